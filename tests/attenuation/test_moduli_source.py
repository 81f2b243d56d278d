"""An estimate by quasi-static moduli has the constants, errors, order and range of the nine units by such moduli."""

import numpy as np
import pytest

from unitcad.attenuation.edge.closed_form import published_path
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.models import COMPARED
from unitcad.attenuation.edge.scoring import leave_one_out_levels
from unitcad.estimate_inputs import estimate_spec
from unitcad.validation import load

SLOW = ["layers.0.wall_mm=1.3", "estimate.moduli=quasi-static"]
PAPER = {"rule": 1.29, "published": 2.05, "baseline": 1.33}
"""The scores by quasi-static moduli that docs/how-to/fit.md prints."""


def leave_one_out(table):
    """Return the factor of the published model with a unit left out, fitted here by means."""
    off = np.log(table.levels) - np.log([np.exp(np.mean(np.log(published_path(one)))) for one in table.inputs])
    errors = [off[i] - np.mean(np.delete(off, i)) for i in range(off.size)]
    return float(np.exp(np.mean(np.abs(errors))))


def test_the_errors_are_those_of_such_moduli():
    data = estimate_spec(load("embedded", SLOW))
    found, errors = data["answer"], data["table_error"]
    for model, factor in PAPER.items():
        told = errors[model]["leave_one_out"]["levels"]["geometric_mean"]
        assert told == pytest.approx(factor, abs=0.006)
    own = leave_one_out(measured_table("quasi-static"))
    assert errors["published"]["leave_one_out"]["levels"]["geometric_mean"] == pytest.approx(own, rel=1e-5)
    assert (data["variant"]["moduli"], errors["moduli"]) == ("quasi-static", "quasi-static")
    assert found["analytic_error"] == pytest.approx(own, rel=1e-5)
    assert found["lines"][2].endswith("It misses a measured unit by a factor of 2.1.")
    assert any(line.startswith("The moduli are those of slow pulls") for line in found["details"])
    dynamic = estimate_spec(load("embedded", SLOW[:1]))
    assert dynamic["answer"]["analytic_error"] == pytest.approx(leave_one_out(measured_table()), rel=1e-5)
    assert not any("slow pulls:" in line for line in dynamic["answer"]["details"])


@pytest.mark.parametrize("name", ["embedded", "three-layer", "single-embedded"])
def test_the_level_does_not_depend_on_the_source(name):
    """A silicone has one place, whichever modulus the analytic model takes."""
    one, other = (
        estimate_spec(load(name, [f"estimate.moduli={moduli}"]))["answer"]
        for moduli in ("small-strain", "quasi-static")
    )
    assert [one[key] for key in ("level", "low", "high")] == [other[key] for key in ("level", "low", "high")]
    assert one["published"]["value"] != other["published"]["value"]


def test_the_level_has_the_constant_fitted_with_such_moduli():
    spec = load("embedded", SLOW[1:])
    table = measured_table("quasi-static")
    path = [np.exp(np.mean(np.log(published_path(one)))) for one in table.inputs]
    s = np.exp(np.mean(np.log(table.levels / path)))
    at = table.names.index("embedded E10/D30")
    level = estimate_spec(spec)["models"]["published"]["edge_level"]["value"]
    assert level == pytest.approx(s * path[at], rel=1e-4)


def test_each_unit_is_predicted_by_constants_fitted_without_it():
    for moduli in ("small-strain", "quasi-static"):
        table = measured_table(moduli)
        own = np.exp(np.mean(np.abs(np.log(table.levels / leave_one_out_levels(COMPARED["published"].levels, table)))))
        assert own == pytest.approx(leave_one_out(table), rel=1e-6)

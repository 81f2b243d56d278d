"""An estimate by quasi-static moduli has the constants, errors, order and range of the nine units by such moduli."""

import numpy as np
import pytest

from unitcad.attenuation.edge.closed_form import published_path
from unitcad.attenuation.edge.measured import measured_table, whole_ratio
from unitcad.attenuation.edge.models import leave_one_out_logs
from unitcad.catalogue import materials
from unitcad.estimate_inputs import estimate_spec
from unitcad.validation import load

SLOW = ["layers.0.wall_mm=1.3", "estimate.moduli=quasi-static"]
PAPER = {"rule": 1.29, "divider": 1.76, "published": 2.02, "baseline": 1.33}
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
    assert errors["published"]["leave_one_out"]["levels"]["geometric_mean"] == pytest.approx(own, rel=1e-6)
    assert (data["variant"]["moduli"], errors["moduli"]) == ("quasi-static", "quasi-static")
    assert found["analytic"]["published"]["leave_one_out"] == pytest.approx(own, rel=1e-6)
    assert "error: factor 2.02; baseline, the means of four classes: 1.33" in found["lines"][1]
    assert any(line.startswith("Moduli of a slow pull") for line in found["details"])
    dynamic = estimate_spec(load("embedded", SLOW[:1]))
    assert dynamic["answer"]["analytic"]["published"]["leave_one_out"] == pytest.approx(
        leave_one_out(measured_table()), rel=1e-6
    )
    assert not any("slow pull" in line for line in dynamic["answer"]["details"])


def test_the_rule_does_not_depend_on_the_source_at_a_measured_unit():
    """Its border counts whole from the least ratio that was measured by such moduli."""
    silicones = materials()
    soft, stiff = (silicones[name].quasistatic_modulus_kpa for name in ("ecoflex-00-10", "dragon-skin-10-medium"))
    assert whole_ratio("quasi-static") == pytest.approx(float(stiff) / float(soft))  # type: ignore[arg-type]
    levels = [
        estimate_spec(load("embedded", [f"estimate.moduli={moduli}"]))["models"]["rule"]["edge_level"]["value"]
        for moduli in ("small-strain", "quasi-static")
    ]
    assert levels[0] == pytest.approx(levels[1], rel=1e-5)


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
        own = np.exp(np.mean(np.abs(leave_one_out_logs("published", table))))
        assert own == pytest.approx(leave_one_out(table), rel=1e-6)

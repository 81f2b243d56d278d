"""The range of a level: against scipy's distributions and Gaussian regression by hand; wider the farther it is."""

import itertools
import math

import numpy as np
import pytest
from msgspec import structs
from scipy import integrate, stats

from unitcad.attenuation.edge.measured import LENGTHS, coordinates_of, measured_table, nearest
from unitcad.attenuation.edge.models import leave_one_out_logs, stored
from unitcad.attenuation.edge.ranges import OF_THE_KIND, Predictive, predictive_of
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load


def unit(design="embedded", *changes):
    return estimate_input(load(design, changes))


def test_a_distribution_is_that_of_its_density_integrated():
    made = Predictive(5, np.array([-1.0, 0.5, np.nan]), np.array([0.2, 1.4, 0.3]), np.array([0.6, 0.1, 0.3]))
    for row, level in ((0, 0.2), (0, 0.9), (1, 0.4), (1, 2.0)):

        def density(x, row=row):
            scale = made.below[row] if x < made.centre[row] else made.above[row]
            return stats.t.pdf((x - made.centre[row]) / scale, 5) / scale

        ends = [-40.0, *sorted({min(made.centre[row], math.log(level)), math.log(level)})]
        share = sum(integrate.quad(density, a, b, limit=200)[0] for a, b in itertools.pairwise(ends))
        assert made.at_most(level)[row] == pytest.approx(share, abs=1e-5)
    for share in (0.1, 0.5, 0.9, 0.999):
        assert made.at_most(made.quantile(share))[:2] == pytest.approx([share, share], abs=1e-9)
    assert np.isnan(made.quantile(0.5)[2])
    assert np.isnan(made.at_most(0.1)[2])


def test_a_measured_unit_has_half_its_residual_and_three_quarters_of_the_variance():
    """Gaussian regression of one unit of its kind: weight 1/2, variance sigma^2 (1 - 1/4)."""
    s, q = stored()["rule"].values()
    off = leave_one_out_logs("rule", measured_table())
    sigma = np.sqrt(np.sum(off**2) / 8)
    found = predictive_of([unit()])
    assert found.centre[0] == pytest.approx(np.log(s * q) + OF_THE_KIND * np.log(0.156 / (s * q)), abs=1e-4)
    assert (found.below[0], found.above[0]) == pytest.approx([sigma * np.sqrt(0.75)] * 2, rel=1e-4)
    assert found.degrees_of_freedom == 7


def test_neighbours_of_a_measured_unit_are_drawn_towards_it():
    """The measured 15.6 %, not the class's 14.5 %; less the farther away."""
    s, q = stored()["rule"].values()
    centres = [
        predictive_of([unit("embedded", "diameter_mm=16", f"layers.0.wall_mm={wall}", f"layers.1.wall_mm={wall}")])
        for wall in (1.25, 1.5, 2.0)
    ]
    at_most, centres = centres[-1].at_most(0.06)[0], [one.centre[0] for one in centres]
    assert centres[0] > centres[1] > centres[2] > np.log(s * q)
    assert at_most < 0.1
    below = unit("embedded", "layers.1.material=dragon-skin-10-medium")
    assert predictive_of([below]).centre[0] < np.log(s * q)


@pytest.mark.parametrize(
    ("changes", "far", "slope"),
    [
        (("diameter_mm=300",), math.log(300 / 14), 1.2),
        (("diameter_mm=20",), math.log(20 / 14), 1.2),
        (("estimate.frequency_hz=300",), math.log(300 / 150), 1.0),
        (("estimate.frequency_hz=110",), 0.0, 0.0),
        (("motor.drive=axial",), 0.0, 0.0),
    ],
)
def test_a_range_widens_with_the_distance_from_what_was_measured(changes, far, slope):
    base, found = predictive_of([unit()]), predictive_of([unit("embedded", *changes)])
    kind = OF_THE_KIND * math.exp(-(far**2) / 2)
    sigma2 = base.below[0] ** 2 / 0.75
    assert found.below[0] ** 2 == pytest.approx(sigma2 * (1 - kind**2) + (slope * far) ** 2, rel=1e-4)


def test_moduli_outside_the_measured_ones_widen_it():
    def width(kpa):
        own = ["materials.own.like=ecoflex-00-10", f"materials.own.youngs_modulus_kpa={kpa}"]
        return float(predictive_of([unit("embedded", *own, "layers.0.material=own")]).below[0])

    assert width(15.0) == pytest.approx(predictive_of([unit()]).below[0], rel=1e-3)
    sigma = float(predictive_of([unit()]).below[0]) / math.sqrt(0.75)
    assert width(1.5) == pytest.approx(math.hypot(sigma, math.log(10)), rel=1e-3)


@pytest.mark.parametrize("share", [0.06, 0.3, 0.5, 0.8, 0.94])
def test_between_equal_moduli_and_the_measured_ratio_a_range_holds_both_ends(share):
    s, q = stored()["rule"].values()
    kpa = 250 / (250 / 15) ** share
    own = ["materials.own.like=ecoflex-00-10", f"materials.own.youngs_modulus_kpa={kpa}"]
    changes = [*own, "layers.0.material=own", "layers.1.material=dragon-skin-10-medium"]
    for design, n in (("embedded", 1), ("encapsulating", 2)):
        low, middle, high = (float(end[0]) for end in predictive_of([unit(design, *changes)]).range)
        assert middle == pytest.approx(s * q ** (n * share), rel=0.06)
        assert low < s * q**n
        assert high > s
    sure = predictive_of([unit("embedded", "layers.1.material=dragon-skin-10-medium")])
    assert sure.quantile(0.9)[0] < s / 2


def test_the_measured_units_lie_at_the_origin_of_the_lengths():
    for design in ("embedded", "encapsulating"):
        assert np.abs(coordinates_of(unit(design))[:LENGTHS]).max() < 1e-4
    single = unit("single-embedded")
    assert np.abs(coordinates_of(single)[:LENGTHS]).max() < 1e-4
    assert nearest(single) == {"unit": "single D10", "level": 0.395, "differs_in": [], "not_read": []}


@pytest.mark.parametrize(
    ("template", "changes", "unit_name", "differs"),
    [
        ("motor-10mm", (), "encapsulating E10/D30", ["diameter", "motor", "height of the cavity", "frequency"]),
        ("embedded", ("layers.0.material=ecoflex-00-30",), "embedded E10/D30", ["silicones"]),
        ("embedded", ("estimate.tissue=rigid-plate",), "embedded E10/D30", ["tissue"]),
        ("encapsulating", ("layers.1.cap_mm=0.8",), "encapsulating E10/D30", ["caps"]),
        (  # stiff inside is not compared with soft inside, however close the moduli are
            "embedded",
            ("layers.0.material=dragon-skin-30", "layers.1.material=dragon-skin-10-medium"),
            "embedded D10/E10",
            ["silicones"],
        ),
        ("three-layer", (), "encapsulating E10/D30", ["number of layers", "silicones", "diameter", "walls", "caps"]),
    ],
)
def test_the_nearest_measured_unit_and_what_differs(template, changes, unit_name, differs):
    found = nearest(unit(template, *changes))
    assert (found["unit"], [*found["differs_in"], *found["not_read"]]) == (unit_name, differs)


def test_a_silicone_without_a_modulus_has_no_range_and_leaves_the_others_alone():
    known = unit("encapsulating")
    without = structs.replace(
        known, layers=(unit("encapsulating", "layers.0.material=ecoflex-00-50").layers[0], known.layers[1])
    )
    found = predictive_of([known, without])
    assert np.isfinite(found.at_most(0.06)[0])
    assert np.isnan(found.at_most(0.06)[1])
    assert found.centre[0] == predictive_of([known]).centre[0]

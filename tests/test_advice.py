"""What is unwise in a spec: the roof over a wide cavity, the ring of air round the motor, leads without a way out."""

import math

import numpy as np
import pytest

from tests.sample_bodies import LEADLESS
from unitcad.catalogue import materials
from unitcad.validation import load, templates, warnings
from unitcad.validation.defaults import MOTOR_G_CM3, roof

ONE = ("single-encapsulating",)


def annulus(outer, inner, rigidity, load_n):
    """The sag of a plate clamped at its outer edge that carries a stiff disc: w = c0 + c1 ln r + c2 r2 + c3 r2 ln r."""
    c3 = load_n / (8 * math.pi * rigidity)
    rows = [
        (1.0, math.log(outer), outer**2),  # no sag at the edge
        (0.0, 1 / outer, 2 * outer),  # no slope there
        (0.0, 1 / inner, 2 * inner),  # none at the disc
    ]
    known = [-c3 * outer**2 * math.log(outer)]
    known += [-c3 * (2 * r * math.log(r) + r) for r in (outer, inner)]
    c0, c1, c2 = np.linalg.solve(rows, known)
    return float(c0 + c1 * math.log(inner) + c2 * inner**2 + c3 * inner**2 * math.log(inner))


@pytest.mark.parametrize("diameter", [14.0, 20.0, 30.0])
def test_a_roof_of_one_silicone_sags_as_a_clamped_plate(diameter):
    spec = load(*ONE, {"diameter_mm": diameter})
    silicone = materials()[spec.layers[0].material]
    thick, outer, inner = spec.layers[0].cap_mm / 1e3, diameter / 2e3 - spec.layers[0].wall_mm / 1e3, 3.5e-3
    young = 1e3 * float(silicone.quasistatic_modulus_kpa)
    rigidity = young * thick**3 / (12 * (1 - float(silicone.poisson_ratio) ** 2))
    kilograms = 1e3 * MOTOR_G_CM3 * math.pi * inner**2 * 2e-3
    hung = annulus(outer, inner, rigidity, 9.80665 * kilograms)
    own = 9.80665 * 1e3 * float(silicone.density_g_cm3) * thick * outer**4 / (64 * rigidity)
    sag, hertz = roof(spec)
    assert sag == pytest.approx(1e3 * (hung + own), rel=1e-9)
    assert hertz == pytest.approx(math.sqrt(9.80665 / hung) / (2 * math.pi), rel=1e-9)


def test_a_cap_cut_in_two_of_one_silicone_changes_nothing():
    layer = "{ material = 'dragon-skin-30', wall_mm = %s, cap_mm = %s }"
    one = load(ONE[0], [f"layers=[{layer % (2.5, 2.5)}]"])
    two = load(ONE[0], [f"layers=[{layer % (1.0, 0.99)}, {layer % (1.5, 1.51)}]"])
    assert roof(two) == pytest.approx(roof(one), rel=1e-9)


def test_a_wide_roof_and_a_wide_ring_are_warned_of_and_a_filled_cavity_is_not():
    """Planted at 30 mm: 25 mm of air with a motor of 7 mm in it. The templates are as they should be."""
    wide = warnings(load("encapsulating", ["diameter_mm=30"]))
    assert [next(words for words in ("caps", "ring") if words in line) for line in wide] == ["caps", "ring"]
    assert "span 25 mm" in wide[0]
    assert "below its 125 Hz" in wide[0]
    assert all("motor.fill = true" in line for line in wide)
    assert len(warnings(load("encapsulating", ["diameter_mm=20"]))) == 1
    assert warnings(load("encapsulating", ["diameter_mm=30", "motor.fill=true"])) == []
    assert not [
        line for name in templates() for line in warnings(load(name)) if line.startswith(("caps of", "the motor hangs"))
    ]


def test_leads_without_a_way_out_are_warned_of_and_the_offer_is_accepted():
    (said,) = warnings(load(LEADLESS))
    assert "[wires] with diameter_mm" in said
    assert warnings(load(LEADLESS, ["wires={ diameter_mm = 0.5 }"])) == []

"""The curve's contact factors against finite elements made here; the suite's figures against the solver itself."""

import math

import numpy as np
import pytest

from benchmarks.accuracy import skin_curve as suite
from unitcad.attenuation.curve import CONTACT, CONTACT_MM, contact, crosstalk_ratio, layered_block
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load


def test_the_curve_and_the_ratio_have_contact_in_their_range():
    variant = estimate_input(load("encapsulating"))
    block = layered_block(variant)["drives"]["flat"]["u"]
    ratio = crosstalk_ratio(variant, variant.diameter / 2 + 20e-3)
    assert [ratio.low, ratio.high] == pytest.approx([block["low"][20], block["high"][20]], rel=2e-3)
    assert block["low"][20] < 0.3 * block["value"][20]
    assert all(
        low <= value <= high for low, value, high in zip(*(block[k] for k in ("low", "value", "high")), strict=True)
    )
    for drive in CONTACT:
        low, high = contact(drive, np.array([*CONTACT_MM, -3.0, 80.0]))
        assert np.all(low <= 1)
        assert np.all(high >= 1)
        assert (low[-2], low[-1]) == (1.0, CONTACT[drive][0][-1])


def test_what_is_left_every_20_mm_is_that_of_the_solver():
    """Of a half-space whose surface wave decays as exp(-a r)/sqrt(r) far out: the fall is exp(-20 mm a)."""
    variant = suite.forearm()
    r = 1e-3 * np.array(suite.FAR_MM)
    found = tissue_medium(variant.tissue).response(UniformDisc(3.5e-3), 2 * math.pi * 50, r, rtol=1e-5)
    size = np.sqrt(abs(found.u_r) ** 2 + abs(found.u_z) ** 2) * np.sqrt(r)
    assert suite.far(variant, 50.0, "axial") == pytest.approx((size[-1] / size[0]) ** (1 / 3), rel=2e-3)


def test_no_body_within_the_sources_holds_both_bands_under_a_flat_motor():
    """What the estimate says beyond 2 cm."""
    shares = suite.bodies_in_range(suite.forearm(), 30)
    assert shares["flat"][0] > 0.2
    assert shares["flat"][1:] == (0.0, 0.0)
    details = layered_block(estimate_input(load("encapsulating")))
    assert "0.80 (0.68 to 0.92) at 75 to 100 Hz" in details["far"]
    assert "far" not in layered_block(estimate_input(load("encapsulating", ["estimate.tissue=gel-50kpa"])))


def test_each_published_number_has_its_caveat():
    rows = list(suite.published(suite.forearm()))
    assert len(rows) == 9
    assert all(one.caveat for one in rows)
    assert [one.holds for one in rows if "75 to 100 Hz" in one.what] == [False, False]
    assert all(one.holds for one in rows if "Shah" in one.what or "Sofia" in one.what)

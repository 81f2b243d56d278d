"""The search over readings of the finite elements: what a fit by choice costs, on levels whose truth is known."""

import numpy as np
import pytest

pytest.importorskip("skfem")

from benchmarks.accuracy.fem_search import (
    AXES,
    drawn_levels,
    one_constant,
    search,
    searches,
    unit_levels,
    unit_spec,
)
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.fem.unit import level
from unitcad.estimate_inputs import estimate_input

MEASURED = measured_table().levels


def test_a_true_hypothesis_wins_without_the_unit_too():
    rng = np.random.default_rng(4)
    levels = np.exp(rng.normal(-1, 1, (300, 9)))
    levels[123] = MEASURED * np.exp(rng.normal(0, 0.05, 9))
    found = search(levels, MEASURED, [str(i) for i in range(300)], 1)
    assert found.what == "123"
    assert 1 < found.best < 1.1
    assert found.nested == pytest.approx(found.best, rel=1e-12)
    assert found.chance < 0.01


def test_noise_that_is_searched_long_enough_fits_and_is_found_out():
    rng = np.random.default_rng(5)
    few, many = (np.exp(rng.normal(-1.3, 1, (n, 9))) for n in (30, 30000))
    short, long = (search(levels, MEASURED, [""] * len(levels), 1, 100) for levels in (few, many))
    assert long.best < short.best
    assert long.nested > 1.3 * long.best
    assert long.chance > 0.05


def test_one_constant_is_fitted_without_the_unit():
    every, out = one_constant(3.0 * MEASURED, MEASURED)
    assert every == pytest.approx(1.0)
    assert out == pytest.approx(1.0)
    off = MEASURED.copy()
    off[0] *= 8
    every, out = one_constant(off, MEASURED)
    assert every == pytest.approx(8 ** (1 / 9))
    assert out == pytest.approx(8 ** (1 / 9))


def test_the_levels_of_the_search_are_those_of_the_estimate():
    found = unit_levels("embedded E10/D30", None, 0.5)
    variant = estimate_input(unit_spec("embedded", "E10/D30"))
    assert found.shape == (2, 2, 3, 2)
    assert found[0, 1, 1, 0] == level(variant, 125.0, "flat", "edge", None, 0.5)
    assert found[1, 0, 0, 0] == level(variant, 125.0, "axial", "skin", None, 0.5)


def test_a_search_names_its_hypothesis():
    levels = np.array(list(drawn_levels(3, 2, 0.5)))
    assert levels.shape == (2, 9, 2, 2, 3, 2)
    assert len(AXES) == levels.ndim - 2
    found = searches(levels, 1)
    assert found["skin, either drive"].count == 2 * found["skin, flat"].count == 24
    best = found["edge, flat"]
    draw, drive, component, over = best.what.split(", ")
    where = 0, 1, ("normal", "radial", "total").index(component), ("over motor", "over free").index(over)
    assert drive == "flat"
    taken = levels[int(draw.split()[1]), :, where[0], where[1], where[2], where[3]]
    assert best.best == pytest.approx(np.exp(np.abs(np.log(taken / MEASURED)).mean()))

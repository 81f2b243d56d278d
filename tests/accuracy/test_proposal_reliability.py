"""The suite that judges proposals: a unit left out is not in its own prediction; planted faults break promises."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import beta

from benchmarks.accuracy import proposal_reliability as suite
from unitcad.attenuation.edge.measured import measured_table


def test_a_units_own_level_does_not_enter_its_prediction():
    table = measured_table()
    before = suite.leave_one_out("rule", table)
    for i in (0, 4):
        levels = table.levels.copy()
        levels[i] *= 3.0
        changed = suite.leave_one_out("rule", replace(table, levels=levels))
        assert changed[i].met == before[i].met
        assert (changed[i].low, changed[i].high) == (before[i].low, before[i].high)
        assert changed[1].met != before[1].met


def test_a_table_without_a_unit_has_the_others_in_their_order():
    table = measured_table()
    left = table.without(3)
    assert left.names == (*table.names[:3], *table.names[4:])
    assert left.levels.tolist() == [*table.levels[:3], *table.levels[4:]]
    assert len(left.inputs) == len(left.layers) == len(left.designs) == 8


def test_intervals_are_those_of_clopper_and_pearson():
    low, high = suite.interval(6, 9)
    assert low == pytest.approx(beta.ppf(0.025, 6, 4))
    assert high == pytest.approx(beta.ppf(0.975, 7, 3))


def _of(levels, shift):
    made = []
    for level in levels:
        middle = level * np.exp(shift)
        met = tuple(float(middle <= limit) for limit in suite.LEVELS)
        made.append(suite.Judged("", level, middle / 1.5, middle, middle * 1.5, 0.5, met))
    return made


def test_the_promises_fail_for_ranges_that_miss_and_probabilities_that_say_nothing():
    levels = measured_table().levels.tolist()
    right, wrong = _of(levels, 0.0), _of(levels, 2.0)
    assert suite._miss(right) == 0.0
    assert suite._miss(wrong) > 0.1
    assert suite.score(right) < 0.1
    assert suite.score(wrong) > 1.0
    p, met = suite.pairs(right)
    assert p.size == met.size == 9 * len(suite.LEVELS)

"""The displacement beside FFTLog: each error has the first setting that reaches it, FFTLog the best of its ranges."""

import numpy as np

from benchmarks.accuracy import hankel_frontier
from benchmarks.accuracy.hankel import RADII, beside_fftlog, brute_force, cases
from benchmarks.accuracy.hankel_frontier import Best


def test_fftlog_has_the_range_and_bias_that_come_nearest(monkeypatch):
    """With the range and bias of the other table 128 points are 80 times as far off."""
    case = cases()[0]
    exact = brute_force(case)
    monkeypatch.setattr(hankel_frontier, "_POINTS", (64, 128))
    monkeypatch.setattr(hankel_frontier, "_FIRST", (1e-4, 1e-2, 0.1))
    monkeypatch.setattr(hankel_frontier, "_LAST", (1e4, 1e5))
    monkeypatch.setattr(hankel_frontier, "_BIASES", (-0.25, 0.0))
    few, many = hankel_frontier.by_fftlog(case.remainder, case.known, RADII, exact)
    assert many.error < few.error < 1e-2
    assert many.error < 2e-4
    assert np.max(np.abs(many.solve() - exact)) == many.error * np.max(np.abs(exact))
    monkeypatch.setattr(hankel_frontier, "TARGETS", (1e-3, 1e-12))
    found = beside_fftlog(case, exact, repeats=1)
    assert [row[0] for row in found.rows] == [1e-3, 1e-12]
    assert found.rows[0][1].startswith("128 points")
    assert found.rows[0][3] == "rtol 0.1"
    assert found.rows[0][5] > 0
    assert found.rows[0][6].endswith("s")
    assert found.rows[1][1:] == (None,) * 6


def test_the_first_setting_that_reaches_an_error_is_taken(monkeypatch):
    monkeypatch.setattr(hankel_frontier, "TARGETS", (1e-3,))
    settings = [Best(name, error, lambda: np.zeros(1)) for name, error in (("a", 2e-3), ("b", 5e-4), ("c", 1e-9))]
    (row,) = hankel_frontier.table("damped", settings, settings[2:], 1).rows
    assert (row[3], row[1]) == ("b", "c")

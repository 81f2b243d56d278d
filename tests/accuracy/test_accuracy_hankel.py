"""The response's error estimate against a brute-force path of another shape: a bound down to its finest tolerance."""

import numpy as np
import pytest

from benchmarks.accuracy import hankel_peers
from benchmarks.accuracy.hankel import RADII, brute_force, cases, second_path


def test_the_reference_does_not_hang_on_its_own_path():
    case = cases()[1]
    one, other = brute_force(case), second_path(case)
    assert np.max(np.abs(one - other)) < 1e-12 * np.max(np.abs(one))


Z = 5e-3


def _exponential(k):
    """Its transform is 1 / sqrt(r^2 + z^2)."""
    return np.exp(-k * Z) + 0j


def _off(found):
    return np.max(np.abs(found * np.hypot(RADII, Z) - 1))


@pytest.mark.parametrize(("n", "limit"), [(256, 5e-6), (1024, 2e-8), (4096, 1e-9), (16384, 1e-9)])
def test_fftlog_gains_digits_with_points(n, limit):
    """Without a bias, from k = 0.1 and linear in log r it lost them: 6e-4 at 256 points, 0.15 at 4,096."""
    assert _off(hankel_peers.logarithmic(_exponential, RADII, n)) < limit


def test_the_other_ways_do_a_known_transform():
    for lifted in (False, True):
        value, error = hankel_peers.adaptive(_exponential, RADII, 1e-6, lifted)
        assert np.max(np.abs(value - 1 / np.hypot(RADII, Z))) < error < 1e-6
    assert _off(hankel_peers.uniform(_exponential, RADII, 30000)) < 1e-5
    pytest.importorskip("libdlf")
    assert _off(hankel_peers.filtered(_exponential, RADII, "anderson_801_1982")) < 1e-8

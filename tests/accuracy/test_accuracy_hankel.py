"""The response's error estimate against a brute-force path of another shape: a bound down to its finest tolerance."""

import numpy as np
import pytest

from unitcad.accuracy.hankel import DISC, OMEGA, RADII, brute_force, cases


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_the_error_is_below_its_estimate_and_the_tolerance(case):
    """Before the panels were graded towards k = 0, bone's branch points cost 2.6e-11 at an estimate of 4e-12."""
    exact = brute_force(case)
    scale = np.max(np.abs(exact))
    for rtol in (1e-5, 1e-9, 1e-11):
        found = case.medium.response(DISC, OMEGA, RADII, rtol=rtol)
        error = np.max(np.abs(found.u_z - exact))
        assert error <= found.error
        assert error <= rtol * scale


def test_the_reference_does_not_hang_on_its_own_path():
    case = cases()[1]
    one, other = brute_force(case), brute_force(case, end=6e5, poles=9000.0, height=25.0)
    assert np.max(np.abs(one - other)) < 1e-12 * np.max(np.abs(one))

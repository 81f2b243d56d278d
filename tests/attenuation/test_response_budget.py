"""A film far thinner than the disc takes more wavenumbers than are spent: what is left must go where the error is."""

import numpy as np
import pytest

from unitcad.attenuation.loads import UniformDisc
from unitcad.attenuation.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.rheology import LossFactor

R = np.array([0.5e-3, 30e-3])


@pytest.fixture(scope="module")
def film():
    """6.3 nm on a stiff plate on gel: its kernel falls off beyond k = 1e8 only."""
    layers = [Layer(6.3e-9, 1000, 36.7e6, 0.0, LossFactor(0.2)), Layer(1.97e-3, 1000, 3e9, 0.5)]
    medium = LayeredMedium(layers, HalfSpace(1000, 174e3, 0.5))
    return {rtol: medium.response(UniformDisc(3.5e-3), 785.0, R, rtol=rtol) for rtol in (1e-6, 1e-8, 1e-12)}


def test_a_smaller_rtol_does_not_make_it_worse(film):
    """All panels used to go into the tail: an estimate of 5.7e-7 at rtol 1e-6, of 1.8e-3 at 1e-8."""
    errors = {rtol: found.error / np.max(np.abs(found.u_z)) for rtol, found in film.items()}
    assert errors[1e-6] < 1e-6
    assert errors[1e-8] < 1.5 * errors[1e-6]
    assert errors[1e-12] < 1.5 * errors[1e-8]


def test_the_estimates_cover_what_the_tolerances_differ_by(film):
    best = film[1e-12]
    for rtol in (1e-6, 1e-8):
        gap = max(np.max(np.abs(film[rtol].u_z - best.u_z)), np.max(np.abs(film[rtol].u_r - best.u_r)))
        assert gap <= film[rtol].error + best.error


def test_panels_are_not_wasted(film):
    for found in film.values():
        assert found.wavenumbers < 1.1 * 60_000 * 16

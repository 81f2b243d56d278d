"""A film far thinner than the disc takes more wavenumbers than are spent: what is left must go where the error is."""

import numpy as np
import pytest

from benchmarks.accuracy.hankel import DISC, RADII, cases
from unitcad.accuracy.random_media import trial
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import LossFactor, UniformDisc

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


def test_panels_are_not_wasted(film):
    for found in film.values():
        assert found.wavenumbers < 3 * 1.1 * 40_000 * 16


def test_the_forearm_takes_few_wavenumbers():
    """386 at rtol 1e-3 with panels of a factor of two next to 0, 466 when those beyond the last wave were short too."""
    case = cases()[0]
    found = {rtol: case.medium.response(DISC, case.omega, RADII, rtol=rtol) for rtol in (1e-3, 1e-9)}
    assert found[1e-3].wavenumbers < 320
    off = np.max(np.abs(found[1e-3].u_z - found[1e-9].u_z))
    assert off <= found[1e-3].error + found[1e-9].error <= 1e-3 * found[1e-3].largest


@pytest.mark.parametrize("seed", [9104, 9116, 9121])
def test_a_looser_rtol_takes_no_more_wavenumbers(seed):
    """33264 at rtol 1e-3, 6368 at 1e-4: on a film the half-space that was taken out was chosen by a guess of |u|."""
    one = trial("large k a", seed)
    responses = [one.medium.response(one.load, one.omega, one.r, rtol=rtol) for rtol in (1e-2, 1e-3, 1e-4)]
    counts = [response.wavenumbers for response in responses]
    assert sorted(counts) == counts

"""The radial disc's transform against arbitrary precision."""

import mpmath as mp
import numpy as np

from unitcad.attenuation.layered import UniformDisc

RADIAL = UniformDisc(1e-3, "radial")


def _exact(x):
    """Integral of t J1(x t) from 0 to 1 as a hypergeometric function."""
    with mp.workdps(60):
        at = mp.mpmathify(x)
        return complex(at / 6 * mp.hyp1f2(1.5, 2, 2.5, -at * at / 4))


def _envelope(x):
    """Of the transform, times 1 + |x|: rounding of x turns the phase by that many 1e-16."""
    size = np.abs(x)
    return np.minimum(size / 6, 0.5 * size**-1.5 + size**-2) * np.exp(np.abs(x.imag)) * (1 + size)


def _points():
    rng = np.random.default_rng(5)
    real = np.concatenate([10 ** rng.uniform(-8, 4, 100), rng.uniform(0.5, 60, 100), [1.0, 25.76536, 40.0]])
    lifted = rng.uniform(0.1, 80, 80) + 1j * rng.uniform(0, 3, 80)
    first_leg = 10 ** rng.uniform(-8, 1.7, 80) * np.exp(0.25j * np.pi)
    return np.concatenate([real, lifted, first_leg])


def test_transform_in_arbitrary_precision():
    x = _points()
    real = x.imag == 0
    found = np.where(real, RADIAL.transform(x.real * 1e3), RADIAL.transform(x * 1e3)) * 1e6
    off = np.abs(found - [_exact(complex(one)) for one in x]) / _envelope(x)
    assert np.max(off) < 2e-15

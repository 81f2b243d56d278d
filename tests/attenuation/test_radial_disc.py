"""The radial disc's transform against arbitrary precision; it costs no more than the pressure's."""

import time

import mpmath as mp
import numpy as np
import pytest

from unitcad.attenuation.layered import HalfSpace, LayeredMedium, UniformDisc

NORMAL, RADIAL = UniformDisc(1e-3), UniformDisc(1e-3, "radial")


def _exact(x: complex) -> complex:
    """Integral of t J1(x t) from 0 to 1 as a hypergeometric function."""
    with mp.workdps(60):
        at = mp.mpmathify(x)
        return complex(at / 6 * mp.hyp1f2(1.5, 2, 2.5, -at * at / 4))


def _envelope(x: np.ndarray) -> np.ndarray:
    """Of the transform, times 1 + |x|: rounding of x turns the phase by that many 1e-16."""
    size = np.abs(x)
    return np.minimum(size / 6, 0.5 * size**-1.5 + size**-2) * np.exp(np.abs(x.imag)) * (1 + size)


def _points() -> np.ndarray:
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


def test_transform_where_scipys_struve_function_is_no_number():
    k = np.linspace(25765.35, 25765.38, 301)
    found = RADIAL.transform(k)
    assert np.all(np.isfinite(found))
    assert RADIAL.transform(25765.36) * 1e6 == pytest.approx(_exact(25.76536).real, rel=1e-12)


def test_static_displacement_far_from_a_radial_disc():
    """Far away a radial disc is the dipole of its moment: the integral of J1(kr) q(k) dk is a^3 / (6 r^2) (1 + ...)."""
    far = np.array([1e2, 1e4, 1e6]) * 1e-3
    along, _ = RADIAL.static(far)
    s = far / 1e-3
    assert along == pytest.approx(1e-3 / (6 * s**2) * (1 + 9 / (40 * s**2)), rel=1e-9)


def test_static_displacement_does_not_jump_at_the_rim():
    inside, rim, outside = RADIAL.static(np.array([1 - 1e-9, 1.0, 1 + 1e-9]) * 1e-3)[0]
    assert rim == pytest.approx(1e-3 * 2 / np.pi * (0.915965594177219015 - 0.5), rel=1e-13)
    assert inside == pytest.approx(rim, rel=1e-7)
    assert outside == pytest.approx(rim, rel=1e-7)


def test_a_radial_disc_costs_about_as_much_as_a_pressure():
    """10 mm on 10 kPa at 20 kHz: the transform took a rule of 0.7 k a nodes at every wavenumber, 200 times as long."""
    medium = LayeredMedium([], HalfSpace(1000, 1e4, 0.49))
    seconds, wavenumbers = {}, {}
    for direction in ("normal", "radial"):
        load, spent = UniformDisc(10e-3, direction), []
        for _ in range(3):
            start = time.process_time()
            found = medium.response(load, 2 * np.pi * 20e3, [1e-3, 10e-3, 30e-3], rtol=0.1)
            spent.append(time.process_time() - start)
        seconds[direction], wavenumbers[direction] = min(spent), found.wavenumbers
    assert wavenumbers["radial"] < 2 * wavenumbers["normal"]
    assert seconds["radial"] < 5 * seconds["normal"]

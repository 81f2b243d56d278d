"""The bound of an amplitude against sums, integrals and matrices that share no code with it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_circulant

from benchmarks.accuracy import cramer_rao
from benchmarks.accuracy.cramer_rao import amplitude_bound
from benchmarks.accuracy.synthetic_records import PLAIN, SCENARIOS

TIME = np.arange(4000) / 2000


def test_white_noise_has_the_textbooks_bound():
    """2/n over the squared signal-to-noise ratio, far from all other lines."""
    assert amplitude_bound(PLAIN, 127.0) == pytest.approx(np.sqrt(2 / 4000) / 30, rel=2e-3)


@pytest.mark.parametrize("hz", [100.05, 100.27, 100.6, 127.0, 149.9])
def test_mains_beside_the_line_raise_the_bound(hz):
    """Derivatives by differences of a record's formula, the mains' prior as two more observations."""
    part, snr = 0.03, 30.0

    def model(p):
        size, phase, frequency, cosine, sine, offset, slope, *harmonics = p
        angle = 2 * np.pi * frequency * TIME + phase
        mains = 2 * np.pi * 50 * round(hz / 50) * TIME
        over = sum(
            harmonics[2 * i] * np.cos(k * angle) + harmonics[2 * i + 1] * np.sin(k * angle)
            for i, k in enumerate((2, 3))
        )
        return size * np.cos(angle) + cosine * np.cos(mains) + sine * np.sin(mains) + offset + slope * TIME + over

    at = np.array([1.0, 0.3, hz, 0, 0, 0, 0, 0, 0, 0, 0])
    columns = [(model(at + 1e-5 * unit) - model(at - 1e-5 * unit)) / 2e-5 for unit in np.eye(len(at))]
    rows = np.concatenate([np.array(columns).T * snr, np.eye(len(at))[[3, 4]] * np.sqrt(2) / part])
    expected = np.sqrt(np.linalg.inv(rows.T @ rows)[0, 0])
    mains = (0.0, part, part)
    scenario = replace(PLAIN, mains=mains)
    assert amplitude_bound(scenario, hz) == pytest.approx(expected, rel=0.01)


def test_the_bound_in_coloured_noise_is_that_of_its_covariance():
    """By the inverse of the noise's circulant covariance, whose first column is the spectrum's inverse transform."""
    scenario = next(one for one in SCENARIOS if one.red)
    columns = np.array([np.cos(2 * np.pi * 125.3 * TIME), np.sin(2 * np.pi * 125.3 * TIME), TIME - 1])
    shape = 1 / np.sqrt(np.maximum(np.arange(2001), 1))
    shape /= np.sqrt(np.mean(shape[1:] ** 2)) * scenario.snr
    first = np.fft.irfft(shape**2, 4000)
    expected = columns @ solve_circulant(first, columns.T)
    found = cramer_rao._in_coloured_noise(columns, scenario)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()

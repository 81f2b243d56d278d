"""The standard uncertainty of a line's amplitude, from what its fit leaves."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats

NEAR_HZ = 15.0
"""To either side of the line, where the noise's density is taken."""
BLOCK_S = 0.2
LEAST_BLOCKS = 6


def noise(residual: Floats, good: Bools, rate: float) -> float:
    """Return the standard deviation of the amplitude that the noise beside the line gives.

    `residual` (n) is what the fit leaves, turned back by the line's phase and 0 where a sample was left out. The noise
    N of the sum over n samples has the mean square of the sums at neighbouring frequencies; the amplitude is 2/n times
    its real part.
    """
    count, used = len(residual), int(good.sum())
    power = np.abs(np.fft.fft(residual)) ** 2
    away = np.abs(np.fft.fftfreq(count, 1 / rate))
    least = 2 * rate / count
    beside = (away > least) & (away < max(NEAR_HZ, 12 * least))
    if not beside.any():
        beside = away > 0
    values = power[beside]
    density = float(np.median(values)) / np.log(2) if len(values) >= 20 else float(values.mean())
    density = max(density, min(float(values.mean()), 1.5 * density))
    return float(np.sqrt(2 * density / used) / np.sqrt(used))


def blocks(value: complex, residual: Floats, good: Bools, rate: float) -> Floats:
    """Return the line's complex amplitude in equal blocks: the whole record's and the mean of what is left there."""
    return blocks_of(value, residual, good, rate, BLOCK_S)[0]


def blocks_of(value: complex, residual: Floats, good: Bools, rate: float, length_s: float) -> tuple[Floats, Floats]:
    """Return the line's complex amplitude in blocks of about `length_s`, and how many good samples each has."""
    count = max(round(len(residual) / rate / length_s), LEAST_BLOCKS)
    edges = np.linspace(0, len(residual), count + 1).astype(int)
    sums = np.add.reduceat(residual, edges[:-1])
    weight = np.add.reduceat(good.astype(float), edges[:-1])
    return value + 2 * sums / np.maximum(weight, 1), weight


def of_mean(values: Floats, noise_variance: float) -> tuple[float, float]:
    """Return the standard uncertainty of the mean of successive values beyond their noise, and their own deviation.

    The correlation of neighbours makes fewer of them independent; its estimate is too small in short series by about
    (1 + 3 r)/n (Kendall 1954). Few values make the deviation uncertain: it is widened as Student's t is.
    """
    from scipy.stats import t as student

    count = len(values)
    left = values - values.mean()
    total = float(left @ left)
    variance = total / (count - 1)
    slow = variance - noise_variance
    if slow <= 0 or total <= 0:
        return 0.0, float(np.sqrt(variance))
    found = float(left[1:] @ left[:-1]) / total
    correlation = min(max(found + (1 + 3 * max(found, 0.0)) / count, 0.0), 0.9)
    independent = max(count * (1 - correlation) / (1 + correlation), 2.0)
    widened = float(student.ppf(0.97725, max(independent - 1, 1.5))) / 2
    return float(np.sqrt(slow / independent) * widened), float(np.sqrt(variance))

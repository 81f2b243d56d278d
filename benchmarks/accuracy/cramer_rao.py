"""The Cramer-Rao bound of a record's amplitude: Fisher information of the whole model, nuisances and all.

Unknown are the line's amplitude, phase and frequency, its harmonics, an offset and a slope, and the phase of the mains,
whose amplitude a motor-off record tells: a prior, so that the bound is Bayesian (Van Trees 1968). So is the amplitude's
wander about its mean, in cosines. Of a sample that is cut off only the side is known, which leaves less information.
"""

from __future__ import annotations

import numpy as np

from benchmarks.accuracy.synthetic_records import LENGTH_S, RATE, Scenario
from unitcad.geometry.arrays import Floats

WAVES = 24
WANDER_S = 0.3
SPIN_UP_END = 0.01


def amplitude_bound(scenario: Scenario, frequency_hz: float, phase: float = 0.3) -> float:
    """Return the least standard deviation of an estimate of a record's amplitude, over the amplitude."""
    count = round(RATE * LENGTH_S)
    time = np.arange(count) / RATE
    running = np.ones(count, bool)
    if scenario.spin_up_s:
        running = time > -scenario.spin_up_s * np.log(SPIN_UP_END)
    at = 2 * time / LENGTH_S - 1
    angle = 2 * np.pi * frequency_hz * (time + scenario.drift * (time**2 / LENGTH_S - time) / 2) + phase
    free = [np.cos(angle), -np.sin(angle), -at * np.sin(angle)]
    free += [-(at**2) * np.sin(angle)] * bool(scenario.drift)
    free += [wave(k * angle) for k in (2, 3) for wave in (np.cos, np.sin)] + [np.ones(count), at]
    known: list[tuple[Floats, float]] = []
    for order, part in enumerate(scenario.mains, 1):
        turn = 2 * np.pi * 50.0 * order * time
        known += [(wave(turn), part**2 / 2) for wave in (np.cos, np.sin)] * bool(part)
    if scenario.wander:
        start, length = time[running][0], np.ptp(time[running])
        for k in range(1, WAVES + 1):
            density = 2 * WANDER_S / (1 + (np.pi * k / length * WANDER_S) ** 2)
            wave = np.sqrt(2) * np.cos(np.pi * k * (time - start) / length)
            known.append((wave * np.cos(angle), scenario.wander**2 * density / length))
    columns = np.array([*free, *(column for column, _ in known)])
    information = _information(columns, scenario, angle, running)
    prior = np.concatenate([np.zeros(len(free)), [1 / variance for _, variance in known]])
    return float(np.sqrt(np.linalg.inv(information + np.diag(prior))[0, 0]))


def _information(columns: Floats, scenario: Scenario, angle: Floats, running: np.ndarray) -> Floats:
    """Return the Fisher information (k, k) of samples whose mean has the derivatives `columns` (k, n)."""
    if scenario.red:
        return _in_coloured_noise(columns, scenario)
    weight = running * scenario.snr**2
    if scenario.clip:
        weight = weight * _left_by_clipping(np.cos(angle), scenario.clip, 1 / scenario.snr)
    return (columns * weight) @ columns.T


def _left_by_clipping(mean: Floats, limit: float, deviation: float) -> Floats:
    """Return the part of a sample's information on its mean that is left where it is cut off beyond +- limit."""
    from scipy.stats import norm

    low, high = (-limit - mean) / deviation, (limit - mean) / deviation
    inside = norm.cdf(high) - high * norm.pdf(high) - norm.cdf(low) + low * norm.pdf(low)
    # the square of the density over the probability of either side, without a quotient of two zeros
    above = np.exp(2 * norm.logpdf(high) - norm.logsf(high))
    below = np.exp(2 * norm.logpdf(low) - norm.logcdf(low))
    return inside + above + below


def _in_coloured_noise(columns: Floats, scenario: Scenario) -> Floats:
    """Return the information in the noise of the synthetic records, whose spectrum is known: a sum over its bins."""
    count = columns.shape[1]
    bins = np.arange(count // 2 + 1)
    shape = 1 / np.sqrt(np.maximum(bins, 1))
    shape = (1 - scenario.red) + scenario.red * shape / np.sqrt(np.mean(shape[1:] ** 2))
    waves = np.fft.rfft(columns, axis=1)
    both = np.where((bins == 0) | (bins == count // 2), 1.0, 2.0)
    return np.real((waves * both / (shape / scenario.snr) ** 2) @ waves.conj().T) / count

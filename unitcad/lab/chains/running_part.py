"""The part of a record in which a motor runs, where it is silent for so long that medians are of the silence."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats
from unitcad.lab.chains.demodulation import WINDOW_S, coarse_frequency, envelope

MOST_RUNNING = 0.65
"""Part of a record up to which the running part is fitted alone: beyond, medians of all samples are of the line."""
ON = 0.5
"""Part of the envelope's largest value from which the motor runs."""
SILENT = 0.2
"""Part of it below which the envelope stays in the silence, once it has had FALL_S to fall; a beat falls slowly."""
QUIET = 0.4
"""The same for what the silence holds beside the mains: a line that has only changed its frequency is louder."""
LOWEST_HZ = 20.0
FALL_S = 0.75 * WINDOW_S
"""How long the envelope of a line that ends takes to fall, with a margin."""
LEAST_SILENT = 0.2
"""Part of a record that is silent at least."""
LOUDEST, BEYOND_LOUDEST = 0.92, 1.5
"""Quantile of the samples' size, and how many times it a sample counts at most: drop-outs are no motion."""


def running_part(
    x: Floats, good: Bools, rate: float, band: tuple[float, float], mains_hz: float
) -> tuple[int, int] | None:
    """Return the first sample of the longest stretch in which the line of a record runs, and the one after its last.

    `x` has no offset; samples that are not `good` count for nothing. None where the line runs for most of the record,
    or the rest is not silent.
    """
    most = BEYOND_LOUDEST * float(np.quantile(np.abs(x[good]), LOUDEST))
    x = np.clip(np.where(good, x, 0.0), -most, most)
    frequency = coarse_frequency(x, rate, band, mains_hz)
    if not frequency > 0:
        return None
    time, line = envelope(x, good, rate, frequency)
    if len(time) < 4:
        return None
    size = np.abs(line)
    on = size >= ON * size.max()
    if on.mean() > MOST_RUNNING:
        return None
    near = np.zeros(len(on), bool)
    for first, last in _runs(on):
        near |= (time >= time[first] - FALL_S) & (time <= time[last] + FALL_S)
    if (~near).mean() < LEAST_SILENT or size[~near].max() > SILENT * size.max():
        return None
    first, last = max(_runs(~near), key=lambda run: run[1] - run[0])
    silence = x[int(time[first] * rate) : int(time[last] * rate) + 1]
    if _loudest(silence, rate, band, mains_hz) > QUIET * size.max():
        return None
    first, last = max(_runs(on), key=lambda run: run[1] - run[0])
    start = 0 if first == 0 else int(time[first] * rate)
    return start, len(x) if last == len(on) - 1 else int(time[last] * rate) + 1


def _runs(on: Bools) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def _loudest(x: Floats, rate: float, band: tuple[float, float], mains_hz: float) -> float:
    """Return the amplitude of a line with all power of samples in a band, or of the strongest line outside, if more.

    The mains and what is slower than LOWEST_HZ are left out.
    """
    if len(x) < 16:
        return 0.0
    window = np.hanning(len(x) + 2)[1:-1]
    turned = np.abs(np.fft.rfft((x - x.mean()) * window))
    hertz = np.fft.rfftfreq(len(x), 1 / rate)
    own = np.abs(hertz - mains_hz * np.round(hertz / mains_hz)) > 2 * rate / len(x)
    inside = own & (hertz >= band[0]) & (hertz <= band[1])
    whole = 2 * float(np.sqrt(np.sum(turned[inside] ** 2) / (len(x) * np.sum(window**2))))
    strongest = 2 * float(turned[own & (hertz > LOWEST_HZ)].max(initial=0.0)) / window.sum()
    return max(whole, strongest)

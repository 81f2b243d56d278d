"""Signals that are cut off at a level, by their converter or by the range that was set."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats

NEAR = 0.02
"""Part of the peak below it in which samples are counted."""
LOWEST = 0.7
"""Part of the amplitude down to which a cut-off sine can be fitted by the rest."""
CROWD = 0.13
"""Part of the samples within NEAR of a peak beyond which it is a plateau: twice what a sine has there."""
LEAST_VALUES = 8
"""Different values below which a channel shows its converter's steps and no motion that a limit could cut off."""


def clip_mask(x: Floats, good: Bools, full_scale: tuple[float, float] | None = None) -> tuple[Bools, float, float]:
    """Return the samples of a record about zero that lie on a plateau, the lowest plateau's height, and its part.

    One plateau is enough. The part is of the amplitude that a sine would have which is cut off as often, 0 where that
    is half of the time or more; without a plateau both are infinite.
    `full_scale` is the height of the positive and the negative limit, where they are known.
    """
    cut, level, part = np.zeros(len(x), bool), float("inf"), float("inf")
    low, high = np.quantile(x[good], [0.05, 0.95])
    fine = len(np.unique(x[good])) >= LEAST_VALUES
    for sign, limit in zip((1.0, -1.0), full_scale or (None, None), strict=True):
        signed = sign * x
        peak = float(signed[good].max())
        below = NEAR * peak
        if 4 * peak <= high - low:  # cut off near the middle: the median is on the plateau, the band one of the range
            if high <= low:
                continue
            below = NEAR * (high - low) / 2
        elif peak <= 0:
            continue
        near = good & (signed >= peak - below)
        at_limit = limit is not None and peak >= 0.999 * limit
        if at_limit or (fine and (near.sum() > CROWD * good.sum() or (peak > 0 and _repeats(signed[good], peak)))):
            cut |= near
            level = min(level, peak)
            part = min(part, max(float(np.cos(np.pi * near.sum() / good.sum())) / (1 - NEAR), 0.0))
    return cut, level, part


def _repeats(x: Floats, peak: float) -> bool:
    """Tell whether the largest value comes more often than the resolution of the samples explains for a sine."""
    at_peak = np.count_nonzero(x == peak)
    if at_peak < max(8, 0.01 * len(x)):
        return False
    steps = np.diff(np.unique(x[x > 0.5 * peak]))
    step = float(np.median(steps)) if len(steps) else peak
    return at_peak > len(x) * (0.01 + 2 * np.arccos(max(1 - step / peak, -1.0)) / np.pi)

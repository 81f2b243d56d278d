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


def clip_mask(x: Floats, good: Bools, full_scale: tuple[float, float] | None = None) -> tuple[Bools, float, float]:
    """Return the samples of a record about zero that lie on a plateau, the lowest plateau's height, and its part.

    The part is of the amplitude that a sine would have which is cut off as often; without a plateau both are infinite.
    `full_scale` is the height of the positive and the negative limit, where they are known.
    """
    cut, level, part = np.zeros(len(x), bool), float("inf"), float("inf")
    for sign, limit in zip((1.0, -1.0), full_scale or (None, None), strict=True):
        signed = sign * x
        peak = float(signed[good].max())
        if peak <= 0:
            continue
        near = good & (signed >= (1 - NEAR) * peak)
        at_limit = limit is not None and peak >= 0.999 * limit
        if near.sum() > CROWD * good.sum() or _repeats(signed[good], peak) or at_limit:
            cut |= near
            level = min(level, peak)
            part = min(part, float(np.cos(np.pi * min(near.sum() / good.sum(), 0.5))) / (1 - NEAR))
    return cut, level, part


def _repeats(x: Floats, peak: float) -> bool:
    """Tell whether the largest value comes more often than the resolution of the samples explains for a sine."""
    at_peak = np.count_nonzero(x == peak)
    if at_peak < max(8, 0.01 * len(x)):
        return False
    steps = np.diff(np.unique(x[x > 0.5 * peak]))
    step = float(np.median(steps)) if len(steps) else peak
    return at_peak > len(x) * (0.01 + 2 * np.arccos(max(1 - step / peak, -1.0)) / np.pi)

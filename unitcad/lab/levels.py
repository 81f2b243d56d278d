"""Levels: amplitudes over the motor's, from repeats, with an interval of 95 %.

The mean of ratios with their standard deviation covers the truth too rarely: ratios are skewed, and three repeats say
little of their own scatter. So logarithms are averaged, and Student's t widens the interval for the few repeats.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from unitcad.errors import Refusal

COVERAGE = 0.95
LEAST_REPEATS = 3


@dataclass(frozen=True)
class Level:
    """A level with the ends of its interval of 95 %, the repeats above and below the line, and degrees of freedom.

    `scatter` is the standard deviation of the repeats' logarithms, the larger of both sides'.
    """

    value: float
    low: float
    high: float
    repeats: tuple[int, int]
    freedom: float
    scatter: float


def level(amplitudes: Sequence[float], references: Sequence[float], shared: float = 0.0) -> Level:
    """Return the level of repeated amplitudes over repeated amplitudes of the motor, measured apart.

    The two scatters may differ (Welch 1947, Satterthwaite 1946). `shared` is a relative standard uncertainty that all
    repeats have in common. Raises Refusal for fewer than three repeats of either.
    """
    above, below = _side("points", amplitudes), _side("reference", references)
    parts = [variance / count for _, variance, count in (above, below)]
    total = sum(parts)
    weights = sum(part**2 / (count - 1) for part, (_, _, count) in zip(parts, (above, below), strict=True))
    freedom = total**2 / weights if weights > 0 else float(above[2] + below[2] - 2)
    return _interval(above[0] - below[0], total, freedom, shared, (above, below))


def paired_level(ratios: Sequence[float], shared: float = 0.0) -> Level:
    """Return the level of repeated ratios to a motor that was recorded at the same time; else as `level`."""
    side = _side("points", ratios)
    return _interval(side[0], side[1] / side[2], side[2] - 1.0, shared, (side, side))


def _side(field: str, values: Sequence[float]) -> tuple[float, float, int]:
    """Return mean and variance of the logarithms, and their count."""
    if len(values) < LEAST_REPEATS:
        limit = f"has {len(values)} usable repeats; a level needs {LEAST_REPEATS} or more"
        raise Refusal(field, None, limit)
    logs = [math.log(value) for value in values]
    mean = math.fsum(logs) / len(logs)
    return mean, math.fsum((one - mean) ** 2 for one in logs) / (len(logs) - 1), len(logs)


def _interval(
    log: float, variance: float, freedom: float, shared: float, sides: tuple[tuple[float, float, int], ...]
) -> Level:
    from scipy.stats import norm
    from scipy.stats import t as student

    quantile = (1 + COVERAGE) / 2
    half = math.hypot(float(student.ppf(quantile, freedom)) * math.sqrt(variance), float(norm.ppf(quantile)) * shared)
    scatter = math.sqrt(max(side[1] for side in sides))
    counts = (sides[0][2], sides[1][2])
    return Level(math.exp(log), math.exp(log - half), math.exp(log + half), counts, freedom, scatter)

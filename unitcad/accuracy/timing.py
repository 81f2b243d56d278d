"""Run times: calls are timed in turn, so that other load on the machine falls on all alike; medians with quartiles."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

K = TypeVar("K")
PROCESSOR = time.process_time
"""A clock that counts only this process's processor seconds."""
PROCESSOR_NOTE = (
    "Times are processor seconds of all threads: waiting on a busy machine is not in them, a cache that is shared with "
    "other programs is."
)


@dataclass(frozen=True)
class Timing:
    """Seconds: median, lower and upper quartile, all equal for a single run; `value`: the last run's result."""

    median: float
    low: float
    high: float
    value: Any = None

    def __str__(self) -> str:
        spread = f" ({_seconds(self.low)} to {_seconds(self.high)})" if self.high > self.low else ""
        return _seconds(self.median) + spread


def interleaved(
    calls: Mapping[K, Callable[[], Any]],
    repeats: int,
    warm: bool = True,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[K, Timing]:
    """Time every call `repeats` times, in turn; a first round warms up and does not count.

    clock: seconds; `PROCESSOR` for work in one thread, for which waiting on a busy machine must not count.
    """
    seconds: dict[K, list[float]] = {name: [] for name in calls}
    values: dict[K, Any] = {}
    for round_ in range(repeats + warm):
        for name, call in calls.items():
            gc.collect()
            start = clock()
            values[name] = call()
            taken = clock() - start
            if round_ or not warm:
                seconds[name].append(taken)
    return {name: timing(seconds[name], values[name]) for name in calls}


def timing(seconds: list[float], value: Any = None) -> Timing:
    """Return the median and quartiles of some runs."""
    if len(seconds) < 2:
        return Timing(seconds[0], seconds[0], seconds[0], value)
    low, middle, high = statistics.quantiles(seconds, n=4, method="inclusive")
    return Timing(middle, low, high, value)


def _seconds(value: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"

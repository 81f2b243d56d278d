"""How long a casting takes: work and cures one after the other, from the printed pieces to the unit in the hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from unitcad.casting.bench_step import BenchStep


@dataclass(frozen=True)
class Phase:
    """A stretch of work and the wait after it, minutes: `start_min` counts from the first step of all."""

    name: str
    start_min: float
    bench_min: float
    wait_min: float

    @property
    def end_min(self) -> float:
        """When it is over."""
        return self.start_min + self.bench_min + self.wait_min


def phases(stages: Iterable[tuple[str, Sequence[BenchStep]]]) -> tuple[Phase, ...]:
    """Return the phases of named stages: a cure ends one, since a person may leave meanwhile; shorter waits don't."""
    found: list[Phase] = []
    clock = 0.0
    for name, steps in stages:
        bench = wait = 0.0
        cured = False
        for i, step in enumerate(steps):
            bench, wait = bench + step.minutes, wait + step.wait_min
            if step.kind == "cure" or i == len(steps) - 1:
                later = "open" if name.startswith("pour") else "go on"
                found.append(Phase(f"{name}: {later}" if cured else name, clock, bench, wait))
                clock, bench, wait, cured = clock + bench + wait, 0.0, 0.0, True
    return tuple(found)


def duration(minutes: float) -> str:
    """Return minutes as "20 h 40 min", beyond two days as "3 days 20 h"."""
    hours, rest = divmod(round(minutes), 60)
    if 60 * hours + rest > 48 * 60:
        days, hours = divmod(round(minutes / 60), 24)
        return f"{days} days {hours} h" if hours else f"{days} days"
    return f"{hours} h {rest} min" if hours and rest else f"{hours} h" if hours else f"{rest} min"

"""What a check may spend, and how it stops: bytes, faces, seconds. Reaching a limit is finding F011, never a pass."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from unitcad.check.findings import Facts, Finding, ending
from unitcad.check.rules.f_file import F011
from unitcad.geometry.ticks import Interrupted


@dataclass(frozen=True)
class Limits:
    """Bounds on one file. `seconds` is wall time; `ratio` is inflated over packed size of a zip entry,
    `max_instances` what a 3MF may place: items and components, counted before they are expanded."""

    max_faces: int = 10_000_000
    max_bytes: int = 4_000_000_000
    max_package_bytes: int = 2_000_000_000
    max_entries: int = 10_000
    max_instances: int = 100_000
    max_depth: int = 64
    ratio: float = 1000.0
    seconds: float = 600.0


class Unreadable(Interrupted):
    """The check can go no further; the findings say why, and no filter drops the errors among them.

    What was found before, and the facts known by then, are added on the way up (`keeping`).
    """

    def __init__(self, *findings: Finding) -> None:
        self.findings = ending(findings)
        self.facts = Facts()
        super().__init__("; ".join(found.message for found in findings))


class OutOfTime(Unreadable):
    """The time is up: no fault of the part that was being read, so nothing is concluded from it."""

    def __init__(self, seconds: float) -> None:
        super().__init__(F011.finding(f"not finished within --timeout {seconds:g} s"))


def over_limit(what: str) -> Unreadable:
    """Return the limit `what` is reached."""
    return Unreadable(F011.finding(what))


@contextlib.contextmanager
def keeping(
    findings: Sequence[Finding] = (),
    facts: Facts | None = None,
    change: Callable[[Iterable[Finding]], Iterable[Finding]] = iter,
) -> Iterator[None]:
    """Put the findings by then, and the facts, beside what ends the check inside; `change` all of them.

    Raises `Unreadable`, with F011 where memory runs out or calls nest too deeply.
    """
    try:
        yield
    except (Unreadable, MemoryError, RecursionError) as error:
        if isinstance(error, Unreadable):
            stop = error
        else:
            stop = over_limit("out of memory (--memory)" if isinstance(error, MemoryError) else "nested too deeply")
        stop.findings = tuple(change((*findings, *stop.findings)))
        if facts is not None and stop.facts == Facts():
            stop.facts = facts
        raise stop from None


class Deadline:
    """A clock that ends a check: `tick()` raises `OutOfTime` once the time is up."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._end = time.monotonic() + seconds

    def tick(self) -> None:
        """Raise `OutOfTime` (F011) after the last second."""
        if time.monotonic() > self._end:
            raise OutOfTime(self.seconds)

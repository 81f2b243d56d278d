"""What a check may spend, and how it stops: bytes, faces, seconds. Reaching a limit is finding F011, never a pass."""

from __future__ import annotations

import time
from dataclasses import dataclass

from unitcad.check.findings import Finding, ending
from unitcad.check.rulebook import finding


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


class Unreadable(Exception):
    """A reader can go no further; the findings say why, and no filter drops the errors among them."""

    def __init__(self, *findings: Finding) -> None:
        self.findings = ending(findings)
        super().__init__("; ".join(found.message for found in findings))


def over_limit(what: str) -> Unreadable:
    """The limit `what` is reached."""
    return Unreadable(finding("F011", what))


class Deadline:
    """A clock that ends a check: `tick()` raises `Unreadable` once the time is up."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._end = time.monotonic() + seconds

    def tick(self) -> None:
        """Raises `Unreadable` (F011) after the last second."""
        if time.monotonic() > self._end:
            raise over_limit(f"not finished within {self.seconds:g} s")

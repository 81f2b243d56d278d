"""A mould check, and its result at one place."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import TypedDict

from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.profile import GRID_PER_MM

GRID = 3 / GRID_PER_MM
"""Change of a distance by snapping the two faces that it is between to the grid, mm."""


class FindingRecord(TypedDict):
    """A finding as JSON data."""

    code: str
    where: str
    ok: bool
    value: float
    limit: float
    unit: str
    advice: str


@dataclass(frozen=True)
class MouldFinding:
    """A check at a place: `value` against `limit` in `unit` ("" for a ratio), whether it passes, a remedy or a note."""

    code: str
    where: str
    ok: bool
    value: float
    limit: float
    unit: str
    advice: str = ""

    def as_dict(self) -> FindingRecord:
        """Return JSON-ready data; six significant digits, so that a summation's last bits do not show."""
        return FindingRecord(**{**asdict(self), "value": float(f"{self.value:.6g}")})


def at_most(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> MouldFinding:
    """Return a finding that passes up to `limit`."""
    ok = bool(value <= limit)
    return MouldFinding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)


def at_least(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> MouldFinding:
    """Return a finding that passes from `limit` on."""
    ok = bool(value >= limit)
    return MouldFinding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)


@dataclass(frozen=True)
class MouldCheck:
    """A code, its demand in one line, and its function. `reads_silicone`: its limit is a material's."""

    code: str
    demands: str
    findings: Callable[[MouldSet], Iterable[MouldFinding]]
    reads_silicone: bool = False

"""The result of a mould check at one place."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TypedDict


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
    """One check at one place: `value` against `limit` in `unit`, whether it passes, and a remedy or a note."""

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


def exactly(code: str, where: str, value: float, wanted: float, unit: str) -> MouldFinding:
    """Return a finding that passes if `value` is `wanted`."""
    return MouldFinding(code, where, bool(value == wanted), float(value), float(wanted), unit)


def at_most(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> MouldFinding:
    """Return a finding that passes up to `limit`."""
    ok = bool(value <= limit)
    return MouldFinding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)


def at_least(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> MouldFinding:
    """Return a finding that passes from `limit` on."""
    ok = bool(value >= limit)
    return MouldFinding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)

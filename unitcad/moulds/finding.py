"""What a law says of one place."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Finding:
    """One law at one place: `value` against `limit` in `unit`, whether it holds, and what to change where not."""

    code: str
    where: str
    ok: bool
    value: float
    limit: float
    unit: str
    advice: str = ""


def exactly(code: str, where: str, value: float, wanted: float, unit: str) -> Finding:
    """Holds where `value` is `wanted`."""
    return Finding(code, where, bool(value == wanted), float(value), float(wanted), unit)


def at_most(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> Finding:
    """Holds up to `limit`."""
    ok = bool(value <= limit)
    return Finding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)


def at_least(code: str, where: str, value: float, limit: float, unit: str, advice: str = "") -> Finding:
    """Holds from `limit` on."""
    ok = bool(value >= limit)
    return Finding(code, where, ok, float(value), float(limit), unit, "" if ok else advice)


def as_dict(finding: Finding) -> dict[str, Any]:
    """The finding as JSON-ready data; six significant digits, so that a summation's last bits do not show."""
    return {**asdict(finding), "value": float(f"{finding.value:.6g}")}

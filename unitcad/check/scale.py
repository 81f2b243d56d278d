"""Size rules that need no printer: S001."""

from __future__ import annotations

from unitcad.check.findings import Facts, Finding
from unitcad.check.rulebook import finding

SMALL, LARGE = 1.0, 2000.0  # mm; a printed part lies between


def judge(facts: Facts, unit_known: bool) -> list[Finding]:
    """S001 from the largest side of the box; `unit_known` says that the file or the caller named the unit."""
    if facts.bbox_mm is None:
        return []
    side = max(high - low for low, high in zip(*facts.bbox_mm, strict=True))
    if SMALL <= side <= LARGE or side == 0:
        return []
    if side < SMALL:
        guess = f"{side * 1000:.3g} mm if it was metres, {side * 25.4:.3g} mm if inches"
    else:
        guess = f"{side / 1000:.3g} mm if it was microns"
    named = "in the unit that is named" if unit_known else "as millimetres"
    return [finding("S001", f"largest side {side:.6g} mm {named}; {guess}")]

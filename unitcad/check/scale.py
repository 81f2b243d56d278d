"""Size rules that need no printer: S001, and G010 for specks."""

from __future__ import annotations

import numpy as np

from unitcad.check.findings import Facts, Finding, Location, counted, number
from unitcad.check.options import UNITS_MM
from unitcad.check.rulebook import finding
from unitcad.geometry.arrays import Bools, Floats

SMALL, LARGE = 1.0, 2000.0  # mm; a printed part lies between
SPECK = 0.02  # mm; a tenth of the least feature of the finest printer in the catalogue


def judge(facts: Facts, unit: str | None) -> list[Finding]:
    """S001 from the largest side of the box; `unit` is the one that the file or the caller named, as in UNITS_MM."""
    if facts.bbox_mm is None:
        return []
    side = max(high - low for low, high in zip(*facts.bbox_mm, strict=True))
    if SMALL <= side <= LARGE or side == 0:
        return []
    factor = UNITS_MM.get(unit or "millimeter", 1.0)
    if factor != 1.0:
        guess = f"{number(side / factor)} mm if the numbers are millimetres"
    elif side < SMALL:
        guess = f"{number(side * 1000, 3)} mm if it was metres, {number(side * 25.4, 3)} mm if inches"
    else:
        guess = f"{number(side / 1000, 3)} mm if it was microns"
    named = f"with the unit {unit} that is named" if unit else "as millimetres"
    return [finding("S001", f"largest side {number(side)} mm {named}; {guess}")]


def specks(low: Floats, high: Floats, asked: Bools) -> list[Finding]:
    """G010 for the bodies `asked` of those with these boxes, (n, 3) mm, where one of them is as large as a part."""
    side = (high - low).max(axis=1, initial=0)
    tiny = np.flatnonzero(asked & (side < SPECK))
    if not len(tiny) or side.max() < SMALL:
        return []
    middle = ((low + high) / 2)[tiny].tolist()
    places = [Location(xyz=(x, y, z)) for x, y, z in middle]
    text = f"{counted(len(tiny), 'speck')}, the largest {number(side[tiny].max(), 3)} mm across"
    return [finding("G010", text, len(tiny), places)]

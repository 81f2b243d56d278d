"""Sizes below which a printer, a slicer or a float32 number shows no difference; severities rest on them."""

from __future__ import annotations

from dataclasses import dataclass

STEPS = 4
"""float32 steps that rounding may move a plane by: half a step for each corner, more at its far end."""
EXACT = 0.99
"""Share of a limit that is enough, for what was drawn at it."""
SMALL = 1.0
"""Largest side, mm, below which a part was probably drawn in metres."""


@dataclass(frozen=True)
class Resolution:
    """Sizes in mm.

    `feature` is the least feature of the finest printer in the catalogue. `thin`, a tenth of it and of a usual `layer`,
    is a thickness that no printer makes and every slicer closes. `digit` is the last digit of usual G-code: what is
    smaller cannot reach a printer. `unit`: one mm of the part in mm of the file, 0.001 if it was drawn in metres.
    """

    feature: float = 0.2
    layer: float = 0.2
    thin: float = 0.02
    digit: float = 0.001
    unit: float = 1.0


def resolution_of(side: float) -> Resolution:
    """Return the sizes for a file by its largest side, mm, in metres if it was probably drawn in metres."""
    unit = 1e-3 if side < SMALL else 1.0
    usual = Resolution()
    return Resolution(usual.feature * unit, usual.layer * unit, usual.thin * unit, usual.digit * unit, unit)

"""What keeps a tongue level: a pad of card under its grip, which hangs free beside the cup."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.moulds.base import plate_top
from unitcad.moulds.cup import window_section
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.tongue import GRIP_WIDTH
from unitcad.shape import Shape, box

ON_PLATE = 0.75
"""Share of the pad's width, at least, that lies on the plate: it does not tip over the plate's edge."""


@dataclass(frozen=True)
class Prop:
    """A pad on the plate, against the cup: its size in mm, and each one's shape in its place.

    `tolerance_mm`: how far its thickness may be off: the tongue has as much room above and below in its windows.
    """

    thickness_mm: float
    width_mm: float
    length_mm: float
    tolerance_mm: float
    pads: tuple[Shape, ...]


def grip_of(moulds: MouldSet) -> str:
    """Return what a tongue is pulled by: a printed one's grip, or the tab of tape on one that is cut."""
    return "tab" if any(tool.made == "cut" for tool in moulds.plan.of_kind("tongue")) else "grip"


def tongue_prop(moulds: MouldSet) -> Prop | None:
    """Return the pad under the tongues' grips, one on each side that tongues leave to; None without tongues."""
    return moulds.once("tongue prop", lambda: _tongue_prop(moulds))


def _tongue_prop(moulds: MouldSet) -> Prop | None:
    lay, exit = moulds.plan.layout, moulds.dimensions.exit
    if not exit or not moulds.plan.of_kind("tongue"):
        return None
    top = plate_top(moulds.spec)
    width = float(math.floor((lay.plate[0] - lay.cup[0]) / ON_PLATE))
    room = []
    for step in moulds.plan.steps:
        _, low, high = window_section(moulds.spec, exit, step.rim)
        room += [exit.low - low, *([high - exit.high] if high < step.rim else [])]
    pads, length = [], 0.0
    for side in (1, -1):
        along = [cell.y for cell in lay.cells if side in cell.sides]
        if along:
            x0, x1 = sorted((side * lay.cup[0], side * (lay.cup[0] + width)))
            y0, y1 = min(along) - GRIP_WIDTH / 2 - 1, max(along) + GRIP_WIDTH / 2 + 1
            pads.append(box(x0, x1, y0, y1, top, exit.low))
            length = max(length, y1 - y0)
    return Prop(exit.low - top, width, length, min(room), tuple(pads))

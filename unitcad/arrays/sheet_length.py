"""How long a sheet may be: what is longer is refused with the pitch, the limb or the margin that would do."""

from __future__ import annotations

import math
from collections.abc import Sequence

from unitcad.arrays.array import Box
from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.layouts import Point
from unitcad.designs.limits import down
from unitcad.errors import Refusal

LONGEST = 1500.0
"""Of a sheet along x and along y, mm: lines that cut its tools begin and end 1 m from its middle."""


def check_length(asked: AskedArray, points: Sequence[Point], outline: Box) -> None:
    """Raise Refusal for a sheet that is too long: for what takes most of its length, with the value that fits."""
    for axis, ways in enumerate(zip(*((point.x, point.y) for point in points), strict=True)):
        length = outline[axis + 2] - outline[axis]
        over, span = length - LONGEST, max(ways) - min(ways)
        if over <= 2 / 1024:
            continue
        limit = f"the sheet would be {length:.5g} mm long along {'xy'[axis]}; it is at most {LONGEST:g} mm"
        field, value = max(_beside(asked, axis), key=lambda each: each[1])
        if span >= 2 * value:
            field, value, more = _of_layout(asked, axis, span)
        else:
            more = 2.0
        nearest = down(value - over / more) if more else 0.0
        raise Refusal(field, value, limit, nearest if nearest > 0 else None)


def _beside(asked: AskedArray, axis: int) -> list[tuple[str, float]]:
    """Return what the sheet has at either end along an axis: field and value, mm."""
    sheet = asked.sheet
    found = [("sheet.margin_mm", sheet.margin_mm)]
    if sheet.strap_slot_mm and axis == 0:
        found += [("sheet.strap_web_mm", sheet.strap_web_mm), ("sheet.strap_slot_mm.0", sheet.strap_slot_mm[0])]
    return found


def _of_layout(asked: AskedArray, axis: int, span: float) -> tuple[str, float, float]:
    """Return a layout's field, its value, and how much longer (mm) a unit more of it makes the span of the places."""
    layout = asked.layout
    if layout["kind"] == "list":
        return "layout.points_mm", round(span, 3), 0.0
    if layout["kind"] == "ring":
        if axis == 0:
            return "body.radius_mm", asked.body.radius_mm or 0.0, 2 * math.pi * (1 - 1 / layout["count"])
        pitch, field = layout["band_pitch_mm"], "layout.band_pitch_mm"
    else:
        pitch, field = layout["pitch_mm"], "layout.pitch_mm"
        if not isinstance(pitch, int | float):
            pitch, field = pitch[axis], f"{field}.{axis}"
    return field, pitch, span / pitch

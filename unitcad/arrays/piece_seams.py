"""Tools that are larger than the bed: their cuts, the weep of a seam, labels of the pieces."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise, product
from typing import Literal, NamedTuple

from unitcad.arrays.array import Array, Box
from unitcad.arrays.sheet import rounded, slot_profile
from unitcad.checks.seam import WEEP
from unitcad.errors import Refusal
from unitcad.moulds.cuts import (
    BESIDE,
    FAR,
    LARGE,
    Axis,
    Feature,
    Interval,
    Seam,
    Sized,
    in_gaps,
    length,
    seams,
    to_seam_frame,
)
from unitcad.moulds.pieces import row, row_width
from unitcad.shape import Shape, mm, moved, turned
from unitcad.shape.lettering import HEIGHT
from unitcad.spec import Spec

ROUNDING = 0.97
"""Fraction of the limit: the computed weep is within 3 % of the one that the check measures on the meshes."""


def sheet_mm2(array: Array) -> float:
    """Return the area of a sheet without its strap slots, mm2."""
    sheet = array.sheet
    return rounded(sheet.outline, sheet.corner_mm).area - sum(slot_profile(slot).area for slot in sheet.strap_slots)


def weep(array: Array, seams: Sequence[Seam], outline: Box, heights: tuple[float, float]) -> float:
    """Return the volume in a tool's seams, mm3. `heights` of the cut parts within the sheet and next to it, mm."""
    x0, y0, x1, y1 = array.sheet.outline
    total = 0.0
    for seam in seams:
        low, high = (y0, y1) if seam.across == "x" else (-x1, -x0)
        whole = outline[3] - outline[1] if seam.across == "x" else outline[2] - outline[0]
        total += seam.play * (heights[0] * length(seam, low, high) + heights[1] * (whole - (high - low)))
    return total


def too_much(
    array: Array, outline: Box, heights: tuple[float, float], layer_mm3: float
) -> Callable[[Sequence[Seam]], str]:
    """Return the reason why seams take more of a layer's volume than C250 allows, "" if they do not.

    `outline` and `heights` as those of `weep`.
    """

    def fault(seams: Sequence[Seam]) -> str:
        taken, limit = weep(array, seams, outline, heights), ROUNDING * WEEP * layer_mm3
        text = f"the seams of so many pieces would take {taken:.0f} mm3 of silicone; at most {limit:.0f} mm3 may"
        return text if taken > limit else ""

    return fault


STEP = 0.5
"""Between two places that are tried for a text, a pin or a slot, mm."""
Side = Literal["front", "back", "left", "right"]
SIDES: dict[Side, tuple[int, int]] = {"front": (1, -1), "back": (1, 1), "left": (0, -1), "right": (0, 1)}
"""The axis that leads to each side of a tool, and its sign there."""


def pieces(outline: Box, seams: Iterable[Seam]) -> list[Box]:
    """Return the extent of each piece of a tool, between the teeth at its ends, in the order of their numbers."""
    cut_at, (x0, y0, x1, y1) = sorted(seams, key=lambda seam: seam.extent), outline
    along = bool(cut_at) and cut_at[0].across == "y"
    low, high = (y0, y1) if along else (x0, x1)
    parts = [(a[1], b[0]) for a, b in pairwise([(low, low), *(seam.extent for seam in cut_at), (high, high)])]
    return [(x0, a, x1, b) for a, b in reversed(parts)] if along else [(a, y0, b, y1) for a, b in parts]


def outer_sides(piece: Box, outline: Box) -> list[Side]:
    """Return the sides of a tool that one of its pieces has."""
    return [side for side, (axis, sign) in SIDES.items() if piece[axis + 1 + sign] == outline[axis + 1 + sign]]


def along_side(piece: Box, side: Side) -> Interval:
    """Return a piece's interval along one of its sides."""
    return (piece[0], piece[2]) if SIDES[side][0] else (piece[1], piece[3])


class Strip(NamedTuple):
    """The strip of a tool for texts, all around inside `outer` and away from it by `inset`, mm.

    `stroke` of the characters; `heights` from z to z that are engraved. Pieces are looked at for a side of the tool in
    the order `first`, then the rest. `taken`: areas to avoid; with None texts are in the middle.
    """

    outer: Box
    inset: float
    stroke: float
    heights: Interval
    first: Side
    taken: Sequence[Box] | None = None


def on_pieces(strip: Strip, rows: Sequence[Sequence[str]], seams: Sequence[Seam]) -> Iterator[Shape]:
    """Draw a row of texts on each piece of a tool: the first of the `rows` that has room there, otherwise the last.

    If the tool is cut the piece's number follows them.
    """
    for number, piece in enumerate(pieces(strip.outer, seams), 1):
        numbered = [[*each, *([str(number)] if seams else [])] for each in rows]
        sides = sorted(outer_sides(piece, strip.outer), key=lambda side: side != strip.first)
        for texts, side in product(numbered, sides):
            if (start := _start(strip, side, texts, piece)) is not None:
                break
        else:
            side, texts = sides[0], numbered[-1]
            start = along_side(piece, side)[0] + _margin(strip, side, piece)
        yield from _on_side(strip, side, texts, start)


def _on_side(strip: Strip, side: Side, texts: Sequence[str], start: float) -> Iterator[Shape]:
    """Draw texts on one side of the strip, one after the other, from `start` along it."""
    x0, y0, x1, y1 = strip.outer
    high = HEIGHT * strip.stroke
    if SIDES[side][0]:
        y = y0 + strip.inset if side == "front" else y1 - strip.inset - high
        yield from row(texts, strip.stroke, (start, y), strip.heights)
    else:
        # Read from the right, from below to above.
        x = x0 + strip.inset + high if side == "left" else x1 - strip.inset
        yield from (moved(turned(c, "z", 1), x, start) for c in row(texts, strip.stroke, (0.0, 0.0), strip.heights))


def _start(strip: Strip, side: Side, texts: Sequence[str], piece: Box) -> float | None:
    """Return the start of texts on a side: in the middle, or next to its margin, clear of taken areas, or None."""
    width, margin, within = row_width(texts, strip.stroke), _margin(strip, side, piece), along_side(piece, side)
    if strip.taken is None:
        return (within[0] + within[1] - width) / 2 if width + 2 * margin <= within[1] - within[0] else None
    to_side, sign = SIDES[side]
    axis, deep = 1 - to_side, strip.inset + HEIGHT * strip.stroke
    low, high = sorted((strip.outer[to_side + 1 + sign], strip.outer[to_side + 1 + sign] - sign * deep))
    taken = [(b[axis], b[2 + axis]) for b in strip.taken if b[1 - axis] < high and b[3 - axis] > low]
    at = within[0] + margin
    while at + width <= within[1]:
        if not any(start < at + width + BESIDE / 2 and end > at - BESIDE / 2 for start, end in taken):
            return at
        at += STEP
    return None


def _margin(strip: Strip, side: Side, piece: Box) -> float:
    """Return how far from an end of a piece a text begins: from a seam, or from the tool's own edge, mm."""
    axis = 1 - SIDES[side][0]
    return strip.inset if piece[axis] == strip.outer[axis] else BESIDE


EDGE = 0.5
"""From a tooth to the sheet's edge, at least, mm: beyond it a groove would cut the tooth."""


def box_feature(x0: float, y0: float, x1: float, y1: float) -> Feature:
    """Return a box as a feature."""
    return Feature(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


def round_units(array: Array, reach: Iterable[float]) -> list[Feature]:
    """Return each place to `reach` all round, in the order of the places."""
    return [Feature(((place.x, place.y),), r) for place, r in zip(array.places, reach, strict=True)]


def of_sheet(array: Array) -> list[Feature]:
    """Return strap slots and round corners."""
    sheet = array.sheet
    (x0, y0, x1, y1), r = sheet.outline, sheet.corner_mm
    slots = [box_feature(*slot) for slot in sheet.strap_slots]
    ends = [((x0 - FAR, x0 + r), (x1 - r, x1 + FAR)), ((y0 - FAR, y0 + r), (y1 - r, y1 + FAR))]
    return slots + [box_feature(x[0], y[0], x[1], y[1]) for x in ends[0] for y in ends[1]]


def seams_of(
    array: Array,
    outline: Box,
    called: str,
    clear: Sequence[Feature],
    close: Sequence[Feature],
    fault: Callable[[Sequence[Seam]], str],
    *,
    under: Sequence[Feature] = (),
    other: Sequence[Seam] = (),
) -> tuple[Seam, ...]:
    """Return the seams of a tool, named `called`, with this `outline`; () if it fits the bed.

    Cuts are between the features `clear` if that gives pieces that fit, otherwise between `close`, which none may meet.
    The line may cross features `under` the tool, teeth may not. `fault` and `other` as for `seams`. Raises Refusal for
    a tool that exceeds the bed along both axes, and for a sheet that is too narrow for a dovetail.
    """
    moulds = array.unit.moulds
    x0, y0, x1, y1 = outline
    along: tuple[tuple[Axis, Interval, float], ...] = (
        ("x", (x0, x1), moulds.bed_x_mm),
        ("y", (y0, y1), moulds.bed_y_mm),
    )
    over = [each for each in along if each[1][1] - each[1][0] > each[2] + 1e-9]
    if not over:
        return ()
    axis, ends, bed = min(over, key=lambda each: each[1][1] - each[1][0] - each[2])
    if len(over) > 1:
        limit = f"{called} exceeds the bed along both axes, and tools are cut across one only"
        raise Refusal(f"moulds.bed_{axis}_mm", bed, limit, math.ceil(10 * (ends[1] - ends[0]) - 1e-6) / 10)
    kept, closer, crossed = (
        tuple(Feature(tuple(to_seam_frame(corner, axis) for corner in f.corners), f.radius) for f in each)
        for each in (clear, close, under)
    )
    play, teeth, avoided = moulds.plinth_clearance_mm, _across(array, axis), (*closer, *crossed)
    choices = (
        in_gaps(ends, kept, teeth, avoided, play, axis),
        in_gaps(ends, closer, teeth, avoided, play, axis, narrow=True),
    )
    return seams(Sized(axis, ends, bed, choices), called, other, fault)


def longer_than_bed(spec: Spec, length: float) -> bool:
    """Tell whether a bar fits the bed neither along nor across."""
    return length > max(spec.moulds.bed_x_mm, spec.moulds.bed_y_mm) + 1e-9


def _across(array: Array, across: Axis) -> Interval:
    """Return the possible places of teeth along a seam: within the sheet, clear of the groove round it."""
    x0, y0, x1, y1 = array.sheet.outline
    low, high = (y0, y1) if across == "x" else (-x1, -x0)
    least = LARGE.tip + 2 * EDGE
    if high - low < least:
        needed = array.sheet.margin_mm + (least - (high - low)) / 2
        limit = f"its tools are larger than the bed; a dovetail between their pieces needs a sheet {least:.3g} mm wide"
        raise Refusal("sheet.margin_mm", array.sheet.margin_mm, limit, mm(needed + 0.005))
    return low + EDGE, high - EDGE

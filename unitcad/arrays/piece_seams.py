"""Tools that are larger than the bed: their cuts, the weep of a seam, labels of the pieces."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Literal, NamedTuple

from unitcad.arrays.array import Array, Box, Placed
from unitcad.arrays.sheet import rounded, slot_profile
from unitcad.checks.seam import WEEP
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, nearer, to_segment
from unitcad.moulds.cuts import (
    BESIDE,
    FAR,
    LARGE,
    Axis,
    Feature,
    Interval,
    Place,
    Seam,
    Sized,
    in_gaps,
    length,
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
"""Between two places that are tried for a text, mm."""
Side = Literal["top", "bottom", "left", "right"]


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


def on_pieces(strip: Strip, rows: Sequence[Sequence[str]], seams: Sequence[Seam]) -> list[Shape]:
    """Draw a row of texts on each piece of a tool: the first of the `rows` that has room there, otherwise the last.

    If the tool is cut the piece's number follows them. A piece without an outer edge has none.
    """
    x0, y0, x1, y1 = strip.outer
    columns, lines = intervals((x0, x1), seams, "x"), intervals((y0, y1), seams, "y")[::-1]
    letters: list[Shape] = []
    for j, along in enumerate(lines):
        for i, across in enumerate(columns):
            ends: tuple[tuple[Side, bool], ...] = (
                ("top", j == 0),
                ("bottom", j == len(lines) - 1),
                ("left", i == 0),
                ("right", i == len(columns) - 1),
            )
            free: list[Side] = [side for side, there in ends if there]
            within: dict[Side, Interval] = {side: across if side in ("top", "bottom") else along for side in free}
            number = [str(j * len(columns) + i + 1)] if seams else []
            letters += _on_piece(strip, [[*each, *number] for each in rows], within)
    return letters


def _on_piece(strip: Strip, rows: Sequence[Sequence[str]], within: Mapping[Side, Interval]) -> Iterator[Shape]:
    """Draw a row of texts on one of a piece's sides; `within`: the piece's interval along each."""
    sides = sorted(within, key=lambda side: side != strip.first)
    for texts, side in product(rows, sides):
        start = _start(strip, side, texts, within[side])
        if start is not None:
            yield from _on_side(strip, side, texts, start)
            return
    if sides:
        side = sides[0]
        yield from _on_side(strip, side, rows[-1], within[side][0] + _margin(strip, side, within[side]))


def _on_side(strip: Strip, side: Side, texts: Sequence[str], start: float) -> Iterator[Shape]:
    """Draw texts on one side of the strip, one after the other, from `start` along it."""
    x0, y0, x1, y1 = strip.outer
    high = HEIGHT * strip.stroke
    if side in ("top", "bottom"):
        y = y0 + strip.inset if side == "bottom" else y1 - strip.inset - high
        yield from row(texts, strip.stroke, (start, y), strip.heights)
    else:
        # Read from the right, from below to above.
        x = x0 + strip.inset + high if side == "left" else x1 - strip.inset
        yield from (moved(turned(c, "z", 1), x, start) for c in row(texts, strip.stroke, (0.0, 0.0), strip.heights))


def _start(strip: Strip, side: Side, texts: Sequence[str], within: Interval) -> float | None:
    """Return the start of texts on a side: in the middle, or next to its margin, clear of taken areas, or None.

    `within` is the piece's interval along that side.
    """
    width, margin = row_width(texts, strip.stroke), _margin(strip, side, within)
    if strip.taken is None:
        return (within[0] + within[1] - width) / 2 if width + 2 * margin <= within[1] - within[0] else None
    axis = 0 if side in ("top", "bottom") else 1
    ends = strip.outer[1 - axis], strip.outer[3 - axis]
    deep = strip.inset + HEIGHT * strip.stroke
    low, high = (ends[1] - deep, ends[1]) if side in ("top", "right") else (ends[0], ends[0] + deep)
    taken = [(b[axis], b[2 + axis]) for b in strip.taken if b[1 - axis] < high and b[3 - axis] > low]
    at = within[0] + margin
    while at + width <= within[1]:
        if not any(start < at + width + BESIDE / 2 and end > at - BESIDE / 2 for start, end in taken):
            return at
        at += STEP
    return None


def _margin(strip: Strip, side: Side, within: Interval) -> float:
    """Return how far from an end of a piece a text begins: from a seam, or from the tool's own edge, mm."""
    edge = strip.outer[0 if side in ("top", "bottom") else 1]
    return strip.inset if within[0] == edge else BESIDE


EDGE = 0.5
"""From a tooth to the sheet's edge, at least, mm: beyond it a groove would cut the tooth."""
THROUGH = 2.5
"""A stepping line is straight so far to either side of a row's middle, mm: fins of the row end next to it."""

STEPS = (0,), (0, 1, 2, 1)
"""Steps of lines from row to row, in half pitches: two steps to one side leave room for a tooth."""


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


def size_tool(
    array: Array,
    outline: Box,
    clear: Sequence[Feature],
    close: Sequence[Feature],
    under: Sequence[Feature] = (),
) -> tuple[Sized, ...]:
    """Return a tool with its `outline` along x and along y, if it exceeds the bed.

    Cuts are between the features `clear` if that gives pieces that fit, otherwise between `close`, which none may meet.
    A straight line may cross features `under` the tool, teeth may not. Raises Refusal for a sheet that is
    too narrow for a dovetail.
    """
    moulds = array.unit.moulds
    found: list[Sized] = []
    x0, y0, x1, y1 = outline
    along: tuple[tuple[Axis, Interval, float], ...] = (
        ("x", (x0, x1), moulds.bed_x_mm),
        ("y", (y0, y1), moulds.bed_y_mm),
    )
    for axis, ends, bed in along:
        if ends[1] - ends[0] > bed + 1e-9:
            kept, closer, crossed = (
                tuple(Feature(tuple(to_seam_frame(corner, axis) for corner in f.corners), f.radius) for f in each)
                for each in (clear, close, under)
            )
            choices = tuple(in_gaps(ends, kept)), tuple(in_gaps(ends, closer, narrow=True))
            if axis == "x":
                choices = choices[0], (*choices[1], *_stepping(array, (*closer, *crossed)))
            found.append(Sized(axis, ends, bed, _across(array, axis), (*closer, *crossed), choices))
    return tuple(found)


def longer_than_bed(spec: Spec, length: float) -> bool:
    """Tell whether a bar fits the bed neither along nor across."""
    return length > max(spec.moulds.bed_x_mm, spec.moulds.bed_y_mm) + 1e-9


def intervals(ends: Interval, seams: Iterable[Seam], across: Axis) -> list[Interval]:
    """Return the extent of each piece of a tool along an axis, between the teeth at its ends, from below."""
    marks = sorted(seam.extent for seam in seams if seam.across == across)
    return [(a[1], b[0]) for a, b in pairwise([(ends[0], ends[0]), *marks, (ends[1], ends[1])])]


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


def _stepping(array: Array, features: Sequence[Feature]) -> Iterator[Place]:
    """Yield the places of lines that step between the rows from gap to gap, clear of the features."""
    rows: dict[float, list[Placed]] = {}
    for place in sorted(array.places, key=lambda place: (place.y, place.x)):
        rows.setdefault(place.y, []).append(place)
    starts = sorted({(a.x + b.x) / 2 for row in rows.values() for a, b in pairwise(row)})
    for start, steps, through in product(starts, STEPS, (THROUGH, 0.0)):
        wanted = [start + steps[i % len(steps)] * array.pitch_mm / 2 for i in range(len(rows))]
        line = _line([(y, _passes(rows[y], x, array.pitch_mm)) for y, x in zip(rows, wanted, strict=True)], through)
        stretches = list(pairwise(line))
        if len({x for x, _ in line}) > 1 and not any(
            nearer(ends, feature.corners, feature.radius + BESIDE) for ends in stretches for feature in features
        ):
            yield Place(start, line)


def _passes(row: Sequence[Placed], start: float, pitch: float) -> float:
    """Return the point at which a line passes a row: the gap, or the place next to the row, nearest to `start`."""
    beside = [row[0].x - pitch / 2, row[-1].x + pitch / 2]
    if not beside[0] < start < beside[1]:
        return start
    return min([*((a.x + b.x) / 2 for a, b in pairwise(row)), *beside], key=lambda x: (abs(x - start), x))


def _line(passed: Sequence[tuple[float, float]], through: float) -> tuple[Point, ...]:
    """Return the line that passes each row (y, x), straight for `through` mm to either side if it turns there."""
    line = [(passed[0][1], -FAR)]
    for (y, x), (above, after) in pairwise(passed):
        if x != after:
            by = min(through, (above - y) / 6)
            line += [(x, y + by), (after, above - by)]
    line = list(dict.fromkeys([*line, (passed[-1][1], FAR)]))
    kept = [line[0]]
    for point, after in pairwise(line[1:]):
        # None if the line goes straight on.
        if to_segment(point, kept[-1], after) > 1e-3:
            kept.append(point)
    return (*kept, line[-1])

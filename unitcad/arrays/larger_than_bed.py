r"""Where an array's tools that are larger than the bed are cut: between units, clear of what stands there.

    o  /  o   o      the line of a seam that steps from gap to gap, where no straight one is free:
      |              straight through a row of a hexagon, then at a slant between two units
      \
    o  o \  o
          |
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise, product

from unitcad.arrays.array import Array, Box, Placed
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, nearer, to_segment
from unitcad.moulds.cuts import BESIDE, Feature, Place, Sized, in_gaps
from unitcad.moulds.dovetails import FAR, LARGE, Axis, Interval, Seam, seen
from unitcad.shape import mm
from unitcad.spec import Spec

EDGE = 0.5
"""From a tooth to the sheet's edge, at least, mm: beyond it a groove would cut the tooth."""
THROUGH = 2.5
"""A stepping line is straight so far to either side of a row's middle, mm: fins of the row end beside it."""

STEPS = (0,), (0, 1, 2, 1)
"""What stepping lines follow from row to row, in half pitches: two steps to one side leave room for a tooth."""


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


def sized(
    array: Array,
    outline: Box,
    clear: Sequence[Feature],
    close: Sequence[Feature],
    under: Sequence[Feature] = (),
) -> tuple[Sized, ...]:
    """Return a tool with its `outline` along x and along y, where it exceeds the bed.

    Cuts lie between the features `clear` where that gives pieces that fit, else between `close`, which none may meet.
    A straight line may cross what lies `under` the tool, teeth stand clear of it. Raises Refusal for a sheet that is
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
                tuple(Feature(tuple(seen(corner, axis) for corner in f.corners), f.radius) for f in each)
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
    """Return what each piece of a tool has to itself along an axis, between the teeth at its ends, from below."""
    marks = sorted(seam.extent for seam in seams if seam.across == across)
    return [(a[1], b[0]) for a, b in pairwise([(ends[0], ends[0]), *marks, (ends[1], ends[1])])]


def _across(array: Array, across: Axis) -> Interval:
    """Return where along a seam its teeth may stand: within the sheet, clear of the groove round it."""
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
    """Return where a row of places is passed: the gap, or the place beside the row, that is nearest to `start`."""
    beside = [row[0].x - pitch / 2, row[-1].x + pitch / 2]
    if not beside[0] < start < beside[1]:
        return start
    return min([*((a.x + b.x) / 2 for a, b in pairwise(row)), *beside], key=lambda x: (abs(x - start), x))


def _line(passed: Sequence[tuple[float, float]], through: float) -> tuple[Point, ...]:
    """Return the line that passes each row (y, x), `through` mm to either side of it straight where it turns there."""
    line = [(passed[0][1], -FAR)]
    for (y, x), (above, after) in pairwise(passed):
        if x != after:
            by = min(through, (above - y) / 6)
            line += [(x, y + by), (after, above - by)]
    line = list(dict.fromkeys([*line, (passed[-1][1], FAR)]))
    kept = [line[0]]
    for point, after in pairwise(line[1:]):
        # None where the line goes straight on.
        if to_segment(point, kept[-1], after) > 1e-3:
            kept.append(point)
    return (*kept, line[-1])

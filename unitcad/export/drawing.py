"""A sheet of a dimensioned drawing: a section, the view from above under it, checks for a caliper, a table of holes.

The views are in the first angle, at a scale of ISO 5455. Lengths of the body in mm, of the sheet in mm on paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.export import paper, svg
from unitcad.export.lengths import LEAST_CORNERS, ROUND_MM, Hole, Length
from unitcad.export.paper import Arrow, Fill, Line, Mark, Page, Point, Ring, Text, crossed, overlap, text_width

SCALES = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)
"""Those of ISO 5455 that a body of a mould may need."""
GAP_MM = 5.0
FIRST_MM, ROW_MM = 8.0, 5.2
"""From a view to its first dimension line; from one to the next."""
BESIDE_CUT_MM = 13.0
"""The same beside the view from above, where the line of the section ends."""
ROWS = 14
RING_MM = 1.75
"""Radius of the ring round the number of a check."""
ROW_OF_TABLE_MM = 4.4
CHECKS_MM = (7.0, 30.0, 16.0, 13.0, 14.0)
HOLES_MM = (8.0, 12.5, 12.5, 13.0)
MOST_HOLES = 44
"""A table with more holes than this has a sheet of its own."""
ON_A_SHEET = 150


@dataclass(frozen=True)
class View:
    """A view: regions and lengths in its two axes (mm); `axes`: first coordinates of axes; `notes`: texts at points.

    `beyond`: the outline of the part behind a section.
    """

    regions: tuple[svg.Region, ...]
    lengths: tuple[Length, ...]
    axes: tuple[float, ...] = ()
    notes: tuple[svg.Note, ...] = ()
    beyond: tuple[tuple[Point, ...], ...] = ()


@dataclass(frozen=True)
class Sheet:
    """A body's sheet. `front`: the section by the plane at `cut` (y, mm); `plan`: from above.

    `facts`: rows of the title block but for scale and sheet, as `paper.title_block` has them. `holes`: a table gives
    them from the `datum`, a corner from above. `tolerance`: of a length in the plane, and of a height, with their sign.
    """

    facts: tuple[tuple[tuple[str, str, float], ...], ...]
    front: View
    plan: View
    cut: float
    holes: tuple[Hole, ...] = ()
    datum: Point = (0.0, 0.0)
    tolerance: tuple[str, str] = ("", "")
    hatched: bool = True

    @property
    def checks(self) -> tuple[Length, ...]:
        """The lengths that a caliper checks, by their number."""
        found = (one for view in (self.plan, self.front) for one in view.lengths if one.check)
        return tuple(sorted(found, key=lambda one: one.check))


def pages(sheets: Sequence[Sheet]) -> list[Page]:
    """Return the pages of a drawing: one for each sheet, and more for its holes if they don't fit."""
    drawn = [page for sheet in sheets for page in _pages(sheet)]
    return [
        Page(size, (*marks, *paper.title_block(size, _titled(facts, scale, i, len(drawn)))))
        for i, (size, marks, facts, scale) in enumerate(drawn, 1)
    ]


_Facts = tuple[tuple[tuple[str, str, float], ...], ...]
_Drawn = tuple[Point, list[Mark], _Facts, float]


def _titled(facts: _Facts, scale: float, number: int, of: int) -> list[tuple[tuple[str, str, float], ...]]:
    said = "" if not scale else f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"
    ends = (("scale", said, 1.0), ("sheet", f"{number} of {of}", 1.0))
    return [*facts[:-2], *((*row, end) for row, end in zip(facts[-2:], ends, strict=True))]


def _pages(sheet: Sheet) -> Iterator[_Drawn]:
    """Draw a sheet at the largest scale at which it has room, upright if it is no larger lying."""
    few = len(sheet.holes) <= MOST_HOLES
    tables = list(_tables(sheet, few))
    high = -paper.extent(tables)[1] + GAP_MM if tables else 0.0
    found, (px0, py0, px1, py1) = None, _bounds(sheet.plan)
    for scale in SCALES:
        if scale * max(px1 - px0, py1 - py0) > max(paper.PORTRAIT) and scale != SCALES[-1]:
            continue
        views = list(paper.interrupted(list(_views(sheet, scale))))
        x0, y0, x1, y1 = paper.extent(views)
        for size in (paper.PORTRAIT, paper.LANDSCAPE):
            left, bottom, right, top = paper.frame(size)
            bottom += paper.TITLE_MM[1] + high
            spare = right - left - (x1 - x0) - GAP_MM, top - bottom - (y1 - y0) - GAP_MM
            if min(spare) >= 0 or scale == SCALES[-1]:
                at = (left + right - x0 - x1) / 2, (bottom + top - y0 - y1) / 2
                found = size, [*paper.moved(views, *at), *paper.moved(tables, left + 2, bottom - 2)]
                break
        if found:
            yield (*found, sheet.facts, scale)
            break
    for first in range(0, 0 if few else len(sheet.holes), ON_A_SHEET):
        left, _, _, top = paper.frame(paper.PORTRAIT)
        listed = list(_hole_table(sheet.holes[first : first + ON_A_SHEET], sheet.datum, 3))
        yield paper.PORTRAIT, list(paper.moved(listed, left + 2, top - 4)), sheet.facts, 0.0


def _tables(sheet: Sheet, few: bool) -> Iterator[Mark]:
    """Draw the checks and, if they are `few`, the holes next to them, the upper left corner at the origin."""
    wide = 0.0
    if sheet.checks:
        rows = [("no.", "check with a caliper", "mm", "tolerance", "measured")]
        for one in sheet.checks:
            rows.append((str(one.check), one.name, one.text, sheet.tolerance[one.running], ""))
        yield from paper.table(rows, CHECKS_MM, (0.0, 0.0), ROW_OF_TABLE_MM)
        wide = sum(CHECKS_MM) + 2.0
    if few and sheet.holes:
        yield from paper.moved(_hole_table(sheet.holes, sheet.datum, 1 if len(sheet.holes) <= 7 else 2), wide, 0.0)


def _hole_table(holes: Sequence[Hole], datum: Point, blocks: int) -> Iterator[Mark]:
    """Draw the table of holes in so many blocks side by side, the upper left corner at the origin."""
    rows = math.ceil(len(holes) / blocks)
    for i in range(blocks):
        part = [("name", "x", "y", "size")]
        for one in holes[i * rows : (i + 1) * rows]:
            part.append((one.name, f"{one.x - datum[0]:.2f}", f"{one.y - datum[1]:.2f}", one.size))
        at = i * (sum(HOLES_MM) + 1.0), 0.0
        yield from paper.table(part, HOLES_MM, at, ROW_OF_TABLE_MM) if len(part) > 1 else ()
    said = "x to the right and y up from 0, where the left and the lower edge meet"
    yield Text(said, (0.0, -(rows + 1) * ROW_OF_TABLE_MM - 3.0), "start", 2.2)


def _views(sheet: Sheet, scale: float) -> Iterator[Mark]:
    front = list(_front(sheet, scale))
    yield from front
    down = paper.extent(front)[1] - GAP_MM - scale * _bounds(sheet.plan)[3]
    yield from paper.moved(_plan(sheet, scale), 0.0, down)


def _bounds(view: View) -> paper.Box:
    points = np.array(
        [point for loops in (view.beyond, *(one.loops for one in view.regions)) for loop in loops for point in loop]
    )
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0, y0, x1, y1


def _fills(view: View, scale: float, hatched: bool) -> Iterator[Fill]:
    def scaled(loops: Sequence[Sequence[Point]]) -> tuple[tuple[Point, ...], ...]:
        return tuple(tuple((scale * u, scale * v) for u, v in loop) for loop in loops)

    if view.beyond:
        yield Fill(scaled(view.beyond), (0.97, 0.97, 0.97), None, "edge")
    for i, region in enumerate(view.regions):
        yield Fill(
            scaled(region.loops), region.colour, (45.0, 135.0)[i % 2] if hatched else None, "edge" if i else "outline"
        )


def _front(sheet: Sheet, scale: float) -> Iterator[Mark]:
    """Draw the section, its widths below it, its heights on its left, its windows on its right, its name above it."""
    view = sheet.front
    x0, y0, x1, y1 = (scale * end for end in _bounds(view))
    marks: list[Mark] = [*_fills(view, scale, sheet.hatched)]
    marks += [Line((scale * u, y0 - 3), (scale * u, y1 + 3), "centre") for u in view.axes]
    notes = list(_notes(view.notes, scale, (x0, x1), y1 + 9)) if view.notes else []
    marks += notes
    marks.append(Text("A-A", ((x0 + x1) / 2, y1 + (15 if notes else 5)), size=paper.LARGE_MM))
    running = [one for one in view.lengths if one.running]
    for side, edge, first in (("below", y0, FIRST_MM), ("left", x0, FIRST_MM + 16 * bool(running))):
        measured = [one for one in view.lengths if one.side == side and not one.running]
        marks += _stacked(measured, scale, edge, marks, first)
    marks += _running(running, scale, x0) if running else ()
    beside = [one for one in view.lengths if one.side == "right"]
    marks += _beside(beside, scale, x1) if beside else ()
    yield from marks


def _plan(sheet: Sheet, scale: float) -> Iterator[Mark]:
    """Draw the view from above, its lengths below and on its left, the line of the section, the names of holes."""
    view = sheet.plan
    x0, y0, x1, y1 = (scale * end for end in _bounds(view))
    marks: list[Mark] = [*_fills(view, scale, False)]
    marks += [Line((scale * u, y0 - 3), (scale * u, y1 + 3), "centre") for u in view.axes]
    for note in view.notes:
        u, v = scale * note.at[0], scale * note.at[1]
        marks += [Line((u, v), (u + 5, v + 5)), Text(note.text, (u + 5.6, v + 5.2), "start")]
    y = scale * sheet.cut
    for near, far in ((x0 - 2, x0 - 6), (x1 + 2, x1 + 6)):
        marks += [Line((near, y), (far, y), "end"), Line((far, y - 6), (far, y)), Arrow((far, y), (0.0, 1.0))]
        marks.append(Text("A", (far, y - 9), size=paper.LARGE_MM))
    marks.append(Line((x0 - 2, y), (x1 + 2, y), "cut"))
    if sheet.holes:
        at = scale * sheet.datum[0], scale * sheet.datum[1]
        marks += [Ring(at, 0.9), Text("0", (at[0] - 2.4, at[1] - 3.2))]
        points = np.array([point for region in view.regions for loop in region.loops for point in loop])
        for hole in sheet.holes:
            for radius in (d / 2 for d in hole.diameters[-1:]):
                near = abs(np.hypot(*(points - (hole.x, hole.y)).T) - radius) < ROUND_MM
                if np.count_nonzero(near) < LEAST_CORNERS:
                    marks.append(Ring((scale * hole.x, scale * hole.y), scale * radius, hidden=True))
        marks += _named(sheet.holes, scale, marks)
    for side, edge, first in (("below", y0, FIRST_MM), ("left", x0, BESIDE_CUT_MM)):
        marks += _stacked([one for one in view.lengths if one.side == side], scale, edge, marks, first)
    yield from marks


def _notes(notes: Sequence[svg.Note], scale: float, ends: Point, row: float) -> Iterator[Mark]:
    """Draw names in a row, each with a leader to its point."""
    at = [(scale * note.at[0], scale * note.at[1]) for note in notes]
    widths = [text_width(note.text, paper.TEXT_MM) for note in notes]
    middles = svg.spread([x for x, _ in at], widths, 3.0)
    for note, (x, y), middle in zip(notes, at, middles, strict=True):
        yield Text(note.text, (middle, row))
        yield Line((middle, row - 1.0), (x, y), "leader")
        yield Ring((x, y), 0.4, filled=True)


def _named(holes: Sequence[Hole], scale: float, marks: Sequence[Mark]) -> Iterator[Text]:
    """Draw the holes' names, each at the nearest place to its middle that is free of lines and of other names."""
    lines, taken = (
        paper.segments(mark for mark in marks if not _soft(mark)),
        [mark.box for mark in marks if isinstance(mark, Text)],
    )
    for hole in holes:
        x, y = scale * hole.x, scale * hole.y
        places = [(0.0, 0.0)]
        places += [
            (r * math.cos(turn), r * math.sin(turn))
            for r in np.arange(1.5, 12, 0.75).tolist()
            for turn in (math.tau * (i + 0.5) / 12 for i in range(12))
        ]
        best, least = None, math.inf
        for dx, dy in places:
            text = Text(hole.name, (x + dx, y + dy - paper.CAPITAL / 2 * paper.TEXT_MM))
            met = int(crossed(text.box, lines).sum()) + 100 * sum(overlap(text.box, box) for box in taken)
            if met < least:
                best, least = text, met
            if not met:
                break
        if best:
            taken.append(best.box)
            yield best


def _soft(mark: Mark) -> bool:
    return isinstance(mark, Line) and mark.kind in ("extension", "leader", "centre", "cut")


def _ring(number: int, at: Point, upright: bool = False) -> Iterator[Mark]:
    """Draw the number of a check in a ring about a point."""
    low = paper.CAPITAL / 2 * paper.TEXT_MM
    foot = (at[0] + low, at[1]) if upright else (at[0], at[1] - low)
    yield Ring(at, RING_MM)
    yield Text(str(number), foot, upright=upright)


_RINGED_MM = 2 * RING_MM + 0.8
"""Room that the ring takes in front of a text."""


def _stacked(
    lengths: Sequence[Length], scale: float, edge: float, marks: Sequence[Mark], first: float
) -> Iterator[Mark]:
    """Draw lengths next to a view whose edge is there, the shortest nearest, each clear of the texts before it."""
    drawn = list(marks)
    rows: dict[int, list[Point]] = {}
    for one in sorted(lengths, key=lambda one: (one.value, one.start)):
        best, least = None, math.inf
        lines = paper.segments(drawn)
        texts = [mark.box for mark in drawn if isinstance(mark, Text)]
        for row in range(ROWS):
            for place in ("middle", "end", "start"):
                placed, span = _placed(one, scale, edge, first + ROW_MM * row, place)
                if not placed or any(span[0] < b and a < span[1] for a, b in rows.get(row, ())):
                    continue
                met = sum(int(crossed(mark.box, lines).sum()) for mark in placed if isinstance(mark, Text))
                own = paper.segments(placed)
                met += sum(int(crossed(box, own).sum()) for box in texts)
                if met < least:
                    best, least = (row, placed, span), met
            if not least:
                break
        if best:
            row, placed, span = best
            rows.setdefault(row, []).append(span)
            drawn += placed
            yield from placed


def _placed(one: Length, scale: float, edge: float, out: float, place: str) -> tuple[list[Mark], Point]:
    """Draw a length at a distance from a view, its text in the `middle` of it or beyond an `end`; and from where to where.

    Nothing if the text has no room in the middle.
    """
    upright = one.side != "below"

    def at(along: float, away: float) -> Point:
        return (edge - away, along) if upright else (along, edge - away)

    ends = [scale * point[upright] for point in (one.start, one.end)]
    feet = [scale * point[not upright] - edge for point in (one.start, one.end)]
    ring = _RINGED_MM if one.check else 0.0
    wide = text_width(one.text, paper.TEXT_MM) + ring
    inside = ends[1] - ends[0] > 3 * paper.ARROW_MM
    tail = 0.0 if inside else 2 * paper.ARROW_MM
    low, high = ends[0] - tail, ends[1] + tail
    if place == "middle":
        if wide + 1.0 > ends[1] - ends[0]:
            return [], (0.0, 0.0)
        middle = (ends[0] + ends[1]) / 2
    elif place == "end":
        middle = high + 0.8 + wide / 2
        high += wide + 1.6
    else:
        middle = low - 0.8 - wide / 2
        low -= wide + 1.6
    marks: list[Mark] = []
    for end, foot in zip(ends, feet, strict=True):
        marks.append(Line(at(end, -foot), at(end, out + 1.0), "extension"))
    marks.append(Line(at(low, out), at(high, out)))
    for end, sign in zip(ends, (-1.0, 1.0), strict=True):
        way = sign if inside else -sign
        marks.append(Arrow(at(end, out), (0.0, way) if upright else (way, 0.0)))
    # A text is above its line, as it is read: an upright one from the right.
    above = out + 0.7 if upright else out - 0.7
    marks.append(Text(one.text, at(middle + ring / 2, above), upright=upright))
    if one.check:
        letters = paper.CAPITAL / 2 * paper.TEXT_MM
        centre = at(middle - wide / 2 + RING_MM, above + letters + 0.35 if upright else above - letters - 0.35)
        marks += _ring(one.check, centre, upright)
    return marks, (low - 0.6, high + 0.6)


def _running(lengths: Sequence[Length], scale: float, edge: float) -> Iterator[Mark]:
    """Draw heights from one face: a line with an arrow at each, numbers in a column on the left (ISO 129-1)."""
    x, labels = edge - 4.0, edge - 11.0
    levels = [scale * one.end[1] for one in lengths]
    yield Line((x, levels[0]), (x, levels[-1]))
    yield Ring((x, levels[0]), 0.6)
    sizes = [2 * RING_MM if one.check else paper.TEXT_MM for one in lengths]
    for one, level, place in zip(lengths, levels, svg.spread(levels, sizes, 0.6), strict=True):
        yield Line((scale * one.end[0], level), (x - 1.0, level), "extension")
        if level > levels[0]:
            yield Arrow((x, level), (0.0, 1.0))
        yield Line((x - 1.0, level), (labels + 2.0, place), "leader")
        yield Line((labels + 2.0, place), (labels + 0.6, place), "leader")
        yield Text(one.text, (labels, place - paper.CAPITAL / 2 * paper.TEXT_MM), "end")
        if one.check:
            wide = text_width(one.text, paper.TEXT_MM)
            yield from _ring(one.check, (labels - wide - 0.8 - RING_MM, place))


def _beside(lengths: Sequence[Length], scale: float, edge: float) -> Iterator[Mark]:
    """Draw windows on the right of a section: a dimension line each, the text beside it."""
    x, labels = edge + 5.0, edge + 11.0
    middles = [scale * (one.start[1] + one.end[1]) / 2 for one in lengths]
    for one, middle, place in zip(
        lengths, middles, svg.spread(middles, [paper.TEXT_MM] * len(lengths), 0.8), strict=True
    ):
        low, high = scale * one.start[1], scale * one.end[1]
        inside = high - low > 3 * paper.ARROW_MM
        tail = 0.0 if inside else 2 * paper.ARROW_MM
        yield Line((x, low - tail), (x, high + tail))
        for level, sign in ((low, -1.0), (high, 1.0)):
            yield Line((scale * one.start[0], level), (x + 1.0, level), "extension")
            yield Arrow((x, level), (0.0, sign if inside else -sign))
        yield Line((x, middle), (labels - 0.6, place), "leader")
        yield Text(one.text, (labels, place - paper.CAPITAL / 2 * paper.TEXT_MM), "start")

r"""Tools larger than the printer's bed: cut at dovetails, whose pieces slide together along z.

       piece 1        piece 2
    ------------.  .-------------      the line of a seam, seen from above: round corners, teeth of piece 1 in piece 2
               /  /  .------.
    ----------'  /  /            y
      tooth     |  |             |
    ----------.  \  \            '-- x
               \  \  '------'
    ------------'  '-------------

Either side of the line is moved square to itself by half the play, so that the gap is the play everywhere, along the
flanks too. A seam goes from edge to edge. Seams across x and across y cross on straight stretches: the corners of the
four pieces are whole, and no tooth is cut.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

from unitcad.geometry.segments import Point, to_segment
from unitcad.shape import Common, Extrude, Profile, Shape, turned
from unitcad.shape.body import Body

FLANK_DEG = 30.0
"""Of a flank against the way that pulls the pieces apart: they part by play / sin(30) = 2 plays before it bears."""
ROUND = 0.8
"""Radius of the line's corners, mm: a nozzle follows it, and the gap stays the play round them."""
TOOTH_PITCH = 14.0
FAR = 1000.0
"""Begin and end of lines, beyond every tool, mm."""
Interval = tuple[float, float]
Axis = Literal["x", "y"]


@dataclass(frozen=True)
class Dovetail:
    """A tooth's depth and its width at the foot, mm."""

    depth: float
    neck: float

    @property
    def tip(self) -> float:
        """Its width at the tip, mm."""
        return self.neck + 2 * self.depth * math.tan(math.radians(FLANK_DEG))


LARGE, SMALL = Dovetail(3.5, 5.0), Dovetail(2.5, 4.0)
"""SMALL is for narrow gaps between units."""


@dataclass(frozen=True)
class Tooth:
    """A tooth on a seam's line: the middle of its foot, the line's way there, on its right (1) or left (-1)."""

    middle: Point
    way: Point
    side: int
    size: Dovetail = LARGE

    @property
    def corners(self) -> tuple[Point, ...]:
        """Its corners along the line's way: foot, tip, tip, foot."""
        (ux, uy), size = self.way, self.size
        deep = self.side * uy * size.depth, -self.side * ux * size.depth
        half = -size.neck / 2, -size.tip / 2, size.tip / 2, size.neck / 2
        return tuple(
            (self.middle[0] + ux * by + out * deep[0], self.middle[1] + uy * by + out * deep[1])
            for by, out in zip(half, (0, 1, 1, 0), strict=True)
        )


@dataclass(frozen=True)
class Seam:
    """A cut across x or y: `at` there, and the gap between the pieces (mm).

    `line` goes from far below to far above, `teeth` are on it, in the frame of the tools; for a seam across y that
    frame is turned by a quarter, (y, -x): there too the seam goes from below to above.
    """

    at: float
    line: tuple[Point, ...]
    teeth: tuple[Tooth, ...]
    play: float
    across: Axis = "x"

    @property
    def corners(self) -> tuple[Point, ...]:
        """The line's corners with those of its teeth, without its ends."""
        found: list[Point] = []
        for start, end in pairwise(self.line):
            there = [tooth for tooth in self.teeth if to_segment(tooth.middle, start, end) < 1e-6]
            found += [c for tooth in sorted(there, key=lambda t: math.dist(start, t.middle)) for c in tooth.corners]
            found.append(end)
        return tuple(found[:-1])

    @property
    def extent(self) -> Interval:
        """Its lower and upper end along the axis that it is across, mm."""
        reached = [x for x, _ in (*self.line, *self.corners)]
        return min(reached), max(reached)

    def side(self, of: int) -> tuple[tuple[float, float, float], ...]:
        """Return the border of the piece on the left (-1) or right (1) of the line, from below, with bulges."""
        shift = -of * self.play / 2  # to the left of the way along the line
        line = (self.line[0], *self.corners, self.line[-1])
        ways = [_unit(a, b) for a, b in pairwise(line)]
        border = [(*_beside(line[0], ways[0], shift), 0.0)]
        for corner, before, after in zip(line[1:-1], ways[:-1], ways[1:], strict=True):
            turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
            tangent = ROUND * abs(math.tan(turn / 2))
            start, end = _along(corner, before, -tangent), _along(corner, after, tangent)
            border += [(*_beside(start, before, shift), math.tan(turn / 4)), (*_beside(end, after, shift), 0.0)]
        return (*border, (*_beside(line[-1], ways[-1], shift), 0.0))


@dataclass(frozen=True)
class Split:
    """A tool by its name, and the pieces that it is printed in: row by row from the top, each row from -x to +x."""

    tool: str
    pieces: tuple[Body, ...]
    seams: tuple[Seam, ...]

    @property
    def columns(self) -> int:
        """The number of pieces in a row."""
        return 1 + sum(seam.across == "x" for seam in self.seams)

    @property
    def crossings(self) -> tuple[Point, ...]:
        """The meeting point of four pieces."""
        over = [seam.line[0][0] for seam in self.seams if seam.across == "y"]
        return tuple((at(seam.line, y), y) for seam in self.seams if seam.across == "x" for y in over)


def split(tool: Body, seams: Sequence[Seam]) -> Split:
    """Cut a tool at its seams. The pieces are named by the tool and a number: base-1, base-2 ..."""
    across, along = (sorted((s for s in seams if s.across == axis), key=lambda s: s.at) for axis in ("x", "y"))
    columns: list[list[Shape]] = [[_between(*ends)] if across else [] for ends in pairwise((None, *across, None))]
    rows: list[list[Shape]] = [
        [turned(_between(*ends), "z", 1)] if along else [] for ends in pairwise((None, *along, None))
    ]
    within = [(*column, *row) for row in reversed(rows) for column in columns]
    pieces = tuple(
        replace(tool, name=f"{tool.name}-{i}", shape=Common((tool.shape, *shapes)))
        for i, shapes in enumerate(within, 1)
    )
    return Split(tool.name, pieces, (*across, *along))


def straight(
    where: float, stretches: Sequence[Interval], play: float, across: Axis = "x", size: Dovetail = LARGE
) -> Seam:
    """Return a straight seam whose teeth, all to one side, have their middle at `where` and are within `stretches`."""
    x = where - size.depth / 2
    teeth = tuple(Tooth((x, y), (0.0, 1.0), 1, size) for ends in stretches for y in evenly(ends, size))
    return Seam(where, ((x, -FAR), (x, FAR)), teeth, play, across)


def evenly(within: Interval, size: Dovetail) -> list[float]:
    """Return the middles of as many teeth as fit an interval at their pitch; none without room."""
    middle, width = sum(within) / 2, within[1] - within[0]
    if width < size.tip - 1e-9:
        return []
    count = max(1, math.floor((width - size.tip) / TOOTH_PITCH) + 1)
    return [middle + (i - (count - 1) / 2) * TOOTH_PITCH for i in range(count)]


def at(line: Sequence[Point], y: float) -> float:
    """Return x of a line that goes upwards at a height y that it passes."""
    for (x0, y0), (x1, y1) in pairwise(line):
        if y0 <= y <= y1:
            return x0 + (x1 - x0) * (y - y0) / (y1 - y0)
    raise ValueError(f"the line does not pass y = {y:g}")


def seen(point: Point, across: Axis) -> Point:
    """Return a point in the frame of the seams across an axis."""
    return point if across == "x" else (point[1], -point[0])


def unseen(point: Point, across: Axis) -> Point:
    """Return a point of the frame of the seams across an axis in the frame of the tools."""
    return point if across == "x" else (-point[1], point[0])


def length(seam: Seam, low: float, high: float) -> float:
    """Return how long a seam's line is between two heights, between which it turns, its corners round (mm)."""
    ends = (at(seam.line, low), low), (at(seam.line, high), high)
    line = (ends[0], *(corner for corner in seam.corners if low < corner[1] < high), ends[1])
    angles = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(line)]
    turns = [abs(math.remainder(after - before, 2 * math.pi)) for before, after in pairwise(angles)]
    return sum(math.dist(*each) for each in pairwise(line)) - ROUND * sum(2 * math.tan(t / 2) - t for t in turns)


def strips(seam: Seam, by: float) -> Iterator[tuple[Point, ...]]:
    """Yield rectangles that cover all that is nearer to a seam's line than `by`, and its teeth, in the seam's frame."""
    for start, end in pairwise((seam.line[0], *seam.corners, seam.line[-1])):
        way = _unit(start, end)
        ends = _along(start, way, -by), _along(end, way, by)
        yield tuple(_beside(ends[i], way, side * by) for i, side in ((0, -1), (1, -1), (1, 1), (0, 1)))
    for tooth in seam.teeth:
        yield tooth.corners[:: tooth.side]


def _between(left: Seam | None, right: Seam | None) -> Shape:
    """Draw the region between two seams; without one it reaches far out."""
    up = right.side(-1) if right else ((FAR, -FAR, 0.0), (FAR, FAR, 0.0))
    down = left.side(1) if left else ((-FAR, -FAR, 0.0), (-FAR, FAR, 0.0))
    # Walked the other way, an arc's bulge is at its other end and turns to the other side.
    bulges = [-bulge for _, _, bulge in down[:-1]]
    back = [(x, y, bulge) for (x, y, _), bulge in zip(reversed(down), [*reversed(bulges), 0.0], strict=True)]
    return Extrude(Profile((*up, *back)), -FAR, FAR)


def _unit(a: Point, b: Point) -> Point:
    length = math.dist(a, b)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _along(point: Point, way: Point, by: float) -> Point:
    return point[0] + way[0] * by, point[1] + way[1] * by


def _beside(point: Point, way: Point, by: float) -> Point:
    """Return the point moved to the left of a way by `by`."""
    return point[0] - way[1] * by, point[1] + way[0] * by

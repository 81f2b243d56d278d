r"""Cuts of tools larger than the printer's bed, and the dovetails whose pieces slide together along z.

       piece 1        piece 2
    ------------.  .-------------      the line of a seam, seen from above: round corners, teeth of piece 1 in piece 2
               /  /  .------.
    ----------'  /  /            y
      tooth     |  |             |
    ----------.  \  \            '-- x
               \  \  '------'
    ------------'  '-------------

Either side of the line is moved square to itself by half the play, so that the gap is the play everywhere, along the
flanks too. A seam is straight and goes from edge to edge; all seams of a tool are across one axis.

In a wide gap the teeth reach to one side. In a narrow one the line is in the middle, with small teeth to either side if
the features leave room.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Literal, NamedTuple

from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, nearer
from unitcad.shape import Common, Extrude, Profile, Shape, turned
from unitcad.shape.tree import Body

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
    """A tooth on a seam's line: the middle of its foot, on the line's right (1) or left (-1)."""

    x: float
    y: float
    side: int = 1
    size: Dovetail = LARGE

    @property
    def corners(self) -> tuple[Point, ...]:
        """Its corners, upwards along the line: foot, tip, tip, foot."""
        size, deep = self.size, self.x + self.side * self.size.depth
        half = -size.neck / 2, -size.tip / 2, size.tip / 2, size.neck / 2
        return tuple((x, self.y + by) for x, by in zip((self.x, deep, deep, self.x), half, strict=True))


@dataclass(frozen=True)
class Seam:
    """A cut across x or y: the middle of its gap, the line's place, the teeth on it, the gap of the pieces (mm).

    In the frame of the tools; for a seam across y that frame is turned by a quarter, (y, -x): there too the seam goes
    from below to above.
    """

    at: float
    x: float
    teeth: tuple[Tooth, ...]
    play: float
    across: Axis = "x"

    @property
    def line(self) -> tuple[Point, ...]:
        """Its corners, from far below to far above."""
        teeth = sorted(self.teeth, key=lambda tooth: tooth.y)
        return ((self.x, -FAR), *(corner for tooth in teeth for corner in tooth.corners), (self.x, FAR))

    @property
    def extent(self) -> Interval:
        """Its lower and upper end along the axis that it is across, mm."""
        reached = [x for x, _ in self.line]
        return min(reached), max(reached)

    def side(self, of: int) -> tuple[tuple[float, float, float], ...]:
        """Return the border of the piece on the left (-1) or right (1) of the line, from below, with bulges."""
        shift = -of * self.play / 2  # to the left of the way along the line
        line = self.line
        ways = [_unit(a, b) for a, b in pairwise(line)]
        border = [(*_left_of(line[0], ways[0], shift), 0.0)]
        for corner, before, after in zip(line[1:-1], ways[:-1], ways[1:], strict=True):
            turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
            tangent = ROUND * abs(math.tan(turn / 2))
            start, end = _along(corner, before, -tangent), _along(corner, after, tangent)
            border += [(*_left_of(start, before, shift), math.tan(turn / 4)), (*_left_of(end, after, shift), 0.0)]
        return (*border, (*_left_of(line[-1], ways[-1], shift), 0.0))


@dataclass(frozen=True)
class Split:
    """A tool by its name, the pieces that it is printed in, and their seams: from -x to +x, or from the top down."""

    tool: str
    pieces: tuple[Body, ...]
    seams: tuple[Seam, ...]

    @property
    def columns(self) -> int:
        """The number of pieces in a row."""
        return len(self.pieces) if self.seams[0].across == "x" else 1


def split(tool: Body, seams: Sequence[Seam]) -> Split:
    """Cut a tool at its seams. The pieces are named by the tool and a number: base-1, base-2 ..."""
    ordered = sorted(seams, key=lambda seam: seam.at)
    parts = [_between(*ends) for ends in pairwise((None, *ordered, None))]
    if ordered[0].across == "y":
        parts = [turned(part, "z", 1) for part in reversed(parts)]
    pieces = (
        replace(tool, name=f"{tool.name}-{i}", shape=Common((tool.shape, part))) for i, part in enumerate(parts, 1)
    )
    return Split(tool.name, tuple(pieces), tuple(ordered))


def to_seam_frame(point: Point, across: Axis) -> Point:
    """Return a point in the frame of the seams across an axis."""
    return point if across == "x" else (point[1], -point[0])


def unseen(point: Point, across: Axis) -> Point:
    """Return a point of the frame of the seams across an axis in the frame of the tools."""
    return point if across == "x" else (-point[1], point[0])


def length(seam: Seam, low: float, high: float) -> float:
    """Return how long a seam's line is between two heights, between which its teeth are, its corners round (mm)."""
    line = ((seam.x, low), *seam.line[1:-1], (seam.x, high))
    angles = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(line)]
    turns = [abs(math.remainder(after - before, 2 * math.pi)) for before, after in pairwise(angles)]
    return sum(math.dist(*each) for each in pairwise(line)) - ROUND * sum(2 * math.tan(t / 2) - t for t in turns)


def strips(seam: Seam, by: float) -> Iterator[tuple[Point, ...]]:
    """Yield rectangles that cover all that is nearer to a seam's line than `by`, and its teeth, in the seam's frame."""
    for start, end in pairwise(seam.line):
        way = _unit(start, end)
        ends = _along(start, way, -by), _along(end, way, by)
        yield tuple(_left_of(ends[i], way, side * by) for i, side in ((0, -1), (1, -1), (1, 1), (0, 1)))
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


def _left_of(point: Point, way: Point, by: float) -> Point:
    """Return the point moved to the left of a way by `by`."""
    return point[0] - way[1] * by, point[1] + way[0] * by


BESIDE = 1.2
"""From a seam to a feature of the tool, at least, mm."""
FREE = LARGE.depth + 2 * BESIDE
"""Width of a wide gap, mm."""
STEP = 0.5
"""Between two places that are tried for a tooth, mm."""


class Feature(NamedTuple):
    """A region without cuts: a convex polygon by its corners, and its surroundings within `radius` (mm)."""

    corners: tuple[Point, ...]
    radius: float = 0.0

    @property
    def extent(self) -> Interval:
        """Its extent along x, mm."""
        return min(x for x, _ in self.corners) - self.radius, max(x for x, _ in self.corners) + self.radius


@dataclass(frozen=True)
class Sized:
    """A tool that exceeds the bed along an axis: its `ends` there and the `bed`, mm.

    `choices`: seams, of which later ones are tried if earlier ones don't fit.
    """

    across: Axis
    ends: Interval
    bed: float
    choices: tuple[tuple[Seam, ...], ...]


def seams(
    sized: Sized,
    what: str,
    other: Sequence[Seam] = (),
    fault: Callable[[Sequence[Seam]], str] = lambda found: "",
) -> tuple[Seam, ...]:
    """Return the fewest seams with which all pieces of a tool fit the bed.

    Among these the longest piece is as short as it can be. If possible, none is over a seam of the tool under it
    (`other`): each tool then joins the other's pieces. `fault` returns the fault of seams, "" if there is none. Raises
    Refusal for a bed that no such cut makes large enough, with the least that is.
    """
    found = _found(sized, sized.bed, other)
    why = f"{what} exceeds the bed, and the cuts leave longer pieces" if found is None else fault(found)
    if found is not None and not why:
        return tuple(found)
    lengths = _all_lengths(sized, [seam for choice in sized.choices for seam in choice])
    beds = sorted({math.ceil(10 * most - 1e-6) / 10 for most in lengths if most > sized.bed})

    def enough(bed: float) -> bool:
        tried = _found(sized, bed, other)
        return tried is not None and not fault(tried)

    least = beds[min(bisect(beds, False, key=enough), len(beds) - 1)]
    raise Refusal(f"moulds.bed_{sized.across}_mm", sized.bed, why, least)


def in_gaps(
    ends: Interval,
    features: Iterable[Feature],
    teeth: Interval,
    avoided: Sequence[Feature],
    play: float,
    across: Axis = "x",
    *,
    narrow: bool = False,
) -> tuple[Seam, ...]:
    """Return a seam in the middle of each wide gap between features, and of each `narrow` one that has room for a line.

    Gaps are along x in the seams' frame, the features taken from edge to edge. Teeth, within the interval `teeth`, are
    clear of the features `avoided`; a gap without room for one has no seam.
    """
    found, reached = list[Seam](), ends[0]
    for low, high in (*sorted(feature.extent for feature in features), (ends[1], ends[1])):
        if low - reached >= (2 * BESIDE if narrow else FREE):
            wide, middle = low - reached >= FREE, (reached + low) / 2
            x = middle - LARGE.depth / 2 if wide else middle
            if fitted := _fitting(x, wide, teeth, avoided):
                found.append(Seam(middle, x, tuple(fitted), play, across))
        reached = max(reached, high)
    return tuple(found)


def _fitting(x: float, wide: bool, within: Interval, features: Sequence[Feature]) -> list[Tooth]:
    """Return the teeth of a line, clear of the features, in the middle of their room."""
    sides, size = ((1,), LARGE) if wide else ((1, -1), SMALL)
    ends = (x, within[0]), (x, within[1])
    near = [f for f in features if nearer(ends, f.corners, f.radius + size.depth + BESIDE)]

    def clear(tooth: Tooth) -> bool:
        return not any(nearer(tooth.corners, corners, radius + BESIDE - 1e-9) for corners, radius in near)

    at_pitch = [Tooth(x, y) for y in _evenly(within, LARGE)] if wide else []
    if at_pitch and all(map(clear, at_pitch)):
        return at_pitch
    middle, count = sum(within) / 2, 2 * math.floor((within[1] - within[0] - size.tip) / 2 / STEP)
    found: list[Tooth] = []
    for side in sides:
        runs: list[list[float]] = []
        for by in [(i - count / 2) * STEP for i in range(count + 1)]:
            if not clear(Tooth(x, middle + by, side, size)):
                continue
            if runs and by - runs[-1][-1] < 1.5 * STEP:
                runs[-1].append(by)
            else:
                runs.append([by])
        for run in runs:
            room = run[0] - size.tip / 2, run[-1] + size.tip / 2
            found += [Tooth(x, middle + by, side, size) for by in _evenly(room, size)]
    teeth: list[Tooth] = []
    for tooth in sorted(found, key=lambda tooth: tooth.y):
        if not teeth or tooth.y - teeth[-1].y >= TOOTH_PITCH - STEP:
            teeth.append(tooth)
    return teeth


def _evenly(within: Interval, size: Dovetail) -> list[float]:
    """Return the middles of as many teeth as fit an interval at their pitch; none without room."""
    middle, width = sum(within) / 2, within[1] - within[0]
    if width < size.tip - 1e-9:
        return []
    count = max(1, math.floor((width - size.tip) / TOOTH_PITCH) + 1)
    return [middle + (i - (count - 1) / 2) * TOOTH_PITCH for i in range(count)]


def _found(sized: Sized, bed: float, other: Sequence[Seam]) -> list[Seam] | None:
    """Return the seams with which pieces fit a bed; None if none do."""
    taken = {seam.at for seam in other if seam.across == sized.across}
    for choice in sized.choices:
        found = _fewest(sized, choice, bed)
        if found is not None:
            staggered = _fewest(sized, [seam for seam in choice if seam.at not in taken], bed)
            return staggered if staggered is not None and len(staggered) == len(found) else found
    return None


def _fewest(sized: Sized, choice: Sequence[Seam], bed: float) -> list[Seam] | None:
    """Return the fewest cuts with which no piece is longer than the bed, the longest as short as can be; or None."""
    found = _reaching(sized, choice, bed)
    if found is None:
        return None
    for most in _all_lengths(sized, choice):
        better = _reaching(sized, choice, min(most, bed))
        if better is not None and len(better) == len(found):
            return better
    return found


def _reaching(sized: Sized, choice: Sequence[Seam], most: float) -> list[Seam] | None:
    """Return cuts from below on, each as far as a piece of length `most` reaches; None if one would be longer."""
    chosen: list[Seam] = []
    start, reached = sized.ends[0], -math.inf
    while sized.ends[1] - start > most + 1e-9:
        near = [s for s in choice if s.extent[0] > reached + BESIDE and s.extent[1] - start <= most + 1e-9]
        if not near:
            return None
        chosen.append(max(near, key=lambda seam: seam.at))
        start, reached = chosen[-1].extent
    return chosen


def _all_lengths(sized: Sized, choice: Sequence[Seam]) -> list[float]:
    """Return every length that a piece can have, the shortest first."""
    marks = [(sized.ends[0], sized.ends[0]), *(seam.extent for seam in choice), (sized.ends[1], sized.ends[1])]
    return sorted({after[1] - before[0] for before, after in combinations(sorted(marks), 2)})

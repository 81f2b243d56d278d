r"""Cuts of tools larger than the printer's bed, and the dovetails whose pieces slide together along z.

Tools larger than the printer's bed: cut at dovetails, whose pieces slide together along z.

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

In a wide gap a seam is straight and its teeth reach to one side. In a narrow one its line is in the middle, with small
teeth to either side if the features leave room: between four units of a grid, or three of a hexagon.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Literal, NamedTuple

from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, between_convex, nearer, to_segment
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
        border = [(*_left_of(line[0], ways[0], shift), 0.0)]
        for corner, before, after in zip(line[1:-1], ways[:-1], ways[1:], strict=True):
            turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
            tangent = ROUND * abs(math.tan(turn / 2))
            start, end = _along(corner, before, -tangent), _along(corner, after, tangent)
            border += [(*_left_of(start, before, shift), math.tan(turn / 4)), (*_left_of(end, after, shift), 0.0)]
        return (*border, (*_left_of(line[-1], ways[-1], shift), 0.0))


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


def to_seam_frame(point: Point, across: Axis) -> Point:
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


class Place(NamedTuple):
    """Place of a cut: the middle of a gap, and the line of its seam, in the frame of its seam."""

    at: float
    line: tuple[Point, ...]
    wide: bool = False

    @property
    def extent(self) -> Interval:
        """Lower and upper limit of its seam, teeth included, mm."""
        if self.wide:
            return self.at - LARGE.depth / 2, self.at + LARGE.depth / 2
        return min(x for x, _ in self.line) - SMALL.depth, max(x for x, _ in self.line) + SMALL.depth


@dataclass(frozen=True)
class Sized:
    """A tool that exceeds the bed along an axis, in the frame of the seams across that axis, mm.

    `ends` of the tool, the `bed`, `teeth`: places of teeth along the seams; `features` that teeth keep clear of.
    `choices`: places for cuts; later ones are tried if earlier ones don't fit.
    """

    across: Axis
    ends: Interval
    bed: float
    teeth: Interval
    features: tuple[Feature, ...]
    choices: tuple[tuple[Place, ...], ...]


def seams(
    tool: Iterable[Sized],
    what: str,
    play: float,
    other: Sequence[Seam] = (),
    fault: Callable[[Sequence[Seam]], str] = lambda found: "",
) -> tuple[Seam, ...]:
    """Return the seams of a tool whose pieces all fit the bed, as few as possible, along the axes that it exceeds.

    Among these the longest piece is as short as it can be. If possible, none is over a seam of the tool under it
    (`other`): each tool then joins the other's pieces. Teeth join all pieces, though not each two that share a border.
    `fault` returns the fault of seams, "" if there is none. Raises Refusal for a bed that no such cut makes large
    enough, with the least that is.
    """
    sized = tuple(tool)
    found = _found(sized, play, other)
    why = fault(found) if isinstance(found, tuple) else f"{what} exceeds the bed, and the cuts leave longer pieces"
    if isinstance(found, tuple) and not why:
        return found
    # The axis along which no cut was found first.
    for each in sorted(sized, key=lambda each: each.across != found):
        places = [place for choice in each.choices for place in choice]
        beds = sorted({math.ceil(10 * most - 1e-6) / 10 for most in _all_lengths(each, places) if most > each.bed})

        def enough(bed: float, each: Sized = each) -> bool:
            larger = [replace(one, bed=bed) if one is each else one for one in sized]
            tried = _found([one for one in larger if one.ends[1] - one.ends[0] > one.bed + 1e-9], play, other)
            return isinstance(tried, tuple) and not fault(tried)

        least = bisect(beds, False, key=enough)
        if least < len(beds):
            raise Refusal(f"moulds.bed_{each.across}_mm", each.bed, why, beds[least])
    first = next(each for each in sized if each.across == found or isinstance(found, tuple))
    needed = math.ceil(10 * (first.ends[1] - first.ends[0]) - 1e-6) / 10
    raise Refusal(f"moulds.bed_{first.across}_mm", first.bed, why, needed)


def _found(sized: Sequence[Sized], play: float, other: Sequence[Seam]) -> tuple[Seam, ...] | Axis:
    """Return the seams of a tool, or the axis along which no cuts give pieces that fit the bed."""
    useless = set[tuple[Axis, Place]]()
    while True:
        chosen: list[tuple[Sized, Place]] = []
        for each in sized:
            places = _cuts(each, other, useless)
            if places is None:
                return each.across
            chosen += [(each, place) for place in places]
        bare = [Seam(place.at, place.line, (), play, each.across) for each, place in chosen]
        made = [add_teeth(place, each, play, [s for s in bare if s.across != each.across]) for each, place in chosen]
        found = [seam for seam in made if seam]
        if len(found) == len(chosen) and _joined(found):
            return tuple(found)
        poor = [not seam or not all(_stretches(seam, found)) for seam in made]
        useless |= {(each.across, place) for (each, place), few in zip(chosen, poor, strict=True) if few}


def _heights(seam: Seam, others: Iterable[Seam]) -> list[float]:
    """Return the crossings of a seam with those across the other axis, from below, in its frame."""
    crossing = [other for other in others if other.across != seam.across]
    if seam.across == "x":
        return sorted(other.line[0][0] for other in crossing)
    return sorted(-at(other.line, seam.line[0][0]) for other in crossing)


def _stretches(seam: Seam, others: Iterable[Seam]) -> list[int]:
    """Return how many teeth a seam has on each stretch between crossings, from below, in its frame."""
    heights = _heights(seam, others)
    places = [bisect(heights, tooth.middle[1]) for tooth in seam.teeth]
    return [places.count(i) for i in range(len(heights) + 1)]


def _joined(found: Sequence[Seam]) -> bool:
    """Tell whether teeth join all pieces, over one another."""
    columns, rows = (sorted((s for s in found if s.across == axis), key=lambda s: s.at) for axis in ("x", "y"))
    links = [
        *(((i, j), (i + 1, j)) for i, s in enumerate(columns) for j, n in enumerate(_stretches(s, found)) if n),
        # Seen along a seam across y, columns go from right to left.
        *(((i, j), (i, j + 1)) for j, s in enumerate(rows) for i, n in enumerate(_stretches(s, found)[::-1]) if n),
    ]
    reached = {(0, 0)}
    while more := {piece for link in links if reached & set(link) for piece in link} - reached:
        reached |= more
    return len(reached) == (len(columns) + 1) * (len(rows) + 1)


def gaps(ends: Interval, features: Iterable[Feature], least: float) -> Iterator[Interval]:
    """Yield the gaps along x that are as wide as `least`, between features that are taken from edge to edge."""
    reached = ends[0]
    for low, high in (*sorted(feature.extent for feature in features), (ends[1], ends[1])):
        if low - reached >= least:
            yield reached, low
        reached = max(reached, high)


def in_gaps(ends: Interval, features: Sequence[Feature], *, narrow: bool = False) -> Iterator[Place]:
    """Yield a place in the middle of each wide gap, and of each `narrow` one too that leaves room for a line."""
    for low, high in gaps(ends, features, 2 * BESIDE if narrow else FREE):
        wide, middle = high - low >= FREE, (low + high) / 2
        x = middle - LARGE.depth / 2 if wide else middle
        yield Place(middle, ((x, -FAR), (x, FAR)), wide)


def add_teeth(place: Place, sized: Sized, play: float, crossing: Sequence[Seam] = ()) -> Seam | None:
    """Return the seam at a place, with teeth clear of the seams that cross it (`crossing`); None without room."""
    heights = _heights(Seam(place.at, place.line, (), play, sized.across), crossing)
    way = {"x": lambda p: (-p[1], p[0]), "y": lambda p: to_seam_frame(p, "y")}[sized.across]
    lines = [tuple(way(point) for point in seam.line) for seam in crossing]
    features = (*sized.features, *(Feature(ends, LARGE.depth) for line in lines for ends in pairwise(line)))
    teeth: list[Tooth] = []
    for low, high in pairwise((sized.teeth[0], *heights, sized.teeth[1])):
        keep = LARGE.depth + BESIDE
        within = low + keep * (low in heights), high - keep * (high in heights)
        teeth += _fitting(place, within, features)
    return Seam(place.at, place.line, tuple(teeth), play, sized.across) if teeth else None


def _fitting(place: Place, within: Interval, features: Sequence[Feature]) -> list[Tooth]:
    """Return the teeth of a place's line, clear of the features, in the middle of their room."""
    if place.wide:
        at_pitch = [Tooth((place.line[0][0], y), (0.0, 1.0), 1) for y in evenly(within, LARGE)]
        if all(_clear(tooth, features) for tooth in at_pitch):
            return at_pitch
    sides, size = ((1,), LARGE) if place.wide else ((1, -1), SMALL)
    found = [
        tooth
        for ends in pairwise(place.line)
        for side in sides
        for tooth in _beside(*ends, within, side, size, features)
    ]
    teeth: list[Tooth] = []
    for tooth in sorted(found, key=lambda t: t.middle[1]):
        if not teeth or math.dist(tooth.middle, teeth[-1].middle) >= TOOTH_PITCH - STEP:
            teeth.append(tooth)
    return teeth


def _beside(
    start: Point, end: Point, within: Interval, side: int, size: Dovetail, features: Sequence[Feature]
) -> Iterator[Tooth]:
    """Yield the teeth that fit along one straight stretch of a line."""
    low, high = max(start[1], within[0]), min(end[1], within[1])
    length = math.dist(start, end)
    way = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    # Round corners of the line are off a tooth's foot.
    room = (high - low) / way[1] - size.tip - 2 * BESIDE * (start[0] != end[0])
    if room < 0:
        return
    y = (low + high) / 2
    middle = start[0] + way[0] * (y - start[1]) / way[1], y
    near = [f for f in features if nearer((start, end), f.corners, f.radius + size.depth + BESIDE)]
    count = 2 * math.floor(room / 2 / STEP)
    runs: list[list[float]] = []
    for by in [(i - count / 2) * STEP for i in range(count + 1)]:
        if not _clear(_shifted(middle, way, by, side, size), near):
            continue
        if runs and by - runs[-1][-1] < 1.5 * STEP:
            runs[-1].append(by)
        else:
            runs.append([by])
    for run in runs:
        for by in evenly((run[0] - size.tip / 2, run[-1] + size.tip / 2), size):
            yield _shifted(middle, way, by, side, size)


def _shifted(middle: Point, way: Point, by: float, side: int, size: Dovetail) -> Tooth:
    return Tooth((middle[0] + way[0] * by, middle[1] + way[1] * by), way, side, size)


def _clear(tooth: Tooth, features: Iterable[Feature]) -> bool:
    """Tell whether a tooth keeps clear of features."""
    reach, corners = tooth.size.tip + tooth.size.depth + BESIDE, tooth.corners
    for points, radius in features:
        # Far off along either axis: the distance need not be worked out.
        if any(
            min(p[i] for p in points) - radius - reach > tooth.middle[i]
            or max(p[i] for p in points) + radius + reach < tooth.middle[i]
            for i in (0, 1)
        ):
            continue
        if between_convex(corners, points) < radius + BESIDE - 1e-9:
            return False
    return True


def _cuts(sized: Sized, other: Sequence[Seam], useless: set[tuple[Axis, Place]]) -> list[Place] | None:
    """Return the places of the cuts across one axis; None if none give pieces that fit."""
    taken = {seam.at for seam in other if seam.across == sized.across}
    for choice in sized.choices:
        places = sorted(place for place in choice if (sized.across, place) not in useless)
        found = _fewest(sized, places)
        if found is not None:
            staggered = _fewest(sized, [place for place in places if place.at not in taken])
            return staggered if staggered is not None and len(staggered) == len(found) else found
    return None


def _fewest(sized: Sized, places: Sequence[Place]) -> list[Place] | None:
    """Return the fewest cuts with which no piece is longer than the bed, the longest as short as can be; or None."""
    found = _reaching(sized, places, sized.bed)
    if found is None:
        return None
    for most in _all_lengths(sized, places):
        better = _reaching(sized, places, min(most, sized.bed))
        if better is not None and len(better) == len(found):
            return better
    return found


def _reaching(sized: Sized, places: Sequence[Place], most: float) -> list[Place] | None:
    """Return cuts from below on, each as far as a piece of length `most` reaches; None if one would be longer."""
    chosen: list[Place] = []
    start, reached = sized.ends[0], -math.inf
    while sized.ends[1] - start > most + 1e-9:
        near = [p for p in places if p.extent[0] > reached + BESIDE and p.extent[1] - start <= most + 1e-9]
        if not near:
            return None
        chosen.append(max(near, key=lambda place: place.at))
        start, reached = chosen[-1].extent
    return chosen


def _all_lengths(sized: Sized, places: Sequence[Place]) -> list[float]:
    """Return every length that a piece can have, the shortest first."""
    marks = [(sized.ends[0], sized.ends[0]), *(place.extent for place in places), (sized.ends[1], sized.ends[1])]
    return sorted({after[1] - before[0] for before, after in combinations(marks, 2)})

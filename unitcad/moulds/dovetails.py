r"""Tools larger than the printer's bed: cut across x at dovetails, whose pieces slide together along z.

       piece 1        piece 2
    ------------.  .-------------      the line of a seam, seen from above: round corners, teeth of piece 1 in piece 2
               /  /  .------.
    ----------'  /  /            y
      tooth     |  |             |
    ----------.  \  \            '-- x
               \  \  '------'
    ------------'  '-------------

Either side of the line is moved square to itself by half the play, so that the gap is the play everywhere, along the
flanks too. A cut lies in the middle of a gap between features, so that it meets none of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

from unitcad.errors import Refusal
from unitcad.shape import Common, Extrude, Profile
from unitcad.shape.body import Body

DEPTH = 3.5
"""Of a tooth, mm."""
NECK = 5.0
"""Width of a tooth at its foot, mm."""
FLANK_DEG = 30.0
"""Of a flank against the way that pulls the pieces apart: they part by play / sin(30) = 2 plays before it bears."""
ROUND = 0.8
"""Radius of the line's corners, mm: a nozzle follows it, and the gap stays the play round them."""
TOOTH_PITCH = 14.0
BESIDE = 1.2
"""From a tooth to a feature of the tool, at least, mm."""
FREE = DEPTH + 2 * BESIDE
"""Width of a gap between features that takes a seam, mm."""
TIP = NECK + 2 * DEPTH * math.tan(math.radians(FLANK_DEG))
"""Width of a tooth at its tip, mm."""
_FAR = 1000.0
_Point = tuple[float, float]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Seam:
    """A cut across x: the middle of its teeth in x, their middles in y, and the gap between the pieces (mm)."""

    x: float
    teeth: tuple[float, ...]
    play: float

    @property
    def corners(self) -> tuple[_Point, ...]:
        """The line's corners from -y to +y."""
        low, high = self.x - DEPTH / 2, self.x + DEPTH / 2
        return tuple(
            point
            for y in self.teeth
            for point in ((low, y - NECK / 2), (high, y - TIP / 2), (high, y + TIP / 2), (low, y + NECK / 2))
        )

    def side(self, of: int) -> tuple[tuple[float, float, float], ...]:
        """Return the border of the piece on the left (-1) or right (1) of the line, from -y to +y, with bulges."""
        shift = -of * self.play / 2  # to the left of the way along the line
        ends = (self.x - DEPTH / 2, -_FAR), (self.x - DEPTH / 2, _FAR)
        line = (ends[0], *self.corners, ends[1])
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
    """A tool by its name, and the pieces that it is printed in, from -x to +x; `seams` lie between them."""

    tool: str
    pieces: tuple[Body, ...]
    seams: tuple[Seam, ...]


def split(tool: Body, seams: Sequence[Seam]) -> Split:
    """Cut a tool at its seams. The pieces are named by the tool and a number from -x on: base-1, base-2 ..."""
    pieces = []
    for i, (left, right) in enumerate(pairwise((None, *seams, None))):
        within = Extrude(_between(left, right), -_FAR, _FAR)
        pieces.append(replace(tool, name=f"{tool.name}-{i + 1}", shape=Common((tool.shape, within))))
    return Split(tool.name, tuple(pieces), tuple(seams))


def seams(cuts: Iterable[float], across: Interval, play: float) -> tuple[Seam, ...]:
    """Return a seam at each cut, its teeth within `across` (y, mm), as many as stand there at their pitch."""
    middle, width = sum(across) / 2, across[1] - across[0]
    count = max(1, math.floor((width - TIP) / TOOTH_PITCH) + 1)
    teeth = tuple(middle + (i - (count - 1) / 2) * TOOTH_PITCH for i in range(count))
    return tuple(Seam(x, teeth, play) for x in cuts)


def cuts(ends: Interval, taken: Iterable[Interval], bed: float, what: str, other: Sequence[float] = ()) -> list[float]:
    """Return where a tool between `ends` is cut so that every piece fits the bed along x: as few cuts as can be.

    Among these the longest piece is as short as it can be. `taken`: what features take along x; a cut lies in the
    middle of a gap between them. Where it can, it lies at none of the cuts of the tool under it (`other`): each then
    holds the other's pieces together, and no seam lies over a seam. Raises Refusal for a bed that no cut makes large
    enough, with the least that is.
    """
    places = _places(ends, taken)
    staggered = _fewest(ends, [place for place in places if place not in other], bed)
    found = _fewest(ends, places, bed)
    if found is None:
        needed = min(length for length in (max(_lengths(ends, places)), ends[1] - ends[0]))
        limit = f"{what} exceeds the bed, and the cuts between its features leave longer pieces"
        raise Refusal("moulds.bed_x_mm", bed, limit, math.ceil(needed * 10 - 1e-6) / 10)
    return staggered if staggered is not None and len(staggered) == len(found) else found


def _places(ends: Interval, taken: Iterable[Interval]) -> list[float]:
    """Return the middles of the gaps that take a seam."""
    reached, found = ends[0], []
    for low, high in (*sorted(taken), (ends[1], ends[1])):
        if low - reached >= FREE:
            found.append((low + reached) / 2)
        reached = max(reached, high)
    return found


def _fewest(ends: Interval, places: Sequence[float], bed: float) -> list[float] | None:
    """Return the fewest cuts with which no piece is longer than the bed, the longest as short as can be; or None."""
    found = _reaching(ends, places, bed)
    if found is None:
        return None
    marks = _marks(ends, places)
    for most in sorted({b - a + DEPTH for a, b in combinations(marks, 2)}):
        better = _reaching(ends, places, min(most, bed))
        if better is not None and len(better) == len(found):
            return better
    return found


def _reaching(ends: Interval, places: Sequence[float], most: float) -> list[float] | None:
    """Return cuts from the left on, each as far as a piece of length `most` reaches; None where one would be longer."""
    chosen: list[float] = []
    while _lengths(ends, chosen)[-1] > most + 1e-9:
        further = [x for x in places if x > (chosen[-1] if chosen else ends[0])]
        near = [x for x in further if _lengths(ends, [*chosen, x])[-2] <= most + 1e-9]
        if not near:
            return None
        chosen.append(near[-1])
    return chosen


def _lengths(ends: Interval, cuts: Sequence[float]) -> list[float]:
    """Return the pieces' lengths along x: from the outermost of one seam's teeth to that of the next one's."""
    return [b - a + DEPTH for a, b in pairwise(_marks(ends, cuts))]


def _marks(ends: Interval, cuts: Sequence[float]) -> list[float]:
    return [ends[0] + DEPTH / 2, *cuts, ends[1] - DEPTH / 2]


def _between(left: Seam | None, right: Seam | None) -> Profile:
    """Return the region between two seams; without one it reaches far out."""
    up = right.side(-1) if right else ((_FAR, -_FAR, 0.0), (_FAR, _FAR, 0.0))
    down = left.side(1) if left else ((-_FAR, -_FAR, 0.0), (-_FAR, _FAR, 0.0))
    # Walked the other way, an arc's bulge stands at its other end and turns to the other side.
    bulges = [-bulge for _, _, bulge in down[:-1]]
    back = [(x, y, bulge) for (x, y, _), bulge in zip(reversed(down), [*reversed(bulges), 0.0], strict=True)]
    return Profile((*up, *back))


def _unit(a: _Point, b: _Point) -> _Point:
    length = math.dist(a, b)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _along(point: _Point, way: _Point, by: float) -> _Point:
    return point[0] + way[0] * by, point[1] + way[1] * by


def _beside(point: _Point, way: _Point, by: float) -> _Point:
    """Return the point moved to the left of a way by `by`."""
    return point[0] - way[1] * by, point[1] + way[0] * by

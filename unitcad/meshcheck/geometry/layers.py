"""Layers: level cuts through a mesh, and the area of each that depends on the fill rule of a slicer.

A fill rule decides by a point's winding number: even-odd fills where it is odd, nonzero where it is not 0, positive
where it is above 0. They agree at 0 and 1, the numbers of air and of a sound body.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from manifold3d import CrossSection, FillRule

from unitcad.geometry.arrays import Floats, Ints, distinct, sorted_with_order
from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.geometry.topology import Edges

_MOST_SEGMENTS = 1 << 21  # cut at a time
_MOST_ENDS = 2000  # loose ends of a layer that are joined to the nearest; more are joined in their order
_MANY_CORNERS, _PIECES = 2000, 200  # of an area that is taken in strips; pieces of a strip
_ROUGHLY = 0.9  # a polygon of the library's circle has less area than the circle
_NOTHING = 1e-9  # mm2: the library's grid is 1e-8 mm


@dataclass(frozen=True, eq=False)
class Layer:
    """A cut at a height along an axis (0 to 2), mm; its outlines (n, 2) have the next two axes as coordinates.

    Material is left of an outline. Loose ends of an open surface are joined by straight lines, the nearest first.
    """

    axis: int
    height: float
    outlines: list[Floats]

    def section(self, rule: FillRule) -> CrossSection:
        """Fill the outlines by a rule."""
        return CrossSection(self.outlines, rule)

    def disputed(self) -> CrossSection:
        """Return the area that fill rules treat differently: winding numbers below 0, and 2, 4 and so on."""
        positive, negative = self.section(FillRule.Positive), self.section(FillRule.Negative)
        alike = abs(positive.area() - sum(map(_area, self.outlines))) <= _NOTHING * max(1.0, positive.area())
        if alike and negative.area() <= _NOTHING:
            return CrossSection()
        # With the outline of the positive area once more, a number that is even and not 0 becomes odd there.
        even = CrossSection([*self.outlines, *positive.to_polygons()], FillRule.EvenOdd)
        return even if negative.is_empty() else even + negative

    def in_space(self, points: Floats) -> Floats:
        """Return points (n, 2) of this layer as (n, 3), mm."""
        return np.roll(np.column_stack([np.full(len(points), self.height), points]), self.axis, axis=1)


def eroded(area: CrossSection, radius: float) -> CrossSection:
    """Return the middles of all circles of a radius, mm, that fit into an area.

    Of many pieces those that hold no circle are left out, and those without a hole are taken in strips side by side:
    one offset of 100,000 pieces takes minutes.
    """
    if area.num_vert() <= _MANY_CORNERS:
        return area.offset(-radius)
    loops = area.to_polygons()
    begin = np.cumsum([0] + [len(loop) for loop in loops[:-1]])
    x, y = np.concatenate(loops).T
    after = np.arange(1, len(x) + 1)
    after[begin[1:] - 1], after[-1] = begin[:-1], begin[-1]
    inside = np.add.reduceat(x * y[after] - x[after] * y, begin) / 2
    (left, low), (right, high) = ([ends.reduceat(one, begin) for one in (x, y)] for ends in (np.minimum, np.maximum))
    room = (inside >= np.pi * radius**2 * _ROUGHLY) & (np.minimum(right - left, high - low) >= 2 * radius * _ROUGHLY)
    holes, beside = np.flatnonzero(inside < 0), np.zeros(len(loops), bool)
    for k in holes:
        beside |= (left <= right[k]) & (right >= left[k]) & (low <= high[k]) & (high >= low[k])
    alone = np.flatnonzero(room & ~beside)
    alone = alone[np.argsort(left[alone], kind="stable")]
    groups = np.split(alone, np.arange(_PIECES, len(alone), _PIECES))
    smaller = list[Floats]()
    # A piece that went has a hole that fills nothing; no piece in that hole is larger.
    for some in [*groups, np.concatenate([np.flatnonzero(room & beside), holes])]:
        if len(some):
            smaller += CrossSection([loops[i] for i in some], FillRule.Positive).offset(-radius).to_polygons()
    return CrossSection(smaller, FillRule.Positive)


def _area(outline: Floats) -> float:
    """Return the area inside a closed line (n, 2), below 0 if it runs clockwise."""
    x, y = (outline - outline[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@dataclass(eq=False)
class Slicer:
    """Cutter of a mesh: its vertices (n, 3) mm, faces (m, 3), and the edges of the faces."""

    vertices: Floats
    faces: Ints
    edges: Edges
    tick: Tick
    edge_of: Ints = field(init=False)

    def __post_init__(self) -> None:
        self.edge_of = np.empty(len(self.edges.order), np.int32)
        self.edge_of[self.edges.order] = np.repeat(np.arange(len(self.edges.size), dtype=np.int32), self.edges.size)

    def layers(self, axis: int, heights: Floats) -> Iterator[Layer]:
        """Yield the layers at sorted heights along an axis; of a height without outlines there is none.

        A vertex at a height counts as below it, so that every cut is closed.
        """
        corners = self.vertices[:, axis].take(self.faces)
        first, last = (np.searchsorted(heights, ends) for ends in (corners.min(axis=1), corners.max(axis=1)))
        cut = np.flatnonzero(last > first)
        first, count = first[cut], (last - first)[cut]
        begun, ended = (np.bincount(at, minlength=len(heights) + 1)[:-1] for at in (first, first + count))
        blocks = np.cumsum(np.cumsum(begun - ended)) // _MOST_SEGMENTS
        for block in np.unique(blocks):
            self.tick()
            low, high = np.searchsorted(blocks, block), np.searchsorted(blocks, block, "right")
            begin = np.maximum(first, low)
            some = np.flatnonzero(np.minimum(first + count, high) > begin)
            yield from self._cut(axis, heights, cut[some], begin[some], np.minimum(first + count, high)[some])

    def _cut(self, axis: int, heights: Floats, faces: Ints, begin: Ints, end: Ints) -> Iterator[Layer]:
        """Yield the layers at the heights `begin` to `end` of each of some faces."""
        count = end - begin
        face = np.repeat(faces, count)
        level = np.arange(len(face)) - np.repeat(np.cumsum(count) - count - begin, count)
        height = heights.take(level)
        above = self.vertices[:, axis].take(self.faces[face]) > height[:, None]
        # Seen from above with material on the left, a segment begins on the edge that runs down, ends on the one up.
        onwards = above[:, [1, 2, 0]]
        down, up = (
            self.edge_of.take(3 * face + np.argmax(side, axis=1)) for side in (above > onwards, onwards > above)
        )
        following = _linked(level, down, up, len(self.edges.size))
        points = self._points(axis, height, down)
        if (loose := np.flatnonzero(following < 0)).size:
            points, following, level = self._closed(axis, height, up, loose, points, following, level)
        yield from _outlines(axis, heights, points, following, level)

    def _points(self, axis: int, height: Floats, edge: Ints) -> Floats:
        """Return the points (n, 2) at which edges meet heights; the same for both faces of an edge."""
        low, high = (self.vertices[ends.take(edge)] for ends in (self.edges.low, self.edges.high))
        share = (height - low[:, axis]) / (high[:, axis] - low[:, axis])
        return np.stack(
            [low[:, k] + share * (high[:, k] - low[:, k]) for k in ((axis + 1) % 3, (axis + 2) % 3)], axis=1
        )

    def _closed(
        self, axis: int, height: Floats, up: Ints, loose: Ints, points: Floats, following: Ints, level: Ints
    ) -> tuple[Floats, Ints, Ints]:
        """Join each loose end to the nearest loose start of its layer by a further segment."""
        starts = np.setdiff1d(np.arange(len(following)), following)
        ends = self._points(axis, height[loose], up[loose])
        n, target = len(following), np.empty(len(loose), np.int64)
        for at in np.unique(level[loose]):
            mine, free = np.flatnonzero(level[loose] == at), starts[level[starts] == at]
            if len(mine) <= _MOST_ENDS:
                away = np.linalg.norm(ends[mine][:, None] - points[free], axis=2)
                taken = _nearest(away)
            else:
                taken = np.arange(len(mine))
            target[mine] = free[taken]
        following = np.concatenate([following, target])
        following[loose] = n + np.arange(len(loose))
        return np.concatenate([points, ends]), following, np.concatenate([level, level[loose]])


def _nearest(away: Floats) -> Ints:
    """Return for each row of a square of distances a column of its own, the nearest pairs first."""
    taken, used = np.full(len(away), -1), np.zeros(len(away), bool)
    for row, column in zip(*np.unravel_index(np.argsort(away, axis=None), away.shape), strict=True):
        if taken[row] < 0 and not used[column]:
            taken[row], used[column] = column, True
    return taken


def _linked(level: Ints, down: Ints, up: Ints, n_edges: int) -> Ints:
    """Return for each segment the one that begins where it ends, -1 for none."""
    bits = (int(level.max(initial=0)) + 1).bit_length() + n_edges.bit_length()
    place = level.astype(np.uint64) * np.uint64(n_edges)
    (starts, by_start), (ends, by_end) = (
        sorted_with_order(place + edge.astype(np.uint64), bits) for edge in (down, up)
    )
    following = np.full(len(level), -1, np.int64)
    if np.array_equal(starts, ends):
        following[by_end] = by_start
        return following
    place_of = np.arange(len(ends))
    turn = place_of - np.maximum.accumulate(np.where(distinct(ends), place_of, 0))  # several faces may end on one edge
    at = np.searchsorted(starts, ends) + turn
    there = np.flatnonzero(at < len(starts))
    there = there[starts[at[there]] == ends[there]]
    following[by_end[there]] = by_start[at[there]]
    return following


def _outlines(axis: int, heights: Floats, points: Floats, following: Ints, level: Ints) -> Iterator[Layer]:
    """Yield the layers of segments by their first points, (n, 2), with `following` a permutation."""
    n = len(following)
    first, step = np.arange(n), following
    while True:  # the least number round each outline, by doubling steps
        least = np.minimum(first, first.take(step))
        if np.array_equal(least, first):
            break
        first, step = least, step.take(step)
    root = first == np.arange(n)
    left, step = np.where(root, 0, 1), np.where(root, np.arange(n), following)
    while (more := left.take(step)).any():
        left, step = left + more, step.take(step)
    roots = np.flatnonzero(root)
    roots = roots[np.argsort(level[roots], kind="stable")]
    number = np.empty(n, np.int64)
    number[roots] = np.arange(len(roots))
    behind = np.where(root, 0, int(left.max(initial=0)) + 1 - left)
    bits = int(behind.max(initial=0)).bit_length()
    key = number.take(first).astype(np.uint64) << np.uint64(bits) | behind.astype(np.uint64)
    order = sorted_with_order(key, len(roots).bit_length() + bits)[1]
    lines = np.split(points.take(order, axis=0), np.cumsum(np.bincount(number.take(first)))[:-1])
    at = level[roots]
    for here in at[distinct(at)]:
        some = range(*np.searchsorted(at, [here, here + 1]))
        kept = [lines[i] for i in some if len(lines[i]) > 2]
        if kept:
            yield Layer(axis, float(heights[here]), kept)

"""Distances in the plane: points, straight segments, convex polygons and closed outlines."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.geometry.boxes import boxes_of, frame_of, meeting_between, morton_order

Point = tuple[float, float]


def to_segment(at: Point, start: Point, end: Point) -> float:
    """Return the distance of a point from a segment, which may be a point itself."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx * dx + dy * dy
    along = ((at[0] - start[0]) * dx + (at[1] - start[1]) * dy) / square if square else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(at[0] - start[0] - along * dx, at[1] - start[1] - along * dy)


def between_segments(a: Point, b: Point, c: Point, d: Point) -> float:
    """Return the distance of the segments a b and c d; 0 if they cross."""

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return 0.0
    return min(to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b))


def to_box(start: Point, end: Point, box: tuple[float, float, float, float]) -> float:
    """Return the distance of a segment from a box (x0, y0, x1, y1); 0 if it ends in it or crosses it."""
    x0, y0, x1, y1 = box
    if x0 <= end[0] <= x1 and y0 <= end[1] <= y1:
        return 0.0
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return min(between_segments(start, end, *side) for side in zip(corners, [*corners[1:], corners[0]], strict=True))


def between_convex(one: Sequence[Point], other: Sequence[Point]) -> float:
    """Return the distance of two convex polygons, which may be points or segments; 0 if they meet."""
    if _inside(one[0], other) or _inside(other[0], one):
        return 0.0
    return min(between_segments(*edge, *beside) for edge in _edges(one) for beside in _edges(other))


def _edges(corners: Sequence[Point]) -> list[tuple[Point, Point]]:
    if len(corners) < 3:
        return [(corners[0], corners[-1])]
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


def _inside(at: Point, corners: Sequence[Point]) -> bool:
    """Tell whether a point is in a convex polygon of three corners or more."""
    sides = [(q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]) for p, q in _edges(corners)]
    return len(corners) > 2 and (min(sides) >= 0 or max(sides) <= 0)


def nearer(a: Sequence[Point], b: Sequence[Point], than: float) -> bool:
    """Tell whether two convex polygons are nearer to each other than a distance; quick if their boxes are not."""
    for axis in (0, 1):
        ones, others = [p[axis] for p in a], [p[axis] for p in b]
        if min(ones) - max(others) >= than or min(others) - max(ones) >= than:
            return False
    return between_convex(a, b) < than


def between_outlines(one: Sequence[Floats], other: Sequence[Floats], most: float) -> float:
    """Return the least distance of any corner of either from any side of the other, mm, and `most` if none is less.

    Each loop is (n, 2). Between outlines that do not cross, a corner is an end of every shortest way.
    """
    (corners, after), (others, others_after) = _sides(one), _sides(other)
    least = _to_sides(corners, others, others_after, most)
    return _to_sides(others, corners, after, least)


def _sides(loops: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the starts and the ends of all sides, (n, 2) each."""
    return np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])


def _to_sides(points: Floats, starts: Floats, ends: Floats, most: float) -> float:
    """Return the least distance of points from sides, mm, `most` at most."""
    low, high = np.minimum(starts, ends) - most, np.maximum(starts, ends) + most
    frame = frame_of(np.pad(np.concatenate([low, high, points]), ((0, 0), (0, 1))))
    of_points, of_sides = (frame.steps(np.pad(at, ((0, 0), (0, 1)))) for at in (points, np.concatenate([low, high])))
    nearby, order = morton_order(of_points), morton_order(of_sides, np.arange(len(low)))
    boxes, grown = boxes_of(of_points, nearby), boxes_of(of_sides, order, order + len(low))
    along = ends - starts
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    least = most
    for i, k in meeting_between(boxes, grown):
        side = order[k]
        off, way = points[nearby[i]] - starts[side], along[side]
        share = np.clip(np.einsum("ij,ij->i", off, way) / square[side], 0.0, 1.0)
        least = min(least, float(np.hypot(*(off - share[:, None] * way).T).min(initial=least)))
    return least

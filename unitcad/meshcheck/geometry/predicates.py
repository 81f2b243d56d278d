"""Signs of determinants that are never wrong: a float filter with an error bound, exact arithmetic for the rest.

orient3d(a, b, c, d) is the sign of det(a - d, b - d, c - d): positive if d is below the plane through a, b, c (seen so
that a, b, c turn anticlockwise), zero if all four are coplanar. The filter's bound is Shewchuk's (1997), for
differences that are rounded themselves.

Python's integers decide the rest.

Triangles that are not coplanar: Devillers and Guigue, "Faster triangle-triangle intersection tests" (INRIA RR-4488,
2002): on the line of the two planes each triangle cuts an interval; two determinants compare the intervals' ends. Both
negative: the intervals share a length. One zero: they share a point, which is touching.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints

_EPS = np.finfo(np.float64).eps / 2
_BOUND = {2: (3.0 + 16.0 * _EPS) * _EPS, 3: (7.0 + 56.0 * _EPS) * _EPS}  # of the sum of the terms' sizes, by axes
_TINY = 1e-270  # more than underflow takes from a determinant of coordinates that fit single precision


def orient3d(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """Return the sign of orient3d for each row of four (n, 3) arrays, int8."""
    return _orient3d_columns(a.T, b.T, c.T, d.T)


def orient2d(a: Floats, b: Floats, c: Floats) -> Ints:
    """Return the sign of the area of each triangle a, b, c in the plane, (n, 2) arrays: positive anticlockwise."""
    return orient2d_columns(a.T, b.T, c.T)


def orient2d_columns(a: Floats, b: Floats, c: Floats) -> Ints:
    """Return the result of `orient2d` for points by axis: (2, n) arrays."""
    (ax, ay), (bx, by) = a - c, b - c
    left, right = ax * by, ay * bx
    value = left - right
    size = np.abs(left, out=left)
    size += np.abs(right, out=right)
    return _sure((a, b, c), value, size)


def sides(a: Floats, b: Floats) -> Ints:
    """Return the side of the plane of each triangle `a` that each corner of `b` lies on: int8 (corner, n).

    Both are (corner, axis, n). Positive if `a` is seen anticlockwise; zero for all corners if `a` has no area.
    """
    return np.stack([_orient3d_columns(corner, a[1], a[2], a[0]) for corner in b])


def _orient3d_columns(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """Return the result of `orient3d` for points by axis: (3, n) arrays."""
    rows = np.stack([a - d, b - d, c - d])
    value = _determinant(rows)
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = np.abs(rows, out=rows)
    size = az * (bx * cy + cx * by) + bz * (cx * ay + ax * cy) + cz * (ax * by + bx * ay)
    return _sure((a, b, c, d), value, size)


def _sure(points: Sequence[Floats], value: Floats, size: Floats) -> Ints:
    """Return the signs of determinants: of their values (n,), or exact if these are too small relative to `size`.

    `size`: the sum of the sizes of a determinant's terms; points: (axes, n) arrays.
    """
    sign = np.sign(value).astype(np.int8)
    unsure = np.flatnonzero(np.abs(value) <= _BOUND[len(points) - 1] * size + _TINY)
    if len(unsure):
        sign[unsure] = _exact(np.stack([point.take(unsure, axis=1) for point in points]))
    return sign


def _determinant(rows: Any) -> Any:
    """Return the determinant of rows[i][axis], floats, whole numbers or pairs."""
    if len(rows) == 2:
        (ax, ay), (bx, by) = rows
        return ax * by - ay * bx
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
    return az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)


def _exact(points: Floats) -> Ints:
    """Return signs of the determinants of points (axes + 1, axes, n) that the filter leaves."""
    sign = np.zeros(points.shape[2], np.int8)
    same = points == points[-1]
    left = np.flatnonzero(
        ~(same.all(axis=0).any(axis=0) | same[:-1].all(axis=1).any(axis=0))
    )  # else two lines are zero
    if len(left):
        whole = integers(points.take(left, axis=2))
        sign[left] = np.sign(_determinant(whole[:-1] - whole[-1])).astype(np.int8)
    return sign


def integers(values: Floats) -> np.ndarray:
    """Return the floats times one power of two that makes them all whole, as Python's integers."""
    mantissa, exponent = np.frexp(values)
    digits = (mantissa * 2.0**53).astype(np.int64)
    shift = np.where(digits == 0, 0, exponent - exponent.min(initial=0, where=digits != 0))
    return digits.astype(object) << shift.astype(object)


@dataclass(frozen=True, eq=False)
class Meeting:
    """Relation of the triangles of each pair.

    `crosses`: each passes through the other; `touches`: they have a point in common; `overlaps`: they are coplanar with
    area in common. `side_a` (n, 3) are the sides of b's plane on which a's corners lie; `side_b` is the same the other
    way.
    """

    crosses: Bools
    touches: Bools
    overlaps: Bools
    side_a: Ints
    side_b: Ints


def _table() -> tuple[Ints, Bools]:
    """Tabulate by three signs (index 9p + 3q + r + 13) which corner stands alone, and whether the other is flipped."""
    alone, flip = np.zeros(27, np.int8), np.zeros(27, bool)
    for index in range(27):
        p, q, r = index // 9 - 1, index // 3 % 3 - 1, index % 3 - 1
        if p > 0:
            turn = (2, True) if q > 0 else (1, True) if r > 0 else (0, False)
        elif p < 0:
            turn = (2, False) if q < 0 else (1, False) if r < 0 else (0, True)
        elif q < 0:
            turn = (1, True) if r >= 0 else (0, False)
        elif q > 0:
            turn = (0, True) if r > 0 else (1, False)
        else:
            turn = (2, r < 0)
        alone[index], flip[index] = turn
    return alone, flip


_ALONE, _FLIP = _table()


def meet(a: Floats, b: Floats) -> Meeting:
    """Decide for rows of corners (n, 3, 3); no triangle may be without area.

    If one triangle is wholly on one side of the other's plane, the other's `side` is not computed, and 1.
    """
    n = len(a)
    side_a, side_b = np.ones((2, n, 3), np.int8)
    left = np.arange(n)
    for one, other, into in ((a, b, side_b), (b, a, side_a)):
        into[left] = sides(*(np.ascontiguousarray(corners[left].transpose(1, 2, 0)) for corners in (one, other))).T
        left = left[~_one_side(into[left])]
    flat = (side_b == 0).all(axis=1)
    apart = _one_side(side_a) | _one_side(side_b)
    crosses, touches, overlaps = np.zeros(n, bool), np.zeros(n, bool), np.zeros(n, bool)
    rest = np.flatnonzero(~flat & ~apart)
    if len(rest):
        one, two = _compared(a[rest], b[rest], side_a[rest], side_b[rest])
        touches[rest] = (one <= 0) & (two <= 0)
        through = _straddles(side_a[rest]) & _straddles(side_b[rest])
        crosses[rest] = (one < 0) & (two < 0) & through
    rest = np.flatnonzero(flat)
    if len(rest):
        overlaps[rest], touches[rest] = coplanar(a[rest], b[rest])
    return Meeting(crosses, touches, overlaps, side_a, side_b)


def _one_side(sides: Ints) -> Bools:
    return np.asarray((sides > 0).all(axis=1) | (sides < 0).all(axis=1))


def _straddles(sides: Ints) -> Bools:
    return np.asarray((sides > 0).any(axis=1) & (sides < 0).any(axis=1))


def _compared(a: Floats, b: Floats, side_a: Ints, side_b: Ints) -> tuple[Ints, Ints]:
    """Return the two determinants that compare the intervals' ends."""
    rows = np.arange(len(a))
    weights = np.array([9, 3, 1])
    index_a = side_a.astype(np.int64) @ weights + 13
    index_b = side_b.astype(np.int64) @ weights + 13
    turn_a, turn_b = _ALONE[index_a], _ALONE[index_b]
    corner = np.arange(3)
    p1, q1, r1 = (a[rows, (turn_a + k) % 3] for k in corner)
    p2, q2, r2 = (b[rows, (turn_b + k) % 3] for k in corner)
    flip_b, flip_a = _FLIP[index_a][:, None], _FLIP[index_b][:, None]
    q2, r2 = np.where(flip_b, r2, q2), np.where(flip_b, q2, r2)
    q1, r1 = np.where(flip_a, r1, q1), np.where(flip_a, q1, r1)
    both = ((p2, p2), (p1, r1), (q2, r2), (q1, p1))
    one, two = orient3d(*(np.concatenate(points) for points in both)).reshape(2, -1)
    return one, two


def flatten(a: Floats, *others: Floats) -> list[Floats]:
    """Return the corners without the axis along which the triangles `a` (n, 3, 3) face most: (n, k, 2) each."""
    x, y, z = a.transpose(2, 1, 0)
    one, two = ([axis[k] - axis[0] for axis in (x, y, z)] for k in (1, 2))
    normal = [one[k - 2] * two[k - 1] - one[k - 1] * two[k - 2] for k in range(3)]
    drop = np.argmax(np.abs(normal), axis=0)
    first, second = drop == 0, drop == 1
    flat = []
    for points in (a, *others):
        x, y, z = points.transpose(2, 1, 0)
        plan = np.where(first, y, np.where(second, z, x)), np.where(first, z, np.where(second, x, y))
        flat.append(np.stack(plan, axis=1).transpose(2, 0, 1))
    return flat


def coplanar(a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """Return whether coplanar triangles share area, and whether a point: no side of either separates them."""
    flat = flatten(a, b)
    sides = np.concatenate([_off_sides(flat[0], flat[1]), _off_sides(flat[1], flat[0])])
    largest = sides.max(axis=1)
    return (largest > 0).all(axis=0), (largest >= 0).all(axis=0)


def _off_sides(corners: Floats, points: Floats) -> Ints:
    """Return 1 if a point is inward of a side, -1 if it is outward: (side, k, n).

    Triangles are (n, 3, 2), points (n, k, 2).
    """
    at, there = (np.ascontiguousarray(of.transpose(1, 2, 0)) for of in (corners, points))
    turn = orient2d_columns(*at)
    return np.array([[orient2d_columns(at[k], at[(k + 1) % 3], place) * turn for place in there] for k in range(3)])


def segment_inside(u: Floats, v: Floats, b: Floats) -> Bools:
    """Return whether the open segment u v (n, 3), which lies in the plane of triangle b, passes through b's inside."""
    flat, ends = flatten(b, np.stack([u, v], axis=1))
    inside = (_off_sides(flat, ends).max(axis=1) > 0).all(axis=0)
    across = orient2d(
        np.tile(ends[:, 0], (3, 1)), np.tile(ends[:, 1], (3, 1)), np.concatenate([flat[:, k] for k in range(3)])
    ).reshape(3, -1)
    return inside & (across > 0).any(axis=0) & (across < 0).any(axis=0)


def common_points(a: Floats, b: Floats) -> Floats:
    """Return a point of pairs of triangles (n, 3, 3) that meet: the middle of the point, segment or polygon they share.

    Each of `a` is cut to the prism over its `b` that is as high as rounding, so a point is exact to rounding only; not
    a number if nothing is left.
    """
    largest = np.maximum(np.abs(a).max(axis=(1, 2), initial=0.0), np.abs(b).max(axis=(1, 2), initial=0.0))
    shift = b[:, :1]
    left, corners = a - shift, b - shift
    size = np.maximum(np.abs(left).max(axis=(1, 2), initial=0.0), np.abs(corners).max(axis=(1, 2), initial=0.0))
    near = (1e-9 + 8 * np.spacing(largest) / size)[:, None]
    left, corners = left / size[:, None, None], corners / size[:, None, None]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None]
    sides = np.cross(normal, np.roll(corners, -1, axis=1) - corners)
    inward = np.concatenate([normal, -normal, sides], axis=1)
    inward /= np.maximum(np.linalg.norm(inward, axis=2), 1e-150)[:, :, None]
    empty = np.zeros(len(a), bool)
    for i, k in enumerate((0, 0, 0, 1, 2)):
        height = ((left - corners[:, k, None]) * inward[:, i, None]).sum(axis=2) + near
        before, one = np.roll(height, 1, axis=1), np.roll(left, 1, axis=1)
        crosses, kept = (before < 0) != (height < 0), height >= 0
        share = before / np.where(crosses, before - height, 1.0)
        cut = one + (left - one) * share[:, :, None]
        # A convex polygon gains at most one corner; shorter ones repeat their last.
        chosen = np.stack([crosses, kept], axis=2).reshape(len(a), 2 * left.shape[1])
        points = np.stack([cut, left], axis=2).reshape(len(a), 2 * left.shape[1], 3)
        count = chosen.sum(axis=1)
        order = np.argsort(~chosen, axis=1, kind="stable")[:, : left.shape[1] + 1]
        slots = np.minimum(np.arange(order.shape[1]), np.maximum(count - 1, 0)[:, None])
        left = np.take_along_axis(points, np.take_along_axis(order, slots, axis=1)[:, :, None], axis=1)
        empty |= count == 0
    apart = np.ones(left.shape[:2], bool)
    for k in range(1, left.shape[1]):
        far = np.abs(left[:, :k] - left[:, k, None]).max(axis=2) > 4 * near
        apart[:, k] = (far | ~apart[:, :k]).all(axis=1)
    middle = np.where(apart[:, :, None], left, 0.0).sum(axis=1) / apart.sum(axis=1)[:, None]
    return np.where(empty[:, None], np.nan, middle * size[:, None] + shift[:, 0])


def without_area(corners: Floats) -> Bools:
    """Return whether the corners of each face (n, 3, 3) lie on one line: seen along no axis do they have an area."""
    flat = np.ones(len(corners), bool)
    for axis in range(3):
        left = np.flatnonzero(flat)
        plan = np.delete(corners[left], axis, axis=2)
        flat[left] = orient2d(plan[:, 0], plan[:, 1], plan[:, 2]) == 0
    return flat

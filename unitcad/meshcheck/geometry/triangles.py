"""How two triangles meet, decided exactly: apart, touching, crossing, or overlapping in one plane.

Triangles that are not coplanar: Devillers and Guigue, "Faster triangle-triangle intersection tests" (INRIA RR-4488,
2002): on the line of the two planes each triangle cuts an interval; two determinants compare the intervals' ends. Both
negative: the intervals share a length. One zero: they share a point, which is touching.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, cross
from unitcad.meshcheck.geometry.predicates import orient2d, orient2d_columns, orient3d, sides

_BLOCK = 1 << 13  # pairs whose corners stay in the processor's cache


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

    Where one triangle lies wholly on one side of the other's plane, the other's `side` is not worked out, and 1.
    """
    n = len(a)
    side_a, side_b = np.ones((2, n, 3), np.int8)
    for start in range(0, n, _BLOCK):
        left = np.arange(start, min(start + _BLOCK, n))
        one, other = (np.ascontiguousarray(corners[left].transpose(1, 2, 0)) for corners in (a, b))
        for into in (side_b, side_a):
            side = sides(one, other)
            into[left] = side.T
            near = np.flatnonzero(~((side > 0).all(axis=0) | (side < 0).all(axis=0)))
            left = left[near]
            one, other = other.take(near, axis=2), one.take(near, axis=2)
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


def flattened(a: Floats, *others: Floats) -> list[Floats]:
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
    flat = flattened(a, b)
    sides = np.concatenate([_off_sides(flat[0], flat[1]), _off_sides(flat[1], flat[0])])
    largest = sides.max(axis=1)
    return (largest > 0).all(axis=0), (largest >= 0).all(axis=0)


def _off_sides(corners: Floats, points: Floats) -> Ints:
    """Return 1 where a point is inward of a side, -1 where it is outward: (side, k, n).

    Triangles are (n, 3, 2), points (n, k, 2).
    """
    n, count = len(corners), points.shape[1]
    sign = np.empty((3, count, n), np.int8)
    for start in range(0, n, _BLOCK):
        block = slice(start, start + _BLOCK)
        at, there = (np.ascontiguousarray(of[block].transpose(1, 2, 0)) for of in (corners, points))
        turn = orient2d_columns(*at)
        for k in range(3):
            for p in range(count):
                np.multiply(orient2d_columns(at[k], at[(k + 1) % 3], there[p]), turn, out=sign[k, p, block])
    return sign


def segment_inside(u: Floats, v: Floats, b: Floats) -> Bools:
    """Return whether the open segment u v (n, 3), which lies in the plane of triangle b, passes through b's inside."""
    flat, ends = flattened(b, np.stack([u, v], axis=1))
    inside = (_off_sides(flat, ends).max(axis=1) > 0).all(axis=0)
    across = orient2d(
        np.tile(ends[:, 0], (3, 1)), np.tile(ends[:, 1], (3, 1)), np.concatenate([flat[:, k] for k in range(3)])
    ).reshape(3, -1)
    return inside & (across > 0).any(axis=0) & (across < 0).any(axis=0)


def common_point(a: Floats, b: Floats) -> Floats | None:
    """Return a point of two triangles (3, 3) that meet: the middle of the point, segment or polygon that they share.

    `a` is cut to the prism over `b` that is as high as rounding, so it is exact to rounding only; None where nothing is
    left.
    """
    shift = b[0]
    left, corners = a - shift, b - shift
    size = max(np.abs(left).max(), np.abs(corners).max())
    near = 1e-9 + 8 * float(np.spacing(max(np.abs(a).max(), np.abs(b).max()))) / size
    left, corners = left / size, corners / size
    normal = cross(corners[1:2] - corners[0], corners[2:] - corners[0])
    inward = np.concatenate(
        [normal, -normal, cross(np.repeat(normal, 3, axis=0), np.roll(corners, -1, axis=0) - corners)]
    )
    inward /= np.maximum(np.linalg.norm(inward, axis=1), 1e-150)[:, None]
    for along, origin in zip(inward, corners[[0, 0, 0, 1, 2]], strict=True):
        height = ((left - origin) * along).sum(axis=1) + near
        cut = []
        for k, point in enumerate(left):
            if (height[k - 1] < 0) != (height[k] < 0):
                cut.append(left[k - 1] + (point - left[k - 1]) * (height[k - 1] / (height[k - 1] - height[k])))
            if height[k] >= 0:
                cut.append(point)
        if not cut:
            return None
        left = np.array(cut)
    apart: list[Floats] = []
    for point in left:
        if all(np.abs(point - other).max() > 4 * near for other in apart):
            apart.append(point)
    return np.mean(apart, axis=0) * size + shift


def without_area(corners: Floats) -> Bools:
    """Return whether the corners of each face (n, 3, 3) lie on one line: seen along no axis do they have an area."""
    flat = np.ones(len(corners), bool)
    for axis in range(3):
        left = np.flatnonzero(flat)
        plan = np.delete(corners[left], axis, axis=2)
        flat[left] = orient2d(plan[:, 0], plan[:, 1], plan[:, 2]) == 0
    return flat

"""How two triangles meet, decided exactly: apart, touching, crossing, or overlapping in one plane.

Triangles that are not coplanar: Devillers and Guigue, "Faster triangle-triangle intersection tests" (INRIA RR-4488,
2002): on the line of the two planes each triangle cuts an interval; two determinants compare the intervals' ends. Both
negative: the intervals share a length. One zero: they share a point, which is touching.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.check.exact import orient2d, orient3d, sides
from unitcad.geometry.arrays import Bools, Floats, Ints

_BLOCK = 1 << 12  # pairs whose corners stay in the processor's cache


@dataclass(frozen=True)
class Meeting:
    """For each pair of triangles: `crosses` (each passes through the other), `touches` (they have a point in common),
    `overlaps` (coplanar, with area in common). `side_a` (n, 3): the sides of a's corners off b's plane; `side_b` so.
    """

    crosses: Bools
    touches: Bools
    overlaps: Bools
    side_a: Ints
    side_b: Ints


def _table() -> tuple[Ints, Bools]:
    """By three signs (index 9 p + 3 q + r + 13): which corner stands alone, and whether the other one is flipped."""
    alone, flip = np.zeros(27, np.int8), np.zeros(27, bool)
    for index in range(27):
        p, q, r = index // 9 - 1, index // 3 % 3 - 1, index % 3 - 1
        if p > 0:
            found = (2, True) if q > 0 else (1, True) if r > 0 else (0, False)
        elif p < 0:
            found = (2, False) if q < 0 else (1, False) if r < 0 else (0, True)
        elif q < 0:
            found = (1, True) if r >= 0 else (0, False)
        elif q > 0:
            found = (0, True) if r > 0 else (1, False)
        else:
            found = (2, r < 0)
        alone[index], flip[index] = found
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
    """The two determinants that compare the intervals' ends."""
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
    return orient3d(p2, p1, q2, q1), orient3d(p2, r1, r2, p1)


def flattened(a: Floats, *others: Floats) -> list[Floats]:
    """The corners without the axis along which the triangles `a` (n, 3, 3) face most: (n, k, 2) each."""
    normal = np.abs(np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0]))
    drop = np.argmax(normal, axis=1)
    keep = np.array([[1, 2], [2, 0], [0, 1]])[drop]
    rows = np.arange(len(a))[:, None, None]
    return [points[rows, np.arange(points.shape[1])[None, :, None], keep[:, None, :]] for points in (a, *others)]


def coplanar(a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """Whether coplanar triangles share area, and whether they share a point: no side of either separates them."""
    flat_a, flat_b = flattened(a, b)
    share, meet_ = np.ones(len(a), bool), np.ones(len(a), bool)
    for one, other in ((flat_a, flat_b), (flat_b, flat_a)):
        turn = orient2d(one[:, 0], one[:, 1], one[:, 2])
        for k in range(3):
            side = [turn * orient2d(one[:, k], one[:, (k + 1) % 3], other[:, j]) for j in range(3)]
            largest = np.max(side, axis=0)
            share &= largest > 0
            meet_ &= largest >= 0
    return share, meet_


def segment_inside(u: Floats, v: Floats, b: Floats) -> Bools:
    """Whether the open segment u v (n, 3), which lies in the plane of triangle b, passes through b's inside."""
    flat, ends = flattened(b, np.stack([u, v], axis=1))
    turn = orient2d(flat[:, 0], flat[:, 1], flat[:, 2])
    inside = np.ones(len(u), bool)
    for k in range(3):
        side = [turn * orient2d(flat[:, k], flat[:, (k + 1) % 3], ends[:, j]) for j in range(2)]
        inside &= np.max(side, axis=0) > 0
    across = np.stack([orient2d(ends[:, 0], ends[:, 1], flat[:, k]) for k in range(3)], axis=1)
    return inside & (across > 0).any(axis=1) & (across < 0).any(axis=1)


def common_point(a: Floats, b: Floats) -> Floats | None:
    """A point (3,) of two triangles (3, 3) that meet: the middle of the point, segment or polygon that they share.

    `a` is cut to the prism over `b` that is as high as rounding, so it is exact to rounding only; None where nothing is
    left.
    """
    shift = b[0]
    size = float(np.abs([a - shift, b - shift]).max())
    near = 1e-9 + 8 * float(np.spacing(np.abs([a, b]).max())) / size
    a, b = (a - shift) / size, (b - shift) / size
    normal = np.cross(b[1] - b[0], b[2] - b[0])
    normal /= max(np.sqrt(normal @ normal), 1e-150)
    planes = [(normal, b[0]), (-normal, b[0])]
    for k in range(3):
        inward = np.cross(normal, b[(k + 1) % 3] - b[k])
        planes.append((inward / max(np.sqrt(inward @ inward), 1e-150), b[k]))
    left = list(a)
    for inward, origin in planes:
        height = [float((point - origin) @ inward) + near for point in left]
        cut = []
        for k, point in enumerate(left):
            before, low, high = left[k - 1], height[k - 1], height[k]
            if (low < 0) != (high < 0):
                cut.append(before + (point - before) * (low / (low - high)))
            if high >= 0:
                cut.append(point)
        left = cut
    apart: list[Floats] = []
    for point in left:
        if all(np.abs(point - other).max() > 4 * near for other in apart):
            apart.append(point)
    return np.mean(apart, axis=0) * size + shift if apart else None

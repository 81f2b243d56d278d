"""Volumes of shells: which are closed, how much each holds, and whether two that meet in a face lie side by side."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.geometry.ticks import Tick
from unitcad.meshcheck.geometry.edges import Edges

_BLOCK = 1 << 13  # faces whose corners stay in the processor's cache


def closed(edges: Edges, shells: Ints, n: int) -> Bools:
    """Return whether each of `n` shells has an inside: at all its edges as many faces run one way as the other."""
    inside = np.ones(n, bool)
    if not edges.closed:
        wrong = np.repeat(~edges.balanced, edges.size)
        inside[shells[edges.order[wrong] // 3]] = False
    return inside


def signed(vertices: Floats, faces: Ints, areas: Floats, shells: Ints, n: int) -> Floats:
    """Return the volume of each of `n` shells, mm3: below zero where its faces look inwards.

    It means nothing where the shell is not closed. Tetrahedra stand on the middle of all vertices, so that a part far
    from the origin loses no digits.
    """
    corner = faces[:, 0]
    tetra = np.zeros(len(faces))
    for axis in range(3):
        column = vertices[:, axis]
        height = column.take(corner)
        height -= (column.min() + column.max()) / 2 if n else 0.0
        height *= areas[:, axis]
        tetra += height
    tetra /= 6
    return np.bincount(shells, tetra, n).astype(float) if n > 1 else np.array([tetra.sum()] * n)


def side_by_side(one: Floats, other: Floats) -> Bools:
    """Return whether two closed shells that meet in faces which look opposite ways have material on both sides.

    Arguments are their volumes, 0 for a shell that is not closed. Two solids have; a cavity and the wall's outer face
    have not: the wall is without thickness there. What stands in a cavity has less volume than the cavity, whose volume
    is below zero.
    """
    return np.asarray((one * other > 0) | ((one * other < 0) & (one + other < -1e-9 * np.abs(one))))


def _dot(a: Floats, b: Floats) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def winding_number(vertices: Floats, faces: Ints, point: Floats) -> int:
    """Count how often a closed surface winds round `point`: the sum of solid angles over 4 pi (Van Oosterom, 1983)."""
    total = 0.0
    for start in range(0, len(faces), _BLOCK):
        block = faces[start : start + _BLOCK]
        total += float(_half_angles(vertices, block, np.broadcast_to(point, (len(block), 3))).sum())
    return round(total / (2 * np.pi))


def winding_numbers(vertices: Floats, faces: Ints, first: Ints, count: Ints, points: Floats, tick: Tick) -> Ints:
    """Return the same for points (n, 3), of each the surface of the `count` faces from `first` on."""
    numbers, ends = np.zeros(len(points), np.int64), np.cumsum(count)
    start = 0
    while start < len(points):
        tick()
        stop = max(int(np.searchsorted(ends, ends[start] - count[start] + _BLOCK, "right")), start + 1)
        if stop == start + 1:
            surface = faces[first[start] : first[start] + count[start]]
            numbers[start] = winding_number(vertices, surface, points[start])
        else:
            row = np.repeat(np.arange(start, stop), count[start:stop])
            place = np.arange(len(row)) - np.repeat(
                ends[start:stop] - count[start:stop] - ends[start] + count[start], count[start:stop]
            )
            angles = _half_angles(vertices, faces[first[row] + place], points[row])
            numbers[start:stop] = np.round(np.bincount(row - start, angles, stop - start) / (2 * np.pi))
        start = stop
    return numbers


def _half_angles(vertices: Floats, faces: Ints, points: Floats) -> Floats:
    """Return half of the solid angle under which each face is seen from a point, (n,)."""
    a, b, c = (np.ascontiguousarray((vertices.take(faces[:, k], axis=0) - points).T) for k in range(3))
    la, lb, lc = (np.sqrt(_dot(v, v)) for v in (a, b, c))
    top = a[0] * (b[1] * c[2] - b[2] * c[1])
    top += a[1] * (b[2] * c[0] - b[0] * c[2])
    top += a[2] * (b[0] * c[1] - b[1] * c[0])
    low = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    return np.asarray(np.arctan2(top, low))

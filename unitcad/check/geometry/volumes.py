"""Volumes of shells: which are closed, how much each holds, and whether two that meet in a face lie side by side."""

from __future__ import annotations

import numpy as np

from unitcad.check.geometry.edges import Edges
from unitcad.geometry.arrays import Bools, Floats, Ints

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
        a, b, c = (np.ascontiguousarray((vertices.take(block[:, k], axis=0) - point).T) for k in range(3))
        la, lb, lc = (np.sqrt(_dot(v, v)) for v in (a, b, c))
        top = a[0] * (b[1] * c[2] - b[2] * c[1])
        top += a[1] * (b[2] * c[0] - b[0] * c[2])
        top += a[2] * (b[0] * c[1] - b[1] * c[0])
        low = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        total += float(np.arctan2(top, low).sum())
    return round(total / (2 * np.pi))

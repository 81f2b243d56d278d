"""Volumes of shells: which are closed, how much each holds, and whether two that meet in a face lie side by side."""

from __future__ import annotations

import numpy as np

from unitcad.check.geometry.edges import Edges
from unitcad.geometry.arrays import Bools, Floats, Ints

_BLOCK = 500_000


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


def winding_number(vertices: Floats, faces: Ints, point: Floats) -> int:
    """Count how often a closed surface winds round `point`: the sum of solid angles over 4 pi (Van Oosterom, 1983)."""
    total = 0.0
    for start in range(0, len(faces), _BLOCK):
        a, b, c = (vertices[faces[start : start + _BLOCK, k]] - point for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("ij,ij->i", v, v)) for v in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        dot = np.einsum
        low = la * lb * lc + dot("ij,ij->i", a, b) * lc + dot("ij,ij->i", b, c) * la + dot("ij,ij->i", c, a) * lb
        total += float(np.arctan2(top, low).sum())
    return round(total / (2 * np.pi))

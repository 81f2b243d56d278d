"""Vertices whose faces can meet nowhere but in that vertex and their common edges, since their star is a height field.

Most pairs of faces whose boxes meet are neighbours round such a vertex, and need no look.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.meshcheck.geometry.edges import edges_of, surrounded
from unitcad.meshcheck.geometry.topology import Surface

_BLOCK = 1 << 14  # faces whose coordinates stay in the processor's cache
_ROUNDING = 1e-15  # of the squared longest side: more than rounding takes from twice an area
_SOUND = 1e-9  # of the squared longest side: faces with less area have no direction worth adding to a mean
_FACING = 0.01  # cosine to the mean direction
_AXES = (((1, 0, 0), 1), ((0, 1, 0), 2), ((0, 0, 1), 0))
_DIAGONALS = (((1, 1, 0), 2), ((1, -1, 0), 2), ((1, 0, 1), 1), ((1, 0, -1), 1), ((0, 1, 1), 0), ((0, 1, -1), 0))
"""Ways to look along, and an axis square to each."""


@dataclass(frozen=True, eq=False)
class Stars:
    """Vertices of a surface, `smooth` (n,) where their stars are height fields.

    `closed`: whether every edge has two faces, wound alike.
    """

    smooth: Bools
    closed: bool


def stars_of(surface: Surface) -> Stars:
    """Return the stars of a surface's vertices, each face where the file has it."""
    vertices, faces, areas = surface.mesh.vertices, surface.stored, surface.stored_areas
    edges = surface.edges if faces is surface.mesh.faces else edges_of(faces, len(vertices))
    normal, corners = np.ascontiguousarray(areas.T), np.ascontiguousarray(faces.T)
    solid = (normal != 0).any(axis=0)
    if not solid.all():
        normal, corners = normal.compress(solid, axis=1), corners.compress(solid, axis=1)
    whole = surrounded(edges, len(vertices))
    return Stars(height_fields(np.ascontiguousarray(vertices.T), corners, normal, whole), edges.closed)


def height_fields(columns: Floats, corners: Ints, areas: Floats, whole: Bools) -> Bools:
    """Return which vertices (3, n) have such a star, of the `whole` ones, `surrounded` by faces wound alike.

    `corners` (3, m) are the vertices of the faces, `areas` (3, m) twice their area vectors.
    """
    found = _along(_AXES, columns, corners, areas) & whole
    for further in (partial(_along, _DIAGONALS), _along_means):
        asked = whole & ~found
        some = np.flatnonzero(asked.take(corners[0]) | asked.take(corners[1]) | asked.take(corners[2]))
        if not len(some):
            break
        corners, areas = corners.take(some, axis=1), areas.take(some, axis=1)
        found |= further(columns, corners, areas) & asked
    return found


def _along(ways: Sequence[tuple[tuple[int, ...], int]], columns: Floats, corners: Ints, areas: Floats) -> Bools:
    """Return vertices whose faces all face one way, of some `ways`, and go round once, if all their faces are given.

    Seen along that way each face then turns the same way by less than half a turn, so turns are counted by the
    neighbours that pass the line of one coordinate, the one that each way has: comparisons only, hence exact.
    """
    n, m = columns.shape[1], corners.shape[1]
    kind = np.uint8 if len(ways) < 4 else np.uint16
    facing = np.zeros(m, kind)  # a bit a way: faces up along it; then those down
    rises, falls = np.zeros((2, 3, m), np.uint8)  # a bit an axis, for each side
    for start in range(0, m, _BLOCK):
        block = slice(start, start + _BLOCK)
        sides = _sides(columns, [corner[block].astype(np.intp) for corner in corners])
        least = _ROUNDING * _longest(sides)
        for place, (weights, _) in enumerate(ways):
            parts = [areas[axis, block] * weight for axis, weight in enumerate(weights) if weight]
            up = np.add.reduce(parts)
            more = least * (2 * len(parts) - 1)
            facing[block] |= (up > more).astype(kind) << place
            facing[block] |= (up < -more).astype(kind) << (place + len(ways))
        for axis in range(3):
            for k in range(3):
                rises[k, block] |= (sides[k][axis] > 0).view(np.uint8) << axis
                falls[k, block] |= (sides[k][axis] < 0).view(np.uint8) << axis
    common = np.full(n, (1 << 2 * len(ways)) - 1, kind)
    for corner in corners:
        np.bitwise_and.at(common, corner, facing)
    common = (common | (common >> len(ways))) & ((1 << len(ways)) - 1)
    line = np.zeros(n, np.uint8)  # of the first of them, as a bit
    for place, (_, axis) in reversed(list(enumerate(ways))):
        line[(common & (1 << place)) != 0] = 1 << axis
    turns = np.zeros(n, np.int64)
    for k, corner in enumerate(corners):
        passes = (rises[k] & ~falls[k - 1] & line.take(corner, mode="clip")) != 0
        turns += np.bincount(corner[passes], minlength=n)
    return (common != 0) & (turns == 1)


def _along_means(columns: Floats, corners: Ints, areas: Floats) -> Bools:
    """Return the same along the mean normal of each vertex' faces: corners.

    Rounding moves a face's turn by 2e-5 at most, and turns are whole.
    """
    n, m = columns.shape[1], corners.shape[1]
    blocks = [slice(start, start + _BLOCK) for start in range(0, m, _BLOCK)]
    share, angle, steep = np.empty(m), np.empty((3, m)), np.empty((3, m), bool)
    for block in blocks:
        here = list(areas[:, block])
        size = np.sqrt(_dot(here, here))
        sound = size > _SOUND * _longest(_sides(columns, [corner[block].astype(np.intp) for corner in corners]))
        share[block] = 1 / np.where(sound, size, np.inf)
    along = [np.add.reduce([np.bincount(corner, share * area, n) for corner in corners]) for area in areas]
    length = np.maximum(np.sqrt(_dot(along, along)), 1e-300)
    along = [part / length for part in along]
    for block in blocks:
        near, here = [corner[block].astype(np.intp) for corner in corners], list(areas[:, block])
        sides = _sides(columns, near)
        for k, corner in enumerate(near):
            up = [part.take(corner) for part in along]
            double = _dot(here, up)
            flat = _dot(sides[k], up) * _dot(sides[k - 1], up) - _dot(sides[k], sides[k - 1])
            steep[k, block] = double * share[block] <= _FACING
            np.arctan2(double, flat, out=angle[k, block])
    turns, seen = np.zeros(n), np.ones(n, bool)
    for k, corner in enumerate(corners):
        seen[corner[steep[k]]] = False
        turns += np.bincount(corner, angle[k], n)
    return seen & (np.abs(turns - 2 * np.pi) < 0.1)


def _sides(columns: Floats, ids: list[Ints]) -> list[list[Floats]]:
    """Return the sides of faces from each corner to the next, by axis."""
    at = [[column.take(corner, mode="clip") for column in columns] for corner in ids]
    return [[at[(k + 1) % 3][axis] - at[k][axis] for axis in range(3)] for k in range(3)]


def _longest(sides: list[list[Floats]]) -> Floats:
    """Return the squared longest side."""
    one, two, three = (_dot(side, side) for side in sides)
    return np.maximum(np.maximum(one, two), three)


def _dot(a: list[Floats], b: list[Floats]) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

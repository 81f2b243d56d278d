"""Sieves for pairs of faces: boxes, planes, corners in common. What they leave is decided by exact signs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, among, distinct, sorted_with_order

MOST_CONTACTS = 1_000_000
"""Pairs of faces that `Contacts` holds, unless it is told another number."""


@dataclass(eq=False)
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found.

    With more than `most` pairs of faces it is `full`, and takes no more.
    """

    shells: int
    most: int = MOST_CONTACTS
    full: bool = False
    noted: list[tuple[Ints, Ints]] = field(default_factory=list)
    sorted_already: int = 0

    def keys(self, one: Ints, other: Ints) -> Ints:
        """Return a number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def add(self, shell: Ints, i: Ints, j: Ints) -> None:
        """Note pairs of faces i, j that meet, of those whose shells differ; `shell` has the shell of each face."""
        one, other = shell.take(i), shell.take(j)
        apart = np.flatnonzero(one != other)
        if self.full or not len(apart):
            return
        self.noted.append((self.keys(one[apart], other[apart]), np.stack([i[apart], j[apart]], axis=1)))
        if sum(len(keys) for keys, _ in self.noted) > max(self.most, 2 * self.sorted_already):
            self.sorted_already = len(self.pairs()[0])
            self.full = self.sorted_already > self.most // 2

    def unknown(self, shell: Ints, i: Ints, j: Ints) -> Ints:
        """Return the places of pairs of faces i, j whose shells differ and are not known to meet."""
        one, other = shell.take(i), shell.take(j)
        if self.full:
            return np.empty(0, np.int64)
        return np.flatnonzero((one != other) & ~among(self.keys(one, other), self.pairs()[0]))

    def pairs(self) -> tuple[Ints, Ints]:
        """Return the keys of shells that meet and pairs of their faces (k, 2), in the order of the keys."""
        if not self.noted:
            return np.empty(0, np.int64), np.empty((0, 2), np.int32)
        keys, pairs = (np.concatenate(part) for part in zip(*self.noted, strict=True))
        ordered, order = sorted_with_order(keys.astype(np.uint64), max(self.shells**2 - 1, 1).bit_length())
        fresh = distinct(ordered)
        self.noted = [(ordered[fresh].astype(np.int64), pairs[order[fresh]])]
        return self.noted[0]


_UNIT = np.finfo(np.float64).eps / 2
_PLANE = 128 * _UNIT  # of longest side ** 2 * largest coordinate: a height times twice the area is off by less
_TINY = 1e-270  # more than underflow takes from coordinates that fit single precision


@dataclass(frozen=True, eq=False)
class Planes:
    """Faces by their corners and planes.

    `columns` (3, n): the coordinates of vertices; `ids` (3, m): the vertices of the faces; `normal` (3, m): twice their
    area vectors; `offset` and `error` (m,): normal * point - offset is right to within the error. `near` (m,) is what
    it is at the height that rounding may give a point of the plane.
    """

    columns: Floats
    ids: Ints
    normal: Floats
    offset: Floats
    error: Floats
    near: Floats

    def vertices(self, i: Ints) -> Ints:
        """Return the vertices of faces i: (corner, n), to take with."""
        return self.ids.take(i, axis=1, mode="clip").astype(np.intp)

    def corners(self, ids: Ints) -> Floats:
        """Return the corners of faces by their vertices: (corner, axis, n)."""
        corners = np.empty((3, 3, ids.shape[1]))
        for k, at in enumerate(ids):
            for axis, column in enumerate(self.columns):
                column.take(at, mode="clip", out=corners[k, axis])
        return corners

    def one_side(self, i: Ints, others: Ints, shared: Ints) -> tuple[Bools, Bools]:
        """Return whether the vertices `others` (corner, n) of faces are on one side of the plane of each face i.

        0 to 3 of them are `shared`, and left out. Also return whether all of them are near the plane.
        """
        x, y, z = (row.take(i, mode="clip") for row in self.normal)
        offset, error = self.offset.take(i, mode="clip"), self.error.take(i, mode="clip")
        above, below = np.zeros((2, len(i)), np.int8)
        farthest = np.zeros(len(i))
        for at in others:
            height = self.columns[0].take(at, mode="clip")
            height *= x
            for part, column in ((y, self.columns[1]), (z, self.columns[2])):
                term = column.take(at, mode="clip")
                term *= part
                height += term
            height -= offset
            above += height > error
            below += height < -error
            np.maximum(farthest, np.abs(height, out=height), out=farthest)
        clear = ((above == 0) | (below == 0)) & (above + below >= 3 - shared) & (shared < 3)
        return clear, farthest <= self.near.take(i, mode="clip")


def planes_of(columns: Floats, ids: Ints, normal: Floats, rounding: Floats) -> Planes:
    """Return the planes of faces from vertices (3, n), their ids (3, m) and their `area_vectors` (3, m).

    `rounding` (m,): the height that rounding may give a point of a plane, mm.
    """
    low, high = columns.min(axis=1), columns.max(axis=1)
    offset, longest = np.zeros((2, ids.shape[1]))
    for axis, column in enumerate(columns):
        at = [column.take(corner) for corner in ids]
        offset += normal[axis] * at[0]
        for k in range(3):
            side = at[k] - at[k - 1]
            np.maximum(longest, np.abs(side, out=side), out=longest)
    longest *= longest
    longest *= _PLANE * float(np.maximum(-low, high).max())
    longest += _TINY
    return Planes(columns, ids, normal, offset, longest, rounding * np.sqrt(dot(normal, normal)) + longest)


_SOUND = 1e-9  # of the squared longest side: faces with less area have no direction worth adding to a mean
_FACES = 1 << 14  # faces whose corners stay in the processor's cache
_FACING = 0.01  # cosine to the mean direction


def height_fields(columns: Floats, corners: Ints, areas: Floats, whole: Bools) -> Bools:
    """Return which vertices (3, n) have a star that is a height field, of the `whole` ones (`surrounded`).

    `corners` (3, m) are the vertices of faces with an area, `areas` (3, m) twice their area vectors. Along the mean
    normal of the vertex the faces of its star face one way and go round it once. Rounding moves a face's turn by 2e-5
    at most, and turns are whole.
    """
    n, m = columns.shape[1], corners.shape[1]
    blocks = [slice(start, start + _FACES) for start in range(0, m, _FACES)]
    share, angle, steep = np.empty(m), np.empty((3, m)), np.empty((3, m), bool)
    for block in blocks:
        here = list(areas[:, block])
        size = np.sqrt(dot(here, here))
        sides = _sides_of(columns, corners[:, block])
        longest = np.maximum.reduce([dot(side, side) for side in sides])
        share[block] = 1 / np.where(size > _SOUND * longest, size, np.inf)
        for k in range(3):  # a normal counts by the angle of its face there, however many faces a fan is cut into
            np.arctan2(size, -dot(sides[k], sides[k - 1]), out=angle[k, block])
    angle *= share
    along = [np.add.reduce([np.bincount(corners[k], angle[k] * area, n) for k in range(3)]) for area in areas]
    length = np.maximum(np.sqrt(dot(along, along)), 1e-300)
    along = [part / length for part in along]
    for block in blocks:
        sides, here = _sides_of(columns, corners[:, block]), list(areas[:, block])
        for k, corner in enumerate(corners[:, block]):
            up = [part.take(corner) for part in along]
            double = dot(here, up)
            flat = dot(sides[k], up) * dot(sides[k - 1], up) - dot(sides[k], sides[k - 1])
            steep[k, block] = double * share[block] <= _FACING
            np.arctan2(double, flat, out=angle[k, block])
    turns, seen = np.zeros(n), whole.copy()
    for k, corner in enumerate(corners):
        seen[corner[steep[k]]] = False
        turns += np.bincount(corner, angle[k], n)
    return seen & (np.abs(turns - 2 * np.pi) < 0.1)


def _sides_of(columns: Floats, ids: Ints) -> list[list[Floats]]:
    """Return the sides of faces from each corner to the next, by axis."""
    at = [[column.take(corner, mode="clip") for column in columns] for corner in ids.astype(np.intp)]
    return [[at[(k + 1) % 3][axis] - at[k][axis] for axis in range(3)] for k in range(3)]


def dot(a: Floats | list[Floats], b: Floats | list[Floats]) -> Floats:
    """Return the products of vectors by axis."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

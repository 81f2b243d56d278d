"""Pairs of faces that a plane sets apart: most pairs whose boxes meet, decided in floats with a bound on rounding.

Two faces are apart where the plane of one has the other wholly on one side. Faces that share a corner or an edge meet
nowhere else where the rest of one is on one side of the other's plane. The same holds of the line through a side of
one and of all corners as seen along an axis: that sets faces in one plane apart.

The size of the whole mesh takes part in the bounds. What is too small beside it is left to exact signs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints

_UNIT = np.finfo(np.float64).eps / 2
_PLANE = 128 * _UNIT  # of longest side ** 2 * largest coordinate: a height times twice the area is off by less
_LINE = 16 * _UNIT  # of the mesh's size ** 2: twice an area in a plane is off by less
_TINY = 1e-270  # more than underflow takes from coordinates that fit single precision
_FACES = 1 << 14  # faces whose corners stay in the processor's cache


@dataclass(frozen=True, eq=False)
class Planes:
    """Faces by their corners and planes.

    `columns` (3, n): the coordinates of vertices; `ids` (3, m): the vertices of the faces; `normal` (3, m): twice their
    area vectors; `offset` and `error` (m,): normal * point - offset is right to within the error. `line_error` is the
    same for twice an area in a plane square to an axis.
    """

    columns: Floats
    ids: Ints
    normal: Floats
    offset: Floats
    error: Floats
    line_error: float

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

    def one_side(self, i: Ints, others: Ints, shared: Ints) -> Bools:
        """Return whether the vertices `others` (corner, n) of faces are on one side of the plane of each face i.

        0 to 3 of them are `shared`, and left out.
        """
        x, y, z = (row.take(i, mode="clip") for row in self.normal)
        offset, error = self.offset.take(i, mode="clip"), self.error.take(i, mode="clip")
        above, below = np.zeros((2, len(i)), np.int8)
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
        return ((above == 0) | (below == 0)) & (above + below >= 3 - shared) & (shared < 3)

    def seen_apart(self, i: Ints, a: Floats, b: Floats, shared: Ints) -> Bools:
        """Return whether a side of a or b has them on both sides of its line, as seen along the axis that i faces most.

        `a` are the corners of i, `b` those of the other face.
        """
        drop = np.argmax(np.abs(self.normal.take(i, axis=1)), axis=0)
        rows = np.arange(len(i))
        (x_a, y_a), (x_b, y_b) = ([corners[:, (drop + k) % 3, rows] for k in (1, 2)] for corners in (a, b))
        return self._outside(x_a, y_a, x_b, y_b, shared) | self._outside(x_b, y_b, x_a, y_a, shared)

    def _outside(self, x: Floats, y: Floats, other_x: Floats, other_y: Floats, shared: Ints) -> Bools:
        """Return whether all of the other's corners (corner, pair) are outside one side of a triangle in the plane."""
        along_x, along_y = x[[1, 2, 0]] - x, y[[1, 2, 0]] - y
        turn = along_x[0] * along_y[1] - along_y[0] * along_x[1]
        turn = np.sign(turn) * (np.abs(turn) > self.line_error)
        along_x *= turn
        along_y *= turn
        inside, outside = np.zeros((2, *x.shape), np.int8)
        for k in range(3):
            height = along_x * (other_y[k] - y)
            height -= along_y * (other_x[k] - x)
            inside += height > self.line_error
            outside += height < -self.line_error
        return np.asarray(((inside == 0) & (outside >= 3 - shared) & (shared < 3)).any(axis=0))


def planes_of(columns: Floats, ids: Ints, normal: Floats) -> Planes:
    """Return the planes of faces from vertices (3, n), their ids (3, m) and their `area_vectors` (3, m)."""
    low, high = columns.min(axis=1), columns.max(axis=1)
    offset, longest = np.zeros((2, ids.shape[1]))
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, column in enumerate(columns):
            at = [column.take(place, mode="clip") for place in places]
            offset[block] += normal[axis, block] * at[0]
            for k in range(3):
                side = at[k] - at[k - 1]
                np.maximum(longest[block], np.abs(side, out=side), out=longest[block])
    longest *= longest
    longest *= _PLANE * float(np.maximum(-low, high).max())
    longest += _TINY
    return Planes(columns, ids, normal, offset, longest, _LINE * float((high - low).max()) ** 2 + _TINY)

"""A mesh as the rules see it: vertices in mm, faces as indices, and the places of its triangles in the file.

Readers give a triangle soup or an indexed mesh; `weld_exact` makes the one into the other without moving a vertex.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from manifold3d import Manifold, Mesh64
from numpy.typing import NDArray

from unitcad.geometry.arrays import Bools, Floats, Ints, by_appearance, distinct, order_of_packed, unique_rows

_NO_INDEX = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Source:
    """The places of a mesh's triangles (m) in its file, by polygon (p); None or empty: unknown.

    `polygons` (m,) gives the polygon of each triangle, None if every triangle is one by itself. `lines` (p,) are
    line numbers from 1. `starts` (s,) are the first polygons of the file's objects, `names` their names, a line each.
    """

    polygons: Ints | None = None
    lines: Ints | None = None
    part: str | None = None
    starts: Ints = field(default_factory=lambda: _NO_INDEX)
    names: bytes = b""

    @cached_property
    def _names(self) -> list[str]:
        return [name.strip() for name in self.names.decode("utf-8", "replace").split("\n")]

    def line(self, polygon: int) -> int | None:
        """Return the line on which a polygon stands."""
        return None if self.lines is None else int(self.lines[polygon])

    def object(self, polygon: int) -> str | None:
        """Return the name of the object that a polygon belongs to."""
        at = int(np.searchsorted(self.starts, polygon, "right")) - 1
        return self._names[at] if at >= 0 and self._names[at] else None


LARGEST = float(np.finfo(np.float32).max)
"""Coordinates beyond this, and NaN, are no numbers of a mesh (V001), in whatever precision a file has them."""

SMALLEST = float(np.finfo(np.float32).smallest_subnormal)
"""Coordinates below this are 0 as float32, and are taken for it: even doubles do not hold their products."""

_BLOCK = 1 << 15  # points that stay in the processor's cache


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices (n, 3) float64 mm, faces (m, 3) int32 into them; `normals` (m, 3) as stored, if the format has them.

    `name`: the object of the file, `source`: the places of its triangles in the file. `indexed` is false if vertices
    were shared only by their place.
    """

    vertices: Floats
    faces: Ints
    normals: Floats | None = None
    name: str | None = None
    indexed: bool = True
    source: Source | None = None


def representable(points: Floats) -> Floats:
    """Return the points with 0 for each coordinate below SMALLEST; the same array if there is none."""
    size = np.abs(points)
    tiny = (size < SMALLEST) & (size > 0)
    return np.where(tiny, 0.0, points) if tiny.any() else points


def weld_exact(corners: Floats) -> tuple[Floats, Ints]:
    """Return distinct points as float64 (v, 3), and for each of the corners (m, k, 3) which of them it is, (m, k).

    Points with the same three numbers are one; -0.0 is 0.0. They are in the order in which they first appear: those of
    a face are mostly near each other then, which the processor's cache needs.
    """
    if corners.dtype != np.float32:
        corners = representable(corners)
    sides, n = corners.shape[1], corners.shape[0] * corners.shape[1]
    room = max(n - 1, 1).bit_length()
    bits = _bits(corners)
    key = _mix(bits) & ~np.uint64((1 << room) - 1)
    order = order_of_packed(key, room)
    fresh = distinct(key)
    places, number = by_appearance(order[fresh], n)
    index = np.empty(n, np.int32)
    index[order] = number.take(np.cumsum(fresh, dtype=np.int32) - np.int32(1))
    index = index.reshape(-1, sides)
    apart = (bits.take(places.take(index.reshape(-1)), axis=0) != bits).any(axis=1)
    if apart.any():
        places, index = _told_apart(bits, places, index, apart)
    vertices = corners[places // sides, places % sides]
    return vertices.astype(np.float64), index


def _told_apart(bits: NDArray[np.unsignedinteger], places: Ints, index: Ints, apart: Bools) -> tuple[Ints, Ints]:
    """Return `places` and `index` of corners (n, 3) of which some places have one hash; only those are sorted again.

    `apart` (n,): the corners that are not in the place of their index.
    """
    n = len(bits)
    first = places.take(index.reshape(-1))  # of each corner, the first one in its place
    among = np.zeros(len(places), bool)
    among[index.reshape(-1)[apart]] = True
    some = np.flatnonzero(among.take(index.reshape(-1)))
    distinct, place = unique_rows(bits[some])
    least = np.full(len(distinct), n)
    np.minimum.at(least, place, some)
    first[some] = least[place]
    fresh = first == np.arange(n)
    number = np.cumsum(fresh, dtype=np.int32) - np.int32(1)
    return np.flatnonzero(fresh), number.take(first).reshape(index.shape)


def weld_points(points: Floats) -> tuple[Floats, Ints]:
    """Return the result of `weld_exact` for points (n, 3): distinct ones, and for each which of them it is, (n,)."""
    vertices, index = weld_exact(points[:, None])
    return vertices, index.reshape(-1)


def _bits(corners: Floats) -> NDArray[np.unsignedinteger]:
    """Return the numbers of corners (m, k, 3) as integers, (m k, 3); -0.0 as 0.0."""
    # A record of a file is copied first: sums of a few numbers each, apart in memory, take three times as long.
    values = (np.ascontiguousarray(corners) + np.zeros(1, corners.dtype)).reshape(-1, 3)
    return values.view(np.uint32 if corners.dtype == np.float32 else np.uint64)


def same_place(points: Floats) -> Ints:
    """Return for each of (n, 3) points the first one that is in the same place."""
    places, index = weld_points(points)
    if len(places) == len(points):
        return np.arange(len(points), dtype=np.int32)
    first = np.flatnonzero(np.diff(np.maximum.accumulate(index), prepend=np.int32(-1)))
    return first[index].astype(np.int32)


def _mix(bits: NDArray[np.unsignedinteger]) -> NDArray[np.uint64]:
    """Return a 64-bit hash of each row of three integers (multiply and xor-shift, as in splitmix64)."""
    key = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        key += column
        key *= np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
        key *= np.uint64(0xBF58476D1CE4E5B9)
        key ^= key >> np.uint64(32)
    return key


def float32_step(vertices: Floats) -> float:
    """Return the distance between neighbouring float32 numbers at the largest coordinate, mm."""
    return float(float32_steps(vertices[None])[0])


def float32_steps(places: Floats) -> Floats:
    """Return the distance between neighbouring float32 numbers at the largest coordinate of each of n places, mm."""
    largest = np.abs(places).max(axis=tuple(range(1, places.ndim)), initial=0)
    return np.spacing(np.minimum(largest, 1e38).astype(np.float32)).astype(np.float64)


def solid_of(vertices: Floats, faces: Ints) -> Manifold:
    """Make manifold3d's solid of a mesh, vertices (n, 3) mm and faces (m, 3); empty if it refuses the mesh."""
    return Manifold(Mesh64(vert_properties=vertices, tri_verts=faces.astype(np.uint64)))


def area_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Return twice the area of each face along its normal (right-hand rule), (m, 3) mm2."""
    columns, areas = np.ascontiguousarray(vertices.T), np.empty((len(faces), 3))
    for start in range(0, len(faces), _BLOCK):
        block = slice(start, start + _BLOCK)
        one, two, three = (corner.astype(np.intp) for corner in faces[block].T)
        first, second = [], []
        for column in columns:
            origin = column.take(one)
            first.append(column.take(two) - origin)
            second.append(column.take(three) - origin)
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            np.subtract(first[i] * second[j], first[j] * second[i], out=areas[block, axis])
    return areas

"""A mesh as the rules see it: vertices in mm, faces as indices, and what else the file has.

Readers give a triangle soup or an indexed mesh; `weld_exact` makes the one into the other without moving a vertex.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from unitcad.check.geometry.source import Source
from unitcad.geometry.arrays import Floats, Ints, sorted_with_order

if TYPE_CHECKING:
    from manifold3d import Manifold

LARGEST = float(np.finfo(np.float32).max)
"""Coordinates beyond this, and NaN, are no numbers of a mesh (V001), in whatever precision a file has them."""

SMALLEST = float(np.finfo(np.float32).smallest_subnormal)
"""Coordinates below this are 0 as float32, and are taken for it: even doubles do not hold their products."""

_BLOCK = 1 << 15  # points that stay in the processor's cache


@dataclass(frozen=True)
class Mesh:
    """Vertices (n, 3) float64 mm, faces (m, 3) int32 into them; `normals` (m, 3) as stored, where the format has them.

    `name` says which object of the file this is, `source` where its triangles stand in the file. `indexed` is false
    where vertices were shared by their place alone. `single` is true where coordinates were stored as float32.
    """

    vertices: Floats
    faces: Ints
    normals: Floats | None = None
    name: str | None = None
    indexed: bool = True
    single: bool = False
    source: Source | None = None


def representable(points: Floats) -> Floats:
    """Return the points with 0 for each coordinate below SMALLEST; the same array where there is none."""
    size = np.abs(points)
    tiny = (size < SMALLEST) & (size > 0)
    return np.where(tiny, 0.0, points) if tiny.any() else points


def weld_exact(corners: Floats) -> tuple[Floats, Ints]:
    """Return vertices and faces of a triangle soup (m, 3, 3), welded by `weld_points`."""
    vertices, index = weld_points(corners.reshape(-1, 3))
    return vertices, index.reshape(-1, 3)


def weld_points(points: Floats) -> tuple[Floats, Ints]:
    """Return distinct points as float64 (v, 3), and for each of the points (n, 3) which of them it is.

    Points with the same three numbers are one; -0.0 is 0.0. They are in the order in which they first appear: those of
    a face are mostly near each other then, which the processor's cache needs.
    """
    flat = np.ascontiguousarray(points if points.dtype == np.float32 else representable(points))
    bits = (flat + np.zeros(1, flat.dtype)).view(np.uint32 if flat.dtype == np.float32 else np.uint64)
    kept = 64 - max(len(flat) - 1, 1).bit_length()
    key, order = sorted_with_order(_mix(bits) >> np.uint64(64 - kept), kept)
    starts = np.empty(len(key), bool)
    starts[:1] = True
    np.not_equal(key[1:], key[:-1], out=starts[1:])
    del key
    rank = np.cumsum(starts, dtype=np.int32)
    rank -= 1
    places, number = _by_appearance(order[starts])
    index = np.empty(len(flat), np.int32)
    index[order] = number.take(rank)
    vertices = flat[places]
    if not _same_places(vertices, index, flat):  # two places with one hash
        _, first, rank = np.unique(flat + np.zeros(1, flat.dtype), axis=0, return_index=True, return_inverse=True)
        places, number = _by_appearance(first)
        vertices, index = flat[places], number.take(rank.reshape(-1))
    return vertices.astype(np.float64), index


def _by_appearance(first: Ints) -> tuple[Ints, Ints]:
    """Return the first places of points (v,) in their order, and where in it each stands."""
    places, order = sorted_with_order(first.astype(np.uint64), int(first.max(initial=0)).bit_length())
    number = np.empty(len(first), np.int32)
    number[order] = np.arange(len(first), dtype=np.int32)
    return places.astype(np.intp), number


def same_place(points: Floats) -> Ints:
    """Return for each of (n, 3) points the first one that is in the same place."""
    distinct, index = weld_points(points)
    if len(distinct) == len(points):
        return np.arange(len(points), dtype=np.int32)
    first = np.flatnonzero(np.diff(np.maximum.accumulate(index), prepend=np.int32(-1)))
    return first[index].astype(np.int32)


def _same_places(vertices: Floats, index: Ints, flat: Floats) -> bool:
    blocks = (slice(start, start + _BLOCK) for start in range(0, len(flat), _BLOCK))
    return all(np.array_equal(vertices.take(index[block], axis=0), flat[block]) for block in blocks)


def _mix(bits: NDArray[np.unsignedinteger]) -> NDArray[np.uint64]:
    """Return a 64-bit hash of each row of three integers (multiply and xor-shift, as in splitmix64)."""
    keys = np.zeros(len(bits), np.uint64)
    for start in range(0, len(bits), _BLOCK):
        key = keys[start : start + _BLOCK]
        for column in range(3):
            key += bits[start : start + _BLOCK, column]
            key *= np.uint64(0x9E3779B97F4A7C15)
            key ^= key >> np.uint64(29)
            key *= np.uint64(0xBF58476D1CE4E5B9)
            key ^= key >> np.uint64(32)
    return keys


def float32_step(vertices: Floats) -> float:
    """Return the distance between neighbouring float32 numbers at the largest coordinate, mm."""
    if not len(vertices):
        return 0.0
    largest = max(abs(float(vertices.min())), abs(float(vertices.max())))
    return float(np.spacing(np.float32(min(largest, 1e38))))


def float32_steps(places: Floats) -> Floats:
    """Return the distance between neighbouring float32 numbers at the largest coordinate of each of n places, mm."""
    largest = np.abs(places).max(axis=tuple(range(1, places.ndim)), initial=0)
    return np.spacing(np.minimum(largest, 1e38).astype(np.float32)).astype(np.float64)


def solid_of(vertices: Floats, faces: Ints) -> Manifold:
    """Make manifold3d's solid of a mesh, vertices (n, 3) mm and faces (m, 3); empty where it refuses the mesh."""
    from manifold3d import Manifold, Mesh64

    return Manifold(Mesh64(vert_properties=vertices, tri_verts=faces.astype(np.uint64)))


def area_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Return twice the area of each face along its normal (right-hand rule), (m, 3) mm2."""
    corners = [np.ascontiguousarray(faces[:, k]) for k in range(3)]
    first, second = [], []
    for axis in range(3):
        column = np.ascontiguousarray(vertices[:, axis])
        origin = column.take(corners[0])
        first.append(column.take(corners[1]) - origin)
        second.append(column.take(corners[2]) - origin)
    areas = np.empty((len(faces), 3))
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        np.subtract(first[i] * second[j], first[j] * second[i], out=areas[:, axis])
    return areas

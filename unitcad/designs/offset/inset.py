"""Inner layers of a body: its surface, moved inwards. Lengths in mm.

The distance d(p) to the surface, without its flat bottom on the seat, is known exactly at the nodes of a lattice of
cubes of side h. Each cube is cut into six tetrahedra (Kuhn, 1960), and the level d = t is interpolated on them. d changes
by no more than the way walked. All corners of a tetrahedron are on a sphere of radius h sqrt(3) / 2. So no point of the
level is off by more than that; on a smooth surface of radius R it is about h^2 / 8 R. Of an upright wall the level is
upright too, since all tetrahedra of a column cut it alike: a cup slides off it.

Only nodes near the level matter. The closest point of such a node is on a triangle whose corners, moved inwards along
the normals round them, are next to the node (the closest point transform of Mauch, 2000).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, open_edges
from unitcad.meshcheck.geometry.distance import squares
from unitcad.meshcheck.geometry.mesh import solid_of
from unitcad.shape import Polyhedron
from unitcad.shape.profile import GRID_PER_MM
from unitcad.shape.tree import corners_and_faces
from unitcad.spec.body_file import on_grid

MOST_NODES = 1_000_000
"""Nodes of a lattice, about."""
SHARE = 1 / 3
"""Share of the thinnest layer that the bound of the error is, at most, in a body of ordinary size."""
LEAST_SIDE = 0.1
"""Least side of the lattice's cubes, mm: finer ones make more triangles than moulds need."""
CIRCLE = 3**0.5 / 2
"""Radius of the sphere round a cube of side 1: the bound of the error, in sides."""
_NEAR = 0.01
"""Least distance of the level from a node, in sides: nearer ones make triangles that the grid flattens."""
_FLAT = 0.004
_BAND = 2.0
"""Sides on either side of the level within which distances are exact: its cubes reach as far as their diagonal."""
_PAIRS = 1_000_000
"""Pairs of a node and a triangle that are compared at once."""
_SEAT = 0.5 / GRID_PER_MM


def side_of(body: Polyhedron, thickness: float, by: float) -> float:
    """Return the side of the lattice for a layer of a thickness, and an offset of `by`, mm."""
    size = float(np.prod(np.maximum(np.ptp(corners_and_faces(body)[0], axis=0) - (by, by, 0), by)))
    return max(SHARE * thickness / CIRCLE, LEAST_SIDE, (size / MOST_NODES) ** (1 / 3))


@lru_cache(maxsize=16)
def inset(body: Polyhedron, by: float, side: float) -> Polyhedron | None:
    """Return the largest part of a body that is deeper than `by` under its surface; None if nothing is.

    It reaches a little under the seat. `side`: that of the lattice, mm, at most half of `by`.
    """
    corners, faces = corners_and_faces(body)
    low, high = corners.min(axis=0) + by - side, corners.max(axis=0) - by + side
    # Levels of the lattice are on the seat.
    low[2] = -2 * side
    if (high <= low + side).any():
        return None
    counts = np.ceil((high - low) / side).astype(int) + 1
    depth = _Field.of(corners, faces, by + _BAND * side, _BAND * side).on(low, side, counts) - by
    depth = np.where(depth > 0, np.maximum(depth, _NEAR * side), np.minimum(depth, -_NEAR * side))
    border = np.ones(depth.shape, bool)
    border[1:-1, 1:-1, 1:-1] = False
    depth[border] = -side
    found = solid_of(*_level(depth, low, side))
    # Outside the body too there are nodes far from its surface.
    deep = np.where(corners[:, 2:] <= _SEAT, [0, 0, low[2]], 0.0)
    reach = solid_of(corners + deep, faces)
    pieces = [piece for piece in found.decompose() if (piece ^ reach).volume() > piece.volume() / 2 > 0]
    if not pieces:
        return None
    mesh = max(pieces, key=lambda piece: piece.volume()).simplify(_FLAT).to_mesh64()
    return on_grid("", "layer", np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, np.int64))


def _level(values: Floats, low: Floats, side: float) -> tuple[Floats, Ints]:
    """Return corners and faces of the level 0 of values at the nodes of a lattice: positive ones are inside."""
    shape = values.shape
    inside = values > 0
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    parts = [
        inside[i : shape[0] - 1 + i, j : shape[1] - 1 + j, k : shape[2] - 1 + k] for i, j, k in np.ndindex(2, 2, 2)
    ]
    many: Ints = np.sum(parts, axis=0)
    cubes = np.stack(np.nonzero((many > 0) & (many < 8)), axis=1) @ stride
    ways = [np.cumsum([0, *stride[list(axes)]]) for axes in permutations(range(3))]
    odd = [np.linalg.det(np.eye(3)[list(axes)]) < 0 for axes in permutations(range(3))]
    tetrahedra = np.concatenate(
        [cubes[:, None] + (way[[0, 2, 1, 3]] if turned else way) for way, turned in zip(ways, odd, strict=True)]
    )
    flat = values.ravel()
    mask = (inside.ravel()[tetrahedra] * (1, 2, 4, 8)).sum(axis=1)
    edges = np.concatenate([tetrahedra[mask == m][:, triangle] for m in range(1, 15) for triangle in _CASES[m]])
    pairs, index = np.unique(np.sort(edges.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    first, last = (np.stack(np.unravel_index(end, shape), axis=1) for end in pairs.T)
    share = flat[pairs[:, 0]] / (flat[pairs[:, 0]] - flat[pairs[:, 1]])
    corners = low + side * (first + share[:, None] * (last - first))
    return corners, index.reshape(-1, 3)


def _cases() -> list[list[list[list[int]]]]:
    """Return for each set of corners of a tetrahedron that are inside the triangles of the level, as edges that it cuts."""
    place = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    found: list[list[list[list[int]]]] = []
    for mask in range(16):
        ins, outs = ([k for k in range(4) if (mask >> k & 1) == side] for side in (1, 0))
        if len(ins) == 2:
            (i, j), (k, m) = ins, outs
            loop = [[i, k], [i, m], [j, m], [j, k]]
            triangles = [loop[:3], [loop[0], *loop[2:]]]
        else:
            triangles = [[[i, j] for i in ins for j in outs]] if len(ins) in (1, 3) else []
        for triangle in triangles:
            a, b, c = (place[edge].mean(axis=0) for edge in triangle)
            if np.cross(b - a, c - a) @ (place[outs].mean(axis=0) - place[ins].mean(axis=0)) < 0:
                triangle.reverse()
        found.append(triangles)
    return found


_CASES = _cases()


@dataclass(frozen=True)
class _Field:
    """The distance to a body's surface without its flat bottom.

    `corners` (3, 3, n) of its triangles; `low` and `high` (n, 3): for each the box of the points within `far` whose
    closest one it may have.
    """

    corners: Floats
    low: Floats
    high: Floats
    far: float

    @staticmethod
    def of(corners: Floats, faces: Ints, far: float, outside: float) -> _Field:
        """Return the field up to `far` inside a body, and some way outside."""
        corners, faces = _skirted(corners, faces, far + 2 * outside)
        normals = _normal_ranges(corners, faces)
        pieces = _fine(np.concatenate([corners[faces], normals[faces]], axis=2), 3 * outside)
        at, least, most = pieces[:, :, :3], pieces[:, :, 3:6], pieces[:, :, 6:]
        ends = np.concatenate([at - depth * normal for depth in (-outside, far) for normal in (least, most)], axis=1)
        return _Field(np.ascontiguousarray(at.transpose(1, 2, 0)), ends.min(axis=1), ends.max(axis=1), far)

    def on(self, low: Floats, side: float, counts: Ints) -> Floats:
        """Return the distance at the nodes of a grid, exact up to `far` inside the body."""
        first = np.clip(np.ceil((self.low - low) / side).astype(int), 0, counts)
        last = np.clip(np.floor((self.high - low) / side).astype(int), -1, counts - 1)
        sides = np.maximum(last - first + 1, 0)
        size = sides.prod(axis=1)
        total = np.cumsum(size)
        found = np.full(int(np.prod(counts)), self.far**2)
        start = 0
        while start < len(total):
            most = (total[start - 1] if start else 0) + _PAIRS
            end = max(int(np.searchsorted(total, most, "right")), start + 1)
            face = np.repeat(np.arange(start, end), size[start:end])
            place = np.arange(len(face)) - np.repeat(
                total[start:end] - size[start:end] - (most - _PAIRS), size[start:end]
            )
            rest, k = np.divmod(place, sides[face, 2])
            i, j = np.divmod(rest, sides[face, 1])
            node = (first[face] + np.stack([i, j, k], axis=1)).T
            here = squares(low[:, None] + side * node, self.corners.take(face, axis=2))
            np.minimum.at(found, np.ravel_multi_index(tuple(node), tuple(counts)), here)
            start = end
        return np.sqrt(found).reshape(counts)


def without_bottom(corners: Floats, faces: Ints) -> Floats:
    """Return the triangles (n, 3, 3) of a surface without those on the seat z = 0."""
    return corners[faces[_off_seat(corners, faces)]]


def _off_seat(corners: Floats, faces: Ints) -> Bools:
    heights: Floats = np.abs(corners[faces][:, :, 2]).max(axis=1)
    return heights > _SEAT


def _skirted(corners: Floats, faces: Ints, deep: float) -> tuple[Floats, Ints]:
    """Return a surface without its faces on the seat; from their border it goes on straight down."""
    faces = faces[_off_seat(corners, faces)]
    a, b = open_edges(faces).T
    below = np.full(len(corners), -1)
    rim = np.unique(a)
    below[rim] = len(corners) + np.arange(len(rim))
    skirt = [np.stack([b, a, below[a]], axis=1), np.stack([b, below[a], below[b]], axis=1)]
    return np.concatenate([corners, corners[rim] - (0, 0, deep)]), np.concatenate([faces, *skirt])


def _normal_ranges(corners: Floats, faces: Ints) -> Floats:
    """Return for each corner the least and the largest components of the directions between the normals of its faces."""
    at = corners[faces]
    normals = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    least, most = np.full(corners.shape, np.inf), np.full(corners.shape, -np.inf)
    mean, cosine = np.zeros(corners.shape), np.ones(len(corners))
    for k in range(3):
        np.minimum.at(least, faces[:, k], normals)
        np.maximum.at(most, faces[:, k], normals)
        np.add.at(mean, faces[:, k], normals)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    for k in range(3):
        np.minimum.at(cosine, faces[:, k], np.einsum("ij,ij->i", normals, mean[faces[:, k]]))
    # The patch of the sphere between the normals bulges over the box of its corners; twice, for saddles.
    bulge = 2 * (1 - cosine)[:, None]
    return np.concatenate([np.maximum(least - bulge, -1), np.minimum(most + bulge, 1)], axis=1)


def _fine(pieces: Floats, side: float) -> Floats:
    """Return triangles (n, 3, 9), each corner with its range of normals, in pieces without a side longer than `side`."""
    done = []
    while len(pieces):
        sides = np.square(pieces - np.roll(pieces, -1, axis=1))[:, :, :3].sum(axis=2)
        large = sides.max(axis=1) > side * side
        done.append(pieces[~large])
        pieces = pieces[large]
        rows, first = np.arange(len(pieces)), np.argmax(sides[large], axis=1)
        a, b, c = (pieces[rows, (first + k) % 3] for k in range(3))
        # On an edge there are the normals of its two faces, which both of its ends have.
        middle = np.concatenate([(a + b)[:, :3] / 2, np.maximum(a, b)[:, 3:6], np.minimum(a, b)[:, 6:]], axis=1)
        pieces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done)

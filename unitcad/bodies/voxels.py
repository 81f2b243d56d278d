"""A body on a grid of cubes, coarse and quick: the search for a parting tries hundreds of ways on it.

The search only proposes. The tools are drawn exactly, and the mould checks decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

ALONG = 64
"""Cubes along a body's longest side."""
_OFF = np.array([0.4142135, 0.5772156, 0.0])
"""Place of a ray in its cell, in cubes: on no edge or diagonal of a body that is drawn on round numbers."""
_LEVEL = np.zeros((3, 3, 3), bool)
_LEVEL[1, :, 1] = _LEVEL[:, 1, 1] = True
"""Neighbours in one level."""


@dataclass(frozen=True)
class Voxels:
    """`filled[x, y, z]` tells of each cube whether it is in the body; `low` is the corner of the first, mm.

    A border of two free cubes is all round.
    """

    filled: np.ndarray
    low: np.ndarray
    side: float

    @cached_property
    def outer(self) -> np.ndarray:
        """Free cubes that are joined to the border within their own level: the space round the body."""
        labels = np.empty(self.filled.shape, np.int32)
        ndimage.label(~self.filled, _LEVEL, output=labels)
        return (labels == labels[:1, :1]) & ~self.filled

    @cached_property
    def inner(self) -> np.ndarray:
        """Free cubes that the body surrounds within their own level: holes and pockets."""
        return ~self.filled & ~self.outer

    def blocked(self, axis: int, way: int) -> np.ndarray:
        """Tell of each free cube whether the body is in its way along an axis, upwards (1) or downwards (-1)."""
        turned = self.filled if way < 0 else np.flip(self.filled, axis)
        met = np.logical_or.accumulate(turned, axis)
        return (met if way < 0 else np.flip(met, axis)) & ~self.filled

    def heights(self, axis: int) -> np.ndarray:
        """Return the lower borders of the cubes along an axis, mm; the last one is the grid's end."""
        return self.low[axis] + self.side * np.arange(self.filled.shape[axis] + 1)


def voxels(vertices: np.ndarray, faces: np.ndarray, along: int = ALONG) -> Voxels:
    """Return a closed mesh (vertices (n, 3) mm, faces (m, 3)) on a grid.

    A cube is filled if its middle is in the body, by rays along z.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    side = float((high - low).max()) / along
    shape = np.ceil((high - low) / side + 0.5).astype(int) + 4
    corner = low - 2 * side
    column, z, up = _crossings(vertices, faces, corner + _OFF * side, side, shape[:2])
    level = np.clip(np.ceil((z - corner[2]) / side - 0.5).astype(int), 0, shape[2])
    count = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int32)
    np.add.at(count, (column, level), np.where(up, -1, 1))
    filled = np.cumsum(count, axis=1)[:, :-1] > 0
    return Voxels(filled.reshape(shape), corner, side)


def _crossings(
    vertices: np.ndarray, faces: np.ndarray, origin: np.ndarray, side: float, shape: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of each crossing of an upright ray with a face: the ray, z in mm, and whether the face looks up."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    flat = np.abs(doubled) > 1e-12
    a, b, c, doubled = a[flat], b[flat], c[flat], doubled[flat]
    at = np.stack([a, b, c])[:, :, :2]
    first = np.clip(np.ceil((at.min(axis=0) - origin[:2]) / side).astype(int), 0, shape)
    last = np.clip(np.floor((at.max(axis=0) - origin[:2]) / side).astype(int), -1, shape - 1)
    wide, deep = np.maximum(last - first + 1, 0).T
    face = np.repeat(np.arange(len(a)), wide * deep)
    place = np.arange(len(face)) - np.repeat(np.cumsum(wide * deep) - wide * deep, wide * deep)
    i, j = first[face, 0] + place // deep[face], first[face, 1] + place % deep[face]
    x, y = origin[0] + side * i - a[face, 0], origin[1] + side * j - a[face, 1]
    (bx, by), (cx, cy) = (b - a)[face, :2].T, (c - a)[face, :2].T
    u, v = (x * cy - y * cx) / doubled[face], (y * bx - x * by) / doubled[face]
    met = (u >= 0) & (v >= 0) & (u + v < 1)
    face, u, v = face[met], u[met], v[met]
    z = a[face, 2] + u * (b - a)[face, 2] + v * (c - a)[face, 2]
    return i[met] * shape[1] + j[met], z, doubled[face] > 0

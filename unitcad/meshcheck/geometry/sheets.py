"""Sheets: places at which two sides of a surface lie on each other, so that a wall or a gap has no thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, FillRule

from unitcad.geometry.arrays import Floats, cross
from unitcad.geometry.components import components
from unitcad.meshcheck.geometry.disputed import deepest
from unitcad.meshcheck.geometry.mesh import Mesh, float32_step, weld_points
from unitcad.meshcheck.geometry.resolution import EXACT, STEPS, Resolution

_MOST = 200  # groups of faces that are measured
_TURNED = 0.9  # cosine: faces that are turned by more are in another plane


@dataclass(frozen=True, eq=False)
class Sheets:
    """The sheets of a mesh: `wide` is the diameter of the largest circle in one, mm; 0 if it is below rounding.

    `wall`: a printer could show one of them but for its thickness, and loses it, since air is on both sides. `gap`: it
    fills one, with material on both sides.
    """

    wide: float = 0.0
    wall: bool = False
    gap: bool = False


def sheets_of(mesh: Mesh, a: Floats, b: Floats, alone: Floats, limits: Resolution) -> Sheets:
    """Measure the sheets of faces, by their corners (n, 3, 3) mm.

    `a` and `b` are pairs that look opposite ways, `alone` those with the vertices of another face.
    """
    corners = np.concatenate([a, b, alone])
    normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    if not size.any():
        return Sheets()
    n = len(a)
    _, ids = weld_points(corners.reshape(-1, 3))
    faces = np.arange(len(corners))
    of_faces = np.concatenate([np.repeat(faces, 3), faces[:n]])
    others = np.concatenate([len(corners) + ids, faces[n : 2 * n]])
    group = components(len(corners) + int(ids.max()) + 1, of_faces, others)[: len(corners)]
    order, wide, gap = np.argsort(-size, kind="stable"), 0.0, False
    done, pieces = np.zeros(len(corners), bool), 0
    for largest in order.tolist():
        if done[largest] or pieces == _MOST or not size[largest]:
            continue
        pieces += 1
        normal = normals[largest] / size[largest]
        way = normals @ normal
        mine = ~done & (group == group[largest]) & (np.abs(way) >= _TURNED * size)
        mine[largest] = True
        done |= mine
        frame = _frame(normal)
        flat = (corners[mine] - corners[largest, 0]) @ frame[:, :2]
        flat[way[mine] < 0] = flat[way[mine] < 0][:, ::-1]  # all turn one way
        kind = np.where(faces[mine] >= 2 * n, 2, way[mine] > 0)
        # Of triangles that lie on each other, one fills the same area; many are slow.
        key = np.column_stack([kind, np.sort(ids.reshape(-1, 3)[mine], axis=1)])
        once = np.unique(key, axis=0, return_index=True)[1]
        flat, kind = flat[once], kind[once]
        down, up, twice = (CrossSection(list(flat[kind == k]), FillRule.NonZero) for k in range(3))
        radius, middle = deepest((down ^ up) + twice)
        if 2 * radius > STEPS * float32_step(corners[mine]):
            wide = max(wide, 2 * radius)
        if 2 * radius >= limits.feature * EXACT:
            point = corners[largest, 0] + frame[:, :2] @ middle
            if abs(_winding_above(mesh, point, frame, limits.thin / 2)) != 1:
                return Sheets(wide, wall=True)
            gap = True
    return Sheets(wide, gap=gap)


def _frame(normal: Floats) -> Floats:
    """Return two directions of a plane and its normal as columns."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(normal, x), normal])


def _winding_above(mesh: Mesh, point: Floats, frame: Floats, height: float) -> int:
    """Return how often a surface winds round the place at a height over a point of a sheet, along the third axis."""
    away = (mesh.vertices - point) @ frame
    x, y = (away[:, k].take(mesh.faces) for k in (0, 1))
    near = np.flatnonzero((x.min(axis=1) <= 0) & (x.max(axis=1) >= 0) & (y.min(axis=1) <= 0) & (y.max(axis=1) >= 0))
    x, y, z = (away[:, k].take(mesh.faces[near]) for k in range(3))
    turns = np.stack([x[:, k - 2] * y[:, k - 1] - x[:, k - 1] * y[:, k - 2] for k in range(3)], axis=1)
    through = (turns > 0).all(axis=1) | (turns < 0).all(axis=1)
    turns, z = turns[through], z[through]
    above = np.einsum("ij,ij->i", turns, z) / turns.sum(axis=1) > height
    return int(np.sign(turns[above, 0]).sum())

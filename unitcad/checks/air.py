"""C400: air finds its way out. Every high region of a cavity meets the rim or a vent, level and tilted.

A high region is a peak of the cavity's height function that is a ceiling, not the top of something standing in it. Its
depth is the height from the peak down to the saddle over which it would empty. A dent shallower than a tenth of the
layer's thinnest part is ignored: it thins the layer by less than the printer's play does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.geometry.components import components
from unitcad.kernels.mesh import arrays
from unitcad.moulds.cavities import Cavity
from unitcad.moulds.lid import TILT_DEG, deepest
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.profile import GRID_PER_MM

ATTITUDES = ((0.0, 0.0), (TILT_DEG, 0.0), (TILT_DEG, 90.0), (TILT_DEG, 180.0), (TILT_DEG, 270.0))
"""(tilt, azimuth of the side that is raised), degrees. Vents are halfway between these azimuths: the worst case."""
_SAME = 1e-6
_AT_TOP = 1 / GRID_PER_MM
"""Height that snapping may take from the opening, mm."""
CREVICE = 1e-6
"""A pocket of a smaller share of the cavity is a crevice that rounding leaves between two pieces, as in C100."""


@dataclass(frozen=True)
class Pocket:
    """Air held back under `peak` (mm): its depth (mm), in the attitude (degrees) in which it is."""

    depth: float
    tilt: float
    azimuth: float
    peak: tuple[float, float, float]


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure the deepest pocket of every cavity over the five attitudes."""
    return (_of_cavity(cavity, deepest(moulds.spec, cavity.step.index - 1)) for cavity in moulds.cavities)


def _of_cavity(cavity: Cavity, limit: float) -> MouldFinding:
    """Compare the depth of a cavity's deepest pocket with `limit`, mm."""
    reached, top = cavity.reached, cavity.step.top
    for pocket in pockets(reached, top):
        if pocket.depth <= limit:
            return at_most("C400", cavity.where, pocket.depth, limit, "mm")
        volume = pocket_volume(reached, top, pocket)
        if volume > CREVICE * reached.volume():
            where = f"{cavity.where}, tilted by {pocket.tilt:g} degrees towards {pocket.azimuth:g}"
            advice = f"{volume:.3g} mm3 of air find no way to the rim or a vent"
            return at_most("C400", where, pocket.depth, limit, "mm", advice)
    return at_most("C400", cavity.where, 0.0, limit, "mm")


def pockets(cavity: Manifold, top: float) -> list[Pocket]:
    """Return the pockets of a cavity that is open at z = `top` (mm), over `ATTITUDES`, the deepest first."""
    vertices, faces = arrays(cavity)
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = np.stack(np.divmod(np.unique(sides[:, 0] * len(vertices) + sides[:, 1]), len(vertices)), axis=1)
    normals, opening = _normals(vertices, faces), vertices[:, 2] >= top - _AT_TOP
    kept = [
        Pocket(depth, tilt, azimuth, tuple(peak.tolist()))
        for tilt, azimuth in ATTITUDES
        for depth, peak in _pockets(vertices, edges, normals, opening, upwards(tilt, azimuth))
    ]
    return sorted(kept, key=lambda pocket: -pocket.depth)


def pocket_volume(cavity: Manifold, top: float, pocket: Pocket) -> float:
    """Return the volume of the air that a pocket traps, mm3."""
    up, peak = upwards(pocket.tilt, pocket.azimuth), np.asarray(pocket.peak)
    above = cavity.trim_by_plane(tuple(up), float(peak @ up) - pocket.depth + _SAME)
    total = 0.0
    for part in above.decompose():
        corners = arrays(part)[0]
        if np.min(np.linalg.norm(corners - peak, axis=1)) < 1e-3 and corners[:, 2].max() < top - _AT_TOP:
            total += part.volume()
    return total


def upwards(tilt: float, azimuth: float) -> np.ndarray:
    """Return the unit vector that is up when the mould's side at `azimuth` is raised by `tilt` (degrees)."""
    t, a = math.radians(tilt), math.radians(azimuth)
    return np.array([math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), math.cos(t)])


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the outward normals at the vertices, weighted by angle."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normals = np.zeros_like(vertices)
    for i in range(3):
        a, b = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        lengths = np.maximum(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-300)
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", a, b) / lengths, -1, 1))
        np.add.at(normals, faces[:, i], angle[:, None] * normal)
    return normals


def _pockets(
    vertices: np.ndarray, edges: np.ndarray, normals: np.ndarray, opening: np.ndarray, up: np.ndarray
) -> list[tuple[float, np.ndarray]]:
    """Return (depth, peak) of every ceiling peak that does not meet the opening."""
    height = vertices @ up
    first, second = edges.T
    level = np.abs(height[first] - height[second]) <= _SAME
    plateau = components(len(height), *edges[level].T)
    count = int(plateau.max(initial=-1)) + 1
    rises = np.zeros(count, dtype=bool)
    step = height[second] - height[first]
    rises[plateau[first[step > _SAME]]] = True
    rises[plateau[second[step < -_SAME]]] = True
    # A sum of angle-weighted normals points out of the cavity: up at a ceiling, down at the top of an obstacle.
    facing = np.bincount(plateau, weights=normals @ up, minlength=count)
    opens = np.bincount(plateau, weights=opening, minlength=count) > 0
    peaks = np.nonzero(~rises & ~opens & (facing > 0))[0]
    tops = [int(np.nonzero(plateau == peak)[0][0]) for peak in peaks]
    if not tops:
        return []
    # A pocket without a way out empties nowhere.
    low = np.maximum(_ways_out(edges, height, opening), height.min())
    return [(float(height[top] - low[top]), vertices[top]) for top in tops]


def _ways_out(edges: np.ndarray, height: np.ndarray, opening: np.ndarray) -> np.ndarray:
    """Return for every vertex the height of the lowest point of its highest way to the opening; -inf without one.

    From a vertex, going up to its steepest neighbour loses no height and ends on a top; so ways lead from top to top.
    """
    order = np.argsort(height, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    first, second = edges.T
    highest = rank.copy()
    np.maximum.at(highest, first, rank[second])
    np.maximum.at(highest, second, rank[first])
    top = order[highest]
    while not np.array_equal(above := top[top], top):
        top = above
    saddle, apart = np.minimum(height[first], height[second]), top[first] != top[second]
    one, other, saddle = top[first[apart]], top[second[apart]], saddle[apart]
    out = np.full(len(order), -np.inf)
    np.maximum.at(out, top[opening], height[opening])
    while True:
        before = out.copy()
        np.maximum.at(out, one, np.minimum(out[other], saddle))
        np.maximum.at(out, other, np.minimum(out[one], saddle))
        if np.array_equal(out, before):
            return np.minimum(out[top], height)


CHECK = MouldCheck("C400", "air: every high region of a cavity meets the rim or a vent, level and tilted", findings)

"""Shape to mesh with manifold3d. Meshes are closed by construction; lengths in mm, double precision."""

from __future__ import annotations

import math
from functools import lru_cache

import manifold3d
import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.shape import Common, Cut, Extrude, Place, Revolve, Shape, Union
from unitcad.shape.profile import Profile, points

FINEST, COARSEST = 4096, 24


def segment_count(radius: float, tolerance: float) -> int:
    """Sides of an area-true polygon whose distance from a circle of `radius` nowhere exceeds `tolerance` (both mm).

    Its corners stand r (a - 1) outside, a = sqrt(x / sin x) with x = 2 pi / n; the middles of its sides
    half as far inside. A multiple of 8, so that the axes and diagonals are vertices.
    """
    n = COARSEST
    while n < FINEST and radius * (area_true(n) - 1) > tolerance:
        n += 8
    return n


def area_true(segments: int) -> float:
    """The factor on a regular polygon's circumradius that gives it the circle's area."""
    step = 2 * math.pi / segments
    return math.sqrt(step / math.sin(step))


def realise(shape: Shape, segments: int) -> Manifold:
    """The solid of `shape`, every full turn in `segments` sides; revolved radii are area-true, so mating ones mate."""
    return _realise(shape, segments)


@lru_cache(maxsize=512)
def _realise(shape: Shape, segments: int) -> Manifold:
    match shape:
        case Revolve(profile):
            # Scaled after revolving: CrossSection rounds to a grid that the scaled radii would not lie on.
            swell = area_true(segments)
            return Manifold.revolve(CrossSection([points(profile, segments)]), segments).scale((swell, swell, 1.0))
        case Extrude(profile, z0, z1, holes, None):
            loops = [points(profile, segments), *(points(hole, segments)[::-1] for hole in holes)]
            return Manifold.extrude(CrossSection(loops), z1 - z0).translate((0, 0, z0))
        case Extrude(profile, z0, z1, _, Profile() as top):
            return _taper(points(profile, segments), points(top, segments), z0, z1)
        case Union(parts):
            return Manifold.batch_boolean([_realise(part, segments) for part in parts], manifold3d.OpType.Add)
        case Cut(body, tools):
            bodies = [_realise(body, segments), *(_realise(tool, segments) for tool in tools)]
            return Manifold.batch_boolean(bodies, manifold3d.OpType.Subtract)
        case Common(parts):
            return Manifold.batch_boolean([_realise(part, segments) for part in parts], manifold3d.OpType.Intersect)
        case Place(inner, turn, move):
            return _realise(inner, segments).transform(np.column_stack([turn, move]))
    raise TypeError(f"not a shape: {shape!r}")


def forget() -> None:
    """Drop every mesh that is kept for the next call: what a measurement of times needs."""
    _realise.cache_clear()


def arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (n, 3) in mm, double; faces (m, 3))."""
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, dtype=np.int64)


def bounds(solid: Manifold) -> tuple[float, ...]:
    """(x0, y0, z0, x1, y1, z1) in mm."""
    return tuple(solid.bounding_box())


def _taper(below: np.ndarray, above: np.ndarray, z0: float, z1: float) -> Manifold:
    """A ruled solid between two polygons with as many corners, the lower one counter-clockwise."""
    n = len(below)
    floor = np.column_stack([below, np.full(n, z0)])
    roof = np.column_stack([above, np.full(n, z1)])
    cap_below = manifold3d.triangulate([below])[:, ::-1]
    cap_above = manifold3d.triangulate([above]) + n
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.vstack([np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])])
    mesh = manifold3d.Mesh64(np.vstack([floor, roof]), np.vstack([cap_below, cap_above, sides]).astype(np.uint64))
    return Manifold(mesh)

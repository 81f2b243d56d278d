"""The upright box round a shape, found from its tree without a mesh."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from unitcad.shape.profile import GRID_PER_MM
from unitcad.shape.tree import (
    UNTURNED,
    Below,
    Common,
    Component,
    Cut,
    Extrude,
    Place,
    Polyhedron,
    Revolve,
    Shape,
    Turn,
    Union,
)

Point = tuple[float, float, float]
Extent = tuple[float, float, float, float, float, float]
"""The low corner of a box, then the high one, mm."""


def extent(shape: Shape, turn: Turn = UNTURNED, move: Point = (0.0, 0.0, 0.0)) -> Extent:
    """Return a box around a shape, turned and then moved: (x0, y0, z0, x1, y1, z1), mm; round all that cuts leave."""
    match shape:
        case Place():
            columns = [_transform(turn, column, (0.0, 0.0, 0.0)) for column in zip(*shape.turn, strict=True)]
            return extent(shape.shape, tuple(zip(*columns, strict=True)), _transform(turn, shape.move, move))
        case Cut(body, _):
            return extent(body, turn, move)
        case Union(parts) | Common(parts):
            boxes = np.array([extent(part, turn, move) for part in parts])
            inner, outer = (np.max, np.min) if isinstance(shape, Common) else (np.min, np.max)
            return *inner(boxes[:, :3], axis=0).tolist(), *outer(boxes[:, 3:], axis=0).tolist()
    return _placed_box(_box_of(shape), turn, move)


@lru_cache(maxsize=4096)
def _box_of(shape: Shape) -> Extent:
    """Return a box around a leaf in its own frame, mm; a circle's polygon may exceed the circle a little."""
    match shape:
        case Revolve(profile):
            _, z0, r, z1 = profile.bounds
            r *= 1 + 1 / 32  # an area-true polygon of 24 sides, the coarsest, reaches to 1.012 r
            return -r, -r, z0, r, r, z1
        case Extrude(profile, z0, z1, _, top):
            x0, y0, x1, y1 = profile.bounds
            if top is not None:
                u0, v0, u1, v1 = top.bounds
                x0, y0, x1, y1 = min(x0, u0), min(y0, v0), max(x1, u1), max(y1, v1)
            return x0, y0, z0, x1, y1, z1
        case Polyhedron(vertices, _):
            corners = np.frombuffer(vertices, "<i4").reshape(-1, 3) / GRID_PER_MM
            return *corners.min(axis=0).tolist(), *corners.max(axis=0).tolist()
        case Component(inner, _):
            return extent(inner)
        case Below(inner, bottom):
            x0, y0, z0, x1, y1, z1 = extent(inner)
            return x0, y0, min(bottom, z0), x1, y1, z1
    raise TypeError(f"not a leaf: {shape!r}")


def _placed_box(extent: Extent, turn: Turn, move: Point) -> Extent:
    if turn == UNTURNED:
        x, y, z = move
        return extent[0] + x, extent[1] + y, extent[2] + z, extent[3] + x, extent[4] + y, extent[5] + z
    # Along each axis the two corners that reach least and farthest: exact for quarter turns, a bound for others.
    ends = [
        [sum(pick(row[k] * extent[k], row[k] * extent[k + 3]) for k in range(3)) + by for pick in (min, max)]
        for row, by in zip(turn, move, strict=True)
    ]
    (x0, x1), (y0, y1), (z0, z1) = ends
    return x0, y0, z0, x1, y1, z1


def _transform(turn: Turn, point: Point, move: Point) -> Point:
    """Return a point turned, then moved."""
    x, y, z = (sum(row[k] * point[k] for k in range(3)) + by for row, by in zip(turn, move, strict=True))
    return x, y, z

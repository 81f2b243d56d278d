"""The leaves under the ribs of a resin cup, measured on its mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.designs.limits import LEAF_WIDTH
from unitcad.moulds.cup import SLOPE, SQUARE, Rib

BESIDE = 0.4 * LEAF_WIDTH
"""Positions along the face at which a leaf is measured: clear of the rib in its middle."""
LINE, REACH, STEP = 0.02, 2.5, 0.002
"""Width of a section's strip, how far it reaches behind the face, how finely a root is looked for, mm."""


@dataclass(frozen=True)
class Leaf:
    """The worst of a cup's leaves, mm: how thick, how wide the slot behind it, and z up to which all are free."""

    thickness: float
    room: float
    root: float


def thickest_leaf(cup: Manifold, standing: Sequence[Rib], clearance: float) -> Leaf:
    """Return the greatest thickness, the least room and the lowest root of the leaves that carry `standing`.

    A leaf without slots has no room, and its root is at its crest.
    """
    level = (standing[0].bottom + standing[0].top) / 2
    section = cup.slice(level)
    measured = [_across(section, rib, level, side) for rib in standing for side in (-BESIDE, BESIDE)]
    free, fixed = level, 1.0
    while fixed - free > STEP:
        middle = (free + fixed) / 2
        freed = _all_free(cup.slice(middle), standing, middle, clearance)
        free, fixed = (middle, fixed) if freed else (free, middle)
    return Leaf(max(thick for thick, _ in measured), min(room for _, room in measured), free)


def _across(section: CrossSection, rib: Rib, level: float, along: float) -> tuple[float, float]:
    """Return the thickness of a leaf at a level, square to its face, and the room behind it."""
    found = _runs(section, rib, level, (0.0, -REACH), (along, along + LINE))
    if not found:
        return 0.0, 0.0
    (near, far), *others = found
    return (far - near) / SQUARE, (others[0][0] - far) / SQUARE if others else 0.0


def _all_free(section: CrossSection, standing: Sequence[Rib], level: float, clearance: float) -> bool:
    """Tell whether every leaf is free at a level: a slot behind it, a slot or an opening on both its sides."""
    depth, wide = -(clearance + LINE) * SQUARE, LEAF_WIDTH
    for rib in standing:
        if len(_runs(section, rib, level, (0.0, -REACH), (BESIDE, BESIDE + LINE))) < 2:
            return False
        across = _runs(section, rib, level, (depth, depth - LINE), (-wide, wide), along=True)
        if not any(-wide / 2 - LINE < low < 0 < high < wide / 2 + LINE for low, high in across):
            return False
    return True


def _runs(
    section: CrossSection,
    rib: Rib,
    level: float,
    depths: tuple[float, float],
    sides: tuple[float, float],
    along: bool = False,
) -> list[tuple[float, float]]:
    """Return the sorted intervals in which a strip over a face meets material, outwards of the face or `along` it."""
    (nx, ny), face = rib.inwards, level * SLOPE
    inwards, beside = np.array((nx, ny), float), np.array((-ny, nx), float)
    origin = np.array((rib.x, rib.y)) + inwards * face
    corners = [
        origin + inwards * d + beside * t for d, t in zip((*depths, *depths[::-1]), np.repeat(sides, 2), strict=True)
    ]
    way = beside if along else -inwards
    strip = CrossSection([np.array(corners)])
    if strip.area() == 0:
        strip = CrossSection([np.array(corners[::-1])])
    spans = []
    for patch in (strip ^ section).decompose():
        reach = (np.concatenate(patch.to_polygons()) - origin) @ way
        spans.append((float(reach.min()), float(reach.max())))
    return sorted(spans)

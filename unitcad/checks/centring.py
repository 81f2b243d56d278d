"""C220: the ribs that centre a cup bear on three faces or more, with the interference of the spec, and clear the seat.

Measured on the meshes: the patches in which cup and base overlap halfway up the ribs' crests. A patch's narrowest
extent is the interference, and its direction that of the face that the rib bears on. If any two neighbouring directions
are less than half a turn apart, the cup can't slip aside. Ribs of resin are on leaves, which must bend without
breaking, into the slot behind them. A cup without ribs has a play.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.checks.finding import GRID, MouldCheck, MouldFinding, at_least, at_most
from unitcad.checks.leaves import thickest_leaf
from unitcad.designs.limits import MOST_STRAIN, farthest_push, leaf_mm, leaf_strain
from unitcad.kernels.mesh import thick_parts
from unitcad.moulds.cup import SQUARE, ribs
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import printer_of

FACES = 3
"""Faces that ribs bear on, at least: fewer leave a way to slip aside."""
WIDEST_DEG = 150.0
"""Largest angle between neighbouring directions in which a cup is centred: at 180 it can slip aside between them."""
SAME_DEG = 20.0
"""Directions nearer than this are those of one face."""
FARTHEST, NEAR = 4.0, 1e-4
"""How far a play is looked for, and how finely, mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure how each cup is centred."""
    lengths = moulds.spec.moulds
    standing = ribs(moulds.frame)
    for step in moulds.plan.steps:
        where = step.lid if step.pins and step.lid else step.cup
        if where not in moulds.solids:
            continue
        cup, base = moulds.solids[where], moulds.solids[moulds.plan.base_of(step)]
        if not standing:
            pins = step.pins or moulds.plan.pins
            level = pins.seat + pins.height / 2 if pins else -(lengths.plinth_height_mm - lengths.seat_relief_mm) / 2
            on = "pins" if pins else "plinth, no ribs"
            limit = lengths.plinth_clearance_mm * SQUARE + GRID
            advice = "it slips aside by more than the clearance asked for"
            yield at_most("C220", f"{where}: play on the {on}", _play(cup, base, level), limit, "mm", advice)
            continue
        held = _patches(cup, base, (standing[0].bottom + standing[0].top) / 2)
        directions = _faces(direction for _, direction in held)
        yield at_least("C220", f"{where}: faces that ribs bear on", len(directions), FACES, "")
        gap = max((b - a for a, b in pairwise([*directions, *(d + 360 for d in directions[:1])])), default=360.0)
        advice = "the cup can slip to that side: a rib is missing or too low"
        yield at_most("C220", f"{where}: widest angle between them", gap, WIDEST_DEG, "deg", advice)
        depths = [depth for depth, _ in held] or [0.0]
        asked = lengths.rib_interference_mm
        yield at_least("C220", f"{where}: least interference of a rib", min(depths), asked - GRID, "mm")
        yield at_most("C220", f"{where}: greatest interference of a rib", max(depths), asked + GRID, "mm")
        shared = cup ^ moulds.crushing
        room = -shared.bounding_box()[5] if not shared.is_empty() else -standing[0].head
        advice = "the crushed rib lifts the cup off its seat"
        yield at_least("C220", f"{where}: from the seat down to a rib", room, -standing[0].head - GRID, "mm", advice)
        if leaf_mm(printer_of(moulds.spec)):
            yield from _bending(moulds, step.cup, max(depths), -room)


def _bending(moulds: MouldSet, cup: str, depth: float, contact: float) -> Iterator[MouldFinding]:
    """Measure how far a cup's leaves are strained, and whether they find room, if ribs bear up to z = `contact`."""
    lengths, standing = moulds.spec.moulds, ribs(moulds.frame)
    leaf = thickest_leaf(moulds.solids[cup], standing, lengths.plinth_clearance_mm)
    pushed, arm = farthest_push(depth, lengths.xy_play_mm, lengths.plinth_clearance_mm), leaf.root - contact
    strain = leaf_strain(leaf.thickness, pushed, arm) if arm > 0 else math.inf
    advice = "the leaf under a rib breaks: it is too thick, or its slot too short"
    yield at_most("C220", f"{cup}: strain at the root of a rib's leaf", 100 * strain, 100 * MOST_STRAIN, "%", advice)
    # The straight part below the contact turns with it.
    end = pushed * (1 + 1.5 * (contact - standing[0].foot) / arm) if arm > 0 else math.inf
    yield at_least("C220", f"{cup}: room behind a rib's leaf", leaf.room, end, "mm")


def _patches(cup: Manifold, base: Manifold, level: float) -> list[tuple[float, float]]:
    """Return depth (mm, square to the face) and direction (degrees, outwards) of every patch of both at a level."""
    shared, plinth = cup.slice(level) ^ base.slice(level), base.slice(level).bounds()
    middle = np.array([plinth[0] + plinth[2], plinth[1] + plinth[3]]) / 2
    found = []
    for patch in thick_parts(shared, GRID):
        depth, normal = _narrowest(patch)
        x0, y0, x1, y1 = patch.bounds()
        outwards = normal if float(normal @ (np.array([x0 + x1, y0 + y1]) / 2 - middle)) > 0 else -normal
        found.append((depth / SQUARE, math.degrees(math.atan2(outwards[1], outwards[0])) % 360))
    return found


def _narrowest(patch: CrossSection) -> tuple[float, np.ndarray]:
    """Return the least extent of a patch over its hull's sides, mm, and the direction in which it is that narrow."""
    (hull,) = patch.hull().to_polygons()
    sides = np.roll(hull, -1, axis=0) - hull
    sides = sides[np.hypot(*sides.T) > 1e-6]
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.hypot(*sides.T)[:, None]
    along = hull @ normals.T
    extents = along.max(axis=0) - along.min(axis=0)
    return float(extents.min()), normals[int(extents.argmin())]


def _faces(directions: Iterator[float]) -> list[float]:
    """Return the directions in their order, one for each face."""
    faces: list[float] = []
    for direction in sorted(directions):
        if not faces or min(direction - faces[-1], 360 + faces[0] - direction) > SAME_DEG:
            faces.append(direction)
    return faces


def _play(cup: Manifold, base: Manifold, level: float) -> float:
    """Return how far the plinth's section at a level moves along x or y before it meets the cup's, mm."""
    wall, plinth = cup.slice(level), base.slice(level)
    return max(_travel(wall, plinth, way) for way in ((1, 0), (-1, 0), (0, 1), (0, -1)))


def _travel(wall: CrossSection, plinth: CrossSection, way: tuple[int, int]) -> float:
    free, meets = 0.0, FARTHEST
    while meets - free > NEAR:
        middle = (free + meets) / 2
        shared = wall ^ plinth.translate((middle * way[0], middle * way[1]))
        free, meets = (free, middle) if thick_parts(shared, NEAR) else (middle, meets)
    return free


CHECK = MouldCheck(
    "C220",
    "centring: ribs bear on three faces with the spec's interference, clear the seat and break no leaf",
    findings,
)

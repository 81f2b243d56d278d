"""Thin walls and narrow gaps: D001 and D006.

A wall has two faces that are nearly parallel, a thickness below the floor, and reaches farther than the floor in two
directions; so bevels and wedges, tapered edges and the strips between engraved strokes are none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.components import components
from unitcad.meshcheck.findings import Finding, Location, counted, number, point
from unitcad.meshcheck.geometry.rays import SLACK, Rays, cast, lying
from unitcad.meshcheck.geometry.topology import Topology
from unitcad.meshcheck.rules.inspection import Inspection, Printer
from unitcad.meshcheck.rules.registry import Rule

D001 = Rule("""
    D001 warning: wall below the printer's floor
    A wall, measured between two faces within 12 degrees of parallel, is thinner than the printer's least wall (its
    least flat wall if the faces are level), and reaches farther than that in two directions. Bevels, tapered edges and
    the strips between engraved strokes are no walls.
    Example: A wall of 0.3 mm for a printer whose least wall is 0.8 mm.
    Fix: Thicken the wall.
""")

D006 = Rule("""
    D006 warning: gap that the printer closes
    A gap between two faces within 12 degrees of parallel is narrower than the printer's play (xy_play_mm; if the faces
    are level, than a layer, layer_mm), and reaches farther than that in two directions. Its two sides are printed as
    one.
    Example: A slot of 0.05 mm is between a lid and its frame.
    Fix: Widen the gap, or close it.
""")


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply the rules to a mesh that has an inside."""
    if not part.solid:
        return
    walls = _patches(part.topology, part.material, float(printer.least_wall_mm) * SLACK)
    if walls:
        text = f"{counted(len(walls), 'wall')} below the floor, the thinnest {number(walls[0][0], 3)} mm"
        yield D001.finding(text, len(walls), [place for _, place in walls])
    floors = float(printer.xy_play_mm), float(printer.layer_mm)
    air = cast(part.topology, floors, 0.0, part.tick, side=-1)
    gaps = _patches(part.topology, air, floors[0] * SLACK)
    if gaps:
        text = f"{counted(len(gaps), 'gap')} that the printer closes, the narrowest {number(gaps[0][0], 3)} mm"
        yield D006.finding(text, len(gaps), [place for _, place in gaps])


def _patches(topology: Topology, rays: Rays, upright: float) -> list[tuple[float, Location]]:
    """Return the least distance and its place for each wall or gap, the thinnest first.

    Thin points grouped by faces that share edges; groups that reach farther than the floor both ways are walls.

    Groups that look at each other through the material are the two sides of one wall.
    """
    thin = np.flatnonzero(rays.thickness < rays.floor)
    if not len(thin):
        return []
    points, owner, thickness = rays.points, rays.owner, rays.thickness
    faces = topology.mesh.faces
    left, right = (half // 3 for half in topology.edges.pairs)
    n = len(faces)
    marked = np.zeros(n, bool)
    marked[owner[thin]] = True
    whole = np.bincount(owner[thin], minlength=n) > 0.6 * np.maximum(np.bincount(owner, minlength=n), 1)
    level = lying(topology)
    both = marked[left] & marked[right] & (level[left] == level[right])
    patch = components(n, left[both], right[both])
    group = patch[owner[thin]]
    through = thin[marked[rays.across[thin]]]
    wall = components(n, patch[owner[through]], patch[rays.across[through]])
    thinnest: dict[int, tuple[float, Location]] = {}
    sides: dict[int, list[Ints]] = {}
    for label in np.unique(group):
        mine = thin[group == label]
        of = owner[mine]
        cloud = np.concatenate([points[mine], topology.mesh.vertices[faces[of[whole[of]]]].reshape(-1, 3)])
        if _reach(cloud, bool(level[of[0]])) < upright:
            continue
        worst = mine[np.argmin(thickness[mine])]
        here = (float(thickness[worst]), Location(face=int(topology.kept[owner[worst]]), xyz=point(points[worst])))
        one = int(wall[label])
        thinnest[one] = min(here, thinnest.get(one, here), key=lambda item: item[0])
        sides.setdefault(one, []).append(of)
    found = [
        (least, replace(place, region=topology.kept[np.unique(np.concatenate(sides[one]))]))
        for one, (least, place) in thinnest.items()
    ]
    return sorted(found, key=lambda item: item[0])


def _reach(cloud: Floats, lying: bool) -> float:
    """Measure how far a thin patch reaches across its longest direction, mm: its height, or lesser extent in plan."""
    if not lying:
        return float(np.ptp(cloud[:, 2]))
    plan = cloud[:, :2] - cloud[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(plan, full_matrices=False)
    return float(np.ptp(plan @ axes.T, axis=0).min())

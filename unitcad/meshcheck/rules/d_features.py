"""Small features, D002: parts of a solid that are narrower than the printer's least feature in both directions across.

Two searches. Level sections half-way between the heights at which the mesh has vertices find upright features: pins,
tips. Features that lie or point sideways have faces with material less than the floor behind them all over; a section
across such faces shows whether it is a whisker, or a rib or a wall, which goes on into the body.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick
from unitcad.geometry.components import components
from unitcad.meshcheck.findings import Finding, Location, counted, number
from unitcad.meshcheck.geometry.mesh import solid_of
from unitcad.meshcheck.geometry.rays import Rays
from unitcad.meshcheck.geometry.topology import Topology
from unitcad.meshcheck.rules.inspection import Inspection, Printer, at_region
from unitcad.meshcheck.rules.registry import Rule

D002 = Rule("""
    D002 warning: feature below the printer's floor
    A pin, a tip or a whisker, standing, lying or sticking out, is narrower than the printer's least feature in both
    directions across: it will not be printed. Ribs that are joined to the body along their length are none.
    Example: A pin of 0.2 mm in diameter.
    Fix: Make it larger, or leave it out.
""")

_LEVELS = 40
_GROUPS = 40  # thin places looked at
_FACES = 5  # sections tried a place
_STANDS = 0.9  # directions nearer to the vertical than this cosine are left to the level sections
_LEAST_MM2 = 1e-4
_SLACK = 0.999


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply D002 to a mesh that has an inside."""
    if not part.solid:
        return
    mesh, least = part.topology.mesh, float(printer.least_feature_mm)
    solid = solid_of(mesh.vertices, mesh.faces)
    if solid.is_empty():
        return
    places = _standing(part.topology, solid, least, float(printer.layer_mm))
    part.tick()
    places += _lying(part.topology, solid, part.material, least, part.tick)
    if places:
        text = f"{counted(len(places), 'section')} smaller than {number(least)} mm both ways"
        yield D002.finding(text, len(places), places)


def _standing(topology: Topology, solid: Manifold, least: float, layer: float) -> list[Location]:
    """Return islands of level sections."""
    mesh = topology.mesh
    heights = np.unique(np.round(mesh.vertices[np.unique(mesh.faces), 2], 3))
    gaps = np.flatnonzero(np.diff(heights) >= layer * 0.99)
    if len(gaps) > _LEVELS:
        gaps = gaps[np.linspace(0, len(gaps) - 1, _LEVELS).astype(int)]
    places = []
    for gap in gaps:
        z = float(heights[gap] + heights[gap + 1]) / 2
        for island in solid.slice(z).decompose():
            if _narrow(island, least):
                x0, y0, x1, y1 = island.bounds()
                places.append(Location(xyz=((x0 + x1) / 2, (y0 + y1) / 2, z)))
    return places


def _lying(topology: Topology, solid: Manifold, rays: Rays, least: float, tick: Tick) -> list[Location]:
    """Return one place for each connected patch of thin faces that a section across shows to be a whisker."""
    faces, vertices, edges = topology.mesh.faces, topology.mesh.vertices, topology.edges
    n = len(faces)
    thick = np.bincount(rays.owner[rays.behind >= least * _SLACK], minlength=n)
    thin = (np.bincount(rays.owner, minlength=n) > 0) & (thick == 0)
    if not thin.any():
        return []
    left, right = (half // 3 for half in edges.pairs)
    both = thin[left] & thin[right]
    group = components(n, left[both], right[both])
    places: list[Location] = []
    labels, first = np.unique(group[thin], return_index=True)
    for label in labels[np.argsort(first)][:_GROUPS]:
        tick()
        mine = np.flatnonzero(thin & (group == label))
        place = _whisker(vertices, faces[mine], solid, least)
        if place is not None:
            places.append(at_region(topology.kept[mine], place))
    return places


def _whisker(vertices: Floats, faces: Ints, solid: Manifold, least: float) -> Floats | None:
    """Return the middle of a face of the patch at which the solid, cut across its length, is narrow both ways."""
    corners = vertices[faces]
    sides = corners[:, [1, 2, 0]] - corners
    lengths = np.sqrt(np.einsum("fkx,fkx->fk", sides, sides))
    longest_first = np.argsort(-lengths.max(axis=1), kind="stable")
    for i in longest_first[np.unique(np.linspace(0, len(faces) - 1, _FACES).astype(int))]:
        middle = corners[i].mean(axis=0)
        for k in np.argsort(-lengths[i], kind="stable"):
            along = sides[i, k] / lengths[i, k]
            if abs(along[2]) > _STANDS or np.ptp(corners @ along) < least:
                continue
            x = np.cross(np.eye(3)[np.argmin(np.abs(along))], along)
            x /= np.linalg.norm(x)
            frame = np.stack([x, np.cross(along, x), along])  # turns `along` to z
            turned = solid.transform(np.column_stack([frame, np.zeros(3)]))
            if all(_narrow_at(turned, frame @ middle, shift, least) for shift in (0, -0.75 * least, 0.75 * least)):
                return middle
    return None


def _narrow_at(turned: Manifold, point: Floats, shift: float, least: float) -> bool:
    """Return whether the level section `shift` above the point has a narrow island there.

    A corner that is cut off askew is narrow too, but not so a little farther in.
    """
    x, y, z = point
    room = 1e-3 + abs(shift) / 2  # a whisker may bend
    for island in turned.slice(float(z + shift)).decompose():
        x0, y0, x1, y1 = island.bounds()
        if x0 - room <= x <= x1 + room and y0 - room <= y <= y1 + room and _narrow(island, least):
            return True
    return False


def _narrow(island: CrossSection, least: float) -> bool:
    """Return whether a box at some angle about the island has both sides below `least`."""
    x0, y0, x1, y1 = island.bounds()
    if max(x1 - x0, y1 - y0) >= 1.5 * least or island.area() <= _LEAST_MM2:
        return False
    points = np.concatenate(island.to_polygons())
    angle = np.radians(np.arange(0, 90, 5))
    across = np.stack([np.cos(angle), np.sin(angle)])
    width = np.ptp(points @ across, axis=0)
    depth = np.ptp(points @ np.stack([-across[1], across[0]]), axis=0)
    return bool((np.maximum(width, depth) < least * _SLACK).any())

"""Fit and printability for a printer: S002 and D001 to D005. The mesh stands as it will be printed, z up.

These rules look for what a printer cannot make, not for what is unusual: a wedge is no thin wall, the strip between two
engraved strokes is no wall since it is lower than it is thick, a ceiling with support at both ends is a bridge.
"""

from __future__ import annotations

import numpy as np

from unitcad.catalogue import Printer
from unitcad.check import overhang, walls
from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import Deadline
from unitcad.check.mesh import Floats, extent
from unitcad.check.rulebook import finding
from unitcad.check.shells import measures, winding_number
from unitcad.check.topology import Topology

ON_BED = 0.02  # mm; an STL rounds to less, a layer is ten times more
STAND = 1.0  # mm2 of flat that a part needs to stand on
_LEVELS = 40


def judge(topology: Topology, printer: Printer, deadline: Deadline) -> list[Finding]:
    """Apply the rules; those that need an inside are left out for a mesh that is not closed."""
    mesh = topology.mesh
    if not len(mesh.faces):
        return []
    low, high = extent(mesh.vertices[np.unique(mesh.faces)])
    found = _fits(high - low, printer) + _stands(topology, low)
    if topology.watertight and topology.oriented:
        found += walls.judge(topology, printer, deadline)
        found += _features(topology, printer)
        found += overhang.judge(topology, printer, deadline, float(low[2]))
        found += _trapped(topology)
    return found


def _fits(size: Floats, printer: Printer) -> list[Finding]:
    x, y, z = float(printer.bed_x_mm), float(printer.bed_y_mm), float(printer.bed_z_mm)
    upright = size[2] <= z
    if upright and ((size[0] <= x and size[1] <= y) or (size[0] <= y and size[1] <= x)):
        return []
    shown = " x ".join(f"{side:.4g}" for side in size)
    return [finding("S002", f"{shown} mm does not fit {printer.name}: {x:g} x {y:g} x {z:g}")]


def _stands(topology: Topology, low: Floats) -> list[Finding]:
    """D005: lowest point at z = 0, and a flat there that faces down."""
    vertices, faces = topology.mesh.vertices, topology.mesh.faces
    if abs(low[2]) > ON_BED:
        return [finding("D005", f"lowest point at z = {low[2]:.4g} mm")]
    lying = (vertices[faces, 2] < low[2] + ON_BED).all(axis=1) & (topology.areas[:, 2] < 0)
    flat = float(np.abs(topology.areas[lying, 2]).sum()) / 2
    if flat >= STAND:
        return []
    return [finding("D005", f"only {flat:.3g} mm2 of flat on the bed")]


def _features(topology: Topology, printer: Printer) -> list[Finding]:
    """D002: islands of level sections, half-way between the heights at which the mesh has vertices."""
    from manifold3d import Manifold, Mesh64

    mesh, least = topology.mesh, float(printer.least_feature_mm)
    solid = Manifold(Mesh64(vert_properties=mesh.vertices, tri_verts=mesh.faces.astype(np.uint64)))
    if solid.is_empty():
        return []
    heights = np.unique(np.round(mesh.vertices[np.unique(mesh.faces), 2], 3))
    gaps = np.flatnonzero(np.diff(heights) >= float(printer.layer_mm) * 0.99)
    if len(gaps) > _LEVELS:
        gaps = gaps[np.linspace(0, len(gaps) - 1, _LEVELS).astype(int)]
    places = []
    for gap in gaps:
        z = float(heights[gap] + heights[gap + 1]) / 2
        for island in solid.slice(z).decompose():
            x0, y0, x1, y1 = island.bounds()
            if max(x1 - x0, y1 - y0) < least * 0.999 and island.area() > 1e-4:
                places.append(Location(xyz=((x0 + x1) / 2, (y0 + y1) / 2, z)))
    if not places:
        return []
    return [
        finding("D002", f"{counted(len(places), 'section')} smaller than {least:g} mm both ways", len(places), places)
    ]


def _trapped(topology: Topology) -> list[Finding]:
    """D004: shells that face inwards inside another one."""
    if topology.n_shells < 2:
        return []
    volumes, low, high = measures(topology)
    faces, vertices = topology.mesh.faces, topology.mesh.vertices
    places = []
    for i in np.flatnonzero(volumes < 0)[:50]:
        own = topology.shells == i
        point = vertices[faces[np.argmax(own), 0]]
        if winding_number(vertices, faces[~own], point) > 0:
            centre = (low[i] + high[i]) / 2
            places.append(Location(xyz=tuple(float(v) for v in centre)))  # type: ignore[arg-type]
    if not places:
        return []
    return [finding("D004", f"{counted(len(places), 'hollow')} without an opening", len(places), places)]

"""Fit and printability for a printer: S002 and D001 to D006. The mesh stands as it will be printed, z up.

These rules look for what a printer cannot make, not for what is unusual: a wedge is no thin wall, the strip between two
engraved strokes is no wall since it is lower than it is thick, a ceiling with support at both ends is a bridge.
"""

from __future__ import annotations

import numpy as np

from unitcad.catalogue import Printer
from unitcad.check import features, overhang, walls
from unitcad.check.findings import Finding, Location, counted, number
from unitcad.check.limits import Deadline, keeping
from unitcad.check.mesh import extent
from unitcad.check.rulebook import finding
from unitcad.check.shells import winding_number
from unitcad.check.topology import Topology
from unitcad.geometry.arrays import Floats

ON_BED = 0.02  # mm; an STL rounds to less, a layer is ten times more
STAND = 1.0  # mm2 of flat that a part needs to stand on


def judge(topology: Topology, printer: Printer, deadline: Deadline) -> list[Finding]:
    """Apply the rules; those that need an inside are left out for a mesh that is not closed."""
    mesh = topology.mesh
    if not len(mesh.faces):
        return []
    low, high = extent(mesh.vertices[np.unique(mesh.faces)])
    found = _fits(high - low, printer) + _stands(topology, low)
    if topology.watertight and topology.oriented:
        with keeping(found):
            rays = walls.cast(topology, printer, deadline)
            found += walls.judge(topology, printer, rays)
            found += walls.gaps(topology, printer, deadline)
            found += features.judge(topology, printer, rays, deadline)
            found += overhang.judge(topology, printer, deadline, float(low[2]))
            found += _trapped(topology)
    return found


def _fits(size: Floats, printer: Printer) -> list[Finding]:
    x, y, z = float(printer.bed_x_mm), float(printer.bed_y_mm), float(printer.bed_z_mm)
    upright = size[2] <= z
    if upright and ((size[0] <= x and size[1] <= y) or (size[0] <= y and size[1] <= x)):
        return []
    shown = " x ".join(number(side, 4) for side in size)
    return [finding("S002", f"{shown} mm does not fit {printer.name}: {number(x)} x {number(y)} x {number(z)}")]


def _stands(topology: Topology, low: Floats) -> list[Finding]:
    """D005: lowest point at z = 0, and a flat there that faces down."""
    vertices, faces = topology.mesh.vertices, topology.mesh.faces
    if abs(low[2]) > ON_BED:
        return [finding("D005", f"lowest point at z = {number(low[2], 4)} mm")]
    lying = (vertices[faces, 2] < low[2] + ON_BED).all(axis=1) & (topology.areas[:, 2] < 0)
    flat = float(np.abs(topology.areas[lying, 2]).sum()) / 2
    if flat >= STAND:
        return []
    return [finding("D005", f"only {number(flat, 3)} mm2 of flat on the bed")]


def _trapped(topology: Topology) -> list[Finding]:
    """D004: shells that face inwards inside another one."""
    if topology.n_shells < 2:
        return []
    volumes, low, high = topology.volumes, topology.low, topology.high
    faces, vertices = topology.mesh.faces, topology.mesh.vertices
    places = []
    for i in np.flatnonzero(volumes < 0)[:50]:
        own = topology.shells == i
        point = vertices[faces[np.argmax(own), 0]]
        if winding_number(vertices, faces[~own], point) > 0:
            centre = (low[i] + high[i]) / 2
            region = topology.kept[own]
            xyz = (float(centre[0]), float(centre[1]), float(centre[2]))
            places.append(Location(face=int(region[0]), xyz=xyz, region=region))
    if not places:
        return []
    return [finding("D004", f"{counted(len(places), 'hollow')} without an opening", len(places), places)]

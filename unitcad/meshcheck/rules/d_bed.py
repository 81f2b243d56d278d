"""What stands on the bed: D004 and D005. A mesh stands as it will be printed, z up.

The rules for a printer look for what it cannot make, not for what is unusual: a wedge is no thin wall, a ceiling with
support at both ends is a bridge.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.meshcheck.findings import Finding, counted, number
from unitcad.meshcheck.geometry.rays import winding_number
from unitcad.meshcheck.geometry.topology import Topology
from unitcad.meshcheck.rules.inspection import Inspection, Printer, at_region
from unitcad.meshcheck.rules.registry import Rule

D004 = Rule("""
    D004 warning: trapped volume
    A hollow has no opening, so that support, resin or powder cannot leave it.
    Example: A hollow ball has no drain.
    Fix: Open it, or fill it.
""")

D005 = Rule("""
    D005 warning: not on the bed
    The lowest point floats above z = 0, reaches below it, or no flat of the part lies there to stand on; the message
    says which.
    Example: The underside of a part lies at z = 5 mm.
    Fix: Place the part with a flat on z = 0.
""")

ON_BED = 0.02  # mm; an STL rounds to less, a layer is ten times more
STAND = 1.0  # mm2 of flat that a part needs to stand on


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply the rules; D004 needs a mesh that has an inside."""
    yield from _stands(part.topology)
    if part.solid:
        yield from _trapped(part.topology)


def _stands(topology: Topology) -> Iterator[Finding]:
    """Apply D005: lowest point at z = 0, and a flat there that faces down."""
    vertices, faces = topology.mesh.vertices, topology.mesh.faces
    low = float(vertices[np.unique(faces), 2].min())
    if abs(low) > ON_BED:
        what = "floats above the bed, which a slicer corrects" if low > 0 else "reaches below the bed"
        yield D005.finding(f"{what}: lowest point at z = {number(low, 4)} mm")
        return
    lying = (vertices[faces, 2] < low + ON_BED).all(axis=1) & (topology.areas[:, 2] < 0)
    flat = float(np.abs(topology.areas[lying, 2]).sum()) / 2
    if flat < STAND:
        yield D005.finding(f"only {number(flat, 3)} mm2 of flat on the bed")


def _trapped(topology: Topology) -> Iterator[Finding]:
    """Apply D004: shells that face inwards inside another one."""
    if topology.n_shells < 2:
        return
    volumes, low, high = topology.volumes, topology.low, topology.high
    faces, vertices = topology.mesh.faces, topology.mesh.vertices
    places = []
    for i in np.flatnonzero(volumes < 0)[:50]:
        own = topology.shells == i
        if winding_number(vertices, faces[~own], vertices[faces[np.argmax(own), 0]]) > 0:
            places.append(at_region(topology.kept[own], (low[i] + high[i]) / 2))
    if places:
        yield D004.finding(f"{counted(len(places), 'hollow')} without an opening", len(places), places)

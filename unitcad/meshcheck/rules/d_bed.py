"""The rules of the bed, D004 and D005. A mesh has its printing position, z up.

The rules for a printer look for what it cannot make, not for what is unusual: a wedge is no thin wall, a ceiling with
support at both ends is a bridge.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.meshcheck.findings import Finding, counted, number
from unitcad.meshcheck.geometry.rays import winding_numbers
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
    A part rests on an edge or a point, or reaches below z = 0. A part above z = 0 is none: slicers drop it to the bed.
    Example: A sphere rests on a point.
    Fix: Turn the part so that a flat lies down, or cut one.
""")

ON_BED = 0.02  # mm; an STL rounds to less, a layer is ten times more
STAND = 1.0  # mm2 of flat that a part needs to stand on


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply the rules; D004 needs a mesh that has an inside."""
    yield from _stands(part.topology)
    if part.solid:
        yield from _trapped(part)


def _stands(topology: Topology) -> Iterator[Finding]:
    """Apply D005 to the shells that reach the lowest point of the mesh."""
    if not topology.n_shells:
        return
    vertices, faces, bottoms = topology.mesh.vertices, topology.mesh.faces, topology.low[:, 2]
    low = float(bottoms.min())
    if low < -ON_BED:
        yield D005.finding(f"reaches below the bed: lowest point at z = {number(low, 4)} mm")
        return
    lying = (vertices[faces, 2] < low + ON_BED).all(axis=1) & (topology.areas[:, 2] < 0)
    flat = np.bincount(topology.shells[lying], -topology.areas[lying, 2] / 2, topology.n_shells)
    places, least = [], STAND
    for i in np.flatnonzero((bottoms < low + ON_BED) & (flat < STAND)).tolist():
        own = np.flatnonzero(topology.shells == i)
        lowest = vertices[faces[own]].reshape(-1, 3)
        places.append(at_region(topology.kept[own], lowest[np.argmin(lowest[:, 2])]))
        least = min(least, float(flat[i]))
    if places:
        message = f"{counted(len(places), 'part')} on an edge or a point: {number(least, 3)} mm2 of flat on the bed"
        yield D005.finding(message, len(places), places)


def _trapped(part: Inspection) -> Iterator[Finding]:
    """Apply D004: shells that face inwards inside another one."""
    topology = part.topology
    volumes, low, high = topology.volumes, topology.low, topology.high
    faces, vertices = topology.mesh.faces, topology.mesh.vertices
    places = []
    for i in np.flatnonzero(volumes < 0)[:50]:
        own = topology.shells == i
        others, at = faces[~own], vertices[faces[np.argmax(own)][:1]]
        if winding_numbers(vertices, others, np.array([0]), np.array([len(others)]), at, part.tick)[0] > 0:
            places.append(at_region(topology.kept[own], (low[i] + high[i]) / 2))
    if places:
        yield D004.finding(f"{counted(len(places), 'hollow')} without an opening", len(places), places)

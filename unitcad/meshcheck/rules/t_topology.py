"""Topology rules, T001 to T013: edges, winding, pinches, duplicates, degenerate faces, stored normals."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, counted, point
from unitcad.meshcheck.geometry.mesh import Mesh, float32_step, float32_steps
from unitcad.meshcheck.geometry.predicates import without_area
from unitcad.meshcheck.geometry.topology import Topology, diagonals, max_side_squared
from unitcad.meshcheck.rules.inspection import Inspection, at_edges, at_faces
from unitcad.meshcheck.rules.registry import Rule

T001 = Rule("""
    T001 error: boundary edge
    An edge has one face only: the surface has a hole, so inside and outside are undefined.
    Example: A box without its lid has four.
    Fix: Close the hole in the CAD model; a slicer's repair guesses.
""")

T002 = Rule("""
    T002 error: edge with more than two faces, an odd number
    Three or five faces meet at an edge: a loose face hangs on the surface.
    Example: A triangle stands on an edge of a box: three faces meet there.
    Fix: Remove the inner or hanging face.
""")

T003 = Rule("""
    T003 warning: edge with more than two faces, an even number
    Two shells meet along an edge. Slicers pair the faces in different ways; shells are counted here with the solid
    between the faces of a pair. An error in a 3MF with --3mf-strict, since the core specification (4.1) forbids it.
    Example: Two boxes share one edge: four faces meet there.
    Fix: Move the shells apart, or unite them with some overlap.
""")

T004 = Rule("""
    T004 warning: pinch vertex
    Two fans of faces share one vertex only: the solid has no thickness there.
    Example: Two boxes share one corner.
    Fix: Move the parts apart, or unite them with some overlap.
""")

T005 = Rule("""
    T005 error: T-junction
    A vertex lies on an open edge of a face that does not use it: the crack has no width, but it is one.
    Example: The upper side of a wall is one edge, and the face above has a vertex in the middle of it.
    Fix: Weld after meshing, or mesh all faces together.
""")

T006 = Rule("""
    T006 warning: closed only after welding
    Edges match only once vertices are joined that are listed apart. Two are joined if they are in one place, or nearer
    than 1e-5 of their own shell's diagonal (or two float32 steps there) and than a tenth of the shortest edge at
    either. So a gap wider than that stays a boundary (T001), no face collapses, and other shells of the file have no
    influence. Crossings, stored normals and slivers are checked on the faces as stored. An error in a 3MF with
    --3mf-strict, since the core specification (4.1) asks for common vertices.
    Example: Two halves of a ball were exported apart, and their rims differ by 0.000001 mm.
    Fix: Weld vertices at export.
""")

T007 = Rule("""
    T007 error: inconsistent winding
    Two neighbours run along their common edge in the same direction, so one of them faces inwards.
    Example: One face of a box is flipped.
    Fix: Recalculate normals outside.
""")

T009 = Rule("""
    T009 error: duplicate face
    Two faces with an area have the same three vertices. If two closed shells are side by side there, they touch instead
    (G003, T003).
    Example: The lid of a box is in the file twice.
    Fix: Remove one, or both if they face each other.
""")

T010 = Rule("""
    T010 warning: degenerate face
    A face uses a vertex twice, or its three vertices lie on one line exactly. Repair programs drop it, and open the
    mesh.
    Example: A face has the corners (0, 0, 0), (1, 0, 0) and (2, 0, 0).
    Fix: Weld and collapse short edges at export.
""")

T011 = Rule("""
    T011 warning: sliver
    A face is longer than a thousandth of its shell's diagonal but lower than the grid of float32 numbers there: its
    direction is rounding noise, and welding turns it over.
    Example: A face is 10 mm long and 0.0000001 mm high.
    Fix: Mesh with a minimum edge length, or collapse short edges.
""")

T012 = Rule("""
    T012 info: unreferenced vertex
    A vertex is listed and no face uses it.
    Example: An OBJ lists nine vertices, and its faces use eight.
    Fix: Nothing; it costs space only.
""")

T013 = Rule("""
    T013 warning: stored normals disagree
    A facet's stored normal differs from the one of its vertices by more than 15 degrees, or is not a number. Programs
    that trust it shade or orient the part wrongly.
    Example: A level facet has the stored normal (1, 0, 0).
    Fix: Write normals from the vertices, or zeros.
""")

SLIVER = 1e-3  # T011: shortest length of a sliver, as part of the diagonal
NORMAL_COS = float(np.cos(np.radians(15.0)))  # T013


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the topology rules but for T008, which needs to know which shell is inside which."""
    topology = part.topology
    mesh, edges, kept = topology.mesh, topology.edges, topology.kept
    if topology.unused:
        yield unreferenced(topology.unused)
    yield from _open_edges(topology)
    if part.mesh.normals is not None:
        yield from _stored_normals(part.mesh, part.mesh.normals, kept, topology.stored_areas)
    yield from _many_faces(topology)
    yield from _thin(topology)
    if n := len(topology.pinched):
        text = counted(n, "pinch vertex", "pinch vertices")
        yield T004.finding(text, n, (Location(xyz=point(xyz)) for xyz in mesh.vertices[topology.pinched]))
    twice = topology.twice[~without_area(mesh.vertices[mesh.faces[topology.twice]])]  # the others are T010
    if n := len(twice):
        yield T009.finding(counted(n, "duplicate face"), n, at_faces(mesh.vertices, mesh.faces, kept, twice))
    if n := len(topology.unbalanced):
        text = f"{counted(n, 'edge')} along which more faces run one way than the other"
        yield T007.finding(text, n, at_edges(mesh.vertices, edges, kept, topology.unbalanced))


def unreferenced(n: int) -> Finding:
    """Make the finding T012 about n vertices, for a reader too, which leaves them out."""
    return T012.finding(f"{counted(n, 'vertex', 'vertices')} that no face uses", n)


def _open_edges(topology: Topology) -> Iterator[Finding]:
    """Report open edges: closed by welding (T006), or T-junctions (T005) and boundaries (T001)."""
    opened, mesh = topology.opened, topology.mesh
    if opened is None:
        return
    if n := len(opened.shut):
        text = f"{counted(n, 'open edge')} that welding within the tolerance closes"
        yield T006.finding(text, n, at_edges(mesh.vertices, opened.edges, opened.kept, opened.shut))
    if len(split := opened.left[opened.split]):
        places = at_edges(mesh.vertices, topology.edges, topology.kept, split)
        yield T005.finding(f"{counted(len(split), 'open edge')} with a vertex in between", len(split), places)
    if n := len(opened.left):
        places = at_edges(mesh.vertices, topology.edges, topology.kept, opened.left)
        yield T001.finding(counted(n, "boundary edge"), n, places)


def _many_faces(topology: Topology) -> Iterator[Finding]:
    edges = topology.edges
    for rule, odd, word in ((T002, 1, "odd"), (T003, 0, "even")):
        which = np.flatnonzero((edges.size > 2) & (edges.size % 2 == odd))
        if len(which):
            text = f"{counted(len(which), 'edge')} with more than two faces, an {word} number"
            yield rule.finding(text, len(which), at_edges(topology.mesh.vertices, edges, topology.kept, which))


def _thin(topology: Topology) -> Iterator[Finding]:
    """Report degenerate faces (T010) and slivers (T011), on the faces as stored.

    A sliver harms if it is long: its height is below the float32 step, so only rounding decides its direction, and it
    is longer than SLIVER of its shell. Short ones vanish in a slicer's own resolution.
    """
    mesh, faces, kept, areas = topology.mesh, topology.stored, topology.kept, topology.stored_areas
    vertices, repeated = mesh.vertices, topology.repeated
    size = diagonals(topology.low, topology.high)[topology.shells]
    double = np.abs(areas[:, 0]) + np.abs(areas[:, 1]) + np.abs(areas[:, 2])
    whole, step = float(size.max(initial=0)), float32_step(vertices)
    suspect = np.flatnonzero(double < 8 * max(step, 1e-7 * whole) * whole)
    corners = vertices[faces[suspect]]
    longest = np.sqrt(max_side_squared(corners))
    flat = without_area(corners)
    lines = suspect[flat]
    n = len(repeated) + len(lines)
    if n:
        places = (Location(face=int(i)) for i in repeated)
        text = f"{counted(n, 'face')} without area"
        yield T010.finding(text, n, chain(places, at_faces(vertices, faces, kept, lines)))
    height = np.sqrt(np.einsum("ij,ij->i", areas[suspect], areas[suspect])) / np.maximum(longest, 1e-300)
    thin = suspect[~flat & (height < float32_steps(corners)) & (longest > SLIVER * size[suspect])]
    if len(thin):
        yield T011.finding(counted(len(thin), "sliver"), len(thin), at_faces(vertices, faces, kept, thin))


def _stored_normals(mesh: Mesh, normals: Floats, kept: Ints, areas: Floats) -> Iterator[Finding]:
    """Apply T013.

    A stored normal of zeros is none, and a face lower than a thousandth of its length has no direction.
    """
    stored = normals[kept]
    lengths = np.sqrt(np.einsum("ij,ij->i", stored, stored, dtype=np.float64))
    dot = np.einsum("ij,ij->i", stored, areas)
    real = np.sqrt(np.einsum("ij,ij->i", areas, areas))
    off = np.flatnonzero(~(dot >= NORMAL_COS * lengths * real * (1 - 1e-6)))
    if not len(off):
        return
    corners = mesh.vertices[mesh.faces[kept[off]]]
    sound = real[off] > 1e-3 * max_side_squared(corners)
    wrong = off[(sound & (lengths[off] > 0)) | ~np.isfinite(lengths[off])]
    if len(wrong):
        text = f"{counted(len(wrong), 'stored normal')} unlike the face's own"
        yield T013.finding(text, len(wrong), (Location(face=int(kept[i])) for i in wrong))

"""Topology rules, T001 to T013: edges, winding, pinches, duplicates, degenerate faces, stored normals."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, number, point, tally
from unitcad.meshcheck.geometry.mesh import Mesh, float32_step, float32_steps
from unitcad.meshcheck.geometry.predicates import without_area
from unitcad.meshcheck.geometry.resolution import STEPS
from unitcad.meshcheck.geometry.topology import Topology, diagonals, max_side_squared, small_patches
from unitcad.meshcheck.rules.inspection import Inspection, at_edges, at_faces
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.severity import by_width

T001 = Rule("""
    T001 error: boundary edge
    An edge has one face only: the surface has a hole, so inside and outside are undefined. A crack of 0.02 mm or less
    is T005. A warning for patches that no printer shows: shorter than 0.2 mm, or narrower than 0.02 mm.
    Example: A box without its lid has four.
    Fix: Close the hole in the CAD model; a slicer's repair guesses.
""")

T002 = Rule("""
    T002 error: edge with more than two faces, an odd number
    Three or five faces meet at an edge: a loose face hangs on the surface. A warning if the patch is one of T001.
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
    T005 warning: crack
    Open edges lie along each other within 0.02 mm, and their vertices do not match, as at a T-junction: a vertex lies
    on an edge of a face that does not use it. Slicers close such a crack; the message gives its width.
    Example: The upper side of a wall is one edge, and the face above has a vertex in the middle of it.
    Fix: Weld after meshing, or mesh all faces together.
""")

T006 = Rule("""
    T006 warning: closed only after welding
    Edges match only once vertices are joined that are listed apart. Two are joined if they are in one place, or nearer
    than 0.02 mm (or two float32 steps there) and than a tenth of the shortest edge at either, so no face collapses. The
    message gives the largest distance; up to four float32 steps it is information. Crossings, stored normals and
    slivers are checked on the faces as stored. An error in a 3MF with --3mf-strict, since the core specification (4.1)
    asks for common vertices.
    Example: Two halves of a ball were exported apart, and their rims differ by 0.001 mm.
    Fix: Weld vertices at export.
""")

T007 = Rule("""
    T007 error: inconsistent winding
    Two neighbours run along their common edge in the same direction, so one of them faces inwards. A warning if they
    belong to a patch that no printer shows, as in T001.
    Example: One face of a box is flipped.
    Fix: Recalculate normals outside.
""")

T009 = Rule("""
    T009 error: duplicate face
    Two faces with an area have the same three vertices. If two closed shells are side by side there, they touch instead
    (G003, T003). A warning, unless --strict is given, if no circle of 0.2 mm fits into them, or if material lies on
    both sides.
    Example: The lid of a box is in the file twice.
    Fix: Remove one, or both if they face each other.
""")

T010 = Rule("""
    T010 info: degenerate face
    A face uses a vertex twice, or its three vertices lie on one line exactly. No layer shows it. Repair programs drop
    it, and open the mesh.
    Example: A face has the corners (0, 0, 0), (1, 0, 0) and (2, 0, 0).
    Fix: Weld and collapse short edges at export.
""")

T011 = Rule("""
    T011 info: sliver
    A face is longer than a thousandth of its shell's diagonal but lower than the grid of float32 numbers there: its
    direction is rounding noise, and welding turns it over. No layer shows it.
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
    that trust it shade or orient the part wrongly. Information if all such facets are lower than 0.2 mm, the least
    feature of the finest printer in the catalogue.
    Example: A level facet has the stored normal (1, 0, 0).
    Fix: Write normals from the vertices, or zeros.
""")

SLIVER = 1e-3  # T011: shortest length of a sliver, as part of the diagonal
NORMAL_COS = float(np.cos(np.radians(15.0)))  # T013


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the topology rules but for T008, which needs to know which shell is inside which."""
    topology = part.topology
    mesh, kept = topology.mesh, topology.kept
    if topology.unused:
        yield unreferenced(topology.unused)
    yield from _open_edges(topology)
    if part.mesh.normals is not None:
        limit = topology.resolution.feature
        yield from _stored_normals(part.mesh, part.mesh.normals, kept, topology.stored_areas, limit)
    yield from _many_faces(topology)
    yield from _thin(topology)
    if n := len(topology.pinched):
        text = tally(n, "pinch vertex", "pinch vertices")
        yield T004.finding(text, n, (Location(xyz=point(xyz)) for xyz in mesh.vertices[topology.pinched]))
    twice = topology.twice[~without_area(mesh.vertices[mesh.faces[topology.twice]])]  # the others are T010
    n = len(twice)
    yield from by_width(
        part, T009, tally(n, "duplicate face"), n, at_faces(mesh.vertices, mesh.faces, kept, twice), "warning"
    )
    more = " along which more faces run one way than the other"
    yield from _with_flaps(topology, T007, "edge", topology.unbalanced, more)


def unreferenced(n: int) -> Finding:
    """Make the finding T012 about n vertices, for a reader too, which leaves them out."""
    return T012.finding(f"{tally(n, 'vertex', 'vertices')} that no face uses", n)


def _open_edges(topology: Topology) -> Iterator[Finding]:
    """Report open edges: closed by welding (T006), cracks (T005), borders of flaps and holes (T001)."""
    opened, mesh = topology.opened, topology.mesh
    if opened is None:
        return
    if n := len(opened.shut):
        text = f"{tally(n, 'open edge')} that welding closes, {number(opened.gap, 2)} mm apart at most"
        places = at_edges(mesh.vertices, opened.edges, opened.kept, opened.shut)
        yield T006.finding(text, n, places, None if opened.gap > STEPS * float32_step(mesh.vertices) else "info")
    if len(crack := opened.left[opened.crack]):
        places = at_edges(mesh.vertices, topology.edges, topology.kept, crack)
        text = f"{tally(len(crack), 'open edge')} of a crack {number(opened.wide, 2)} mm wide at most; slicers close it"
        yield T005.finding(text, len(crack), places)
    left = opened.left[~opened.crack]
    yield from _with_flaps(topology, T001, "boundary edge", left)


def _with_flaps(topology: Topology, rule: Rule, noun: str, which: Ints, more: str = "") -> Iterator[Finding]:
    """Report some edges, as a warning those of patches that no printer shows."""
    if not len(which):
        return
    small = small_patches(topology, which)
    for some, severity, whose in ((~small, None, ""), (small, "warning", " of patches that no printer shows")):
        if n := int(some.sum()):
            places = at_edges(topology.mesh.vertices, topology.edges, topology.kept, which[some])
            yield rule.finding(f"{tally(n, noun)}{more}{whose}", n, places, severity)


def _many_faces(topology: Topology) -> Iterator[Finding]:
    size = topology.edges.size
    odd, even = (np.flatnonzero((size > 2) & (size % 2 == rest)) for rest in (1, 0))
    yield from _with_flaps(topology, T002, "edge", odd, " with more than two faces, an odd number")
    if n := len(even):
        places = at_edges(topology.mesh.vertices, topology.edges, topology.kept, even)
        yield T003.finding(f"{tally(n, 'edge')} with more than two faces, an even number", n, places)


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
        text = f"{tally(n, 'face')} without area"
        yield T010.finding(text, n, chain(places, at_faces(vertices, faces, kept, lines)))
    height = np.sqrt(np.einsum("ij,ij->i", areas[suspect], areas[suspect])) / np.maximum(longest, 1e-300)
    thin = suspect[~flat & (height < float32_steps(corners)) & (longest > SLIVER * size[suspect])]
    if len(thin):
        yield T011.finding(tally(len(thin), "sliver"), len(thin), at_faces(vertices, faces, kept, thin))


def _stored_normals(mesh: Mesh, normals: Floats, kept: Ints, areas: Floats, feature: float) -> Iterator[Finding]:
    """Apply T013; a face that is lower than a `feature` (mm) does not show.

    A stored normal of zeros is none, and a face lower than a thousandth of its length has no direction.
    """
    stored = normals[kept]
    lengths = np.sqrt(np.einsum("ij,ij->i", stored, stored, dtype=np.float64))
    dot = np.einsum("ij,ij->i", stored, areas)
    real = np.sqrt(np.einsum("ij,ij->i", areas, areas))
    off = np.flatnonzero(~(dot >= NORMAL_COS * lengths * real * (1 - 1e-6)))
    if not len(off):
        return
    square = max_side_squared(mesh.vertices[mesh.faces[kept[off]]])
    sound, unreadable = real[off] > 1e-3 * square, ~np.isfinite(lengths[off])
    wrong = (sound & (lengths[off] > 0)) | unreadable
    if not wrong.any():
        return
    shows = unreadable | (wrong & (real[off] >= feature * np.sqrt(square)))
    text = f"{tally(int(wrong.sum()), 'stored normal')} unlike the face's own"
    places = (Location(face=int(kept[i])) for i in off[wrong])
    yield T013.finding(text, int(wrong.sum()), places, None if shows.any() else "info")

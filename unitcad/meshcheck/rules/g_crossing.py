"""Faces that cross, touch or cover each other: G001, G003, G004, G008 and G009."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np

from unitcad.geometry.arrays import Floats, Ints, among
from unitcad.meshcheck.findings import Finding, Location, counted, most_locations, point
from unitcad.meshcheck.geometry.crossings import (
    Crossings,
    Faces,
    covering_depths,
    crossing_depths,
    facing,
    folded,
    folded_edges,
    join_pairs,
    kinds,
    through_edges,
)
from unitcad.meshcheck.geometry.mesh import float32_step, same_place
from unitcad.meshcheck.geometry.predicates import common_point
from unitcad.meshcheck.geometry.topology import edges_of, turns_of
from unitcad.meshcheck.rules.g_shells import SPECK
from unitcad.meshcheck.rules.inspection import Inspection, at_edges
from unitcad.meshcheck.rules.registry import Rule

G001 = Rule("""
    G001 error: self-crossing
    Two faces pass through each other. Decided exactly: touching is not crossing. A warning, unless --strict is given,
    if they do so by no more than 0.02 mm or four float32 steps; the message gives the depth. In a 3MF file a warning,
    since the core specification (4.1) defines what is solid.
    Example: A bolt passes through a wall and is not united with it.
    Fix: Unite the bodies with a boolean, or move the surfaces apart.
""")

G003 = Rule("""
    G003 warning: shells touch
    Two shells meet in a point, line or face and do not pass through each other there. The shared volume is a millionth
    of the smaller one at most; if it is more, G002 applies too. Rounding decides whether they print as one.
    Example: The tip of a cone meets the top of a box.
    Fix: Overlap them and unite, or leave a gap.
""")

G004 = Rule("""
    G004 warning: coplanar overlap
    Two faces lie in one plane and cover each other in part.
    Example: A box stands on a larger one: its underside covers a part of the other's top.
    Fix: Unite the bodies with a boolean.
""")

G008 = Rule("""
    G008 error: shell overlaps itself
    A shell passes through itself along edges that four or more of its faces share, or two of its faces cover each other
    in one plane and look the same way: its winding number takes another value than 0 and 1, such as 2 in the middle of
    a pentagram or -1 in one half of a bow tie. A warning, unless --strict is given, if two faces cover each other by no
    more than 0.02 mm. In a 3MF file a warning, since the core specification (4.1) says what is solid.
    Example: A prism stands on a pentagram that is drawn in one stroke.
    Fix: Unite the body with itself by a boolean, or correct the outline that it was made from.
""")

G009 = Rule("""
    G009 error: wall or gap without thickness
    Two faces cover each other in one plane and look opposite ways, and they do not belong to two solids that lie side
    by side: a fin, a fold, a crack, or a cavity that reaches the surface. Also if two neighbours fold onto each other
    to within two float32 steps. A warning, unless --strict is given, if they cover each other by no more than 0.02 mm.
    Example: A fin is drawn as one surface and exported with both of its sides.
    Fix: Give the wall or the gap a thickness, or remove both faces.
""")


_LISTED = 16  # pairs whose places are computed, unless more are kept: some fall together


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the rules to all pairs of faces, then along the edges."""
    crossings = part.crossings
    if crossings.faces is not None:
        yield from _pairs(part, crossings, crossings.faces)
        yield from _touching(crossings, crossings.faces)
    if crossings.stopped is not None:
        raise crossings.stopped
    yield from _along_edges(part)


def _pairs(part: Inspection, crossings: Crossings, faces: Faces) -> Iterator[Finding]:
    """Return pairs of faces that cross or cover each other."""
    topology, places = part.topology, partial(_places, faces)
    crossing, covering = join_pairs(crossings.crossing), join_pairs(crossings.covering)
    opposite = facing(faces, covering[:, 0], covering[:, 1]) < 0
    twice, thin = kinds(topology, faces.shell[covering], opposite)
    other, corners = ~twice & ~thin, faces.corners
    if topology.mesh.indexed and (len(crossing) or len(covering)):
        corners = same_place(faces.vertices)[corners]
    deep = crossing_depths(faces.vertices, corners, crossing, SPECK)
    covers = covering_depths(faces.vertices, corners, covering, SPECK)
    yield from _by_depth(part, G001, "pair", "of faces that cross", deep, crossing, places)
    if other.any():
        text = f"{counted(int(other.sum()), 'pair')} of faces that overlap in one plane"
        yield G004.finding(text, int(other.sum()), places(covering[other]))
    for rule, which, what in (
        (G008, twice, "of faces of one shell that overlap in one plane and look the same way"),
        (G009, thin, "of faces in one plane with nothing between them"),
    ):
        yield from _by_depth(part, rule, "pair", what, covers[which], covering[which], places)


def _by_depth(
    part: Inspection,
    rule: Rule,
    one: str,
    what: str,
    depth: Floats,
    found: Ints,
    places: Callable[[Ints], Iterable[Location]],
) -> Iterator[Finding]:
    """Yield a finding of the deep ones among those `found`, and one of the shallow ones, which `depth` (mm) tells."""
    for shallow in (False, True):
        which = np.isfinite(depth) == shallow
        if not which.any():
            continue
        text, severity = f"{counted(int(which.sum()), one)} {what}", None
        if shallow:
            text += f", {depth[which].max():.2g} mm deep at most"
            severity = None if part.strict else "warning"
        yield rule.finding(text, int(which.sum()), places(found[which]), severity)


def _touching(crossings: Crossings, faces: Faces) -> Iterator[Finding]:
    """Return pairs of shells whose faces meet and do not cross."""
    contact = crossings.contact
    keys, touching = contact.pairs()
    first = np.flatnonzero(~among(keys, np.sort(contact.keys(*faces.shell[join_pairs(crossings.crossing)].T))))
    n = len(first)
    if not n:
        return
    some = " among those compared" if contact.full else ""
    yield G003.finding(f"{counted(n, 'pair')} of shells that touch{some}", n, _places(faces, touching[first]))


def _places(faces: Faces, pairs: Ints) -> list[Location]:
    """List the points at which pairs meet, no point twice, with both faces; first the one that was not named before."""
    by_place: dict[tuple[int, ...], Location] = {}
    named: set[int] = set()
    grid = 4 * max(float32_step(faces.vertices), 1e-300)
    listed = max(_LISTED, most_locations())
    chosen = np.arange(0, len(pairs), max(1, len(pairs) // listed))[:listed]
    corners = faces.vertices[faces.corners[:, pairs[chosen]].transpose(1, 2, 0)]
    names = np.sort(faces.original[pairs[chosen]], axis=1).tolist()
    for (a, b), (one, other) in zip(corners, names, strict=True):
        common = common_point(a, b)
        xyz = point((a.mean(axis=0) if common is None else common) + 0.0)  # no -0
        near = tuple(round(v / grid) for v in xyz)
        if near in by_place:
            continue
        first, second = (other, one) if one in named else (one, other)
        named.add(first)
        by_place[near] = Location(faces=(first, second), xyz=xyz)
    return sorted(by_place.values(), key=lambda place: place.face or 0)


def _along_edges(part: Inspection) -> Iterator[Finding]:
    """Apply G008 and G009 along edges. Vertices in one place are one, whether or not the file lists them apart."""
    topology = part.topology
    mesh, edges, faces = topology.mesh, topology.edges, topology.mesh.faces
    kept, shells, areas, turns = topology.kept, topology.shells, topology.areas, topology.turns
    if mesh.indexed:
        place = same_place(mesh.vertices)
        if not np.array_equal(place, np.arange(len(place))):
            faces = place[faces]
            whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
            faces, kept, shells, areas = faces[whole], kept[whole], shells[whole], areas[whole]
            edges = edges_of(faces, len(mesh.vertices))
            turns = turns_of(mesh.vertices, faces, edges)
    places = partial(at_edges, mesh.vertices, edges, kept)
    through, (folds, low, high) = through_edges(turns, shells), folded_edges(mesh.vertices, faces, edges, areas)
    if n := len(through):
        yield G008.finding(f"{counted(n, 'edge')} at which a shell passes through itself", n, places(through))
    depth = folded(low, high, SPECK)
    yield from _by_depth(part, G009, "edge", "at which two faces fold onto each other", depth, folds, places)

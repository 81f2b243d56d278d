"""Faces that cross, touch or cover each other: G001, G003, G004, G008 and G009."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from unitcad.geometry.arrays import Ints, among
from unitcad.meshcheck.findings import Finding, Location, most_locations, point, tally
from unitcad.meshcheck.geometry.crossings import Faces, join_pairs
from unitcad.meshcheck.geometry.mesh import float32_step
from unitcad.meshcheck.geometry.predicates import common_points
from unitcad.meshcheck.rules.inspection import Inspection, at_edges
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.severity import by_layers, by_width

G001 = Rule("""
    G001 error: self-crossing
    Two faces pass through each other. Decided exactly: touching is not crossing. What they enclose is solid or hollow
    by the fill rule of a slicer: even-odd, nonzero and positive filling differ. A warning, unless --strict is given, if
    a printer cannot show the difference: it is less than 0.02 mm thick, or less than 0.2 mm wide in one of the two
    directions across. Ignored if it is below four float32 steps. In a 3MF file a warning, since the core specification
    (4.1) defines what is solid.
    Example: A bolt passes through a wall and is not united with it.
    Fix: Unite the bodies with a boolean, or move the surfaces apart.
""")

G003 = Rule("""
    G003 warning: shells touch
    Two shells meet in a point, line or face, to within four float32 steps, and do not pass through each other, or by
    less than 0.001 mm. Rounding decides whether they print as one.
    Example: The tip of a cone meets the top of a box.
    Fix: Overlap them and unite, or leave a gap.
""")

G004 = Rule("""
    G004 warning: coplanar overlap
    Two faces of different shells lie in one plane and cover each other in part.
    Example: A box stands on a larger one: its underside covers a part of the other's top.
    Fix: Unite the bodies with a boolean.
""")

G008 = Rule("""
    G008 error: shell overlaps itself
    A shell passes through itself along edges that four or more of its faces share, or two of its faces cover each other
    in one plane and look the same way: its winding number takes another value than 0 and 1, such as 2 in the middle of
    a pentagram or -1 in one half of a bow tie. A warning if a printer cannot show it, as in G001. In a 3MF file a
    warning, since the core specification (4.1) says what is solid.
    Example: A prism stands on a pentagram that is drawn in one stroke.
    Fix: Unite the body with itself by a boolean, or correct the outline that it was made from.
""")

G009 = Rule("""
    G009 error: wall or gap without thickness
    Two faces cover each other to within four float32 steps and look opposite ways, and they do not belong to two solids
    that lie side by side: a fin, a fold, a crack, or a cavity that reaches the surface. A warning, unless --strict is
    given, if no circle of 0.2 mm fits into the place, or if material lies on both sides, so that a slicer fills the
    gap.
    Example: A fin is drawn as one surface and exported with both of its sides.
    Fix: Give the wall or the gap a thickness, or remove both faces.
""")


_LISTED = 16  # pairs whose places are computed, unless more are kept: some fall together


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the rules to all pairs of faces, then along the edges."""
    crossings = part.crossings
    if (faces := crossings.faces) is not None:
        yield from _pairs(part, faces)
        yield from _touching(part, faces)
    if crossings.stopped is not None:
        raise crossings.stopped
    placed, through = part.placed, part.through
    text = f"{tally(len(through), 'edge')} at which a shell passes through itself"
    places = at_edges(placed.mesh.vertices, placed.edges, placed.kept, through)
    yield from by_layers(part, G008, text, len(through), places)
    if part.disputed.stopped is not None:
        raise part.disputed.stopped


def _pairs(part: Inspection, faces: Faces) -> Iterator[Finding]:
    """Return pairs of faces that cross or lie on each other."""
    crossings, places = part.crossings, partial(_places, faces)
    crossing = join_pairs(crossings.crossing) if part.strict else crossings.deep
    twice, thin, other = crossings.kinds(part.topology)
    text = f"{tally(len(crossing), 'pair')} of faces that cross"
    yield from by_layers(part, G001, text, len(crossing), places(crossing))
    if len(other):
        text = f"{tally(len(other), 'pair')} of faces that overlap in one plane"
        yield G004.finding(text, len(other), places(other))
    text = f"{tally(len(twice), 'pair')} of faces of one shell that overlap in one plane and look the same way"
    by = by_width if part.disputed.thick == 0 and not part.disputed.shows else by_layers
    yield from by(part, G008, text, len(twice), places(twice))
    text = f"{tally(len(thin), 'pair')} of faces in one plane with nothing between them"
    yield from by_width(part, G009, text, len(thin), places(thin))


def _touching(part: Inspection, faces: Faces) -> Iterator[Finding]:
    """Return pairs of shells whose faces meet, or would but for rounding, and do not cross by more."""
    crossings = part.crossings
    kept = zip(crossings.contact.pairs(), crossings.near.pairs(), strict=True)
    keys, pairs = (np.concatenate(part) for part in kept)
    keys, first = np.unique(keys, return_index=True)
    if part.disputed.shows or part.disputed.thick >= part.topology.resolution.digit:
        first = first[~among(keys, crossings.crossing_shells())]
    n = len(first)
    if not n:
        return
    some = " among those compared" if crossings.contact.full or crossings.near.full else ""
    yield G003.finding(f"{tally(n, 'pair')} of shells that touch{some}", n, _between(part, faces, pairs[first]))


def _between(part: Inspection, faces: Faces, pairs: Ints) -> Iterator[Location]:
    """Return the places of pairs, one for two shells, each with the middle of the room that their boxes share."""
    topology = part.topology
    shell = dict(zip(faces.original[pairs].ravel().tolist(), faces.shell[pairs].ravel().tolist(), strict=True))
    for place in _places(faces, pairs):
        both = [shell[face] for face in place.faces]
        middle = (topology.low[both].max(axis=0) + topology.high[both].min(axis=0)) / 2
        yield replace(place, centre=point(middle))


def _places(faces: Faces, pairs: Ints) -> list[Location]:
    """List the points at which pairs meet, no point twice, with both faces; first the one that was not named before."""
    by_place: dict[tuple[int, ...], Location] = {}
    named: set[int] = set()
    grid = 4 * max(float32_step(faces.vertices), 1e-300)
    listed = max(_LISTED, most_locations())
    chosen = np.arange(0, len(pairs), max(1, len(pairs) // listed))[:listed]
    corners = faces.vertices[faces.corners[:, pairs[chosen]].transpose(1, 2, 0)]
    names = np.sort(faces.original[pairs[chosen]], axis=1).tolist()
    common = common_points(corners[:, 0], corners[:, 1])
    middles = np.where(np.isnan(common), corners[:, 0].mean(axis=1), common) + 0.0  # no -0
    for middle, (one, other) in zip(middles, names, strict=True):
        xyz = point(middle)
        near = tuple(round(v / grid) for v in xyz)
        if near in by_place:
            continue
        first, second = (other, one) if one in named else (one, other)
        named.add(first)
        by_place[near] = Location(faces=(first, second), xyz=xyz)
    return sorted(by_place.values(), key=lambda place: place.face or 0)

"""Bounds of a mesh's distance from its shape, from the number of segments; for tests and reports.

With n segments a turn, a = sqrt(x / sin x), x = 2 pi / n (see `mesh.area_true`):

- revolved: a radius r becomes an area-true polygon, off by at most r (a - 1); a profile's arc of radius R is first
  inscribed, off by R (1 - cos(pi / n)): d = r (a - 1) + a R (1 - cos(pi / n));
- extruded: an arc of radius R is inscribed: d = R (1 - cos(pi / n)); straight sides are exact: d = 0.

Volume: |V_mesh - V| <= sum over the leaves of d S, S the area of the leaf's curved faces. It holds through every
boolean, since two sums, differences or intersections differ only at points at which their operands differ.
Under `Below` a leaf's curved faces also bound the volume below them: their area counts by how much taller it becomes,
for leaves that are moved but not turned.
Box: a face of the box moves by at most max d if a leaf's own face is the outermost, and by d / sin(w) if an edge of two
faces at the angle w is: 2 max d for any w of 30 degrees or more.
`segment_count(r, t)` makes r (a - 1) <= t, and so d <= 1.5 t for every extruded R <= r.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from unitcad.kernels.mesh import area_true
from unitcad.shape import Below, Common, Component, Cut, Extrude, Place, Polyhedron, Profile, Revolve, Shape, Union
from unitcad.shape.profile import arc_centre, sides


def deviation(shape: Shape, segments: int) -> float:
    """Return the farthest (mm) that any leaf's mesh of `segments` a turn deviates from the leaf's surface."""
    return max((_deviation(leaf, segments) for leaf, _ in _leaves(shape)), default=0.0)


def volume_bound(shape: Shape, segments: int) -> float:
    """Return how much (mm3) the mesh's volume may differ from the shape's."""
    return sum(times * _deviation(leaf, segments) * _curved_area(leaf) for leaf, times in _leaves(shape))


def _leaves(shape: Shape, times: float = 1.0) -> Iterator[tuple[Revolve | Extrude, float]]:
    """Yield every leaf, and how often its curved area counts: under `Below` its faces reach farther down."""
    match shape:
        case Revolve() | Extrude():
            yield shape, times
        case Polyhedron():
            return  # flat faces: the mesh is the shape
        case Union(parts) | Common(parts):
            for part in parts:
                yield from _leaves(part, times)
        case Cut(body, tools):
            for part in (body, *tools):
                yield from _leaves(part, times)
        case Place(inner) | Component(inner):
            yield from _leaves(inner, times)
        case Below(inner, bottom):
            for leaf, more in _leaves(inner, times):
                low, high = (
                    (leaf.z0, leaf.z1)
                    if isinstance(leaf, Extrude)
                    else (leaf.profile.bounds[1], leaf.profile.bounds[3])
                )
                yield leaf, more * (1 + max(high - bottom, 0.0) / (high - low))


def _deviation(leaf: Revolve | Extrude, segments: int) -> float:
    sagitta = 1 - math.cos(math.pi / segments)
    match leaf:
        case Revolve(profile):
            swell = area_true(segments)
            reach = profile.bounds[2]
            return reach * (swell - 1) + swell * sagitta * max((radius for radius, _ in _arcs(profile)), default=0.0)
        case Extrude():
            return sagitta * max((radius for profile in _outlines(leaf) for radius, _ in _arcs(profile)), default=0.0)


def _curved_area(leaf: Revolve | Extrude) -> float:
    """Return the area (mm2) of a leaf's curved faces, or a little more."""
    match leaf:
        case Revolve(profile):
            flat = sum(
                math.pi * (x0 + x1) * math.dist((x0, y0), (x1, y1))
                for (x0, y0, bulge), (x1, y1, _) in sides(profile.vertices)
                if not bulge and y0 != y1
            )
            return flat + 2 * math.pi * profile.bounds[2] * sum(length for _, length in _arcs(profile))
        case Extrude(z0=z0, z1=z1):
            # The farthest that a taper's corner moves sideways on its way up.
            corners = zip(leaf.profile.vertices, (leaf.top or leaf.profile).vertices, strict=True)
            lean = max(math.dist(low[:2], high[:2]) for low, high in corners)
            return math.hypot(z1 - z0, lean) * sum(
                length for profile in _outlines(leaf) for _, length in _arcs(profile)
            )


def _outlines(leaf: Extrude) -> tuple[Profile, ...]:
    return (leaf.profile, *leaf.holes, *([leaf.top] if leaf.top else []))


def _arcs(profile: Profile) -> Iterator[tuple[float, float]]:
    """Yield radius and length (mm) of each arc."""
    for (x0, y0, bulge), (x1, y1, _) in sides(profile.vertices):
        if bulge:
            radius = arc_centre((x0, y0), (x1, y1), bulge)[2]
            yield radius, 4 * math.atan(abs(bulge)) * radius

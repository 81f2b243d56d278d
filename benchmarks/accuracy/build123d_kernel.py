"""Shape to build123d by its own operations, a peer of `unitcad.kernels.occt`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import build123d as b3d
from build123d.topology import Shape as B3dShape
from build123d.topology import SkipClean

from unitcad.kernels import brep, occt
from unitcad.shape import Shape
from unitcad.shape.tree import Turn


def solid(shape: Shape) -> B3dShape:
    """Return the Solid of `shape`, or a Compound if it has several; faces that continue each other are merged."""
    return _solids([shape])[0]


def line(start: brep.Point, end: brep.Point) -> b3d.Edge:
    return b3d.Edge.make_line(start, end)


def arc(start: brep.Point, middle: brep.Point, end: brep.Point) -> b3d.Edge:
    return b3d.Edge.make_three_point_arc(start, middle, end)


def wire(edges: Sequence[b3d.Edge]) -> b3d.Wire:
    return b3d.Wire(edges)


def face(outer: b3d.Wire, holes: Sequence[b3d.Wire]) -> b3d.Face:
    return b3d.Face(outer, holes)


def revolve(profile: b3d.Face) -> b3d.Solid:
    return b3d.Solid.revolve(profile, 360, b3d.Axis.Z)


def extrude(profile: b3d.Face, height: float) -> b3d.Solid:
    return b3d.Solid.extrude(profile, (0, 0, height))


def loft(below: b3d.Wire, above: b3d.Wire) -> b3d.Solid:
    return b3d.Solid.make_loft([below, above], ruled=True)


def polyhedron(corners: Sequence[brep.Point], faces: Sequence[Sequence[int]]) -> B3dShape:
    return B3dShape.cast(occt.polyhedron(corners, faces))


def fuse(parts: Sequence[B3dShape]) -> B3dShape:
    return parts[0].fuse(*parts[1:])


def cut(body: B3dShape, tools: Sequence[B3dShape]) -> B3dShape:
    return body.cut(*tools)


def common(one: B3dShape, other: B3dShape) -> B3dShape:
    return b3d.Compound(one.intersect(other) or [])


def component(shape: B3dShape, at: brep.Point) -> B3dShape:
    return B3dShape.cast(occt.component(shape.wrapped, at))


def below(shape: B3dShape, bottom: float) -> B3dShape:
    return B3dShape.cast(occt.below(shape.wrapped, bottom))


def place(shape: B3dShape, turn: Turn, move: brep.Point) -> B3dShape:
    x_axis, _, z_axis = zip(*turn, strict=True)
    return shape.moved(b3d.Location(b3d.Plane(move, x_dir=x_axis, z_dir=z_axis)))


def _solids(shapes: Sequence[Shape]) -> list[B3dShape]:
    # Cleaned once at the end instead of after each boolean.
    with SkipClean():
        made = brep.realise(shapes, sys.modules[__name__])
    return [shape.clean() for shape in made]

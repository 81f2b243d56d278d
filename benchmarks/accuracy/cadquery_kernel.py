"""Shape to CadQuery by its own operations, a peer of `unitcad.kernels.occt`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import cadquery as cq

from unitcad.kernels import brep, occt
from unitcad.shape import Shape
from unitcad.shape.tree import Turn


def solid(shape: Shape) -> cq.Shape:
    """Return the Solid of `shape`, or a Compound if it has several; faces that continue each other are merged."""
    return _solids([shape])[0]


def line(start: brep.Point, end: brep.Point) -> cq.Edge:
    return cq.Edge.makeLine(start, end)


def arc(start: brep.Point, middle: brep.Point, end: brep.Point) -> cq.Edge:
    return cq.Edge.makeThreePointArc(start, middle, end)


def wire(edges: Sequence[cq.Edge]) -> cq.Wire:
    return cq.Wire.assembleEdges(edges)


def face(outer: cq.Wire, holes: Sequence[cq.Wire]) -> cq.Face:
    return cq.Face.makeFromWires(outer, list(holes))


def revolve(profile: cq.Face) -> cq.Solid:
    return cq.Solid.revolve(profile, 360, (0, 0, 0), (0, 0, 1))


def extrude(profile: cq.Face, height: float) -> cq.Solid:
    return cq.Solid.extrudeLinear(profile, (0, 0, height))


def loft(below: cq.Wire, above: cq.Wire) -> cq.Solid:
    return cq.Solid.makeLoft([below, above], True)


def polyhedron(corners: Sequence[brep.Point], faces: Sequence[Sequence[int]]) -> cq.Shape:
    return cq.Shape.cast(occt.polyhedron(corners, faces))


def fuse(parts: Sequence[cq.Shape]) -> cq.Shape:
    return parts[0].fuse(*parts[1:])


def cut(body: cq.Shape, tools: Sequence[cq.Shape]) -> cq.Shape:
    return body.cut(*tools)


def common(one: cq.Shape, other: cq.Shape) -> cq.Shape:
    return one.intersect(other)


def component(shape: cq.Shape, at: brep.Point) -> cq.Shape:
    return cq.Shape.cast(occt.component(shape.wrapped, at))


def below(shape: cq.Shape, bottom: float) -> cq.Shape:
    return cq.Shape.cast(occt.below(shape.wrapped, bottom))


def place(shape: cq.Shape, turn: Turn, move: brep.Point) -> cq.Shape:
    x_axis, _, z_axis = zip(*turn, strict=True)
    return shape.moved(cq.Location(cq.Plane(move, xDir=x_axis, normal=z_axis)))


def _solids(shapes: Sequence[Shape]) -> list[cq.Shape]:
    made = [shape.clean() for shape in brep.realise(shapes, sys.modules[__name__])]
    return [shape.Solids()[0] if len(shape.Solids()) == 1 else shape for shape in made]

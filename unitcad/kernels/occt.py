"""Shape to boundary representation with OCCT directly, for STEP files.

The extra step installs only OCP; build123d and cadquery install it too. OCP loads in a third of the time that build123d
takes, half of cadquery's.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence

from unitcad.errors import UnitcadError
from unitcad.kernels import brep, mesh
from unitcad.kernels.bounds import volume_bound
from unitcad.kernels.ocp import loading
from unitcad.shape import Place, Shape
from unitcad.shape.tree import Turn

with loading("OCP"):
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
    from OCP.BRepAlgoAPI import BRepAlgoAPI_BooleanOperation, BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
        BRepBuilderAPI_MakeSolid,
        BRepBuilderAPI_MakeWire,
        BRepBuilderAPI_Sewing,
    )
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.BRepGProp import BRepGProp, BRepGProp_Face
    from OCP.BRepLib import BRepLib
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.GeomAbs import GeomAbs_Plane
    from OCP.gp import gp_Ax1, gp_Ax3, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.GProp import GProp_GProps
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_FACE, TopAbs_IN, TopAbs_ShapeEnum, TopAbs_SHELL, TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Wire
    from OCP.TopTools import TopTools_ListOfShape


_SEGMENTS = 96
"""Facets a turn of the mesh that a solid is compared with."""
_SEWN = 1e-6
"""Distance up to which edges of neighbouring faces are one, mm."""
_FLAT = 1e-9
"""Distance from a line or a plane up to which points count as on it, mm."""


def solids(shapes: Iterable[Shape]) -> list[TopoDS_Shape]:
    """Return the bodies of `shapes`, faces that continue each other merged; those of one shape are partners."""
    chains = [_unplaced(shape) for shape in shapes]
    distinct = list(dict.fromkeys(inner for inner, _ in chains))
    made = brep.realise(distinct, sys.modules[__name__])
    merged = dict(zip(distinct, map(_unified, made), strict=True))
    placed = []
    for inner, places in chains:
        solid = merged[inner]
        for each in reversed(places):
            solid = place(solid, each.turn, each.move)
        placed.append(solid)
    return placed


def _unplaced(shape: Shape) -> tuple[Shape, list[Place]]:
    """Return the original of a placed shape, and its places, the outermost first."""
    places = []
    while isinstance(shape, Place):
        places.append(shape)
        shape = shape.shape
    return shape, places


def confirm(shape: Shape, solid: TopoDS_Shape) -> None:
    """Refuse a `solid` that differs from manifold3d's mesh of `shape` in count or volume.

    OCCT can lose a part of a body and call the rest valid. Raises UnitcadError for another count, or for a volume that
    differs by more than the mesh's facets explain.
    """
    properties, other = GProp_GProps(), mesh.realise(shape, _SEGMENTS)
    BRepGProp.VolumeProperties_s(solid, properties)
    count, parts = len(solids_in(solid)), len(other.decompose())
    allowed = volume_bound(shape, _SEGMENTS) + 1e-6 * other.volume()
    if count != parts or abs(properties.Mass() - other.volume()) > allowed:
        raise UnitcadError(
            f"OCCT and manifold3d differ: {count} solids of {properties.Mass():.6g} mm3 against {parts} of"
            f" {other.volume():.6g}, more than the {allowed:.2g} that the mesh's facets explain"
        )


def volume(solid: TopoDS_Shape) -> float:
    """Return the volume of a body, mm3, to about 1e-12 of it."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties, 1e-12)
    return properties.Mass()


def box_of(solid: TopoDS_Shape) -> tuple[float, ...]:
    """Return the box of a body's surfaces themselves, to about 1e-7 mm: (x0, y0, z0, x1, y1, z1)."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(solid, box, False, False)
    box.SetGap(0.0)
    return tuple(box.Get())


def line(start: brep.Point, end: brep.Point) -> TopoDS_Edge:
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*start), gp_Pnt(*end)).Edge()


def arc(start: brep.Point, middle: brep.Point, end: brep.Point) -> TopoDS_Edge:
    return BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(gp_Pnt(*start), gp_Pnt(*middle), gp_Pnt(*end)).Value()).Edge()


def wire(edges: Sequence[TopoDS_Edge]) -> TopoDS_Wire:
    builder = BRepBuilderAPI_MakeWire()
    builder.Add(_list(edges))
    return builder.Wire()


def face(outer: TopoDS_Wire, holes: Sequence[TopoDS_Wire]) -> TopoDS_Face:
    builder = BRepBuilderAPI_MakeFace(outer, True)
    for hole in holes:
        # Drawn counter-clockwise like the outer one, so turned round.
        builder.Add(TopoDS.Wire(hole.Reversed()))
    return builder.Face()


def revolve(profile: TopoDS_Face) -> TopoDS_Shape:
    return BRepPrimAPI_MakeRevol(profile, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 2 * math.pi, True).Shape()


def extrude(profile: TopoDS_Face, height: float) -> TopoDS_Shape:
    return BRepPrimAPI_MakePrism(profile, gp_Vec(0, 0, height), True).Shape()


def loft(below: TopoDS_Wire, above: TopoDS_Wire) -> TopoDS_Shape:
    builder = BRepOffsetAPI_ThruSections(True, True)
    builder.AddWire(below)
    builder.AddWire(above)
    return _with_planes(builder.Shape())


def _with_planes(ruled: TopoDS_Shape) -> TopoDS_Shape:
    """Return a ruled solid, its flat sides as planes.

    OCCT rules a spline between edges of different lengths; a boolean of splines takes twenty times as long.
    """
    sewing = BRepBuilderAPI_Sewing(_SEWN)
    for side in faces_of(ruled):
        corners = [] if BRepAdaptor_Surface(side).GetType() == GeomAbs_Plane else _flat_corners(side)
        sewing.Add(_polygon(corners) if corners else side)
    return _sewn(sewing)


def _flat_corners(side: TopoDS_Face) -> list[gp_Pnt]:
    """Return the corners of a face whose edges are straight and in one plane; of another face none."""
    explorer, corners = BRepTools_WireExplorer(BRepTools.OuterWire_s(side)), []
    while explorer.More():
        corner, curve = BRep_Tool.Pnt_s(explorer.CurrentVertex()), BRepAdaptor_Curve(explorer.Current())
        ends = [curve.Value(at) for at in (curve.FirstParameter(), curve.LastParameter())]
        middle = curve.Value((curve.FirstParameter() + curve.LastParameter()) / 2)
        if gp_Vec(ends[0], middle).Crossed(gp_Vec(ends[0], ends[1])).Magnitude() > _FLAT * ends[0].Distance(ends[1]):
            return []
        corners.append(corner)
        explorer.Next()
    first, *others = corners
    across = gp_Vec(first, others[0]).Crossed(gp_Vec(first, others[-1]))
    flat = all(abs(gp_Vec(first, other).Dot(across)) <= _FLAT * across.Magnitude() for other in others)
    return corners if flat else []


def _polygon(corners: Sequence[gp_Pnt]) -> TopoDS_Face:
    outline = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        outline.Add(corner)
    outline.Close()
    return BRepBuilderAPI_MakeFace(outline.Wire(), True).Face()


def polyhedron(corners: Sequence[brep.Point], faces: Sequence[Sequence[int]]) -> TopoDS_Shape:
    """Return the solid of triangles: their edges sewn together, faces in one plane made one."""
    sewing = BRepBuilderAPI_Sewing(_SEWN)
    for face in faces:
        sewing.Add(_polygon([gp_Pnt(*corners[i]) for i in face]))
    return _unified(_sewn(sewing))


def _sewn(sewing: BRepBuilderAPI_Sewing) -> TopoDS_Shape:
    """Return the solid that sewn faces bound."""
    sewing.Perform()
    builder = BRepBuilderAPI_MakeSolid()
    for shell in _explored(sewing.SewedShape(), TopAbs_SHELL):
        builder.Add(TopoDS.Shell(shell))
    solid = builder.Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return solid


def fuse(parts: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Fuse(), parts[:1], parts[1:])


def cut(body: TopoDS_Shape, tools: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Cut(), [body], tools)


def common(one: TopoDS_Shape, other: TopoDS_Shape) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Common(), [one], [other])


def component(solid: TopoDS_Shape, at: brep.Point) -> TopoDS_Shape:
    for piece in solids_in(solid):
        if BRepClass3d_SolidClassifier(piece, gp_Pnt(*at), 1e-7).State() == TopAbs_IN:
            return piece
    raise UnitcadError(f"OCCT: no solid is at the point {at}")


def below(solid: TopoDS_Shape, bottom: float) -> TopoDS_Shape:
    """Return the prisms under the upward faces, fused: exact where each such face is seen whole from above."""
    x0, y0, _, x1, y1, high = box_of(solid)
    down = gp_Vec(0, 0, bottom - 1 - high)
    prisms = [BRepPrimAPI_MakePrism(each, down, True).Shape() for each in faces_of(solid) if _faces_up(each)]
    under = BRepPrimAPI_MakeBox(gp_Pnt(x0 - 1, y0 - 1, bottom), gp_Pnt(x1 + 1, y1 + 1, high + 1)).Shape()
    return common(fuse([solid, *prisms]), under)


def _faces_up(each: TopoDS_Face) -> bool:
    """Tell whether a face looks upwards. Raises UnitcadError for one that turns from up to down: it has no prism."""
    surface, point, normal = BRepGProp_Face(each), gp_Pnt(), gp_Vec()
    u0, u1, v0, v1 = surface.Bounds()
    signs = set()
    for u in (0.02, 0.35, 0.65, 0.98):
        for v in (0.02, 0.35, 0.65, 0.98):
            surface.Normal(u0 + u * (u1 - u0), v0 + v * (v1 - v0), point, normal)
            if abs(normal.Z()) > 1e-6 * normal.Magnitude():
                signs.add(normal.Z() > 0)
    if len(signs) > 1:
        raise UnitcadError("OCCT: a curved face that turns from up to down bounds a mould; part it where it turns")
    return signs == {True}


def place(solid: TopoDS_Shape, turn: Turn, move: brep.Point) -> TopoDS_Shape:
    x_axis, _, z_axis = zip(*turn, strict=True)
    transform = gp_Trsf()
    transform.SetTransformation(gp_Ax3(gp_Pnt(*move), gp_Dir(*z_axis), gp_Dir(*x_axis)))
    return solid.Moved(TopLoc_Location(transform.Inverted()))


def _boolean(
    operation: BRepAlgoAPI_BooleanOperation, bodies: Sequence[TopoDS_Shape], tools: Sequence[TopoDS_Shape]
) -> TopoDS_Shape:
    # Not in parallel: nothing is gained at this size, and a fork after a parallel run hangs.
    operation.SetArguments(_list(bodies))
    operation.SetTools(_list(tools))
    operation.Build()
    if not operation.IsDone() or operation.Shape().IsNull():
        raise UnitcadError(f"OCCT failed: {type(operation).__name__} of {len(bodies) + len(tools)} solids")
    return operation.Shape()


def _list(shapes: Sequence[TopoDS_Shape]) -> TopTools_ListOfShape:
    collected = TopTools_ListOfShape()
    for shape in shapes:
        collected.Append(shape)
    return collected


def _unified(solid: TopoDS_Shape) -> TopoDS_Shape:
    upgrade = ShapeUpgrade_UnifySameDomain(solid, True, True, True)
    upgrade.AllowInternalEdges(False)
    upgrade.Build()
    solids = solids_in(upgrade.Shape())
    return solids[0] if len(solids) == 1 else upgrade.Shape()


def solids_in(shape: TopoDS_Shape) -> list[TopoDS_Shape]:
    """Return the solids of a shape: itself, or those of a compound."""
    return _explored(shape, TopAbs_SOLID)


def faces_of(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    """Return the faces of a shape."""
    return [TopoDS.Face(face) for face in _explored(shape, TopAbs_FACE)]


def _explored(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> list[TopoDS_Shape]:
    explorer, there = TopExp_Explorer(shape, kind), []
    while explorer.More():
        there.append(explorer.Current())
        explorer.Next()
    return there

"""The solids of a STEP file as OCCT reads, meshes and measures them. It may die of a file: only a worker calls it."""

from __future__ import annotations

from math import dist
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_COMPOUND, TopAbs_FACE, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Iterator
from OCP.TopTools import TopTools_IndexedMapOfShape
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Point
from unitcad.meshcheck.readers.read_step import Measured, TooMany

_ANGLE = 0.35
"""Largest angle between neighbouring facets of a curved face, radians."""
_LEAST_MM, _PART = 0.01, 5e-5
"""A mesh lies within the larger of _LEAST_MM and _PART of the diagonal from its surface."""


def read_bodies(path: str, tolerance: float) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the result of `read_step.step_bodies`, in this process."""
    document, reader = TDocStd_Document(TCollection_ExtendedString("XmlXCAF")), STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.ReadFile(path)
    reader.Transfer(document)
    roots = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    return [
        (name, *triangles_of(solid, tolerance))
        for root in range(1, roots.Length() + 1)
        for name, solid in _solids(roots.Value(root), "", TopLoc_Location())
    ]


def _solids(label: Any, called: str, place: Any) -> list[tuple[str, Any]]:
    """Return the solids under a label with the name of the part that holds each."""
    name = TDataStd_Name()
    if label.FindAttribute(TDataStd_Name.GetID_s(), name):
        called = name.Get().ToExtString()
    if XCAFDoc_ShapeTool.IsReference_s(label):
        referred = TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(label, referred)
        return _solids(referred, called, place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label)))
    if XCAFDoc_ShapeTool.IsAssembly_s(label):
        parts = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(label, parts)
        return [solid for i in range(1, parts.Length() + 1) for solid in _solids(parts.Value(i), called, place)]
    explorer, solids = TopExp_Explorer(XCAFDoc_ShapeTool.GetShape_s(label).Moved(place), TopAbs_SOLID), []
    while explorer.More():
        solids.append((called, explorer.Current()))
        explorer.Next()
    return solids


def triangles_of(solid: Any, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3), mm, and faces (m, 3) of OCCT's mesh of a solid, as `read_step.step_bodies` has them."""
    BRepMesh_IncrementalMesh(solid, tolerance, False, _ANGLE, False)
    vertices: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    explorer = TopExp_Explorer(solid, TopAbs_FACE)
    while explorer.More():
        face, place = TopoDS.Face(explorer.Current()), TopLoc_Location()
        explorer.Next()
        mesh, first = BRep_Tool.Triangulation_s(face, place), len(vertices) - 1
        if mesh is None:
            continue
        for i in range(1, mesh.NbNodes() + 1):
            point = mesh.Node(i).Transformed(place.Transformation())
            vertices.append((point.X(), point.Y(), point.Z()))
        for i in range(1, mesh.NbTriangles() + 1):
            a, b, c = mesh.Triangle(i).Get()
            a, b, c = (a, c, b) if face.Orientation() == TopAbs_REVERSED else (a, b, c)
            faces.append((first + a, first + b, first + c))
    return np.array(vertices).reshape(-1, 3), np.array(faces, dtype=np.int64).reshape(-1, 3)


def measure(path: str) -> Measured | None:
    """Measure a STEP file in this process; None if it contains no shape."""
    reader = STEPControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone or reader.TransferRoots() < 1:
        return None
    shape = reader.OneShape()
    distinct = expect_countable(shape)
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume)
    BRepGProp.SurfaceProperties_s(shape, area)
    valid = all(BRepCheck_Analyzer(distinct.FindKey(i)).IsValid() for i in range(1, distinct.Extent() + 1))
    box = _box(shape)
    tolerance = max(_LEAST_MM, _PART * dist(*box)) if box else _LEAST_MM
    meshes: list[tuple[Floats, Ints]] = []
    explorer = TopExp_Explorer(shape, TopAbs_SOLID)
    while explorer.More():
        meshes.append(triangles_of(explorer.Current(), tolerance))
        explorer.Next()
    return Measured(valid, len(meshes), float(volume.Mass()), float(area.Mass()), box, tolerance, meshes)


MOST_REPEATS, MOST_REPEATED_FACES = 2000, 30_000
"""Bodies and assemblies that a STEP file may place again, and B-rep faces in them: OCCT takes some ms for ten faces."""


def expect_countable(shape: Any) -> TopTools_IndexedMapOfShape:
    """Return the bodies of a shape, each once, where it is defined.

    A file of 40 kB whose assemblies have each other twice can place millions. Raises TooMany.
    """
    distinct, assemblies, faces = TopTools_IndexedMapOfShape(), TopTools_IndexedMapOfShape(), [0]
    repeats = repeated = 0
    left = [shape]
    while left:
        one = left.pop()
        compound = one.ShapeType() == TopAbs_COMPOUND
        known = assemblies if compound else distinct
        before, number = known.Extent(), known.Add(one.Located(TopLoc_Location()))
        if known.Extent() == before:
            repeats, repeated = repeats + 1, repeated + (0 if compound else faces[number])
        elif not compound:
            faces.append(_faces(one))
        below = TopoDS_Iterator(one)
        while compound and below.More():
            left.append(below.Value())
            below.Next()
        if repeats > MOST_REPEATS or repeated > MOST_REPEATED_FACES:
            many = f"{MOST_REPEATS:,} times" if repeats > MOST_REPEATS else f"by {MOST_REPEATED_FACES:,} B-rep faces"
            raise TooMany(f"assemblies that repeat their parts more than {many}")
    return distinct


def _faces(shape: Any) -> int:
    explorer, count = TopExp_Explorer(shape, TopAbs_FACE), 0
    while explorer.More():
        count += 1
        explorer.Next()
    return count


def _box(shape: Any) -> tuple[Point, Point] | None:
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return None
    x0, y0, z0, x1, y1, z1 = box.Get()
    return (x0, y0, z0), (x1, y1, z1)

"""Meshes against the B-rep: volume error and distance over time and triangles, for three ways of making them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.accuracy.measures import makers, mesh_volume
from unitcad.accuracy.result import Plot, Promise, Result, Say, Table, frontier
from unitcad.accuracy.timing import Timing, interleaved, machine
from unitcad.kernels import bounds, mesh
from unitcad.pipeline import Variant
from unitcad.shape import Shape

TOLERANCES = (0.1, 0.03, 0.01, 0.003, 0.001)
ANGLE = 0.1
"""Of OCCT's tessellation, radians: the default of both libraries' exports."""
BODIES = ("layer2", "base", "cup2")
_SAMPLES = 400


@dataclass(frozen=True)
class _Mesh:
    vertices: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True)
class _Row:
    way: str
    tolerance: float
    triangles: int
    volume_error: float
    distance: float
    time: Timing


def run(quick: bool, say: Say) -> Result:
    """Bodies of the encapsulating template by every way and tolerance."""
    tolerances = (0.1, 0.01) if quick else TOLERANCES
    variant = Variant.of("encapsulating")
    parts = {body.name: body.shape for body in (*variant.unit, *variant.plan.tools)}
    tables, plots, promises = [], [], []
    for name in BODIES[:1] if quick else BODIES:
        say(name)
        shape, radius = parts[name], variant.dimensions.outer_radius
        rows = _rows(shape, radius, tolerances, repeats=2 if quick else 5)
        marks = frontier([(row.time.median, row.volume_error) for row in rows])
        tables.append(
            Table(
                f"{name} of the encapsulating template",
                ("way", "tolerance, mm", "triangles", "volume error", "distance, mm", "time from the tree", "frontier"),
                tuple(
                    (r.way, r.tolerance, r.triangles, r.volume_error, r.distance, str(r.time), "*" if mark else "")
                    for r, mark in zip(rows, marks, strict=True)
                ),
            )
        )
        ways = dict.fromkeys(row.way for row in rows)
        plots.append(
            Plot(
                f"{name}: volume error against time",
                "seconds from the tree",
                "volume error, relative",
                {w: tuple((r.time.median, max(r.volume_error, 1e-17)) for r in rows if r.way == w) for w in ways},
            )
        )
        for row in (row for row in rows if row.way == _TRUE):
            bound = bounds.deviation(shape, mesh.segment_count(radius, row.tolerance)) + 1e-6
            where = f"{name} at {row.tolerance:g}: distance over"
            promises.append(Promise(f"{where} the bound that its segments imply", row.distance / bound, 1.0))
            promises.append(Promise(f"{where} 1.5 times the tolerance", row.distance / row.tolerance / 1.5, 1.0))
    return Result(
        suite="tessellation",
        title="Tessellation: error against time and triangles",
        text=(
            "manifold3d draws a circle as a polygon, either through the circle's points (plain) or with the circle's "
            "area "
            "(area-true: what unitcad uses, so that revolved layers keep their volume to rounding). build123d and "
            "CadQuery "
            "tessellate the B-rep that OCCT made, at their default angle of 0.1 rad. Distance is one-sided: the "
            "farthest "
            f"that any of {_SAMPLES} sampled vertices, edge middles and face centres of the mesh lies from the B-rep's "
            "surface. The default of 0.01 mm follows: a fifteenth of the printer's play (0.15 mm), a twentieth of its "
            "layer, and revolved volumes are exact at any tolerance; ten times finer costs time and triangles that no "
            "printer shows."
        ),
        tables=tuple(tables),
        plots=tuple(plots),
        promises=tuple(promises),
        measured=machine("manifold3d", "build123d", "cadquery", "cadquery-ocp"),
    )


_TRUE, _PLAIN = "manifold3d, area-true", "manifold3d, plain"


def _rows(shape: Shape, radius: float, tolerances: tuple[float, ...], repeats: int) -> list[_Row]:
    brep = makers()["OCCT"]([shape])[0]
    true_volume = _volume(brep)
    found = []
    for tolerance in tolerances:
        ways = _ways(shape, radius, tolerance)
        times = interleaved(ways, repeats)
        for way, make in ways.items():
            made = make()
            volume = mesh_volume(made.vertices, made.faces)[0]
            found.append(
                _Row(
                    way,
                    tolerance,
                    len(made.faces),
                    abs(volume / true_volume - 1),
                    _distance(made, brep),
                    times[way],
                )
            )
    return sorted(found, key=lambda row: row.way)


def _ways(shape: Shape, radius: float, tolerance: float) -> dict[str, Callable[[], _Mesh]]:
    libraries = makers()

    def area_true() -> _Mesh:
        mesh.forget()
        return _Mesh(*mesh.arrays(mesh.realise(shape, mesh.segment_count(radius, tolerance))))

    def plain() -> _Mesh:
        with _inscribed():
            made = _Mesh(*mesh.arrays(mesh.realise(shape, _inscribed_count(radius, tolerance))))
        return made

    def by(library: str) -> Callable[[], _Mesh]:
        return lambda: _tessellated(libraries[library]([shape])[0], tolerance)

    return {_TRUE: area_true, _PLAIN: plain, "build123d": by("build123d"), "CadQuery": by("CadQuery")}


@contextlib.contextmanager
def _inscribed() -> Iterator[None]:
    """Circles drawn through their own points: the peer that the area-true polygons are measured against."""
    kept = mesh.area_true
    mesh.forget()
    mesh.area_true = lambda segments: 1.0
    try:
        yield
    finally:
        mesh.area_true = kept
        mesh.forget()


def _inscribed_count(radius: float, tolerance: float) -> int:
    """Sides of an inscribed polygon within `tolerance`, a multiple of 8 like the area-true one's."""
    n = mesh.COARSEST
    while n < mesh.FINEST and radius * (1 - np.cos(np.pi / n)) > tolerance:
        n += 8
    return n


def _tessellated(brep: Any, tolerance: float) -> _Mesh:
    """OCCT's own tessellation, as `tessellate` and `export_stl` of both libraries call it; vertices are not welded."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    BRepTools.Clean_s(brep)
    BRepMesh_IncrementalMesh(brep, tolerance, False, ANGLE, False)
    vertices: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    explorer = TopExp_Explorer(brep, TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face(explorer.Current())
        place = TopLoc_Location()
        grid = BRep_Tool.Triangulation_s(face, place)
        start = len(vertices)
        points = (grid.Node(i).Transformed(place.Transformation()) for i in range(1, grid.NbNodes() + 1))
        vertices += [(p.X(), p.Y(), p.Z()) for p in points]
        for i in range(1, grid.NbTriangles() + 1):
            a, b, c = (v - 1 + start for v in grid.Triangle(i).Get())
            faces.append((a, c, b) if face.Orientation() == TopAbs_REVERSED else (a, b, c))
        explorer.Next()
    return _Mesh(np.array(vertices), np.array(faces))


def _volume(brep: Any) -> float:
    from unitcad.kernels import occt

    return occt.measure(brep).volume


def _distance(made: _Mesh, brep: Any) -> float:
    """The farthest of the sampled points from the B-rep's faces, mm."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS_Compound

    # Faces, not the solid: from inside a solid every distance is zero.
    skin, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(skin)
    explorer = TopExp_Explorer(brep, TopAbs_FACE)
    while explorer.More():
        builder.Add(skin, explorer.Current())
        explorer.Next()
    corners = made.vertices[made.faces]
    points = np.concatenate(
        [made.vertices, (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2, corners.mean(1)]
    )
    sampled = points[np.random.default_rng(0).permutation(len(points))[:_SAMPLES]]
    extrema = BRepExtrema_DistShapeShape()
    extrema.LoadS1(skin)
    farthest = 0.0
    for x, y, z in sampled.tolist():
        extrema.LoadS2(BRepBuilderAPI_MakeVertex(gp_Pnt(x, y, z)).Vertex())
        extrema.Perform()
        farthest = max(farthest, extrema.Value())
    return farthest

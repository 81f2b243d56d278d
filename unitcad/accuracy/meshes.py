"""The meshes of a spec's unit and moulds at five tolerances, compared with the exact surfaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from unitcad.accuracy.timing import interleaved
from unitcad.kernels import bounds, mesh
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Shape

TOLERANCES = (0.1, 0.03, 0.01, 0.003, 0.001)
"""mm."""
SAMPLES = 100
_ROUNDING = 1e-6
"""How far OCCT's distances and volumes may be off: mm, and relative."""

Mesh = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) in mm and faces (m, 3)."""


def tolerances_of(own: float) -> tuple[float, ...]:
    """Return five tolerances, the coarsest first: `own` instead of the nearest of `TOLERANCES`."""
    nearest = min(TOLERANCES, key=lambda one: abs(np.log(one / own)))
    return tuple(own if one == nearest else one for one in TOLERANCES)


def mesh_rows(moulds: MouldSet, say: Callable[[str], object], repeats: int = 3) -> list[dict[str, Any]]:
    """Return triangles, errors, bounds and time of all bodies' meshes, a row for each tolerance.

    Distances are of `SAMPLES` points of each mesh, in mm; volumes relative. Each is that of the worst body, and so is
    its bound. Without the extra `step` there is no exact surface to compare with: the errors are None.
    """
    shapes = {body.shape: body.name for body in (*moulds.unit, *moulds.plan.tools)}
    radius = moulds.dimensions.outer_radius
    segments = {one: mesh.segment_count(radius, one) for one in tolerances_of(moulds.spec.output.tolerance_mm)}
    say("meshes")
    times = interleaved({one: partial(_realise, tuple(shapes), segments[one]) for one in segments}, repeats)
    exact = _exact(tuple(shapes)) if find_spec("OCP") else {}
    rows: list[dict[str, Any]] = []
    for tolerance, time in times.items():
        say(f"distances at {tolerance:g} mm")
        row: dict[str, Any] = {"tolerance_mm": tolerance, "segments": segments[tolerance]}
        row["triangles"] = sum(len(faces) for _, faces in time.value)
        volumes = [mesh.realise(shape, segments[tolerance]).volume() for shape in shapes]
        off = [bounds.deviation(shape, segments[tolerance]) for shape in shapes]
        less = [bounds.volume_bound(shape, segments[tolerance]) / v for shape, v in zip(shapes, volumes, strict=True)]
        row |= {"distance_bound_mm": max(off), "volume_bound": max(less), "distance_mm": None, "volume": None}
        if exact:
            far = [distance(v, f, exact[s][0], SAMPLES) for s, (v, f) in zip(shapes, time.value, strict=True)]
            wrong = [abs(v / exact[s][1] - 1) for s, v in zip(shapes, volumes, strict=True)]
            worst = max(range(len(far)), key=far.__getitem__)
            row |= {"distance_mm": far[worst], "body": [*shapes.values()][worst], "volume": max(wrong)}
            kept = all(a <= b + _ROUNDING for a, b in (*zip(far, off, strict=True), *zip(wrong, less, strict=True)))
            row["within_bounds"] = kept
        rows.append({**row, "s": time.median})
    return rows


def _realise(shapes: Sequence[Shape], segments: int) -> list[Mesh]:
    mesh.forget()
    return [mesh.arrays(mesh.realise(shape, segments)) for shape in shapes]


def _exact(shapes: Sequence[Shape]) -> dict[Shape, tuple[Any, float]]:
    """Return each shape's solid by OCCT, and its volume (mm3)."""
    from unitcad.kernels import occt

    return {s: (solid, occt.measure(solid).volume) for s, solid in zip(shapes, occt.solids(shapes), strict=True)}


def distance(vertices: np.ndarray, faces: np.ndarray, brep: Any, samples: int) -> float:
    """Return how far (mm) the farthest of `samples` vertices, edge middles and face centres is from a solid's faces."""
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
    corners = vertices[faces]
    points = np.concatenate([vertices, (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2, corners.mean(1)])
    sampled = points[np.random.default_rng(0).permutation(len(points))[:samples]]
    extrema = BRepExtrema_DistShapeShape()
    extrema.LoadS1(skin)
    farthest = 0.0
    for x, y, z in sampled.tolist():
        extrema.LoadS2(BRepBuilderAPI_MakeVertex(gp_Pnt(x, y, z)).Vertex())
        extrema.Perform()
        farthest = max(farthest, extrema.Value())
    return farthest

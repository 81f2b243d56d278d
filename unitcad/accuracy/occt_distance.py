"""Distances from a solid's faces by OCCT, an extra: this module loads it."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Compound


def distance(vertices: np.ndarray, faces: np.ndarray, brep: Any, samples: int) -> float:
    """Return how far (mm) the farthest of `samples` vertices, edge middles and face centres is from a solid's faces."""
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

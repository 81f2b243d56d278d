"""Volume, area, box, centre and solid count of a body of any kernel, and the time that it took."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.kernels.mesh import arrays
from unitcad.shape import Shape


@dataclass(frozen=True)
class Measures:
    """Measures of a body in mm, mm2, mm3; the box as (x0, y0, z0, x1, y1, z1)."""

    solids: int
    volume: float
    area: float
    box: tuple[float, ...]
    centre: tuple[float, ...]


def of_mesh(solid: Any) -> Measures:
    """Measure a manifold3d solid."""
    vertices, faces = arrays(solid)
    volume, centre = mesh_volume(vertices, faces)
    return Measures(len(solid.decompose()), volume, solid.surface_area(), tuple(solid.bounding_box()), tuple(centre))


def mesh_volume(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray]:
    """Return volume (mm3) and centre (mm) of a closed mesh, about its middle so that no digits are lost far away."""
    middle = vertices.mean(axis=0)
    a, b, c = np.moveaxis((vertices - middle)[faces], 1, 0)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = six.sum() / 6
    return float(volume), middle + (six[:, None] * (a + b + c)).sum(axis=0) / 24 / volume


def of_brep(solid: Any) -> Measures:
    """Measure an OCCT body (what build123d and CadQuery call `wrapped`)."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from unitcad.kernels import occt

    known = occt.measure(solid)
    surface, body = GProp_GProps(), GProp_GProps()
    BRepGProp.SurfaceProperties_s(solid, surface, 1e-12)
    BRepGProp.VolumeProperties_s(solid, body, 1e-12)
    point = body.CentreOfMass()
    return Measures(known.solids, known.volume, surface.Mass(), known.box, (point.X(), point.Y(), point.Z()))


def makers() -> dict[str, Callable[[list[Shape]], list[Any]]]:
    """Return the B-rep kernels by name, each from trees to OCCT bodies. Raises UnitcadError if one is not installed."""
    from unitcad.kernels import build123d, cadquery, occt

    return {
        "OCCT": occt.solids,
        "build123d": lambda shapes: [build123d.solid(shape).wrapped for shape in shapes],
        "CadQuery": lambda shapes: [cadquery.solid(shape).wrapped for shape in shapes],
    }


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call returns, and its seconds."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start

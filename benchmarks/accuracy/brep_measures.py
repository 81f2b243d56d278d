"""Measures of B-rep solids, by which kernels are compared."""

from __future__ import annotations

from typing import Any, NamedTuple

from unitcad.kernels import occt


class Measures(NamedTuple):
    """Measures that kernels can be compared by, in mm, mm2 and mm3; the box as (x0, y0, z0, x1, y1, z1)."""

    solids: int
    volume: float
    area: float
    box: tuple[float, ...]
    centre: tuple[float, ...]


def measure(solid: Any) -> Measures:
    """Return the measures of a body of OCCT."""
    inside, surface = occt.GProp_GProps(), occt.GProp_GProps()
    occt.BRepGProp.VolumeProperties_s(solid, inside, 1e-12)
    occt.BRepGProp.SurfaceProperties_s(solid, surface, 1e-12)
    centre = inside.CentreOfMass()
    place = (centre.X(), centre.Y(), centre.Z())
    return Measures(len(occt.solids_in(solid)), inside.Mass(), surface.Mass(), occt.box_of(solid), place)

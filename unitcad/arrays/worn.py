"""The patch as it is worn: what was cast flat is mapped onto the limb, each point at its own height over the skin."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from unitcad.arrays.array import Array
from unitcad.kernels.mesh import arrays

FINEST = 2.0
"""Length of an edge, at most, before it is mapped, mm: a long one would cut across the arc."""


def worn(array: Array, solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh of a cast solid as it lies round the limb: vertices (n, 3) in mm and faces (m, 3).

    x becomes the angle x over the middle's radius, z the distance from the limb's axis, which is y: the sheet's middle
    keeps its length. The middle of the array is on top. What was cast curved lies so already. Raises ValueError for an
    array that is worn flat.
    """
    radius, middle = array.radius_mm, array.middle_radius_mm
    if radius is None or middle is None:
        raise ValueError("the array is worn flat")
    if array.cast == "curved":
        vertices, faces = arrays(solid)
        return np.asarray(vertices, float) + np.array([0.0, 0.0, radius]), np.asarray(faces, np.int64)
    vertices, faces = arrays(solid.refine_to_length(FINEST))
    return wrapped(np.asarray(vertices, float), radius, middle), np.asarray(faces, np.int64)


def wrapped(points: np.ndarray, radius: float, middle: float) -> np.ndarray:
    """Return points (n, 3) of the flat frame as they lie round a limb (mm)."""
    angle, distance = points[:, 0] / middle, radius + points[:, 2]
    return np.column_stack([distance * np.sin(angle), points[:, 1], distance * np.cos(angle)])


def limb(array: Array) -> Manifold:
    """Return the limb that the array is worn on as a cylinder, a little longer than the sheet is wide."""
    _, y0, _, y1 = array.sheet.outline
    length = 1.1 * (y1 - y0)
    cylinder = Manifold.cylinder(length, array.radius_mm or 0.0, circular_segments=180, center=True)
    return cylinder.rotate((90.0, 0.0, 0.0)).translate((0.0, (y0 + y1) / 2, 0.0))

"""The opening through which a cavity is filled and vented: its least size, and its section."""

from __future__ import annotations

from manifold3d import Manifold

from unitcad.kernels.sections import widest

LEAST_AREA = 2.0
"""Of an opening that silicone is poured or injected into, mm2 (assumed): a thread or a needle of 1.6 mm."""
LEAST_WIDTH = 0.4
"""Of that opening, and of a vent, mm (assumed): less than the thinnest wall that a spec may have."""
_UNDER = 1 / 4096
"""Depth of the section under the plane of the opening, mm."""


def regions(cavity: Manifold, top: float) -> list[tuple[float, float]]:
    """Return (width in mm, area in mm2) of each region of a cavity's section just under z = `top`, the widest last.

    Width is the diameter of the largest circle that fits.
    """
    return sorted((widest(part)[0], part.area()) for part in cavity.slice(top - _UNDER).decompose())

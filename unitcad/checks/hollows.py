"""The hollows of a cup or a tray: bores, windows, grooves, holes for pins; each a solid."""

from __future__ import annotations

from manifold3d import Manifold

from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape.profile import GRID_PER_MM

GRID = 3 / GRID_PER_MM
"""Wall thickness that snapping two faces to the grid may take, mm."""


def hollows(moulds: MouldSet, piece: str) -> list[Manifold]:
    """Return the difference of a piece's convex hull and the piece, in connected pieces."""
    solid = moulds.solids[piece]
    return moulds.once(f"hollows of {piece}", lambda: thick_pieces(solid.hull() - solid))


def least_wall(moulds: MouldSet) -> float:
    """Return the least wall between two hollows, mm: the printer's, or a narrower land of the spec."""
    lengths = moulds.spec.moulds
    return min(lengths.least_wall_mm, lengths.land_mm) - GRID


def wall_limit(moulds: MouldSet, step: Step) -> float:
    """Return the least wall of a pour's cup, mm: under a low rim the overflow groove's floor may be thinner."""
    least = least_wall(moulds)
    return min(least, step.rim - groove_depth_of(moulds.spec, step.rim) - GRID) if step.groove else least

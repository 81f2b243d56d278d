"""Heights of the tools that fall off the printer's layer grid: the slicer moves such an edge to a layer."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.moulds.base import plate_bottom
from unitcad.moulds.cup import groove_depth_of, window_section
from unitcad.moulds.mould_set import MouldSet

NEAR = 0.02
"""Share of a layer within which a height counts as on the grid."""


@dataclass(frozen=True)
class OffGrid:
    """An edge that no layer ends at: its height above the bed as printed, and the nearest layer's, mm."""

    piece: str
    edge: str
    height_mm: float
    nearest_mm: float

    @property
    def moved_mm(self) -> float:
        """How far the slicer moves it."""
        return self.nearest_mm - self.height_mm


def off_grid(moulds: MouldSet) -> list[OffGrid]:
    """Return the edges that matter to a cavity and are off the grid."""
    layer = moulds.spec.moulds.layer_mm
    nearest = [(*edge, round(edge[2] / layer) * layer) for edge in _edges(moulds)]
    return [
        OffGrid(piece, edge, round(height, 4), round(near, 4))
        for piece, edge, height, near in nearest
        if abs(height - near) > NEAR * layer
    ]


def _edges(moulds: MouldSet) -> list[tuple[str, str, float]]:
    """Return piece, edge and height above the bed, mm. Cups lie upside down: theirs count from the rim."""
    spec, dims = moulds.spec, moulds.plan.dimensions
    bottom = plate_bottom(spec)
    edges = [("base", "seat", -bottom), ("base", "core's top", dims.core_height - bottom)]
    if dims.exit:
        edges += [("base", "ledge", dims.exit.low - bottom), ("tongue", "thickness", dims.exit.height)]
    for step, rim in zip(moulds.plan.steps, dims.heights, strict=True):
        cup = step.cup
        edges += [(cup, "seat", rim)]
        edges += [(cup, "groove's floor", groove_depth_of(spec, rim))] if step.groove else []
        if dims.exit:
            _, low, high = window_section(spec, dims.exit, rim)
            edges += [(cup, "window's lower edge", rim - low)]
            edges += [(cup, "window's upper edge", rim - high)] if high < rim else []
    return edges

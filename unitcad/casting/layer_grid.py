"""Heights of the tools that fall off the printer's layer grid: the slicer moves such an edge to a layer."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.designs import Dimensions
from unitcad.moulds.base import plate_bottom
from unitcad.moulds.cup import groove_depth_of
from unitcad.spec import Spec

NEAR = 0.02
"""Share of a layer within which a height counts as on the grid."""


@dataclass(frozen=True)
class OffGrid:
    """An edge that no layer ends at: its height above the bed as printed, and the nearest layer's, mm."""

    piece: str
    edge: str
    height_mm: float
    nearest_mm: float


def off_grid(spec: Spec, dims: Dimensions) -> list[OffGrid]:
    """The edges that matter to a cavity and are off the grid. Cups lie upside down: heights count from the rim."""
    layer = spec.moulds.layer_mm
    found = []
    for piece, edge, height in _edges(spec, dims):
        nearest = round(height / layer) * layer
        if abs(height - nearest) > NEAR * layer:
            found.append(OffGrid(piece, edge, round(height, 4), round(nearest, 4)))
    return found


def _edges(spec: Spec, dims: Dimensions) -> list[tuple[str, str, float]]:
    bottom, clearance = plate_bottom(spec), spec.moulds.window_clearance_mm
    edges = [("base", "seat", -bottom), ("base", "core's top", dims.core_height - bottom)]
    if dims.exit:
        edges += [("base", "ledge", dims.exit.low - bottom), ("tongue", "thickness", dims.exit.height)]
    for i, rim in enumerate(dims.heights):
        cup = f"cup{i + 1}"
        edges += [(cup, "seat", rim), (cup, "groove's floor", groove_depth_of(spec, rim))]
        if dims.exit:
            low, high = dims.exit.low - clearance, dims.exit.high + clearance
            edges += [(cup, "window's lower edge", rim - low)]
            edges += [(cup, "window's upper edge", rim - high)] if high < rim else []
    return edges

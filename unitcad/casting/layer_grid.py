"""Heights that fall off the printer's layer grid: the slicer moves such an edge to a layer.

The tooling's own heights snap to the grid where the spec leaves them free. The unit's heights are those asked for: a
printer reaches a cap of 1.25 mm in layers of 0.2 mm by no drawing, so what comes out is said instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.designs.limits import filament_groove
from unitcad.moulds.base import plate_bottom, pry_floor
from unitcad.moulds.cup import window_section
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.lid import skirt_end
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


@dataclass(frozen=True)
class UnitHeight:
    """A height of the unit: as asked for, and as whole layers of base and cups make it, mm."""

    what: str
    asked_mm: float
    printed_mm: float


def off_grid(moulds: MouldSet) -> list[OffGrid]:
    """Return the tooling's own edges that are off the grid."""
    layer = moulds.spec.moulds.layer_mm
    nearest = [(*edge, _whole(edge[2], layer)) for edge in _edges(moulds)]
    return [
        OffGrid(piece, edge, round(height, 4), round(near, 4))
        for piece, edge, height, near in nearest
        if abs(height - near) > NEAR * layer
    ]


def unit_heights(moulds: MouldSet) -> list[UnitHeight]:
    """Return the cavity's depth and every layer's height over what it is cast on, where layers make another of them."""
    spec, dims = moulds.spec, moulds.plan.dimensions
    layer, seat = spec.moulds.layer_mm, -moulds.plate[0]
    core = dims.core_height, _whole(seat + dims.core_height, layer) - _whole(seat, layer)
    rims = [(rim, _whole(rim, layer)) for rim in dims.heights]
    heights = [UnitHeight("cavity", *core)] if moulds.plan.concentric and rims[0][0] > core[0] else []
    below = core
    for i, rim in enumerate(rims):
        capped = moulds.plan.concentric and rim[0] > below[0]
        asked, printed = (rim[0] - below[0], rim[1] - below[1]) if capped else rim
        heights.append(UnitHeight(f"layer {i + 1}'s {'cap' if capped else 'height'}", asked, printed))
        below = rim
    heights.append(UnitHeight("height over all", *rims[-1]))
    rounded = [UnitHeight(each.what, round(each.asked_mm, 4), round(each.printed_mm, 4)) for each in heights]
    return [each for each in rounded if abs(each.asked_mm - each.printed_mm) > NEAR * layer]


def _whole(height: float, layer: float) -> float:
    """Return the height of the layers that a slicer makes of it, mm: it cuts each at its middle."""
    return math.floor(height / layer + 0.5 + 1e-6) * layer


def _edges(moulds: MouldSet) -> list[tuple[str, str, float]]:
    """Return piece, edge and height above the bed, mm. Cups lie upside down: theirs count from the rim."""
    spec, dims = moulds.spec, moulds.plan.dimensions
    bottom, top = moulds.plate
    edges = [
        ("base", "plate", top - bottom),
        ("base", "seat", -bottom),
        ("base", "pry slots' floor", pry_floor(spec) - plate_bottom(spec)),
    ]
    if moulds.plan.of_kind("stub"):
        edges.append(("base", "filament groove's roof", filament_groove(spec)))
    if dims.exit:
        edges += [("base", "ledge", dims.exit.low - bottom), ("tongue", "thickness", dims.exit.height)]
    for step, rim in zip(moulds.plan.steps, dims.heights, strict=True):
        cup = step.cup
        edges += [(cup, "groove's floor", groove_depth_of(spec, rim))] if step.groove else []
        if dims.exit:
            _, low, high = window_section(spec, dims.exit, rim)
            edges += [(cup, "window's lower edge", rim - low)]
            edges += [(cup, "window's upper edge", rim - high)] if high < rim else []
        if step.lid and moulds.plan.concentric:
            edges.append((step.lid, "skirt's edge", step.top - skirt_end(spec, dims, step.index - 1)))
            edges.append((step.lid, "underside", step.top - rim))
    return edges

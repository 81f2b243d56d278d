"""The cups: one piece a layer, lifted off upwards."""

from __future__ import annotations

import math

from unitcad.designs import Dimensions
from unitcad.designs.dimensions import Exit
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Cell, Layout
from unitcad.moulds.base import outline, plate_top, tapered
from unitcad.moulds.layout import MARK, PLINTH_DRAFT_DEG
from unitcad.shape import Extrude, Shape, box, cut, cylinder, moved, ring
from unitcad.spec import Spec


def cup(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> Shape:
    """Draw the one-piece cup of a layer (from 0): recess over the plinth, seat at z = 0, bores, windows, grooves."""
    rim, radius = dims.heights[layer], dims.radii[layer]
    tools: list[Shape] = [recess(spec, lay)]
    tools += [moved(cylinder(radius, -BEYOND, rim + BEYOND), c.x, c.y) for c in lay.cells]
    tools += [groove(spec, dims, layer, c) for c in lay.cells]
    tools += windows(spec, dims, lay)
    return cut(cup_blank(spec, lay, rim), tools)


def cup_blank(spec: Spec, lay: Layout, rim: float) -> Shape:
    """Draw the block that a cup is cut from: the skirt ends above the plate, so that the seat bears."""
    return Extrude(outline(lay.cup, MARK), skirt_end(spec), rim)


def skirt_end(spec: Spec) -> float:
    """Return z of the skirt's lower edge."""
    return plate_top(spec) + spec.moulds.seat_relief_mm


def recess(spec: Spec, lay: Layout) -> Shape:
    """Draw the cup's recess: the plinth's taper, wider by the printer's clearance measured square to its sides."""
    clearance = spec.moulds.plinth_clearance_mm / math.cos(math.radians(PLINTH_DRAFT_DEG))
    return tapered(lay, clearance, skirt_end(spec))


def groove(spec: Spec, dims: Dimensions, layer: int, cell: Cell) -> Shape:
    """Draw the overflow groove behind the land; it stops over a window where the wall would be too thin."""
    moulds, rim, radius = spec.moulds, dims.heights[layer], dims.radii[layer]
    inner = radius + moulds.land_mm
    outer = inner + moulds.groove_width_mm
    depth = groove_depth_of(spec, rim)
    channel = ring(inner, outer, rim - depth, rim + BEYOND)
    if dims.exit:
        wall = moulds.least_wall_mm
        half, _, high = window_section(spec, dims.exit)
        if rim - depth - high < wall:
            stops = (
                box(min(0, s * (outer + 1)), max(0, s * (outer + 1)), -half - wall, half + wall, 0, rim + 2 * BEYOND)
                for s in cell.sides
            )
            channel = cut(channel, stops)
    return moved(channel, cell.x, cell.y)


def groove_depth_of(spec: Spec, rim: float) -> float:
    """Return the depth of an overflow groove: the printer's, or half a low rim's height."""
    return min(spec.moulds.groove_depth_mm, rim / 2)


def windows(spec: Spec, dims: Dimensions, lay: Layout) -> list[Shape]:
    """Draw the passages of the tongues through a cup's wall, from each cell outwards to the edge."""
    if not dims.exit:
        return []
    half, low, high = window_section(spec, dims.exit)
    edge = lay.cup[0] + BEYOND
    return [
        box(min(c.x, s * edge), max(c.x, s * edge), c.y - half, c.y + half, low, high)
        for c in lay.cells
        for s in c.sides
    ]


def window_section(spec: Spec, exit: Exit) -> tuple[float, float, float]:
    """Return half width, bottom and top of a window, mm."""
    clearance = spec.moulds.window_clearance_mm
    return exit.width / 2 + clearance, exit.low - clearance, exit.high + clearance

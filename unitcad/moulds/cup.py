"""The cups: one piece a layer, lifted off upwards."""

from __future__ import annotations

import math

from unitcad.designs import Dimensions
from unitcad.designs.dimensions import Exit
from unitcad.designs.parts import BEYOND, solid_within
from unitcad.designs.tooling import Cell, Layout
from unitcad.moulds.base import outline, plate_bottom, plate_top, tapered
from unitcad.moulds.layout import EPS, MARK, groove_depth_of
from unitcad.moulds.ribs import SQUARE, rib_shapes, slot_shapes
from unitcad.shape import Extrude, Shape, box, cut, moved, ring, union
from unitcad.spec import Spec, printer_of


def cup(spec: Spec, dims: Dimensions, lay: Layout, layer: int, wider: float = 0.0) -> Shape:
    """Draw the one-piece cup of a layer (from 0): recess over the plinth, seat at z = 0, bores, windows, grooves."""
    rim = dims.heights[layer]
    tools: list[Shape] = [recess(spec, lay), *bores(dims, lay, layer, wider)]
    tools += grooves(spec, dims, lay, layer)
    tools += windows(spec, dims, lay, rim)
    return cut(cup_blank(spec, lay, rim), tools)


def bores(dims: Dimensions, lay: Layout, layer: int, wider: float = 0.0) -> list[Shape]:
    """Draw the bores of a cup (from 0), longer than it at both ends and `wider` all round, mm."""
    bore = solid_within(tuple((r + wider, z) for r, z in dims.outside(layer)), -BEYOND, dims.heights[layer] + BEYOND)
    return [moved(bore, cell.x, cell.y) for cell in lay.cells]


def cup_blank(spec: Spec, lay: Layout, rim: float) -> Shape:
    """Draw the block that a cup is cut from: the skirt ends above the plate, so that the seat bears."""
    return Extrude(outline(lay.cup, MARK), skirt_end(spec), rim)


def skirt_end(spec: Spec) -> float:
    """Return z of the skirt's lower edge."""
    return plate_top(spec) + spec.moulds.seat_relief_mm


def recess(spec: Spec, lay: Layout) -> Shape:
    """Draw the cup's recess: the plinth's taper, wider by the printer's clearance measured square to its sides, less
    the ribs that centre the cup, and the slots round the leaves of ribs of resin.
    """
    room = cut(tapered(lay, spec.moulds.plinth_clearance_mm * SQUARE, skirt_end(spec)), rib_shapes(spec, lay))
    return union((room, *slots)) if (slots := slot_shapes(spec, lay)) else room


def grooves(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> list[Shape]:
    """Draw the overflow grooves of all cells, neighbours joined if the web between them would be too thin."""
    return [groove(spec, dims, layer, cell) for cell in lay.cells] + _joints(spec, dims, lay, layer)


def _joints(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> list[Shape]:
    """Draw the webs between neighbours' grooves that are thinner than the least wall.

    The pitch is the outermost layer's, whose grooves overlap: those of the layers inside it may just miss each other.
    The circles are polygons within the tolerance, so that is added to the wall on both sides. The lands stay whole.
    """
    moulds, rim, tolerance = spec.moulds, dims.heights[layer], spec.output.tolerance_mm
    outer = dims.radii[layer] + moulds.land_mm + moulds.groove_width_mm
    web, wall = lay.pitch - 2 * outer, moulds.least_wall_mm + 2 * tolerance
    if not -tolerance < web < wall:
        return []
    across = min(wall / 2 + tolerance, web / 2 + moulds.groove_width_mm)
    along = math.sqrt(outer**2 - max((lay.pitch - wall) / 2, 0.0) ** 2)
    low, high, step = rim - groove_depth_of(spec, rim), rim + BEYOND, lay.pitch / 2
    places = {(cell.x, cell.y) for cell in lay.cells}
    beside = [(x + step, y) for x, y in sorted(places) if (x + lay.pitch, y) in places]
    behind = [(x, y + step) for x, y in sorted(places) if (x, y + lay.pitch) in places]
    return [moved(box(-across, across, -along, along, low, high), x, y) for x, y in beside] + [
        moved(box(-along, along, -across, across, low, high), x, y) for x, y in behind
    ]


def groove(spec: Spec, dims: Dimensions, layer: int, cell: Cell) -> Shape:
    """Draw the overflow groove behind the land; it stops over a window if the wall would be too thin."""
    moulds, rim, radius = spec.moulds, dims.heights[layer], dims.radii[layer]
    inner = radius + moulds.land_mm
    outer = inner + moulds.groove_width_mm
    depth = groove_depth_of(spec, rim)
    channel = ring(inner, outer, rim - depth, rim + BEYOND)
    if dims.exit:
        wall = moulds.least_wall_mm
        half, _, high = window_section(spec, dims.exit, rim)
        if rim - depth - high < wall:
            stops = (
                box(min(0, s * (outer + 1)), max(0, s * (outer + 1)), -half - wall, half + wall, 0, rim + 2 * BEYOND)
                for s in cell.sides
            )
            channel = cut(channel, stops)
    return moved(channel, cell.x, cell.y)


def windows(spec: Spec, dims: Dimensions, lay: Layout, rim: float) -> list[Shape]:
    """Draw the passages of the tongues through the wall of a cup of that rim, from each cell outwards to the edge."""
    if not dims.exit:
        return []
    half, low, high = window_section(spec, dims.exit, rim)
    edge = lay.cup[0] + BEYOND
    return [
        box(min(c.x, s * edge), max(c.x, s * edge), c.y - half, c.y + half, low, high)
        for c in lay.cells
        for s in c.sides
    ]


def window_section(spec: Spec, exit: Exit, rim: float) -> tuple[float, float, float]:
    """Return half width, bottom and top of a window in a cup of that rim, mm.

    As the cup is printed, upside down from its rim, bottom and top end whole layers. They keep the clearance to the
    tongue both as drawn and as the layers make cup, ledge and tongue. If the wall over or under the window would be
    thinner than the least wall, they keep only the clearance.
    """
    moulds, layer = spec.moulds, spec.moulds.layer_mm
    low, high = exit.low - moulds.window_clearance_mm, exit.high + moulds.window_clearance_mm

    def printed(height: float) -> tuple[float, float]:
        """Return a height in whole layers; a slicer may take one that is halfway between two for either."""
        return math.ceil(height / layer - 0.5 - EPS) * layer, math.floor(height / layer + 0.5 + EPS) * layer

    seat = -plate_bottom(spec)
    ledge = [one - other for one, other in zip(printed(exit.low + seat), printed(seat)[::-1], strict=True)]
    thickness = exit.height if printer_of(spec).technology.value == "sla" else printed(exit.height)[1]
    rise = max(rim, printed(rim)[1]) - (min(exit.low, ledge[0]) - moulds.window_clearance_mm)
    drop = min(rim, printed(rim)[0]) - (max(exit.high, ledge[1] + thickness) + moulds.window_clearance_mm)
    bottom, top = rim - math.ceil(rise / layer - EPS) * layer, rim - math.floor(drop / layer + EPS) * layer
    return (
        exit.width / 2 + moulds.window_clearance_mm,
        bottom if bottom >= moulds.least_wall_mm - EPS else low,
        top if rim - top >= moulds.least_wall_mm - EPS else high,
    )

"""The piece of printer filament that lets air under a unit, and its way through core and plate.

It fills a hole through the core, flush with its top, and is bent below into a groove under the plate: it rests on the
bench, so it can't sink under the weight of the pour.
"""

from __future__ import annotations

import math

from unitcad.designs.design import BEYOND, Cell, Layout
from unitcad.designs.limits import filament_groove
from unitcad.moulds.layout import Frame
from unitcad.shape import Profile, Revolve, Shape, box, cylinder, moved, polygon, ring, turned, union

FLARE = 1.0
"""Of the filament hole's lower end: the filament bends round it."""
FILAMENT_TAIL = 8.0
"""Length of the bent end outside the plate, mm: the end to pull."""
BITE = 1 / 16
"""How far the seal reaches into filament and core, mm."""
_QUARTER = math.tan(math.pi / 8)


def way(frame: Frame, cell: Cell, bottom: float) -> Shape:
    """Draw the hole through a core, flared below, and the groove under the plate (whose lower face is z = `bottom`)."""
    spec = frame.spec
    radius, depth = spec.moulds.filament_hole_mm / 2, filament_groove(spec)
    roof, layer = bottom + depth, spec.moulds.layer_mm
    below = roof - math.ceil(BEYOND / 2 / layer - 1e-6) * layer  # the floor next to the groove ends a whole layer
    hole = Revolve(
        polygon(
            (0, below),
            (radius + FLARE, below),
            (radius + FLARE, roof),
            (radius, roof + FLARE),
            (radius, frame.dims.core_height + BEYOND),
            (0, frame.dims.core_height + BEYOND),
        )
    )
    channel = box(-depth / 2, depth / 2, -_length(frame, cell), radius + FLARE, bottom - BEYOND, roof)
    return moved(union((hole, channel)), cell.x, cell.y)


def groove(frame: Frame, cell: Cell) -> tuple[float, float, float, float]:
    """Return the groove's rectangle in the plate's lower face: x0, y0, x1, y1 (mm)."""
    half, up = filament_groove(frame.spec) / 2, frame.spec.moulds.filament_hole_mm / 2 + FLARE
    return cell.x - half, cell.y - _length(frame, cell), cell.x + half, cell.y + up


def piece(frame: Frame, cell: Cell, bottom: float) -> Shape:
    """Draw the filament itself: flush with the core's top, its bent end on the bench."""
    radius = frame.spec.moulds.filament_mm / 2
    elbow = bottom + radius
    ball = Revolve(Profile(((0, -radius, _QUARTER), (radius, 0, _QUARTER), (0, radius, 0.0))))
    upright = cylinder(radius, elbow, frame.dims.core_height)
    outside = FILAMENT_TAIL - BEYOND if _meets_edge(frame.lay, cell) else 0.0
    lying = turned(cylinder(radius, 0, _length(frame, cell) - radius + outside), "x", 1)
    bent = union((upright, moved(ball, z=elbow), moved(lying, z=elbow)))
    return moved(bent, cell.x, cell.y)


def annulus(frame: Frame, cell: Cell) -> Shape:
    """Draw the ring between filament and hole: too narrow for silicone of these viscosities to matter, so a seal.

    It reaches into both walls, or faces that coincide could leave a way of no width along them.
    """
    inner = frame.spec.moulds.filament_mm / 2 - BITE
    outer = frame.spec.moulds.filament_hole_mm / 2 + BITE
    return moved(ring(inner, outer, -BEYOND, frame.dims.core_height), cell.x, cell.y)


def _meets_edge(lay: Layout, cell: Cell) -> bool:
    return cell.y == min(c.y for c in lay.cells)


def _length(frame: Frame, cell: Cell) -> float:
    """Return the groove's length: to beyond the plate's edge at -y, or as the pitch allows behind another cell."""
    lay = frame.lay
    if _meets_edge(lay, cell):
        return cell.y + lay.plate[1] + BEYOND
    return lay.pitch - frame.spec.moulds.filament_hole_mm / 2 - FLARE - 2 * frame.spec.moulds.least_wall_mm

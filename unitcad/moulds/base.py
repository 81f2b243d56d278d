"""The base with its plinth and cores, and the tongues that form the slot.

        section of pour 1            cup          rim, z = heights[0]
            .-----------.  groove .--_-----------.
            |           '--'      | |            |
            |     cup   | cavity .'-'. tongue ====== grip
        .---'  .--------+--------'core|-----------'---.
        | skirt|  plinth            filament          |   seat, z = 0
        '------'  ........................ .----------'   skirt ends above the plate
        |  plate                     |   |            |
        '----------------------------'   '- groove ---'

Tools are drawn from the spec's lengths. None is made by subtracting the unit: C100 compares the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from unitcad.designs import Dimensions, design_of
from unitcad.designs.design import BEYOND, Layout, solid_within, strip
from unitcad.designs.dimensions import Exit
from unitcad.moulds import filament
from unitcad.moulds.layout import CORNER_RADIUS, MARK, PLINTH_DRAFT_DEG, Frame
from unitcad.shape import Extrude, Profile, Shape, box, cut, moved, rounded_rectangle, turned, union
from unitcad.spec import Spec
from unitcad.spec.layers import layers_of

GRIP_LENGTH, GRIP_WIDTH, GRIP_GAP, GRIP_APART = 8.0, 10.0, 3.0, 0.5


def tongue(frame: Frame, exit: Exit, cut: bool = False) -> Shape:
    """Draw the strip that forms the slot, with a grip outside the cup; for a single cell on the axis, leaving along +x.

    Its tip is round and stops against the core's riser, its underside rests on the ledge. One that is `cut` from film
    is a plain strip: tape makes its grip.
    """
    lay = frame.lay
    low, high = exit.low, exit.high
    edge = max(lay.cup[0] - abs(c.x) for c in lay.cells)
    reach = edge + GRIP_GAP + GRIP_LENGTH
    if cut:
        return strip(frame.dims, 1, reach, exit.width / 2, low, high)
    half = max(GRIP_WIDTH, exit.width + 4) / 2
    if len(lay.cells) > 1:
        half = max(min(half, lay.pitch / 2 - GRIP_APART), exit.width / 2)
    grip = box(edge + GRIP_GAP, reach, -half, half, low, high)
    return union((strip(frame.dims, 1, reach - 1, exit.width / 2, low, high), grip))


def tongues(frame: Frame, cut: bool = False) -> list[tuple[int, Shape]]:
    """Draw every tongue in its place, with the side (+1, -1 along x) that it is pulled out to; printed, or `cut`."""
    if not frame.dims.exit:
        return []
    one = tongue(frame, frame.dims.exit, cut)
    return [(s, moved(turned(one, "z", 0 if s > 0 else 2), c.x, c.y)) for c in frame.lay.cells for s in c.sides]


PRY_DEPTH, PRY_HALF_WIDTH, PRY_UNDER = 1.5, 4.0, 1.5


def plate_top(spec: Spec) -> float:
    """Return z of the plate's upper face."""
    return -spec.moulds.plinth_height_mm


def plate_bottom(spec: Spec) -> float:
    """Return z of the plate's lower face."""
    return plate_top(spec) - spec.moulds.plate_mm


def base(frame: Frame) -> Shape:
    """Draw plate, keyed plinth and cores in one piece, with pry slots, filament holes and grooves, and ledges."""
    dims, lay = frame.dims, frame.lay
    tools: list[Shape] = []
    if design_of(frame.spec).suction:
        tools += [filament.way(frame, c, plate_bottom(frame.spec)) for c in lay.cells]
    if dims.exit:
        tools += [moved(notch(frame, dims.exit, s), c.x, c.y) for c in lay.cells for s in c.sides]
    return stand(frame, [moved(core(dims), c.x, c.y) for c in lay.cells], tools)


def stand(frame: Frame, standing: Sequence[Shape], tools: Sequence[Shape] = ()) -> Shape:
    """Draw plate and plinth with the parts on them (feet sunk in) in one piece, with pry slots, less `tools`."""
    top, bottom = plate_top(frame.spec), plate_bottom(frame.spec)
    plate = Extrude(outline(frame.lay.plate, MARK), bottom, top)
    return cut(union((plate, plinth(frame), *standing)), [*(pry_slot(frame, side) for side in (1, -1)), *tools])


def pry_floor(spec: Spec) -> float:
    """Return z of a pry slot's floor: PRY_DEPTH or a little more under the plate's face, on a whole layer."""
    layers, bottom = layers_of(spec), plate_bottom(spec)
    wanted = max(spec.moulds.plate_mm - PRY_DEPTH, 0.0)
    return bottom + (layers.down(wanted) or wanted)


def plinth(frame: Frame) -> Shape:
    """Draw the keyed square on the plate that every cup fits over; its top is the seat z = 0."""
    return draw_taper(frame.lay, 0.0, plate_top(frame.spec))


def core(dims: Dimensions) -> Shape:
    """Draw the positive of a cavity, standing on the plinth (its foot sunk in it)."""
    return solid_within(dims.core_outline, -BEYOND, dims.core_height)


def notch(frame: Frame, exit: Exit, side: int) -> Shape:
    """Draw what the ledge removes from a core: the tongue's seat and a window's clearance next to it, open upwards."""
    half = exit.width / 2 + frame.spec.moulds.window_clearance_mm
    return strip(frame.dims, side, frame.dims.cavity_radius + BEYOND, half, exit.low, exit.high + BEYOND)


def outline(size: tuple[float, float], key: float, grow: float = 0.0) -> Profile:
    """Draw a plate of half sizes `size`, its (+x, +y) corner cut by the leg `key`, every side moved out by `grow`.

    A 45 degree cut moves out by as much, which lengthens its leg by (2 - sqrt 2) `grow`.
    """
    leg = key + (2 - math.sqrt(2)) * grow
    return rounded_rectangle(size[0] + grow, size[1] + grow, CORNER_RADIUS + grow, leg)


def draw_taper(lay: Layout, clearance: float, bottom: float) -> Shape:
    """Draw the plinth's taper from `bottom` up to the seat, grown by `clearance` on every side."""

    def section(z: float) -> Profile:
        return outline(lay.plinth, lay.key, clearance - z * math.tan(math.radians(PLINTH_DRAFT_DEG)))

    return Extrude(section(bottom), bottom, 0.0, top=section(0.0))


def pry_slot(frame: Frame, side: int) -> Shape:
    """Draw a slot in the plate's edge that reaches under the skirt: a screwdriver lifts the cup there."""
    inner, outer = side * (frame.lay.cup[0] - PRY_UNDER), side * (frame.lay.plate[0] + BEYOND)
    ends, top = (min(inner, outer), max(inner, outer)), plate_top(frame.spec) + BEYOND / 4
    return box(*ends, -PRY_HALF_WIDTH, PRY_HALF_WIDTH, pry_floor(frame.spec), top)

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
from unitcad.moulds.layout import CORNER_RADIUS, MARK, PLINTH_DRAFT_DEG
from unitcad.shape import Extrude, Profile, Shape, box, cut, moved, rounded_rectangle, turned, union
from unitcad.spec import Spec

GRIP_LENGTH, GRIP_WIDTH, GRIP_GAP, GRIP_APART = 8.0, 10.0, 3.0, 0.5


def tongue(dims: Dimensions, lay: Layout, exit: Exit, cut: bool = False) -> Shape:
    """Draw the strip that forms the slot, with a grip outside the cup; for a single cell on the axis, leaving along +x.

    Its tip is round and stops against the core's riser, its underside rests on the ledge. One that is `cut` from film
    is a plain strip: tape makes its grip.
    """
    low, high = exit.low, exit.high
    edge = max(lay.cup[0] - abs(c.x) for c in lay.cells)
    reach = edge + GRIP_GAP + GRIP_LENGTH
    if cut:
        return strip(dims, 1, reach, exit.width / 2, low, high)
    half = max(GRIP_WIDTH, exit.width + 4) / 2
    if len(lay.cells) > 1:
        half = max(min(half, lay.pitch / 2 - GRIP_APART), exit.width / 2)
    grip = box(edge + GRIP_GAP, reach, -half, half, low, high)
    return union((strip(dims, 1, reach - 1, exit.width / 2, low, high), grip))


def tongues(dims: Dimensions, lay: Layout, cut: bool = False) -> list[tuple[int, Shape]]:
    """Draw every tongue in its place, with the side (+1, -1 along x) that it is pulled out to; printed, or `cut`."""
    if not dims.exit:
        return []
    one = tongue(dims, lay, dims.exit, cut)
    return [(s, moved(turned(one, "z", 0 if s > 0 else 2), c.x, c.y)) for c in lay.cells for s in c.sides]


PRY_DEPTH, PRY_HALF_WIDTH, PRY_UNDER = 1.5, 4.0, 1.5


def plate_top(spec: Spec) -> float:
    """Return z of the plate's upper face."""
    return -spec.moulds.plinth_height_mm


def plate_bottom(spec: Spec) -> float:
    """Return z of the plate's lower face."""
    return plate_top(spec) - spec.moulds.plate_mm


def base(spec: Spec, dims: Dimensions, lay: Layout) -> Shape:
    """Draw plate, keyed plinth and cores in one piece, with pry slots, filament holes and grooves, and ledges."""
    tools: list[Shape] = []
    if design_of(spec).suction:
        tools += [filament.way(spec, dims, lay, c, plate_bottom(spec)) for c in lay.cells]
    if dims.exit:
        tools += [moved(notch(spec, dims, dims.exit, s), c.x, c.y) for c in lay.cells for s in c.sides]
    return stand(spec, lay, [moved(core(dims), c.x, c.y) for c in lay.cells], tools)


def stand(spec: Spec, lay: Layout, standing: Sequence[Shape], tools: Sequence[Shape] = ()) -> Shape:
    """Draw plate and plinth with the parts on them (feet sunk in) in one piece, with pry slots, less `tools`."""
    top, bottom = plate_top(spec), plate_bottom(spec)
    plate = Extrude(outline(lay.plate, MARK), bottom, top)
    return cut(union((plate, plinth(spec, lay), *standing)), [*(pry_slot(spec, lay, side) for side in (1, -1)), *tools])


def pry_floor(spec: Spec) -> float:
    """Return z of a pry slot's floor: PRY_DEPTH or a little more under the plate's face, on a whole layer."""
    layer, bottom = spec.moulds.layer_mm, plate_bottom(spec)
    wanted = max(spec.moulds.plate_mm - PRY_DEPTH, 0.0)
    return bottom + (math.floor(wanted / layer + 1e-6) * layer if wanted >= layer else wanted)


def plinth(spec: Spec, lay: Layout) -> Shape:
    """Draw the keyed square on the plate that every cup fits over; its top is the seat z = 0."""
    return draw_taper(lay, 0.0, plate_top(spec))


def core(dims: Dimensions) -> Shape:
    """Draw the positive of a cavity, standing on the plinth (its foot sunk in it)."""
    return solid_within(dims.core_outline, -BEYOND, dims.core_height)


def notch(spec: Spec, dims: Dimensions, exit: Exit, side: int) -> Shape:
    """Draw what the ledge removes from a core: the tongue's seat and a window's clearance next to it, open upwards."""
    half = exit.width / 2 + spec.moulds.window_clearance_mm
    return strip(dims, side, dims.cavity_radius + BEYOND, half, exit.low, exit.high + BEYOND)


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


def pry_slot(spec: Spec, lay: Layout, side: int) -> Shape:
    """Draw a slot in the plate's edge that reaches under the skirt: a screwdriver lifts the cup there."""
    inner, outer = side * (lay.cup[0] - PRY_UNDER), side * (lay.plate[0] + BEYOND)
    ends, top = (min(inner, outer), max(inner, outer)), plate_top(spec) + BEYOND / 4
    return box(*ends, -PRY_HALF_WIDTH, PRY_HALF_WIDTH, pry_floor(spec), top)

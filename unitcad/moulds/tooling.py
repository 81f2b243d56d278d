"""The pieces of a mould, each a function of the spec: base, cups, tongues, blade, filament stubs, and the seals.

Tools are drawn from the spec's lengths. None is made by subtracting the unit: law 1 compares the two.

        section of pour 1            cup          rim, z = heights[0]
            .-----------.  groove .--_-----------.
            |           '--'      | |            |
            |     cup   | cavity .'-'. tongue ====== grip
        .---'  .--------+--------'core|-----------'---.
        | skirt|  plinth            stub              |   seat, z = 0
        '------'  ........................ .----------'   skirt ends above the plate
        |  plate                     |   |            |
        '----------------------------'   '- groove ---'
"""

from __future__ import annotations

import math

from unitcad.designs import Dimensions, design_named
from unitcad.designs.dimensions import Exit
from unitcad.designs.parts import BEYOND, strip
from unitcad.moulds import filament
from unitcad.moulds.layout import BLADE_HEIGHT, CORNER_RADIUS, MARK, PLINTH_DRAFT_DEG, TEXT_MARGIN, Cell, Layout
from unitcad.shape import (
    Common,
    Extrude,
    Profile,
    Shape,
    box,
    cut,
    cylinder,
    moved,
    polygon,
    ring,
    rounded_rectangle,
    turned,
    union,
)
from unitcad.shape.lettering import HEIGHT, engraving, text_width
from unitcad.spec import Spec

PRY_DEPTH, PRY_HALF_WIDTH, PRY_UNDER = 1.5, 4.0, 1.5
GRIP_LENGTH, GRIP_WIDTH, GRIP_GAP, GRIP_APART = 8.0, 10.0, 3.0, 0.5
BLADE_THICKNESS, BLADE_EDGE = 3.0, 0.8


def plate_top(spec: Spec) -> float:
    """z of the plate's upper face."""
    return -spec.moulds.plinth_height_mm


def plate_bottom(spec: Spec) -> float:
    """z of the plate's lower face."""
    return plate_top(spec) - spec.moulds.plate_mm


def base(spec: Spec, dims: Dimensions, lay: Layout, label: str) -> Shape:
    """Plate, keyed plinth and cores in one piece, with pry slots, filament holes and grooves, ledges and a label."""
    top, bottom = plate_top(spec), plate_bottom(spec)
    plate = Extrude(outline(lay.plate, MARK), bottom, top)
    body = union((plate, plinth(spec, lay), *(moved(core(dims), c.x, c.y) for c in lay.cells)))
    tools: list[Shape] = [_pry_slot(lay, top, side) for side in (1, -1)]
    if design_named(spec.design).suction:
        tools += [filament.way(spec, dims, lay, c, bottom) for c in lay.cells]
    if dims.exit:
        tools += [moved(notch(spec, dims, dims.exit, s), c.x, c.y) for c in lay.cells for s in c.sides]
    if label:
        stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
        text = engraving(label, stroke, top - depth, top + BEYOND)
        width = text_width(label, stroke)
        tools.append(moved(text, -width / 2, (lay.cup[1] + lay.plate[1]) / 2 - lay.label_height / 2))
    return cut(body, tools)


def plinth(spec: Spec, lay: Layout) -> Shape:
    """The keyed square on the plate, 5 degrees a side, that every cup fits over; its top is the seat z = 0."""
    height = spec.moulds.plinth_height_mm
    return _tapered(lay, 0.0, -height)


def core(dims: Dimensions) -> Shape:
    """The positive of a cavity, standing on the plinth (its foot sunk in it)."""
    return cylinder(dims.cavity_radius, -BEYOND, dims.core_height)


def notch(spec: Spec, dims: Dimensions, exit: Exit, side: int) -> Shape:
    """What the ledge removes from a core: the tongue's seat and a window's clearance beside it, open upwards."""
    half = exit.width / 2 + spec.moulds.window_clearance_mm
    return strip(dims, side, dims.cavity_radius + BEYOND, half, exit.low, exit.high + BEYOND)


def cup(spec: Spec, dims: Dimensions, lay: Layout, layer: int, label: tuple[str, str, str] | None) -> Shape:
    """The one-piece cup of a layer (from 0): recess over the plinth, seat at z = 0, bores, windows, grooves."""
    rim, radius = dims.heights[layer], dims.radii[layer]
    tools: list[Shape] = [recess(spec, lay)]
    tools += [moved(cylinder(radius, -BEYOND, rim + BEYOND), c.x, c.y) for c in lay.cells]
    tools += [groove(spec, dims, layer, c) for c in lay.cells]
    tools += windows(spec, dims, lay)
    if label:
        tools += corner_labels(spec, lay, rim, label) + _cell_numbers(spec, lay, rim)
    return cut(cup_blank(spec, lay, rim), tools)


def cup_blank(spec: Spec, lay: Layout, rim: float) -> Shape:
    """The block that a cup is cut from: the skirt ends above the plate, so that the seat bears."""
    return Extrude(outline(lay.cup, MARK), skirt_end(spec), rim)


def outline(size: tuple[float, float], key: float, grow: float = 0.0) -> Profile:
    """A plate of half sizes `size` with its (+x, +y) corner cut by the leg `key`, then every side moved out by `grow`.

    A 45 degree cut moves out by as much, which lengthens its leg by (2 - sqrt 2) `grow`.
    """
    leg = key + (2 - math.sqrt(2)) * grow
    return rounded_rectangle(size[0] + grow, size[1] + grow, CORNER_RADIUS + grow, leg)


def skirt_end(spec: Spec) -> float:
    """z of the skirt's lower edge."""
    return plate_top(spec) + spec.moulds.seat_relief_mm


def recess(spec: Spec, lay: Layout) -> Shape:
    """The cup's recess: the plinth's taper, wider by the printer's clearance measured square to its sides."""
    clearance = spec.moulds.plinth_clearance_mm / math.cos(math.radians(PLINTH_DRAFT_DEG))
    return _tapered(lay, clearance, skirt_end(spec))


def groove(spec: Spec, dims: Dimensions, layer: int, cell: Cell) -> Shape:
    """The overflow groove round a rim, behind the land; it stops over a window that would leave too thin a wall."""
    moulds, rim, radius = spec.moulds, dims.heights[layer], dims.radii[layer]
    inner = radius + moulds.land_mm
    outer = inner + moulds.groove_width_mm
    depth = groove_depth_of(spec, rim)
    channel = ring(inner, outer, rim - depth, rim + BEYOND)
    if dims.exit:
        wall = moulds.least_wall_mm
        half, _, high = _window_section(spec, dims.exit)
        if rim - depth - high < wall:
            stops = (
                box(min(0, s * (outer + 1)), max(0, s * (outer + 1)), -half - wall, half + wall, 0, rim + 2 * BEYOND)
                for s in cell.sides
            )
            channel = cut(channel, stops)
    return moved(channel, cell.x, cell.y)


def groove_depth_of(spec: Spec, rim: float) -> float:
    """Depth of an overflow groove: the printer's, or half a low rim's height."""
    return min(spec.moulds.groove_depth_mm, rim / 2)


def windows(spec: Spec, dims: Dimensions, lay: Layout) -> list[Shape]:
    """The passages of the tongues through a cup's wall, from each cell outwards to the edge."""
    if not dims.exit:
        return []
    half, low, high = _window_section(spec, dims.exit)
    edge = lay.cup[0] + BEYOND
    return [
        box(min(c.x, s * edge), max(c.x, s * edge), c.y - half, c.y + half, low, high)
        for c in lay.cells
        for s in c.sides
    ]


def tongue(dims: Dimensions, lay: Layout, exit: Exit) -> Shape:
    """The strip that forms the slot, with a grip outside the cup; for a single cell on the axis, leaving along +x.

    Its tip is round and stops against the core's riser, its underside rests on the ledge.
    """
    low, high = exit.low, exit.high
    edge = max(lay.cup[0] - abs(c.x) for c in lay.cells)
    reach = edge + GRIP_GAP + GRIP_LENGTH
    half = max(GRIP_WIDTH, exit.width + 4) / 2
    if len(lay.cells) > 1:
        half = max(min(half, lay.pitch / 2 - GRIP_APART), exit.width / 2)
    grip = box(edge + GRIP_GAP, reach, -half, half, low, high)
    return union((strip(dims, 1, reach - 1, exit.width / 2, low, high), grip))


def tongues(dims: Dimensions, lay: Layout) -> list[Shape]:
    """Draw every tongue in its place."""
    if not dims.exit:
        return []
    one = tongue(dims, lay, dims.exit)
    return [moved(turned(one, "z", 0 if s > 0 else 2), c.x, c.y) for c in lay.cells for s in c.sides]


def blade(lay: Layout, rim: float) -> Shape:
    """The strike-off blade, edge down on the rim: a bar as long as the plate, bevelled to a flat edge."""
    half, t, e, h = lay.plate[1], BLADE_THICKNESS, BLADE_EDGE, BLADE_HEIGHT
    section = polygon((0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h))
    # Drawn in (x, z) and stood up: x to x, y to z, extrusion to -y.
    return moved(turned(Extrude(section, -half, half), "x", 1), 0, 0, rim)


def seals(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> list[Shape]:
    """What silicone is kept from though no tool fills it: grease round a tongue, the annulus round a filament.

    A window's seal is what the window removes from the cup, less the tongue; never a solid built a second time.
    """
    found: list[Shape] = []
    if dims.exit:
        around = tongues(dims, lay)
        walls = cut(
            cup_blank(spec, lay, dims.heights[layer]),
            [moved(cylinder(dims.radii[layer], -BEYOND, dims.heights[layer] + BEYOND), c.x, c.y) for c in lay.cells],
        )
        found += [cut(Common((walls, window)), around) for window in windows(spec, dims, lay)]
        found += [
            cut(Common((moved(core(dims), c.x, c.y), moved(notch(spec, dims, dims.exit, s), c.x, c.y))), around)
            for c in lay.cells
            for s in c.sides
        ]
    if design_named(spec.design).suction:
        found += [filament.annulus(spec, dims, c) for c in lay.cells]
    return found


def _tapered(lay: Layout, clearance: float, bottom: float) -> Shape:
    """The plinth's taper from `bottom` up to the seat, grown by `clearance` on every side."""

    def section(z: float) -> Profile:
        return outline(lay.plinth, lay.key, clearance - z * math.tan(math.radians(PLINTH_DRAFT_DEG)))

    return Extrude(section(bottom), bottom, 0.0, top=section(0.0))


def _window_section(spec: Spec, exit: Exit) -> tuple[float, float, float]:
    """Half width, bottom and top of a window."""
    clearance = spec.moulds.window_clearance_mm
    return exit.width / 2 + clearance, exit.low - clearance, exit.high + clearance


def _pry_slot(lay: Layout, top: float, side: int) -> Shape:
    """A slot in the plate's edge that reaches under the skirt: a screwdriver lifts the cup there."""
    inner, outer = side * (lay.cup[0] - PRY_UNDER), side * (lay.plate[0] + BEYOND)
    return box(min(inner, outer), max(inner, outer), -PRY_HALF_WIDTH, PRY_HALF_WIDTH, top - PRY_DEPTH, top + BEYOND / 4)


def corner_labels(spec: Spec, lay: Layout, rim: float, label: tuple[str, str, str]) -> list[Shape]:
    """Three pairs of characters to engrave in a plate's corners, outside all bores; the fourth corner is the key's."""
    stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
    width, height = text_width("00", stroke), HEIGHT * stroke
    x, y = lay.cup[0] - TEXT_MARGIN, lay.cup[1] - TEXT_MARGIN
    corners = ((-x, y - height), (-x, -y), (x - width, -y))
    return [
        moved(engraving(text, stroke, rim - depth, rim + BEYOND), *corner)
        for text, corner in zip(label, corners, strict=True)
    ]


def _cell_numbers(spec: Spec, lay: Layout, rim: float) -> list[Shape]:
    """The number of each of several cells, in the space that the grooves leave at its upper right."""
    stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
    return [
        moved(
            engraving(c.name, stroke, rim - depth, rim + BEYOND),
            c.x + lay.pitch / 2 - text_width(c.name, stroke) / 2,
            c.y + lay.pitch / 2 - HEIGHT * stroke / 2,
        )
        for c in lay.cells
        if c.name
    ]

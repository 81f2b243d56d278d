r"""The cups: one piece a layer, lifted off upwards, and the ribs or pins that centre it.

Pins on a base and blind holes in its cups: they centre cups that are too large for a skirt.

          .----------------- cup -----.
          |    .--------.   blind hole, wider by the clearance and deeper by its relief
    ------'    | /----\ |    '--------  seat, z = 0
               |_| pin|_|
    ----------- base ------------------

A pin's end is chamfered, and the hole's mouth: a first printed layer that is squeezed out narrows it.

Ribs centre a cup on its plinth. Each face of its recess has two, level with those opposite.

      plan, from above                  section of a rib
    .--v-----------v--.                      seat
    |  .---------.    |              |  .-----------     z = 0
    |> | plinth   \  <|              | |
    |  |           |  |              |  \    <- roof
    |> |           | <|              |   |
    |  '-----------'  |              |   |   <- crest: reaches into the plinth by the interference
    '--^-----------^--'              |  /    <- lead-in, down to the skirt's end

The plinth is tapered, so a rib meets it only when the cup is nearly down, along its whole crest at once. Opposite ribs
are crushed alike, which leaves the cup in the middle; pairs hold it against turning too. They are as far from the axes
as the cut corner permits: for leverage, and clear of tails, which leave along x.

Ribs of resin would chip. Each is low on a leaf of the skirt, which a slot from below frees behind and on both sides;
the leaf bends, and nothing is crushed:

      plan of a face, from above
    ----.  .---.  .----
    wall|  |   |  |wall      slot, open downwards
        |  '---'  |
        |  leaf   |          its thickness and the slot's width: the printer's least wall
    ----'----v----'----      recess
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from unitcad.designs.design import BEYOND, Cell, solid_within
from unitcad.designs.dimensions import Exit
from unitcad.designs.limits import CREST, LEAF_WIDTH, leaf_mm
from unitcad.moulds.base import draw_taper, outline, plate_bottom, plate_top
from unitcad.moulds.layout import CORNER_RADIUS, EPS, MARK, PLINTH_DRAFT_DEG, Frame, groove_depth_of
from unitcad.shape import Extrude, Profile, Revolve, Shape, box, cut, moved, polygon, ring, union
from unitcad.shape.profile import mm
from unitcad.spec import Spec, printer_of
from unitcad.spec.layers import layers_of

PIN_RADIUS = 2.0
CHAMFER = 0.4
"""Of a pin's end, and of a hole's mouth, mm."""
DEEPER = 0.4
"""How much deeper than its pin a hole is, mm: the cup bears on its seat."""


@dataclass(frozen=True)
class Pins:
    """Pins at `places` (x, y), all of one `height` over the `seat`, in holes wider by `clearance` all round (mm)."""

    places: tuple[tuple[float, float], ...]
    height: float
    clearance: float
    seat: float = 0.0

    @property
    def hole_radius(self) -> float:
        """Of a hole above its mouth, mm."""
        return PIN_RADIUS + self.clearance


def standing_pins(pins: Pins) -> list[Shape]:
    """Draw the pins, sunk into the base."""
    r, h = PIN_RADIUS, pins.height
    drawn = Revolve(polygon((0, -BEYOND), (r, -BEYOND), (r, h - CHAMFER), (r - CHAMFER, h), (0, h)))
    return [moved(drawn, x, y, pins.seat) for x, y in pins.places]


def pin_holes(pins: Pins) -> list[Shape]:
    """Draw the blind holes in a cup whose lower face is the seat."""
    r, h = pins.hole_radius, pins.height + DEEPER
    wide = r + CHAMFER + BEYOND
    drawn = Revolve(polygon((0, -BEYOND), (wide, -BEYOND), (r, CHAMFER), (r, h), (0, h)))
    return [moved(drawn, x, y, pins.seat) for x, y in pins.places]


ROOF = 1.5
"""Height of a crest's upper ramp over its overhang: steep enough to be printed, upside down, without support."""
ROOT = 0.5
"""How deep a rib's drawing reaches into the wall behind it, mm; half a thinner wall."""
AROUND = 0.05
"""Margin of the box round a rib, mm."""
SLOPE = math.tan(math.radians(PLINTH_DRAFT_DEG))
SQUARE = 1 / math.cos(math.radians(PLINTH_DRAFT_DEG))
"""A length square to the plinth's faces, measured level, over itself."""


@dataclass(frozen=True)
class Rib:
    """A rib: its place on the plinth's upper edge (x, y, mm), and its direction, inwards.

    `bottom` and `top` are those of the crest, `foot` and `head` of the whole rib (z, mm).
    """

    x: float
    y: float
    inwards: tuple[int, int]
    foot: float
    bottom: float
    top: float
    head: float


def ribs(frame: Frame) -> tuple[Rib, ...]:
    """Return the ribs of every cup of a set; () if there are none, or the plinth's faces are too short."""
    if not frame.lay.ribs:
        return ()
    moulds, lay, printer = frame.spec.moulds, frame.lay, printer_of(frame.spec)
    crest, leaf = float(printer.least_feature_mm), leaf_mm(printer)
    end = -moulds.plinth_height_mm + moulds.seat_relief_mm
    corner = max(lay.key, CORNER_RADIUS)
    return place_ribs(lay.plinth, corner, end, moulds.plinth_clearance_mm, moulds.rib_interference_mm, crest, leaf)


@lru_cache(maxsize=16)
def place_ribs(
    half: tuple[float, float],
    corner: float,
    end: float,
    clearance: float,
    interference: float,
    crest: float,
    leaf: float = 0.0,
) -> tuple[Rib, ...]:
    """Return the ribs round a plinth of half sizes `half` at z = 0 whose cup's skirt ends at z = `end`, mm.

    `corner` is the length of a face that a corner takes; () if the corners leave no room. `leaf`: the thickness of the
    leaf under a rib, 0 for the wall itself.
    """
    proud, skirt = (clearance + interference) * SQUARE, -end
    beside = LEAF_WIDTH / 2 + leaf if leaf else crest / 2 + proud + ROOT
    ramp, roof, head = min(proud, skirt / 4), min(ROOF * proud, skirt / 4), -skirt / 5
    if leaf:
        ramp, roof, head = min(ramp, CREST / 4), min(roof, CREST / 2), end + CREST
    x, y = (size - corner - beside for size in half)
    if not interference or min(x, y) <= beside:
        return ()
    places = [((side * half[0], at), (-side, 0)) for side in (1, -1) for at in (y, -y)]
    places += [((at, side * half[1]), (0, -side)) for side in (1, -1) for at in (x, -x)]
    return tuple(Rib(*at, inwards, end, end + ramp, head - roof, head) for at, inwards in places)


def drawn(
    standing: tuple[Rib, ...], clearance: float, interference: float, crest: float, root: float = ROOT
) -> list[Shape]:
    """Draw ribs: a crest as wide as a printed line, flanks of 45 degrees, and a ramp at either end."""
    tip, back = mm(interference * SQUARE), mm(-clearance * SQUARE - root)
    reach = mm(crest / 2) + tip
    shapes: list[Shape] = []
    for rib in standing:
        heights = (rib.foot, rib.bottom, rib.top, rib.head)
        # At foot and head the tip is within the wall.
        tips = (back + mm(root / 2), tip, tip, back + mm(root / 2))
        sections = [_section(rib, at, back, reach, z) for at, z in zip(tips, heights, strict=True)]
        shapes += [Extrude(sections[i], heights[i], heights[i + 1], top=sections[i + 1]) for i in range(3)]
    return shapes


def _section(rib: Rib, tip: float, back: float, reach: float, z: float) -> Profile:
    """Draw a rib's section at z: its tip and its back are so far inwards of the plinth's face there.

    Its flanks would meet at `reach`. All lengths are on the grid, so that flanks are planes at exactly 45 degrees.
    """
    (nx, ny), face = rib.inwards, mm(z * SLOPE)
    corners = ((tip, tip - reach), (tip, reach - tip), (back, reach - back), (back, back - reach))
    x, y = mm(rib.x), mm(rib.y)
    return polygon(*((x + nx * (d + face) - ny * t, y + ny * (d + face) + nx * t) for d, t in corners))


def leaf_slots(standing: tuple[Rib, ...], clearance: float, leaf: float) -> list[Shape]:
    """Draw the slots that free a leaf of thickness `leaf` behind each rib, up to z = 0; none without leaves."""
    if not leaf:
        return []
    face, side, shapes = -clearance * SQUARE, LEAF_WIDTH / 2, []
    back, behind = face - leaf * SQUARE, face - 2 * leaf * SQUARE
    for rib in standing:
        low = rib.foot - BEYOND
        for near, far, t0, t1 in (
            (back, behind, -side - leaf, side + leaf),
            (face + BEYOND, behind, -side - leaf, -side),
            (face + BEYOND, behind, side, side + leaf),
        ):
            lower, upper = (_strip(rib, near, far, t0, t1, z) for z in (low, 0.0))
            shapes.append(Extrude(lower, low, 0.0, top=upper))
    return shapes


def _strip(rib: Rib, near: float, far: float, t0: float, t1: float, z: float) -> Profile:
    """Draw a strip along a rib's face at z, `near` to `far` inwards of the plinth, `t0` to `t1` along it."""
    (nx, ny), face = rib.inwards, z * SLOPE
    corners = ((near, t0), (near, t1), (far, t1), (far, t0))
    return polygon(*((rib.x + nx * (d + face) - ny * t, rib.y + ny * (d + face) + nx * t) for d, t in corners))


def slot_shapes(frame: Frame) -> list[Shape]:
    """Draw the slots round the leaves of every cup of a set; none if its ribs are on the wall itself."""
    slots = leaf_slots(ribs(frame), frame.spec.moulds.plinth_clearance_mm, leaf_mm(printer_of(frame.spec)))
    return [union(slots)] if slots else []


def rib_shapes(frame: Frame) -> list[Shape]:
    """Draw the ribs of every cup of a set, reaching into plinth and wall."""
    spec = frame.spec
    moulds = spec.moulds
    root = min(ROOT, moulds.skirt_wall_mm / 2, (leaf_mm(printer_of(spec)) or moulds.skirt_wall_mm) / 2)
    crest = float(printer_of(spec).least_feature_mm)
    return drawn(ribs(frame), moulds.plinth_clearance_mm, moulds.rib_interference_mm, crest, root)


def rib_spaces(frame: Frame) -> list[Shape]:
    """Draw a box round each rib, from behind its wall to before its tip: a check of other faces ignores it."""
    moulds = frame.spec.moulds
    before = moulds.rib_interference_mm * SQUARE + AROUND
    behind = moulds.plinth_clearance_mm * SQUARE + AROUND
    half = float(printer_of(frame.spec).least_feature_mm) / 2 + before + behind
    boxes = []
    for rib in ribs(frame):
        (nx, ny), near, far = rib.inwards, rib.head * SLOPE + before, rib.foot * SLOPE - behind
        x, y = zip(
            *((rib.x + nx * d - ny * t, rib.y + ny * d + nx * t) for d, t in ((near, half), (far, -half))), strict=True
        )
        boxes.append(box(min(x), max(x), min(y), max(y), rib.foot - AROUND, rib.head + AROUND))
    return boxes


def cup(frame: Frame, layer: int, wider: float = 0.0) -> Shape:
    """Draw the one-piece cup of a layer (from 0): recess over the plinth, seat at z = 0, bores, windows, grooves."""
    rim = frame.dims.heights[layer]
    tools: list[Shape] = [recess(frame), *bores(frame, layer, wider)]
    tools += grooves(frame, layer)
    tools += windows(frame, rim)
    return cut(cup_blank(frame, rim), tools)


def bores(frame: Frame, layer: int, wider: float = 0.0) -> list[Shape]:
    """Draw the bores of a cup (from 0), longer than it at both ends and `wider` all round, mm."""
    side, rim = frame.dims.outside(layer), frame.dims.heights[layer]
    bore = solid_within(tuple((r + wider, z) for r, z in side), -BEYOND, rim + BEYOND)
    return [moved(bore, cell.x, cell.y) for cell in frame.lay.cells]


def cup_blank(frame: Frame, rim: float) -> Shape:
    """Draw the block that a cup is cut from: the skirt ends above the plate, so that the seat bears."""
    return Extrude(outline(frame.lay.cup, MARK), skirt_end(frame.spec), rim)


def skirt_end(spec: Spec) -> float:
    """Return z of the skirt's lower edge."""
    return plate_top(spec) + spec.moulds.seat_relief_mm


def recess(frame: Frame) -> Shape:
    """Draw the cup's recess: the plinth's taper, wider by the printer's clearance measured square to its sides, less
    the ribs that centre the cup, and the slots round the leaves of ribs of resin.
    """
    wider = frame.spec.moulds.plinth_clearance_mm * SQUARE
    room = cut(draw_taper(frame.lay, wider, skirt_end(frame.spec)), rib_shapes(frame))
    return union((room, *slots)) if (slots := slot_shapes(frame)) else room


def grooves(frame: Frame, layer: int) -> list[Shape]:
    """Draw the overflow grooves of all cells, neighbours joined if the web between them would be too thin."""
    return [groove(frame, layer, cell) for cell in frame.lay.cells] + _joints(frame, layer)


def _joints(frame: Frame, layer: int) -> list[Shape]:
    """Draw the webs between neighbours' grooves that are thinner than the least wall.

    The pitch is the outermost layer's, whose grooves overlap: those of the layers inside it may just miss each other.
    The circles are polygons within the tolerance, so that is added to the wall on both sides. The lands stay whole.
    """
    spec, lay = frame.spec, frame.lay
    moulds, rim, tolerance = spec.moulds, frame.dims.heights[layer], spec.output.tolerance_mm
    outer = frame.dims.radii[layer] + moulds.land_mm + moulds.groove_width_mm
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


def groove(frame: Frame, layer: int, cell: Cell) -> Shape:
    """Draw the overflow groove behind the land; it stops over a window if the wall would be too thin."""
    spec, dims = frame.spec, frame.dims
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


def windows(frame: Frame, rim: float) -> list[Shape]:
    """Draw the passages of the tongues through the wall of a cup of that rim, from each cell outwards to the edge."""
    if not frame.dims.exit:
        return []
    half, low, high = window_section(frame.spec, frame.dims.exit, rim)
    edge = frame.lay.cup[0] + BEYOND
    return [
        box(min(c.x, s * edge), max(c.x, s * edge), c.y - half, c.y + half, low, high)
        for c in frame.lay.cells
        for s in c.sides
    ]


def window_section(spec: Spec, exit: Exit, rim: float) -> tuple[float, float, float]:
    """Return half width, bottom and top of a window in a cup of that rim, mm.

    As the cup is printed, upside down from its rim, bottom and top end whole layers. They keep the clearance to the
    tongue both as drawn and as the layers make cup, ledge and tongue. If the wall over or under the window would be
    thinner than the least wall, they keep only the clearance.
    """
    moulds, layers = spec.moulds, layers_of(spec)
    low, high = exit.low - moulds.window_clearance_mm, exit.high + moulds.window_clearance_mm

    def printed(height: float) -> tuple[float, float]:
        """Return a height in whole layers; a slicer may take one that is halfway between two for either."""
        half = 2 * EPS * layers.height
        return layers.printed(height - half), layers.printed(height + half)

    seat = -plate_bottom(spec)
    ledge = [one - other for one, other in zip(printed(exit.low + seat), printed(seat)[::-1], strict=True)]
    thickness = exit.height if printer_of(spec).technology.value == "sla" else printed(exit.height)[1]
    rise = max(rim, printed(rim)[1]) - (min(exit.low, ledge[0]) - moulds.window_clearance_mm)
    drop = min(rim, printed(rim)[0]) - (max(exit.high, ledge[1] + thickness) + moulds.window_clearance_mm)
    bottom, top = rim - layers.up(rise), rim - layers.down(drop)
    return (
        exit.width / 2 + moulds.window_clearance_mm,
        bottom if bottom >= moulds.least_wall_mm - EPS else low,
        top if rim - top >= moulds.least_wall_mm - EPS else high,
    )

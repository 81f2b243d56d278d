"""Arrays with a back sheet: the construction, its tools and their drawing, fins and pry slots."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from unitcad.arrays.array import Array, Box
from unitcad.arrays.circuit import Wiring, wiring
from unitcad.arrays.constructions import Construction, Level
from unitcad.arrays.piece_seams import (
    SIDES,
    STEP,
    Side,
    Strip,
    along_side,
    box_feature,
    longer_than_bed,
    of_sheet,
    on_pieces,
    outer_sides,
    pieces,
    round_units,
    seams_of,
    sheet_mm2,
    too_much,
)
from unitcad.arrays.sheet import bent_stretches, draw_groove, draw_sheet, stopped_ring
from unitcad.arrays.tails import CLEAR
from unitcad.designs import design_of, dimensions, layer_colour, shipped
from unitcad.designs.design import ADHESIVE, BEYOND, Cell, Fitting, Layout, bond
from unitcad.designs.limits import filament_groove
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, nearer
from unitcad.moulds import filament
from unitcad.moulds.base import PRY_DEPTH, PRY_HALF_WIDTH, PRY_UNDER, core, outline, plate_top, pry_floor, pry_slot
from unitcad.moulds.cup import CHAMFER, PIN_RADIUS, Pins, pin_holes, standing_pins
from unitcad.moulds.cuts import BESIDE, Feature, Interval, Seam, split, strips, unseen
from unitcad.moulds.layout import MARK, TEXT_MARGIN, Frame, groove_depth_of
from unitcad.moulds.pieces import (
    CAST,
    Removal,
    base_piece,
    blade,
    blade_piece,
    corner_labels,
    cup_piece,
    engrave,
    filament_pieces,
    row_width,
    set_label,
)
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import (
    Common,
    Extrude,
    Shape,
    box,
    cut,
    cylinder,
    moved,
    union,
)
from unitcad.shape.lettering import HEIGHT
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.spec.layers import layers_of
from unitcad.text import number

OFF_SQUARE = 4.0
"""Offset of one pin from the rectangle of the others, mm: a cup goes on in one attitude only."""
LABEL_MARGIN = 0.6
"""Distance of a label from the edges of its strip, mm."""


@dataclass(frozen=True)
class Drawing(Frame):
    """The frame of all tools of an array, and the cuts of base and cups that are larger than the bed."""

    array: Array
    fins: tuple[Fin, ...]
    pins: Pins
    base_seams: tuple[Seam, ...] = ()
    cup_seams: tuple[Seam, ...] = ()
    pry: tuple[PrySlot, ...] = ()

    @property
    def hole(self) -> float:
        """Radius that a pin's hole takes, its mouth included, mm."""
        return self.pins.hole_radius + CHAMFER


def drawing_of(array: Array) -> Drawing:
    """Return the dimensions of the tools. Raises Refusal for tools larger than the bed that can't be cut."""
    spec, moulds = array.unit, array.unit.moulds
    dims = replace(dimensions(spec), exit=None, sides=())
    height = min(dims.heights[0] - moulds.least_wall_mm - 0.4, 3.0)
    height = math.floor(height / moulds.layer_mm + 1e-6) * moulds.layer_mm  # over the seat, the end of a layer
    label = HEIGHT * moulds.engraving_stroke_mm
    hole = PIN_RADIUS + moulds.plinth_clearance_mm
    wall = max(2 * hole + 2 * moulds.least_wall_mm, label + 1.0 + moulds.least_wall_mm)
    box_, beside = array.sheet.outline, moulds.land_mm + moulds.groove_width_mm + wall
    cup = max(abs(box_[0]), box_[2]) + beside, max(abs(box_[1]), box_[3]) + beside
    plate = cup[0] + label + 2 * LABEL_MARGIN, cup[1] + label + 2 * LABEL_MARGIN
    x, y = cup[0] / 2, cup[1] - wall / 2
    places = (-x, -y), (x, -y), (-x, y), (x - OFF_SQUARE, y)
    cells = tuple(Cell(place.x, place.y, (), place.name) for place in array.places)
    pitch = min(array.pitch_mm, 2 * cup[1])
    # No plinth, so no ribs on it.
    lay = Layout(cells, MARK, pitch, (0.0, 0.0), cup, plate, label)
    drawn = Drawing(spec, dims, lay, array, fins(array), Pins(places, height, moulds.plinth_clearance_mm))
    return _cut(drawn)


def _cut(drawn: Drawing) -> Drawing:
    """Return the drawing with its seams, and with enough pins that each piece of base and cups has two."""
    moulds, array, (x, y), plate = drawn.spec.moulds, drawn.array, drawn.lay.cup, drawn.lay.plate
    kept, play = [*of_sheet(array), *_beside(drawn)], moulds.plinth_clearance_mm
    slots = [box_feature(*fin.taken(fin.reach + play, play)) for fin in drawn.fins]
    bore = drawn.dims.outer_radius
    grooved = round_units(array, [bore + moulds.land_mm + moulds.groove_width_mm] * len(array.places))
    clear, close = [*grooved, *slots, *kept], [*round_units(array, [bore] * len(array.places)), *slots, *kept]
    dims, sheet = drawn.dims, array.sheet
    inner = [dims.cavity_radius, *dims.radii][-2]
    moats = len(array.places) * math.pi * (dims.radii[-1] ** 2 - inner**2) * sheet.low
    layer_mm3 = sheet_mm2(array) * sheet.thickness_mm + moats
    fault = too_much(array, (-x, -y, x, y), (sheet.low, dims.heights[-1]), layer_mm3)

    under = [box_feature(*filament.groove(drawn, cell)) for cell in drawn.lay.cells]
    base = seams_of(
        array,
        (-plate[0], -plate[1], *plate),
        f"the base of {2 * plate[0]:.4g} x {2 * plate[1]:.4g} mm",
        clear,
        close,
        lambda found: pry_slots(drawn, found)[1],
        under=under,
    )
    cups = seams_of(array, (-x, -y, x, y), f"a cup of {2 * x:.4g} x {2 * y:.4g} mm", clear, close, fault, other=base)
    cut_at = replace(drawn, base_seams=base, cup_seams=cups, pry=pry_slots(drawn, base)[0])
    return replace(cut_at, pins=replace(drawn.pins, places=(*drawn.pins.places, *_more_pins(cut_at))))


def _beside(drawn: Drawing) -> list[Feature]:
    """Return the features next to the sheet: pins, the corners with their labels, pry slots."""
    (x, y), plate, stroke = drawn.lay.cup, drawn.lay.plate, drawn.spec.moulds.engraving_stroke_mm
    wide = row_width(["C1", "1"], stroke) + TEXT_MARGIN
    high = drawn.lay.label_height + TEXT_MARGIN
    found = [Feature((place,), drawn.hole) for place in drawn.pins.places]
    for side in (1, -1):
        ends = sorted((side * (x - PRY_UNDER), side * plate[0]))
        found.append(box_feature(ends[0], -PRY_HALF_WIDTH, ends[1], PRY_HALF_WIDTH))
        ends = sorted((side * (x - wide), side * plate[0]))
        for up in (1, -1):
            edges = sorted((up * (y - high), up * plate[1]))
            found.append(box_feature(ends[0], edges[0], ends[1], edges[1]))
    return found


def _more_pins(drawn: Drawing) -> list[Point]:
    """Return pins for pieces of base and cups with fewer than two: on their outer sides."""
    (x, y), cut_at = drawn.lay.cup, (*drawn.base_seams, *drawn.cup_seams)
    out_y = drawn.pins.places[-1][1]
    out = x - (y - out_y), out_y
    standing = list(drawn.pins.places)
    for piece in pieces((-x, -y, x, y), cut_at):
        inside = piece[0], piece[2]
        if sum(inside[0] < at < inside[1] and piece[1] < up < piece[3] for at, up in standing) >= 2:
            continue
        own = outer_sides(piece, (-x, -y, x, y))
        new: list[Point] = []
        for side in own:
            axis, sign = SIDES[side]
            middles = [(place.x, place.y)[1 - axis] for place in drawn.array.places]
            for at in _beside_slots(drawn, side, middles, along_side(piece, side), 2 if len(own) == 1 else 1):
                new.append((at, sign * out[axis]) if axis else (sign * out[axis], at))
        standing += [at for at in new if all(math.dist(at, pin) > 4 * PIN_RADIUS for pin in standing)]
    return standing[len(drawn.pins.places) :]


def _beside_slots(drawn: Drawing, side: Side, middles: Sequence[float], within: Interval, count: int) -> list[float]:
    """Return places of pins on a side, spread evenly and clear of its pry slots: at units' middles if possible."""
    by = PRY_HALF_WIDTH + drawn.hole + drawn.spec.moulds.least_wall_mm
    slots = [slot.middle for slot in drawn.pry if slot.side == side]
    steps = (within[0] + STEP * i for i in range(math.ceil((within[1] - within[0]) / STEP)))
    low, high = within[0] + 2 * PIN_RADIUS, within[1] - 2 * PIN_RADIUS
    wanted = [low + (high - low) * (2 * k + 1) / (2 * count) for k in range(count)]
    for tried in (middles, (*steps, *(at + sign * by for at in slots for sign in (-1, 1)))):
        free = [at for at in tried if low < at < high and all(abs(at - slot) >= by - 1e-9 for slot in slots)]
        if free:
            return sorted({min(free, key=lambda at, place=place: abs(at - place)) for place in wanted})
    return []


UP, DOWN = (0, 0, 1), (0, 0, -1)


def slot_roof(spec: Spec) -> float:
    """Return the height of the slots that the cups have for the fins, mm."""
    return dimensions(spec).core_height + spec.moulds.plinth_clearance_mm


def flat_plan(array: Array, cast: Sequence[tuple[Shape, ...]], label: str = "") -> Plan:
    """Return flat tools and pours of layers drawn as `cast`, the last of them the sheet's.

    With a `label`, that of the whole set, they are only the inner layers: taken out and inserted elsewhere. Tools that
    are larger than the bed are cut. Raises Refusal if they can't be.
    """
    drawing = drawing_of(array)
    spec, dims, lay, pours = drawing.spec, drawing.dims, drawing.lay, len(cast)
    sheets = [not label and pour == pours for pour in range(1, pours + 1)]
    blanks = [_base(drawing), *(_cup(drawing, layer, last=sheet) for layer, sheet in enumerate(sheets))]
    label = label or set_label((*blanks, *(shape for shapes in cast for shape in shapes)))
    base = base_piece(engrave(blanks[0], list(_base_letters(drawing, f"B{label}"))))
    base = replace(base, removal=DOWN) if any(sheets) else base
    filaments = filament_pieces([filament.piece(drawing, cell, -spec.moulds.plate_mm) for cell in lay.cells])
    cups: list[Body] = []
    steps: list[Step] = []
    for pour, (blank, sheet) in enumerate(zip(blanks[1:], sheets, strict=True), 1):
        cup = cup_piece(pour, engrave(blank, _cup_letters(drawing, pour, label)))
        # The last cup is a tray for the sheet: printed as drawn, and the patch leaves it, not it the patch.
        cups.append(replace(cup, upside_down=False, removal=None) if sheet else cup)
        # The last cup can't be lifted past the sheet.
        first = Removal(base.name, DOWN) if sheet else Removal(cup.name, UP)
        pulled = [Removal(piece.name, DOWN) for piece in filaments]
        rim = dims.heights[pour - 1]
        steps.append(
            Step(
                index=pour,
                name=f"layer{pour}",
                material=array.sheet.material if sheet else spec.layers[pour - 1].material,
                tools=(base.name, cup.name, *(piece.name for piece in filaments)),
                layer=cast[pour - 1],
                earlier=tuple(shape for shapes in cast[: pour - 1] for shape in shapes),
                seals=tuple(_seals(drawing, pour - 1, last=sheet)),
                rim=rim,
                top=rim,
                removals=(*pulled, first, Removal(CAST, UP)) if pour == pours else (first,),
            )
        )
    bar = blade(lay, dims.heights[pours - 1])
    seamed = (base, drawing.base_seams), *((cup, drawing.cup_seams) for cup in cups)
    return Plan(
        (base, *cups, *filaments, blade_piece(bar, too_long=longer_than_bed(spec, 2 * lay.plate[1]))),
        tuple(steps),
        lay,
        label,
        dims,
        concentric=False,
        pins=drawing.pins,
        pry_slots=tuple((slot.piece, slot.side, slot.middle) for slot in drawing.pry),
        genus=(("base", len(filaments)), *((cup.name, len(lay.cells)) for cup in cups)),
        splits=tuple(split(tool, where) for tool, where in seamed if where),
    )


def _base_letters(drawing: Drawing, label: str) -> Iterator[Shape]:
    """Draw the base's label; on a base that is cut, on each piece with its number, or only the number."""
    spec, (x, y) = drawing.spec, drawing.lay.plate
    strip = Strip((-x, -y, x, y), LABEL_MARGIN, spec.moulds.engraving_stroke_mm, _engraving(spec, 0.0), "back")
    if all(slot.customary for slot in drawing.pry):
        return on_pieces(strip, [(label,)], drawing.base_seams)
    beside = strip._replace(taken=[slot.taken(drawing.lay) for slot in drawing.pry])
    return on_pieces(beside, [(label,), (label[0],), ()], drawing.base_seams)


def _cup_letters(drawing: Drawing, pour: int, label: str) -> list[Shape]:
    """Draw a cup's letters in its corners; the pieces of one that is cut have its name, the label and their number."""
    spec, lay, rim = drawing.spec, drawing.lay, drawing.dims.heights[pour - 1]
    own, (x, y), stroke = f"C{pour:X}", lay.cup, spec.moulds.engraving_stroke_mm
    if not drawing.cup_seams:
        return corner_labels(drawing, rim, (own, label[:2], label[2:]))
    hole = drawing.hole
    taken = [(x - MARK, y - MARK, x, y)]
    taken += [(at - hole, beside - hole, at + hole, beside + hole) for at, beside in drawing.pins.places]
    strip = Strip((-x, -y, x, y), TEXT_MARGIN, stroke, _engraving(spec, rim), "back", taken)
    return list(on_pieces(strip, [(own, label), (own,)], drawing.cup_seams))


def _engraving(spec: Spec, top: float) -> tuple[float, float]:
    return top - spec.moulds.engraving_depth_mm, top + BEYOND


def _base(drawing: Drawing) -> Shape:
    """Draw the base: plate, cores, fins and pins in one piece, with pry slots and the filaments' ways."""
    spec, dims, lay = drawing.spec, drawing.dims, drawing.lay
    plate = Extrude(outline(lay.plate, MARK), -spec.moulds.plate_mm, 0.0)
    cores = [moved(core(dims), cell.x, cell.y) for cell in lay.cells]
    ridges = [fin.drawn(fin.reach, 0.0, -BEYOND, dims.core_height) for fin in drawing.fins]
    ways = [filament.way(drawing, cell, -spec.moulds.plate_mm) for cell in lay.cells]
    # Drawn for a plate under a plinth.
    slots = [moved(pry_slot(drawing, side), z=-plate_top(spec)) for side in (1, -1)]
    slots += [slot.drawn(lay) for slot in drawing.pry if not slot.customary]
    return cut(union((plate, *cores, *ridges, *standing_pins(drawing.pins))), [*slots, *ways])


def _cup(drawing: Drawing, layer: int, *, last: bool) -> Shape:
    """Draw the cup of a pour (from 0); the last one contains the sheet."""
    spec, dims, lay, sheet = drawing.spec, drawing.dims, drawing.lay, drawing.array.sheet
    rim = dims.heights[layer]
    tools = [*_bores(drawing, layer, last=last), *_slots(drawing), *pin_holes(drawing.pins)]
    if last:
        tools.append(draw_groove(sheet, spec, rim))
    else:
        tools += _grooves(drawing, layer)
    return cut(Extrude(outline(lay.cup, MARK), 0.0, rim), tools)


def _bores(drawing: Drawing, layer: int, *, last: bool) -> list[Shape]:
    """Draw the silicone's space in a pour's cup: a bore a unit, the sheet round the straps' posts."""
    dims, sheet = drawing.dims, drawing.array.sheet
    rim = dims.heights[layer]
    top = sheet.low + (rim - sheet.low) / 2 if last else rim + BEYOND
    shapes = [moved(cylinder(dims.radii[layer], -BEYOND, top), cell.x, cell.y) for cell in drawing.lay.cells]
    if last:
        shapes.append(draw_sheet(sheet, sheet.low, rim + BEYOND))
    return shapes


def _slots(drawing: Drawing) -> list[Shape]:
    """Draw the slots for the fins, open downwards."""
    spec = drawing.spec
    clearance = spec.moulds.plinth_clearance_mm
    return [fin.drawn(fin.reach + clearance, clearance, -BEYOND, slot_roof(spec)) for fin in drawing.fins]


def _grooves(drawing: Drawing, layer: int) -> list[Shape]:
    """Draw a groove round each bore; it stops at seams, over slots and near its neighbours: walls would be thin."""
    spec, dims, cells = drawing.spec, drawing.dims, drawing.lay.cells
    moulds, rim = spec.moulds, dims.heights[layer]
    inner = dims.radii[layer] + moulds.land_mm
    outer, depth = inner + moulds.groove_width_mm, groove_depth_of(spec, rim)
    low, high = rim - depth, rim + BEYOND
    stops: list[list[Feature]] = [[] for _ in cells]
    for i, cell in enumerate(cells):
        for other in cells:
            apart = math.hypot(other.x - cell.x, other.y - cell.y)
            if other is not cell and apart < outer + inner:
                stops[i].append(Feature(((other.x, other.y),), inner))
            if other is not cell and apart < 2 * outer + moulds.least_wall_mm:
                stops[i].append(_halfway((cell.x, cell.y), (other.x, other.y), outer, moulds.least_wall_mm))
    for fin in drawing.fins if low - slot_roof(spec) < moulds.least_wall_mm else ():
        wider = moulds.plinth_clearance_mm + moulds.least_wall_mm
        stops[fin.place].append(box_feature(*fin.taken(outer + BEYOND, wider)))
    for seam in drawing.cup_seams:
        for strip in strips(seam, moulds.least_wall_mm + seam.play / 2):
            corners = tuple(unseen(corner, seam.across) for corner in strip)
            for i, cell in enumerate(cells):
                if nearer([(cell.x, cell.y)], corners, outer):
                    stops[i].append(Feature(corners))
    drawn = (stopped_ring((c.x, c.y), (inner, outer), (low, high), stops[i]) for i, c in enumerate(cells))
    return [groove for groove in drawn if groove]


def _halfway(a: Point, b: Point, half: float, width: float) -> Feature:
    """Return a strip across the middle of the way from a to b, `half` long to either side of it, mm."""
    apart = math.dist(a, b)
    way = (b[0] - a[0]) / apart, (b[1] - a[1]) / apart
    at = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    sides = [(along * width / 2, across * half) for along, across in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Feature(tuple((at[0] + u * way[0] - v * way[1], at[1] + u * way[1] + v * way[0]) for u, v in sides))


def _seals(drawing: Drawing, layer: int, *, last: bool) -> list[Shape]:
    """Draw the spaces without silicone that no tool fills: grease round the fins, the ring round a filament."""
    dims, lay, rim = drawing.dims, drawing.lay, drawing.dims.heights[layer]
    x, y = lay.cup
    wall = cut(box(-x, x, -y, y, -BEYOND, rim), _bores(drawing, layer, last=last))
    ridges = [fin.drawn(fin.reach, 0.0, -2 * BEYOND, dims.core_height) for fin in drawing.fins]
    seals = [cut(Common((wall, union(_slots(drawing)))), ridges)] if drawing.fins else []
    return seals + [filament.annulus(drawing, cell) for cell in lay.cells]


SEAL = 1.2
"""Length of a fin in the wall of the outermost cup, mm: its greased slit is the pour's seal."""
_EPS = 1e-6


class Fin(NamedTuple):
    """A way of the circuit out of a unit at (x, y), the `place` of that number: along +x, -x, +y or -y.

    `half` wide to either side. `reach` is from the unit's centre to the fin's end, mm.
    """

    place: int
    x: float
    y: float
    direction: tuple[int, int]
    half: float
    reach: float

    def drawn(self, reach: float, wider: float, low: float, high: float) -> Shape:
        """Draw a box along the way, from the unit's centre to `reach`, `wider` to either side, from z to z."""
        x0, y0, x1, y1 = self.taken(reach, wider)
        return box(x0, x1, y0, y1, low, high)

    def taken(self, reach: float, wider: float) -> Box:
        """Return the box's extent in the plane, mm."""
        half, (dx, dy) = self.half + wider, self.direction
        x0, x1 = (min(0.0, dx * reach), max(0.0, dx * reach)) if dx else (-half, half)
        y0, y1 = (min(0.0, dy * reach), max(0.0, dy * reach)) if dy else (-half, half)
        return self.x + x0, self.y + y0, self.x + x1, self.y + y1


def fins(array: Array) -> tuple[Fin, ...]:
    """Return the fins of an array's units, for every strip of the circuit that leaves a unit.

    A fin ends a seal's length outside its unit.
    """
    wider, places = array.unit.moulds.slot_width_clearance_mm / 2, array.places
    return tuple(
        Fin(i, places[i].x, places[i].y, direction, half + wider, places[i].radius + SEAL)
        for i, direction, half in sorted(set(_ways(array, wiring(array))))
    )


def _ways(array: Array, circuit: Wiring) -> Iterator[tuple[int, tuple[int, int], float]]:
    """Yield place, direction and the strip's half width for every way out of a unit."""
    for strip in circuit.strips:
        (x0, y0), (x1, y1) = strip.start, strip.end
        length = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        for i, place in enumerate(array.places):
            along, across = (place.x - x0) * ux + (place.y - y0) * uy, (place.y - y0) * ux - (place.x - x0) * uy
            if abs(across) < _EPS and -_EPS < along < length + _EPS:
                for sense, rest in ((1, length - along), (-1, along)):
                    if rest > place.radius:
                        yield i, (round(sense * ux), round(sense * uy)), strip.half


LEAST_DEPTH = 0.8
"""Of a slot over a filament's groove, mm: the tip of a thin screwdriver still gets in (assumed)."""


class PrySlot(NamedTuple):
    """A slot: the piece of the base (from 1; of one that is whole 1), its side, its middle along it, its depth, mm."""

    piece: int
    side: Side
    middle: float
    depth: float

    @property
    def customary(self) -> bool:
        """Whether it is one of the two that every base has."""
        return self.side in ("left", "right") and self.middle == 0.0

    def taken(self, lay: Layout) -> Box:
        """Return its extent on the plate, from under the cup to beyond the edge, mm."""
        axis, sign = SIDES[self.side]
        low, high = sorted((sign * (lay.cup[axis] - PRY_UNDER), sign * (lay.plate[axis] + BEYOND)))
        ends = self.middle - PRY_HALF_WIDTH, self.middle + PRY_HALF_WIDTH
        return (ends[0], low, ends[1], high) if axis else (low, ends[0], high, ends[1])

    def drawn(self, lay: Layout) -> Shape:
        """Draw it in a plate whose upper face is z = 0."""
        x0, y0, x1, y1 = self.taken(lay)
        return box(x0, x1, y0, y1, -self.depth, BEYOND / 4)


def pry_slots(drawn: Drawing, seams: Sequence[Seam]) -> tuple[tuple[PrySlot, ...], str]:
    """Return the slots of a base, and the reason why a piece can't be freed, "" if all can.

    There is a slot in the middle of the left and of the right edge. A piece that has neither of the two gets its own:
    at its left and right edge, or at the front and the back.
    """
    spec, lay = drawn.spec, drawn.lay
    depth, plate = plate_top(spec) - pry_floor(spec), (-lay.plate[0], -lay.plate[1], *lay.plate)
    found: list[PrySlot] = []
    for i, piece in enumerate(pieces(plate, seams), 1):
        sides = outer_sides(piece, plate)
        middle = piece[1] < 0.0 < piece[3]
        own = [PrySlot(i, side, 0.0, depth) for side in ("right", "left") if side in sides and middle]
        for pair in (("left", "right"), ("front", "back")):
            at = (slot for side in pair if side in sides for slot in _at(drawn, piece, side))
            own = own or [PrySlot(i, *slot) for slot in at]
        if not own:
            why = f"piece {i} of the base has no room at its edges for a pry slot, and nothing would lever it off"
            return tuple(found), why
        found += own
    return tuple(found), ""


def _at(drawn: Drawing, piece: Box, side: Side) -> Iterator[tuple[Side, float, float]]:
    """Yield side, middle and depth of a piece's slot, as near to its middle as leaves room for a pin; or nothing."""
    to_side, sign = SIDES[side]
    axis = 1 - to_side
    ends, edge = along_side(piece, side), drawn.lay.plate[axis]
    low, high = (end + sign * (BESIDE if abs(end) < edge else MARK) for end, sign in zip(ends, (1, -1), strict=True))
    near = PRY_HALF_WIDTH + drawn.hole + drawn.spec.moulds.least_wall_mm
    standing = [pin[axis] for pin in drawn.pins.places if sign * pin[to_side] > 0]
    count = math.floor((high - low - 2 * PRY_HALF_WIDTH) / STEP + 1e-9)
    places = (low + PRY_HALF_WIDTH + STEP * i for i in range(count + 1))
    for middle in sorted(places, key=lambda place: (abs(place - (low + high) / 2), place)):
        beside = (ends[0] + 2 * PIN_RADIUS < middle - near, middle + near < ends[1] - 2 * PIN_RADIUS)
        depth = _depth(drawn, side, middle)
        if any(beside) and depth and all(abs(middle - pin) >= near for pin in standing):
            yield side, middle, depth
            return


def _depth(drawn: Drawing, side: Side, middle: float) -> float:
    """Return a slot's depth, mm: less over a filament's groove; 0 if it would be too little."""
    moulds, lay, wall = drawn.spec.moulds, drawn.lay, drawn.spec.moulds.least_wall_mm
    most = moulds.plate_mm
    if side == "front":
        grooves = (filament.groove(drawn, cell) for cell in lay.cells)
        reach = PRY_HALF_WIDTH + wall
        if any(x0 - reach < middle < x1 + reach and y0 < -lay.cup[1] for x0, y0, x1, _ in grooves):
            most -= filament_groove(drawn.spec)
    depth = min(PRY_DEPTH, most - wall)
    # The floor on a whole layer from the plate's lower face.
    floor = layers_of(drawn.spec).up(moulds.plate_mm - depth)
    return moulds.plate_mm - floor if moulds.plate_mm - floor >= LEAST_DEPTH - 1e-6 else 0.0


def apart(unit: Spec) -> tuple[float, str]:
    """Return the least distance of two units' edges, mm, and why."""
    spine = unit.fpcb.tail_width_mm + 2 * CLEAR if unit.fpcb else 0.0
    gap = 2 * (SEAL + unit.moulds.plinth_clearance_mm) + unit.moulds.least_wall_mm
    if spine > gap:
        return spine, f"between two units a spine of the circuit, as wide as a tail, takes {spine:.4g} mm"
    return gap, f"between two units the fins of the circuit's notches and a wall of the cups take {gap:.4g} mm"


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return the sheet's place: flush with the units' backs, over the notches of the circuit.

    Raises Refusal for units that have no cap, or no flexible circuit.
    """
    unit = units[0]
    if not design_of(unit).caps:
        fits = next(name for name, design in shipped().items() if design.caps)
        raise Refusal("unit.design", unit.design, "a back sheet is one piece with the caps of its units", fits)
    if unit.fpcb is None:
        raise Refusal("unit.fpcb", None, "the units of a back sheet share a flexible circuit, so they have one")
    top = dimensions(unit).heights[-1]
    return Level(top - thickness, top, top - slot_roof(unit) - unit.moulds.least_wall_mm)


def layers(array: Array) -> tuple[tuple[Shape, ...], ...]:
    """Draw the silicone of each pour: a layer of every unit at its place; the last with the sheet, in one piece."""
    spec, sheet = array.unit, array.sheet
    dims = dimensions(spec)
    whole = replace(dims, exit=None, sides=())
    of_unit = design_of(spec).layers(spec, whole)
    drawn = [of_unit[f"layer{i + 1}"] for i in range(len(spec.layers))]
    notches: list[list[Shape]] = [[] for _ in array.places]
    for fin in fins(array):
        notches[fin.place].append(fin.drawn(dims.outer_radius + BEYOND, 0.0, -BEYOND, dims.core_height))
    pours = [
        tuple(cut(moved(shape, place.x, place.y), own) for place, own in zip(array.places, notches, strict=True))
        for shape in drawn
    ]
    back: Shape = draw_sheet(sheet, sheet.low, sheet.high)
    if len(drawn) > 1 and sheet.low < dims.heights[-2]:
        inner = [moved(cylinder(dims.radii[-2], -BEYOND, dims.heights[-2]), p.x, p.y) for p in array.places]
        back = cut(back, inner)
    return (*pours[:-1], (union((back, *pours[-1])),))


def pour_bodies(pours: Sequence[tuple[Shape, ...]]) -> tuple[Body, ...]:
    """Return the silicone of some pours, a body each."""
    return tuple(
        Body(f"layer{i + 1}", "unit", "layer", union(shapes), layer_colour(i), made="cast", step=i + 1)
        for i, shapes in enumerate(pours)
    )


def plan(array: Array) -> Plan:
    """Return tools and pours. Raises Refusal for tools that are larger than the bed, and for a pour by injection."""
    if array.unit.moulds.pour == "injected":
        raise Refusal("moulds.pour", "injected", "a back sheet is struck off, its cups have no lids", "open")
    return replace(flat_plan(array, layers(array)), stretches=bent_stretches(array))


def seal_places(array: Array, pour: int) -> str:
    """Return the places at which the slits of the fins are sealed before the cup of a pour (from 1) is put on."""
    ridges = fins(array)
    if not ridges:
        return ""
    length = max(fin.reach for fin in ridges) - dimensions(array.unit).radii[pour - 1]
    layer = "" if pour == 1 else f" or on Layer {pour - 1}"
    return (
        "every fin, the ridge that runs out from a core: sides, top and end face of its outermost "
        f"{number(length, 3)} mm, none nearer the core{layer}"
    )


def assembly(array: Array) -> tuple[Fitting, ...]:
    """Write how the circuit is laid in, with all motors on it."""
    solder = (
        f"Solder the {len(array.places)} motors to the circuit's pads, their backs on it, and try each one. Lay the "
        "patch on its back, the cavities up."
    )
    lay_in = (
        f"{bond('each pad', 'the cap of Layer 1')} Lay the circuit in from the skin's side, motor by motor, its rows "
        "in the notches, and push each motor in until its pad touches that cap. The spine is free between the "
        "units."
    )
    return Fitting(solder, ("soldering iron and solder",)), Fitting(lay_in, (ADHESIVE,), place="in")


CONSTRUCTION = Construction(
    name="back-sheet",
    about="the units' outer layer and a sheet on their backs in one pour; the common circuit is laid in from the skin",
    mixed=False,
    own_tails=False,
    thickness_mm=1.25,
    apart=apart,
    level=level,
    bodies=lambda array: pour_bodies(layers(array)),
    plan=plan,
    assembly=assembly,
    greased=seal_places,
)

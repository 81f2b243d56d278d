"""The tools of a back sheet, drawn from lengths: base with cores, fins and pins, a cup for each pour.

    section of the last pour            struck off at the back
    .--_--.                                       .--_--.
    | cup |            sheet                      | cup |
    |  .--'---. L2 .---------. L2 .---..--.  L2   '--.  |
    |  | |    |    | Layer 1 |    | cup wall |       |  |
    |  |_|    '----'--core---'----'--fin-----'       |  |      seat, z = 0
    '--pin------------ base -----------------------------'

Once the last pour has cured, the filaments are pulled and the base is taken off downwards: the last cup can't be
lifted past the sheet. Then the patch is pushed up out of that cup.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from unitcad.arrays.array import Array
from unitcad.arrays.bending import bent_stretches
from unitcad.arrays.circuit.wiring import wiring
from unitcad.arrays.fins import Fin, fins
from unitcad.arrays.larger_than_bed import across, pieces, taken
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.designs import Dimensions, dimensions
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Cell, Layout
from unitcad.errors import Refusal
from unitcad.moulds import filament
from unitcad.moulds.base import PRY_UNDER, core, outline, plate_top, pry_slot
from unitcad.moulds.blade import blade
from unitcad.moulds.cup import groove_depth_of
from unitcad.moulds.dovetails import BESIDE, Interval, Split, cuts, seams, split
from unitcad.moulds.labels import corner_labels, engraved, row, row_width
from unitcad.moulds.layout import MARK, TEXT_MARGIN
from unitcad.moulds.pieces import base_piece, blade_piece, cup_piece, stub_pieces
from unitcad.moulds.pins import CHAMFER, PIN_RADIUS, Pins, pin_holes, standing_pins
from unitcad.moulds.plan import Plan, Step
from unitcad.moulds.removal import CAST, Removal
from unitcad.shape import Common, Extrude, Shape, Union, box, content_hash, cut, cylinder, moved, ring, union
from unitcad.shape.body import Body
from unitcad.shape.lettering import HEIGHT
from unitcad.spec import Spec

OFF_SQUARE = 4.0
"""How far one pin stands off the rectangle of the others, mm: a cup goes on in one attitude only."""
LABEL_MARGIN = 0.6
"""From a label to the edges of the strip that it stands on, mm."""
UP, DOWN = (0, 0, 1), (0, 0, -1)


@dataclass(frozen=True)
class Drawing:
    """What all tools of an array are drawn to; where the base and the cups are cut that are larger than the bed."""

    array: Array
    spec: Spec
    dims: Dimensions
    fins: tuple[Fin, ...]
    lay: Layout
    pins: Pins
    base_cuts: tuple[float, ...] = ()
    cup_cuts: tuple[float, ...] = ()


def core_top(spec: Spec) -> float:
    """Return the height of cores and fins over the skin, mm: motor and circuit lie under it."""
    return dimensions(spec).core_height


def slot_roof(spec: Spec) -> float:
    """Return the height of the slots that the cups have for the fins, mm."""
    return core_top(spec) + spec.moulds.plinth_clearance_mm


def tools_plan(array: Array, cast: Sequence[tuple[Shape, ...]]) -> Plan:
    """Return tools and pours of an array whose silicone is drawn as `cast`, pour by pour.

    Tools larger than the bed are cut. Raises Refusal where they can't be, and for lids.
    """
    if array.unit.moulds.pour == "injected":
        raise Refusal("moulds.pour", "injected", "a back sheet is struck off, its cups have no lids", "open")
    return replace(_flat_plan(_drawing(array), cast, last=True), stretches=bent_stretches(array))


def inner_tools(array: Array, cast: Sequence[tuple[Shape, ...]], label: str) -> Plan:
    """Return flat tools and pours of the inner layers alone, drawn as `cast`: they are taken out and laid in elsewhere.

    `label` is that of the whole set. Raises Refusal as `tools_plan`.
    """
    return _flat_plan(_drawing(array), cast, last=False, label=label)


def _flat_plan(drawing: Drawing, cast: Sequence[tuple[Shape, ...]], *, last: bool, label: str = "") -> Plan:
    """Return tools and pours of layers drawn as `cast`; `last`: the last of them is the sheet's."""
    spec, dims, lay = drawing.spec, drawing.dims, drawing.lay
    pours = range(1, len(cast) + 1)
    sheets = [last and pour == len(cast) for pour in pours]
    blanks = [_base(drawing), *(_cup(drawing, pour - 1, last=sheets[pour - 1]) for pour in pours)]
    label = label or content_hash(Union((*blanks, *(shape for shapes in cast for shape in shapes))))[:4].upper()
    base = base_piece(engraved(blanks[0], _base_letters(drawing, f"B{label}")))
    base = replace(base, removal=DOWN) if last else base
    cups = []
    for pour, blank in zip(pours, blanks[1:], strict=True):
        cup = cup_piece(pour, engraved(blank, _cup_letters(drawing, pour, label)))
        # The last cup is a tray for the sheet: printed as it stands, and the patch leaves it, not it the patch.
        cups.append(replace(cup, upside_down=False, removal=None) if sheets[pour - 1] else cup)
    stubs = stub_pieces([filament.stub(spec, dims, lay, cell, _bottom(spec)) for cell in lay.cells])
    steps = tuple(_step(drawing, cast, pour, base, cups[pour - 1], stubs, sheet=sheets[pour - 1]) for pour in pours)
    holes = [("base", len(stubs)), *((cup.name, len(lay.cells)) for cup in cups)]
    return Plan(
        (base, *cups, *stubs, blade_piece(blade(lay, dims.heights[len(cast) - 1]))),
        steps,
        lay,
        label,
        dims,
        concentric=False,
        pins=drawing.pins,
        genus=tuple(holes),
        splits=tuple(_splits(drawing, base, cups)),
    )


def _splits(drawing: Drawing, base: Body, cups: Sequence[Body]) -> Iterator[Split]:
    """Yield the tools that are larger than the bed, cut."""
    for tool, where in ((base, drawing.base_cuts), *((cup, drawing.cup_cuts) for cup in cups)):
        if where:
            yield split(tool, seams(where, across(drawing.array), drawing.pins.clearance))


def _base_letters(drawing: Drawing, label: str) -> list[Shape]:
    """Draw the base's label; on a base that is cut, on each piece with its number."""
    spec, lay = drawing.spec, drawing.lay
    stroke, y = spec.moulds.engraving_stroke_mm, (lay.cup[1] + lay.plate[1]) / 2 - lay.label_height / 2
    letters: list[Shape] = []
    for i, (low, high) in enumerate(pieces((-lay.plate[0], lay.plate[0]), drawing.base_cuts)):
        texts = [label, str(i + 1)][: 1 + bool(drawing.base_cuts)]
        letters += row(texts, stroke, ((low + high - row_width(texts, stroke)) / 2, y), _engraving(spec, 0.0))
    return letters


def _cup_letters(drawing: Drawing, pour: int, label: str) -> list[Shape]:
    """Draw a cup's letters in its corners; the pieces of one that is cut have its name and their number at the left."""
    spec, lay, rim = drawing.spec, drawing.lay, drawing.dims.heights[pour - 1]
    own, y = f"C{pour:X}", lay.cup[1] - TEXT_MARGIN - lay.label_height
    letters = corner_labels(spec, lay, rim, (own, label[:2], label[2:]))
    if not drawing.cup_cuts:
        return letters
    starts = [TEXT_MARGIN - lay.cup[0], *(low + BESIDE for low, _ in pieces((0, 0), drawing.cup_cuts)[1:])]
    heights = _engraving(spec, rim)
    rows = [row([own, str(i + 1)], spec.moulds.engraving_stroke_mm, (x, y), heights) for i, x in enumerate(starts)]
    return [*letters[1:], *(shape for shapes in rows for shape in shapes)]


def _engraving(spec: Spec, top: float) -> tuple[float, float]:
    return top - spec.moulds.engraving_depth_mm, top + BEYOND


def _step(
    drawing: Drawing,
    cast: Sequence[tuple[Shape, ...]],
    pour: int,
    base: Body,
    cup: Body,
    stubs: Sequence[Body],
    *,
    sheet: bool,
) -> Step:
    """Return a pour; the last of them casts the sheet, or its layers are taken out to be laid in elsewhere."""
    last, rim = pour == len(cast), drawing.dims.heights[pour - 1]
    pulled = [Removal(stub.name, DOWN) for stub in stubs] if last else []
    # The last cup can't be lifted past the sheet.
    first = Removal(base.name, DOWN) if sheet else Removal(cup.name, UP)
    order = [*pulled, first, *([Removal(CAST, UP)] if last else [])]
    return Step(
        index=pour,
        name=f"layer{pour}",
        material=drawing.array.sheet.material if sheet else drawing.spec.layers[pour - 1].material,
        tools=(base.name, cup.name, *(stub.name for stub in stubs)),
        layer=cast[pour - 1],
        earlier=tuple(shape for shapes in cast[: pour - 1] for shape in shapes),
        seals=tuple(_seals(drawing, pour - 1, last=sheet)),
        rim=rim,
        top=rim,
        removals=tuple(order),
    )


def _drawing(array: Array) -> Drawing:
    """Return what the tools are drawn to. Raises Refusal for plates larger than the bed that can't be cut."""
    spec, moulds = array.unit, array.unit.moulds
    dims = replace(dimensions(spec), exit=None, sides=())
    height = min(dims.heights[0] - moulds.least_wall_mm - 0.4, 3.0)
    height = math.floor(height / moulds.layer_mm + 1e-6) * moulds.layer_mm
    label = HEIGHT * moulds.engraving_stroke_mm
    hole = PIN_RADIUS + moulds.plinth_clearance_mm
    wall = max(2 * hole + 2 * moulds.least_wall_mm, label + 1.0 + moulds.least_wall_mm)
    box_, beside = array.sheet.outline, moulds.land_mm + moulds.groove_width_mm + wall
    cup = max(abs(box_[0]), box_[2]) + beside, max(abs(box_[1]), box_[3]) + beside
    plate = cup[0] + label + 2 * LABEL_MARGIN, cup[1] + label + 2 * LABEL_MARGIN
    if 2 * plate[1] > moulds.bed_y_mm + 1e-9:
        limit = f"the base of {2 * plate[0]:.4g} x {2 * plate[1]:.4g} mm exceeds the bed; tools are cut across x alone"
        raise Refusal("moulds.bed_y_mm", moulds.bed_y_mm, limit, math.ceil(20 * plate[1] - 1e-6) / 10)
    x, y = cup[0] / 2, cup[1] - wall / 2
    places = (-x, -y), (x, -y), (-x, y), (x - OFF_SQUARE, y)
    cells = tuple(Cell(place.x, place.y, (), place.name) for place in array.places)
    pitch = min(array.pitch_mm, 2 * cup[1])
    # No plinth, so no ribs on it.
    lay = Layout(cells, MARK, pitch, (0.0, 0.0), cup, plate, label)
    drawn = Drawing(
        array, spec, dims, fins(array, wiring(array)), lay, Pins(places, height, moulds.plinth_clearance_mm)
    )
    return _cut(drawn) if 2 * plate[0] > moulds.bed_x_mm + 1e-9 else drawn


def _cut(drawn: Drawing) -> Drawing:
    """Return the drawing with its cuts, and with as many pins that each piece of base and cups stands on two."""
    moulds, lay, array, (cup, y) = drawn.spec.moulds, drawn.lay, drawn.array, drawn.lay.cup
    across(array)
    bore = drawn.dims.outer_radius + moulds.land_mm + moulds.groove_width_mm
    reach = [max([bore, *(_slot(drawn, f) for f in drawn.fins if f.place == i)]) for i in range(len(array.places))]
    pin = drawn.pins.hole_radius + CHAMFER
    label = row_width(["C1", "1"], moulds.engraving_stroke_mm) + TEXT_MARGIN
    ends: list[Interval] = [(-lay.plate[0], -cup + max(PRY_UNDER, label)), (cup - max(PRY_UNDER, label), lay.plate[0])]
    there = list(taken(array, reach, [*ends, *((x - pin, x + pin) for x, _ in drawn.pins.places)]))
    plate = -lay.plate[0], lay.plate[0]
    base = cuts(plate, there, moulds.bed_x_mm, f"the base of {2 * lay.plate[0]:.4g} x {2 * lay.plate[1]:.4g} mm")
    cups = base if 2 * cup > moulds.bed_x_mm + 1e-9 else []
    if cups:
        cups = cuts((-cup, cup), there, moulds.bed_x_mm, f"a cup of {2 * cup:.4g} x {2 * y:.4g} mm", base)
    places = list(drawn.pins.places)
    for low, high in pieces((-cup, cup), sorted({*base, *cups})):
        if sum(low < x < high for x, _ in places) < 2:
            middle = min((place.x for place in array.places), key=lambda x: abs(x - (low + high) / 2))
            places += [(middle, side * drawn.pins.places[-1][1]) for side in (-1, 1)]
    return replace(drawn, pins=replace(drawn.pins, places=tuple(places)), base_cuts=tuple(base), cup_cuts=tuple(cups))


def _slot(drawn: Drawing, fin: Fin) -> float:
    """Return how far a fin and its slot reach along x from the unit's middle, mm."""
    clearance = drawn.spec.moulds.plinth_clearance_mm
    return fin.reach + clearance if fin.direction[0] else fin.half + clearance


def _bottom(spec: Spec) -> float:
    """Return z of the base's lower face: its plate has no plinth."""
    return -spec.moulds.plate_mm


def _base(drawing: Drawing) -> Shape:
    """Draw the base: plate, cores, fins and pins in one piece, with pry slots and the filaments' ways."""
    spec, dims, lay, array = drawing.spec, drawing.dims, drawing.lay, drawing.array
    plate = Extrude(outline(lay.plate, MARK), _bottom(spec), 0.0)
    cores = [moved(core(dims), cell.x, cell.y) for cell in lay.cells]
    ridges = [fin.drawn(array, fin.reach, 0.0, -BEYOND, dims.core_height) for fin in drawing.fins]
    ways = [filament.way(spec, dims, lay, cell, _bottom(spec)) for cell in lay.cells]
    # Drawn for a plate under a plinth.
    slots = [moved(pry_slot(spec, lay, side), z=-plate_top(spec)) for side in (1, -1)]
    return cut(union((plate, *cores, *ridges, *standing_pins(drawing.pins))), [*slots, *ways])


def _cup(drawing: Drawing, layer: int, *, last: bool) -> Shape:
    """Draw the cup of a pour (from 0); the last one holds the sheet."""
    spec, dims, lay, sheet = drawing.spec, drawing.dims, drawing.lay, drawing.array.sheet
    rim = dims.heights[layer]
    tools = [*_bores(drawing, layer, last=last), *_slots(drawing), *pin_holes(drawing.pins)]
    if last:
        land, depth = spec.moulds.land_mm, groove_depth_of(spec, rim)
        around = rounded(sheet.outline, sheet.corner_mm, land + spec.moulds.groove_width_mm)
        tools.append(Extrude(around, rim - depth, rim + BEYOND, (rounded(sheet.outline, sheet.corner_mm, land),)))
    else:
        tools += _grooves(drawing, layer)
    return cut(Extrude(outline(lay.cup, MARK), 0.0, rim), tools)


def _bores(drawing: Drawing, layer: int, *, last: bool) -> list[Shape]:
    """Draw what the silicone of a pour takes from its cup: a bore a unit, the sheet round the straps' posts."""
    dims, sheet = drawing.dims, drawing.array.sheet
    rim = dims.heights[layer]
    top = sheet.low + (rim - sheet.low) / 2 if last else rim + BEYOND
    shapes = [moved(cylinder(dims.radii[layer], -BEYOND, top), cell.x, cell.y) for cell in drawing.lay.cells]
    if last:
        posts = tuple(slot_profile(slot) for slot in sheet.strap_slots)
        shapes.append(Extrude(rounded(sheet.outline, sheet.corner_mm), sheet.low, rim + BEYOND, posts))
    return shapes


def _slots(drawing: Drawing) -> list[Shape]:
    """Draw the slots for the fins, open downwards."""
    spec = drawing.spec
    clearance = spec.moulds.plinth_clearance_mm
    return [
        fin.drawn(drawing.array, fin.reach + clearance, clearance, -BEYOND, slot_roof(spec)) for fin in drawing.fins
    ]


def _grooves(drawing: Drawing, layer: int) -> list[Shape]:
    """Draw a groove round each bore; it stops over a slot and beside another bore where the wall would be too thin."""
    spec, dims, cells = drawing.spec, drawing.dims, drawing.lay.cells
    moulds, rim = spec.moulds, dims.heights[layer]
    inner = dims.radii[layer] + moulds.land_mm
    outer, depth = inner + moulds.groove_width_mm, groove_depth_of(spec, rim)
    low, high = rim - depth, rim + BEYOND
    stops: list[list[Shape]] = [[] for _ in cells]
    for i, cell in enumerate(cells):
        for other in cells:
            if other is not cell and math.hypot(other.x - cell.x, other.y - cell.y) < outer + inner:
                stops[i].append(moved(cylinder(inner, low - BEYOND, high + BEYOND), other.x, other.y))
    for fin in drawing.fins if low - slot_roof(spec) < moulds.least_wall_mm else ():
        wider = moulds.plinth_clearance_mm + moulds.least_wall_mm
        over = fin.drawn(drawing.array, outer + BEYOND, wider, low - BEYOND, high + BEYOND)
        stops[fin.place].append(over)
    return [cut(moved(ring(inner, outer, low, high), c.x, c.y), stops[i]) for i, c in enumerate(cells)]


def _seals(drawing: Drawing, layer: int, *, last: bool) -> list[Shape]:
    """Draw what silicone is kept from though no tool fills it: grease round the fins, the ring round a filament."""
    spec, dims, lay, rim = drawing.spec, drawing.dims, drawing.lay, drawing.dims.heights[layer]
    x, y = lay.cup
    wall = cut(box(-x, x, -y, y, -BEYOND, rim), _bores(drawing, layer, last=last))
    ridges = [fin.drawn(drawing.array, fin.reach, 0.0, -2 * BEYOND, dims.core_height) for fin in drawing.fins]
    seals = [cut(Common((wall, union(_slots(drawing)))), ridges)] if drawing.fins else []
    return seals + [filament.annulus(spec, dims, cell) for cell in lay.cells]

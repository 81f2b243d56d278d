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
from dataclasses import replace

from unitcad.arrays.array import Array
from unitcad.arrays.back_sheet_drawing import LABEL_MARGIN, Drawing, drawing_of
from unitcad.arrays.bending import bent_stretches
from unitcad.arrays.larger_than_bed import longer_than_bed
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.arrays.piece_labels import Strip, on_pieces
from unitcad.designs import dimensions
from unitcad.designs.parts import BEYOND
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, nearer
from unitcad.moulds import filament
from unitcad.moulds.base import core, outline, plate_top, pry_slot
from unitcad.moulds.blade import blade
from unitcad.moulds.dovetails import Split, seen, split, strips
from unitcad.moulds.labels import corner_labels, engraved, set_label
from unitcad.moulds.layout import MARK, TEXT_MARGIN, groove_depth_of
from unitcad.moulds.pieces import base_piece, blade_piece, cup_piece, stub_pieces
from unitcad.moulds.pins import pin_holes, standing_pins
from unitcad.moulds.plan import Plan, Step
from unitcad.moulds.removal import CAST, Removal
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
    turned,
    union,
)
from unitcad.shape.body import Body
from unitcad.spec import Spec

UP, DOWN = (0, 0, 1), (0, 0, -1)


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
    return replace(_flat_plan(drawing_of(array), cast, last=True), stretches=bent_stretches(array))


def inner_tools(array: Array, cast: Sequence[tuple[Shape, ...]], label: str) -> Plan:
    """Return flat tools and pours of the inner layers alone, drawn as `cast`: they are taken out and laid in elsewhere.

    `label` is that of the whole set. Raises Refusal as `tools_plan`.
    """
    return _flat_plan(drawing_of(array), cast, last=False, label=label)


def _flat_plan(drawing: Drawing, cast: Sequence[tuple[Shape, ...]], *, last: bool, label: str = "") -> Plan:
    """Return tools and pours of layers drawn as `cast`; `last`: the last of them is the sheet's."""
    spec, dims, lay = drawing.spec, drawing.dims, drawing.lay
    pours = range(1, len(cast) + 1)
    sheets = [last and pour == len(cast) for pour in pours]
    blanks = [_base(drawing), *(_cup(drawing, pour - 1, last=sheets[pour - 1]) for pour in pours)]
    label = label or set_label((*blanks, *(shape for shapes in cast for shape in shapes)))
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
    bar = blade(lay, dims.heights[len(cast) - 1])
    return Plan(
        (base, *cups, *stubs, blade_piece(bar, too_long=longer_than_bed(spec, 2 * lay.plate[1]))),
        steps,
        lay,
        label,
        dims,
        concentric=False,
        pins=drawing.pins,
        pry_slots=tuple((slot.piece, slot.side, slot.middle) for slot in drawing.pry),
        genus=tuple(holes),
        splits=tuple(_splits(drawing, base, cups)),
    )


def _splits(drawing: Drawing, base: Body, cups: Sequence[Body]) -> Iterator[Split]:
    """Yield the tools that are larger than the bed, cut."""
    for tool, where in ((base, drawing.base_seams), *((cup, drawing.cup_seams) for cup in cups)):
        if where:
            yield split(tool, where)


def _base_letters(drawing: Drawing, label: str) -> list[Shape]:
    """Draw the base's label; on a base that is cut, on each piece with its number, or that alone."""
    spec, (x, y) = drawing.spec, drawing.lay.plate
    strip = Strip((-x, -y, x, y), LABEL_MARGIN, spec.moulds.engraving_stroke_mm, _engraving(spec, 0.0), "top")
    if all(slot.customary for slot in drawing.pry):
        return on_pieces(strip, [(label,)], drawing.base_seams)
    beside = strip._replace(taken=[slot.taken(drawing.lay) for slot in drawing.pry])
    return on_pieces(beside, [(label,), (label[0],), ()], drawing.base_seams)


def _cup_letters(drawing: Drawing, pour: int, label: str) -> list[Shape]:
    """Draw a cup's letters in its corners; the pieces of one that is cut have its name, the label and their number."""
    spec, lay, rim = drawing.spec, drawing.lay, drawing.dims.heights[pour - 1]
    own, (x, y), stroke = f"C{pour:X}", lay.cup, spec.moulds.engraving_stroke_mm
    if not drawing.cup_seams:
        return corner_labels(spec, lay, rim, (own, label[:2], label[2:]))
    hole = drawing.hole
    taken = [(x - MARK, y - MARK, x, y)]
    taken += [(at - hole, beside - hole, at + hole, beside + hole) for at, beside in drawing.pins.places]
    strip = Strip((-x, -y, x, y), TEXT_MARGIN, stroke, _engraving(spec, rim), "top", taken)
    return on_pieces(strip, [(own, label), (own,)], drawing.cup_seams)


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
    slots += [slot.drawn(lay) for slot in drawing.pry if not slot.customary]
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
    """Draw a groove round each bore; it stops at seams, over slots and beside its neighbours: walls would be thin."""
    spec, dims, cells = drawing.spec, drawing.dims, drawing.lay.cells
    moulds, rim = spec.moulds, dims.heights[layer]
    inner = dims.radii[layer] + moulds.land_mm
    outer, depth = inner + moulds.groove_width_mm, groove_depth_of(spec, rim)
    low, high = rim - depth, rim + BEYOND
    stops: list[list[Shape]] = [[] for _ in cells]
    for i, cell in enumerate(cells):
        for other in cells:
            apart = math.hypot(other.x - cell.x, other.y - cell.y)
            if other is not cell and apart < outer + inner:
                stops[i].append(moved(cylinder(inner, low - BEYOND, high + BEYOND), other.x, other.y))
            if other is not cell and apart < 2 * outer + moulds.least_wall_mm:
                between = _halfway((cell.x, cell.y), (other.x, other.y), outer, moulds.least_wall_mm)
                stops[i].append(Extrude(between, low - BEYOND, high + BEYOND))
    for fin in drawing.fins if low - slot_roof(spec) < moulds.least_wall_mm else ():
        wider = moulds.plinth_clearance_mm + moulds.least_wall_mm
        over = fin.drawn(drawing.array, outer + BEYOND, wider, low - BEYOND, high + BEYOND)
        stops[fin.place].append(over)
    for seam in drawing.cup_seams:
        for strip in strips(seam, moulds.least_wall_mm + seam.play / 2):
            over = Extrude(polygon(*strip), low - BEYOND, high + BEYOND)
            for i, cell in enumerate(cells):
                if nearer([seen((cell.x, cell.y), seam.across)], strip, outer):
                    stops[i].append(over if seam.across == "x" else turned(over, "z", 1))
    return [cut(moved(ring(inner, outer, low, high), c.x, c.y), stops[i]) for i, c in enumerate(cells)]


def _halfway(a: Point, b: Point, half: float, width: float) -> Profile:
    """Return a strip across the middle of the way from a to b, `half` long to either side of it, mm."""
    apart = math.dist(a, b)
    way = (b[0] - a[0]) / apart, (b[1] - a[1]) / apart
    at = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    sides = [(along * width / 2, across * half) for along, across in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return polygon(*((at[0] + u * way[0] - v * way[1], at[1] + u * way[1] + v * way[0]) for u, v in sides))


def _seals(drawing: Drawing, layer: int, *, last: bool) -> list[Shape]:
    """Draw what silicone is kept from though no tool fills it: grease round the fins, the ring round a filament."""
    spec, dims, lay, rim = drawing.spec, drawing.dims, drawing.lay, drawing.dims.heights[layer]
    x, y = lay.cup
    wall = cut(box(-x, x, -y, y, -BEYOND, rim), _bores(drawing, layer, last=last))
    ridges = [fin.drawn(drawing.array, fin.reach, 0.0, -2 * BEYOND, dims.core_height) for fin in drawing.fins]
    seals = [cut(Common((wall, union(_slots(drawing)))), ridges)] if drawing.fins else []
    return seals + [filament.annulus(spec, dims, cell) for cell in lay.cells]

"""Arrays that are cast round a limb: the construction, its limits, tools and their release."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

from unitcad.arrays.array import Array
from unitcad.arrays.constructions import Level, back_sheet
from unitcad.arrays.constructions.back_sheet import OFF_SQUARE, UP, fins
from unitcad.arrays.sheet import angle_deg, axis, barrel, bent, bent_stretches, inside_of_end, slice_of, strap_slot
from unitcad.catalogue import printers
from unitcad.designs import Dimensions, design_of, dimensions
from unitcad.designs.design import BEYOND, Fitting
from unitcad.errors import Refusal
from unitcad.moulds.base import core
from unitcad.moulds.cup import PIN_RADIUS, Pins, pin_holes, standing_pins
from unitcad.moulds.lid import MESH_ROOM, THICKNESS, TILT_DEG, VENT, deepest
from unitcad.moulds.pieces import CAST, Removal, base_piece, engrave, filament_pieces, lid_piece, set_label
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import (
    Common,
    Revolve,
    Shape,
    box,
    cut,
    cylinder,
    mm,
    moved,
    polygon,
    turned,
    union,
)
from unitcad.shape.lettering import HEIGHT, engraving, text_width
from unitcad.spec import Spec, printer_of
from unitcad.spec.layers import layers_of

MOST_DEG = 75.0
"""Of the sheet's ends from the top, at most (assumed): beyond it lid and base slide on each other as they close."""


def _objections(array: Array) -> Iterator[str]:
    """Yield the objections to a limb: so large that a tilt brings the highest line off the vents, or too small."""
    sheet, radius = array.sheet, array.radius_mm or 0.0
    low, high, _ = level((array.unit,), sheet.thickness_mm, radius)
    middle = radius + (low + high) / 2
    nearer, farther = (math.degrees(end / middle) for end in sorted((-sheet.outline[0], sheet.outline[2])))
    if nearer < TILT_DEG:
        yield (
            f"the sheet reaches {nearer:.3g} degrees from the top, and a mould tilted by {TILT_DEG:g} degrees keeps "
            "air at its ends; cast it flat and bend it"
        )
    steepest = float(printer_of(array.unit).overhang_deg)
    places = [place.x for place in array.places] + [(slot[0] + slot[2]) / 2 for slot in sheet.strap_slots]
    tilt = math.degrees(max(map(abs, places)) / middle)
    if tilt > steepest + 1e-9:
        yield f"the outermost unit or slot is tilted by {tilt:.3g} degrees; from {steepest:g} on it needs support"
    if farther > MOST_DEG + 1e-9:
        yield f"the sheet reaches {farther:.3g} degrees from the top; lid and base close up to {MOST_DEG:g}"
    apart, _ = back_sheet.apart(array.unit)
    for one, other in combinations(array.places, 2):
        outer, turn = one.radius + other.radius, abs(other.x - one.x) / middle / 2
        if turn >= math.pi / 2 or abs(other.y - one.y) > outer + apart:
            continue
        across, along = 2 * radius * math.sin(turn), other.y - one.y
        distance = math.hypot(across, along)
        # Seen along the axis between the two, each unit's foot is an ellipse.
        gap = distance - outer * math.hypot(math.cos(turn) * across, along) / distance
        if gap < apart - 2 / 1024:
            there = f"{gap:.3g}" if gap < apart - 0.05 else f"{gap:.5g}"
            yield f"at the skin {one.name} and {other.name} are {there} mm apart and need {apart:.4g} mm"


BESIDE = 1 / 4
"""How far the space about a unit reaches beyond it, mm."""


def parts_out(array: Array) -> Iterator[Removal]:
    """Yield the removals of the silicone: each unit along its axis, then the sheet in slices about the limb.

    A slice is that part of the sheet that is nearest to a column of units, or to a strap slot.
    """
    sheet = array.sheet
    outer = dimensions(array.unit).outer_radius + BESIDE
    for place in array.places:
        about = bent(array, cylinder(outer, -1.0, sheet.high + outer), place.x, place.y)
        yield Removal(CAST, axis(array, place.x), f"at {place.name}", about)
    middles = sorted({place.x for place in array.places} | {(slot[0] + slot[2]) / 2 for slot in sheet.strap_slots})
    between = [(a + b) / 2 for a, b in pairwise(middles)]
    bounds = [2 * sheet.outline[0] - middles[0], *between, 2 * sheet.outline[2] - middles[-1]]
    for i, (x, ends) in enumerate(zip(middles, pairwise(bounds), strict=True)):
        # The last one gets the remainder of rounding.
        space = slice_of(array, *ends) if i + 1 < len(middles) else None
        yield Removal(CAST, axis(array, x), f"between the units, {x:+.4g} mm round", space)


LAND = 4.0
"""Width of the face on which base and lid bear next to the sheet, mm."""
PIN_HEIGHT = 3.0
VENT_OFF_END = 1 / 8
"""From a vent to the sheet's end along the limb, mm."""
INTO = 0.25
"""How far sprue and vents are drawn into the sheet, mm."""
GRIP_RADIUS = 4.0
"""Of the pocket under a filament, in which pliers take it, mm."""
JOINT = 1 / 8
"""How far a seal reaches into the base, and stays off the cavity, mm."""


@dataclass(frozen=True)
class Former:
    """Dimensions of base and lid, mm: half sizes, the seat next to the barrel, the base's lower face, pins on it."""

    array: Array
    dims: Dimensions
    half: tuple[float, float]
    seat: float
    bottom: float
    pins: Pins

    @property
    def back(self) -> float:
        """Radius of the sheet's back."""
        return self.array.back_radius_mm

    @property
    def top(self) -> float:
        """Z of the lid's upper face."""
        return self.array.sheet.high + THICKNESS


def plan(array: Array) -> Plan:
    """Return tools and pours: inner layers that are cast flat and laid in, and the last pour under a lid.

    Raises Refusal for tools that are larger than the bed, and for a limb too small.
    """
    if why := next(_objections(array), ""):
        raise Refusal("limb.radius_mm", array.radius_mm, why)
    former, flat, (*laid, (poured,)) = _former(array), back_sheet.layers(array)[:-1], layers(array)
    pour = len(flat) + 1
    base, lid = _base(former), _lid(former)
    label = set_label((base, lid, poured, *(shape for shapes in flat for shape in shapes)))
    base = base_piece(engrave(base, _letters(former, f"B{pour:X}{label}", former.seat)))
    lid = lid_piece(pour, engrave(lid, _letters(former, f"L{pour:X}{label}", former.top)))
    ways = [(-x, -y, -z) for x, y, z in (axis(array, place.x) for place in array.places)]
    filaments = [
        replace(piece, removal=way) for piece, way in zip(filament_pieces(_filaments(former)), ways, strict=True)
    ]
    # The flat tools have the plain names.
    base = replace(base, name=f"base{pour}", step=pour)
    filaments = [replace(piece, name=f"{piece.name}-{pour}", step=pour) for piece in filaments]
    channels = tuple(_channels(former, array.sheet.high - INTO, former.top))
    step = Step(
        index=pour,
        name=f"layer{pour}",
        material=array.sheet.material,
        tools=(base.name, lid.name, *(piece.name for piece in filaments)),
        layer=(poured,),
        earlier=tuple(shape for shapes in laid for shape in shapes),
        seals=tuple(_seals(former)),
        rim=array.sheet.high,
        top=former.top,
        channels=channels,
        groove=False,
        pins=former.pins,
        removals=(
            Removal(lid.name, UP),
            *(Removal(piece.name, way) for piece, way in zip(filaments, ways, strict=True)),
            *parts_out(array),
        ),
    )
    holes = ((base.name, len(filaments)), (lid.name, len(channels)))
    inner = back_sheet.flat_plan(array, flat, label)
    return replace(
        inner,
        tools=(*(tool for tool in inner.tools if tool.kind != "blade"), base, lid, *filaments, *inner.of_kind("blade")),
        steps=(*inner.steps, step),
        genus=(*inner.genus, *holes),
        stretches=bent_stretches(array),
    )


def _former(array: Array) -> Former:
    """Return the dimensions of base and lid. Raises Refusal for plates beyond the bed."""
    spec, moulds, sheet = array.unit, array.unit.moulds, array.sheet
    dims, radius = replace(dimensions(spec), exit=None, sides=()), array.radius_mm or 0.0
    back = array.back_radius_mm
    x0, y0, x1, y1 = sheet.outline
    end = math.radians(angle_deg(array, max(-x0, x1))) + LAND / back
    seat = mm(math.floor((back * math.cos(end) - radius) / moulds.layer_mm) * moulds.layer_mm)
    hole = PIN_RADIUS + moulds.plinth_clearance_mm
    beside = 2 * hole + 2 * moulds.least_wall_mm
    edge = math.sqrt(back**2 - (radius + seat) ** 2)
    # The label is between the pins at one end.
    label = text_width("B2F055", moulds.engraving_stroke_mm) / 2 + 1.0 + beside
    half = mm(edge + beside), mm(max(max(-y0, y1) + LAND, label))
    turns = [math.radians(abs(angle_deg(array, place.x))) for place in array.places]
    moats = (radius * math.cos(turn) - dims.outer_radius * math.sin(turn) - radius for turn in turns)
    lowest = min(seat - moulds.plate_mm, *moats)
    under = max(moulds.plate_mm, GRIP_RADIUS + moulds.least_wall_mm)
    bottom = mm(seat - layers_of(spec).up(seat - lowest + under))
    x, y = edge + beside / 2, half[1] - hole - 2 * moulds.least_wall_mm
    places = (-x, -y), (x, -y), (-x, y), (x, y - OFF_SQUARE)
    size, height = f"the base of {2 * half[0]:.4g} x {2 * half[1]:.4g} mm", mm(sheet.high + THICKNESS - bottom)
    for field, needed, part in (
        ("bed_x_mm", 2 * half[0], size),
        ("bed_y_mm", 2 * half[1], size),
        ("bed_z_mm", height, f"the mould, {height:.4g} mm high,"),
    ):
        if needed > getattr(moulds, field) + 1e-9:
            limit = f"{part} exceeds the bed; curved tools are not cut"
            if field == "bed_y_mm" and (fewer := _rows_that_fit(array, needed)):
                raise Refusal("layout.rows", array.layout["rows"], limit, fewer)
            raise Refusal(f"moulds.{field}", getattr(moulds, field), limit, math.ceil(needed * 10 - 1e-6) / 10)
    return Former(array, dims, half, seat, bottom, Pins(places, PIN_HEIGHT, moulds.plinth_clearance_mm, seat))


def _rows_that_fit(array: Array, length: float) -> int:
    """Return how many rows of a grid fit the printer's own bed along the limb, which the tools exceed by a `length`.

    0 if none do, for other layouts, and if the file itself asks for a smaller bed.
    """
    bed = array.unit.moulds.bed_y_mm
    own = float(printers(array.unit.printers)[array.unit.moulds.printer].bed_y_mm)
    rows = sorted({place.y for place in array.places})
    if array.layout["kind"] != "grid" or len(rows) < 2 or bed < own:
        return 0
    return max(0, len(rows) - math.ceil((length - bed) / (rows[1] - rows[0]) - 1e-6))


def _base(former: Former) -> Shape:
    """Draw the base: a block up to the seat and the barrel over it, less the sheet, the moats and filaments' ways."""
    (x, y), seat, bottom = former.half, former.seat, former.bottom
    over = Common((barrel(former.array, former.back), box(-x, x, -y, y, bottom + BEYOND, former.top)))
    block = union((box(-x, x, -y, y, bottom, seat), over, *standing_pins(former.pins)))
    return cut(block, [_between_ends(former.array, 2 * BEYOND), *_moats(former), *_filament_ways(former)])


def _between_ends(array: Array, beyond: float, *within: Shape) -> Shape:
    """Draw the sheet's space over its front and `within` others; posts of strap slots are longer by `beyond`, mm."""
    sheet = array.sheet
    slots = [strap_slot(array, slot, beyond) for slot in sheet.strap_slots]
    room = Common((*within, inside_of_end(array, left=True), inside_of_end(array, left=False)))
    return cut(room, [barrel(array, (array.radius_mm or 0.0) + sheet.low), *slots])


def _moats(former: Former) -> list[Shape]:
    """Draw the units' space in the base: open upwards, round core and fins."""
    array, dims = former.array, former.dims
    drawn = []
    for place, ridges in zip(array.places, _notches(array, 2 * BEYOND), strict=True):
        moat = cut(cylinder(dims.outer_radius, 0.0, array.sheet.high + 2 * BEYOND), [core(dims), *ridges])
        drawn.append(bent(array, moat, place.x, place.y))
    return drawn


def _filament_ways(former: Former) -> list[Shape]:
    """Draw a hole through each core along its axis, and the pocket under the base in which its filament is taken."""
    array, radius, bottom = former.array, former.array.unit.moulds.filament_hole_mm / 2, former.bottom
    drawn: list[Shape] = []
    cone = Revolve(polygon((0, -BEYOND), (GRIP_RADIUS + BEYOND, -BEYOND), (0, GRIP_RADIUS)))
    for place in array.places:
        drawn.append(bent(array, cylinder(radius, -_far(former), former.dims.core_height + BEYOND), place.x, place.y))
        turn = math.radians(angle_deg(array, place.x))
        across = ((array.radius_mm or 0.0) + bottom) * math.tan(turn)
        drawn.append(moved(cone, across, place.y, bottom))
    return drawn


def _filaments(former: Former) -> list[Shape]:
    """Draw the filaments: flush with the core's top, their lower ends on the bench."""
    array, radius = former.array, former.array.unit.moulds.filament_mm / 2
    (x, y), bottom = former.half, former.bottom
    room = box(-2 * x, 2 * x, -2 * y, 2 * y, bottom, former.top)
    return [
        Common((bent(array, cylinder(radius, -_far(former), former.dims.core_height), place.x, place.y), room))
        for place in array.places
    ]


def _far(former: Former) -> float:
    """Return how far under the skin a line along any unit's axis has left the base, mm."""
    return 2 * (former.array.sheet.high - former.bottom)


def _channels(former: Former, low: float, top: float) -> list[Shape]:
    """Draw the sprue on top, and two vents at either end of the sheet along the limb."""
    vent, places = VENT / 2, _vents(former)
    sheet = former.array.sheet
    middle = (sheet.outline[1] + sheet.outline[3]) / 2
    sprue = moved(cylinder(former.array.unit.moulds.sprue_mm / 2, low, top), 0.0, middle)
    drawn = [sprue]
    for x in places:
        along = (sheet.outline[3] - sheet.outline[1]) / 2 - _vent_off_end(former, x) - vent
        # A vent off the top begins lower, as the sheet's back does.
        back = math.sqrt(former.back**2 - (abs(x) + vent) ** 2) - (former.array.radius_mm or 0.0)
        drawn += [moved(cylinder(vent, min(low, back - INTO), top), x, middle + side * along) for side in (-1, 1)]
    return drawn


def _vent_off_end(former: Former, x: float) -> float:
    """Return the distance of a vent's edge from the sheet's end, along the limb, at a place across its top, mm."""
    sheet, back, edge = former.array.sheet, former.back, abs(x) + VENT / 2
    # Round corners make the sheet shorter there.
    r, end = sheet.corner_mm, math.radians(angle_deg(former.array, min(-sheet.outline[0], sheet.outline[2])))
    beside = r - back * math.sin(end - math.asin(edge / back))
    return (r - math.sqrt(r**2 - beside**2) if beside > 0 else 0.0) + VENT_OFF_END


def _vents(former: Former) -> list[float]:
    """Return the places of vents across the top, mm: one is near the highest line of any tilt."""
    count, places = 2, _spread(former, 2)
    limit = MESH_ROOM * deepest(former.array.unit, len(former.array.unit.layers) - 1)
    # An odd number of vents puts one in the middle, if none is nearer to the end.
    at_end = max(limit, _kept_at_end(former, [0.0]))
    # Between two vents air stays up to halfway, tilted round the limb.
    while former.back * (1 - math.cos(math.radians(TILT_DEG / count))) > limit or _kept_at_end(former, places) > at_end:
        count += 1
        places = _spread(former, count)
    return places


def _spread(former: Former, count: int) -> list[float]:
    """Return places across the top at equal angles from each other, within the tilt to either side, mm."""
    step = 2 * TILT_DEG / count
    return [former.back * math.sin(math.radians(step * (k + 0.5) - TILT_DEG)) for k in range(count)]


def _kept_at_end(former: Former, places: list[float]) -> float:
    """Return the depth of the air at an end that a tilt raises, mm: round corners keep outer vents away from it."""
    tilt = math.radians(TILT_DEG)

    def depth(x: float) -> float:
        below = former.back - math.sqrt(former.back**2 - x**2)
        return below * math.cos(tilt) + _vent_off_end(former, x) * math.sin(tilt)

    return min(map(depth, places))


def _lid(former: Former) -> Shape:
    """Draw the lid: a block bored to the sheet's back, a relief over the seat, holes for the pins."""
    (x, y), array = former.half, former.array
    under = former.seat + former.array.unit.moulds.seat_relief_mm
    holes = pin_holes(former.pins)
    ways = _channels(former, array.sheet.high - 2 * BEYOND, former.top + BEYOND)
    return cut(box(-x, x, -y, y, under, former.top), [barrel(array, former.back), *holes, *ways])


def _seals(former: Former) -> list[Shape]:
    """Draw seals at joints that meet only up to rounding: under and in the inserted layers, and lid on base."""
    array, dims, (x, y) = former.array, former.dims, former.half
    laid = cylinder(dims.radii[-2] - JOINT, -JOINT, dims.heights[-2] - JOINT)
    x0, y0, x1, y1 = array.sheet.outline
    joint = cut(barrel(array, former.back + JOINT), [barrel(array, former.back - JOINT)])
    land = Common((joint, box(-x, x, -y, y, former.seat, former.top)))
    beside = [box(-x, x, low, high, former.seat, former.top) for low, high in ((-y, y0 - JOINT), (y1 + JOINT, y))]
    lands = Common((land, union(beside))), cut(land, [slice_of(array, x0 - JOINT, x1 + JOINT)])
    return [*(bent(array, laid, place.x, place.y) for place in array.places), *lands]


def _letters(former: Former, label: str, top: float) -> list[Shape]:
    """Draw a label that reads along the limb on a face, its foot towards +x."""
    stroke, depth = former.array.unit.moulds.engraving_stroke_mm, former.array.unit.moulds.engraving_depth_mm
    drawn = turned(engraving(label, stroke, top - depth, top + BEYOND), "z", 1)
    return [moved(drawn, -former.half[0] + 1.0 + HEIGHT * stroke, -text_width(label, stroke) / 2)]


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return the sheet's place on a limb of a radius: its back is as high as the cap over Layer 1's edge needs.

    Raises Refusal as `back_sheet.level`.
    """
    flat = back_sheet.level(units, thickness, None)
    spec, limb = units[0], radius or 0.0
    dims = dimensions(spec)
    if len(spec.layers) < 2:
        limit = "in a curved mould the inner layers are laid in; units of one layer are cast flat and bent"
        raise Refusal("limb.cast", "curved", limit, "flat")
    top = math.hypot(limb + flat.high, dims.radii[-2]) - limb
    # Next to its unit a notch stays under the sheet.
    roof = math.hypot(limb + dims.core_height, dims.outer_radius + BEYOND) - limb
    return Level(top - thickness, top, top - roof)


def layers(array: Array) -> tuple[tuple[Shape, ...], ...]:
    """Draw the silicone of each pour as it is worn: the inner layers, a solid a unit, then all that is poured last."""
    spec, notches = array.unit, _notches(array, BEYOND)
    drawn = design_of(spec).layers(spec, replace(dimensions(spec), exit=None, sides=()))
    inner = (
        tuple(
            bent(array, cut(drawn[f"layer{i + 1}"], own), place.x, place.y)
            for place, own in zip(array.places, notches, strict=True)
        )
        for i in range(len(spec.layers) - 1)
    )
    return (*inner, (_poured(array, notches),))


def _notches(array: Array, beyond: float) -> list[list[Shape]]:
    """Draw the notches of the circuit at each place, about the z axis, `beyond` unit and skin by so much (mm)."""
    dims = dimensions(array.unit)
    found: list[list[Shape]] = [[] for _ in array.places]
    for fin in fins(array):
        found[fin.place].append(
            fin._replace(x=0.0, y=0.0).drawn(dims.outer_radius + beyond, 0.0, -beyond, dims.core_height)
        )
    return found


def _poured(array: Array, notches: Sequence[Sequence[Shape]]) -> Shape:
    """Draw the outermost layers and the sheet, in one piece."""
    sheet, spec, radius = array.sheet, array.unit, array.radius_mm or 0.0
    dims = dimensions(spec)
    inner, height, outer = dims.radii[-2], dims.heights[-2], dims.outer_radius
    back = _between_ends(array, BEYOND, barrel(array, array.back_radius_mm))
    rounds = [bent(array, cylinder(outer, 0.0, sheet.high + BEYOND), p.x, p.y) for p in array.places]
    rounds = Common((barrel(array, radius + (sheet.low + sheet.high) / 2), union(rounds)))
    hollow: list[Shape] = []
    for place, notched in zip(array.places, notches, strict=True):
        hollow.append(bent(array, cylinder(inner, -BEYOND, height), place.x, place.y))
        hollow += [bent(array, notch, place.x, place.y) for notch in notched]
    return cut(union((back, rounds)), hollow)


def assembly(array: Array) -> tuple[Fitting, ...]:
    """Write how the flat circuit is laid into the sleeve."""
    solder, lay_in = back_sheet.assembly(array)
    flat = (
        "Tape the sleeve's ends down flat until the adhesive is cured: the circuit is as long as the sheet laid flat."
    )
    return replace(solder, text=f"{solder.text} {flat}"), lay_in


CONSTRUCTION = replace(
    back_sheet.CONSTRUCTION,
    cast="curved",
    about="a back sheet cast round the limb: Layer 1 is cast flat and laid in, the rest is injected under a lid",
    level=level,
    bodies=lambda array: back_sheet.pour_bodies(layers(array)),
    plan=plan,
    assembly=assembly,
)

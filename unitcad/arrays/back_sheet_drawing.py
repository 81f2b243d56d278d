"""What the tools of a back sheet are drawn to: plates, fins, pins, and the seams of tools larger than the bed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.wiring import wiring
from unitcad.arrays.fins import Fin, fins
from unitcad.arrays.larger_than_bed import box_feature, intervals, of_sheet, round_units, sized
from unitcad.arrays.pry_slots import STEP, PrySlot, Side, pry_slots
from unitcad.arrays.seam_weep import sheet_mm2, too_much
from unitcad.designs import Dimensions, dimensions
from unitcad.designs.tooling import Cell, Layout
from unitcad.errors import Refusal
from unitcad.moulds import filament
from unitcad.moulds.base import PRY_HALF_WIDTH, PRY_UNDER
from unitcad.moulds.cuts import Feature, seams
from unitcad.moulds.dovetails import Seam
from unitcad.moulds.labels import row_width
from unitcad.moulds.layout import MARK, TEXT_MARGIN
from unitcad.moulds.pins import CHAMFER, PIN_RADIUS, Pins
from unitcad.shape.lettering import HEIGHT
from unitcad.spec import Spec

OFF_SQUARE = 4.0
"""How far one pin stands off the rectangle of the others, mm: a cup goes on in one attitude only."""
LABEL_MARGIN = 0.6
"""From a label to the edges of the strip that it stands on, mm."""


@dataclass(frozen=True)
class Drawing:
    """What all tools of an array are drawn to; where the base and the cups are cut that are larger than the bed."""

    array: Array
    spec: Spec
    dims: Dimensions
    fins: tuple[Fin, ...]
    lay: Layout
    pins: Pins
    base_seams: tuple[Seam, ...] = ()
    cup_seams: tuple[Seam, ...] = ()
    pry: tuple[PrySlot, ...] = ()

    @property
    def hole(self) -> float:
        """Radius that a pin's hole takes, its mouth included, mm."""
        return self.pins.hole_radius + CHAMFER


def drawing_of(array: Array) -> Drawing:
    """Return what the tools are drawn to. Raises Refusal for tools larger than the bed that can't be cut."""
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
    x, y = cup[0] / 2, cup[1] - wall / 2
    places = (-x, -y), (x, -y), (-x, y), (x - OFF_SQUARE, y)
    cells = tuple(Cell(place.x, place.y, (), place.name) for place in array.places)
    pitch = min(array.pitch_mm, 2 * cup[1])
    # No plinth, so no ribs on it.
    lay = Layout(cells, MARK, pitch, (0.0, 0.0), cup, plate, label)
    drawn = Drawing(
        array, spec, dims, fins(array, wiring(array)), lay, Pins(places, height, moulds.plinth_clearance_mm)
    )
    return _cut(drawn)


def _cut(drawn: Drawing) -> Drawing:
    """Return the drawing with its seams, and with as many pins that the pieces of base and cups stand on two."""
    moulds, array, (x, y), plate = drawn.spec.moulds, drawn.array, drawn.lay.cup, drawn.lay.plate
    kept = [*of_sheet(array), *_beside(drawn)]
    slots = [_slot(drawn, fin) for fin in drawn.fins]
    bore = drawn.dims.outer_radius
    grooved = round_units(array, [bore + moulds.land_mm + moulds.groove_width_mm] * len(array.places))
    clear, close = [*grooved, *slots, *kept], [*round_units(array, [bore] * len(array.places)), *slots, *kept]
    what = f"the base of {2 * plate[0]:.4g} x {2 * plate[1]:.4g} mm"
    play = moulds.plinth_clearance_mm
    dims, sheet = drawn.dims, array.sheet
    inner = [dims.cavity_radius, *dims.radii][-2]
    moats = len(array.places) * math.pi * (dims.radii[-1] ** 2 - inner**2) * sheet.low
    layer_mm3 = sheet_mm2(array) * sheet.thickness_mm + moats
    fault = too_much(array, (-x, -y, x, y), (sheet.low, dims.heights[-1]), layer_mm3)

    def levers(found: Sequence[Seam]) -> tuple[tuple[PrySlot, ...], str]:
        return pry_slots(drawn.spec, drawn.lay, found, drawn.pins.places, drawn.hole)

    under = [box_feature(*filament.groove(drawn.spec, drawn.lay, cell)) for cell in drawn.lay.cells]
    bases = sized(array, (-plate[0], -plate[1], *plate), clear, close, under)
    try:
        base = seams(bases, what, play, fault=lambda found: levers(found)[1])
    except Refusal:
        # The bed that would do must do for the cups too.
        base = seams(bases, what, play, fault=lambda found: levers(found)[1] or fault(found))
    what = f"a cup of {2 * x:.4g} x {2 * y:.4g} mm"
    cups = seams(sized(array, (-x, -y, x, y), clear, close), what, play, base, fault)
    cut_at = replace(drawn, base_seams=base, cup_seams=cups, pry=levers(base)[0])
    return replace(cut_at, pins=replace(drawn.pins, places=(*drawn.pins.places, *_more_pins(cut_at))))


def _beside(drawn: Drawing) -> list[Feature]:
    """Return what stands beside the sheet: pins, the corners with their labels, pry slots."""
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


def _more_pins(drawn: Drawing) -> tuple[tuple[float, float], ...]:
    """Return pins for the pieces of base and cups that stand on fewer than two: on the sides that they have."""
    (x, y), units, cut_at = drawn.lay.cup, drawn.array.places, (*drawn.base_seams, *drawn.cup_seams)
    out_y = drawn.pins.places[-1][1]
    out_x = x - (y - out_y)
    standing = list(drawn.pins.places)
    for low_y, high_y in intervals((-y, y), cut_at, "y"):
        for low_x, high_x in intervals((-x, x), cut_at, "x"):
            if sum(low_x < at < high_x and low_y < up < high_y for at, up in standing) < 2:
                ends = [side * out_y for side in (-1, 1) if low_y < side * out_y < high_y]
                sides = [side * out_x for side in (-1, 1) if low_x < side * out_x < high_x]
                each = 2 if len(ends) + len(sides) == 1 else 1
                across, along = (low_x, high_x), (low_y, high_y)
                new = [
                    (at, end)
                    for end in ends
                    for at in _beside_slots(drawn, "back" if end > 0 else "front", [p.x for p in units], across, each)
                ]
                new += [
                    (side, at)
                    for side in sides
                    for at in _beside_slots(drawn, "right" if side > 0 else "left", [p.y for p in units], along, each)
                ]
                standing += [at for at in new if all(math.dist(at, pin) > 4 * PIN_RADIUS for pin in standing)]
    return tuple(standing[len(drawn.pins.places) :])


def _beside_slots(
    drawn: Drawing, side: Side, middles: Sequence[float], within: tuple[float, float], count: int
) -> list[float]:
    """Return where pins stand on a side, as `_spots`, clear of its pry slots: at units' middles, else anywhere."""
    by = PRY_HALF_WIDTH + drawn.hole + drawn.spec.moulds.least_wall_mm
    slots = [slot.middle for slot in drawn.pry if slot.side == side]
    steps = (within[0] + STEP * i for i in range(math.ceil((within[1] - within[0]) / STEP)))
    for tried in (middles, (*steps, *(at + sign * by for at in slots for sign in (-1, 1)))):
        found = _spots([at for at in tried if all(abs(at - slot) >= by - 1e-9 for slot in slots)], within, count)
        if found:
            return found
    return []


def _spots(middles: Sequence[float], within: tuple[float, float], count: int) -> list[float]:
    """Return as many units' middles as asked for, the nearest to places spread evenly within an interval."""
    low, high = within[0] + 2 * PIN_RADIUS, within[1] - 2 * PIN_RADIUS
    inside = [middle for middle in middles if low < middle < high]
    wanted = [low + (high - low) * (2 * k + 1) / (2 * count) for k in range(count)]
    return sorted({min(inside, key=lambda middle, at=at: abs(middle - at)) for at in wanted}) if inside else []


def _slot(drawn: Drawing, fin: Fin) -> Feature:
    """Return what a fin's slot takes."""
    clearance = drawn.spec.moulds.plinth_clearance_mm
    return box_feature(*fin.taken(drawn.array, fin.reach + clearance, clearance))

"""Arrays of units in the pockets of a sheet: the construction and its tray."""

from __future__ import annotations

import math

from unitcad.arrays.array import OFF_ROUND, Array, Box, Sheet
from unitcad.arrays.constructions import Construction, Level
from unitcad.arrays.piece_seams import (
    Strip,
    longer_than_bed,
    of_sheet,
    on_pieces,
    round_units,
    seams_of,
    sheet_mm2,
    too_much,
)
from unitcad.arrays.sheet import bent_stretches, draw_groove, rounded, slot_profile
from unitcad.designs import Dimensions, design_of, dimensions, layer_colour, unit_bodies
from unitcad.designs.design import BEYOND, Cell, Layout
from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import realise, segment_count, thick_pieces
from unitcad.moulds.cavities import united
from unitcad.moulds.cuts import Seam, split
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.pieces import CAST, Removal, bar, base_piece, blade_piece, engrave, set_label
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import Extrude, Shape, cut, cylinder, moved, ring, union
from unitcad.shape.lettering import HEIGHT
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.text import number

MARGIN = 1.0
"""Distance of a label from its edge, mm."""


def plan(array: Array) -> Plan:
    """Return tray, blade and the one pour. A tray that is longer than the bed is cut; raises Refusal if it can't be."""
    sheet, spec, cast = array.sheet, array.unit, cast_sheet(array)
    outer = _outer(array)
    cut_at = _seams(array, outer)
    drawn = tray(array)
    label = set_label((drawn, cast))
    # Under a low rim no deeper than the groove.
    stroke = spec.moulds.engraving_stroke_mm
    depth = min(spec.moulds.engraving_depth_mm, groove_depth_of(spec, sheet.thickness_mm))
    wall = (outer[3] - sheet.outline[3] - spec.moulds.land_mm - spec.moulds.groove_width_mm - HEIGHT * stroke) / 2
    heights = sheet.thickness_mm - depth, sheet.thickness_mm + BEYOND
    letters = list(on_pieces(Strip(outer, wall, stroke, heights, "front"), [(f"B{label}",)], cut_at))
    half = (outer[2] - outer[0]) / 2, (outer[3] - outer[1]) / 2
    strike = blade_piece(bar(half[1], sheet.thickness_mm), too_long=longer_than_bed(spec, 2 * half[1]))
    tools = base_piece(engrave(drawn, letters)), strike
    layout = Layout((Cell(0.0, 0.0, ()),), 0.0, 0.0, (0.0, 0.0), half, half, HEIGHT * stroke)
    step = Step(
        index=1,
        name="layer1",
        material=sheet.material,
        tools=(tools[0].name,),
        layer=(cast,),
        earlier=(),
        seals=(),
        rim=sheet.thickness_mm,
        top=sheet.thickness_mm,
        removals=(Removal(CAST, (0, 0, 1)),),
    )
    dims = Dimensions(
        cavity_radius=0.0,
        radii=(math.hypot(*half),),
        core_height=sheet.thickness_mm,
        heights=(sheet.thickness_mm,),
        motor_radius=0.0,
        motor_height=0.0,
        pad=None,
        exit=None,
        ledge_radius=0.0,
        sides=(),
    )
    held = {unit.diameter_mm: hold_strain(unit.diameter_mm / 2, sheet.hold_mm) for unit in array.units}
    stretches = tuple((f"pocket round a unit of {number(size, 3)} mm", 100 * strain) for size, strain in held.items())
    stretches += bent_stretches(array)
    splits = (split(tools[0], cut_at),) if cut_at else ()
    return Plan(tools, (step,), layout, label, dims, stretches=stretches, splits=splits)


def hold_strain(radius: float, hold: float) -> float:
    """Return the hoop strain of a pocket that is smaller than its unit's radius by `hold` (both mm): 1 is 100 %."""
    return radius / (radius - hold) - 1


def tray(array: Array) -> Shape:
    """Draw the tray without its label."""
    sheet, rim, outer = array.sheet, array.sheet.thickness_mm, _outer(array)
    block = Extrude(rounded(outer, sheet.corner_mm + outer[2] - sheet.outline[2]), -array.unit.moulds.plate_mm, rim)
    cavity = Extrude(rounded(sheet.outline, sheet.corner_mm), 0.0, rim + BEYOND)
    cores: list[Shape] = [
        moved(cylinder(place.radius - sheet.hold_mm, -BEYOND, rim), place.x, place.y) for place in array.places
    ]
    cores += [Extrude(slot_profile(slot), -BEYOND, rim) for slot in sheet.strap_slots]
    return cut(union((cut(block, [cavity]), *cores)), [draw_groove(sheet, array.unit, rim)])


def _outer(array: Array) -> Box:
    """Return the tray's outline: land, groove and a wall for the label."""
    moulds, box = array.unit.moulds, array.sheet.outline
    wall = max(moulds.skirt_wall_mm, HEIGHT * moulds.engraving_stroke_mm + 2 * MARGIN)
    by = moulds.land_mm + moulds.groove_width_mm + wall
    return box[0] - by, box[1] - by, box[2] + by, box[3] + by


def _seams(array: Array, outer: Box) -> tuple[Seam, ...]:
    """Return the cuts of the tray. Raises Refusal for one that stays larger than the bed."""
    kept = [*round_units(array, (place.radius - array.sheet.hold_mm for place in array.places)), *of_sheet(array)]
    what = f"the tray of {outer[2] - outer[0]:.4g} x {outer[3] - outer[1]:.4g} mm"
    plate, thickness = array.unit.moulds.plate_mm, array.sheet.thickness_mm
    area = sheet_mm2(array) - sum(math.pi * (place.radius - array.sheet.hold_mm) ** 2 for place in array.places)
    fault = too_much(array, outer, (plate, plate + thickness), area * thickness)
    return seams_of(array, outer, what, kept, kept, fault)


LEAST_WEB = 2.0
"""Silicone between two pockets, at least, mm (assumed): a narrower strip tears as a unit is pushed in."""


def apart(unit: Spec) -> tuple[float, str]:
    """Return the least distance of two units' edges, mm, and why."""
    return LEAST_WEB, f"the sheet keeps a web of {LEAST_WEB:g} mm between its pockets"


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return the sheet's place: over the tails, as near to the lowest unit's back as possible; otherwise under them."""
    lengths = [dimensions(unit) for unit in units]
    back = min(dims.heights[-1] for dims in lengths)
    over = max((dims.exit.high for dims in lengths if dims.exit), default=0.0)
    under = min((dims.exit.low for dims in lengths if dims.exit), default=back)
    most = max(back - over, min(under, back))
    top = back if back - over >= thickness - 1e-9 else min(under, back)
    return Level(top - thickness, top, most)


def unfit(unit: Spec, sheet: Sheet) -> str:
    """Return the reason why a unit does not fit a pocket, "" if it does: it must be a disc of its diameter there.

    Nothing but tails reaches beyond that disc, they do so under or over the sheet, and at the sheet the silicone
    fills the disc's edge. A design that can't be drawn is refused when it is drawn.
    """
    if design_of(unit).tooling == "concentric":
        return ""  # rings of these radii: their tails leave at the height that `level` checks

    try:
        bodies = unit_bodies(unit)
    except UnitcadError:
        return ""
    radius, segments = unit.diameter_mm / 2, segment_count(unit.diameter_mm, unit.output.tolerance_mm)
    made = united(realise(body.shape, segments) for body in bodies if body.made != "bought")
    whole = united(realise(body.shape, segments) for body in bodies)
    disc = f"a pocket takes a disc of diameter_mm = {unit.diameter_mm:g}"
    low, high = made.bounding_box()[2::3]
    beyond = made - realise(cylinder(radius + OFF_ROUND, low - BEYOND, high + BEYOND), segments)
    if thick_pieces(beyond):
        x0, y0, _, x1, y1, _ = beyond.bounding_box()
        return f"{disc}, and this unit reaches {max(-x0, -y0, x1, y1):.3g} mm from its axis"
    at_sheet = realise(cylinder(radius + OFF_ROUND, sheet.low, sheet.high), segments)
    across = whole.trim_by_plane((0, 0, 1), sheet.low).trim_by_plane((0, 0, -1), -sheet.high) - at_sheet
    if thick_pieces(across):
        return f"its circuit or wires leave at the sheet's height, {sheet.low:.3g} to {sheet.high:.3g} mm over the skin"
    edge = ring(radius - OFF_ROUND - sheet.hold_mm, radius - OFF_ROUND, sheet.low, sheet.high)
    if thick_pieces(realise(edge, segments) - made):
        return f"{disc}; at the sheet's height, {sheet.low:.3g} to {sheet.high:.3g} mm over the skin, this unit is none"
    return ""


def cast_sheet(array: Array) -> Shape:
    """Draw the sheet as it is cast, z = 0 at its side towards the skin (mm)."""
    drawn, thickness = array.sheet, array.sheet.thickness_mm
    holes = [
        moved(cylinder(place.radius - drawn.hold_mm, -BEYOND, thickness + BEYOND), place.x, place.y)
        for place in array.places
    ]
    slots = [Extrude(slot_profile(slot), -BEYOND, thickness + BEYOND) for slot in drawn.strap_slots]
    return cut(Extrude(rounded(drawn.outline, drawn.corner_mm), 0.0, thickness), [*holes, *slots])


CONSTRUCTION = Construction(
    name="pockets",
    about="a sheet with holes for finished units, which can be tested first and exchanged",
    mixed=True,
    own_tails=True,
    thickness_mm=2.0,
    apart=apart,
    level=level,
    bodies=lambda array: (Body("layer1", "unit", "layer", cast_sheet(array), layer_colour(2), made="cast", step=1),),
    plan=plan,
    unfit=unfit,
)

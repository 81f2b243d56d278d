"""The tray that a sheet with pockets is cast in: floor, wall with an overflow groove, cores of pockets and strap slots.

Open at the top; the sheet's back is struck off on the wall. z = 0 is the floor, where the sheet's skin side lies (mm).
"""

from __future__ import annotations

import math

from unitcad.arrays.array import Array, Box
from unitcad.arrays.bending import bent_stretches
from unitcad.arrays.larger_than_bed import longer_than_bed, of_sheet, round_units, sized
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.arrays.piece_labels import Strip, on_pieces
from unitcad.arrays.seam_weep import sheet_mm2, too_much
from unitcad.designs import Dimensions
from unitcad.designs.tooling import Cell, Layout
from unitcad.moulds.blade import bar
from unitcad.moulds.cuts import seams
from unitcad.moulds.dovetails import Seam, split
from unitcad.moulds.labels import engraved, set_label
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.pieces import base_piece, blade_piece
from unitcad.moulds.plan import Plan, Step
from unitcad.moulds.removal import CAST, Removal
from unitcad.shape import Extrude, Shape, cut, cylinder, moved, union
from unitcad.shape.lettering import HEIGHT
from unitcad.text import number

BEYOND = 1.0
"""How far a cutting tool reaches past what it cuts, and a core into the floor, mm."""
MARGIN = 1.0
"""From a label to the edge that it stands at, mm."""


def tray_plan(array: Array, cast: Shape) -> Plan:
    """Return tray, blade and the one pour of an array whose sheet is drawn as `cast`.

    A tray that is longer than the printer's bed is cut. Raises Refusal where it can't be.
    """
    sheet, spec = array.sheet, array.unit
    outer = _outer(array)
    cut_at = _seams(array, outer)
    drawn = tray(array)
    label = set_label((drawn, cast))
    # Under a low rim no deeper than the groove.
    stroke = spec.moulds.engraving_stroke_mm
    depth = min(spec.moulds.engraving_depth_mm, groove_depth_of(spec, sheet.thickness_mm))
    wall = (outer[3] - sheet.outline[3] - spec.moulds.land_mm - spec.moulds.groove_width_mm - HEIGHT * stroke) / 2
    heights = sheet.thickness_mm - depth, sheet.thickness_mm + BEYOND
    letters = on_pieces(Strip(outer, wall, stroke, heights, "bottom"), [(f"B{label}",)], cut_at)
    half = (outer[2] - outer[0]) / 2, (outer[3] - outer[1]) / 2
    strike = blade_piece(bar(half[1], sheet.thickness_mm), too_long=longer_than_bed(spec, 2 * half[1]))
    tools = base_piece(engraved(drawn, letters)), strike
    layout = Layout((Cell(0.0, 0.0, ()),), 0.0, 0.0, half, half, half, HEIGHT * stroke)
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
    sheet, moulds = array.sheet, array.unit.moulds
    rim, land = sheet.thickness_mm, moulds.land_mm
    outer = _outer(array)
    block = Extrude(rounded(outer, sheet.corner_mm + outer[2] - sheet.outline[2]), -moulds.plate_mm, rim)
    cavity = Extrude(rounded(sheet.outline, sheet.corner_mm), 0.0, rim + BEYOND)
    groove = Extrude(
        rounded(sheet.outline, sheet.corner_mm, land + moulds.groove_width_mm),
        rim - groove_depth_of(array.unit, rim),
        rim + BEYOND,
        (rounded(sheet.outline, sheet.corner_mm, land),),
    )
    cores: list[Shape] = [
        moved(cylinder(place.radius - sheet.hold_mm, -BEYOND, rim), place.x, place.y) for place in array.places
    ]
    cores += [Extrude(slot_profile(slot), -BEYOND, rim) for slot in sheet.strap_slots]
    return cut(union((cut(block, [cavity]), *cores)), [groove])


def _outer(array: Array) -> Box:
    """Return the tray's outline: land, groove and a wall that holds the label."""
    moulds, box = array.unit.moulds, array.sheet.outline
    wall = max(moulds.skirt_wall_mm, HEIGHT * moulds.engraving_stroke_mm + 2 * MARGIN)
    by = moulds.land_mm + moulds.groove_width_mm + wall
    return box[0] - by, box[1] - by, box[2] + by, box[3] + by


def _seams(array: Array, outer: Box) -> tuple[Seam, ...]:
    """Return where the tray is cut. Raises Refusal for one that stays larger than the bed."""
    kept = [*round_units(array, (place.radius - array.sheet.hold_mm for place in array.places)), *of_sheet(array)]
    what = f"the tray of {outer[2] - outer[0]:.4g} x {outer[3] - outer[1]:.4g} mm"
    plate, thickness = array.unit.moulds.plate_mm, array.sheet.thickness_mm
    area = sheet_mm2(array) - sum(math.pi * (place.radius - array.sheet.hold_mm) ** 2 for place in array.places)
    fault = too_much(array, outer, (plate, plate + thickness), area * thickness)
    return seams(sized(array, outer, kept, kept), what, array.unit.moulds.plinth_clearance_mm, fault=fault)

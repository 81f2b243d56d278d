"""Pockets: a sheet with holes that hold finished units, each by a hoop strain, cast in an open tray.

        .---.      .----------.      .---.   back
    ....| 2 |......|   unit   |......| 2 |....   sheet, 2 mm
        '---'      |          |
                   '----------'    ============= skin

         section of the tray                     rim = the sheet's back, struck off
    --_---.          .--------.          .---_--
      |   |  cavity  |  core  |  cavity  |   |
      |   '----------'        '----------'   |   z = 0: the sheet's side towards the skin
    --'-----------------------------------------

The tray is drawn from lengths, not by subtracting the sheet: C100 compares the two.
"""

from __future__ import annotations

from unitcad.arrays.array import Array, Sheet
from unitcad.arrays.construction import Construction, Level
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.arrays.tray import tray_plan
from unitcad.designs import design_of, dimensions, layer_colour, unit_bodies
from unitcad.errors import UnitcadError
from unitcad.moulds.plan import Plan
from unitcad.shape import Extrude, Shape, cut, cylinder, moved, ring
from unitcad.shape.body import Body
from unitcad.spec import Spec

LEAST_WEB = 2.0
"""Silicone between two pockets, at least, mm (assumed): a narrower strip tears as a unit is pushed in."""
BEYOND = 1.0
"""How far a cutting tool reaches past what it cuts, mm."""
OFF_ROUND = 0.05
"""How far a unit's outline may lie off its disc, mm (assumed): a quarter of the usual hold."""
SLIVER = 1e-6
"""Volume that is rounding's, mm3."""


def apart(unit: Spec) -> tuple[float, str]:
    """Return the least distance of two units' edges, mm, and why."""
    return LEAST_WEB, f"the sheet keeps a web of {LEAST_WEB:g} mm between its pockets"


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return where the sheet lies: over the tails, as near to the lowest unit's back as it can; else under them."""
    lengths = [dimensions(unit) for unit in units]
    back = min(dims.heights[-1] for dims in lengths)
    over = max((dims.exit.high for dims in lengths if dims.exit), default=0.0)
    under = min((dims.exit.low for dims in lengths if dims.exit), default=back)
    most = max(back - over, min(under, back))
    top = back if back - over >= thickness - 1e-9 else min(under, back)
    return Level(top - thickness, top, most)


def unfit(unit: Spec, sheet: Sheet) -> str:
    """Return why a sheet's pocket can't hold a unit, "" where it can: the unit is a disc of its diameter there.

    Nothing but tails reaches beyond that disc, they do so under or over the sheet, and at the sheet the silicone
    fills the disc's edge. Where a design can't be drawn, that is said when it is drawn.
    """
    if design_of(unit).tooling == "concentric":
        return ""  # rings of these radii: their tails leave where `level` looks
    from unitcad.kernels.mesh import realise, segment_count
    from unitcad.moulds.cavities import united

    try:
        bodies = unit_bodies(unit)
    except UnitcadError:
        return ""
    radius, segments = unit.diameter_mm / 2, segment_count(unit.diameter_mm, unit.output.tolerance_mm)
    made = united(realise(body.shape, segments) for body in bodies if body.made != "bought")
    whole = united(realise(body.shape, segments) for body in bodies)
    disc = f"a pocket holds a disc of diameter_mm = {unit.diameter_mm:g}"
    low, high = made.bounding_box()[2::3]
    beyond = made - realise(cylinder(radius + OFF_ROUND, low - BEYOND, high + BEYOND), segments)
    if beyond.volume() > SLIVER:
        x0, y0, _, x1, y1, _ = beyond.bounding_box()
        return f"{disc}, and this unit reaches {max(-x0, -y0, x1, y1):.3g} mm from its axis"
    at_sheet = realise(cylinder(radius + OFF_ROUND, sheet.low, sheet.high), segments)
    across = whole.trim_by_plane((0, 0, 1), sheet.low).trim_by_plane((0, 0, -1), -sheet.high) - at_sheet
    if across.volume() > SLIVER:
        return f"its circuit or wires leave where the sheet lies, {sheet.low:.3g} to {sheet.high:.3g} mm over the skin"
    edge = ring(radius - OFF_ROUND - sheet.hold_mm, radius - OFF_ROUND, sheet.low, sheet.high)
    if (realise(edge, segments) - made).volume() > SLIVER:
        return f"{disc}; where the sheet lies, {sheet.low:.3g} to {sheet.high:.3g} mm over the skin, this unit is none"
    return ""


def sheet(array: Array) -> Shape:
    """Draw the sheet as it is cast, z = 0 at its side towards the skin (mm)."""
    drawn, thickness = array.sheet, array.sheet.thickness_mm
    holes = [
        moved(cylinder(place.radius - drawn.hold_mm, -BEYOND, thickness + BEYOND), place.x, place.y)
        for place in array.places
    ]
    slots = [Extrude(slot_profile(slot), -BEYOND, thickness + BEYOND) for slot in drawn.strap_slots]
    return cut(Extrude(rounded(drawn.outline, drawn.corner_mm), 0.0, thickness), [*holes, *slots])


def bodies(array: Array) -> tuple[Body, ...]:
    """Return the sheet."""
    colour = layer_colour(2)
    return (Body("layer1", "unit", "layer", sheet(array), colour, made="cast", step=1),)


def plan(array: Array) -> Plan:
    """Return the tray and its pour. Raises Refusal for a tray that is larger than the printer's bed."""
    return tray_plan(array, sheet(array))


CONSTRUCTION = Construction(
    name="pockets",
    about="a sheet with holes that hold finished units, which can be tested alone and exchanged",
    mixed=True,
    own_tails=True,
    thickness_mm=2.0,
    apart=apart,
    level=level,
    bodies=bodies,
    plan=plan,
    unfit=unfit,
)

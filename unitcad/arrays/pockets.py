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

from unitcad.arrays.array import Array
from unitcad.arrays.construction import Construction, Level
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.arrays.tray import tray_plan
from unitcad.designs import dimensions, layer_colour
from unitcad.moulds.plan import Plan
from unitcad.shape import Extrude, Shape, cut, cylinder, moved
from unitcad.shape.body import Body
from unitcad.spec import Spec

LEAST_WEB = 2.0
"""Silicone between two pockets, at least, mm (assumed): a narrower strip tears as a unit is pushed in."""
BEYOND = 1.0
"""How far a cutting tool reaches past what it cuts, mm."""


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
)

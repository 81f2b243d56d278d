r"""A back sheet cast round the limb: Layer 1 of each unit is cast flat and laid in, the rest is injected round it.

         .--- lid ---.             the sheet is a barrel about the limb's axis, from `sheet.low` to `sheet.high`
      .-'  sheet      '-.          over the skin on top; a unit stands on the plane that touches the limb in its middle
    .'.-|Layer 1|- L2 -. '.
   / /  '-------'       \  \       the back of the sheet is as far from the axis as keeps the outer cap over the edge
  ' '      skin, R       '  '      of Layer 1

The silicone is drawn here, from the units; its tools are drawn from lengths in `curved_tools`: C100 compares them.
"""

from __future__ import annotations

import math
from dataclasses import replace

from unitcad.arrays import back_sheet
from unitcad.arrays.array import Array
from unitcad.arrays.back_sheet_tools import core_top
from unitcad.arrays.circuit.wiring import wiring
from unitcad.arrays.construction import Construction, Level
from unitcad.arrays.curved_tools import curved_plan
from unitcad.arrays.fins import fins
from unitcad.arrays.limb_frame import barrel, bent, inside_of_end, strap_slot
from unitcad.arrays.limb_limits import check_limb
from unitcad.designs import design_of, dimensions, layer_colour
from unitcad.designs.design import Fitting
from unitcad.designs.parts import BEYOND
from unitcad.errors import Refusal
from unitcad.moulds.plan import Plan
from unitcad.shape import Common, Shape, cut, cylinder, union
from unitcad.shape.body import Body
from unitcad.spec import Spec


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return where the sheet lies on top of a limb of a radius: its back as high as keeps the cap over Layer 1's edge.

    Raises Refusal as `back_sheet.level`.
    """
    flat = back_sheet.level(units, thickness, None)
    spec, limb = units[0], radius or 0.0
    dims = dimensions(spec)
    if len(spec.layers) < 2:
        limit = "in a curved mould the inner layers are laid in; units of one layer are cast flat and bent"
        raise Refusal("body.cast", "curved", limit, "flat")
    top = math.hypot(limb + flat.high, dims.radii[-2]) - limb
    # Beside its unit a notch stays under the sheet.
    roof = math.hypot(limb + core_top(spec), dims.outer_radius + BEYOND) - limb
    return Level(top - thickness, top, top - roof)


def laid_in(array: Array) -> tuple[tuple[Shape, ...], ...]:
    """Draw the inner layers where they lie round the limb, pour by pour, a solid a unit."""
    drawn, count = _of_place(array), len(array.unit.layers) - 1
    return tuple(
        tuple(bent(array, drawn[n][i], place.x, place.y) for n, place in enumerate(array.places)) for i in range(count)
    )


def _of_place(array: Array) -> list[list[Shape]]:
    """Draw the inner layers of each place about the z axis, with the notches of the circuit."""
    spec = array.unit
    dims = dimensions(spec)
    of_unit = design_of(spec).layers(spec, replace(dims, exit=None, sides=()))
    return [[cut(of_unit[f"layer{i + 1}"], notched) for i in range(len(spec.layers) - 1)] for notched in notches(array)]


def notches(array: Array) -> list[list[Shape]]:
    """Draw the notches of the circuit at each place, about the z axis."""
    reach, top = dimensions(array.unit).outer_radius + BEYOND, core_top(array.unit)
    ways = fins(array, wiring(array))
    return [
        [way.about_the_axis(reach, 0.0, -BEYOND, top) for way in ways if way.place == i]
        for i in range(len(array.places))
    ]


def poured(array: Array) -> Shape:
    """Draw the outermost layers and the sheet, in one piece."""
    sheet, spec, radius = array.sheet, array.unit, array.radius_mm or 0.0
    dims = dimensions(spec)
    inner, height, outer = dims.radii[-2], dims.heights[-2], dims.outer_radius
    holes = [strap_slot(array, slot, BEYOND) for slot in sheet.strap_slots]
    back = Common(
        (barrel(array, array.back_radius_mm), inside_of_end(array, left=True), inside_of_end(array, left=False))
    )
    back = cut(back, [barrel(array, radius + sheet.low), *holes])
    rounds = [bent(array, cylinder(outer, 0.0, sheet.high + BEYOND), p.x, p.y) for p in array.places]
    rounds = Common((barrel(array, radius + (sheet.low + sheet.high) / 2), union(rounds)))
    hollow: list[Shape] = []
    for place, notched in zip(array.places, notches(array), strict=True):
        hollow.append(bent(array, cylinder(inner, -BEYOND, height), place.x, place.y))
        hollow += [bent(array, notch, place.x, place.y) for notch in notched]
    return cut(union((back, rounds)), hollow)


def bodies(array: Array) -> tuple[Body, ...]:
    """Return the silicone as it is worn, a body a pour."""
    shapes = [*(union(pour) for pour in laid_in(array)), poured(array)]
    return tuple(
        Body(f"layer{i + 1}", "unit", "layer", shape, layer_colour(i), made="cast", step=i + 1)
        for i, shape in enumerate(shapes)
    )


def plan(array: Array) -> Plan:
    """Return tools and pours. Raises Refusal for tools that are larger than the bed, and for a limb too small."""
    spec, thickness = array.unit, array.sheet.thickness_mm

    def middle(radius: float) -> float:
        there = level((spec,), thickness, radius)
        return radius + (there.low + there.high) / 2

    check_limb(array, back_sheet.apart(spec)[0], middle)
    return curved_plan(array, back_sheet.layers(array)[:-1], laid_in(array), poured(array))


def assembly(array: Array) -> tuple[Fitting, ...]:
    """Write how the flat circuit is laid into the sleeve."""
    solder, lay_in = back_sheet.assembly(array)
    flat = (
        "Open the sleeve until it lies flat and tape its ends down: the circuit is flat, as long as the sheet laid "
        "flat, and bends with the sleeve when it is worn. It stays flat until the smear is cured."
    )
    return replace(solder, text=f"{solder.text} {flat}"), lay_in


CONSTRUCTION = Construction(
    name="back-sheet",
    cast="curved",
    about="a back sheet cast round the limb: Layer 1 is cast flat and laid in, the rest is injected under a lid",
    mixed=False,
    own_tails=False,
    thickness_mm=1.25,
    apart=back_sheet.apart,
    level=level,
    bodies=bodies,
    plan=plan,
    assembly=assembly,
    greased=back_sheet.greased,
)

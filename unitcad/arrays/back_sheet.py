"""Back sheet: the outermost layer of all units and a sheet on their backs are one pour; the circuit is laid in later.

    ------------------------------------------  back
     sheet  | Layer 1 |         | Layer 1 |
    --. L2 .|  core   |.--. L2 .|  core   |.--
      |    ||         ||  |    ||         ||
      '----''---------''--'----''---------''   skin; notches for the circuit are open to it

The silicone is drawn here, from the units; its tools are drawn from lengths in `back_sheet_tools`: C100 compares them.
"""

from __future__ import annotations

from dataclasses import replace

from unitcad.arrays.array import Array
from unitcad.arrays.back_sheet_tools import core_top, slot_roof, tools_plan
from unitcad.arrays.circuit.wiring import wiring
from unitcad.arrays.construction import Construction, Level
from unitcad.arrays.fins import fins, least_apart
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.arrays.tail_ways import CLEAR
from unitcad.designs import design_of, dimensions, layer_colour, shipped
from unitcad.designs.design import Fitting
from unitcad.designs.parts import BEYOND
from unitcad.errors import Refusal
from unitcad.moulds.plan import Plan
from unitcad.shape import Extrude, Shape, cut, cylinder, moved, union
from unitcad.shape.body import Body
from unitcad.spec import Spec
from unitcad.text import number


def apart(unit: Spec) -> tuple[float, str]:
    """Return the least distance of two units' edges, mm, and why."""
    spine = unit.fpcb.tail_width_mm + 2 * CLEAR if unit.fpcb else 0.0
    gap = least_apart(unit)
    if spine > gap:
        return spine, f"between two units a spine of the circuit, as wide as a tail, takes {spine:.4g} mm"
    return gap, f"between two units the fins of the circuit's notches and a wall of the cups take {gap:.4g} mm"


def level(units: tuple[Spec, ...], thickness: float, radius: float | None) -> Level:
    """Return where the sheet lies: flush with the units' backs, over the notches of the circuit.

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
    ways = fins(array, wiring(array))
    notches = [way.drawn(array, dims.outer_radius + BEYOND, 0.0, -BEYOND, core_top(spec)) for way in ways]
    of_place = [
        [notch for way, notch in zip(ways, notches, strict=True) if way.place == i] for i in range(len(array.places))
    ]
    pours = [
        tuple(
            cut(moved(shape, place.x, place.y), notched) for place, notched in zip(array.places, of_place, strict=True)
        )
        for shape in drawn
    ]
    holes = tuple(slot_profile(slot) for slot in sheet.strap_slots)
    back = Extrude(rounded(sheet.outline, sheet.corner_mm), sheet.low, sheet.high, holes)
    if len(drawn) > 1 and sheet.low < dims.heights[-2]:
        inner = [moved(cylinder(dims.radii[-2], -BEYOND, dims.heights[-2]), p.x, p.y) for p in array.places]
        back = cut(back, inner)
    return (*pours[:-1], (union((back, *pours[-1])),))


def bodies(array: Array) -> tuple[Body, ...]:
    """Return the silicone, a body a pour."""
    return tuple(
        Body(f"layer{i + 1}", "unit", "layer", union(shapes), layer_colour(i), made="cast", step=i + 1)
        for i, shapes in enumerate(layers(array))
    )


def plan(array: Array) -> Plan:
    """Return tools and pours. Raises Refusal for tools that are larger than the bed, and for a pour by injection."""
    return tools_plan(array, layers(array))


def greased(array: Array, pour: int) -> str:
    """Say where the slits beside the fins are sealed before the cup of a pour (from 1) is put on."""
    ridges = fins(array, wiring(array))
    if not ridges:
        return ""
    length = max(fin.reach for fin in ridges) - dimensions(array.unit).radii[pour - 1]
    layer = "" if pour == 1 else f", none on Layer {pour - 1}"
    return (
        "every fin, the ridge that runs out from a core: both upright sides, the top and the end face, on its "
        f"outermost {number(length, 3)} mm alone. None nearer the core, where silicone is cast against the fin"
        f"{layer}"
    )


def assembly(array: Array) -> tuple[Fitting, ...]:
    """Write how the circuit is laid in, with all motors on it."""
    solder = (
        f"Solder the {len(array.places)} motors to the circuit's pads, their backs on it, and try each one. Lay the "
        "patch on its back, the cavities up."
    )
    lay_in = (
        "Put a smear of Layer 1's silicone on each pad, where the cap of Layer 1 will touch it (assumed: silicone "
        "bonds poorly to bare metal and polyimide; a primer or a silicone adhesive holds better). Lay the circuit in "
        "from the skin's side, motor by motor, its rows in the notches, and push each motor in until its pad lies "
        "against that cap. The spine lies free between the units. The notches may be filled with the same silicone."
    )
    return Fitting(solder, ("soldering iron and solder",)), Fitting(lay_in, silicone=1, mixed="smear")


CONSTRUCTION = Construction(
    name="back-sheet",
    about="the units' outer layer and a sheet on their backs in one pour; the common circuit is laid in from the skin",
    mixed=False,
    own_tails=False,
    thickness_mm=1.25,
    apart=apart,
    level=level,
    bodies=bodies,
    plan=plan,
    assembly=assembly,
    greased=greased,
)

"""The patch of an array: its bodies and parts, and its moulds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cache
from typing import NamedTuple

from msgspec import structs

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.array_file import plan_tools, suggest_for_array
from unitcad.arrays.circuit import has_circuit, lay_circuit
from unitcad.arrays.constructions import Construction, construction_of
from unitcad.arrays.sheet import at_place
from unitcad.designs import unit_bodies
from unitcad.errors import Refusal
from unitcad.kernels.mesh import segment_count
from unitcad.moulds.mould_set import MouldSet, Origin, Solids, geometric
from unitcad.moulds.plan import Plan
from unitcad.shape import Shape, cut, cylinder, moved, rotated
from unitcad.shape.tree import Body
from unitcad.spec import Spec, to_json, with_formats
from unitcad.spec.resolved import CastLayer


class PatchPart(NamedTuple):
    """A body in its own frame, its name among the parts, its places; without any it is in place."""

    name: str
    body: Body
    places: tuple[Placed, ...] = ()


def patch_parts(array: Array) -> tuple[PatchPart, ...]:
    """Return the distinct bodies of the whole patch: the silicone that the units share, then each distinct unit's own.

    Units that are cast in one pour with the sheet are there with their bought parts, but without a circuit of their
    own: the array's replaces it.
    """
    way = construction_of(array.construction, array.cast)
    shared = way.bodies(array)
    if way.own_tails:
        shared = tuple(replace(body, name="sheet", shape=_stretched(array, body.shape)) for body in shared)
    own = []
    for i, unit in enumerate(array.units):
        places = tuple(place for place in array.places if array.units.index(place.unit) == i)
        of = f"unit{i + 1}-" if len(array.units) > 1 else ""
        own += [
            PatchPart(f"{of}{body.name}", body, places)
            for body in unit_bodies(unit)
            if way.own_tails or body.kind == "motor"
        ]
    if array.cast == "curved":
        # Turned about the limb, each is a solid of its own.
        own = [PatchPart(body.name, body) for part in own for body in _at_places(array, part)]
    circuit = lay_circuit(array) if has_circuit(array) else ()
    return (*(PatchPart(body.name, body) for body in shared), *own, *(PatchPart(each.name, each) for each in circuit))


def patch_bodies(array: Array) -> tuple[Body, ...]:
    """Return all bodies of the whole patch at their places, a unit's own as "A1-layer1", in the order of the parts."""
    return tuple(
        body for part in patch_parts(array) for body in (_at_places(array, part) if part.places else (part.body,))
    )


def _stretched(array: Array, sheet: Shape) -> Shape:
    """Return the sheet at its height with each pocket as wide as the unit in it, so that the hold is no overlap.

    A turned unit's polygon is within the circle round the pocket's.
    """
    low, high, round_polygon = array.sheet.low, array.sheet.high, 1 / math.cos(math.pi / _segments(array))
    pockets = [
        moved(cylinder(place.reach * round_polygon, low - 1, high + 1), place.x, place.y) for place in array.places
    ]
    return cut(moved(sheet, z=low), pockets)


def _segments(array: Array) -> int:
    """Return the sides of every full turn: as fine as the largest round of units and corners needs."""
    radius = max(array.sheet.corner_mm, *(unit.diameter_mm / 2 for unit in array.units))
    if array.cast == "curved":
        radius = max(radius, array.back_radius_mm)
    return segment_count(radius + math.sqrt(radius), array.unit.output.tolerance_mm)


def _at_places(array: Array, part: PatchPart) -> tuple[Body, ...]:
    """Return a part's bodies, turned about their axes, at its places."""
    return tuple(
        replace(
            part.body,
            name=f"{place.name}-{part.body.name}",
            shape=at_place(array, rotated(part.body.shape, "z", place.angle_deg), place),
        )
        for place in part.places
    )


@dataclass(frozen=True, eq=False)
class PatchMoulds(MouldSet):
    """The set of an array's patch: the silicone besides its units, as it is cast, and the tools and pours of it.

    `spec` is that of the array's unit with the patch's own layers (see `patch_moulds`): the lengths, silicones and lab
    for checks and procedure. Frame of the tools, mm.
    """

    array: Array = field(kw_only=True)

    @property
    def construction(self) -> Construction:
        """The way that the array is made."""
        return construction_of(self.array.construction, self.array.cast)


def patch_moulds(array: Array, plan: Plan | None = None, given: frozenset[str] = frozenset()) -> PatchMoulds:
    """Return the mould set of an array's sheet; with a `plan` in place of its own. `given`: see `MouldSet`.

    Its spec has the unit's lengths, silicones and lab, and the sheet as its layers.
    """
    unit, way = array.unit, construction_of(array.construction, array.cast)
    layers = (CastLayer(material=array.sheet.material, wall_mm=array.sheet.margin_mm, cap_mm=array.sheet.thickness_mm),)
    if not way.own_tails:
        layers = (*unit.layers[:-1], structs.replace(unit.layers[-1], material=array.sheet.material))
    entries = {name: entry for each in array.units for name, entry in each.materials.items()}
    moulds = structs.replace(unit.moulds, pour="open")  # units in pockets may be injected, their sheet is struck off
    own = {"name": array.name, "layers": layers, "materials": entries, "moulds": moulds}
    spec = structs.replace(unit, fpcb=None, wires=None, **own)
    return PatchMoulds(spec, given, origin=_origin(array, plan), array=array)


def _origin(array: Array, plan: Plan | None) -> Origin:
    """Return what a patch's set is made from; with a `plan` in place of its own."""
    way = construction_of(array.construction, array.cast)
    distinct = [to_json(with_formats(geometric(unit))) for unit in array.units]
    places = [(p.name, p.x, p.y, p.angle_deg, array.units.index(p.unit)) for p in array.places]
    sheet = replace(array.sheet, material="")
    reads = (array.construction, array.cast, array.radius_mm, distinct, places, sheet, array.circuit)
    return Origin(
        bodies=cache(lambda: way.bodies(array)),
        plan=cache(lambda: plan or _plan(array)),
        segments=lambda: _segments(array),
        together=lambda: _together(array),
        inner=lambda spec, made: _inner(array, spec, made),
        reads=f" {reads!r}",
        file="array.toml",
        unit=array.unit,
        path="unit.",  # those with several units are cast apart
    )


def _plan(array: Array) -> Plan:
    """Return tools and pours, and what is made of the silicone. Raises Refusal if the moulds can't be made."""
    try:
        made = plan_tools(array)
    except Refusal as refusal:
        raise suggest_for_array(refusal, array.asked) from None
    return _filled_in(array, made)


def _filled_in(array: Array, made: Plan) -> Plan:
    """Return a plan with what its silicone becomes: a sheet for units that are cast apart, or a whole patch."""
    way, bodies = construction_of(array.construction, array.cast), patch_bodies(array)
    x0, y0, x1, y1 = array.sheet.outline
    across = f"The sheet: {x1 - x0:.2f} x {y1 - y0:.2f} mm, before it is bent."
    if array.cast == "curved":
        radius = f"{array.radius_mm or 0.0:.2f}"
        across = f"The sheet: {y1 - y0:.2f} mm along the limb. Every unit sits on a tube of radius {radius} mm."
    elif len(array.places) > 1:
        across += f" Between the middles of neighbouring units: {array.pitch_mm:.2f} mm."
    steps = (replace(step, greased=way.greased(array, step.index), solids=len(step.layer)) for step in made.steps)
    over = tuple(replace(body, shape=moved(body.shape, z=-array.sheet.low)) for body in bodies[1:])
    return replace(
        made,
        steps=tuple(steps),
        makes="sheet" if way.own_tails else "patch",
        laid_later=() if way.own_tails else tuple(body for body in bodies if body.kind in ("motor", "circuit")),
        pushed_in=over if way.own_tails else (),
        assembly=way.assembly(array),
        widest=("sheet", max(x1 - x0, y1 - y0)),
        across=across,
    )


def _together(array: Array) -> Solids:
    """Return the solids in the space of the patch, by name: of pockets the stretched sheet, and the units."""
    way, bodies = construction_of(array.construction, array.cast), patch_bodies(array)
    if not way.own_tails:
        inside = (body for body in bodies if body.kind in ("motor", "circuit"))
        return tuple((body.name, (body.shape,)) for body in (*way.bodies(array), *inside))
    solids: dict[str, list[Shape]] = {}
    for body in bodies:
        solids.setdefault(body.name.partition("-")[0], []).append(body.shape)
    return tuple((name, tuple(shapes)) for name, shapes in solids.items())


def _inner(array: Array, spec: Spec, plan: Plan) -> PatchMoulds | None:
    """Return the set of the flat tools and pours, if only the inner layers are cast flat; otherwise None.

    Its silicone, motors and circuit are those of the whole array, laid flat.
    """
    if plan.standing(plan.steps[-1], "cup") or not plan.of_kind("cup"):
        return None
    steps, dims, flat = plan.steps[:-1], plan.dimensions, replace(array, cast="flat")
    standing = {name for step in steps for name in step.tools}
    tools = tuple(tool for tool in plan.tools if tool.name in standing or tool.kind == "blade")
    lengths = replace(dims, radii=dims.radii[: len(steps)], heights=dims.heights[: len(steps)])
    inner = _filled_in(flat, replace(plan, tools=tools, steps=steps, dimensions=lengths))
    return PatchMoulds(structs.replace(spec, layers=spec.layers[: len(steps)]), origin=_origin(flat, inner), array=flat)

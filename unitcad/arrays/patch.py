"""The patch of an array: its bodies and parts, and its moulds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

from manifold3d import Manifold
from msgspec import structs

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.array_file import plan_tools, suggest_for_array
from unitcad.arrays.circuit import has_circuit, lay_circuit
from unitcad.arrays.constructions import Construction, construction_of
from unitcad.arrays.sheet import at_place
from unitcad.designs import Dimensions, unit_bodies
from unitcad.designs.design import Fitting
from unitcad.errors import Refusal
from unitcad.kernels.mesh import segment_count
from unitcad.moulds.mould_set import MouldSet, geometric
from unitcad.moulds.plan import Plan, Step
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
    """The silicone of an array besides its units, as it is cast, and the tools and pours of it.

    `spec` is that of the array's unit with the patch's own layers (see `patch_moulds`): the lengths, silicones and lab
    for checks and procedure. Frame of the tools, mm.
    """

    array: Array = field(kw_only=True)

    @cached_property
    def construction(self) -> Construction:
        """The way that the array is made."""
        return construction_of(self.array.construction, self.array.cast)

    @cached_property
    def blank(self) -> PatchMoulds:
        """The same set with everything blank that the geometry does not read."""
        spec = geometric(self.spec)
        return self if spec == self.spec else PatchMoulds(spec, self.altered, array=self.array)

    @cached_property
    def geometry(self) -> str:
        """The inputs of the geometry, as a text: places, sheet and lengths, no silicone and no name."""
        array = self.array
        distinct = [to_json(with_formats(geometric(unit))) for unit in array.units]
        places = [(p.name, p.x, p.y, p.angle_deg, array.units.index(p.unit)) for p in array.places]
        sheet = replace(array.sheet, material="")
        reads = (array.construction, array.cast, array.radius_mm, distinct, places, sheet, array.circuit)
        return f"{to_json(with_formats(geometric(self.spec)))} {reads!r}"

    @cached_property
    def unit(self) -> tuple[Body, ...]:
        """The silicone as it is cast."""
        return self.construction.bodies(self.array)

    @property
    def parts(self) -> tuple[str, Spec]:
        """The array's own unit: those with several are cast apart."""
        return "unit.", self.array.unit

    @cached_property
    def laid_later(self) -> tuple[Body, ...]:
        """The motors at their places and the common circuit, of units that are cast in one pour with the sheet."""
        if self.construction.own_tails:
            return ()
        return tuple(body for body in patch_bodies(self.array) if body.kind in ("motor", "circuit"))

    @cached_property
    def pushed_in(self) -> tuple[Body, ...]:
        """The units in the pockets, at their places over the sheet as it is cast."""
        if not self.construction.own_tails:
            return ()
        low = self.array.sheet.low
        return tuple(replace(body, shape=moved(body.shape, z=-low)) for body in patch_bodies(self.array)[1:])

    @cached_property
    def together(self) -> tuple[tuple[str, tuple[Shape, ...]], ...]:
        """The solids in the space of the patch, by name: of pockets the stretched sheet, and the units."""
        if not self.construction.own_tails:
            return super().together
        solids: dict[str, list[Shape]] = {}
        for body in patch_bodies(self.array):
            solids.setdefault(body.name.partition("-")[0], []).append(body.shape)
        return tuple((name, tuple(shapes)) for name, shapes in solids.items())

    @cached_property
    def cast_flat(self) -> PatchMoulds | None:
        """The flat tools and pours of only the inner layers, if the last pour is cast around the limb; otherwise None.

        Its silicone, motors and circuit are those of the whole array, laid flat.
        """
        plan, spec = self.plan, self.spec
        if plan.standing(plan.steps[-1], "cup") or not plan.of_kind("cup"):
            return None
        steps, dims = plan.steps[:-1], plan.dimensions
        standing = {name for step in steps for name in step.tools}
        tools = tuple(tool for tool in plan.tools if tool.name in standing or tool.kind == "blade")
        inner = replace(dims, radii=dims.radii[: len(steps)], heights=dims.heights[: len(steps)])
        layers = spec.layers[: len(steps)]
        return PatchMoulds(
            structs.replace(spec, layers=layers),
            replace(plan, tools=tools, steps=steps, dimensions=inner),
            array=replace(self.array, cast="flat"),
        )

    @property
    def makes(self) -> str:
        """The casting out of the mould."""
        return "sheet" if self.construction.own_tails else "patch"

    @property
    def across(self) -> str:
        """The lengths to measure."""
        x0, y0, x1, y1 = self.array.sheet.outline
        if self.array.cast == "curved":
            along, radius = y1 - y0, self.array.radius_mm or 0.0
            return f"The sheet: {along:.2f} mm along the limb. Every unit sits on a tube of radius {radius:.2f} mm."
        middles = ""
        if len(self.array.places) > 1:
            middles = f" Between the middles of neighbouring units: {self.array.pitch_mm:.2f} mm."
        return f"The sheet: {x1 - x0:.2f} x {y1 - y0:.2f} mm, before it is bent.{middles}"

    @property
    def poured_across(self) -> tuple[str, float]:
        """The widest open surface of a pour: the sheet's longer side, mm."""
        x0, y0, x1, y1 = self.array.sheet.outline
        return "sheet", max(x1 - x0, y1 - y0)

    def greased(self, step: Step) -> str:
        """Return the faces that get petroleum jelly before a cup is put on, in the construction's words."""
        return self.construction.greased(self.array, step.index)

    @property
    def source(self) -> str:
        """The file in a result's folder that makes the result again."""
        return "array.toml"

    @property
    def assembly(self) -> tuple[Fitting, ...]:
        """How motors and circuit go in, in the construction's words."""
        return self.construction.assembly(self.array)

    def pieces(self, name: str) -> int:
        """Return the number of solids that a body is drawn of: a layer of all units has one for each."""
        return next((len(step.layer) for step in self.plan.steps if step.name == name), 1)

    @cached_property
    def plan(self) -> Plan:
        """Tools and pours. Raises Refusal if the moulds can't be made."""
        if self.altered:
            return self.altered
        try:
            return plan_tools(self.array)
        except Refusal as refusal:
            raise suggest_for_array(refusal, self.array.asked) from None

    @cached_property
    def dimensions(self) -> Dimensions:
        """The lengths that the tools are drawn to."""
        return self.plan.dimensions

    @cached_property
    def segments(self) -> int:
        """Sides of every full turn."""
        return _segments(self.array)

    @cached_property
    def rib_spaces(self) -> Manifold:
        """Empty: no cup of a patch is centred by ribs on a plinth."""
        return Manifold()


def patch_moulds(array: Array, altered: Plan | None = None, given: frozenset[str] = frozenset()) -> PatchMoulds:
    """Return the mould set of an array's sheet; `altered` and `given`: see `MouldSet`.

    Its spec has the unit's lengths, silicones and lab, and the sheet as its layers.
    """
    unit, way = array.unit, construction_of(array.construction, array.cast)
    layers = (CastLayer(material=array.sheet.material, wall_mm=array.sheet.margin_mm, cap_mm=array.sheet.thickness_mm),)
    if not way.own_tails:
        layers = (*unit.layers[:-1], structs.replace(unit.layers[-1], material=array.sheet.material))
    entries = {name: entry for each in array.units for name, entry in each.materials.items()}
    moulds = structs.replace(unit.moulds, pour="open")  # units in pockets may be injected, their sheet is struck off
    own = {"name": array.name, "layers": layers, "materials": entries, "moulds": moulds}
    return PatchMoulds(structs.replace(unit, fpcb=None, wires=None, **own), altered, given, array=array)

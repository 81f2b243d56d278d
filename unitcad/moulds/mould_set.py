"""A mould set: a spec's unit, tooling and pours, their meshes and cavities, each worked out when first asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

from msgspec import structs

from unitcad.designs import Design, Dimensions, design_of, unit_bodies
from unitcad.moulds.plan import Plan, plan
from unitcad.moulds.ribs import rib_spaces
from unitcad.shape import Shape
from unitcad.shape.body import Body
from unitcad.spec import Spec, from_json, to_json, with_formats
from unitcad.spec.asked import CastingTable
from unitcad.spec.effective import Estimate

if TYPE_CHECKING:
    from manifold3d import Manifold

    from unitcad.moulds.cavities import Cavity

_T = TypeVar("_T")


def geometric(spec: Spec) -> Spec:
    """Return the spec with everything blank that the geometry does not read."""
    return structs.replace(
        spec,
        name="unit",
        motor=structs.replace(spec.motor, part=None, drive="flat"),
        layers=tuple(structs.replace(layer, material="") for layer in spec.layers),
        casting=CastingTable(),
        estimate=Estimate(frequency_hz=0.0, amplitude_um=0.0, tissue="", models=()),
        materials={},
        motors={},
        tissue={},
    )


@lru_cache(maxsize=32)
def _drawn(geometry: str) -> Plan:
    """Return the plan of a geometry (a spec's JSON), materials blank: variants of one geometry share the drawing."""
    return plan(from_json(geometry))


def forget() -> None:
    """Drop plans and meshes that are kept for the next call: what a measurement of times needs."""
    from unitcad.kernels import mesh

    _drawn.cache_clear()
    mesh.forget()


@dataclass(frozen=True, eq=False)
class MouldSet:
    """A spec's unit and moulds. Lengths in mm, as assembled, z = 0 at the skin.

    `altered` stands in for the plan that the spec's own would be: a set with a fault, for tests.
    """

    spec: Spec
    altered: Plan | None = None
    _kept: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def design(self) -> Design:
        """The design of the unit."""
        return design_of(self.spec)

    @cached_property
    def dimensions(self) -> Dimensions:
        """Radii and heights."""
        return self.design.dimensions(self.spec)

    @cached_property
    def blank(self) -> MouldSet:
        """The set of the same geometry with everything blank that the geometry does not read."""
        spec = geometric(self.spec)
        return self if spec == self.spec else MouldSet(spec, self.altered)

    @cached_property
    def geometry(self) -> str:
        """What the geometry reads, as JSON: the spec without formats and without what is no shape."""
        return to_json(with_formats(self.spec)) if self.blank is self else self.blank.geometry

    @cached_property
    def unit(self) -> tuple[Body, ...]:
        """The bodies of the unit."""
        return unit_bodies(self.spec) if self.blank is self else self.blank.unit

    @cached_property
    def plan(self) -> Plan:
        """Tools and pours. Raises Refusal where the moulds can't be made."""
        if self.altered:
            return self.altered
        drawn = _drawn(self.geometry)
        poured = zip(drawn.steps, self.spec.layers, strict=True)
        return replace(drawn, steps=tuple(replace(step, material=layer.material) for step, layer in poured))

    @cached_property
    def segments(self) -> int:
        """Sides of every full turn in this set's meshes: one number, so that mating faces mate."""
        from unitcad.kernels.mesh import segment_count

        return segment_count(self.dimensions.outer_radius, self.spec.output.tolerance_mm)

    def mesh(self, body: Body) -> Manifold:
        """Return a body's mesh, kept once made."""
        from unitcad.kernels.mesh import realise

        return realise(body.shape, self.segments)

    def meshes(self, shapes: Iterable[Shape]) -> list[Manifold]:
        """Return the meshes of shapes in the frame of the tools: the cells of a layer, seals, channels."""
        from unitcad.kernels.mesh import realise

        return [realise(shape, self.segments) for shape in shapes]

    @cached_property
    def solids(self) -> dict[str, Manifold]:
        """The mesh of every body of unit and tooling by name."""
        return {body.name: self.mesh(body) for body in (*self.unit, *self.plan.tools)}

    @cached_property
    def rib_spaces(self) -> Manifold:
        """The boxes round the ribs that centre the cups; empty without ribs."""
        from unitcad.moulds.cavities import united

        return united(self.meshes(rib_spaces(self.spec, self.plan.layout)))

    @cached_property
    def pressed(self) -> dict[str, Manifold]:
        """The tools by name as they stand in a pour: where a cup's rib reaches into the base, it is crushed."""
        tools = {tool.name: self.solids[tool.name] for tool in self.plan.tools}
        if not self.rib_spaces.is_empty():
            taken = tools["base"] ^ self.rib_spaces
            tools |= {step.cup: tools[step.cup] - taken for step in self.plan.steps}
        return tools

    @cached_property
    def cavities(self) -> tuple[Cavity, ...]:
        """The cavities of all pours in their order, one a cell."""
        from unitcad.moulds.cavities import cavities

        return cavities(self.plan, self.solids, self.segments)

    def once(self, name: str, make: Callable[[], _T]) -> _T:
        """Return what `make` gives, worked out once for this set under `name`."""
        if name not in self._kept:
            self._kept[name] = make()
        return self._kept[name]

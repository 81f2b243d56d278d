"""A variant: a spec and what follows from it, each worked out once and only when somebody asks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from msgspec import structs

from unitcad.designs import Dimensions, dimensions, unit_bodies
from unitcad.moulds.plan import Plan, plan
from unitcad.shape.body import Body
from unitcad.spec import Spec, from_json, to_json
from unitcad.spec.asked import CastingTable
from unitcad.spec.effective import Estimate
from unitcad.validation import load

if TYPE_CHECKING:
    from manifold3d import Manifold


def geometric(spec: Spec) -> Spec:
    """The spec with everything blank that the geometry does not read."""
    return structs.replace(
        spec,
        name="unit",
        motor=structs.replace(spec.motor, part=None),
        layers=tuple(structs.replace(layer, material="") for layer in spec.layers),
        casting=CastingTable(),
        estimate=Estimate(frequency_hz=0.0, amplitude_um=0.0, tissue="", models=()),
        materials={},
        motors={},
        tissue={},
    )


@lru_cache(maxsize=32)
def _drawn(geometry: str) -> Plan:
    """The plan of a geometry (a spec's JSON), materials blank: variants of one geometry share the drawing."""
    return plan(from_json(geometry))


def forget() -> None:
    """Drop plans and meshes that are kept for the next call: what a measurement of times needs."""
    from unitcad.kernels import mesh

    _drawn.cache_clear()
    mesh.forget()


@dataclass(frozen=True)
class Variant:
    """A spec's unit, moulds and meshes. Lengths in mm, as assembled, z = 0 at the skin."""

    spec: Spec

    @classmethod
    def of(cls, source: str, *overrides: str) -> Variant:
        """The variant of a spec file or a template. Raises Refusal or UnitcadError."""
        return cls(load(source, overrides))

    @cached_property
    def dimensions(self) -> Dimensions:
        """Radii and heights."""
        return dimensions(self.spec)

    @cached_property
    def unit(self) -> tuple[Body, ...]:
        """The bodies of the unit."""
        return unit_bodies(self.spec)

    @cached_property
    def plan(self) -> Plan:
        """Tools and pours. Raises Refusal where the moulds can't be."""
        drawn = _drawn(to_json(geometric(self.spec)))
        poured = zip(drawn.steps, self.spec.layers, strict=True)
        return replace(drawn, steps=tuple(replace(step, material=layer.material) for step, layer in poured))

    @cached_property
    def segments(self) -> int:
        """Sides of every full turn in this variant's meshes: one number, so that mating faces mate."""
        from unitcad.kernels.mesh import segment_count

        return segment_count(self.dimensions.outer_radius, self.spec.output.tolerance_mm)

    def mesh(self, body: Body) -> Manifold:
        """The body's mesh, kept once made."""
        from unitcad.kernels.mesh import realise

        return realise(body.shape, self.segments)

    def to_build123d(self) -> Any:
        """Unit and moulds as a named, coloured build123d Compound. Raises UnitcadError without the extra."""
        from unitcad.kernels import build123d

        return build123d.compound((*self.unit, *self.plan.tools))

    def to_cadquery(self) -> Any:
        """Unit and moulds as a named, coloured CadQuery Assembly. Raises UnitcadError without the extra."""
        from unitcad.kernels import cadquery

        return cadquery.assembly((*self.unit, *self.plan.tools))

"""A spec's unit, plan and meshes, as the pipeline judges them, and a way to plant a fault in a tool's tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from manifold3d import Manifold

from unitcad.designs import Dimensions, dimensions, unit_bodies
from unitcad.kernels.mesh import realise, segment_count
from unitcad.moulds.finding import Finding
from unitcad.moulds.laws import judge
from unitcad.moulds.plan import Plan, plan
from unitcad.shape import Shape
from unitcad.shape.body import Body
from unitcad.spec import Spec
from unitcad.validation import load


@dataclass(frozen=True)
class MouldSet:
    """What the laws are judged on."""

    spec: Spec
    dims: Dimensions
    unit: tuple[Body, ...]
    plan: Plan
    segments: int

    @classmethod
    def of(cls, source: str, *overrides: str) -> MouldSet:
        return cls.of_spec(load(source, overrides))

    @classmethod
    def of_spec(cls, spec: Spec) -> MouldSet:
        dims = dimensions(spec)
        return cls(
            spec, dims, unit_bodies(spec), plan(spec), segment_count(dims.outer_radius, spec.output.tolerance_mm)
        )

    def solids(self) -> dict[str, Manifold]:
        return {body.name: realise(body.shape, self.segments) for body in (*self.unit, *self.plan.tools)}

    def judged(self) -> list[Finding]:
        return judge(self.spec, self.unit, self.plan, self.solids(), self.segments)

    def broken(self) -> set[str]:
        """Codes of the laws that do not hold."""
        return {finding.code for finding in self.judged() if not finding.ok}

    def with_fault(self, name: str, change: Callable[[Shape], Shape]) -> MouldSet:
        """The same set with one tool drawn otherwise."""
        tools = tuple(replace(t, shape=change(t.shape)) if t.name == name else t for t in self.plan.tools)
        return replace(self, plan=replace(self.plan, tools=tools))

    def without(self, name: str) -> MouldSet:
        """The same set with a tool forgotten on the bench."""
        steps = tuple(replace(s, tools=tuple(t for t in s.tools if t != name)) for s in self.plan.steps)
        return replace(self, plan=replace(self.plan, steps=steps))

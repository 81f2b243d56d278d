"""A mould set: a unit, tooling and pours, their meshes and cavities, each worked out when first asked for.

A set is made of a spec. A room that casts something else, such as the sheet of an array, gives its own `Origin`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Self, TypeVar

from manifold3d import Manifold
from msgspec import structs

from unitcad.catalogue import printers
from unitcad.designs import Design, Dimensions, design_of, unit_bodies
from unitcad.kernels import mesh
from unitcad.kernels.mesh import realise, segment_count, thick_parts
from unitcad.moulds.base import plate_top
from unitcad.moulds.cavities import Cavity, cavities, united
from unitcad.moulds.cup import rib_spaces
from unitcad.moulds.layout import Frame, groove_depth_of
from unitcad.moulds.plan import Plan, Step, plan
from unitcad.shape import Shape
from unitcad.shape.profile import FACETS
from unitcad.shape.tree import Body
from unitcad.spec import Spec, assumed_lengths, from_json, to_json, with_formats
from unitcad.spec.custom_code import is_body_file
from unitcad.spec.raw import CastingTable, EstimateTable
from unitcad.text import join_words, number

_T = TypeVar("_T")


def geometric(spec: Spec) -> Spec:
    """Return the spec with everything blank that the geometry does not read."""
    return structs.replace(
        spec,
        name="unit",
        motor=structs.replace(spec.motor, part=None, drive="flat"),
        layers=tuple(structs.replace(layer, material="") for layer in spec.layers),
        casting=CastingTable(),
        estimate=EstimateTable(frequency_hz=1.0, amplitude_um=1.0),
        materials={},
        motors={},
        tissue={},
    )


@lru_cache(maxsize=32)
def _drawn(geometry: str) -> Plan:
    """Return the plan of a geometry (a spec's JSON), materials blank: variants of one geometry share the drawing."""
    return plan(from_json(geometry))


def forget() -> None:
    """Drop cached plans, meshes and other results, as a measurement of times needs."""

    _drawn.cache_clear()
    mesh.forget()


Solids = tuple[tuple[str, tuple[Shape, ...]], ...]
"""Solids by name."""


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What a mould set is made from. A function is called once, when its result is needed.

    bodies      all bodies of a unit; of an array the silicone that its units share, as cast
    plan        tools and pours; raises Refusal if the moulds can't be made
    segments    sides of every full turn in this set's meshes: one number, so that mating faces mate
    dimensions  radii and heights of the unit; None: those of the plan
    together    all solids of the finished product; None: the bodies
    inner       from a set's spec and plan to the set of the inner layers, if these are cast flat and laid into the last
                pour; otherwise None
    reads       inputs of the geometry besides the spec, as a text
    file        the file in a result's folder that makes the result again
    unit        the spec of the unit that the bought parts are for
    path        the path of that unit in the file
    """

    bodies: Callable[[], tuple[Body, ...]]
    plan: Callable[[], Plan]
    segments: Callable[[], int]
    unit: Spec
    dimensions: Callable[[], Dimensions] | None = None
    together: Callable[[], Solids] | None = None
    inner: Callable[[Spec, Plan], MouldSet | None] = lambda spec, plan: None
    reads: str = ""
    file: str = "spec.toml"
    path: str = ""


def origin_of(spec: Spec) -> Origin:
    """Return the origin of a unit's set."""
    design = design_of(spec)

    def segments() -> int:
        return segment_count(design.dimensions(spec).outer_radius, spec.output.tolerance_mm)

    def drawn() -> Plan:
        made = _drawn(to_json(with_formats(geometric(spec))))
        poured = zip(made.steps, spec.layers, strict=True)
        return replace(made, steps=tuple(replace(step, material=layer.material) for step, layer in poured))

    return Origin(
        bodies=lambda: unit_bodies(spec),
        plan=drawn,
        segments=segments,
        unit=spec,
        dimensions=lambda: design.dimensions(spec),
    )


@dataclass(frozen=True, eq=False)
class MouldSet:
    """A spec's unit and moulds. Lengths in mm, as assembled, z = 0 at the skin.

    `given`: the paths of the values that a person gave; they count as measured. `origin`: see `Origin`; None: the spec.
    """

    spec: Spec
    given: frozenset[str] = frozenset()
    origin: Origin | None = field(default=None, kw_only=True, repr=False)
    _kept: dict[str, Any] = field(default_factory=dict, init=False, repr=False)
    _meshes: dict[Shape, Manifold] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def design(self) -> Design:
        """The design of the unit."""
        return design_of(self.spec)

    @cached_property
    def source(self) -> Origin:
        """What the set is made from."""
        return self.origin or origin_of(self.spec)

    @cached_property
    def dimensions(self) -> Dimensions:
        """Radii and heights."""
        given = self.source.dimensions
        return given() if given else self.plan.dimensions

    @cached_property
    def blank(self) -> Self:
        """The set of the same geometry with everything blank that the geometry does not read."""
        spec = geometric(self.spec)
        return self if spec == self.spec else replace(self, spec=spec, given=frozenset())

    @cached_property
    def geometry(self) -> str:
        """Inputs of the geometry, as text: the spec without formats and other keys that change no shape."""
        return to_json(with_formats(self.spec)) + self.source.reads if self.blank is self else self.blank.geometry

    @cached_property
    def unit(self) -> tuple[Body, ...]:
        """The bodies of the unit; of an array the silicone that its units share, as cast."""
        return self.source.bodies() if self.blank is self else self.blank.unit

    @property
    def assumed(self) -> dict[str, str]:
        """The assumption about each length of the bought parts that nobody has measured, by its key."""
        return assumed_lengths(self.source.unit, self.given, self.source.path)

    @cached_property
    def together(self) -> Solids:
        """All solids of the finished unit, by name: its bodies, and those that go in after casting."""
        given = self.source.together
        return given() if given else tuple((body.name, (body.shape,)) for body in self.unit)

    @cached_property
    def inner(self) -> MouldSet | None:
        """The set of only the inner layers, if these are cast flat and laid into the last pour; otherwise None."""
        return self.source.inner(self.spec, self.plan)

    @cached_property
    def plan(self) -> Plan:
        """Tools and pours. Raises Refusal if the moulds can't be made."""
        return self.source.plan()

    @cached_property
    def frame(self) -> Frame:
        """Spec, lengths and layout of the tools. Raises Refusal if the moulds can't be made."""
        return Frame(self.spec, self.plan.dimensions, self.plan.layout)

    @cached_property
    def segments(self) -> int:
        """Sides of every full turn in this set's meshes: one number, so that mating faces mate."""
        return self.source.segments()

    @property
    def facets(self) -> float:
        """Largest distance of this set's facets from the true surface, mm: 0 if no body is from a file."""
        if not is_body_file(self.spec.design):
            return 0.0
        from unitcad.kernels.bounds import deviation

        return FACETS + max(deviation(body.shape, self.segments) for body in self.unit)

    def mesh(self, body: Body) -> Manifold:
        """Return a body's mesh, kept once made."""
        return self.mesh_of(body.shape)

    def mesh_of(self, shape: Shape) -> Manifold:
        """Return a shape's mesh in the frame of the tools, kept once made."""

        if shape not in self._meshes:
            self._meshes[shape] = realise(shape, self.segments)
        return self._meshes[shape]

    @property
    def height(self) -> float:
        """Height of the cast bodies of the unit, mm."""
        boxes = [mesh.bounds(self.mesh(body)) for body in self.unit if body.made == "cast"]
        return max(box[5] for box in boxes) - min(box[2] for box in boxes)

    @property
    def plate(self) -> tuple[float, float]:
        """z of the lower and the upper face of the base's plate, mm: a tray, and cups on pins, need no plinth."""
        plinth = self.plan.of_kind("cup") and not self.plan.pins
        top = plate_top(self.spec) if plinth else 0.0
        return top - self.spec.moulds.plate_mm, top

    def hung(self, step: Step) -> float:
        """Return how far a core under a pour's lid hangs into the cavity, mm; 0 without one."""
        lid = self.mesh(self.plan.tool(step.lid)) if step.lid else Manifold()
        cores = len(thick_parts(lid.slice(step.rim - FACETS))) > 1  # besides its skirt
        return step.rim - lid.bounding_box()[2] if cores else 0.0

    def meshes(self, shapes: Iterable[Shape]) -> list[Manifold]:
        """Return the meshes of shapes in the frame of the tools: the cells of a layer, seals, channels."""
        return [self.mesh_of(shape) for shape in shapes]

    @cached_property
    def solids(self) -> dict[str, Manifold]:
        """The mesh of every body of unit and tooling by name."""
        return {body.name: self.mesh(body) for body in (*self.unit, *self.plan.tools)}

    @cached_property
    def rib_spaces(self) -> Manifold:
        """The boxes round the ribs that centre the cups; empty without ribs."""

        return united(self.meshes(rib_spaces(self.frame)))

    @cached_property
    def pressed(self) -> dict[str, Manifold]:
        """The tools by name as assembled in a pour: a cup's rib that reaches into the base is crushed."""
        tools = {tool.name: self.solids[tool.name] for tool in self.plan.tools}
        if not self.crushing.is_empty():
            tools |= {step.cup: tools[step.cup] - self.crushing for step in self.plan.steps}
        return tools

    @cached_property
    def crushing(self) -> Manifold:
        """The parts of the base that ribs reach into; empty without ribs."""
        return self.solids["base"] ^ self.rib_spaces

    @cached_property
    def cavities(self) -> tuple[Cavity, ...]:
        """The cavities of all pours in their order, one a cell."""

        return cavities(self.plan, self.solids, self.segments)

    def once(self, name: str, make: Callable[[], _T]) -> _T:
        """Return the result of `make`, computed once for this set under `name`."""
        if name not in self._kept:
            self._kept[name] = make()
        return self._kept[name]


def shallow_grooves(moulds: MouldSet) -> list[str]:
    """Return a sentence if the spec's depth, larger than the printer's own, is cut down to half a rim; otherwise []."""
    spec = moulds.spec
    asked = spec.moulds.groove_depth_mm
    if asked <= float(printers(spec.printers)[spec.moulds.printer].groove_depth_mm):
        return []
    plan = moulds.plan
    walls = [(plan.walled(step), step.rim) for step in plan.steps if step.groove and plan.walled(step) != step.lid]
    cut_down = {plan.called(name): groove_depth_of(spec, rim) for name, rim in walls if rim / 2 < asked}
    if not cut_down:
        return []
    drawn = join_words([f"{number(depth, 3)} mm on {name}" for name, depth in cut_down.items()])
    return [f"moulds.groove_depth_mm = {asked:g} mm is more than half the rim's height: the groove is drawn {drawn}"]

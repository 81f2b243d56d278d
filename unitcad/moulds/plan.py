"""A casting plan: every tool drawn once, and the pours as records that checks, procedure and pictures run through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from unitcad.designs import Dimensions, design_named, dimensions, unit_bodies
from unitcad.errors import Refusal
from unitcad.moulds import dents, filament, lid
from unitcad.moulds.base import base, plate_bottom
from unitcad.moulds.blade import blade
from unitcad.moulds.cup import cup
from unitcad.moulds.labels import base_label, cell_numbers, corner_labels, engraved
from unitcad.moulds.layout import Cell, Layout, layout
from unitcad.moulds.seals import seals
from unitcad.moulds.tongue import tongues
from unitcad.shape import Shape, Union, content_hash, moved, turned
from unitcad.shape.body import Body, Kind
from unitcad.spec import Spec, printer_of

if TYPE_CHECKING:
    from unitcad.moulds.complement import Complement

_BASE, _CUP, _CUP2, _TONGUE = (0.76, 0.76, 0.76), (0.96, 0.83, 0.66), (0.73, 0.83, 0.93), (0.90, 0.30, 0.30)
_UP, _DOWN = (0, 0, 1), (0, 0, -1)
_BLADE, _STUB, _LID = (0.87, 0.87, 0.55), (0.22, 0.22, 0.22), (0.80, 0.72, 0.90)


@dataclass(frozen=True)
class Step:
    """One pour: the layer it casts, the tools that stand around it (by name), and what is there already.

    `layer` is the cast layer in the frame of the tools, one solid a cell; `earlier` the cured ones; `seals` what
    silicone is kept from though no tool fills it; `channels` the silicone in sprue and vents, as many a cell.
    `rim` is z of the plane that the blade runs on, `top` where the silicone is open: the rim or the lid's upper face.
    `windows` counts the cup's passages for tongues that are closed all round.
    """

    index: int
    name: str
    material: str
    tools: tuple[str, ...]
    layer: tuple[Shape, ...]
    earlier: tuple[Shape, ...]
    seals: tuple[Shape, ...]
    rim: float
    top: float
    channels: tuple[Shape, ...] = ()
    windows: int = 0

    @property
    def cup(self) -> str:
        """The cup's name."""
        return f"cup{self.index}"

    @property
    def lid(self) -> str | None:
        """The lid's name; None for an open pour."""
        return f"lid{self.index}" if self.channels else None


@dataclass(frozen=True)
class Plan:
    """All tools as assembled, the pours in their order, and the four characters that their labels end in.

    `dimensions` are those that the tools were drawn to; `by_complement`: from the cast shapes and not from lengths.
    """

    tools: tuple[Body, ...]
    steps: tuple[Step, ...]
    layout: Layout
    label: str
    dimensions: Dimensions
    by_complement: bool = False

    def tool(self, name: str) -> Body:
        """Return the tool of that name. Raises KeyError."""
        return {tool.name: tool for tool in self.tools}[name]

    def of_kind(self, kind: Kind) -> tuple[Body, ...]:
        """Return the tools of a kind."""
        return tuple(tool for tool in self.tools if tool.kind == kind)

    def standing(self, step: Step, kind: Kind) -> tuple[Body, ...]:
        """Return the tools of a kind that stand in a pour."""
        return tuple(tool for tool in self.of_kind(kind) if tool.name in step.tools)


def plan(spec: Spec) -> Plan:
    """Return the plan of a spec: the design's own tooling, or moulds by complement of its cast layers.

    Raises Refusal where the moulds can't be: beyond the bed, a tail that reaches no edge, a lid whose vents or a tongue
    whose width can't clear the air, a piece that nothing holds.
    """
    layers = cast_layers(spec)
    made = None
    if design_named(spec.design).tooling is None:
        from unitcad.moulds.complement import complement  # it meshes: the other designs' plans load no kernel

        made = complement(spec, layers)
    dims = made.dims if made else dimensions(spec)
    lay = made.layout if made else layout(spec, dims)
    if not made:
        dents.check_tongue(spec, dims)
    blank = _tools(spec, dims, lay, made)
    # Material variants share pieces: the label is of geometry alone, drawn before there is a label on it.
    label = content_hash(Union((*(tool.shape for tool in blank), *layers)))[:4].upper()
    tools = tuple(_engraved(tool, spec, dims, lay, label) for tool in blank)
    cast = [tuple(placed(layer, dims, cell) for cell in lay.cells) for layer in layers]
    around = [tool.name for tool in tools if tool.kind in ("tongue", "stub")]
    injected = spec.moulds.pour == "injected"
    tails = sum(len(cell.sides) for cell in lay.cells) if dims.exit else 0
    steps = tuple(
        Step(
            index=i + 1,
            name=f"layer{i + 1}",
            material=layer.material,
            tools=("base", f"cup{i + 1}", *([f"lid{i + 1}"] if injected else []), *around),
            layer=cast[i],
            earlier=tuple(shape for earlier in cast[:i] for shape in earlier),
            seals=made.seals[i] if made else tuple(seals(spec, dims, lay, i)),
            rim=dims.heights[i],
            top=lid.lid_top(dims, i) if injected else dims.heights[i],
            channels=tuple(lid.channels(spec, dims, lay, i)) if injected else (),
            windows=tails if dims.exit and dims.exit.high < dims.heights[i] else 0,
        )
        for i, layer in enumerate(spec.layers)
    )
    return Plan(tools, steps, lay, label, dims, by_complement=made is not None)


def cast_layers(spec: Spec) -> tuple[Shape, ...]:
    """Return the shapes of a unit's cast layers in the order of their pours.

    Raises Refusal where the design draws others than the spec has layers for.
    """
    bodies = sorted((body for body in unit_bodies(spec) if body.made == "cast"), key=lambda body: body.step or 0)
    if len(bodies) != len(spec.layers):
        drawn = ", ".join(body.name for body in bodies) or "none"
        limit = f"moulds need each of the spec's {len(spec.layers)} [[layers]] drawn as layer1 ...; it draws {drawn}"
        raise Refusal("design", spec.design, f"{limit}; --only unit makes the unit alone")
    return tuple(body.shape for body in bodies)


def placed(shape: Shape, dims: Dimensions, cell: Cell) -> Shape:
    """Return a unit's solid in its cell: turned by half where the cell's one tail leaves to -x."""
    return moved(turned(shape, "z", 2 if cell.sides == (-1,) and dims.sides == (1,) else 0), cell.x, cell.y)


def _tools(spec: Spec, dims: Dimensions, lay: Layout, drawn: Complement | None) -> list[Body]:
    """Draw every tool without its label, in the order in which a person needs them."""
    tools = [Body("base", "tool", "base", drawn.base if drawn else base(spec, dims, lay), _BASE)]
    injected = spec.moulds.pour == "injected"
    for i in range(len(spec.layers)):
        shape, colour = drawn.cups[i] if drawn else cup(spec, dims, lay, i), _CUP2 if i % 2 else _CUP
        tools.append(Body(f"cup{i + 1}", "tool", "cup", shape, colour, step=i + 1, upside_down=True, removal=_UP))
        if injected:
            shape = lid.lid(spec, dims, lay, i)
            tools.append(Body(f"lid{i + 1}", "tool", "lid", shape, _LID, step=i + 1, upside_down=True, removal=_UP))
    # A printed resin is too brittle for a strip this thin: it is cut from film or steel.
    brittle = printer_of(spec).technology.value == "sla"
    strips, made = tongues(dims, lay), "cut" if brittle else "printed"
    tools += [
        Body(_numbered("tongue", i, strips), "tool", "tongue", shape, _TONGUE, made=made, removal=(side, 0, 0))
        for i, (side, shape) in enumerate(strips)
    ]
    if design_named(spec.design).suction and not drawn:
        stubs = [filament.stub(spec, dims, lay, cell, plate_bottom(spec)) for cell in lay.cells]
        tools += [
            Body(_numbered("stub", i, stubs), "tool", "stub", stub, _STUB, made="cut", removal=_DOWN)
            for i, stub in enumerate(stubs)
        ]
    if not injected:
        tools.append(Body("blade", "tool", "blade", blade(lay, dims.heights[-1]), _BLADE, upside_down=True))
    return tools


def _engraved(tool: Body, spec: Spec, dims: Dimensions, lay: Layout, label: str) -> Body:
    """Return the tool with the set's label, and a cup with the numbers of its cells."""
    corners = label[:2], label[2:]
    if tool.kind == "base":
        letters = base_label(spec, lay, f"B{label}")
    elif tool.kind == "cup" and tool.step:
        rim = dims.heights[tool.step - 1]
        letters = corner_labels(spec, lay, rim, (f"C{tool.step:X}", *corners)) + cell_numbers(spec, lay, rim)
    elif tool.kind == "lid" and tool.step:
        letters = corner_labels(spec, lay, lid.lid_top(dims, tool.step - 1), (f"L{tool.step:X}", *corners))
    else:
        return tool
    return replace(tool, shape=engraved(tool.shape, letters))


def _numbered(name: str, index: int, among: Sequence[object]) -> str:
    return name if len(among) == 1 else f"{name}{index + 1}"

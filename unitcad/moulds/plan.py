"""A casting plan: every tool drawn once, and the pours as records that checks, procedure and pictures run through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from unitcad.designs import Dimensions, design_of, inserts, unit_bodies
from unitcad.designs.design import BEYOND, Cell, Fitting, Layout, Tooling
from unitcad.designs.dimensions import poured
from unitcad.designs.printed import in_layers
from unitcad.errors import UNIT_ALONE, Refusal, UnitcadError
from unitcad.moulds import filament, lid
from unitcad.moulds.base import base, plate_bottom, plate_top, tongues
from unitcad.moulds.complement import complement
from unitcad.moulds.cup import Pins, cup
from unitcad.moulds.cuts import Split
from unitcad.moulds.layout import Frame
from unitcad.moulds.lid import skin_tray
from unitcad.moulds.pieces import (
    Removal,
    base_label,
    base_piece,
    blade,
    blade_piece,
    cell_numbers,
    corner_labels,
    cup_piece,
    customary,
    engrave,
    filament_pieces,
    lid_piece,
    seals,
    set_label,
    tongue_pieces,
    tray_piece,
)
from unitcad.rooms import load, mould_makers
from unitcad.shape import Shape, moved, turned, union
from unitcad.shape.tree import Body, Kind
from unitcad.spec import Spec, printer_of
from unitcad.text import spaced


@dataclass(frozen=True)
class Step:
    """One pour: the layer it casts, the tools around it (by name), and the solids that are there already.

    `layer` is the cast layer in the frame of the tools, one solid a cell; `earlier` the cured ones, in their places of
    casting or, if taken out since, of laying in; `seals` space without tool that silicone is kept from;
    `channels` the silicone in sprue and vents, as many a cell.
    `inserts` are motor and circuit of all cells, if they are laid in before this pour or an earlier one. `rim` is z of
    the plane that the blade runs on, `top` that of the silicone's open surface: the rim or the lid's upper face.
    `windows` counts the cup's passages for tongues that are closed all round; `groove`: it has an overflow groove.
    `pins` centre the pour's lid on its base, if no cup does. `greased`: the faces that get petroleum jelly before the
    cup is put on, "" for none; a seal next to a tongue's passage is greased with the tongue.
    `solids`: the number of solids that the product's body of this layer has.
    `gated`: the cup is closed, and filled through a gate, the first of the channels.
    `removals` are the pieces taken away once the layer has cured, in that order; the others are part of the next pour.
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
    groove: bool = True
    inserts: tuple[Body, ...] = ()
    pins: Pins | None = None
    removals: tuple[Removal, ...] = ()
    greased: str = ""
    solids: int = 1
    gated: bool = False

    def __repr__(self) -> str:
        return f"Step({self.index}: {self.name}, {self.material or 'no material'}; {', '.join(self.tools)})"

    @property
    def cup(self) -> str:
        """The cup's name."""
        return f"cup{self.index}"

    @property
    def lid(self) -> str | None:
        """The lid's name; None for a pour without one."""
        name = f"lid{self.index}"
        return name if name in self.tools else None

    @property
    def injected(self) -> bool:
        """Whether silicone is injected: under a lid, or into a closed cup."""
        return bool(self.lid) or self.gated


@dataclass(frozen=True)
class Plan:
    """All tools as assembled, the pours in their order, and the four characters that their labels end in.

    `dimensions` are those that the tools were drawn to; `concentric`: they define every hole and gap in the tools.
    `pins` centre the cups on the base in place of plinth and skirt; `pry_slots` of that base: the number of the piece
    that has it (1 of a whole base), its side (left, right, front, back) and its middle along that side, mm. `genus`:
    the through holes of a tool, by its name, if dimensions of rings don't define them.
    `stretches`: parts of the silicone that stretch after casting, and by how many percent, besides those of the tools.
    `splits`: the tools that are printed in pieces; everything but the pieces' files and C250 sees them joined.
    The product: `makes` is its name. `laid_later` goes into the silicone after casting, `pushed_in` into a cast sheet
    from its side towards the skin, each body named after its place. `assembly` says how; None: as the design does.
    `widest`: name and width (mm) of the widest open surface of a pour; None: the unit. `across`: the length to measure.
    `way`: how the body is turned and where its mould comes apart, in words; "" if cups lift off it as it is drawn.
    `bench`: the module that words and draws the casting of such tools; "" for the core's.
    """

    tools: tuple[Body, ...]
    steps: tuple[Step, ...]
    layout: Layout
    label: str
    dimensions: Dimensions
    concentric: bool = True
    stretches: tuple[tuple[str, float], ...] = ()
    pins: Pins | None = None
    pry_slots: tuple[tuple[int, str, float], ...] = ()
    genus: tuple[tuple[str, int], ...] = ()
    splits: tuple[Split, ...] = ()
    makes: str = "unit"
    laid_later: tuple[Body, ...] = ()
    pushed_in: tuple[Body, ...] = ()
    assembly: tuple[Fitting, ...] | None = None
    widest: tuple[str, float] | None = None
    across: str = ""
    way: str = ""
    bench: str = ""

    def __repr__(self) -> str:
        pours = f"{len(self.steps)} {'pour' if len(self.steps) == 1 else 'pours'}"
        return f"Plan({self.label}: {', '.join(tool.name for tool in self.tools)}; {pours})"

    def tool(self, name: str) -> Body:
        """Return the tool of that name. Raises KeyError."""
        return {tool.name: tool for tool in self.tools}[name]

    @property
    def pieces(self) -> tuple[Body, ...]:
        """All tools as they are made: in the place of a split one its pieces."""
        return tuple(piece for tool in self.tools for piece in self.pieces_of(tool.name))

    def pieces_of(self, name: str) -> tuple[Body, ...]:
        """Return the pieces of a tool by its name: itself if it is not split. Raises KeyError."""
        return next((split.pieces for split in self.splits if split.tool == name), None) or (self.tool(name),)

    def called(self, name: str) -> str:
        """Return a tool's or a piece's name as it is read: "cup 1", "cup 1, piece 2"; a base without cups is a tray."""
        if name == "base" and not self.of_kind("cup"):
            return "tray"
        numbered = ((split.tool, i, piece.name) for split in self.splits for i, piece in enumerate(split.pieces, 1))
        tool, number = next(((tool, f", piece {i}") for tool, i, piece in numbered if piece == name), ("", ""))
        return f"{self.called(tool)}{number}" if tool else spaced(name).replace("-", " ")

    def walled(self, step: Step) -> str:
        """Return the name of the piece that has a pour's wall and rim: its cup, else the piece that stays."""
        return (self.standing(step, "cup") or self.standing(step, "base"))[0].name

    def base_of(self, step: Step) -> str:
        """Return the name of a pour's base."""
        return self.standing(step, "base")[0].name

    def of_kind(self, kind: Kind) -> tuple[Body, ...]:
        """Return the tools of a kind."""
        return tuple(tool for tool in self.tools if tool.kind == kind)

    def standing(self, step: Step, kind: Kind) -> tuple[Body, ...]:
        """Return the tools of a kind in a pour."""
        return tuple(tool for tool in self.of_kind(kind) if tool.name in step.tools)


def plan(spec: Spec) -> Plan:
    """Return the plan of a spec: the tooling of its design, labelled, and the pours.

    Raises Refusal if the moulds can't be made: beyond the bed, a tail that reaches no edge, a lid whose vents or a
    tongue whose width can't clear the air, a loose piece.
    """
    layers = cast_layers(spec)
    return _planned(spec, layers, _tooling(spec, layers))


def _planned(spec: Spec, layers: Sequence[Shape], made: Tooling) -> Plan:
    """Return the plan of a tooling."""
    layers = made.cast or layers
    dims, lay = made.dimensions, made.layout
    frame = Frame(spec, dims, lay)
    # Material variants share pieces: the label depends only on geometry.
    label = set_label((*(tool.in_file.shape for tool in made.tools), *layers))
    tools = tuple(_engraved(tool, frame, label) for tool in made.tools)
    cast = [tuple(place_in_cell(layer, dims, cell) for cell in lay.cells) for layer in layers]
    laid_in, laid = design_of(spec).laid_in, inserts(spec)
    laid = tuple(replace(b, shape=union(place_in_cell(b.shape, dims, cell) for cell in lay.cells)) for b in laid)
    tails = sum(len(cell.sides) for cell in lay.cells) if dims.exit else 0
    pours = range(1, len(layers) + 1)
    standing = [
        [tool for tool in tools if tool.kind not in ("blade", "tray") and tool.step in (None, pour)] for pour in pours
    ]
    steps = tuple(
        Step(
            index=i + 1,
            name=f"layer{i + 1}",
            material=layer.material,
            tools=tuple(tool.name for tool in standing[i]),
            layer=cast[i],
            earlier=tuple(shape for earlier in cast[:i] for shape in earlier),
            seals=made.seals[i],
            rim=dims.heights[i],
            top=made.tops[i] if made.tops else lid.lid_top(dims, i) if made.channels else dims.heights[i],
            channels=made.channels[i] if made.channels else (),
            gated=made.gated[i] if made.gated else False,
            windows=tails if dims.exit and dims.exit.high < dims.heights[i] else 0,
            groove=made.grooves[i] if made.grooves else True,
            inserts=laid if i + 1 >= laid_in else (),
            removals=tuple(customary(standing[i], last=i + 1 == len(layers))),
            greased=_greased(i + 1) if made.seals[i] and not made.concentric else "",
        )
        for i, layer in enumerate(spec.layers)
    )
    across = f"Farthest corner from the axis: {dims.outer_radius:.2f} mm."
    return Plan(tools, steps, lay, label, dims, made.concentric, across=across, way=made.way, bench=made.bench)


def _greased(pour: int) -> str:
    """Return the faces to grease before the cup of a pour by complement is put on."""
    parts = f"the upright faces of the parts on the base, only inside the slots of cup {pour} for them"
    return f"{parts}, outside the cavity"


def _tooling(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Return the tooling of the cast layers, by the way that the design names or by a function of its own.

    Raises UnitcadError if a function's tooling lacks a piece, and Refusal for a pour that the tooling can't take.
    """
    way = design_of(spec).tooling
    if way == "concentric":
        return concentric(spec, cast)
    if way == "complement":
        return _complement(spec, cast)
    made = way(spec, cast)
    names, injected = [tool.name for tool in made.tools], spec.moulds.pour == "injected"
    needed = ["base", *(f"{kind}{i + 1}" for i in range(len(cast)) for kind in ("cup", "lid")[: 1 + injected])]
    wrong = [f"has no {name}" for name in needed if name not in names]
    wrong += [f"has {name} twice" for name in sorted({name for name in names if names.count(name) > 1})]
    optional = [("channels", made.channels or injected), ("grooves", made.grooves)]
    for field in ("seals", *(field for field, given in optional if given)):
        count = len(getattr(made, field))
        wrong += [f"has {field} of {count} pours, not of {len(cast)}"] if count != len(cast) else []
    if wrong:
        raise UnitcadError(f"design {spec.design}: its tooling {wrong[0]}")
    return made


def _complement(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Return moulds by complement, or those of a room that knows more ways. Raises Refusal."""
    try:
        made = complement(spec, cast)
    except Refusal as refusal:
        made = refusal
    for reference in mould_makers():
        made = load(reference)(spec, cast, made, lambda tooling: _planned(spec, cast, tooling))
    if isinstance(made, Refusal):
        raise made
    return made


def cast_layers(spec: Spec) -> tuple[Shape, ...]:
    """Return the shapes of a unit's cast layers in the order of their pours.

    Raises Refusal if the design draws others than the spec has layers for.
    """
    design = design_of(spec)
    dims = design.dimensions(spec)
    cast = tool_dimensions(spec)
    if cast != dims:
        drawn = design.layers(spec, cast)
        return tuple(drawn[f"layer{i + 1}"] for i in range(len(spec.layers)))
    bodies = sorted((body for body in unit_bodies(spec) if body.kind == "layer"), key=lambda body: body.step or 0)
    if len(bodies) != len(spec.layers):
        drawn = ", ".join(body.name for body in bodies) or "none"
        limit = f"moulds need each of the spec's {len(spec.layers)} [[layers]] drawn as layer1 ...; it draws {drawn}"
        raise Refusal("design", spec.design, f"{limit}{UNIT_ALONE}")
    return tuple(body.shape for body in bodies)


def tool_dimensions(spec: Spec) -> Dimensions:
    """Return the dimensions that tools are drawn to: of the silicone as poured; of rings and cups, in whole layers."""
    design = design_of(spec)
    dims = poured(spec, design.dimensions(spec))
    return in_layers(spec, dims) if design.tooling == "concentric" else dims


def place_in_cell(shape: Shape, dims: Dimensions, cell: Cell) -> Shape:
    """Return a unit's solid in its cell: turned by half if the cell's one tail leaves to -x."""
    return moved(turned(shape, "z", 2 if cell.sides == (-1,) and dims.sides == (1,) else 0), cell.x, cell.y)


def _engraved(tool: Body, frame: Frame, label: str) -> Body:
    """Return the tool with the set's label, and a cup with the numbers of its cells."""
    dims = frame.dims
    corners = label[:2], label[2:]
    if tool.kind == "base" and frame.lay.plate == frame.lay.cup:  # a tray: its plate has no free face
        letters = corner_labels(frame, dims.heights[0], ("B", *corners))
    elif tool.kind == "base":
        letters = base_label(frame, f"B{label}", plate_top(frame.spec))
    elif tool.kind == "cup" and tool.step:
        rim = dims.heights[tool.step - 1]
        letters = corner_labels(frame, rim, (f"C{tool.step:X}", *corners)) + cell_numbers(frame, rim)
    elif tool.kind == "lid" and tool.step:
        letters = corner_labels(frame, lid.lid_top(dims, tool.step - 1), (f"L{tool.step:X}", *corners))
    elif tool.kind == "tray":
        letters = corner_labels(frame, dims.heights[-1], ("F", *corners))
    else:
        return tool
    file = engrave(tool.file, letters) if tool.file else None
    return replace(tool, shape=engrave(tool.shape, letters), file=file)


def concentric(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Return the tooling of a spec's rings or cups; the shapes `cast` are not looked at, so that C100 can compare.

    Raises Refusal beyond the bed, for a tail that reaches no edge, and for a tongue or vents that can't clear the air.
    """
    design = design_of(spec)
    frame = Frame.of(spec, tool_dimensions(spec))
    dims, lay, pours = frame.dims, frame.lay, range(len(cast))
    lid.check_tongue(frame)
    injected = spec.moulds.pour == "injected"
    tools = [base_piece(base(frame))]
    for i in pours:
        wider = spec.moulds.bore_compensation_mm
        file = cup(frame, i, wider) if wider else None
        tools.append(cup_piece(i + 1, cup(frame, i), file))
        if injected:
            drilled = lid.channels(frame, i, beyond=BEYOND)
            tools.append(lid_piece(i + 1, lid.lid(frame, i, drilled)))
    brittle = printer_of(spec).technology.value == "sla"
    tools += tongue_pieces(tongues(frame, cut=brittle), brittle)
    if design.suction:
        tools += filament_pieces([filament.piece(frame, cell, plate_bottom(spec)) for cell in lay.cells])
    if dims.skin:
        tools.append(tray_piece(skin_tray(frame)))
    if not injected:
        tools.append(blade_piece(blade(lay, dims.heights[-1])))
    return Tooling(
        dims,
        lay,
        tuple(tools),
        seals=tuple(tuple(seals(frame, i)) for i in pours),
        channels=tuple(tuple(lid.channels(frame, i)) for i in pours) if injected else (),
        concentric=True,
    )

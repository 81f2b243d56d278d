"""The protocol of a design, for the shipped designs and for a custom design's file, and the parts that they share.

Shared: motor, circuit or wires, the slot of the tail.

z
|   .--------- pad, radius pad.radius ---------.========== tail ===  pad.low to pad.high
|      .------- motor, radius motor_radius ----.
0------'---------------------------------------'------------------- skin
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from unitcad.designs.dimensions import WIRE_GAP, Dimensions, Outline, Pad
from unitcad.shape import Revolve, Shape, box, cut, cylinder, moved, polygon, turned, union
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.spec.raw import FpcbTable, RawSpec, WiresTable
from unitcad.text import number

Reason = tuple[str, str]


@dataclass(frozen=True)
class Cell:
    """One cavity: its centre, the sides (+1, -1 along x) of its tails, and its number among several ("")."""

    x: float
    y: float
    sides: tuple[int, ...]
    name: str = ""


@dataclass(frozen=True)
class Layout:
    """Cells and half sizes along x and y (mm): `plinth` at z = 0, `cup` and `plate` outside; `key` is a leg.

    `ribs`: the spec's ribs centre the cups on the plinth; side pieces and trays have none.
    """

    cells: tuple[Cell, ...]
    key: float
    pitch: float
    plinth: tuple[float, float]
    cup: tuple[float, float]
    plate: tuple[float, float]
    label_height: float
    ribs: bool = True


@dataclass(frozen=True)
class Tooling:
    """The tools of all pours, without labels, and the other seals.

    dimensions   the lengths that the tools are drawn to; `heights` are the rims of the pours
    layout       cells and plates; the labels go into the plates' corners
    tools        in the order in which a person needs them: "base", and "cup1", "cup2" ... with their pour as `step`; a
                 tool without `step`, except a blade, is part of every pour
    seals        for each pour, space without tool that silicone is kept from
    channels     for each pour under a lid, the silicone in sprue and vents, as many a cell; () if all pours are open
    grooves      for each pour, whether its cup has an overflow groove; () if all have one
    concentric   whether the tools are those of rings: then the dimensions define every hole and gap in them
    cast         the layers as they lie in the mould, in the frame of the tools; () as the unit is drawn
    tops         for each pour, z of the silicone's open surface; () for rims and lids
    gated        for each pour, whether its cup is closed and filled through a gate, the first of its channels; () for none
    way          how the body is turned and where its mould comes apart, in words; "" as drawn, with cups that lift off
    bench        the module that words and draws the casting of these tools; "" for cups that lift off
    """

    dimensions: Dimensions
    layout: Layout
    tools: tuple[Body, ...]
    seals: tuple[tuple[Shape, ...], ...]
    channels: tuple[tuple[Shape, ...], ...] = ()
    grooves: tuple[bool, ...] = ()
    concentric: bool = False
    cast: tuple[Shape, ...] = ()
    tops: tuple[float, ...] = ()
    gated: tuple[bool, ...] = ()
    way: str = ""
    bench: str = ""

    def __repr__(self) -> str:
        return f"Tooling({', '.join(tool.name for tool in self.tools)})"


Place = Literal["", "beside", "fed", "in", "home"]


@dataclass(frozen=True)
class Fitting:
    """A sentence of the assembly, the tools of its step, and its picture.

    required_tools
                tools and consumables, as casting.steps.REQUIRED_TOOLS names them
    silicone    the layer whose silicone it uses: from 1, -1 the last; 0 for none
    mixed       the product of that silicone, if it is mixed after the pours
    volume_mm3  the volume of it in one unit
    mix         whether it uses the mix of the pour that it is laid into
    place       where its picture shows motor and circuit: "beside" the body; "fed": the lead is out through its slot,
                the motor before the cavity's mouth; on their way "in"; or "home". "": it has no picture
    """

    text: str
    required_tools: tuple[str, ...] = ()
    silicone: int = 0
    mixed: Literal["", "ring"] = ""
    volume_mm3: float = 0.0
    mix: bool = False
    place: Place = ""


@dataclass(frozen=True)
class Design:
    """A kind of unit, all of it in one file.

    name         value of `design` in a spec; a custom design is named by its file
    about        one line for `unitcad list designs`
    layers       the cast layers from the inside out, by name ("layer1" ...); other names are printed bodies
    dimensions   radii, heights, pad and exit that follow from a spec
    limits       raises Refusal for a spec that this design can't be made of
    advice       warnings about unwise values, a sentence each
    pad_radius   default radius of the circuit's pad (mm), from the raw spec and the radius inside the walls
    wire_sides   sides of a wire that need clearance in its exit: 2 in a slot, 1 in a notch
    tooling      "concentric": base, cups, tongues and blade drawn from the dimensions; "complement": the space round
                 the cast layers; or a function from a spec and the cast layers' shapes to a Tooling
    suction      whether a unit closed at the top sticks to its core by suction, so that a filament must let air in
    opens        side on which motor and circuit go in: "above" or "below" (the skin)
    laid_in      the pour (from 1) before which motor, circuit and printed parts are laid in, to stay; 0: after casting
    caps         whether a layer has a cap over the one inside it, or is an open ring
    passes       how often the wave from motor to skin passes the border between the layers; None: no level at the edge
    assembly     how motor and circuit go into the body, or into the mould, a sentence each; [] for a default
    skipped     skipped pieces of this variant, and why
    default      whether it is the design of new specs; True for one design
    """

    name: str
    about: str
    layers: Callable[[Spec, Dimensions], Mapping[str, Shape]]
    dimensions: Callable[[Spec], Dimensions]
    limits: Callable[[Spec, Dimensions], None] = lambda spec, dims: None
    advice: Callable[[Spec, Dimensions], list[str]] = lambda spec, dims: []
    pad_radius: Callable[[RawSpec, float], float] = lambda asked, inner_radius: inner_radius - 0.3
    wire_sides: int = 1
    tooling: Literal["concentric", "complement"] | Callable[[Spec, Sequence[Shape]], Tooling] = "complement"
    suction: bool = False
    opens: Literal["above", "below"] = "below"
    laid_in: int = 0
    caps: bool = False
    passes: float | None = None
    assembly: Callable[[Spec, Dimensions], Sequence[str | Fitting]] = lambda spec, dims: []
    skipped: Callable[[Spec], list[Reason]] = lambda spec: []
    default: bool = False


BEYOND = 1.0
"""How far a cutting tool reaches past the part that it cuts, mm: never in one plane with it."""


def motor(dims: Dimensions) -> Shape:
    """Draw the motor as a cylinder on the skin, or on the lip."""
    return cylinder(dims.motor_radius, dims.motor_low, dims.motor_height)


def solid_within(outline: Outline, low: float, high: float) -> Shape:
    """Draw the solid within a surface of revolution that goes on straight down to z = `low` and up to `high`."""
    (r0, _), *_, (r1, _) = outline
    if len(outline) == 2 and r0 == r1:
        return cylinder(r0, low, high)
    return Revolve(polygon(*dict.fromkeys(((0.0, low), (r0, low), *outline, (r1, high), (0.0, high)))))


ADHESIVE = "silicone adhesive"


def motor_hold(spec: Spec, dims: Dimensions) -> str:
    """Describe the surroundings of the motor once it is in."""
    lip = " The lip keeps it in." if dims.mouth_radius else ""
    if spec.motor.fill:
        return f"Layer 1 encloses the motor.{lip}"
    return f"A ring of air of {number(dims.air_ring, 3)} mm stays round the motor.{lip}"


def bond(what: str, where: str) -> str:
    """Write how the motor is fixed: the same words in every design."""
    return f"Coat {what} thinly with {ADHESIVE} where it touches {where}: cast silicone does not bond to it."


def circuit(fpcb: FpcbTable, pad: Pad, dims: Dimensions) -> Shape:
    """Draw pad and tails of the flexible circuit. The tail starts inside the pad, so that the union has one outline."""
    half, reach = fpcb.tail_width_mm / 2, dims.outer_radius + fpcb.tail_length_mm
    tails = (box(min(0, s * reach), max(0, s * reach), -half, half, pad.low, pad.high) for s in dims.sides)
    return union((cylinder(pad.radius, pad.low, pad.high), *tails))


def wires(drawn: WiresTable, across: tuple[float, ...], dims: Dimensions) -> list[Shape]:
    """Draw the wires, from just off the motor's side out along +x, side by side, a gap below the core's top.

    `across`: y of their axes, mm.
    """
    radius = drawn.diameter_mm / 2
    lying = turned(cylinder(radius, dims.motor_radius + WIRE_GAP, dims.outer_radius + drawn.length_mm), "y", 1)
    return [moved(lying, 0, y, dims.core_height - WIRE_GAP - radius) for y in across]


def strip(dims: Dimensions, side: int, reach: float, half_width: float, z0: float, z1: float) -> Shape:
    """Draw a flat strip that leaves radially on one side, from the ledge's round riser outwards to x = `reach` (mm)."""
    flat = box(min(0, side * reach), max(0, side * reach), -half_width, half_width, z0, z1)
    return cut(flat, [cylinder(dims.ledge_radius, z0 - BEYOND, z1 + BEYOND)])


def slots(dims: Dimensions) -> list[Shape]:
    """Draw the passages of tails or wires through every layer, open outwards; a notch is open upwards too."""
    if not dims.exit:
        return []
    low, high = dims.exit.low, dims.exit.high
    high += BEYOND if high >= dims.heights[0] else 0.0
    return [strip(dims, side, dims.outer_radius + BEYOND, dims.exit.width / 2, low, high) for side in dims.sides]

"""The protocol of a design, for the shipped designs and for a custom design's file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from unitcad.designs.dimensions import Dimensions
from unitcad.designs.parts import Tooling
from unitcad.shape import Shape
from unitcad.spec import Spec
from unitcad.spec.raw import RawSpec

Reason = tuple[str, str]


def _no_limits(spec: Spec, dims: Dimensions) -> None:
    """Accept every spec."""


def _nothing(spec: Spec, dims: Dimensions) -> list[str]:
    return []


def _nothing_skipped(spec: Spec) -> list[Reason]:
    return []


def _inside_cavity(asked: RawSpec, inner_radius: float) -> float:
    return inner_radius - 0.3


@dataclass(frozen=True)
class Fitting:
    """A sentence of the assembly, and the tools of its step.

    required_tools
                tools and consumables, as casting.steps.REQUIRED_TOOLS names them
    silicone    the layer whose silicone it uses: from 1, -1 the last; 0 for none
    mixed       the product of that silicone, if it is mixed after the pours
    volume_mm3  the volume of it in one unit
    mix         whether it uses the mix of the pour that it is laid into
    """

    text: str
    required_tools: tuple[str, ...] = ()
    silicone: int = 0
    mixed: Literal["", "ring"] = ""
    volume_mm3: float = 0.0
    mix: bool = False


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
    passes       how often the wave from motor to skin passes the border between the layers; None: no estimate
    assembly     how motor and circuit go into the body, or into the mould, a sentence each; [] for a default
    skipped     skipped pieces of this variant, and why
    default      whether it is the design of new specs; True for one design
    """

    name: str
    about: str
    layers: Callable[[Spec, Dimensions], Mapping[str, Shape]]
    dimensions: Callable[[Spec], Dimensions]
    limits: Callable[[Spec, Dimensions], None] = _no_limits
    advice: Callable[[Spec, Dimensions], list[str]] = _nothing
    pad_radius: Callable[[RawSpec, float], float] = _inside_cavity
    wire_sides: int = 1
    tooling: Literal["concentric", "complement"] | Callable[[Spec, Sequence[Shape]], Tooling] = "complement"
    suction: bool = False
    opens: Literal["above", "below"] = "below"
    laid_in: int = 0
    caps: bool = False
    passes: float | None = None
    assembly: Callable[[Spec, Dimensions], Sequence[str | Fitting]] = _nothing
    skipped: Callable[[Spec], list[Reason]] = _nothing_skipped
    default: bool = False

"""The lengths that follow from a resolved spec (mm): one place for designs, moulds and drawings to read them from."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from unitcad.spec import Spec
from unitcad.spec.layers import layers_of

MOTOR_CLEARANCE = 0.1
"""Least ring of air between the motor and Layer 1, mm, unless `motor.fill` closes it."""
WIRE_GAP = 0.1
"""Between wires side by side, and between them and their neighbours, mm."""
LIP_EDGE, LIP_LEAN_DEG = 0.4, 40.0
"""Least height of a lip's upright edge, mm, and the lean of the cone over it: the core prints without support."""
Outline = tuple[tuple[float, float], ...]
"""Points (r, z) of a surface of revolution, from the skin upwards, mm."""


EPS = 1e-9


@dataclass(frozen=True)
class Exit:
    """The passage of tails or wires through the silicone, from `low` to `high` (z, mm) and `width` wide.

    A slot has silicone over it; a notch ends at the layers' top and is open there. `wires_y`: y of the wires' axes.
    """

    low: float
    high: float
    width: float
    wires_y: tuple[float, ...] = ()

    @property
    def height(self) -> float:
        """From its floor to its roof."""
        return self.high - self.low


@dataclass(frozen=True)
class Pad:
    """The circuit's round pad: its radius, and its faces at `low` and `high` (z, mm)."""

    radius: float
    low: float
    high: float


@dataclass(frozen=True)
class Dimensions:
    """A unit's radii and heights; z = 0 is the skin.

    cavity_radius   r of the cavity and so of the core at the skin, without a lip; Layer 1 begins there
    radii[i]        outer radius of layer i at the skin, in the section at y = 0 if it is not round
    core_height     top of the core
    heights[i]      top of layer i
    pad             the circuit's pad; None without a circuit
    exit            slot or notch of tails or wires; None if nothing leaves through the silicone
    ledge_radius    radius at which the tongue's tip ends in the core
    sides           exits of the tail: +1 along +x, -1 along -x
    motor_low       z of the motor's face towards the skin: it rests on the lip
    mouth_radius    radius of the lip's mouth; 0 without a lip
    lip_edge        height of the lip's upright edge
    skin            thickness of the film over the skin side, from z = -skin to 0
    tapers          narrowing of core, and of the layers' outsides, for each mm upwards
    """

    cavity_radius: float
    radii: tuple[float, ...]
    core_height: float
    heights: tuple[float, ...]
    motor_radius: float
    motor_height: float
    pad: Pad | None
    exit: Exit | None
    ledge_radius: float
    sides: tuple[int, ...]
    motor_low: float = 0.0
    mouth_radius: float = 0.0
    lip_edge: float = 0.0
    skin: float = 0.0
    tapers: tuple[float, float] = (0.0, 0.0)

    def scaled(self, factor: float) -> Dimensions:
        """Return the dimensions of a unit that is larger by a factor in all directions."""
        lengths = ("cavity_radius", "core_height", "motor_radius", "motor_height", "ledge_radius")
        lengths += ("motor_low", "mouth_radius", "lip_edge", "skin")
        pad, exit = self.pad, self.exit
        return replace(
            self,
            **{name: factor * getattr(self, name) for name in lengths},
            radii=tuple(factor * each for each in self.radii),
            heights=tuple(factor * each for each in self.heights),
            pad=pad and Pad(factor * pad.radius, factor * pad.low, factor * pad.high),
            exit=exit
            and Exit(
                factor * exit.low,
                factor * exit.high,
                factor * exit.width,
                tuple(factor * each for each in exit.wires_y),
            ),
        )

    @property
    def core_outline(self) -> Outline:
        """The core's side, from the skin to its top."""
        taper, top = self.tapers[0], self.core_height
        upper = self.cavity_radius - taper * top, top
        if not self.mouth_radius:
            return (self.cavity_radius, 0.0), upper
        lean = math.tan(math.radians(LIP_LEAN_DEG))
        meets = (self.lip_edge * lean + self.cavity_radius - self.mouth_radius) / (lean + taper)
        wide = self.cavity_radius - taper * meets, meets
        return (self.mouth_radius, 0.0), (self.mouth_radius, self.lip_edge), wide, upper

    def outside(self, layer: int) -> Outline:
        """Return the outside of a layer (from 0), or the core's side (-1), from the skin to its top."""
        if layer < 0:
            return self.core_outline
        return (self.radii[layer], 0.0), (self.rim_radius(layer), self.heights[layer])

    def rim_radius(self, layer: int) -> float:
        """Return the outer radius of a layer (from 0) at its top."""
        return self.radii[layer] - self.tapers[1] * self.heights[layer]

    @property
    def outer_radius(self) -> float:
        """D / 2."""
        return self.radii[-1]

    @property
    def air_ring(self) -> float:
        """Width of the ring of air between motor and Layer 1."""
        return self.cavity_radius - self.motor_radius

    @property
    def exits(self) -> tuple[int, ...]:
        """The sides on which something leaves through the silicone."""
        return self.sides if self.exit else ()


def concentric(spec: Spec, core_height: float, exit: Exit | None) -> Dimensions:
    """Return the dimensions of a unit whose layers are rings, or cups, round the motor's axis.

    `core_height` is the height of the core that Layer 1 is cast on, mm.
    """
    motor, fpcb = spec.motor, spec.fpcb
    inner = spec.diameter_mm / 2 - sum(layer.wall_mm for layer in spec.layers)
    radii = [inner + sum(layer.wall_mm for layer in spec.layers[: i + 1]) for i in range(len(spec.layers))]
    radii[-1] = spec.diameter_mm / 2
    caps = [layer.cap_mm for layer in spec.layers]
    cavity = motor.diameter_mm / 2 if motor.fill else inner
    low, edge = motor_low(spec), lip_edge(spec)
    back, taper = low + motor.thickness_mm, math.tan(math.radians(spec.moulds.draft_deg))
    return Dimensions(
        cavity_radius=cavity,
        radii=tuple(radii),
        core_height=core_height,
        heights=tuple(core_height + sum(caps[: i + 1]) for i in range(len(caps))),
        motor_radius=motor.diameter_mm / 2,
        motor_height=back,
        pad=Pad(fpcb.pad_diameter_mm / 2, back, back + fpcb.thickness_mm) if fpcb else None,
        exit=exit,
        ledge_radius=cavity - spec.moulds.ledge_mm,
        sides=(1, -1) if fpcb and fpcb.tail == "both" else (1,) if fpcb or spec.wires else (),
        motor_low=low,
        mouth_radius=motor.diameter_mm / 2 - motor.lip_mm if motor.lip_mm else 0.0,
        lip_edge=edge,
        skin=spec.skin_mm,
        # A filled cavity is as wide as the motor all the way up.
        tapers=(0.0 if motor.fill else taper, taper),
    )


def lip_edge(spec: Spec) -> float:
    """Return the height of a lip's upright edge, mm: whole layers of the base; 0 without a lip."""
    layer = spec.moulds.layer_mm
    return math.ceil(LIP_EDGE / layer - EPS) * layer if spec.motor.lip_mm else 0.0


def motor_low(spec: Spec) -> float:
    """Return the distance of the motor from the skin, mm: its edge on the cone of the lip."""
    cone = spec.motor.lip_mm / math.tan(math.radians(LIP_LEAN_DEG))
    # Up to a hundredth, clear of the grid that the cone is snapped to.
    return lip_edge(spec) + math.ceil(100 * cone + 0.2) / 100 if cone else 0.0


def whole_layers(spec: Spec, z: float) -> float:
    """Return the height (mm over the skin) nearest to `z` at which a layer of the base ends."""
    seat = spec.moulds.plate_mm + spec.moulds.plinth_height_mm
    return layers_of(spec).nearest(seat + z) - seat


def slot_exit(spec: Spec, low: float, inside: tuple[float, float], width: float) -> Exit:
    """Return a slot with silicone over it, its floor moved from z = `low` to a whole layer of the base.

    It is not moved if `inside` (its content, from z to z, mm) would no longer fit, or the cups' wall under the window
    would get thinner than the least wall.
    """
    snapped, height = whole_layers(spec, low), spec.moulds.slot_height_mm
    if snapped <= inside[0] + EPS and snapped + height >= inside[1] - EPS and snapped >= _least_floor(spec):
        low = snapped
    return Exit(low, low + height, width)


def _least_floor(spec: Spec) -> float:
    """Return the least height of an exit over the skin: the cups have a wall under its window, mm."""
    return spec.moulds.least_wall_mm + spec.moulds.window_clearance_mm - EPS


def wire_exit(spec: Spec, top: float, core: float | None = None) -> Exit | None:
    """Return the exit of a spec's wires, side by side, whose passage ends at z = `top`; None without wires.

    Under a cap, `core` is the core's top (mm), and all of the slot moves to a whole layer. A notch keeps its open top:
    its floor moves down to one, if the wall under it remains.
    """
    wires = spec.wires
    if not wires:
        return None
    pitch = wires.diameter_mm + WIRE_GAP
    across = tuple((i - (wires.count - 1) / 2) * pitch for i in range(wires.count))
    width = spec.moulds.slot_width_clearance_mm + wires.count * pitch - WIRE_GAP
    low = top - spec.moulds.slot_height_mm
    if core is not None:
        upper = core - WIRE_GAP
        return replace(slot_exit(spec, low, (upper - wires.diameter_mm, upper), width), wires_y=across)
    snapped = whole_layers(spec, low)
    snapped -= spec.moulds.layer_mm if snapped > low + EPS else 0.0
    return Exit(snapped if snapped >= _least_floor(spec) else low, top, width, across)


def growth(spec: Spec) -> float:
    """Return the size of the poured silicone over that of the cured unit."""
    return 1 / (1 - spec.moulds.shrinkage_percent / 100)


def poured(spec: Spec, dims: Dimensions) -> Dimensions:
    """Return the dimensions of the silicone as it is poured: it shrinks from them to the unit's."""
    return dims.scaled(growth(spec)) if spec.moulds.shrinkage_percent else dims

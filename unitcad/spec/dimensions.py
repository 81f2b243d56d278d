"""The lengths that follow from an effective spec (mm): one place for designs, moulds and drawings to read them from."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.spec.models import Spec

MOTOR_CLEARANCE = 0.1
"""Least ring of air between the motor and Layer 1, mm, unless `motor.fill` closes it."""

TIP_PROUD = 0.2
"""How far a tongue for wires stands proud of the core, mm, so that Layer 1 clears them; for a circuit it is as much."""
WIRE_GAP = 0.1
"""Between wires side by side, and between them and what is next to them, mm."""


@dataclass(frozen=True)
class Dimensions:
    """A unit's radii and heights; z = 0 is the skin.

    cavity_radius   r of the cavity and so of the core; Layer 1 begins there
    radii[i]        outer radius of layer i
    core_height     top of the core: motor, and in the encapsulating design the circuit on it
    heights[i]      top of layer i
    slot_z          (bottom, top) of the slot or, in the embedded design, the notch of tail or wires; None without one
    wires_y         where the wires' axes lie across the exit; their tops lie a gap below the core's
    slot_width      of the slot and the tongue in it
    ledge_radius    where the tongue's tip stops in the core
    sides           where the tail leaves: +1 along +x, -1 along -x
    """

    cavity_radius: float
    radii: tuple[float, ...]
    core_height: float
    heights: tuple[float, ...]
    motor_radius: float
    motor_height: float
    pad_radius: float | None
    circuit_z: tuple[float, float] | None
    wires_y: tuple[float, ...]
    slot_z: tuple[float, float] | None
    slot_width: float
    ledge_radius: float
    sides: tuple[int, ...]

    @property
    def outer_radius(self) -> float:
        """D / 2."""
        return self.radii[-1]

    @property
    def air_ring(self) -> float:
        """Width of the ring of air between motor and Layer 1."""
        return self.cavity_radius - self.motor_radius


def dimensions(spec: Spec) -> Dimensions:
    """The dimensions of an effective spec (motor sizes and mould values filled in)."""
    motor, fpcb, wires, moulds = spec.motor, spec.fpcb, spec.wires, spec.moulds
    assert motor.diameter_mm is not None
    assert motor.thickness_mm is not None
    encapsulating = spec.design == "encapsulating"
    motor_radius = motor.diameter_mm / 2
    inner = spec.diameter_mm / 2 - sum(layer.wall_mm for layer in spec.layers)
    radii = [inner + sum(layer.wall_mm for layer in spec.layers[: i + 1]) for i in range(len(spec.layers))]
    radii[-1] = spec.diameter_mm / 2
    core = motor.thickness_mm + (fpcb.thickness_mm if fpcb and encapsulating else 0.0)
    caps = [layer.cap_mm or 0.0 for layer in spec.layers]
    heights = tuple(core + sum(caps[: i + 1]) for i in range(len(caps)))
    height, width = moulds.slot_height_mm or 0.0, moulds.slot_width_clearance_mm or 0.0
    slot, wires_y = None, ()
    if fpcb and encapsulating:
        middle = motor.thickness_mm + fpcb.thickness_mm / 2
        slot, width = (middle - height / 2, middle + height / 2), width + fpcb.tail_width_mm
    if wires:
        top = core + (TIP_PROUD if encapsulating else 0.0)
        pitch = wires.diameter_mm + WIRE_GAP
        wires_y = tuple((i - (wires.count - 1) / 2) * pitch for i in range(wires.count))
        slot, width = (top - height, top), width + wires.count * pitch - WIRE_GAP
    cavity = motor_radius if motor.fill else inner
    return Dimensions(
        cavity_radius=cavity,
        radii=tuple(radii),
        core_height=core,
        heights=heights,
        motor_radius=motor_radius,
        motor_height=motor.thickness_mm,
        pad_radius=fpcb.pad_diameter_mm / 2 if fpcb and fpcb.pad_diameter_mm else None,
        circuit_z=(motor.thickness_mm, motor.thickness_mm + fpcb.thickness_mm) if fpcb else None,
        slot_z=slot,
        wires_y=wires_y,
        slot_width=width if slot else 0.0,
        ledge_radius=cavity - moulds.ledge_mm,
        sides=(1, -1) if fpcb and fpcb.tail == "both" else (1,) if fpcb or wires else (),
    )

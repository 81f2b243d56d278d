"""The lengths that follow from an effective spec (mm): one place for designs, moulds and drawings to read them from."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.spec.models import Spec

MOTOR_CLEARANCE = 0.1
"""Least ring of air between the motor and Layer 1, mm, unless `motor.fill` closes it."""


@dataclass(frozen=True)
class Dimensions:
    """A unit's radii and heights; z = 0 is the skin.

    cavity_radius   r of the cavity and so of the core; Layer 1 begins there
    radii[i]        outer radius of layer i
    core_height     top of the core: motor, and in the encapsulating design the circuit on it
    heights[i]      top of layer i
    slot_z          (bottom, top) of the tail's slot; None without one
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
    motor, fpcb, moulds = spec.motor, spec.fpcb, spec.moulds
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
    slot = None
    if fpcb and encapsulating:
        assert moulds.slot_height_mm is not None
        middle = motor.thickness_mm + fpcb.thickness_mm / 2
        slot = (middle - moulds.slot_height_mm / 2, middle + moulds.slot_height_mm / 2)
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
        slot_width=(fpcb.tail_width_mm + (moulds.slot_width_clearance_mm or 0.0)) if fpcb else 0.0,
        ledge_radius=cavity - moulds.ledge_mm,
        sides=() if not fpcb else (1,) if fpcb.tail == "one" else (1, -1),
    )

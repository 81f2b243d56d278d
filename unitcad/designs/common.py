"""What both designs share: motor, circuit or wires, and the slot that lets the tail out.

z
|   .--------- pad, radius pad_radius ---------.========== tail ===  circuit_z
|      .------- motor, radius motor_radius ----.
0------'---------------------------------------'------------------- skin
"""

from __future__ import annotations

from unitcad.shape import Shape, box, cut, cylinder, moved, turned, union
from unitcad.spec import Dimensions, Spec
from unitcad.spec.dimensions import WIRE_GAP

BEYOND = 1.0
"""How far a cutting tool reaches past what it cuts, mm: never in one plane with it."""


def motor(dims: Dimensions) -> Shape:
    """The motor as a cylinder standing on the skin."""
    return cylinder(dims.motor_radius, 0, dims.motor_height)


def circuit(spec: Spec, dims: Dimensions) -> Shape:
    """Pad and tails of the flexible circuit. The tail starts inside the pad, so that the union has one outline."""
    assert spec.fpcb is not None
    assert dims.circuit_z is not None
    assert dims.pad_radius is not None
    low, high = dims.circuit_z
    half, reach = spec.fpcb.tail_width_mm / 2, dims.outer_radius + spec.fpcb.tail_length_mm
    tails = (box(min(0, s * reach), max(0, s * reach), -half, half, low, high) for s in dims.sides)
    return union((cylinder(dims.pad_radius, low, high), *tails))


def wires(spec: Spec, dims: Dimensions) -> list[Shape]:
    """The wires, from just off the motor's side out along +x, side by side, a gap below the core's top."""
    assert spec.wires is not None
    radius = spec.wires.diameter_mm / 2
    lying = turned(cylinder(radius, dims.motor_radius + WIRE_GAP, dims.outer_radius + spec.wires.length_mm), "y", 1)
    return [moved(lying, 0, y, dims.core_height - WIRE_GAP - radius) for y in dims.wires_y]


def strip(dims: Dimensions, side: int, reach: float, half_width: float, z0: float, z1: float) -> Shape:
    """A flat strip that leaves radially on one side, from the ledge's round riser outwards to x = `reach` (mm)."""
    flat = box(min(0, side * reach), max(0, side * reach), -half_width, half_width, z0, z1)
    return cut(flat, [cylinder(dims.ledge_radius, z0 - BEYOND, z1 + BEYOND)])


def slots(dims: Dimensions) -> list[Shape]:
    """The passages of tails or wires through every layer, open outwards; one that ends at the top is open upwards."""
    if not dims.slot_z:
        return []
    low, high = dims.slot_z
    high += BEYOND if high >= dims.heights[0] else 0.0
    return [strip(dims, side, dims.outer_radius + BEYOND, dims.slot_width / 2, low, high) for side in dims.sides]

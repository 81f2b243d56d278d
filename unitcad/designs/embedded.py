"""The embedded design: concentric open rings round the motor; the circuit's pad is on top and touches every layer.

------------------- FPCB pad over all layers
| L2 | L1 |  motor  | L1 | L2 |
============== skin ===========
"""

from __future__ import annotations

import math

from unitcad import catalogue
from unitcad.designs import limits
from unitcad.designs.design import ADHESIVE, Design, Fitting, Reason, bond, motor_hold, slots
from unitcad.designs.dimensions import Dimensions, Outline, concentric, motor_low, wire_exit
from unitcad.errors import Refusal
from unitcad.shape import Revolve, Shape, cut, polygon
from unitcad.spec import Spec
from unitcad.spec.raw import RawSpec
from unitcad.text import number


def layers(spec: Spec, dims: Dimensions) -> dict[str, Shape]:
    """Draw layer i: the tube from the radius of the one inside it to its own, as high as the motor, less the notch."""

    def section(i: int) -> Outline:
        inside = dims.outside(i - 1)
        return (inside[0], *dims.outside(i), *inside[:0:-1])

    return {f"layer{i + 1}": cut(Revolve(polygon(*section(i))), slots(dims)) for i in range(len(dims.heights))}


def dimensions(spec: Spec) -> Dimensions:
    """Return the dimensions: the core is as high as the motor; wires leave through a notch, a tail over the top."""
    height = motor_low(spec) + spec.motor.thickness_mm
    return concentric(spec, height, wire_exit(spec, height))


def check(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal for caps, and for lengths that do not fit each other or the printer."""
    for i, layer in enumerate(spec.layers):
        if layer.cap_mm:
            raise Refusal(
                f"layers.{i}.cap_mm", layer.cap_mm, "an embedded layer is an open ring and has no cap; leave it out"
            )
    limits.check_motor(spec, dims)
    _check_circuit(spec, dims)
    limits.check_wires(spec, dims)
    if dims.exit:
        limits.check_slot_height(spec, DESIGN.wire_sides)
        limits.check_under_window(spec, dims, dims.exit)
    limits.check_printer(spec)
    printer = catalogue.printers(spec.printers)[spec.moulds.printer]
    floor = float(printer.least_flat_wall_mm)
    limits.at_least(
        "motor.thickness_mm",
        dims.motor_height,
        min(spec.moulds.engraving_depth_mm, float(printer.engraving_depth_mm)) + floor,
        f"the first cup is as high as the motor, and its lettering leaves a floor of {floor:g} from",
    )
    limits.check_engraving(spec, dims)
    limits.check_seat(spec)


def _check_circuit(spec: Spec, dims: Dimensions) -> None:
    fpcb = spec.fpcb
    if not fpcb:
        return
    pad = fpcb.pad_diameter_mm
    limits.at_most("fpcb.pad_diameter_mm", pad, spec.diameter_mm, "the pad stays on the body, whose diameter is")
    outermost = 2 * (dims.radii[-2] if len(dims.radii) > 1 else dims.cavity_radius)
    limits.at_least(
        "fpcb.pad_diameter_mm", pad, outermost + 0.2, "the embedded pad covers every layer, so it reaches at least"
    )
    limits.at_most("fpcb.tail_width_mm", fpcb.tail_width_mm, pad, "the tail is no wider than the pad, which has")


def advice(spec: Spec, dims: Dimensions) -> list[str]:
    """Warn if nothing holds the motor."""
    if spec.fpcb or spec.motor.fill:
        return []
    return [
        "motor.fill = false: without a circuit's pad nothing holds the motor in an embedded unit; fill the ring of "
        "air round it, or set motor.fill = true"
    ]


def pad_radius(asked: RawSpec, cavity_radius: float) -> float:
    """Return the default radius of the pad: over every layer, half a millimetre or half a wall short of the edge."""
    return asked.diameter_mm / 2 - min(0.5, asked.layers[-1].wall_mm / 2)


def assembly(spec: Spec, dims: Dimensions) -> list[Fitting]:
    """Write how motor and circuit, or wires, go into the ring."""
    hold = f" {motor_hold(spec, dims)}" if spec.motor.fill or spec.fpcb else ""
    if spec.fpcb and not spec.wires:
        text = (
            f"Solder the motor to the circuit's pad and try it. {bond('the pad', 'the layers')} Set the motor into the "
            f"ring, the pad on top of all layers.{hold}"
        )
        return [Fitting(text, ("soldering iron and solder", ADHESIVE), place="in")]
    text = "Set the motor into the ring from above, its leads out at the back."
    if spec.wires:
        text = "Push the motor into the ring from above, the wires lying in the notch."
    steps = [Fitting(f"{text}{hold}", place="in")]
    if hold:
        return steps
    ring = (
        f"Nothing else holds it: lay the body on a greased flat, centre the motor, and fill the ring of "
        f"{number(dims.air_ring, 3)} mm round it with Layer 1's silicone. motor.fill = true draws Layer 1 up to the "
        "motor instead."
    )
    volume = math.pi * (dims.cavity_radius**2 - dims.motor_radius**2) * dims.motor_height
    return [*steps, Fitting(ring, ("petroleum jelly",), silicone=1, mixed="ring", volume_mm3=volume, place="home")]


def skipped_tooling(spec: Spec) -> list[Reason]:
    """Name the tooling that an open ring does without."""
    reasons = [("filament and its hole", "embedded: open rings have no suction")]
    if spec.fpcb:
        reasons.insert(0, ("tongue and slot", "embedded: the circuit is on the rings"))
    return reasons


DESIGN = Design(
    name="embedded",
    about="open rings round the motor, the circuit over all layers",
    layers=layers,
    dimensions=dimensions,
    limits=check,
    advice=advice,
    pad_radius=pad_radius,
    wire_sides=1,
    tooling="concentric",
    opens="above",
    passes=1.0,
    assembly=assembly,
    skipped=skipped_tooling,
)

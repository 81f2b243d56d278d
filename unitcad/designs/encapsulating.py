"""The encapsulating design: each layer a wall and a cap over the one inside it; the circuit touches Layer 1 only.

.-----------------.  heights[1]
| .-------------. |  heights[0]
| |  FPCB pad   | |  core_height
|L|L|  motor  |L|L=  the slot of a tail
|2|1|         |1|2|
======= skin ======
"""

from __future__ import annotations

from unitcad import catalogue
from unitcad.designs import limits
from unitcad.designs.design import ADHESIVE, Design, Fitting, bond, motor_hold, slots
from unitcad.designs.dimensions import (
    MOTOR_CLEARANCE,
    Dimensions,
    Exit,
    Outline,
    concentric,
    motor_low,
    slot_exit,
    wire_exit,
)
from unitcad.designs.limits import allowed_strain, pad_strain, tail_strain, widest_tail_end
from unitcad.errors import Refusal
from unitcad.shape import Revolve, Shape, cut, polygon
from unitcad.spec import Spec
from unitcad.spec.raw import LEAST_TAIL, FpcbTable

TIP_PROUD = 0.2
"""Height of a tongue for wires above the core, mm, so that Layer 1 clears them, before it moves to a layer."""


def layers(spec: Spec, dims: Dimensions) -> dict[str, Shape]:
    """Draw layer i: wall and cap in one profile, less the slots of tails or wires."""

    def section(i: int) -> Outline:
        inside, outside = dims.outside(i - 1), dims.outside(i)
        top, below = outside[-1][1], inside[-1][1]
        return (inside[0], *outside, (0.0, top), (0.0, below), *inside[:0:-1])

    return {f"layer{i + 1}": cut(Revolve(polygon(*section(i))), slots(dims)) for i in range(len(dims.heights))}


def dimensions(spec: Spec) -> Dimensions:
    """Return the dimensions: the core holds motor and circuit; tail or wires leave through a slot at its top."""
    fpcb, moulds = spec.fpcb, spec.moulds
    back = motor_low(spec) + spec.motor.thickness_mm
    core = back + (fpcb.thickness_mm if fpcb else 0.0)
    exit = wire_exit(spec, core + TIP_PROUD, core)
    if fpcb and not exit:
        low = back + fpcb.thickness_mm / 2 - moulds.slot_height_mm / 2
        exit = slot_exit(spec, low, (back, core), moulds.slot_width_clearance_mm + fpcb.tail_width_mm)
    return concentric(spec, core, exit)


def check(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal for missing caps, and for lengths that do not fit each other or the printer."""
    for i, layer in enumerate(spec.layers):
        if not layer.cap_mm:
            raise Refusal(f"layers.{i}.cap_mm", None, "every encapsulating layer has a cap", layer.wall_mm)
    limits.check_motor(spec, dims)
    if spec.fpcb and dims.exit:
        _check_circuit(spec, dims, spec.fpcb, dims.exit)
    limits.check_wires(spec, dims)
    if dims.exit:
        limits.check_slot_height(spec, DESIGN.wire_sides)
        moulds = spec.moulds
        limits.at_least(
            "layers.0.cap_mm",
            spec.layers[0].cap_mm,
            moulds.least_wall_mm + moulds.window_clearance_mm + dims.exit.high - dims.core_height,
            f"with a {limits.leaving(spec)}, the cup's wall over the window needs a first cap of at least",
        )
        limits.check_under_window(spec, dims, dims.exit)
    limits.check_printer(spec)
    limits.check_engraving(spec, dims)
    limits.check_seat(spec)
    limits.check_filament(spec, dims)


def _check_circuit(spec: Spec, dims: Dimensions, fpcb: FpcbTable, exit: Exit) -> None:
    tail, pad, end = fpcb.tail_width_mm, fpcb.pad_diameter_mm, fpcb.tail_end_width_mm
    widest = limits.widest_exit(spec, dims)
    clearance = spec.moulds.window_clearance_mm
    if widest < LEAST_TAIL:
        # No tail fits: the refusal names the clearance if that is the cause, otherwise the core, not the tail.
        most = limits.down(clearance - (tail - widest) / 2)
        if clearance > LEAST_TAIL and most > 0:
            limit = f"the ledge leaves room for a tail of {tail:g} mm up to a clearance of {most:g} mm"
            raise Refusal("moulds.window_clearance_mm", clearance, limit, most)
        limit = f"the core must have room for the ledge next to a tail, whose least width is {LEAST_TAIL:g} mm"
        raise limits.wider_core(spec, limits.core_for(spec, LEAST_TAIL) - dims.cavity_radius, limit)
    limits.at_most(
        "fpcb.tail_width_mm",
        tail,
        widest,
        "half the tail is at most 0.7 of the core's radius and keeps off the ledge's ends, so the tail at most",
    )
    limits.at_most(
        "fpcb.pad_diameter_mm",
        pad,
        2 * dims.core_outline[-1][0],
        "the encapsulated pad touches Layer 1 only, so it stays in the cavity of",
    )
    limits.at_least("fpcb.pad_diameter_mm", pad, tail, "the pad is no narrower than the tail, which has")
    limits.at_least("fpcb.tail_end_width_mm", end, tail, "the tail's end is no narrower than it,")
    if end > tail:
        allowed = allowed_strain(spec, catalogue.materials(spec.materials))
        limits.at_most(
            "fpcb.tail_end_width_mm",
            end,
            widest_tail_end(fpcb, exit, allowed),
            f"passing the slot would stretch it by {tail_strain(fpcb, exit):.0%}, and the silicone takes "
            f"{allowed:.0%} with its margin: solder the end on after, widen moulds.slot_width_clearance_mm, "
            "or make the end at most",
        )


def advice(spec: Spec, dims: Dimensions) -> list[str]:
    """Warn if the pad has no clearance in the cavity."""
    if not dims.pad or dims.pad.radius <= dims.cavity_radius - MOTOR_CLEARANCE + limits.EPS:
        return []
    return [
        f"fpcb.pad_diameter_mm = {2 * dims.pad.radius:g} mm leaves no clearance in the cavity "
        f"of {2 * dims.cavity_radius:g} mm"
    ]


def assembly(spec: Spec, dims: Dimensions) -> list[Fitting]:
    """Write how motor and circuit, or wires, go into the cavity."""
    solder = ("soldering iron and solder",)
    if spec.wires:
        fed = (
            "Lay the unit down, the cavity's mouth up. Feed the wires out through the slot from inside. Leave the "
            "motor before the cavity's mouth."
        )
        steps = [Fitting(fed, place="fed")]
    elif spec.fpcb and dims.exit:
        steps = [
            Fitting(
                "Solder the motor to the circuit's pad and try it. Lay the unit down, the cavity's mouth up. Feed the "
                "tail out through the slot from inside, but leave pad and motor before the cavity's mouth.",
                solder,
                place="fed",
            )
        ]
        strain = pad_strain(spec.fpcb, dims.exit)
        if spec.fpcb.tail == "both" and strain:
            next_unit = (
                f"The next pad of the circuit does not pass the slot: that would stretch it by {strain:.0%}. Solder "
                "the next unit on after this one is in its silicone."
            )
            steps.append(Fitting(next_unit, solder))
    else:
        laid = "Lay the unit down, the cavity's mouth up, and the motor next to it, its back up."
        steps = [Fitting(laid, place="beside")]
    back, moved_in = ("the pad", "pad and motor") if spec.fpcb else ("the motor's back", "the motor")
    way = "through the lip" if dims.mouth_radius else "from the skin's side"
    fixed = (
        f"{bond(back, 'the cap of Layer 1')} Push {moved_in} in {way} until {back} lies against that "
        f"cap. {motor_hold(spec, dims)}"
    )
    return [*steps, Fitting(fixed, (ADHESIVE,), place="in")]


DESIGN = Design(
    name="encapsulating",
    about="walls and caps over the motor, the circuit inside Layer 1",
    layers=layers,
    dimensions=dimensions,
    limits=check,
    advice=advice,
    wire_sides=2,
    tooling="concentric",
    suction=True,
    caps=True,
    passes=2.0,
    assembly=assembly,
    default=True,
)

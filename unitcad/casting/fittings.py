"""How motor and circuit go into the body, or into the mould, and where they are in the picture of each step."""

from __future__ import annotations

from dataclasses import replace

from unitcad.designs.design import ADHESIVE, Fitting, bond
from unitcad.moulds.mould_set import MouldSet


def fittings(moulds: MouldSet) -> tuple[Fitting, ...]:
    """Return the sentences of the assembly: the design's own, or usual ones.

    If none of them places motor and circuit, the last one shows them in place.
    """
    given = moulds.plan.assembly
    if given is None:
        words = moulds.design.assembly(moulds.spec, moulds.dimensions)
        given = tuple(each if isinstance(each, Fitting) else Fitting(each) for each in words)
    found = given or _usual(moulds)
    if found and not any(fitting.place for fitting in found):
        return (*found[:-1], replace(found[-1], place="home"))
    return found


def _usual(moulds: MouldSet) -> tuple[Fitting, ...]:
    spec, design, leaves = moulds.spec, moulds.design, lead(moulds)
    found = []
    if spec.fpcb:
        found.append(
            Fitting("Solder the motor to the circuit's pad, and try the motor.", ("soldering iron and solder",))
        )
    elif spec.wires:
        found.append(Fitting("Try the motor on its wires."))
    if design.laid_in:
        lay = "Lay everything that is not silicone where the drawing of this pour shows it."
        return (*found, Fitting(lay, place="in"))
    below, what = design.opens == "below", "the pad" if spec.fpcb else "the motor's back"
    ahead, side = ", the pad ahead," if spec.fpcb and below else "", "the skin's side" if below else "above"
    way = f", and lay the {leaves} in the notch" if leaves else ""
    if is_fed_through(moulds):
        way = ""
        fed = f"Feed the {leaves} out through the slot from inside. Leave the motor before the cavity's mouth."
        found.append(Fitting(fed, place="fed"))
    push = (
        f"{bond(what, 'Layer 1')} Push the motor{ahead} into the cavity from {side}{way}. The design's file says no "
        "more of the assembly."
    )
    return (*found, Fitting(push, (ADHESIVE,), place="in"))


def is_fed_through(moulds: MouldSet) -> bool:
    """Tell whether a tail or wires are led out through a closed slot before the motor is pushed in."""
    exit = moulds.dimensions.exit
    return bool(exit) and exit.high < moulds.dimensions.heights[0] and moulds.design.opens == "below"


def lead(moulds: MouldSet) -> str:
    """Return the name of the part that leads out of the silicone."""
    return "tail" if moulds.spec.fpcb else "wires" if moulds.spec.wires else ""

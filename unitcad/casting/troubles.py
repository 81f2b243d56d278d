"""Faults at the bench, each with its cause, a remedy for now and a change of the spec."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from unitcad.moulds.mould_set import MouldSet

TROUBLES = "troubleshooting.md"
"""The file of a result that has them."""
_Part = Literal["cup", "tongue", "filament", "slot", "motor"]
_VACUUM = "casting.vacuum = true, or "


@dataclass(frozen=True)
class Trouble:
    """A fault: its sign and cause, a remedy for now and a change of the spec."""

    sign: str
    cause: str
    now: str
    spec: str


_KNOWN: tuple[tuple[_Part | None, str, str, str, str], ...] = (
    (
        None,
        "Silicone stays tacky",
        "The parts were weighed or mixed wrong, or a surface inhibits the cure: latex, sulphur clay, fresh resin.",
        "Touch the rest in the mixing cup. If it is soft, the mix was wrong: cast again. If it is firm, a surface "
        "inhibits: wait a day, clean with isopropanol, coat the mould.",
        "casting.minimum_mix_g larger, since a small batch can't be weighed well.",
    ),
    (
        None,
        "Silicone is torn",
        "It was opened too early, lifted over a tongue, or levered only on one side.",
        "Close a small tear with silicone adhesive. Cast again if it runs through the slot or into the bond.",
        "the torn layer's wall_mm larger (Layer 1 is layers.0), or a silicone with more elongation at break.",
    ),
    (
        "cup",
        "A layer sticks in its cup",
        "Silicone grips the print's layer lines, and only the last cup may get release agent.",
        "Push it out with a thumb. Put an inner layer back on the core and go on.",
        "moulds.layer_mm smaller.",
    ),
    (
        "filament",
        "The unit sticks on the core",
        "No air gets under it, or silicone grips the core's layer lines.",
        "Check that the filament is out. Lift the edge with a blunt spatula all round and let in a drop of "
        "isopropanol.",
        "moulds.layer_mm smaller.",
    ),
    (
        None,
        "A bubble opens at the skin",
        "Air stayed in the mix or in the corner of the seat.",
        "Fill the hole with a drop of the same mix, strike it off and let it cure.",
        f"{_VACUUM}a silicone that flows more easily.",
    ),
    (
        "slot",
        "The circuit won't pass the slot",
        "The tail's end is wider than the slot stretches, or a film closes the slot.",
        "Cut the film. Wet the tail with isopropanol. Solder a wide end on after the tail is through.",
        "moulds.slot_width_clearance_mm or moulds.slot_height_mm larger.",
    ),
    (
        "cup",
        "A cup rocks or sits high",
        "The first layer bulges, a string is in between, or ribs are too tight.",
        "Cut the bulge off, scrape both faces, press the cup on again.",
        "moulds.rib_interference_mm smaller or moulds.plinth_clearance_mm larger: the fit coupon shows which.",
    ),
    (
        "tongue",
        "A film closes the slot",
        "The tongue was not home, or grease did not close the gap round it.",
        "Cut the film along the slot with a sharp knife before the motor goes in.",
        "moulds.window_clearance_mm smaller: the fit coupon shows how far.",
    ),
    (
        "motor",
        "The motor juts out of the skin",
        "It is thicker than the spec says.",
        "Nothing helps this unit: the cavity is too shallow.",
        "motor.thickness_mm as the caliper shows it; then print again.",
    ),
)
"""Part of a mould set that has the fault, None for every set; then as `Trouble`."""


def troubles(moulds: MouldSet | None = None) -> tuple[Trouble, ...]:
    """Return the troubles that a set can have; all of them without a set."""
    spec = moulds and moulds.spec
    there = {tool.kind for tool in moulds.plan.tools} if moulds else set[str]()
    if spec:
        there |= {*([] if spec.motor.absent else ["motor"])}
        there |= {"slot"} if spec.fpcb and "tongue" in there else set()
    had = spec is not None and spec.casting.vacuum
    return tuple(
        Trouble(sign, cause, now, change.removeprefix(_VACUUM) if had else change)
        for part, sign, cause, now, change in _KNOWN
        if not moulds or part is None or part in there
    )


def troubles_markdown(these: Iterable[Trouble]) -> str:
    """Write troubles as a page."""
    lines = ["# Troubleshooting", ""]
    for trouble in these:
        lines += [f"## {trouble.sign}", "", f"- Cause: {trouble.cause}", f"- Now: {trouble.now}"]
        lines += [f"- In the spec: {trouble.spec}", ""]
    return "\n".join(lines[:-1]) + "\n"

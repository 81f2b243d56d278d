"""Faults at the bench, each with its cause, a remedy for now and a change of the spec."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from unitcad.casting.sentences import say
from unitcad.moulds.mould_set import MouldSet

TROUBLES = "troubleshooting.md"
"""The file of a result that has them."""
_Part = Literal["cup", "tongue", "filament", "slot", "motor"]


@dataclass(frozen=True)
class Trouble:
    """A fault: its sign and cause, a remedy for now and a change of the spec."""

    sign: str
    cause: str
    now: str
    spec: str


_KNOWN: dict[str, _Part | None] = {
    "tacky": None,
    "torn": None,
    "layer_sticks": "cup",
    "unit_sticks": "filament",
    "bubble": None,
    "circuit_stops": "slot",
    "cup_rocks": "cup",
    "film_in_slot": "tongue",
    "motor_juts_out": "motor",
}
"""Each trouble by its table in `procedure.toml`, with the part of a mould set that has it; None: every set."""


def troubles(moulds: MouldSet | None = None) -> tuple[Trouble, ...]:
    """Return the troubles that a set can have; all of them without a set."""
    spec = moulds and moulds.spec
    there = {tool.kind for tool in moulds.plan.tools} if moulds else set[str]()
    if spec:
        there |= {*([] if spec.motor.absent else ["motor"])}
        there |= {"slot"} if spec.fpcb and "tongue" in there else set()
    had = spec is not None and spec.casting.vacuum
    return tuple(
        Trouble(
            say(f"{name}.sign"),
            say(f"{name}.cause"),
            say(f"{name}.now"),
            say("bubble.spec_vacuum" if had and name == "bubble" else f"{name}.spec"),
        )
        for name, part in _KNOWN.items()
        if not moulds or part is None or part in there
    )


def troubles_markdown(these: Iterable[Trouble]) -> str:
    """Write troubles as a page."""
    lines = ["# Troubleshooting", ""]
    for trouble in these:
        lines += [f"## {trouble.sign}", "", f"- Cause: {trouble.cause}", f"- Now: {trouble.now}"]
        lines += [f"- In the spec: {trouble.spec}", ""]
    return "\n".join(lines[:-1]) + "\n"

"""A casting in two or three lines, for a terminal and the live page: pours, times, grams, bubbles that stay."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from unitcad.casting.time_line import duration
from unitcad.text import listed, number

STAY, LATE = "Such bubbles stay", "All this ends"
"""How a pour's verdict begins to say that bubbles do not rise out, and that the pot life is over before the end."""


def in_short(procedure: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line each: pours and times, what to mix, and what goes wrong in a pour.

    `procedure` is a `Procedure` as plain data, as casting.json has it.
    """
    grams: dict[str, float] = defaultdict(float)
    for item in procedure["bill"]:  # the pours' own, and of an array with pockets those of the units
        if item["unit"] == "g":
            grams[item["item"].removesuffix(" part A").removesuffix(" part B")] += item["quantity"]
    total, bench = duration(procedure["earliest_finish_min"]), duration(procedure["bench_min"])
    pours = procedure["pours"]
    count = f"{len(pours)} pour{'s' if len(pours) > 1 else ''}"
    yield f"{count}, ready {total} after the print, of which {bench} at the bench"
    yield "to mix: " + ", ".join(f"{number(mass, 3)} g of {name}" for name, mass in grams.items())
    verdicts = [(f"pour {pour['index']} ({pour['material']})", pour["verdict"]) for pour in pours]
    yield from (f"warning: {line}" for line in pour_warnings(verdicts))


def pour_warnings(verdicts: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield what goes wrong in pours, by their names and verdicts: bubbles that stay, a pot life that is too short."""
    pours = list(verdicts)
    if held := [name for name, verdict in pours if STAY in verdict]:
        yield f"without a vacuum bubbles stay in {listed(held)}; casting.md says what to do"
    if late := [name for name, verdict in pours if LATE in verdict]:
        yield f"mixing and pouring outlast the pot life in {listed(late)}; casting.md says what to do"

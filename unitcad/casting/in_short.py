"""A casting in two or three lines, for a terminal and the live page: pours, times, grams, bubbles that stay."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

from unitcad.casting.time_line import duration
from unitcad.text import listed, number

STAY = "Such bubbles stay"
"""How a pour's verdict begins to say that bubbles do not rise out by themselves."""


def in_short(procedure: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line each: pours and times, what to mix, and the pours whose bubbles stay for want of a vacuum.

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
    if held := [f"pour {pour['index']} ({pour['material']})" for pour in pours if STAY in pour["verdict"]]:
        yield f"warning: without a vacuum bubbles stay in {listed(held)}; casting.md says what to do"

"""The step that joins the pieces of tools which are larger than the printer's bed, before the first pour."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from unitcad.casting.bench_step import BenchStep
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan
from unitcad.text import listed, number

if TYPE_CHECKING:
    from unitcad.moulds.dovetails import Seam, Split

JOIN_MIN = 3.0
"""To join two pieces and seal their seam (assumed)."""


def joining(moulds: MouldSet, picture: str) -> Iterator[BenchStep]:
    """Say how the pieces of split tools go together and how their seams are sealed."""
    plan = moulds.plan
    if not plan.splits:
        return
    called = {split.tool: plan.called(split.tool) for split in plan.splits}
    parts = listed(f"{called[split.tool]} in {len(split.pieces)} pieces" for split in plan.splits)
    below = called[plan.splits[0].tool]
    upper = [name for tool, name in called.items() if plan.tool(tool).kind == "cup"]
    play = number(plan.splits[0].seams[0].play, 2)
    grid = any(seam.across == "y" for split in plan.splits for seam in split.seams)
    numbered = "each engraved with its number from the left" + ", row by row from the back" * grid
    if any(inner(split) for split in plan.splits):
        numbered += "; a piece without an outer edge has none"
    rows = ", one row after the other" * grid
    around = ", cut out round the filaments' grooves" * bool(grid and plan.of_kind("stub"))
    text = (
        f"Printed in pieces, since they are larger than the bed: {parts}, {numbered}. "
        "Cut off the bulge of the first layer along their dovetails. Lay a piece flat on the bench, hold the next one "
        f"over it and push it straight down, dovetail into dovetail{rows}, until a fingernail feels no step between "
        f"their faces. They have {play} mm of play all round; scrape dovetails that jam. Then seal each seam from "
        f"outside, never on a face that silicone touches: tape over the underside of the {below}{around} and over the "
        "ends of the seam"
    )
    if upper:
        text += (
            f"; petroleum jelly rubbed into the underside of {listed(upper)} and wiped off flush, since tape would "
            f"keep a cup off its seat. The tape stays on until the {below} is off. {_in_line(plan)}"
        )
    text += f". Silicone that gets into a seam cures to a fin {play} mm thick: pull it off with the flash."
    yield BenchStep("Join the pieces", text, picture, minutes=JOIN_MIN * sum(len(s.pieces) - 1 for s in plan.splits))


def _in_line(plan: Plan) -> str:
    """Say what holds the pieces of each cup in line: the pins, but where base and cup are cut at the same gap."""
    base, *cups = plan.splits
    if plan.tool(base.tool).kind != "base":
        return "The pins hold the pieces of each cup in line"
    same = [seam for seam in base.seams if any(_same_gap(plan, seam, other) for cup in cups for other in cup.seams)]
    if not same:
        return "The pins hold the pieces of each cup in line"
    x, y = plan.layout.plate
    where = listed(
        f"{number(seam.at + x if seam.across == 'x' else y - seam.at, 3)} mm from the base's "
        f"{'left end' if seam.across == 'x' else 'back'}"
        for seam in same
    )
    return (
        f"The pins hold the pieces of each cup to the base; but where base and cup are cut at the same gap ({where}), "
        "nothing but dovetails and tape holds them in line. Keep the base on one flat board from now on, and before "
        "each pour lay the blade's edge over that seam on the cup's rim: no light may show under it on either side"
    )


def _same_gap(plan: Plan, one: Seam, other: Seam) -> bool:
    """Tell whether two seams go through the same gap: no unit stands between them."""
    low, high = sorted((one.at, other.at))
    return one.across == other.across and not any(
        low < (cell.x if one.across == "x" else cell.y) < high for cell in plan.layout.cells
    )


def inner(split: Split) -> bool:
    """Tell whether a piece lies between others on all sides."""
    return min(split.columns, len(split.pieces) // split.columns) > 2

"""C100: the cavity that tools and earlier layers leave is the layer, and nothing more.

It compares what was drawn as a unit with what was drawn as tools, and knows of neither how it was drawn.
"""

from __future__ import annotations

from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, at_most
from unitcad.moulds.cavities import BALANCE, Cavity
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Look at every cavity of every pour."""
    pours = zip(moulds.plan.steps, moulds.cavities, strict=True)
    return [finding for step, cells in pours for finding in of_pour(step, cells)]


def of_pour(step: Step, cells: list[Cavity]) -> list[MouldFinding]:
    """Return a finding a cell: each component that holds a layer equals it."""
    found = []
    for i, (drawn, holding) in enumerate(cells):
        # What one has and the other lacks, both ways.
        differ = abs(holding.volume() + drawn.volume() - 2 * (holding ^ drawn).volume())
        where = f"pour {step.index}" + (f" cell {i + 1}" if len(cells) > 1 else "")
        found.append(at_most("C100", where, differ / drawn.volume(), BALANCE, "share of the layer"))
    return found


CHECK = MouldCheck(
    "C100", "balance and leak: the cavity that tools and earlier layers leave is the layer, and nothing more", findings
)

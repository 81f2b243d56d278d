"""The order in which pieces are removed, and the direction of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from unitcad.moulds.plan import Plan


@dataclass(frozen=True)
class Removal:
    """One removal after pour `step`: the piece, its direction, and the tools that stay.

    The layers that are there stay too. The unit is peeled off the core last; that is C310's.
    """

    step: int
    piece: str
    direction: tuple[int, int, int]
    stays: tuple[str, ...]


def removals(plan: Plan) -> Iterator[Removal]:
    """Yield every movement in its order: lid, tongues, cup, a pour at a time; at the end the filaments."""
    for step in plan.steps:
        there = list(step.tools)
        pieces = [tool for kind in ("lid", "tongue", "cup") for tool in plan.standing(step, kind)]
        for piece in pieces:
            there.remove(piece.name)
            if piece.removal:
                yield Removal(step.index, piece.name, piece.removal, tuple(there))
    last = plan.steps[-1]
    there = [tool.name for kind in ("base", "stub") for tool in plan.standing(last, kind)]
    for piece in plan.standing(last, "stub"):
        there.remove(piece.name)
        if piece.removal:
            yield Removal(last.index, piece.name, piece.removal, tuple(there))

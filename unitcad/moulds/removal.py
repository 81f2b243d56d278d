"""A removal after a pour: a piece and its direction. A step's removals are in their order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from unitcad.shape import Shape
from unitcad.shape.body import Body

CAST = "cast"
"""Stands for the silicone of all pours so far, bonded, in the place of a tool's name."""
Way = tuple[float, float, float]
"""A direction of any length but 0."""


@dataclass(frozen=True)
class Removal:
    """One movement: a tool's name, or `CAST`, and the direction in which it is taken away.

    Silicone bends, so its parts may leave in ways of their own: `part` names one, `within` is the space that it fills;
    None is all that is still there.
    """

    piece: str
    direction: Way
    part: str = ""
    within: Shape | None = None


def customary(standing: Sequence[Body], *, last: bool) -> Iterator[Removal]:
    """Yield the removals of moulds that a unit is peeled off: lid, tongues, cup; after the last pour the filaments.

    `standing` are the tools of the pour. A piece without a way of its own stays. The peel itself is C310's.
    """
    for kind in ("lid", "tongue", "cup", *(("filament",) if last else ())):
        for piece in standing:
            if piece.kind == kind and piece.removal:
                yield Removal(piece.name, piece.removal)

"""The engraving of tools that are printed in pieces: each piece is told by a number, where it has an outer edge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from unitcad.arrays.array import Box
from unitcad.arrays.larger_than_bed import intervals
from unitcad.moulds.cuts import BESIDE
from unitcad.moulds.dovetails import Interval, Seam
from unitcad.moulds.labels import row, row_width
from unitcad.shape import Shape, moved, turned
from unitcad.shape.lettering import HEIGHT

STEP = 0.5
"""Between two places that are tried for a text, mm."""
Side = Literal["top", "bottom", "left", "right"]


class Strip(NamedTuple):
    """The strip of a tool that texts stand on, all round inside `outer` and away from it by `inset`, mm.

    `stroke` of the characters; `heights` from z to z that are engraved. Pieces are looked at for a side of the tool in
    the order `first`, then the rest. `taken`: what texts keep clear of; where that is None they stand in the middle.
    """

    outer: Box
    inset: float
    stroke: float
    heights: Interval
    first: Side
    taken: Sequence[Box] | None = None


def on_pieces(strip: Strip, text: str, seams: Sequence[Seam]) -> list[Shape]:
    """Draw a text on each piece of a tool, with the piece's number where the tool is cut.

    A piece without an outer edge has none.
    """
    x0, y0, x1, y1 = strip.outer
    columns, rows = intervals((x0, x1), seams, "x"), intervals((y0, y1), seams, "y")[::-1]
    letters: list[Shape] = []
    for j, along in enumerate(rows):
        for i, across in enumerate(columns):
            ends: tuple[tuple[Side, bool], ...] = (
                ("top", j == 0),
                ("bottom", j == len(rows) - 1),
                ("left", i == 0),
                ("right", i == len(columns) - 1),
            )
            there: list[Side] = [side for side, free in ends if free]
            side: Side | None = strip.first if strip.first in there else next(iter(there), None)
            if side:
                texts = [text, str(j * len(columns) + i + 1)][: 1 + bool(seams)]
                letters += _on_side(strip, side, texts, across if side in ("top", "bottom") else along)
    return letters


def _on_side(strip: Strip, side: Side, texts: Sequence[str], within: Interval) -> Iterator[Shape]:
    """Draw texts on one side of the strip, beside each other, within an interval along it."""
    x0, y0, x1, y1 = strip.outer
    high, width = HEIGHT * strip.stroke, row_width(texts, strip.stroke)
    if side in ("top", "bottom"):
        y = y0 + strip.inset if side == "bottom" else y1 - strip.inset - high
        taken = None if strip.taken is None else [(b[0], b[2]) for b in strip.taken if b[1] < y + high and b[3] > y]
        x = _start(within, width, taken, strip.inset if within[0] == x0 else BESIDE)
        yield from row(texts, strip.stroke, (x, y), strip.heights)
    else:
        # Read from the right, from below to above.
        x = x0 + strip.inset + high if side == "left" else x1 - strip.inset
        taken = None if strip.taken is None else [(b[1], b[3]) for b in strip.taken if b[0] < x and b[2] > x - high]
        y = _start(within, width, taken, strip.inset if within[0] == y0 else BESIDE)
        yield from (moved(turned(c, "z", 1), x, y) for c in row(texts, strip.stroke, (0.0, 0.0), strip.heights))


def _start(within: Interval, width: float, taken: Sequence[Interval] | None, margin: float) -> float:
    """Return where a text begins: in the middle, or beside its margin and clear of what is taken."""
    if taken is None:
        return (within[0] + within[1] - width) / 2
    first = at = within[0] + margin
    while any(low < at + width + BESIDE / 2 and high > at - BESIDE / 2 for low, high in taken):
        at += STEP
        if at + width > within[1]:
            return first
    return at

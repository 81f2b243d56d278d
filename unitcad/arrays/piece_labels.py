"""The engraving of tools that are printed in pieces: each piece is told by a number, where it has an outer edge."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
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


def on_pieces(strip: Strip, rows: Sequence[Sequence[str]], seams: Sequence[Seam]) -> list[Shape]:
    """Draw a row of texts on each piece of a tool: the first of the `rows` that has room there, else the last.

    Where the tool is cut the piece's number stands after them. A piece without an outer edge has none.
    """
    x0, y0, x1, y1 = strip.outer
    columns, lines = intervals((x0, x1), seams, "x"), intervals((y0, y1), seams, "y")[::-1]
    letters: list[Shape] = []
    for j, along in enumerate(lines):
        for i, across in enumerate(columns):
            ends: tuple[tuple[Side, bool], ...] = (
                ("top", j == 0),
                ("bottom", j == len(lines) - 1),
                ("left", i == 0),
                ("right", i == len(columns) - 1),
            )
            free: list[Side] = [side for side, there in ends if there]
            within: dict[Side, Interval] = {side: across if side in ("top", "bottom") else along for side in free}
            number = [str(j * len(columns) + i + 1)] if seams else []
            letters += _on_piece(strip, [[*each, *number] for each in rows], within)
    return letters


def _on_piece(strip: Strip, rows: Sequence[Sequence[str]], within: Mapping[Side, Interval]) -> Iterator[Shape]:
    """Draw a row of texts on one of a piece's sides; `within`: the piece's interval along each."""
    sides = sorted(within, key=lambda side: side != strip.first)
    for texts, side in product(rows, sides):
        start = _start(strip, side, texts, within[side])
        if start is not None:
            yield from _on_side(strip, side, texts, start)
            return
    if sides:
        side = sides[0]
        yield from _on_side(strip, side, rows[-1], within[side][0] + _margin(strip, side, within[side]))


def _on_side(strip: Strip, side: Side, texts: Sequence[str], start: float) -> Iterator[Shape]:
    """Draw texts on one side of the strip, beside each other, from `start` along it."""
    x0, y0, x1, y1 = strip.outer
    high = HEIGHT * strip.stroke
    if side in ("top", "bottom"):
        y = y0 + strip.inset if side == "bottom" else y1 - strip.inset - high
        yield from row(texts, strip.stroke, (start, y), strip.heights)
    else:
        # Read from the right, from below to above.
        x = x0 + strip.inset + high if side == "left" else x1 - strip.inset
        yield from (moved(turned(c, "z", 1), x, start) for c in row(texts, strip.stroke, (0.0, 0.0), strip.heights))


def _start(strip: Strip, side: Side, texts: Sequence[str], within: Interval) -> float | None:
    """Return where texts begin on a side: in the middle, or beside its margin, clear of what is taken; None: nowhere.

    `within` is the piece's interval along that side.
    """
    width, margin = row_width(texts, strip.stroke), _margin(strip, side, within)
    if strip.taken is None:
        return (within[0] + within[1] - width) / 2 if width + 2 * margin <= within[1] - within[0] else None
    axis = 0 if side in ("top", "bottom") else 1
    ends = strip.outer[1 - axis], strip.outer[3 - axis]
    deep = strip.inset + HEIGHT * strip.stroke
    low, high = (ends[1] - deep, ends[1]) if side in ("top", "right") else (ends[0], ends[0] + deep)
    taken = [(b[axis], b[2 + axis]) for b in strip.taken if b[1 - axis] < high and b[3 - axis] > low]
    at = within[0] + margin
    while at + width <= within[1]:
        if not any(start < at + width + BESIDE / 2 and end > at - BESIDE / 2 for start, end in taken):
            return at
        at += STEP
    return None


def _margin(strip: Strip, side: Side, within: Interval) -> float:
    """Return how far from an end of a piece a text begins: from a seam, or from the tool's own edge, mm."""
    edge = strip.outer[0 if side in ("top", "bottom") else 1]
    return strip.inset if within[0] == edge else BESIDE

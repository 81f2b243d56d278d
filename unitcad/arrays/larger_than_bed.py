"""Where an array's tools that are larger than the bed are cut: between columns, clear of what stands there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from unitcad.arrays.array import Array
from unitcad.errors import Refusal
from unitcad.moulds.dovetails import DEPTH, TIP, Interval
from unitcad.shape import mm

EDGE = 0.5
"""From a tooth to the sheet's edge, at least, mm: beyond it a groove would cut the tooth."""


def taken(array: Array, reach: Iterable[float], more: Iterable[Interval] = ()) -> Iterator[Interval]:
    """Yield what the tools' features take along x: each place to `reach` on either side, strap slots, round corners.

    `reach` is in the order of the places; `more`: what the tools have besides.
    """
    sheet = array.sheet
    x0, _, x1, _ = sheet.outline
    yield from ((place.x - r, place.x + r) for place, r in zip(array.places, reach, strict=True))
    yield from ((slot[0], slot[2]) for slot in sheet.strap_slots)
    yield from ((x0 - 1e3, x0 + sheet.corner_mm), (x1 - sheet.corner_mm, x1 + 1e3))
    yield from more


def across(array: Array) -> Interval:
    """Return where along y the teeth of a seam may stand: within the sheet, clear of the groove round it.

    Raises Refusal for a sheet that is too narrow for one.
    """
    _, y0, _, y1 = array.sheet.outline
    least = TIP + 2 * EDGE
    if y1 - y0 < least:
        needed = array.sheet.margin_mm + (least - (y1 - y0)) / 2
        limit = f"its tools are larger than the bed; a dovetail between their pieces needs a sheet {least:.3g} mm wide"
        raise Refusal("sheet.margin_mm", array.sheet.margin_mm, limit, mm(needed + 0.005))
    return y0 + EDGE, y1 - EDGE


def pieces(ends: Interval, cuts: Sequence[float]) -> list[Interval]:
    """Return what each piece of a tool has to itself along x, between the teeth at its ends."""
    marks = [ends[0] - DEPTH / 2, *cuts, ends[1] + DEPTH / 2]
    return [(a + DEPTH / 2, b - DEPTH / 2) for a, b in pairwise(marks)]

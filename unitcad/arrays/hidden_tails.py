"""Tails of units in pockets that end between sheet and skin, where nothing can be joined to them any more."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from unitcad.arrays.array import Array, Placed, Sheet
from unitcad.arrays.construction import construction_of
from unitcad.arrays.layouts import Point
from unitcad.arrays.tail_ways import Tail, in_the_way, tail_length, tails
from unitcad.designs import dimensions
from unitcad.designs.limits import EPS
from unitcad.geometry.segments import to_box
from unitcad.text import listed, number

MOST_NAMES = 12
"""Places that a warning names before it counts the others."""


@dataclass(frozen=True)
class HiddenTail:
    """A tail, or a bundle of wires, whose end the sheet covers.

    short_mm    from its end to where all of its width is out, along it
    length_mm   of the tail that would come out, beyond the unit's edge
    field       the spec's key of that length
    blocked_by  what stands in the straight way there; "" where it is free
    """

    place: str
    short_mm: float
    length_mm: float
    field: str
    blocked_by: str


def hidden_tails(array: Array) -> tuple[HiddenTail, ...]:
    """Return the tails that end under the sheet, in the order of places; () where the sheet covers none."""
    if not construction_of(array.construction, array.cast).own_tails:
        return ()
    points = [Point(place.name, place.x, place.y) for place in array.places]
    radii = [place.radius for place in array.places]
    laid = [_tails(place, i) for i, place in enumerate(array.places)]
    found = []
    for i, place in enumerate(array.places):
        exit = dimensions(place.unit).exit
        if exit is None or exit.high > array.sheet.low + EPS:
            continue  # the tail lies on the sheet
        ahead = [_short(tail, array.sheet) for tail in laid[i]]
        if max(ahead, default=0.0) <= EPS:
            continue
        length = tail_length(place.unit) + max(ahead)
        near = sorted(
            (j for j in range(len(points)) if j != i), key=lambda j: math.dist(points[i][1:3], points[j][1:3])
        )
        blocked = in_the_way(_tails(place, i, length), i, points, radii, near, laid, array.sheet.strap_slots)
        field = "fpcb.tail_length_mm" if place.unit.fpcb else "wires.length_mm"
        found.append(HiddenTail(place.name, round(max(ahead), 2), _typed(length), field, blocked))
    return tuple(found)


def where_they_end(hidden: Sequence[HiddenTail], most_names: int = 0) -> str:
    """Say how far before the sheet's edge tails end, measured along them, the farthest last."""

    def short(tail: HiddenTail) -> float:
        return float(number(tail.short_mm, 2))

    groups = groupby(sorted(hidden, key=short), key=short)
    first, *others = (f"{number(way)} mm%s at {_names(same, most_names)}" for way, same in groups)
    return listed([first % " before its edge, measured along the tail,", *(other % "" for other in others)])


def longer_tails(hidden: Sequence[HiddenTail], most_names: int = 0) -> str:
    """Say which tails would reach the sheet's edge if they were longer, and which have no straight way there."""

    def wanted(tail: HiddenTail) -> tuple[str, float]:
        return tail.field, tail.length_mm

    free = sorted((tail for tail in hidden if not tail.blocked_by), key=wanted)
    said = [
        f"With {field} = {number(length)} {_names(same, most_names)} would reach the edge."
        for (field, length), same in groupby(free, key=wanted)
    ]
    if stopped := [tail for tail in hidden if tail.blocked_by]:
        said.append(f"No straight way out is free at {_names(stopped, most_names)}.")
    return " ".join(said)


def hidden_tails_warning(array: Array) -> list[str]:
    """Return the warning of tails that end under the sheet; [] where none does."""
    hidden = hidden_tails(array)
    if not hidden:
        return []
    return [
        f"tails end under the sheet, {where_they_end(hidden, MOST_NAMES)}. {longer_tails(hidden, MOST_NAMES)} "
        "Solder wires to a tail that stays under the sheet before its unit goes in"
    ]


def _tails(place: Placed, owner: int, length: float | None = None) -> list[Tail]:
    return tails(place.unit, place.x, place.y, place.angle_deg, owner, length)


def _short(tail: Tail, sheet: Sheet) -> float:
    """Return how far a tail has to go on until all of its width is out of the sheet's outline, mm."""
    long = math.hypot(tail.x1 - tail.x0, tail.y1 - tail.y0)
    along = (tail.x1 - tail.x0) / long, (tail.y1 - tail.y0) / long
    aside = -along[1] * tail.half, along[0] * tail.half
    starts = ((tail.x1 + side * aside[0], tail.y1 + side * aside[1]) for side in (-1, 0, 1))
    return max(_out(start, along, sheet) for start in starts)


def _out(start: tuple[float, float], along: tuple[float, float], sheet: Sheet) -> float:
    """Return the way from a point along a direction out of the sheet's outline, mm; 0 from a point outside.

    The outline is convex, so the way is halved until it is known.
    """
    x0, y0, x1, y1 = sheet.outline
    r = sheet.corner_mm
    inner = x0 + r, y0 + r, x1 - r, y1 - r

    def inside(way: float) -> bool:
        at = start[0] + way * along[0], start[1] + way * along[1]
        return to_box(at, at, inner) <= r

    low, high = 0.0, math.hypot(x1 - x0, y1 - y0)
    if not inside(low):
        return 0.0
    while high - low > EPS / 2:
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) else (low, middle)
    return high


def _typed(length: float) -> float:
    """Return a length to type, mm: the next tenth that is not shorter."""
    return math.ceil(length * 10 - 1e-3) / 10


def _names(tails: Iterable[HiddenTail], most: int) -> str:
    """Return the tails' places in words; with a `most` only so many, and the number of the others."""
    names = [tail.place for tail in tails]
    return listed([*names[:most], f"{len(names) - most} others"] if 0 < most < len(names) else names)

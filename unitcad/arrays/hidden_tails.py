"""Tails of units in pockets that end between sheet and skin, where nothing can be joined to them any more."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.construction import construction_of
from unitcad.arrays.layouts import Point
from unitcad.arrays.tail_ways import Tail, candidates, ends_hidden, in_the_way, tail_length, tails, to_edge
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
    angle_deg   at which the tail as it is would come out; None where none of the angles that are tried is free
    """

    place: str
    short_mm: float
    length_mm: float
    field: str
    blocked_by: str
    angle_deg: float | None


def hidden_tails(array: Array) -> tuple[HiddenTail, ...]:
    """Return the tails that end under the sheet, in the order of places; () where the sheet covers none."""
    if not construction_of(array.construction, array.cast).own_tails:
        return ()
    points = [Point(place.name, place.x, place.y) for place in array.places]
    radii = [place.radius for place in array.places]
    laid = [_tails(place, i) for i, place in enumerate(array.places)]
    found = []
    for i, place in enumerate(array.places):
        if not ends_hidden(place.unit, laid[i], array.sheet):
            continue
        short = to_edge(laid[i], array.sheet)
        length = tail_length(place.unit) + short
        near = sorted(
            (j for j in range(len(points)) if j != i), key=lambda j: math.dist(points[i][1:3], points[j][1:3])
        )
        blocked = in_the_way(_tails(place, i, length), i, points, radii, near, laid, array.sheet.strap_slots)
        field = "fpcb.tail_length_mm" if place.unit.fpcb else "wires.length_mm"

        def free(angle: float, place: Placed = place, i: int = i, near: Sequence[int] = near) -> bool:
            """Tell whether the tail as it is comes out at an angle."""
            turned = tails(place.unit, place.x, place.y, angle, i)
            if ends_hidden(place.unit, turned, array.sheet):
                return False
            return not in_the_way(turned, i, points, radii, near, laid, array.sheet.strap_slots)

        turn = next((angle for angle in candidates(points[i]) if free(angle)), None)
        found.append(HiddenTail(place.name, round(short, 2), _typed(length), field, blocked, turn))
    return tuple(found)


def where_they_end(hidden: Sequence[HiddenTail], most_names: int = 0) -> str:
    """Say how far before the sheet's edge tails end, measured along them, the farthest last."""

    def short(tail: HiddenTail) -> float:
        return float(number(tail.short_mm, 2))

    groups = groupby(sorted(hidden, key=short), key=short)
    first, *others = (f"{number(way)} mm%s at {_names(same, most_names)}" for way, same in groups)
    return listed([first % " before its edge, measured along the tail,", *(other % "" for other in others)])


def longer_tails(hidden: Sequence[HiddenTail], most_names: int = 0) -> str:
    """Say which tails would come out turned, which if they were longer, and which have no straight way there."""

    def wanted(tail: HiddenTail) -> tuple[str, float]:
        return tail.field, tail.length_mm

    turned = [(tail.angle_deg, tail) for tail in hidden if tail.angle_deg is not None]
    said = [
        f"With angle_deg = {number(angle)} {_names((tail for _, tail in same), most_names)} would come out as it is."
        for angle, same in groupby(sorted(turned, key=lambda pair: pair[0]), key=lambda pair: pair[0])
    ]
    straight = [tail for tail in hidden if tail.angle_deg is None]
    free = sorted((tail for tail in straight if not tail.blocked_by), key=wanted)
    said += [
        f"With {field} = {number(length)} {_names(same, most_names)} would reach the edge."
        for (field, length), same in groupby(free, key=wanted)
    ]
    if stopped := [tail for tail in straight if tail.blocked_by]:
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


def _typed(length: float) -> float:
    """Return a length to type, mm: the next tenth that is not shorter."""
    return math.ceil(length * 10 - 1e-3) / 10


def _names(tails: Iterable[HiddenTail], most: int) -> str:
    """Return the tails' places in words; with a `most` only so many, and the number of the others."""
    names = [tail.place for tail in tails]
    return listed([*names[:most], f"{len(names) - most} others"] if 0 < most < len(names) else names)

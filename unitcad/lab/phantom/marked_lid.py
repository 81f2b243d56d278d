"""What is cut out of the phantom's lid: the unit's seat, a hole for each point along +x from its edge, and numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import count, pairwise

from unitcad.errors import Refusal
from unitcad.shape import Shape, box, cylinder, moved, union
from unitcad.shape.lettering import HEIGHT, engraving, text_width

POINT_RADIUS = 1.25
LEAST_APART = 2 * POINT_RADIUS + 1.0
"""Between two points, mm: the holes of nearer ones would leave no wall."""
_FROM_HOLE, _FROM_SEAT, _APART = 2.0, 1.0, 1.0
"""Of a number to its hole's edge, to the seat's, and to another number, mm."""

Box = tuple[float, float, float, float]
"""Least and largest x and y: x0, y0, x1, y1."""


def expect_apart(points_mm: Sequence[float]) -> None:
    """Raise Refusal for points whose holes in the lid would meet."""
    for one, other in pairwise(sorted(points_mm)):
        if other - one < LEAST_APART:
            limit = f"{one:g} and {other:g} are nearer than {LEAST_APART:g} mm: their holes in the lid would meet"
            raise Refusal("points_mm", list(points_mm), limit)


def marks(
    points_mm: Sequence[float], seat_radius: float, stroke: float, depth: float, low: float, high: float
) -> list[Shape]:
    """Draw what is cut out of a lid from `low` to `high`; numbers are engraved `depth` deep by `stroke`. All in mm."""
    points = sorted(points_mm)
    tools: list[Shape] = [cylinder(seat_radius, low - 1.0, high + 1.0)]
    for distance, (x0, y0, _, _) in zip(points, numbers(points, seat_radius, stroke), strict=True):
        tools.append(moved(cylinder(POINT_RADIUS, low - 1.0, high + 1.0), seat_radius + distance, 0.0))
        tools.append(moved(_number(f"{distance:g}", stroke, high - depth, high + 1.0), x0, y0))
    return tools


def numbers(points: Sequence[float], seat_radius: float, stroke: float) -> list[Box]:
    """Return where the number of each point stands: beside its hole, above and below in turn, clear of what is cut.

    `points` rise. A number moves along +x to clear the seat, and a row outwards to clear the numbers before it.
    """
    placed: list[Box] = []
    height = HEIGHT * stroke
    for i, distance in enumerate(points):
        width = _width(f"{distance:g}", stroke)
        for row in count():
            near = POINT_RADIUS + _FROM_HOLE + (row // 2) * (height + _APART)
            y0 = near if (row + i) % 2 == 0 else -near - height
            clear = math.sqrt(max((seat_radius + _FROM_SEAT) ** 2 - near**2, 0.0))
            x0 = max(seat_radius + distance - width / 2, clear)
            place = (x0, y0, x0 + width, y0 + height)
            if not any(_meet(place, other) for other in placed):
                placed.append(place)
                break
    return placed


def _meet(one: Box, other: Box) -> bool:
    return (
        one[0] < other[2] + _APART
        and other[0] < one[2] + _APART
        and one[1] < other[3] + _APART
        and other[1] < one[3] + _APART
    )


def _width(text: str, stroke: float) -> float:
    return sum(text_width(part, stroke) for part in text.split(".")) + 3 * stroke * text.count(".")


def _number(text: str, stroke: float, z0: float, z1: float) -> Shape:
    """Draw a number, its decimal point a square of one stroke, the lower left corner at the origin."""
    whole, _, rest = text.partition(".")
    if not rest:
        return engraving(whole, stroke, z0, z1)
    x = text_width(whole, stroke) + stroke
    point = box(x, x + stroke, 0.0, stroke, z0, z1)
    return union((engraving(whole, stroke, z0, z1), point, moved(engraving(rest, stroke, z0, z1), x + 2 * stroke)))

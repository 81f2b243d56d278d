"""Points one by one."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import Meta

from unitcad.arrays.layouts import LayoutKind, Point, needs
from unitcad.errors import Refusal
from unitcad.spec.raw import Table

Coordinate = Annotated[float, Meta(ge=-1000, le=1000)]


class ListTable(Table, frozen=True, kw_only=True):
    """The centres [x, y] of the units in their order, in any frame; they are named P1, P2 ... in it."""

    kind: Literal["list"] = "list"
    points_mm: Annotated[
        tuple[tuple[Coordinate, Coordinate], ...],
        Meta(min_length=1, max_length=1024, description="centres as [x, y], at least one; they are named P1, P2 ..."),
    ]


def points(table: ListTable, radius: float | None) -> tuple[Point, ...]:
    """Return the points as they are listed, the middle of their box at the origin."""
    xs, ys = zip(*table.points_mm, strict=True)
    middle = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    return tuple(Point(f"P{i + 1}", x - middle[0], y - middle[1], 0, i) for i, (x, y) in enumerate(table.points_mm))


def wider(table: ListTable, radius: float | None, pair: tuple[Point, Point], distance: float) -> Refusal:
    """Refuse the later point; the nearest accepted one is on the line from the other through it."""
    one, other = sorted(pair, key=lambda point: point.column)
    away = math.hypot(other.x - one.x, other.y - one.y)
    ux, uy = ((other.x - one.x) / away, (other.y - one.y) / away) if away else (1.0, 0.0)
    more = distance - away
    x, y = table.points_mm[other.column]
    outwards = [math.copysign(math.ceil(abs(v) * 1000) / 1000, v) for v in (ux * more, uy * more)]
    nearest = [round(x + outwards[0], 3), round(y + outwards[1], 3)]
    return Refusal(f"layout.points_mm.{other.column}", [x, y], needs(distance, pair), nearest)


NAMING = "Places are numbered as the file lists them. They are measured from the middle of the listed points' box."
LAYOUT = LayoutKind("list", "points one by one", ListTable, points, wider, NAMING)

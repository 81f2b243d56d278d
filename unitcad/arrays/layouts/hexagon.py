"""A hexagon of rings round one unit: 7 units in one ring, 19 in two, 37 in three."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import Meta

from unitcad.arrays.array_tables import Pitch
from unitcad.arrays.layouts import LayoutKind, Point, named, needs
from unitcad.designs.limits import up
from unitcad.errors import Refusal
from unitcad.spec.raw import Table


class HexTable(Table, frozen=True, kw_only=True):
    """Rings round the middle unit; `pitch_mm` from each unit to its six neighbours. Rows run along x."""

    kind: Literal["hex"] = "hex"
    rings: Annotated[
        int, Meta(ge=1, le=18, description="rings around the middle unit: 1 gives 7 units, 2 gives 19")
    ] = 2
    pitch_mm: Annotated[Pitch, Meta(description="distance between neighbours")]


def points(table: HexTable, radius: float | None) -> tuple[Point, ...]:
    """Return the points by rows from the top, in a row along x."""
    n, height = table.rings, math.sqrt(3) / 2
    found = []
    for row in range(2 * n + 1):
        count = 2 * n + 1 - abs(row - n)
        found += [
            Point(named(row, i), (i - (count - 1) / 2) * table.pitch_mm, (n - row) * height * table.pitch_mm, row, i)
            for i in range(count)
        ]
    return tuple(found)


def wider(table: HexTable, radius: float | None, pair: tuple[Point, Point], distance: float) -> Refusal:
    """Refuse the pitch."""
    return Refusal("layout.pitch_mm", table.pitch_mm, needs(distance, pair), up(distance))


LAYOUT = LayoutKind("hex", "a hexagon of 7, 19, 37 ... units", HexTable, points, wider)

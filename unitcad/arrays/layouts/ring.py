"""Bands round a limb: units at equal distances round it, one band next to the other along it."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from msgspec import Meta

from unitcad.arrays.array_tables import Pitch
from unitcad.arrays.layouts import LayoutKind, Point, named, needs
from unitcad.designs.limits import up
from unitcad.errors import Refusal
from unitcad.spec.raw import Table


class RingTable(Table, frozen=True, kw_only=True):
    """`count` units round the limb whose radius `limb.radius_mm` gives, in `bands`, `band_pitch_mm` along the limb."""

    kind: Literal["ring"] = "ring"
    count: Annotated[int, Meta(ge=2, le=200, description="units around the limb")]
    bands: Annotated[int, Meta(ge=1, le=50, description="number of bands along the limb")] = 1
    band_pitch_mm: Annotated[Pitch | None, Meta(description="distance between two bands")] = None


def points(table: RingTable, radius: float | None) -> tuple[Point, ...]:
    """Return the points by bands from the top, unrolled: x is the way round, at the radius that keeps its length."""
    if radius is None:
        raise Refusal("limb.radius_mm", None, "a ring needs the radius of the limb that it goes round", 40.0)
    if table.bands > 1 and table.band_pitch_mm is None:
        raise Refusal("layout.band_pitch_mm", None, f"{table.bands} bands need the distance between them", 40.0)
    pitch = 2 * math.pi * radius / table.count
    return tuple(
        Point(
            named(band, i),
            (i - (table.count - 1) / 2) * pitch,
            ((table.bands - 1) / 2 - band) * (table.band_pitch_mm or 0.0),
            band,
            i,
        )
        for band in range(table.bands)
        for i in range(table.count)
    )


def wider(table: RingTable, radius: float | None, pair: tuple[Point, Point], distance: float) -> Refusal:
    """Refuse the count of a band, or the distance of two bands."""
    if pair[0].row != pair[1].row:
        return Refusal("layout.band_pitch_mm", table.band_pitch_mm, needs(distance, pair), up(distance))
    fits = int(2 * math.pi * (radius or 0.0) / distance + 1e-9)
    return Refusal("layout.count", table.count, needs(distance, pair), fits if fits > 1 else None)


LAYOUT = LayoutKind("ring", "bands round a limb", RingTable, points, wider)

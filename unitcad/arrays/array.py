"""The resolved array, which `array_file` makes of a file and which the rest of this room reads.

The flat frame, in mm: z = 0 at the skin and upwards away from it, x along the columns and round the limb, y along the
rows' axis and the limb's. Seen from outside, rows are lettered from the top (the largest y), columns numbered along x.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from unitcad.arrays.array_tables import Cast, CircuitTable, Construction
from unitcad.designs import design_of
from unitcad.spec import Spec, to_data

Box = tuple[float, float, float, float]
"""(x0, y0, x1, y1), mm."""
OFF_ROUND = 0.05
"""Largest distance of a unit's outline from its disc, mm (assumed): a quarter of the usual hold."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A unit at its place (mm), turned about its axis counter-clockwise as seen from outside: its tail leaves there."""

    name: str
    x: float
    y: float
    angle_deg: float
    unit: Spec

    @property
    def radius(self) -> float:
        """Half the unit's diameter, mm."""
        return self.unit.diameter_mm / 2

    @property
    def reach(self) -> float:
        """Largest distance of its outline from its axis, mm."""
        return self.radius + (0.0 if design_of(self.unit).tooling == "concentric" else OFF_ROUND)


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """The silicone between the units, mm: from `low` to `high` above the skin, rounded corners, slots for straps.

    `hold_mm`: how much smaller than its unit's a pocket's radius is.
    """

    material: str
    low: float
    high: float
    margin_mm: float
    corner_mm: float
    outline: Box
    strap_slots: tuple[Box, ...]
    hold_mm: float

    @property
    def thickness_mm(self) -> float:
        """From the skin's side to the back."""
        return self.high - self.low


@dataclass(frozen=True, kw_only=True, repr=False)
class Array:
    """Units at their places on one sheet. `radius_mm`: of the limb, None if it is flat.

    `layout`: the table that the places came from. `asked`: plain data that gives the same array when read again.
    """

    name: str
    construction: Construction
    cast: Cast
    radius_mm: float | None
    layout: dict[str, Any]
    places: tuple[Placed, ...]
    sheet: Sheet
    circuit: CircuitTable | None
    asked: dict[str, Any]

    @cached_property
    def units(self) -> tuple[Spec, ...]:
        """The distinct units, the most frequent kind of place first among equals in the order of places."""
        found: list[Spec] = []
        for place in self.places:
            if not any(place.unit == unit for unit in found):
                found.append(place.unit)
        return tuple(found)

    @property
    def unit(self) -> Spec:
        """The unit of the places that name no other."""
        return self.units[0]

    @property
    def middle_radius_mm(self) -> float | None:
        """Radius of the sheet's middle round the limb, which keeps its length as the sheet is bent; None: worn flat."""
        return None if self.radius_mm is None else self.radius_mm + (self.sheet.low + self.sheet.high) / 2

    @property
    def back_radius_mm(self) -> float:
        """Distance of the sheet's back from the limb's axis; of a flat array from the skin."""
        return (self.radius_mm or 0.0) + self.sheet.high

    @cached_property
    def pitch_mm(self) -> float:
        """The least distance between two places' centres, mm; infinite for one place."""
        at = sorted((place.x, place.y) for place in self.places)
        least = math.inf
        for i, (x, y) in enumerate(at):
            for other_x, other_y in at[i + 1 :]:
                if other_x - x >= least:
                    break
                least = min(least, math.hypot(other_x - x, other_y - y))
        return least

    def paths_of(self, unit: Spec) -> tuple[str, ...]:
        """Return the paths at which `asked` has a unit: "unit." first, if it is the array's own, then its places."""
        return tuple(f"{path}." for path, table in units_in(self.asked).items() if table == to_data(unit))

    def __repr__(self) -> str:
        return f"Array({self.name!r}: {self.construction}, {len(self.places)} units of {self.unit.diameter_mm:g} mm)"


def units_in(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the units of an array's plain data, which nobody checked, by their paths: "unit" first, then of places."""
    places = data.get("place")
    tables = {f"place.{i}.unit": place for i, place in enumerate(places if isinstance(places, list) else ())}
    return {
        path: table["unit"]
        for path, table in {"unit": data, **tables}.items()
        if isinstance(table, Mapping) and "unit" in table
    }

"""What the tables `[layout]` and `[[place]]` of an array file speak of: a kind of layout, and points of it."""

from __future__ import annotations

from typing import Any

from unitcad.arrays.array_tables import AskedArray, PlaceTable
from unitcad.arrays.layouts import LayoutKind, Point, layouts
from unitcad.errors import Refusal, UnknownKey, unknown_name
from unitcad.spec import convert
from unitcad.spec.fields import fields_of
from unitcad.text import listed


def layout_of(asked: AskedArray) -> tuple[Any, LayoutKind]:
    """Return the layout's table and kind."""
    name = asked.layout.get("kind")
    if name is None:
        raise Refusal("layout.kind", None, f"is required: one of {', '.join(layouts())}")
    if not isinstance(name, str) or name not in layouts():
        raise unknown_name("layout.kind", str(name), layouts())
    kind = layouts()[name]
    own = set(fields_of(kind.table))
    of_others = {key for each in layouts().values() for key in fields_of(each.table)} - own
    if foreign := [key for key in asked.layout if key in of_others]:
        keys = listed([f"layout.{key}" for key in foreign])
        limit = f"unknown key; a layout of the kind {name!r} has no such keys: leave out {keys}"
        raise UnknownKey(f"layout.{foreign[0]}", asked.layout[foreign[0]], limit)
    return convert(asked.layout, kind.table, "layout"), kind


def places_of(asked: AskedArray, points: list[Point]) -> dict[int, int]:
    """Return the number of each point that a [[place]] speaks of, with that table's number."""
    found: dict[int, int] = {}
    for i, place in enumerate(asked.place):
        index = _number(place, i, points)
        if index in found:
            raise Refusal(f"place.{i}.at", _shown(place), f"place.{found[index]} speaks of it too")
        found[index] = i
    return found


def _number(place: PlaceTable, i: int, points: list[Point]) -> int:
    """Return the number of the point that a place speaks of."""
    if isinstance(place.at, str):
        names = [p.name for p in points]
        if place.at not in names:
            raise unknown_name(f"place.{i}.at", place.at, names)
        return names.index(place.at)
    column, row = place.at
    there = {(p.column + 1, p.row + 1): n for n, p in enumerate(points)}
    if (column, row) not in there:
        nearest = min(there, key=lambda at: (abs(at[0] - column) + abs(at[1] - row), at))
        raise Refusal(f"place.{i}.at", [column, row], "there is no such column and row", list(nearest))
    return there[column, row]


def _shown(place: PlaceTable) -> object:
    return place.at if isinstance(place.at, str) else list(place.at)

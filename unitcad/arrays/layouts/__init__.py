"""Layouts: places of the units of an array. Every file here that defines LAYOUT is one."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

from unitcad.errors import Refusal
from unitcad.spec.raw import Table


class Point(NamedTuple):
    """A place's name and centre, mm; rows and columns are numbered from 0 if the kind has them."""

    name: str
    x: float
    y: float
    row: int = 0
    column: int = 0


@dataclass(frozen=True)
class LayoutKind:
    """A kind by its name in a file.

    points   from the table and the radius round which a ring is measured (mm, None if it is flat) to the points, the
             origin in their middle; raises Refusal for a table that gives none
    wider    from the table, the radius, the numbers of two points and the distance that they need (mm) to the refusal
             that names the value which would give it
    naming   how its places are named, seen from outside
    """

    name: str
    about: str
    table: type[Table]
    points: Callable[[Any, float | None], tuple[Point, ...]]
    wider: Callable[[Any, float | None, tuple[Point, Point], float], Refusal]
    naming: str = "Rows are lettered from the top, columns numbered from the left."


def named(row: int, column: int) -> str:
    """Return a place's name from its row and column, both from 0: rows are A to Z, then AA, AB ..."""
    letters, left = "", row + 1
    while left:
        left, rest = divmod(left - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return f"{letters}{column + 1}"


def needs(distance: float, pair: tuple[Point, Point]) -> str:
    """Return the distance of two points and the one that they need (mm), in words."""
    one, other = pair
    there = ((one.x - other.x) ** 2 + (one.y - other.y) ** 2) ** 0.5
    return f"{one.name} and {other.name} are {there:.4g} mm apart and need {distance:.4g} mm"


MOST_PLACES = 1024


@cache
def layouts() -> dict[str, LayoutKind]:
    """Return the kinds of layout by name."""
    modules = (import_module(f"{__name__}.{file.name}") for file in pkgutil.iter_modules(__path__))
    return {module.LAYOUT.name: module.LAYOUT for module in modules if hasattr(module, "LAYOUT")}

"""What one picture of the procedure holds, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from unitcad.casting.bench_extras import Extra
from unitcad.export.picture_letters import Name
from unitcad.shape import Shape

ABOVE, UNDER, OVER, LOW = (0.55, -1.0, 0.62), (0.55, -1.0, -0.6), (0.25, -1.0, 1.2), (0.55, -1.0, 0.3)
"""Directions towards the eye."""

Offset = tuple[float, float, float]


@dataclass(frozen=True)
class Placed:
    """A piece by its name, moved from its place (mm); `half`: without its half nearer the eye."""

    name: str
    moved: Offset = (0.0, 0.0, 0.0)
    half: bool = False


@dataclass(frozen=True)
class View:
    """One picture. Views of one `eye` and `group` share their scale.

    `syringe_on`: channels that one stands on. `names` stand beside the points that they name; pieces laid out side by
    side are named by their own names. `turned`: the picture upside down, as what lies on its back is seen.
    """

    parts: tuple[Placed, ...]
    extras: tuple[Extra, ...] = ()
    eye: Offset = ABOVE
    group: Literal["moulds", "under", "pieces", "unit", "cut", "curved"] = "moulds"
    syringe_on: Shape | None = None
    names: tuple[Name, ...] = ()
    turned: bool = False

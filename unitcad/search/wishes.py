"""The limits of a target beside the level, and which candidates meet them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.search.candidates import Candidates
from unitcad.text import number


@dataclass(frozen=True)
class Limit:
    """A limit of the target: its key, what it limits in words, the unit, the most that is allowed, each row's value.

    A row whose value is NaN does not meet it.
    """

    key: str
    what: str
    unit: str
    most: float
    values: np.ndarray

    @property
    def met(self) -> np.ndarray:
        """Whether each row meets it."""
        return self.values <= self.most * (1 + 1e-9)

    def shown(self, row: int) -> str:
        """Return a row's value and the limit in words."""
        value, most = number(self.values[row], 3), number(self.most, 3)
        if np.isnan(self.values[row]):
            return f"{self.what}: none, since units would overlap or moulds can't be made (at most {most}{self.unit})"
        return f"{self.what} {value} of at most {most}{self.unit}"


def limits(found: Candidates) -> list[Limit]:
    """Return the limits that a target sets beside the level."""
    wish = found.target.wish
    asked = [
        ("diameter_max_mm", "diameter", " mm", wish.diameter_max_mm, found.diameter_mm),
        ("height_max_mm", "height", " mm", wish.height_max_mm, found.height_mm),
        ("mass_max_g", "mass", " g", wish.mass_max_g, found.mass_g),
        ("cure_hours_max", "cure", " h", wish.cure_hours_max, found.hours),
        ("crosstalk_ratio_max", "crosstalk ratio", "", wish.crosstalk_ratio_max, found.crosstalk),
    ]
    made = [Limit(key, what, unit, most, values) for key, what, unit, most, values in asked if most is not None]
    if wish.pitch_mm is not None:
        made.append(
            Limit("pitch_mm", "diameter, so that neighbours do not touch,", " mm", wish.pitch_mm, found.diameter_mm)
        )
    return made


def within(found: Candidates) -> np.ndarray:
    """Return the rows that meet every limit beside the level; there may be none."""
    met = np.array([limit.met for limit in limits(found)]).reshape(-1, found.count)
    return np.flatnonzero(met.all(axis=0))


def label(found: Candidates, row: int) -> str:
    """Return what a candidate is in a few words: design, silicones from the inside out, walls."""
    lengths = found.lengths(row)
    walls = " and ".join(f"{wall:g}" for wall in lengths.walls)
    motor = f", {lengths.motor}" if len(found.target.asked.at_hand.motors) > 1 else ""
    return f"{lengths.design} {'/'.join(found.materials(row))}, walls {walls} mm{motor}"

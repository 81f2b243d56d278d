"""The limits of a target against the candidates: who meets all, and what is the nearest where nobody does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.errors import Refusal
from unitcad.inverse.candidates import Candidates
from unitcad.inverse.ranking_order import novelty
from unitcad.text import listed, number


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
    """Return the rows that meet every limit beside the level. Raises Refusal with the nearest where none does."""
    made = limits(found)
    met = np.array([limit.met for limit in made]).reshape(len(made), found.count)
    if met.all(axis=0).any():
        return np.flatnonzero(met.all(axis=0))
    if len(alone := [limit for limit in made if not limit.met.any() and np.isfinite(limit.values).any()]) > 1:
        raise _none_alone(found, alone)
    for i, limit in enumerate(made):
        others = np.delete(met, i, axis=0).all(axis=0) & np.isfinite(limit.values)
        if others.any():
            raise _none(found, limit, others, " and meets the other limits" if len(made) > 1 else "")
    names = listed(f"target.{limit.key}" for limit in made)
    short = next((limit for limit in made if not limit.met.any() and np.isfinite(limit.values).any()), made[0])
    raise _none(found, short, np.isfinite(short.values), f" by itself; {names} are not met together")


def _none_alone(found: Candidates, alone: list[Limit]) -> Refusal:
    """Return the refusal of several limits none of which any candidate meets, each with its own nearest."""
    each = []
    for limit in alone:
        at = _least(found, limit.values, np.flatnonzero(np.isfinite(limit.values)))
        least = _up(float(limit.values[at]))
        each.append(f"target.{limit.key} = {limit.most:g}: {least:g}{limit.unit} is the least ({label(found, at)})")
    first = alone[0]
    least = _up(float(np.nanmin(first.values)))
    words = (
        f"none of {found.count} candidates is within it, nor within {listed(f'target.{one.key}' for one in alone[1:])}"
    )
    return Refusal(f"target.{first.key}", first.most, f"{words}: {'; '.join(each)}{_left_out(found)}", least)


def _left_out(found: Candidates) -> str:
    """Say which silicones were not tried."""
    names = list(found.silicones.left_out)
    return f"; not tried, without a modulus: {listed(names)}" if names else ""


def _hint(limit: Limit) -> str:
    """Say what a crosstalk ratio depends on."""
    if limit.key != "crosstalk_ratio_max":
        return ""
    return (
        "; only diameter, pitch, body and drive enter it: a larger target.pitch_mm or other vary.diameter_mm change it"
    )


def _none(found: Candidates, limit: Limit, rows: np.ndarray, how: str) -> Refusal:
    at = _least(found, limit.values, np.flatnonzero(rows))
    least = _up(float(limit.values[at]))
    words = f"none of {found.count} candidates is within it{how}; {limit.what} {least:g}{limit.unit} is the least"
    return Refusal(
        f"target.{limit.key}", limit.most, f"{words} ({label(found, at)}){_hint(limit)}{_left_out(found)}", least
    )


def check_level(found: Candidates, rows: np.ndarray, measured: bool = False) -> None:
    """Raise Refusal, with the nearest level that is possible, where no row meets the level probably enough.

    `measured`: a unit among them was measured within the wish.
    """
    wish = found.target.wish
    most = float(np.max(found.probability[rows]))
    if measured or most >= wish.probability_min:
        return
    of = f"none of {rows.size} candidates within the limits" if rows.size < found.count else f"none of {found.count}"
    share, percent = wish.probability_min, 100 * wish.probability_min
    missed = f"{of} meets it with a probability of {percent:.3g} % or more (the best has {100 * most:.2g} %)"
    if wish.edge_min is None:
        levels = found.predictive.quantile(share)
        at = _least(found, levels, rows)
        least = _up(float(levels[at]))
        words = f"{missed}; {100 * least:.3g} % of the motor's amplitude is the least with it ({label(found, at)})"
        raise Refusal("target.edge_max", wish.edge_max, words + _left_out(found), least)
    if wish.edge_max is None:
        levels = found.predictive.quantile(1 - share)
        at = _least(found, -levels, rows)
        largest = -_up(-float(levels[at]))
        words = f"{missed}; {100 * largest:.3g} % of the motor's amplitude is the most with it ({label(found, at)})"
        raise Refusal("target.edge_min", wish.edge_min, words + _left_out(found), largest)
    raise Refusal("target.probability_min", share, missed, -_up(-most))


def _least(found: Candidates, values: np.ndarray, rows: np.ndarray) -> int:
    """Return the row of the least value; of equals the one that relies least on what was not measured."""
    order = np.lexsort((rows, novelty(found)[rows], np.round(values[rows], 9)))
    return int(rows[order[0]])


def label(found: Candidates, row: int) -> str:
    """Return what a candidate is in a few words: design, silicones from the inside out, walls."""
    lengths = found.lengths(row)
    walls = " and ".join(f"{wall:g}" for wall in lengths.walls)
    motor = f", {lengths.motor}" if len(found.target.asked.at_hand.motors) > 1 else ""
    return f"{lengths.design} {'/'.join(found.materials(row))}, walls {walls} mm{motor}"


def _up(value: float) -> float:
    """Return the value rounded away from below to three significant digits, so that the rounded one is met."""
    if not value:
        return value
    unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    return float(f"{np.ceil(value / unit - 1e-9) * unit:.3g}")

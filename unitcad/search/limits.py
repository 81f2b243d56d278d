"""Limits of a target on its candidates; if none meets them all, the nearest values that one meets."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.attenuation.curve import crosstalk_ratio
from unitcad.attenuation.receivers import MOST_PITCH_MM
from unitcad.errors import Refusal
from unitcad.search.candidates import Candidates
from unitcad.text import listed, number, some

_PITCHES = np.unique(np.round([*np.arange(1.0, 100.0, 0.1), *np.arange(100.0, MOST_PITCH_MM + 1.0)], 1))
"""Pitches that are offered, mm: those of three digits."""


@dataclass(frozen=True)
class Limit:
    """A limit: the target's key and value, the limited quantity, the unit, each row's value, and who meets it.

    is_least: `asked` is the least value that is allowed, otherwise the largest.
    """

    key: str
    what: str
    unit: str
    asked: float
    values: np.ndarray
    met: np.ndarray
    is_least: bool = False

    @property
    def far(self) -> np.ndarray:
        """Distance of each row from meeting it: |ln| of its value over the asked one."""
        with np.errstate(divide="ignore"):
            far = np.abs(np.log(self.values / self.asked))
        return np.where(self.met, 0.0, np.where(np.isnan(far), np.inf, far))

    def shown(self, row: int) -> str:
        """Return a row's value and the limit in words."""
        if np.isnan(self.values[row]):
            return f"{self.what}: none, since moulds can't be made (at most {number(self.asked, 3)}{self.unit})"
        return f"{self.what} {number(self.values[row], 3)} of at most {number(self.asked, 3)}{self.unit}"

    def offer(self, row: int) -> float:
        """Return the value to ask for in its place: three digits, and the row meets it."""
        sign, value = -1.0 if self.is_least else 1.0, float(self.values[row])
        if not value:
            return value
        unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
        return float(f"{sign * np.ceil(sign * value / unit - 1e-9) * unit:.3g}")


def limits(found: Candidates) -> list[Limit]:
    """Return the limits that a target sets besides the level."""
    goals = found.target.goals
    columns = {
        "diameter_max_mm": ("diameter", " mm", found.diameter_mm),
        "height_max_mm": ("height", " mm", found.height_mm),
        "mass_max_g": ("mass", " g", found.mass_g),
        "cure_hours_max": ("cure", " h", found.cure_hours),
        "crosstalk_ratio_max": ("crosstalk ratio", "", found.crosstalk),
        "pitch_mm": ("diameter, so that neighbours do not touch,", " mm", found.diameter_mm),
    }
    return [
        Limit(key, what, unit, most, values, values <= most * (1 + 1e-9))
        for key, (what, unit, values) in columns.items()
        if (most := getattr(goals, key)) is not None
    ]


def within(found: Candidates) -> np.ndarray:
    """Return the rows that meet every limit besides the level; there may be none."""
    met = np.array([limit.met for limit in limits(found)]).reshape(-1, found.count)
    return np.flatnonzero(met.all(axis=0))


def _level_limits(found: Candidates, measured: Mapping[int, Mapping[str, Any]]) -> list[Limit]:
    """Return the limits on the level.

    A row's value is the level that it meets with the probability that is asked for, or its measured level if that is
    nearer.
    """
    goals, share = found.target.goals, found.target.goals.probability_min
    own = np.full(found.count, np.nan)
    own[list(measured)] = [one["level"] for one in measured.values()]
    met = found.probability >= share
    met[[row for row, one in measured.items() if one["meets"]]] = True
    what, unit, least, most = (
        "an edge level of",
        f" (probability {share:g}, or measured)",
        goals.edge_min,
        goals.edge_max,
    )
    if least is None:
        values = np.fmin(found.predictive.quantile(share), own)
        return [Limit("edge_max", what, unit, most or np.inf, values, met)]
    if most is None:
        values = np.fmax(found.predictive.quantile(1 - share), own)
        return [Limit("edge_min", what, unit, least, values, met, is_least=True)]
    low, high = (found.predictive.quantile(end) for end in ((1 - share) / 2, (1 + share) / 2))
    nearer = np.maximum(own, most) / np.minimum(own, least) < np.maximum(high, most) / np.minimum(low, least)
    low, high = (np.where(nearer, own, end) for end in (low, high))
    met_low = met | (low >= least)
    return [
        Limit("edge_min", what, unit, least, low, met_low, is_least=True),
        Limit("edge_max", what, unit, most, high, met | ((high <= most) & ~met_low)),
    ]


def check_possible(found: Candidates, measured: Mapping[int, Mapping[str, Any]]) -> None:
    """Raise Refusal, with the nearest values that are met together, if no candidate meets everything.

    measured: see `measured_rows`. If several values must change, the refusal has the others in its `others`.
    """
    asked = [*limits(found), *_level_limits(found, measured)]
    far, missed = np.array([limit.far for limit in asked]), ~np.array([limit.met for limit in asked])
    if not missed.any(axis=0).all():
        return
    rest = " and the rest" if len(asked) > 1 else ""
    none = f"none of {found.count} candidates meets it{rest}"
    alone = missed & (missed.sum(axis=0) == 1) & np.isfinite(far)
    if alone.any():
        each = [(limit, _nearest(found, far[i], alone[i])) for i, limit in enumerate(asked) if alone[i].any()]
        (limit, row), *others = sorted(each, key=lambda one: float(one[0].far[one[1]]))
        value = limit.offer(row)
        end = "most" if limit.is_least else "least"
        words = f"{none}; {limit.what} {value:g}{limit.unit} is the {end} ({label(found, row)})"
        for other, at in others:
            words += f"; or target.{other.key} = {other.offer(at):g} in its place ({label(found, at)})"
        pitch = _pitch(found, row) if limit.key == "crosstalk_ratio_max" else None
        words += f"; or target.pitch_mm = {pitch:g} in its place" if pitch else ""
        raise Refusal(f"target.{limit.key}", limit.asked, words + _left_out(found), value)
    row = _nearest(found, far.sum(axis=0), np.ones(found.count, dtype=bool))
    offers = {limit.key: (limit.asked, limit.offer(row)) for i, limit in enumerate(asked) if missed[i, row]}
    if "pitch_mm" in offers and (pitch := _pitch(found, row)):
        offers.pop("crosstalk_ratio_max", None)
        offers["pitch_mm"] = offers["pitch_mm"][0], pitch
    made = []
    for key, (value, offer) in offers.items():
        others = [f"target.{other} = {instead:g}" for other, (_, instead) in offers.items() if other != key]
        together = f": together with {listed(others)}" if others else ""
        words = f"{none}; nearest is {label(found, row)}{together}{_left_out(found)}"
        made.append(Refusal(f"target.{key}", value, words, offer))
    made[0].others = tuple(made[1:])
    raise made[0]


def _nearest(found: Candidates, far: np.ndarray, among: np.ndarray) -> int:
    """Return the nearest row; of equals the one with the fewest unmeasured inputs."""
    rows = np.flatnonzero(among)
    return int(rows[np.lexsort((rows, found.novelty[rows], np.round(far[rows], 9)))[0]])


def _pitch(found: Candidates, row: int) -> float | None:
    """Return the least pitch at which a row's crosstalk ratio is within its limit, mm; None if there is none."""
    geometry, most = found.geometries[found.geometry[row]], found.target.goals.crosstalk_ratio_max
    pitches = _PITCHES[geometry.lengths.diameter - 1e-9 <= _PITCHES].tolist()

    def is_met(pitch: float) -> bool:
        return most is None or crosstalk_ratio(geometry.variant, 1e-3 * pitch, spread=False).middle <= most

    at = bisect_left(pitches, True, key=is_met)
    return pitches[at] if at < len(pitches) else None


def label(found: Candidates, row: int) -> str:
    """Return a candidate in a few words: design, silicones from the inside out, walls."""
    lengths = found.lengths(row)
    walls = " and ".join(f"{wall:g}" for wall in lengths.walls)
    motor = f", {lengths.motor}" if len(found.target.asked.at_hand.motors) > 1 else ""
    return f"{lengths.design} {'/'.join(found.materials(row))}, walls {walls} mm{motor}"


def _left_out(found: Candidates) -> str:
    return f"; not tried, without a modulus: {some(found.skipped)}" if found.skipped else ""

"""What to wish for instead where no candidate meets every wish: the nearest values that are met together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unitcad.attenuation.crosstalk import crosstalk_ratio
from unitcad.attenuation.receivers import MOST_PITCH_MM
from unitcad.errors import Refusal
from unitcad.search.candidates import Candidates
from unitcad.search.own_measurement import measured_rows
from unitcad.search.ranking_order import novelty
from unitcad.search.wishes import Limit, label, limits
from unitcad.text import listed

_PITCHES = np.unique(np.round([*np.arange(1.0, 100.0, 0.1), *np.arange(100.0, MOST_PITCH_MM + 1.0)], 1))
"""Pitches that are offered, mm: those of three digits."""
_LEAST_OFFERED = 0.01
"""The least `probability_min` that a target may have."""


@dataclass(frozen=True)
class _Wish:
    """A key of the target and what was asked, how far each row is from it, and what to say and to ask instead.

    far: ln of the ratio of a row's value to what was asked, zero where it is met. `offer` gives the value that a row
    meets, in three digits, `said` the words for a row and that value. missed: who does not meet it, where that is not
    said of all candidates.
    """

    key: str
    asked: float
    far: np.ndarray
    offer: Callable[[int], float]
    said: Callable[[int, float], str]
    missed: str = ""


def check_possible(found: Candidates, rows: np.ndarray, measured: Mapping[int, Mapping[str, Any]]) -> None:
    """Raise Refusal, with the nearest wish that is met, where no row meets the level probably enough.

    rows: those within the limits; measured: their measurements, see `measured_rows`. Where several values must change,
    the refusal has them all: its own and those of its `others` are met together.
    """
    if any(one["meets"] for one in measured.values()):
        return
    if rows.size and np.max(found.probability[rows]) >= found.target.wish.probability_min:
        return
    raise _refusal(found, rows)


def _refusal(found: Candidates, rows: np.ndarray) -> Refusal:
    levels = _levels(found, rows)
    closer, apart = ([*_limit_wishes(found, wider), *levels] for wider in (False, True))
    if alone := sorted(_alone(found, closer), key=lambda one: one[0]):
        _, row, wish = alone[0]
        instead = [one for one in alone[1:] if one[2].key != wish.key]
        instead += [one for one in _alone(found, apart) if one[2].key == "pitch_mm" and wish.key != "pitch_mm"]
        return _of_one(found, row, wish, len(closer) > 1, instead)
    return _of_several(found, min((_together(found, wishes) for wishes in (closer, apart)), key=lambda one: one[0]))


def _alone(found: Candidates, wishes: list[_Wish]) -> Iterator[tuple[float, int, _Wish]]:
    """Yield how far, the row and the wish for each wish which, changed alone, leaves a row that meets everything."""
    far = np.array([wish.far for wish in wishes])
    over = far > 0
    for i, wish in enumerate(wishes):
        at = np.flatnonzero(over[i] & (over.sum(axis=0) == 1) & np.isfinite(far[i]))
        if at.size:
            row = _least(found, far[i], at)
            yield float(far[i][row]), row, wish


def _together(found: Candidates, wishes: list[_Wish]) -> tuple[float, int, list[_Wish]]:
    """Return how far the nearest row is from all wishes, the row, and the wishes that it does not meet."""
    total = np.array([wish.far for wish in wishes]).sum(axis=0)
    row = _least(found, total, np.arange(found.count))
    return float(total[row]), row, [wish for wish in wishes if wish.far[row] > 0]


def _of_one(found: Candidates, row: int, wish: _Wish, others: bool, instead: list[tuple[float, int, _Wish]]) -> Refusal:
    value = wish.offer(row)
    missed = wish.missed or f"none of {found.count} candidates is within it{' and meets the rest' if others else ''}"
    words = f"{missed}; {wish.said(row, value)} ({label(found, row)})"
    for _, at, one in instead:
        words += f"; or target.{one.key} = {one.offer(at):g} in its place ({label(found, at)})"
    return Refusal(f"target.{wish.key}", wish.asked, words + _left_out(found), value)


def _of_several(found: Candidates, nearest: tuple[float, int, list[_Wish]]) -> Refusal:
    _, row, wishes = nearest
    offers = [(wish, wish.offer(row)) for wish in wishes]
    made = []
    for wish, value in offers:
        rest = listed(f"target.{one.key} = {offer:g}" for one, offer in offers if one is not wish)
        words = f"none of {found.count} candidates meets it and the rest; nearest is {label(found, row)}: together with"
        made.append(Refusal(f"target.{wish.key}", wish.asked, f"{words} {rest}{_left_out(found)}", value))
    made[0].others = tuple(made[1:])
    return made[0]


def _levels(found: Candidates, rows: np.ndarray) -> list[_Wish]:
    """Return the level as wishes; rows: those within the limits.

    A row that was measured asks for its measured level where that is nearer to the wish than what its probability asks.
    """
    wish, share, predictive = found.target.wish, found.target.wish.probability_min, found.predictive
    met = found.probability >= share
    measured = measured_rows(found, np.arange(found.count))
    met[[row for row, one in measured.items() if one["meets"]]] = True
    own = np.full(found.count, np.nan)
    own[list(measured)] = [one["level"] for one in measured.values()]
    best = float(np.max(found.probability[rows] if rows.size else found.probability))
    of = (
        f"none of {rows.size} candidates within the limits" if 0 < rows.size < found.count else f"none of {found.count}"
    )
    missed = f"{of} meets it with a probability of {100 * share:.3g} % or more (the best has {100 * best:.2g} %)"

    def one(key: str, asked: float, sign: int, values: np.ndarray, said: str, nearest: float = 1e-9) -> _Wish:
        with np.errstate(divide="ignore"):
            far = np.where(met, 0.0, np.maximum(sign * np.log(values / asked), nearest))
        return _Wish(
            key,
            asked,
            np.where(np.isnan(far), np.inf, far),
            lambda row: sign * _up(sign * float(values[row])),
            lambda row, value: (
                f"{100 * value:.3g} % {said.format('as measured' if values[row] == own[row] else 'with it')}"
            ),
            missed,
        )

    least, most = wish.edge_min, wish.edge_max
    if least is not None and most is not None:
        if best >= _LEAST_OFFERED:
            offered = np.where(found.probability >= _LEAST_OFFERED, found.probability, np.nan)
            return [one("probability_min", share, -1, offered, "is the most")]
        low = np.minimum(predictive.quantile((1 - share) / 2), least)
        high = np.maximum(predictive.quantile((1 + share) / 2), most)
        own_low, own_high = np.minimum(own, least), np.maximum(own, most)
        nearer = own_high / own_low < high / low
        low, high = np.where(nearer, own_low, low), np.where(nearer, own_high, high)
        return [
            one("edge_min", least, -1, low, "of the motor's amplitude is the most {}", 0.0),
            one("edge_max", most, 1, high, "of the motor's amplitude is the least {}", 0.0),
        ]
    if most is not None:
        at = np.fmin(predictive.quantile(share), own)
        return [one("edge_max", most, 1, at, "of the motor's amplitude is the least {}")]
    assert least is not None
    at = np.fmax(predictive.quantile(1 - share), own)
    return [one("edge_min", least, -1, at, "of the motor's amplitude is the most {}")]


def _limit_wishes(found: Candidates, wider: bool) -> list[_Wish]:
    """Return the limits as wishes; `wider`: units whose crosstalk is over its limit are moved apart.

    Units that would overlap are moved apart in any case.
    """
    made = {limit.key: limit for limit in limits(found)}
    pitch, crosstalk = made.get("pitch_mm"), made.get("crosstalk_ratio_max")
    if pitch and crosstalk:
        move = ~pitch.met | (~crosstalk.met if wider else np.zeros(found.count, dtype=bool))
        apart, ratio = _apart(found, crosstalk.most)
        made["pitch_mm"] = replace(pitch, what="a pitch of", values=np.where(move, apart, pitch.values))
        made["crosstalk_ratio_max"] = replace(crosstalk, values=np.where(move, ratio, crosstalk.values))
    elif pitch:
        made["pitch_mm"] = replace(pitch, what="a pitch of")
    return [_of_limit(limit) for limit in made.values()]


def _of_limit(limit: Limit) -> _Wish:
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(limit.met, 0.0, np.log(limit.values / limit.most))
    hint = "; other vary.diameter_mm, body and drive change it too" if limit.key == "crosstalk_ratio_max" else ""
    return _Wish(
        limit.key,
        limit.most,
        np.where(np.isnan(far), np.inf, far),
        lambda row: _up(float(limit.values[row])),
        lambda row, value: f"{limit.what} {value:g}{limit.unit} is the least{hint}",
    )


def _apart(found: Candidates, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the least pitch (mm) at which each row's crosstalk ratio is within `most`, and the ratio there.

    Where none up to `MOST_PITCH_MM` is, the pitch is that at which units touch.
    """
    known: dict[tuple[str, float], tuple[float, float]] = {}
    for one in found.geometries:
        key = (one.lengths.motor, one.lengths.diameter)
        if key in known:
            continue
        touching = one.lengths.diameter - 1e-9
        pitches = _PITCHES[touching <= _PITCHES]

        def ratio(at: int, variant: Any = one.variant, pitches: np.ndarray = pitches) -> float:
            return crosstalk_ratio(variant, 1e-3 * float(pitches[at]), spread=False).middle

        low, high = 0, pitches.size - 1
        if ratio(high) > most:
            high = 0
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if ratio(middle) <= most else (middle + 1, high)
        known[key] = float(pitches[high]), ratio(high)
    of = np.array([known[one.lengths.motor, one.lengths.diameter] for one in found.geometries])[found.geometry]
    return of[:, 0], of[:, 1]


def _least(found: Candidates, values: np.ndarray, rows: np.ndarray) -> int:
    """Return the row of the least value; of equals the one that relies least on what was not measured."""
    order = np.lexsort((rows, novelty(found)[rows], np.round(values[rows], 9)))
    return int(rows[order[0]])


def _left_out(found: Candidates) -> str:
    """Say which silicones were not tried."""
    names = list(found.silicones.left_out)
    return f"; not tried, without a modulus: {listed(names)}" if names else ""


def _up(value: float) -> float:
    """Return the value rounded away from below to three significant digits, so that the rounded one is met."""
    if not value:
        return value
    unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    return float(f"{np.ceil(value / unit - 1e-9) * unit:.3g}")

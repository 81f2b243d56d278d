"""Crosstalk between the units of an array: matrix, table and sentences."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from html import escape
from itertools import groupby
from typing import Any

import numpy as np

from unitcad.arrays.array import Array
from unitcad.arrays.circuit import circuit_files, has_circuit, outline, outline_path
from unitcad.arrays.sheet import rounded, slot_profile
from unitcad.attenuation.curve import RANGE, contact, decay, ends, in_axes, motion
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec, estimate_input
from unitcad.export.chart import coord
from unitcad.shape import Profile
from unitcad.text import join_words, number

SUMS = ("in_phase", "worst_phases", "root_sum_of_squares")
"""The amplitude at a place from all others: every motor in one phase, as a complex sum of vectors; the phases that give
the most; and the root of the sum of squares, which motors give that are not synchronous."""
DIGITS = 6
ASSUMPTIONS = [
    "The decay is that of the bare, laterally uniform skin under each unit's own motor; the other units, the sheet and "
    "the circuit are not on it. With each unit as a mass on its disc of skin, sums of three shipped arrays were 7 to "
    "20 % higher.",
    "A flat motor's force turns in the plane of the skin: |u| is then alike at every angle, and needs no direction.",
    "|u| is the root of the sum of the squares of the three components' amplitudes.",
    "Sums are in one unit's level at its edge, as if every unit were driven to that level.",
    "In one phase every motor's force points the same way at each moment; the motions add as complex vectors.",
]


def ways(array: Array) -> np.ndarray:
    """Return the way from each unit's middle to each other's along the skin (mm), shape (n, n, 2), rows the first.

    On a limb, x goes round it: ways are those along the unrolled skin, the shorter way round, and shorter than on the
    flat sheet.
    """
    at = np.array([(place.x, place.y) for place in array.places])
    across = at[None] - at[:, None]
    if array.radius_mm is not None and array.middle_radius_mm is not None:
        # Cast flat, places are as far apart as they are in the sheet's middle; the skin under it has the shorter arc.
        across[..., 0] *= array.radius_mm / array.middle_radius_mm
        half = math.pi * array.radius_mm
        across[..., 0] = (across[..., 0] + half) % (2 * half) - half
    return across


def distances(array: Array) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances to each other unit's middle, and to the nearest point of its edge, along the skin (mm).

    Their shape is (n, n), rows the unit that drives.
    """
    radii = np.array([place.radius for place in array.places])
    centre = np.linalg.norm(ways(array), axis=-1)
    return centre, np.maximum(centre - radii[None, :], radii[:, None])


class Decays:
    """An array's units, the inputs of each distinct one's estimate, and the motions that they give each other.

    `kind`: the number of each place's distinct unit; `centre`, `edge`: see `distances`; `synchronous`: whether all
    motors run at one frequency, so that phases mean anything; `short`: shortfalls of the responses so far, each once.
    Raises Refusal for a unit without an estimate, and for units on several tissues.
    """

    def __init__(self, array: Array) -> None:
        self.array, self.inputs = array, tuple(estimate_input(unit) for unit in array.units)
        for one in self.inputs:
            if one.tissue != self.inputs[0].tissue:
                name = self.inputs[0].tissue_name
                raise Refusal("estimate.tissue", one.tissue_name, f"units side by side are on one tissue, {name}", name)
        self.kind = np.array([array.units.index(place.unit) for place in array.places])
        self.centre, self.edge = distances(array)
        self.short: dict[str, None] = {}
        self.synchronous = len({one.frequency.middle for one in self.inputs}) == 1

    def motions(self, drivers: np.ndarray, ways: np.ndarray, end: dict[str, int] | None = None) -> np.ndarray:
        """Return the motion at the end of ways (mm, (k, 2)) from the units numbered `drivers`, (k,), shape (k, 3).

        Complex, in x, y and z, over |u| at the unit's edge. Every motor is in one phase.
        """
        found = np.zeros((len(drivers), 3), dtype=complex)
        away, angle = np.hypot(ways[:, 0], ways[:, 1]), np.arctan2(ways[:, 1], ways[:, 0])
        for kind, one in enumerate(self.inputs):
            rows = self.kind[drivers] == kind
            if np.any(rows):
                found[rows] = in_axes(motion(one, 1e-3 * away[rows], end=end, short=self._note), angle[rows], one.drive)
        return found

    def _note(self, shortfall: str) -> None:
        self.short[shortfall] = None

    def both(self) -> np.ndarray:
        """Return |u| at the centre and at the nearest edge, shape (n, n, 2), rows the unit that drives.

        Over |u| at that unit's edge; 0 for itself.
        """
        away = np.stack([self.centre, self.edge], axis=-1)
        found = np.zeros(away.shape)
        drivers, moved = np.nonzero(~np.eye(len(self.kind), dtype=bool))
        for kind, one in enumerate(self.inputs):
            rows = self.kind[drivers] == kind
            i, j = drivers[rows], moved[rows]
            if i.size:
                found[i, j] = decay(one, 1e-3 * away[i, j], short=self._note)
        return found

    def sums(self, worst: int | None = None, end: dict[str, int] | None = None) -> dict[str, np.ndarray]:
        """Return `SUMS` at each place from all others, shape (n, 3); with `worst` at that place alone, (1, 3).

        Of bare skin, and times the least and the largest factor of `contact`. NaN for phases of several frequencies.
        """
        count = len(self.kind)
        places = np.arange(count) if worst is None else np.array([worst])
        found = {key: np.zeros((places.size, 3)) for key in SUMS}
        drivers, rows = np.nonzero(np.arange(count)[:, None] != places)
        if not drivers.size:
            return found
        moved = self.motions(drivers, ways(self.array)[drivers, places[rows]], end)
        low, high = np.ones((2, drivers.size))
        for kind, one in enumerate(self.inputs):
            own = self.kind[drivers] == kind
            away = self.centre[drivers[own], places[rows[own]]]
            low[own], high[own] = contact(one.drive, away - 500.0 * one.diameter)
        for column, factor in enumerate((np.ones(drivers.size), low, high)):
            scaled = moved * factor[:, None]
            for row in range(places.size):
                vectors = scaled[rows == row]
                found["root_sum_of_squares"][row, column] = np.linalg.norm(vectors)
                found["in_phase"][row, column] = np.linalg.norm(vectors.sum(axis=0)) if self.synchronous else np.nan
                found["worst_phases"][row, column] = worst_phases(vectors) if self.synchronous else np.nan
        return found

    def nearest(self, pair: tuple[int, int] | None, end: dict[str, int] | None = None) -> dict[str, np.ndarray]:
        """Return |u| at the centre and at the nearest edge of the second of two units, from the first, shape (3,).

        Of bare skin, and times the least and the largest factor of `contact`.
        """
        if pair is None:
            return dict.fromkeys(("nearest_centre", "nearest_edge"), np.zeros(3))
        one = self.inputs[self.kind[pair[0]]]
        away = np.array([self.centre[pair], self.edge[pair]])
        found = decay(one, 1e-3 * away, end=end, short=self._note)
        low, high = contact(one.drive, away - 500.0 * one.diameter)
        rows = np.stack([found, found * low, found * high], axis=-1)
        return {"nearest_centre": rows[0], "nearest_edge": rows[1]}


_STARTS, _TURNS = 8, 40


def worst_phases(vectors: np.ndarray) -> float:
    """Return the largest |sum| of complex vectors (k, 3) over the phase of each.

    In a direction w the best phases give the sum of |w* v|; the largest sum is that of the best direction. Each pass
    takes the phases for a direction and the direction of their sum, and never lowers it. It starts from the longest
    vectors and from the axes.
    """
    size = np.linalg.norm(vectors, axis=1)
    if not size.any():
        return 0.0
    longest = vectors[np.argsort(-size)[:_STARTS]]
    totals = np.concatenate([longest, np.eye(3), vectors.sum(axis=0)[None]]).astype(complex)
    for _ in range(_TURNS):
        along = np.conj(totals) @ vectors.T
        phases = np.divide(np.conj(along), np.abs(along), out=np.ones_like(along), where=np.abs(along) > 0)
        totals = phases @ vectors
    return float(np.linalg.norm(totals, axis=1).max())


def crosstalk(array: Array, say: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """Return an array's crosstalk as JSON-ready data.

    `matrix`: the decay between each two units, rows the unit that drives, to the other's centre, null for itself, by
    its own drive and frequency; `sums`: the sum at each place; `absolute`: a range in the motor's own amplitude;
    `not_reached`: the shortfalls of responses that miss their accuracy.

    Raises Refusal for a unit without an estimate, and for a frequency out of range.
    """
    say("crosstalk: decay")
    units = Decays(array)
    matrix = units.both()[..., 0]
    sums = {key: found[:, 0] for key, found in units.sums().items()}
    nearest, worst = _nearest(units, matrix), int(np.argmax(np.round(sums["root_sum_of_squares"], 9)))
    say("crosstalk: range")
    varied = {str(end): end for one in units.inputs for end in ends(one)}.values()
    answers = [
        units.nearest(nearest, end) | {key: one[0] for key, one in units.sums(worst, end).items()}
        for end in (None, *varied)
    ]
    ranged = {key: _quantity(np.array([one[key] for one in answers])) for key in answers[0]}
    names = [place.name for place in array.places]
    data: dict[str, Any] = {
        "array": array.name,
        "tissue": units.inputs[0].tissue_name,
        "range": RANGE,
        "distances": "along the skin, taken as flat"
        if array.radius_mm is None
        else f"along the skin, unrolled: round the limb of radius {array.radius_mm:g} mm a distance is the arc, the "
        "shorter way round; the decay is that of flat skin",
        "places": [
            {"name": name, "drive": own.drive, "frequency_hz": own.frequency.middle}
            for name, own in zip(names, (units.inputs[kind] for kind in units.kind), strict=True)
        ],
        "nearest": nearest
        and {
            "from": names[nearest[0]],
            "to": names[nearest[1]],
            "distance_mm": round(float(units.centre[nearest]), DIGITS),
            "centre": ranged["nearest_centre"],
            "nearest_edge": ranged["nearest_edge"],
        },
        "synchronous": units.synchronous,
        "worst": {"place": names[worst], **{key: ranged[key] for key in SUMS}},
        "sums": {key: None if np.isnan(one).any() else np.round(one, DIGITS).tolist() for key, one in sums.items()},
        "matrix": [
            [None if i == j else value for j, value in enumerate(row)]
            for i, row in enumerate(np.round(matrix, DIGITS).tolist())
        ],
        "assumptions": ASSUMPTIONS,
        "absolute": _absolute(units, worst, ranged),
        "not_reached": [*units.short],
    }
    return {**data, "answer": crosstalk_lines(data)}


def _quantity(every: np.ndarray) -> dict[str, float] | None:
    """Return a value with its range, of `Decays` at the nominal tissue and at the ends, a row each; None for NaN."""
    if np.isnan(every).any():
        return None
    ends = {"value": every[0, 0], "low": every[:, 1].min(), "high": every[:, 2].max()}
    return {key: round(float(one), DIGITS) for key, one in ends.items()}


def _nearest(units: Decays, matrix: np.ndarray) -> tuple[int, int] | None:
    """Return the numbers of the two units nearest to each other, of several the loudest; None for a single unit."""
    if len(units.kind) < 2:
        return None
    apart = np.where(np.eye(len(units.kind), dtype=bool), np.inf, np.round(units.centre, 6))
    nearest = np.argwhere(apart == apart.min()).tolist()
    i, j = max(nearest, key=lambda pair: (round(float(matrix[pair[0], pair[1]]), 9), -pair[0], -pair[1]))
    return i, j


def _absolute(units: Decays, worst: int, ranged: Mapping[str, Mapping[str, float] | None]) -> dict[str, Any]:
    """Return the amplitude at the worst place from the others, in motors' amplitudes, as a range; or why there is none.

    The 80 % ranges of the units' levels at the edge, all at one end, times the decay at the same end of its range.
    """
    answers = [answer_spec(unit) for unit in units.array.units]
    if any(one.low is None for one in answers):
        return {"reason": "the level of a unit is not known"}
    levels = {end: np.array([getattr(one, end) for one in answers])[units.kind] for end in ("low", "high")}
    others = np.delete(np.arange(len(units.kind)), worst)
    moved = units.motions(others, ways(units.array)[others, worst]) if others.size else np.zeros((0, 3))
    made: dict[str, Any] = {}
    for end, level in levels.items():
        vectors = moved * level[others][:, None]
        found = {"root_sum_of_squares": float(np.linalg.norm(vectors))}
        if units.synchronous:
            found |= {"in_phase": float(np.linalg.norm(vectors.sum(axis=0))), "worst_phases": worst_phases(vectors)}
        for name, size in found.items():
            quantity = ranged[name]
            assert quantity is not None
            made.setdefault(name, {})[end] = round(size * (quantity[end] / max(quantity["value"], 1e-300)), DIGITS)
    return made


def crosstalk_csv(array: Array) -> bytes:
    """Return a CSV file: `from` drives, `to` is moved; distances along the skin in mm, from the middle of `from`.

    The last columns are |u| over that at the edge of `from`, to the `centre` and the nearest `edge` of `to`. Raises
    Refusal as `crosstalk`.
    """
    units = Decays(array)
    apart = ~np.eye(len(units.kind), dtype=bool)
    table = {"distance_mm": np.round(units.centre[apart], 4), "edge_mm": np.round(units.edge[apart], 4)}
    table["frequency_hz"] = np.array([one.frequency.middle for one in units.inputs])[units.kind[np.nonzero(apart)[0]]]
    table["centre"], table["edge"] = np.round(units.both()[apart], DIGITS).T
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("from", "to", *table))
    names = [place.name for place in array.places]
    columns = [column.tolist() for column in table.values()]
    for (i, j), *values in zip(np.argwhere(apart).tolist(), *columns, strict=True):
        rows.writerow((names[i], names[j], *values))
    return text.getvalue().encode()


IN_BRACKETS = (
    "Brackets have the range: moduli, damping, thicknesses and frequency at both ends of their ranges, and a unit "
    "that sticks to the skin or rests on it."
)
ALIKE = 1e-3
"""Sums that differ by less, as a share, are called alike."""
Crosstalk = Mapping[str, Any]


def crosstalk_lines(data: Crosstalk) -> list[str]:
    """Return the answer, the nearest neighbour first: its share, the sums, and the range over the models."""
    nearest, worst = data["nearest"], data["worst"]
    if nearest is None:
        return ["A single unit has no neighbour: there is no crosstalk."]
    values = data["sums"]["root_sum_of_squares"]
    # Equivalent places differ by the rounding of their centres.
    alike = max(values) - min(values) <= ALIKE * max(values)
    most = "all get alike" if alike else f"{worst['place']} gets the most"
    return [
        f"{_ranged(nearest['centre'], 100, ' %')} of a unit's motion at its edge reaches the middle of its nearest "
        f"neighbour ({nearest['from']} to {nearest['to']}, {number(nearest['distance_mm'], 4)} mm apart), "
        f"and {_ranged(nearest['nearest_edge'], 100, ' %')} the neighbour's edge.",
        f"With all other units on, {most}: {_ranged(worst['root_sum_of_squares'])} times one "
        f"unit's edge level if the motors are not synchronous (root of squares){_phases(worst)}.",
        _absolute_line(worst["place"], data["absolute"]),
        IN_BRACKETS,
        *(f"A response of the skin does not reach its accuracy: {short}." for short in data["not_reached"]),
    ]


def ratios(every: Sequence[Crosstalk]) -> list[dict[str, Any]]:
    """Return each array's crosstalk over that of the first: nearest neighbour, and the sums at the worst places.

    In units' own levels at their edge. A ratio is None if one of the two is a single unit.
    """
    first, *others = every
    return [
        {
            "array": other["array"],
            "over": first["array"],
            **{
                key: round(there / own, 6) if there and own else None
                for (key, there), own in zip(_compared(other).items(), _compared(first).values(), strict=True)
            },
            "same_tissue": first["tissue"] == other["tissue"],
        }
        for other in others
    ]


def _compared(data: Crosstalk) -> dict[str, float]:
    """Return the values that are compared; 0 for a single unit."""
    nearest = data["nearest"]["centre"]["value"] if data["nearest"] else 0.0
    return {"nearest_centre": nearest, **{key: (data["worst"][key] or {"value": 0.0})["value"] for key in SUMS}}


def ratio_line(one: Mapping[str, Any]) -> str:
    """Say how an array's crosstalk compares with another's."""
    parts = {
        "nearest neighbour": one["nearest_centre"],
        "worst place, root of squares": one["root_sum_of_squares"],
        "in one phase": one["in_phase"],
        "worst phases": one["worst_phases"],
    }
    said = join_words(
        f"{change} x {number(value, 3, zeros=True)}" for change, value in parts.items() if value is not None
    )
    tissue = "" if one["same_tissue"] else " (on another tissue)"
    return (
        f"{one['array']} over {one['over']}: {said or 'nothing to compare'}{tissue}, in edge levels of their own units."
    )


def _ranged(quantity: Mapping[str, float], factor: float = 1.0, unit: str = "") -> str:
    value, low, high = (number(factor * quantity[key], 2) for key in ("value", "low", "high"))
    return f"{value}{unit} ({low} to {high})"


def _phases(worst: Mapping[str, Any]) -> str:
    if worst["in_phase"] is None:
        return ". The motors run at several frequencies: no phase lasts"
    return (
        f", {_ranged(worst['in_phase'])} times with all motors in one phase (complex sum), and at most "
        f"{_ranged(worst['worst_phases'])} times at the worst phases"
    )


def _absolute_line(place: str, ranges: Mapping[str, Any]) -> str:
    if "reason" in ranges:
        return f"No absolute level: {ranges['reason']}."
    said = {key: f"{number(100 * one['low'], 2)} to {number(100 * one['high'], 2)} %" for key, one in ranges.items()}
    phases = (
        f", {said['in_phase']} in one phase and {said['worst_phases']} at the worst phases"
        if "in_phase" in said
        else ""
    )
    return (
        f"At {place} that is {said['root_sum_of_squares']} of the motor's own amplitude{phases}. "
        "The ranges combine those of the edge level and of the decay."
    )


STEPS = 21
_LIGHT, _DARK = (247, 251, 255), (8, 64, 129)
_INK = "#111111"
_MOST_NUMBERS, _MOST_NAMES = 20, 40
"""Units up to which each cell has its number, and each row and column its name."""
_LETTER = 0.6
"""Width of a letter over its size, about the mean."""
_PAGE = 640.0
_SCALE_PX = 90.0


def heat_map_svg(data: Crosstalk) -> str:
    """Return the matrix of `crosstalk` to the middles, by each unit's own drive, as an SVG document, in per cent.

    A row is a unit that vibrates, a column one that it reaches.
    """
    places = data["places"]
    names = [place["name"] for place in places]
    matrix, n = data["matrix"], len(names)
    cell = min(56.0, max(2.0, _PAGE / n))
    left, top = (64.0, 74.0) if n <= _MOST_NAMES else (34.0, 60.0)
    high = _largest(value for row in matrix for value in row if value is not None)
    wide, tall = max(left + n * cell + _SCALE_PX, 470.0), top + n * cell + 20.0
    driven = " and ".join(sorted({place["drive"] for place in places}))
    head = f"{data['array']}: how much of a unit's motion at its edge reaches the middle of another, % ({driven} drive)"
    parts = [_open(wide, tall), _text(8, 20, head, 12, "start")]
    parts += _cells(matrix, left, top, cell, high)
    for i, name in enumerate(names if n <= _MOST_NAMES else ()):
        size = min(11.0, 0.8 * cell)
        parts.append(_text(left - 5, top + (i + 0.5) * cell + 0.35 * size, name, size, "end"))
        parts.append(_text(left + (i + 0.5) * cell, top - 6, name, size, "middle"))
    if n <= _MOST_NUMBERS:
        size = min(11.0, 0.36 * cell)
        for i, row in enumerate(matrix):
            for j, value in enumerate(row):
                if value is not None:
                    at = left + (j + 0.5) * cell, top + (i + 0.5) * cell + 0.35 * size
                    parts.append(_text(*at, _map_percent(value), size, "middle", _ink(_share(value, high))))
    above = top - 26 if n <= _MOST_NAMES else top - 8
    parts.append(_text(left + n * cell / 2, above, "unit that is reached", 11, "middle"))
    middle = top + n * cell / 2
    turned = f'transform="translate(16 {coord(middle)}) rotate(-90)"'
    parts.append(f'<text {turned} font-size="11" text-anchor="middle">unit that vibrates</text>')
    parts += _scale(left + n * cell + 24, top, min(n * cell, 240.0), high)
    return "\n".join([*parts, "</svg>", ""])


def patch_map_svg(array: Array, data: Crosstalk, circuit: Profile | None = None) -> str:
    """Return the patch from outside as an SVG document: sheet, strap slots, units by name, the circuit if given.

    Each unit is coloured by the root of the sum of squares of the amplitudes that all others give it. These are in per
    cent of one unit's level at its edge.
    """
    x0, y0, x1, y1 = array.sheet.outline if circuit is None else tuple(
        pick(a, b) for pick, a, b in zip((min, min, max, max), array.sheet.outline, circuit.bounds, strict=True)
    )  # fmt: skip
    scale = min(8.0, _PAGE / (x1 - x0), _PAGE / (y1 - y0))
    edge, top = 16.0, 44.0
    values = data["sums"]["root_sum_of_squares"]
    high = _largest(values)
    head = [
        f"{array.name}: amplitude at each unit from all others",
        "in % of one unit's edge level (root of the sum of squares)",
    ]
    wide = max(470.0, (x1 - x0) * scale + 2 * edge + _SCALE_PX, *(_LETTER * 12 * len(line) + 16 for line in head))
    tall = (y1 - y0) * scale + top + edge
    parts = [_open(wide, tall), *(_text(8, 20 + 15 * i, line, 12, "start") for i, line in enumerate(head))]
    parts.append(
        f'<g transform="translate({coord(edge - x0 * scale)} {coord(top + y1 * scale)}) '
        f'scale({coord(scale)})" stroke-width="{0.8 / scale:.4f}">'
    )
    slots = "".join(outline_path(slot_profile(slot)) for slot in array.sheet.strap_slots)
    outer = outline_path(rounded(array.sheet.outline, array.sheet.corner_mm))
    parts.append(
        f'<path d="{outer}{slots}" fill="#e4f2e4" stroke="#4f7f4f" fill-rule="evenodd"><title>sheet</title></path>'
    )
    for place, value in zip(array.places, values, strict=True):
        parts.append(
            f'<circle cx="{coord(place.x)}" cy="{coord(-place.y)}" r="{coord(place.radius)}" '
            f'fill="{_colour(_share(value, high))}" '
            f'stroke="#33566e"><title>{escape(f"{place.name}: {_map_percent(value)} %")}</title></circle>'
        )
    if circuit is not None:
        parts.append(f'<path d="{outline_path(circuit)}" fill="none" stroke="#a85a12"><title>circuit</title></path>')
    parts.append("</g>")
    size = min(13.0, 0.6 * min(place.radius for place in array.places) * scale)
    for place, value in zip(array.places, values, strict=True):
        x, y, fill = edge + (place.x - x0) * scale, top + (y1 - place.y) * scale, _ink(_share(value, high))
        parts.append(_text(x, y - 0.1 * size, place.name, size, "middle", fill))
        parts.append(_text(x, y + 1.0 * size, _map_percent(value), size, "middle", fill))
    parts += _scale(wide - _SCALE_PX + 20, top, min(240.0, tall - top - edge), high)
    return "\n".join([*parts, "</svg>", ""])


def _cells(matrix: Sequence[Sequence[float | None]], left: float, top: float, cell: float, high: float) -> list[str]:
    """Draw the cells, those of one colour as one path; runs of one colour in a row are one rectangle."""
    paths: dict[str, list[str]] = {}
    for i, row in enumerate(matrix):
        steps = ["#d9d9d9" if value is None else _colour(_share(value, high)) for value in row]
        j = 0
        for colour, run in groupby(steps):
            length = len(list(run))
            at = f"M{coord(left + j * cell)} {coord(top + i * cell)}"
            paths.setdefault(colour, []).append(f"{at}h{coord(length * cell)}v{coord(cell)}h{coord(-length * cell)}z")
            j += length
    return [f'<path fill="{colour}" d="{"".join(parts)}"/>' for colour, parts in sorted(paths.items())]


def _largest(values: Iterable[float]) -> float:
    """Return the value that the scale of colours ends at: the largest, 1 if there is none, as of a single unit."""
    return max(values, default=0.0) or 1.0


def _share(value: float, high: float) -> float:
    """Return a value's place from 0 to `high`, as both are written."""
    return float(_map_percent(value)) / float(_map_percent(high))


def _colour(share: float) -> str:
    """Return the colour of a share from 0 to 1, in `STEPS` steps."""
    step = round(share * (STEPS - 1)) / (STEPS - 1)
    return "#" + "".join(f"{round(a + (b - a) * step):02x}" for a, b in zip(_LIGHT, _DARK, strict=True))


def _ink(share: float) -> str:
    return "#ffffff" if share > 0.55 else _INK


def _scale(x: float, y: float, length: float, high: float) -> list[str]:
    part = length / STEPS
    bars = [
        f'<rect x="{coord(x)}" y="{coord(y + length - (i + 1) * part)}" width="14" height="{coord(part + 0.3)}" '
        f'fill="{_colour(i / (STEPS - 1))}"/>'
        for i in range(STEPS)
    ]
    marks = [
        _text(x + 18, y + length - share * length + 4, f"{_map_percent(share * high)} %", 11, "start")
        for share in (0.0, 0.5, 1.0)
    ]
    return [*bars, *marks]


def _open(wide: float, tall: float) -> str:
    size = f"{coord(wide)} {coord(tall)}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" width="{coord(wide)}" height="{coord(tall)}" '
        f'font-family="sans-serif"><rect width="{coord(wide)}" height="{coord(tall)}" fill="#ffffff"/>'
    )


def _text(x: float, y: float, content: str, size: float, anchor: str, fill: str = _INK) -> str:
    return (
        f'<text x="{coord(x)}" y="{coord(y)}" font-size="{coord(size)}" text-anchor="{anchor}" fill="{fill}">'
        f"{escape(content)}</text>"
    )


@lru_cache(maxsize=4096)
def _map_percent(value: float) -> str:
    """Return a fraction in per cent: two digits, three from 100 on."""
    shown = 100.0 * value
    return f"{shown:.0f}" if shown >= 9.95 else number(shown, 2)


CROSSTALK = "crosstalk.json"


def crosstalk_files(array: Array) -> dict[str, bytes]:
    """Return the files by their names. Raises Refusal for units without an estimate."""
    data, circuit = crosstalk(array), outline(array) if has_circuit(array) else None
    return {
        CROSSTALK: (json.dumps(data, indent=1, allow_nan=False) + "\n").encode(),
        "crosstalk.csv": crosstalk_csv(array),
        "crosstalk.svg": heat_map_svg(data).encode(),
        "crosstalk-patch.svg": patch_map_svg(array, data, circuit).encode(),
    }


def extras(array: Array, only: Sequence[str]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return circuit and crosstalk files by path, for the outputs `only`, and the reason for a missing one.

    Raises Refusal for a circuit that does not fit.
    """
    files, lacking = circuit_files(array) if "unit" in only else ({}, {})
    if "estimate" in only:
        try:
            files |= crosstalk_files(array)
        except Refusal as refusal:
            lacking[CROSSTALK] = str(refusal)
    return files, lacking

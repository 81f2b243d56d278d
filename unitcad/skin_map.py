"""The map of the skin's motion around units: superposition, where it is felt, the felt radius and the least pitch.

A map has a radial table for each kind of unit (`attenuation.radial`) and the places of the units. From these the
motion at any point follows, in Python (`amplitude`) and in a page (`report/app/skinmap.js`), by one formula. Lengths in
mm, amplitudes in um: peaks, as |u| of `attenuation.curve`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import msgspec
import numpy as np

from unitcad.attenuation.curve import contact, in_axes
from unitcad.attenuation.inputs import Drive, EstimateInput
from unitcad.attenuation.radial import TERMS, WANTED, RadialTable, radial_table
from unitcad.catalogue import touch
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec, estimate_input
from unitcad.export.field import DECADES, SCALE, Circle, Field
from unitcad.spec import Spec
from unitcad.text import join_words, number

AROUND_MM = 30.0
"""Skin around the units that a map shows."""
SHARE = 0.1
"""Default of the share for the least pitch."""
LARGEST_KB = 200
"""Largest size of a map's data, so that a page stays light."""
UNIT = 1e-8
"""Of the table's integers: share of |u| at the edge."""
_PITCHES_MM = 120.0
_MOST_POINTS, _FINEST_MM = 2_000_000, 0.5
ASSUMED = (
    "Bare skin, at middle values of the tissue; no other unit, sheet or circuit is on it. Ranges have the level's 80 % "
    "range, the threshold's own range, and a unit that sticks to the skin or rests on it."
)


class Span(msgspec.Struct, frozen=True):
    """A value with its range; a length of infinity is None."""

    value: float | None
    low: float | None
    high: float | None


class Threshold(msgspec.Struct, frozen=True):
    """The threshold of touch at a kind's frequency, um; `site`: "" if a person typed it; `source`: of the level."""

    um: Span
    site: str
    status: str
    source: str


class Kind(msgspec.Struct, frozen=True):
    """A distinct unit: its motion at the edge, its table, and its figures.

    edge_um       |u| at its edge: the level times the motor's amplitude; None with a reason in `no_edge`
    threshold     None with a reason in `no_threshold`
    felt_mm       felt radius from the unit's middle; 0: not felt, a value of None: farther than the table reaches
    pitch_mm      least pitch at which a neighbour of this kind moves a unit's middle by less than the share
    ends_mm       ends of the table's panels
    terms         real and imaginary parts of u_r, u_theta and u_z: Chebyshev coefficients, panel after panel, in `UNIT`
    error         of the table, over the largest motion
    """

    unit: str
    drive: Drive
    frequency_hz: float
    diameter_mm: float
    edge_um: Span | None
    no_edge: str
    threshold: Threshold | None
    no_threshold: str
    felt_mm: Span | None
    pitch_mm: Span
    ends_mm: tuple[float, ...]
    terms: tuple[tuple[int, ...], ...]
    error: float


class Place(msgspec.Struct, frozen=True):
    """A unit's middle, and the number of its kind."""

    name: str
    x: float
    y: float
    kind: int


class SkinMap(msgspec.Struct, frozen=True):
    """The map of units; `wrap_mm`: length of a whole turn around the limb, None if it is flat; `lines`: in words."""

    name: str
    tissue: str
    kinds: tuple[Kind, ...]
    places: tuple[Place, ...]
    box_mm: tuple[float, float, float, float]
    wrap_mm: float | None
    share: float
    lines: tuple[str, ...]

    @property
    def absolute(self) -> bool:
        """Whether every kind's level is known, so that amplitudes are in um; otherwise over the level at the edge."""
        return all(kind.edge_um is not None for kind in self.kinds)

    def figures(self) -> dict[str, Any]:
        """Return the map without its tables, as JSON-ready data."""
        kinds = [
            {key: value for key, value in msgspec.to_builtins(kind).items() if key not in ("ends_mm", "terms")}
            for kind in self.kinds
        ]
        return {"kinds": kinds, "box_mm": list(self.box_mm), "share": self.share, "lines": list(self.lines)}

    @property
    def synchronous(self) -> bool:
        """Whether all motors have one frequency, so that phases mean anything."""
        return len({kind.frequency_hz for kind in self.kinds}) == 1


def unit_map(
    spec: Spec, frequency_hz: float | None = None, threshold_um: float | None = None, share: float = SHARE
) -> SkinMap:
    """Return the map of one unit. Raises `Refusal` as `skin_map`."""
    half = spec.diameter_mm / 2.0
    placed = [("", 0.0, 0.0, spec)]
    return skin_map(spec.name, placed, (-half, -half, half, half), None, frequency_hz, threshold_um, share)


def skin_map(
    name: str,
    placed: Sequence[tuple[str, float, float, Spec]],
    patch_mm: tuple[float, float, float, float],
    wrap_mm: float | None = None,
    frequency_hz: float | None = None,
    threshold_um: float | None = None,
    share: float = SHARE,
) -> SkinMap:
    """Return the map of units at their places (name, x, y, spec) along the skin, on a patch and the skin around it.

    `threshold_um` replaces the published threshold of touch, at every frequency. `share`: of the motion at a unit's
    edge, for the least pitch. Raises `Refusal` for units without an estimate, and for waves too short for the map.
    """
    x0, y0, x1, y1 = patch_mm
    box = (x0 - AROUND_MM, y0 - AROUND_MM, x1 + AROUND_MM, y1 + AROUND_MM)
    if wrap_mm is not None and box[2] - box[0] > wrap_mm:  # once around the limb
        middle = (x0 + x1) / 2.0
        box = (middle - wrap_mm / 2.0, box[1], middle + wrap_mm / 2.0, box[3])
    corners = np.array([(x, y) for x in box[::2] for y in box[1::2]])
    far = max(float(np.hypot(*(corners - (x, y)).T).max()) for _, x, y, _ in placed)
    specs: list[Spec] = []
    for *_, spec in placed:
        if spec not in specs:
            specs.append(spec)
    reach = max(far, _PITCHES_MM) + 1.0
    kinds = tuple(_kind(spec, reach, frequency_hz, threshold_um, share) for spec in specs)
    places = tuple(Place(title, x, y, specs.index(spec)) for title, x, y, spec in placed)
    tissue = estimate_input(specs[0], frequency_hz).tissue_name
    made = SkinMap(name, tissue, kinds, places, box, wrap_mm, share, ())
    return msgspec.structs.replace(made, lines=tuple(_lines(made)))


def _kind(spec: Spec, reach_mm: float, hertz: float | None, threshold_um: float | None, share: float) -> Kind:
    variant = estimate_input(spec, hertz)
    table, (edge, unknown) = radial_table(variant, 1e-3 * reach_mm), _edge(spec, variant, hertz)
    threshold, reason = _threshold(variant, threshold_um)
    radius = variant.diameter / 2.0

    def farthest(least: float, own: int) -> float | None:
        """Return the last radius (mm) of at least a share, of bare skin (0) or at an end of `contact` (1, 2)."""

        def factor(r: np.ndarray) -> Any:
            return 1.0 if own == 0 else contact(variant.drive, 1e3 * (r - radius))[own - 1]

        found = 1e3 * table.last_above(least, factor)
        return None if math.isinf(found) else found

    felt = None
    if edge is not None and threshold is not None:
        um = threshold.um
        shares = _over(um.value, edge.value), _over(um.high, edge.low), _over(um.low, edge.high)
        felt = Span(*(farthest(least, own) for own, least in enumerate(shares)))
    pitch = (farthest(share, own) for own in range(3))
    parts = [part.ravel() for each in table.terms for part in (each.real, each.imag)]
    return Kind(
        unit=spec.name,
        drive=variant.drive,
        frequency_hz=variant.frequency.middle,
        diameter_mm=1e3 * variant.diameter,
        edge_um=edge,
        no_edge=unknown,
        threshold=threshold,
        no_threshold=reason,
        felt_mm=felt,
        pitch_mm=Span(*(None if one is None else max(one, 1e3 * variant.diameter) for one in pitch)),
        ends_mm=tuple(float(f"{1e3 * end:.12g}") for end in table.ends),
        terms=tuple(tuple(np.round(part / UNIT).astype(int).tolist()) for part in parts),
        error=float(f"{table.error:.2g}"),
    )


def _over(one: float | None, other: float | None) -> float:
    """Return a ratio of two lengths that are known."""
    return (one or 0.0) / (other or math.inf)


def _edge(spec: Spec, variant: EstimateInput, hertz: float | None) -> tuple[Span | None, str]:
    """Return |u| at a unit's edge in um, the level's 80 % range times the motor's amplitude, or why it is not known."""
    one = answer_spec(spec, hertz)
    if one.level is None or one.low is None or one.high is None:
        return None, one.reason
    if variant.amplitude is None:
        return None, "the motor's amplitude is not known"
    return Span(*(1e6 * variant.amplitude * level for level in (one.level, one.low, one.high))), ""


def _threshold(variant: EstimateInput, typed: float | None) -> tuple[Threshold | None, str]:
    """Return the threshold of touch under a unit, or why there is none."""
    hertz = variant.frequency.middle
    if typed is not None:
        return Threshold(Span(typed, typed, typed), "", "typed", "typed"), ""
    curve = touch().get(variant.tissue_name)
    if curve is None:
        return None, f"no curve of touch is known for the tissue {variant.tissue_name}"
    found = curve.at(hertz)
    if found is None:
        return None, f"the curve of touch is known from {float(curve.from_hz):g} to {float(curve.to_hz):g} Hz"
    um, low, high = found
    level = curve.threshold_um
    return Threshold(
        Span(um, low, high), curve.site.value, level.status, f"{curve.corner_hz.source}; {level.source}"
    ), ""


def _lines(made: SkinMap) -> Iterator[str]:
    several = len(made.kinds) > 1
    for kind in made.kinds:
        of = f"{kind.unit}: " if several else ""
        yield of + _felt_line(kind)
        share = f"{number(100 * made.share, 3)} %"
        yield (
            f"{of}Least pitch at which a neighbour moves a unit's middle by less than {share} of the motion at its own "
            f"edge: {_length(kind.pitch_mm)}."
        )
    if not made.synchronous:
        yield "The motors run at several frequencies: no phase lasts, and the map has the root of the sum of squares."
    yield ASSUMED
    if (worst := max(kind.error for kind in made.kinds)) > WANTED:
        yield f"The solver reaches an error of {worst:.1g} of the largest motion, {WANTED:g} was wanted."


def _felt_line(kind: Kind) -> str:
    if kind.threshold is None:
        return f"No felt radius: {kind.no_threshold}. Give a threshold in um."
    if kind.felt_mm is None:
        return f"No felt radius, since there is no level at the edge: {kind.no_edge}."
    one = kind.threshold
    um, own = number(one.um.value or 0.0, 2), "typed" if not one.site else f"{one.site}, level {one.status}"
    ends = "" if not one.site else f" ({number(one.um.low or 0.0, 2)} to {number(one.um.high or 0.0, 2)})"
    where = f"{_length(kind.felt_mm)} from the middle of a unit" if kind.felt_mm.value != 0 else "nowhere"
    ranged = "" if kind.felt_mm.value != 0 or kind.felt_mm.high == 0 else f"; at most {_length(kind.felt_mm)}"
    return f"Felt radius: {where}{ranged}. Threshold of touch at {kind.frequency_hz:g} Hz: {um} um{ends}, {own}."


def _length(one: Span) -> str:
    value, low, high = ("beyond the map" if v is None else number(v, 2) for v in (one.value, one.low, one.high))
    ends = "" if low == high else f" ({low} to {high})"
    return f"{value} mm{ends}" if one.value is not None else f"{value}{ends}"


def table_of(kind: Kind) -> RadialTable:
    """Return the radial table of a kind's data."""
    terms = UNIT * np.array(kind.terms, dtype=float).reshape(3, 2, -1, TERMS)
    return RadialTable(1e-3 * np.array(kind.ends_mm), terms[:, 0] + 1j * terms[:, 1], kind.error)


def amplitude(
    made: SkinMap, x: np.ndarray, y: np.ndarray, phases_deg: Mapping[str, float] | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return |u| at points (mm), and its share of the threshold of touch; None if one of both is not known.

    `phases_deg`: phase of each unit that is on, by name; default: all, in one phase. |u| is in um, or over the level at
    the edge (`SkinMap.absolute`). Motions of different frequencies add as the root of the sum of squares.
    """
    by_frequency: dict[float, np.ndarray] = {}
    limits: dict[float, float | None] = {}
    for place in made.places:
        if phases_deg is not None and place.name not in phases_deg:
            continue
        kind = made.kinds[place.kind]
        across = x - place.x
        if made.wrap_mm is not None:
            across = (across + made.wrap_mm / 2.0) % made.wrap_mm - made.wrap_mm / 2.0
        away, angle = np.hypot(across, y - place.y), np.arctan2(y - place.y, across)
        edge = kind.edge_um.value if made.absolute and kind.edge_um and kind.edge_um.value else 1.0
        turned = np.exp(1j * math.radians((phases_deg or {}).get(place.name, 0.0)))
        moved = edge * turned * in_axes(_table(kind).at(1e-3 * away), angle, kind.drive)
        before = by_frequency.get(kind.frequency_hz)
        by_frequency[kind.frequency_hz] = moved if before is None else before + moved
        limits[kind.frequency_hz] = kind.threshold.um.value if kind.threshold else None
    sizes = {hertz: np.linalg.norm(moved, axis=-1) for hertz, moved in by_frequency.items()}
    if not sizes:
        return np.zeros(np.shape(x)), None
    whole = np.sqrt(sum(size**2 for size in sizes.values()))
    if not made.absolute or any(limit is None for limit in limits.values()):
        return whole, None
    return whole, np.sqrt(sum((size / (limits[hertz] or 1.0)) ** 2 for hertz, size in sizes.items()))


_table: Callable[[Kind], RadialTable] = lru_cache(maxsize=64)(table_of)


def map_data(made: SkinMap) -> dict[str, Any]:
    """Return a map as JSON-ready data for a page, with the constants of its formula and its colours.

    Raises `Refusal` if it is larger than a page may carry.
    """
    size = len(msgspec.json.encode(made))
    if size > 1000 * LARGEST_KB:
        limit = f"its map of {len(made.kinds)} kinds of units has {size // 1000} kB, the most is {LARGEST_KB}"
        raise Refusal("array", made.name, limit)
    return {**msgspec.to_builtins(made), "terms": TERMS, "unit": UNIT, "scale": SCALE, "decades": DECADES}


def field_of(made: SkinMap, phases_deg: Mapping[str, float] | None = None) -> Field:
    """Return a map as a field for a picture; `phases_deg` as for `amplitude`."""
    x0, y0, x1, y1 = made.box_mm
    step = max(_FINEST_MM, math.sqrt((x1 - x0) * (y1 - y0) * len(made.places) / _MOST_POINTS))
    columns, rows = (math.ceil((high - low) / step) + 1 for low, high in ((x0, x1), (y0, y1)))
    x, y = np.meshgrid(np.linspace(x0, x1, columns), np.linspace(y0, y1, rows))
    values, felt = amplitude(made, x, y, phases_deg)
    on = [phases_deg is None or place.name in phases_deg for place in made.places]
    circles = [
        Circle(place.name, place.x, place.y, made.kinds[place.kind].diameter_mm / 2.0, own)
        for place, own in zip(made.places, on, strict=True)
    ]
    hertz = join_words(f"{value:g} Hz" for value in dict.fromkeys(kind.frequency_hz for kind in made.kinds))
    how = "" if len(made.places) == 1 else ", all units in one phase" if phases_deg is None else ", chosen units on"
    line = () if felt is None else ("Orange line: the threshold of touch.",)
    return Field(
        title=f"{made.name}: amplitude of the skin's motion, {hertz}{how}",
        box=made.box_mm,
        values=values,
        unit="um" if made.absolute else "of the edge",
        circles=circles,
        contour=None if felt is None else (felt, 1.0, "felt"),
        words=(*line, *made.lines),
    )

"""Every candidate of a target as a table: lengths, silicones, size, mass, hours, and probability of the level."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import structs

from unitcad import catalogue
from unitcad.attenuation.curve import crosstalk_ratio
from unitcad.attenuation.edge import measured as nearest
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured import FIELDS, stack_inputs
from unitcad.attenuation.edge.ranges import Predictive, lead_of
from unitcad.attenuation.inputs import EstimateInput, Quantity, SiliconeLayer
from unitcad.casting.figures import CASTING_NEEDS, cure_hours, not_castable
from unitcad.casting.procedure import procedure
from unitcad.designs import dimensions
from unitcad.designs import shipped as designs
from unitcad.designs.dimensions import MOTOR_CLEARANCE
from unitcad.errors import Refusal
from unitcad.estimate_inputs import drawn_input, silicone_layer
from unitcad.moulds.mould_set import MouldSet
from unitcad.search.target_file import MOST_GEOMETRIES, Target
from unitcad.spec import Spec
from unitcad.text import join_words, some
from unitcad.validation import from_data

MOST_CANDIDATES = 400_000
Say = Callable[[str], None]


@dataclass(frozen=True)
class Lengths:
    """The lengths of a unit that vary, mm: walls and caps inside out; a design may have no caps."""

    design: str
    motor: str
    walls: tuple[float, ...]
    caps: tuple[float, ...]
    diameter: float


@dataclass(frozen=True)
class Geometry:
    """Lengths that a design accepts: spec and estimate's input, with some silicone in every layer."""

    lengths: Lengths
    spec: Spec
    variant: EstimateInput

    @property
    def height_mm(self) -> float:
        """The height of the unit over the skin, its circuit's pad included."""
        dims = dimensions(self.spec)
        return max(dims.heights[-1], dims.pad.high if dims.pad else 0.0, dims.motor_height)


@dataclass(frozen=True)
class Candidates:
    """Candidates as columns, one row each: `geometry` and `sequence` are indices into the two lists.

    mass in g; hours from the first weighing until the unit is out of the mould; crosstalk at the pitch, or at touching
    units if the pitch is shorter, NaN without a pitch. `probability` is that of meeting the level; `novelty`: how many
    of lengths, motor and frequency no measured unit had. skipped: silicones without a modulus, or that can't be cast,
    with the reason.
    refused: the reasons why lengths were refused, by design and field.
    """

    target: Target
    geometries: list[Geometry]
    sequences: list[tuple[str, ...]]
    silicones: dict[str, SiliconeLayer]
    geometry: np.ndarray
    sequence: np.ndarray
    predictive: Predictive
    probability: np.ndarray
    novelty: np.ndarray
    mass_g: np.ndarray
    cure_hours: np.ndarray
    height_mm: np.ndarray
    diameter_mm: np.ndarray
    crosstalk: np.ndarray
    skipped: dict[str, str] = field(default_factory=dict)
    refused: dict[str, list[str]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """How many there are."""
        return self.geometry.size

    def lengths(self, row: int) -> Lengths:
        """Return the lengths of a candidate."""
        return self.geometries[self.geometry[row]].lengths

    def materials(self, row: int) -> tuple[str, ...]:
        """Return the silicones of a candidate from the inside out."""
        return self.sequences[self.sequence[row]]

    def kind(self, row: int) -> tuple[str, str, tuple[str, ...]]:
        """Return (design, motor, silicones): candidates of one kind differ only in lengths."""
        lengths = self.lengths(row)
        return lengths.design, lengths.motor, self.materials(row)

    def variant(self, row: int) -> EstimateInput:
        """Return a candidate as the estimate reads it."""
        own = self.geometries[self.geometry[row]].variant
        layers = zip(self.materials(row), own.layers, strict=True)
        known = tuple(structs.replace(self.silicones[name], thickness=layer.thickness) for name, layer in layers)
        return structs.replace(own, layers=known)

    def spec(self, row: int, name: str = "candidate") -> Spec:
        """Return the spec of a candidate."""
        return from_data(spec_data(self.target, self.lengths(row), self.materials(row), name))

    @cached_property
    def range(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The 10, 50 and 90 % points of the level."""
        return self.predictive.range


def candidates(target: Target, say: Say = lambda stage: None) -> Candidates:
    """Return every candidate of a target. Raises Refusal for too many, if there is none, or if none can be cast."""
    try:
        made, refused = geometries(target, say)
        known, skipped = silicones_of(target, made[0].variant.frequency)
        table = replace(tabulate(target, made, known, say), skipped=skipped, refused=refused)
        if np.isnan(table.cure_hours).all():
            finish_hours(made[0].spec)  # which says why no moulds can be made
        return table
    except Refusal as refusal:
        if refusal.field.partition(".")[0] not in target.asked.spec:
            raise
        raise Refusal(f"spec.{refusal.field}", refusal.value, refusal.limit, refusal.nearest) from None


def spec_data(target: Target, lengths: Lengths, materials: Sequence[str], name: str = "candidate") -> dict[str, Any]:
    """Return the plain data of a candidate's spec."""
    tables = target.entries
    layers: list[dict[str, Any]] = [
        {"material": material, "wall_mm": wall} for material, wall in zip(materials, lengths.walls, strict=True)
    ]
    for layer, cap in zip(layers, lengths.caps, strict=False):
        layer["cap_mm"] = cap
    return {
        "name": name,
        "design": lengths.design,
        "diameter_mm": lengths.diameter,
        **tables,
        "motor": {"part": lengths.motor, **tables.get("motor", {})},
        "layers": layers,
    }


def geometry_of(target: Target, lengths: Lengths) -> Geometry:
    """Return the geometry of lengths. Raises Refusal if the design does not accept them."""
    known = catalogue.materials(target.asked.materials)
    some_silicone = next((name for name in target.materials if not not_castable(known[name])), target.materials[0])
    spec = from_data(spec_data(target, lengths, (some_silicone,) * len(lengths.walls)))
    return Geometry(lengths, spec, drawn_input(spec))


def geometries(target: Target, say: Say = lambda stage: None) -> tuple[list[Geometry], dict[str, list[str]]]:
    """Return every geometry that the target lets vary, and why others were refused, by design and field.

    Raises Refusal for more than `MOST_GEOMETRIES`, and the design's own if it accepts none.
    """
    wanted = list(itertools.islice(_lengths(target), MOST_GEOMETRIES + 1))
    step = target.asked.vary.step_mm
    if len(wanted) > MOST_GEOMETRIES:
        limit = f"makes more than {MOST_GEOMETRIES} sets of lengths to try; widen the step or narrow the ranges"
        raise Refusal("vary.step_mm", step, limit, 2 * step)
    made: list[Geometry] = []
    refused: dict[str, list[str]] = {}
    last = None
    for i, lengths in enumerate(wanted):
        if i % 200 == 0:
            say(f"lengths {i} of {len(wanted)}")
        try:
            made.append(geometry_of(target, lengths))
        except Refusal as refusal:
            last = refusal
            refused.setdefault(f"{lengths.design}, {refusal.field}", []).append(refusal.limit)
    if last and not made:
        raise last
    return made, refused


def _lengths(target: Target) -> Iterator[Lengths]:
    vary, known = target.asked.vary, designs()
    caps = grid(vary.cap_mm, vary.step_mm) if vary.cap_mm else ()
    for design, motor, count in itertools.product(target.designs, target.asked.at_hand.motors, sorted(vary.layers)):
        for walls in itertools.product(grid(vary.walls(count), vary.step_mm), repeat=count):
            over = [walls] if known[design].caps else [()]
            if known[design].caps and caps:
                over = list(itertools.product(caps, repeat=count))
            for diameter, cap in itertools.product(_diameters(target, motor, walls), over):
                yield Lengths(design, motor, walls, cap, diameter)


def _diameters(target: Target, motor: str, walls: tuple[float, ...]) -> tuple[float, ...]:
    """Return the diameters to try; default: the measured units', or the least that motor, clearance and walls fit."""
    vary, most = target.asked.vary, target.goals.diameter_max_mm
    if vary.diameter_mm:
        return grid(vary.diameter_mm, vary.diameter_step_mm)
    table = target.entries.get("motor", {})
    wide = table.get("diameter_mm") or float(catalogue.motors(target.asked.motors)[motor].diameter_mm)
    clearance = 0.0 if table.get("fill") else MOTOR_CLEARANCE
    least = math.ceil(10 * (wide + 2 * (clearance + sum(walls))) - 1e-6) / 10
    usual = catalogue.measurements().unit.diameter_mm
    return (max(usual if most is None else min(usual, most), least),)


def grid(ends: tuple[float, float], step: float) -> tuple[float, ...]:
    """Return the values from the least to the largest, a step apart, the largest among them."""
    low, high = ends
    values = [round(low + i * step, 6) for i in range(math.floor((high - low) / step + 1e-9) + 1)]
    return tuple(values if np.isclose(values[-1], high) else [*values, high])


def silicones_of(target: Target, frequency: Quantity) -> tuple[dict[str, SiliconeLayer], dict[str, str]]:
    """Return the silicones at hand as the estimate reads them, and why others are skipped.

    Raises Refusal if none has a modulus.
    """
    entries, known, skipped = catalogue.materials(target.asked.materials), {}, {}
    for name in target.materials:
        if lacks := not_castable(entries[name]):
            missing = " and ".join(CASTING_NEEDS[key] for key in lacks)
            skipped[name] = f"the catalogue has no {missing} for it (state {' and '.join(lacks)} in [materials])"
            continue
        layer = silicone_layer(entries[name], 1e-3, frequency, target.asked.estimate.moduli == "quasi-static")
        if math.isnan(layer.place):
            skipped[name] = "no modulus is known"
        else:
            known[name] = layer
    if not known:
        name, why = next(iter(skipped.items()))
        limit = f"none can be tried: {name}: {why}"
        raise Refusal("at_hand.materials", list(target.materials), limit)
    return known, skipped


def sequences_of(
    materials: Sequence[str], count: int, entries: Mapping[str, catalogue.Material]
) -> list[tuple[str, ...]]:
    """Return the silicones of `count` layers: each cures on the one inside it, and is another one.

    Two layers of one silicone are one layer.
    """

    def cures(on: str, poured: str) -> bool:
        found = catalogue.contact(entries[poured], entries[on])
        return on != poured and (found is None or found.result == "bonds")

    every = itertools.product(materials, repeat=count)
    return [one for one in every if all(itertools.starmap(cures, itertools.pairwise(one)))]


def tabulate(
    target: Target,
    made: list[Geometry],
    silicones: dict[str, SiliconeLayer],
    say: Say = lambda stage: None,
) -> Candidates:
    """Return the candidates of geometries with every sequence of silicones.

    Raises Refusal for too many, and if there is none.
    """
    counts = np.array([len(one.lengths.walls) for one in made])
    entries, room_c = catalogue.materials(made[0].spec.materials), made[0].spec.casting.room_c
    by_count = {int(n): sequences_of(list(silicones), int(n), entries) for n in np.unique(counts)}
    total = sum(len(by_count[n]) for n in counts.tolist())
    if total > MOST_CANDIDATES:
        step, limit = target.asked.vary.step_mm, f"makes {total} candidates; at most {MOST_CANDIDATES}"
        raise Refusal("vary.step_mm", step, limit, 2 * step)
    if not total:
        limit = "has no two silicones with a modulus of which one cures on the other: vary one layer"
        raise Refusal("at_hand.materials", list(target.materials), limit)
    say(f"{total} candidates")
    sequences = [one for n in by_count for one in by_count[n]]
    lead = lead_of(target.asked.estimate.moduli, target.fit)
    parts, start = [], 0
    for n, own in by_count.items():
        at = np.flatnonzero(counts == n)
        if own:
            units, of, mass = _units([made[i] for i in at], [[silicones[name] for name in one] for one in own])
            sequence = np.tile(np.arange(len(own)) + start, at.size)
            new = [len(nearest.differing(place)) for place in nearest.coordinates(units, of)[:: len(own)]]
            columns = np.repeat(at, len(own)), sequence, mass, np.repeat(new, len(own))
            parts.append((*columns, lead.predictive(units, of)))
        start += len(own)
    geometry, sequence, mass, new = (np.concatenate([part[i] for part in parts]) for i in range(4))
    ends = ("centre", "scale")
    predictive = replace(
        parts[0][4], **{end: np.concatenate([getattr(part[4], end) for part in parts]) for end in ends}
    )
    cures = np.array([_cure_hours(one, entries, room_c) for one in sequences])
    say("crosstalk")
    return Candidates(
        target=target,
        geometries=made,
        sequences=sequences,
        silicones=silicones,
        geometry=geometry,
        sequence=sequence,
        predictive=predictive,
        probability=probability(target, predictive),
        novelty=new,
        mass_g=1e3 * mass,
        cure_hours=_by_key(made, lambda of: (of.design, of.motor, len(of.walls)), _bench_hours)[geometry]
        + cures[sequence],
        height_mm=np.array([one.height_mm for one in made])[geometry],
        diameter_mm=np.array([one.lengths.diameter for one in made])[geometry],
        crosstalk=_by_key(made, lambda of: (of.motor, of.diameter), lambda one: _crosstalk(one, target.goals.pitch_mm))[
            geometry
        ],
    )


def probability(target: Target, predictive: Predictive) -> np.ndarray:
    """Return the probability of meeting the level, shape (...)."""
    goals = target.goals
    if goals.edge_max is not None:
        return predictive.at_most(goals.edge_max)
    return 1.0 - predictive.at_most(goals.edge_min or 0.0)


def _units(
    made: Sequence[Geometry], own: Sequence[Sequence[SiliconeLayer]]
) -> tuple[Units, nearest.Lengths, np.ndarray]:
    """Return the closed forms' input, lengths and mass (kg) of each geometry with each sequence of silicones."""
    variants = [one.variant for one in made]
    base, each, count = stack_inputs(variants), nearest.lengths(variants), len(own)
    of_silicones = {key: [[getattr(layer, key).middle for layer in one] for one in own] for key in FIELDS}
    for key in ("density", "place", "doubt"):
        of_silicones[key] = [[getattr(layer, key) for layer in one] for one in own]
    units = replace(
        base,
        **{key: np.tile(values, (len(made), 1)) for key, values in of_silicones.items()},
        **{key: np.repeat(getattr(base, key), count, axis=0) for key in ("thickness", "omega", "passes")},
    )
    of = nearest.Lengths(*(np.repeat(part, count, axis=0) for part in vars(each).values()))
    shapes = [one.geometry for one in variants]
    cylinders = [[layer.outer_radius**2 * layer.top for layer in shape.layers] for shape in shapes]
    inside = [[shape.cavity_radius**2 * shape.core_height] for shape in shapes]
    volumes = np.pi * np.diff(np.concatenate([inside, cylinders], axis=1))
    motor = np.array([shape.motor_mass.middle for shape in shapes])
    mass = np.einsum("ij,ij->i", np.repeat(volumes, count, axis=0), units.density) + np.repeat(motor, count)
    return units, of, mass


def finish_hours(spec: Spec) -> float:
    """Return the hours from the first pour's first step until the units are out of the mould.

    Work before it is done once for a mould. Raises Refusal if the moulds can't be made.
    """
    # Volumes change only the grams, which the procedure's times do not depend on.
    made = procedure(MouldSet(spec), (1.0,) * len(spec.layers), 1.0)
    begins = next(phase.start_min for phase in made.time_line if phase.name == "pour 1")
    return (made.earliest_finish_min - begins) / 60


def _cure_hours(names: Iterable[str], entries: Mapping[str, catalogue.Material], room_c: float) -> float:
    """Return the hours that layers of these silicones cure, one after the other, at the room's temperature."""
    return sum(cure_hours(entries[name], room_c) for name in names)


def _by_key(
    made: Sequence[Geometry], key: Callable[[Lengths], Hashable], value: Callable[[Geometry], float]
) -> np.ndarray:
    """Return a value of each geometry, worked out once for all geometries of one key."""
    first = {key(one.lengths): one for one in reversed(made)}
    known = {own: value(one) for own, one in first.items()}
    return np.array([known[key(one.lengths)] for one in made])


def _bench_hours(one: Geometry) -> float:
    """Return the hours of a geometry's procedure without its cures, NaN if its moulds can't be made.

    Lengths do not change them.
    """
    spec, names = one.spec, (layer.material for layer in one.spec.layers)
    try:
        return finish_hours(spec) - _cure_hours(names, catalogue.materials(spec.materials), spec.casting.room_c)
    except Refusal:
        return math.nan


def _crosstalk(one: Geometry, pitch: float | None) -> float:
    """Return the ratio of a geometry at the pitch, or at touching units, without its range; NaN without a pitch."""
    if pitch is None:
        return math.nan
    return crosstalk_ratio(one.variant, 1e-3 * max(pitch, one.lengths.diameter), spread=False).middle


@dataclass(frozen=True)
class Limit:
    """A limit: the target's key and value, each row's value, and who meets it.

    is_least: `asked` is the least value that is allowed, otherwise the largest.
    """

    key: str
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

    def offer(self, row: int) -> float:
        """Return the value to ask for in its place: three digits, and the row meets it."""
        sign, value = -1.0 if self.is_least else 1.0, float(self.values[row])
        if not value:
            return value
        unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
        return float(f"{sign * np.ceil(sign * value / unit - 1e-9) * unit:.3g}")


def limits(found: Candidates) -> list[Limit]:
    """Return the limits that a target sets besides the level."""
    columns = {
        "diameter_max_mm": found.diameter_mm,
        "height_max_mm": found.height_mm,
        "mass_max_g": found.mass_g,
        "cure_hours_max": found.cure_hours,
        "crosstalk_ratio_max": found.crosstalk,
        "pitch_mm": found.diameter_mm,  # neighbours do not touch
    }
    return [
        Limit(key, most, values, values <= most * (1 + 1e-9))
        for key, values in columns.items()
        if (most := getattr(found.target.goals, key)) is not None
    ]


def within(found: Candidates) -> np.ndarray:
    """Return the rows that meet every limit besides the level; there may be none."""
    met = np.array([limit.met for limit in limits(found)]).reshape(-1, found.count)
    return np.flatnonzero(met.all(axis=0))


def meets_level(found: Candidates, measured: Mapping[int, Mapping[str, Any]]) -> np.ndarray:
    """Return whether each row meets the level: by its measurement, or with the probability that is asked for."""
    met = found.probability >= found.target.goals.probability_min
    met[list(measured)] = [one["meets"] for one in measured.values()]
    return met


def _level_limit(found: Candidates, measured: Mapping[int, Mapping[str, Any]]) -> Limit:
    """Return the limit on the level.

    A row's value is its measured level, or the one that it meets with the probability that is asked for.
    """
    goals, share = found.target.goals, found.target.goals.probability_min
    is_least = goals.edge_max is None
    values = found.predictive.quantile(1 - share if is_least else share)
    values[list(measured)] = [one["level"] for one in measured.values()]
    key, asked = ("edge_min", goals.edge_min) if is_least else ("edge_max", goals.edge_max)
    return Limit(key, asked or 0.0, values, meets_level(found, measured), is_least)


def check_possible(found: Candidates, measured: Mapping[int, Mapping[str, Any]]) -> None:
    """Raise Refusal, with the nearest values that are met together, if no candidate meets everything.

    measured: see `measured_rows`. If several values must change, the refusal has the others in its `others`.
    """
    asked = [*limits(found), _level_limit(found, measured)]
    far, missed = np.array([limit.far for limit in asked]), ~np.array([limit.met for limit in asked])
    if not missed.any(axis=0).all():
        return
    rows = np.arange(found.count)  # of equally near ones, the one with the fewest unmeasured inputs
    row = int(np.lexsort((rows, found.novelty, np.round(far.sum(axis=0), 9)))[0])
    none = f"none of {found.count} candidates meets it" + (" and the rest" if len(asked) > 1 else "")
    left_out = f"; not tried: {some(found.skipped)}" if found.skipped else ""
    offers = {limit.key: (limit.asked, limit.offer(row)) for i, limit in enumerate(asked) if missed[i, row]}
    made = []
    for key, (value, offer) in offers.items():
        others = [f"target.{other} = {instead:g}" for other, (_, instead) in offers.items() if other != key]
        together = f": together with {join_words(others)}" if others else ""
        words = f"{none}; nearest is {label(found, row)}{together}{left_out}"
        made.append(Refusal(f"target.{key}", value, words, offer))
    made[0].others = tuple(made[1:])
    raise made[0]


def label(found: Candidates, row: int) -> str:
    """Return a candidate in a few words: design, silicones from the inside out, walls."""
    lengths = found.lengths(row)
    walls = " and ".join(f"{wall:g}" for wall in lengths.walls)
    motor = f", {lengths.motor}" if len(found.target.asked.at_hand.motors) > 1 else ""
    return f"{lengths.design} {'/'.join(found.materials(row))}, walls {walls} mm{motor}"

"""Every candidate of a target as a table: what it is made of, what it measures, and how probably it meets the level."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from unitcad import catalogue
from unitcad.attenuation.crosstalk import crosstalk_ratio
from unitcad.attenuation.edge.bush import sections
from unitcad.attenuation.edge.closed_form import Section, Units
from unitcad.attenuation.edge.predictive import Predictive, stack_of
from unitcad.attenuation.inputs import Quantity, SiliconeLayer
from unitcad.errors import Refusal
from unitcad.estimating import silicone_layer
from unitcad.search.finish_time import Work, bench_hours, cure_hours, finish_hours
from unitcad.search.geometries import Geometry, Lengths, Refused, Say, geometries
from unitcad.search.target_file import Target

MOST_CANDIDATES = 400_000


@dataclass(frozen=True)
class Silicones:
    """The silicones that the models can read, by name, and why the others are left out."""

    known: dict[str, SiliconeLayer]
    left_out: dict[str, str]


@dataclass(frozen=True)
class Candidates:
    """Candidates as columns, one row each: `geometry` and `sequence` are indices into the two lists.

    mass in g, hours from the first weighing until it is out of the mould, crosstalk NaN where it is not asked for.
    `probability` is that of meeting the level; `work`: see `finish_time`.
    """

    target: Target
    geometries: list[Geometry]
    sequences: list[tuple[str, ...]]
    silicones: Silicones
    refused: dict[str, Refused]
    geometry: np.ndarray
    sequence: np.ndarray
    predictive: Predictive
    probability: np.ndarray
    mass_g: np.ndarray
    hours: np.ndarray
    height_mm: np.ndarray
    diameter_mm: np.ndarray
    crosstalk: np.ndarray
    work: Work

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
        """Return (design, motor, silicones): candidates of one kind differ in lengths alone."""
        lengths = self.lengths(row)
        return lengths.design, lengths.motor, self.materials(row)

    @cached_property
    def range(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The 10, 50 and 90 % points of the level."""
        return self.predictive.range


def candidates(target: Target, say: Say = lambda stage: None) -> Candidates:
    """Return every candidate of a target. Raises Refusal where there is none, or too many."""
    try:
        made, refused = geometries(target, say)
        return tabulate(target, made, refused, silicones_of(target, made[0].variant.frequency), say)
    except Refusal as refusal:
        if refusal.field.partition(".")[0] not in target.asked.spec:
            raise
        raise Refusal(f"spec.{refusal.field}", refusal.value, refusal.limit, refusal.nearest) from None


def silicones_of(target: Target, frequency: Quantity) -> Silicones:
    """Return the silicones at hand as the estimate reads them. Raises Refusal where none has a modulus."""
    entries, known, left_out = catalogue.materials(target.asked.materials), {}, {}
    for name in target.materials:
        layer = silicone_layer(entries[name], 1e-3, frequency, target.asked.estimate.moduli == "quasi-static")
        if layer.youngs_modulus.value is None:
            left_out[name] = layer.youngs_modulus.note
        else:
            known[name] = layer
    if not known:
        names = list(target.materials)
        raise Refusal("at_hand.materials", names, f"no level can be estimated: {next(iter(left_out.values()))}")
    return Silicones(known, left_out)


def sequences_of(materials: Sequence[str], count: int) -> list[tuple[str, ...]]:
    """Return the silicones of `count` layers, neighbours different: two layers of one silicone are one layer."""
    every = itertools.product(materials, repeat=count)
    return [one for one in every if all(a != b for a, b in itertools.pairwise(one))]


def tabulate(
    target: Target,
    made: list[Geometry],
    refused: dict[str, Refused],
    silicones: Silicones,
    say: Say = lambda stage: None,
    only: tuple[str, ...] | None = None,
    work: Work | None = None,
) -> Candidates:
    """Return the candidates of geometries with every sequence of silicones, or with `only` one; `work` is added to.

    Raises Refusal for too many, where there is none, and where no moulds can be made of any.
    """
    counts = [len(one.lengths.walls) for one in made]
    known = list(silicones.known)
    by_count = {n: [only] if only else sequences_of(known, n) for n in sorted(set(counts))}
    total = sum(len(by_count[n]) for n in counts)
    if total > MOST_CANDIDATES:
        limit = f"makes {total} candidates; at most {MOST_CANDIDATES}"
        raise Refusal("vary.step_mm", target.asked.vary.step_mm, limit, 2 * target.asked.vary.step_mm)
    if not total:
        limit = "has one silicone with a modulus, and neighbouring layers differ: vary one layer"
        raise Refusal("at_hand.materials", list(target.materials), limit)
    sequences = [one for n in by_count for one in by_count[n]]
    starts = dict(zip(by_count, np.cumsum([0, *map(len, by_count.values())]), strict=False))
    stack, parts = stack_of(target.models, target.fit, target.asked.estimate.moduli), []
    for n, own in by_count.items():
        at = np.flatnonzero(np.equal(counts, n))
        if not own or not at.size:
            continue
        say(f"{at.size * len(own)} candidates of {n} {'layer' if n == 1 else 'layers'}")
        geometry, sequence = (each.ravel() for each in np.meshgrid(at, np.arange(len(own)), indexing="ij"))
        units, volumes = _units([made[i] for i in at], [[silicones.known[m] for m in one] for one in own])
        motor = np.array([made[i].variant.geometry.motor_mass.middle for i in at])
        mass = np.einsum("ij,ij->i", volumes, units.density) + np.repeat(motor, len(own))
        parts.append((geometry, sequence + starts[n], stack.predictive(units), 1e3 * mass))
    geometry, sequence = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    predictive = replace(
        parts[0][2],
        centre=np.concatenate([part[2].centre for part in parts]),
        scale=np.concatenate([part[2].scale for part in parts]),
    )
    say("hours")
    entries, work = catalogue.materials(target.asked.materials), {} if work is None else work
    cures = np.array([cure_hours(one, entries, target.casting.room_c) for one in sequences])
    benches = np.array([bench_hours(one, work) for one in made])
    if np.isnan(benches).all():
        finish_hours(made[0].spec)  # says why no moulds can be made
    say("crosstalk")
    crosstalk = _crosstalk(target, made)
    return Candidates(
        target=target,
        geometries=made,
        sequences=sequences,
        silicones=silicones,
        refused=refused,
        geometry=geometry,
        sequence=sequence,
        predictive=predictive,
        probability=probability_of(target, predictive),
        mass_g=np.concatenate([part[3] for part in parts]),
        hours=cures[sequence] + benches[geometry],
        work=work,
        height_mm=np.array([one.height for one in made])[geometry],
        diameter_mm=np.array([one.lengths.diameter for one in made])[geometry],
        crosstalk=crosstalk[geometry],
    )


def probability_of(target: Target, predictive: Predictive) -> np.ndarray:
    """Return the probability of meeting the level that is wished for."""
    return probability_by_model(target, predictive) @ predictive.weights


def probability_by_model(target: Target, predictive: Predictive) -> np.ndarray:
    """Return the same by each model alone, shape (..., models)."""
    wish = target.wish
    below = predictive.each_at_most(wish.edge_max) if wish.edge_max is not None else np.ones(predictive.centre.shape)
    return below - predictive.each_at_most(wish.edge_min) if wish.edge_min is not None else below


def _units(made: Sequence[Geometry], own: Sequence[Sequence[SiliconeLayer]]) -> tuple[Units, np.ndarray]:
    """Return the closed forms' input and the layers' volumes (m3), a row for each geometry with each sequence."""
    count, layers = len(own), len(own[0])
    variants = [one.variant for one in made]

    def of_materials(values: list[list[float]]) -> np.ndarray:
        return np.tile(np.array(values, dtype=float), (len(made), 1))

    def of_lengths(values: Sequence[object]) -> np.ndarray:
        return np.repeat(np.array(values, dtype=float), count, axis=0)

    section = sections([variant.geometry for variant in variants])
    units = Units(
        youngs_modulus=of_materials([[layer.youngs_modulus.middle for layer in one] for one in own]),
        density=of_materials([[layer.density for layer in one] for one in own]),
        poisson_ratio=of_materials([[layer.poisson_ratio.middle for layer in one] for one in own]),
        tan_delta=of_materials([[layer.tan_delta.middle for layer in one] for one in own]),
        thickness=of_lengths([[layer.thickness for layer in variant.layers] for variant in variants]),
        omega=of_lengths([2.0 * np.pi * variant.frequency.middle for variant in variants]),
        passes=of_lengths([variant.passes for variant in variants]),
        section=Section(*(np.repeat(getattr(section, field.name), count, axis=0) for field in fields(section))),
    )
    tops = np.array([[layer.top for layer in variant.geometry.layers] for variant in variants])
    inside = np.array(section.cavity_radius) ** 2 * np.array(section.core_height)
    cylinders = np.concatenate([inside[:, None], np.array(section.outer_radii) ** 2 * tops], axis=1)
    volumes = np.pi * np.diff(cylinders, axis=1)
    assert volumes.shape[1] == layers
    return units, np.repeat(volumes, count, axis=0)


def _crosstalk(target: Target, made: Sequence[Geometry]) -> np.ndarray:
    """Return the ratio of each geometry at the pitch, without its range; NaN where none is asked for or units meet."""
    pitch = target.wish.pitch_mm
    found: dict[tuple[str, float], float] = {}
    for one in made:
        key = (one.lengths.motor, one.lengths.diameter)
        if pitch is not None and key not in found and one.lengths.diameter <= pitch + 1e-9:
            found[key] = crosstalk_ratio(one.variant, 1e-3 * pitch, spread=False).middle
    return np.array([found.get((one.lengths.motor, one.lengths.diameter), np.nan) for one in made])

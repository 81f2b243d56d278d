"""A campaign measured: every record, then the level of each unit at its edge and along the skin.

A level is amplitudes over the motor's, from repeats, with an interval of 95 %. The mean of ratios with their standard
deviation covers the truth too rarely: ratios are skewed, and three repeats say little of their own scatter. So
logarithms are averaged, and Student's t widens the interval for the few repeats.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

import numpy as np
from scipy.stats import t

from unitcad.errors import Refusal
from unitcad.lab.campaign import Campaign, SensorTable, UnitTable, check_files
from unitcad.lab.record import LabFinding, RecordResult, assumed_unit, finding, measure_record
from unitcad.text import some

COVERAGE = 0.95
LEAST_REPEATS = 3
MOST_DISAGREEMENT = 0.15
"""Standard deviation of the repeats' logarithms: three times the usual one."""
NEAR_MOTOR = 0.2
"""Part of the motor's frequency, to either side, in which a unit's line is looked for."""
MOST_APART = 0.1
"""Part of the motor's frequency by which the unit's may differ: beyond, it is another motor's."""
LEVELS = (1e-4, 3.0)
"""A level beyond these is that of a wrong unit: measured levels are 0.04 to 1, and prefixes differ by 1000."""
LEAST_UNSTATED = 1e-3
"""The least level at an edge if a file states no unit: a thousandth of a measured level is below it."""
MOST_BETWEEN_REPEATS = 10.0
"""Factor between repeats beyond which they are not of one place, or not in the units that they are read in."""


@dataclass(frozen=True)
class Level:
    """A level with the ends of its interval of 95 %, the repeats above and below the line.

    `scatter` is the standard deviation of the repeats' logarithms, the larger of both sides'.
    """

    value: float
    low: float
    high: float
    repeats: tuple[int, int]
    scatter: float


def level(amplitudes: Sequence[float], references: Sequence[float] | None = None) -> Level:
    """Return the level of repeated amplitudes over repeated amplitudes of the motor, measured apart.

    Without `references` the amplitudes are ratios to a motor that was recorded at the same time. The two scatters may
    differ (Welch 1947, Satterthwaite 1946). Raises Refusal for fewer than three repeats of either.
    """

    sides = []
    for field, values in (("points", amplitudes), ("reference", references)):
        if values is None:
            continue
        if len(values) < LEAST_REPEATS:
            limit = f"has {len(values)} usable repeats; a level needs {LEAST_REPEATS} or more"
            raise Refusal(field, None, limit)
        sides.append(np.log(values))
    counts, means = [len(logs) for logs in sides], [float(np.mean(logs)) for logs in sides]
    variances = [float(np.var(logs, ddof=1)) for logs in sides]
    parts = [variance / count for variance, count in zip(variances, counts, strict=True)]
    weights = sum(part**2 / (count - 1) for part, count in zip(parts, counts, strict=True))
    freedom = sum(parts) ** 2 / weights if weights > 0 else float(sum(counts) - len(counts))
    log = means[0] - sum(means[1:])
    half = float(t.ppf((1 + COVERAGE) / 2, freedom)) * math.sqrt(sum(parts))
    ends = (math.exp(log), math.exp(log - half), math.exp(log + half))
    return Level(*ends, (counts[0], counts[-1]), math.sqrt(max(variances)))


@dataclass(frozen=True)
class PlaceLevel:
    """The level of one unit at one place by one chain; distance 0 is the edge."""

    unit: str
    distance_mm: float
    chain: str
    level: Level
    frequency_hz: float


@dataclass(frozen=True)
class Measured:
    """A campaign's result: levels, records by unit, findings."""

    campaign: Campaign
    levels: tuple[PlaceLevel, ...]
    records: dict[str, tuple[RecordResult, ...]]
    findings: tuple[LabFinding, ...]


def measure(campaign: Campaign, folder: Path, say: Callable[[str], None] = lambda name: None) -> Measured:
    """Measure a campaign with files in or below `folder`; `say` gets each record.

    Raises Refusal for a file that can't be read.
    """
    check_files(campaign, folder)
    levels: list[PlaceLevel] = []
    records: dict[str, tuple[RecordResult, ...]] = {}
    findings: list[LabFinding] = []
    for unit in campaign.unit:
        records[unit.name] = tuple(one := _records(unit, campaign, folder, say))
        _expect_units_stated(campaign, [record for several in records.values() for record in several])
        findings += [finding for record in one for finding in record.findings]
        for role, distance, _ in sorted(_places(unit), key=itemgetter(1)):
            more, said = _levels(unit, role, distance, one, campaign)
            levels += more
            findings += said
    return Measured(campaign, tuple(levels), records, tuple(findings))


def _expect_units_stated(campaign: Campaign, records: Sequence[RecordResult]) -> None:
    """Raise Refusal if some files of one sensor state a unit, and others, read in another unit, none."""
    own_motor = campaign.motor_sensor is not None
    for key, sensor in (("sensor", campaign.sensor), ("motor_sensor", campaign.motor_sensor)):
        if sensor is None or sensor.per is not None:
            continue
        read = [
            (record.file, unit)
            for record in records
            for i, unit in enumerate(record.units)
            if own_motor is False or (key == "motor_sensor") == (record.role == "reference" or i == 1)
        ]
        silent = next((file for file, unit in read if not unit.stated), None)
        other = next(((file, unit) for file, unit in read if unit.stated and unit.name != assumed_unit(sensor)), None)
        if silent and other:
            limit = f"is needed: {other[0]} states {other[1].name}, and {silent} no unit: is it in {other[1].name}?"
            raise Refusal(f"{key}.per", None, limit, assumed_unit(sensor))


def _units(records: Sequence[RecordResult], channel: int = 0) -> str:
    """Return the units in which the records' numbers were read, with the files if they differ."""
    by_unit: dict[str, list[str]] = {}
    for record in records:
        by_unit.setdefault(str(record.units[channel]), []).append(record.file)
    return ", ".join(f"{unit}: {some(names, 3)}" if len(by_unit) > 1 else unit for unit, names in by_unit.items())


def _apart(where: str, values: Sequence[float], records: Sequence[RecordResult]) -> LabFinding | None:
    """Return the finding that repeats differ too much for a level, if they do."""
    factor = max(values) / min(values)
    if factor <= MOST_BETWEEN_REPEATS:
        return None
    message = f"repeats differ by a factor of {factor:.3g}, read in {_units(records)}"
    return finding("L109", where, message, "error")


def _places(unit: UnitTable) -> list[tuple[str, float, tuple[str, ...]]]:
    """Return role, distance and records of a unit's places, in the order of the file."""
    edge = [("edge", 0.0, unit.edge)] if unit.edge else []
    return edge + [(f"{point.distance_mm:g} mm", point.distance_mm, point.records) for point in unit.point]


def _records(unit: UnitTable, campaign: Campaign, folder: Path, say: Callable[[str], None]) -> list[RecordResult]:
    """Measure a unit's records: the motor's first, near whose frequency the others' lines are looked for."""
    motor = campaign.motor_sensor or campaign.sensor
    band = campaign.chain.band_hz
    out: list[RecordResult] = []

    def add(name: str, role: str, sensors: tuple[SensorTable, ...], band: tuple[float, float]) -> None:
        say(name)
        out.append(measure_record(folder / name, role, campaign, sensors, band, name))

    for name in unit.reference:
        add(name, "reference", (motor,), band)
    hertz = [record.frequency_hz for record in out if record.usable]
    if hertz:
        middle = float(np.median(hertz))
        band = (max(band[0], middle * (1 - NEAR_MOTOR)), min(band[1], middle * (1 + NEAR_MOTOR)))
    sensors = (campaign.sensor,) if campaign.recording.motor_channel is None else (campaign.sensor, motor)
    for role, _, names in _places(unit):
        for name in names:
            add(name, role, sensors, band)
    return out


def _levels(
    unit: UnitTable, role: str, distance: float, records: list[RecordResult], campaign: Campaign
) -> tuple[list[PlaceLevel], list[LabFinding]]:
    """Return a unit's levels at one place by every chain, and the findings about them."""
    there = [record for record in records if record.role == role and record.usable]
    motor = [record for record in records if record.role == "reference" and record.usable]
    paired = campaign.recording.motor_channel is not None
    where = f"{unit.name}, {role}"
    for side in (there,) if paired else (there, motor):
        if len(side) < LEAST_REPEATS:
            return [], [finding("L112", where, f"{len(side)} usable records; a level needs {LEAST_REPEATS}")]
    base = there if paired else motor
    middle = float(np.median([one.frequency_hz for one in base]))
    near = [one for one in there if abs(one.frequency_hz - middle) < MOST_APART * middle]
    if not near:
        return [], [finding("L116", where, f"nothing near the motor's {middle:.2f} Hz")]
    hertz = float(np.median([one.frequency_hz for one in near]))
    levels: list[PlaceLevel] = []
    findings: list[LabFinding] = []
    for chain in campaign.chain.use:
        values, below = ([one.by_chain[chain] for one in side if chain in one.by_chain] for side in (near, base))
        if not values:  # L114 or L106 says why
            continue
        count = min(len(values), len(below))
        if count < LEAST_REPEATS:
            message = f"{count} usable records; a level needs {LEAST_REPEATS}"
            findings.append(finding("L112", f"{where}, {hertz:.2f} Hz, by {chain}", message))
            continue
        sides = ((where, values, near), (f"{unit.name}, motor", below, base))[: 1 if paired else 2]
        if doubt := next((one for name, each, side in sides if (one := _apart(name, each, side))), None):
            findings.append(doubt)
            continue
        result = level(values, None if paired else below)
        units = [record.units[0] for record in near] + (
            [near[0].units[1]] if paired else [one.units[0] for one in base]
        )
        least = LEVELS[0] if distance or all(one.stated for one in units) else LEAST_UNSTATED
        if not least <= result.value <= LEVELS[1]:
            read = f"read in {_units(near)} at the place and {_units(near, 1) if paired else _units(base)} at the motor"
            limit = f"is the level by {chain}; it must be from {least:g} to {LEVELS[1]:g}. Is a unit wrong? {read}"
            raise Refusal(where, float(f"{result.value:.4g}"), limit)
        levels.append(PlaceLevel(unit.name, distance, chain, result, hertz))
        if result.scatter > MOST_DISAGREEMENT:
            message = f"by {chain}: logarithms scatter by {result.scatter:.2f}"
            findings.append(finding("L109", where, message))
    return levels, findings

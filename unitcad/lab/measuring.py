"""A campaign measured: every record, then the level of each unit at its edge and along the skin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.files import sha256
from unitcad.lab.campaign import Campaign, UnitTable
from unitcad.lab.campaign_files import blank_files, check_files
from unitcad.lab.chains.chain import Chain
from unitcad.lab.chains.line import Mains
from unitcad.lab.chains.signal_chains import chains_of
from unitcad.lab.lab_rules import LabFinding, found
from unitcad.lab.levels import LEAST_REPEATS, Level, level, paired_level
from unitcad.lab.measured_record import measure_record
from unitcad.lab.motor_off import mains_of_blanks
from unitcad.lab.record_result import RecordResult
from unitcad.lab.unit_files import file_of, source_file

MOST_DISAGREEMENT = 0.15
"""Standard deviation of the repeats' logarithms: three times the usual one."""
NEAR_MOTOR = 0.2
"""Part of the motor's frequency, to either side, in which a unit's line is looked for."""

MOST_APART = 0.1
"""Part of the motor's frequency by which the unit's may differ: beyond, it is another motor's."""


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
    """A campaign's result: levels, records by unit, findings, hashes of its other files.

    `mains` and `motor_mains` are the mains' amplitudes by multiple in motor-off records of the unit's sensor and of the
    motor's, in its unit.
    """

    campaign: Campaign
    levels: tuple[PlaceLevel, ...]
    records: dict[str, tuple[RecordResult, ...]]
    findings: tuple[LabFinding, ...]
    specs: dict[str, str]
    mains: tuple[tuple[int, float], ...]
    motor_mains: tuple[tuple[int, float], ...]

    @property
    def chains(self) -> tuple[Chain, ...]:
        """The chains of the campaign."""
        return chains_of(self.campaign.chain)

    @property
    def assumed(self) -> dict[str, Any]:
        """The parameters of the chains that their sources do not state; none where no such chain was used."""
        return {name: value for chain in self.chains for name, value in chain.assumed.items()}


def measure(campaign: Campaign, folder: Path, say: Callable[[str], None] = lambda stage: None) -> Measured:
    """Measure a campaign whose files lie in or below `folder`, as its TOML file gives them.

    Raises Refusal for a file that is not there or can't be read without a guess.
    """
    check_files(campaign, folder)
    mains = mains_of_blanks(campaign, folder)
    paired = campaign.recording.motor_channel is not None
    levels: list[PlaceLevel] = []
    records: dict[str, tuple[RecordResult, ...]] = {}
    findings: list[LabFinding] = []
    specs = {name: sha256(folder / name) for _, name in blank_files(campaign)}
    for i, unit in enumerate(campaign.unit):
        if name := source_file(unit, folder, f"unit.{i}"):
            specs[name] = sha256(folder / name)
        one = _unit(unit, f"unit.{i}", campaign, folder, mains, say)
        records[unit.name] = tuple(one)
        findings += [finding for record in one for finding in record.findings]
        found_levels, more = _levels(unit, one, campaign, paired)
        levels += found_levels
        findings += more
    return Measured(campaign, tuple(levels), records, tuple(findings), specs, mains[0].blank, mains[1].blank)


def _unit(
    unit: UnitTable,
    field: str,
    campaign: Campaign,
    folder: Path,
    mains: tuple[Mains, Mains],
    say: Callable[[str], None],
) -> list[RecordResult]:
    """Measure a unit's records: the motor's first, whose frequency the others' lines are looked for near."""
    motor_sensor = campaign.motor_sensor or campaign.sensor
    paired = campaign.recording.motor_channel is not None
    band = campaign.chain.band_hz
    out = []
    for i, name in enumerate(unit.reference):
        say(name)
        path = file_of(folder, name, f"{field}.reference.{i}")
        out.append(measure_record(path, "reference", campaign, (motor_sensor,), mains[1:], band, name, unit.lines))
    hertz = [record.frequency_hz for record in out if record.usable]
    if hertz:
        middle = float(np.median(hertz))
        band = (max(band[0], middle * (1 - NEAR_MOTOR)), min(band[1], middle * (1 + NEAR_MOTOR)))
    sensors = (campaign.sensor, motor_sensor) if paired else (campaign.sensor,)
    places = [("edge", f"{field}.edge", unit.edge)]
    places += [(f"{p.distance_mm:g} mm", f"{field}.point.{k}.records", p.records) for k, p in enumerate(unit.point)]
    for role, where, names in places:
        for i, name in enumerate(names):
            say(name)
            path = file_of(folder, name, f"{where}.{i}")
            out.append(measure_record(path, role, campaign, sensors, mains, band, name, unit.lines))
    return out


def _levels(
    unit: UnitTable, records: list[RecordResult], campaign: Campaign, paired: bool
) -> tuple[list[PlaceLevel], list[LabFinding]]:
    levels, findings = [], []
    places = [("edge", 0.0)] if unit.edge else []
    places += [(f"{point.distance_mm:g} mm", point.distance_mm) for point in unit.point]
    for role, distance in sorted(places, key=lambda place: place[1]):
        there = [record for record in records if record.role == role and record.usable]
        motor = [record for record in records if record.role == "reference" and record.usable]
        few = [len(side) for side in ([there] if paired else [there, motor]) if len(side) < LEAST_REPEATS]
        where = f"{unit.name}, {role}"
        if few:
            findings.append(found("L112", where, f"{few[0]} usable records; a level needs {LEAST_REPEATS}"))
            continue
        shared = max(record.shared for record in (*there, *motor))
        here: list[PlaceLevel] = []
        for chain in chains_of(campaign.chain):
            for hertz, values, below in _sides(chain, there, there if paired else motor):
                at = f"{where}, {hertz:.2f} Hz, by {chain.name}"
                if not values:
                    none = found("L116", where, f"nothing near the motor's {hertz:.2f} Hz")
                    findings += [] if none in findings else [none]  # the same of every chain
                elif min(len(values), len(below)) < LEAST_REPEATS:
                    count = min(len(values), len(below))
                    findings.append(found("L112", at, f"{count} usable records; a level needs {LEAST_REPEATS}"))
                else:
                    result = paired_level(values, shared) if paired else level(values, below, shared)
                    here.append(PlaceLevel(unit.name, distance, chain.name, result, hertz))
                    if result.scatter > MOST_DISAGREEMENT:
                        findings.append(
                            found("L109", where, f"by {chain.name}: logarithms scatter by {result.scatter:.2f}")
                        )
        levels += here
        if len({one.chain for one in here}) == len(here):
            for one, other in combinations(here, 2):
                if one.level.high < other.level.low or other.level.high < one.level.low:
                    said = f"{one.chain} {one.level.value:.3g}, {other.chain} {other.level.value:.3g}"
                    findings.append(found("L115", where, said))
    return levels, findings


def _sides(
    chain: Chain, there: list[RecordResult], motor: list[RecordResult]
) -> list[tuple[float, list[float], list[float]]]:
    """Return frequency, the records' values and the motor's, of each line that the motor's records have.

    A chain that tells no lines apart has one entry. No values at all: no record has a line near the motor's.
    """
    lines = sorted(hertz for hertz, _ in max(motor, key=lambda one: len(one.by_line)).by_line)
    if chain.each_line and len(lines) > 1:
        gap = min(b - a for a, b in pairwise(lines))
        return [(hertz, _near(there, hertz, gap / 2), _near(motor, hertz, gap / 2)) for hertz in lines]
    middle = float(np.median([one.frequency_hz for one in motor]))
    values = _near(there, middle, MOST_APART * middle)
    if not values or chain.each_line:
        nearest = [min((hz for hz, _ in one.by_line), key=lambda hz: abs(hz - middle), default=middle) for one in there]
        hertz = float(np.median(nearest)) if values else middle
        return [(hertz, values, _near(motor, middle, MOST_APART * middle))]
    values, below = (
        [one.by_chain[chain.name] for one in side if chain.name in one.by_chain] for side in (there, motor)
    )
    hertz = float(np.median([one.frequency_hz for one in there]))
    return [(hertz, values, below)] if values else []


def _near(records: list[RecordResult], hertz: float, most: float) -> list[float]:
    """Return of each record the value of the line nearest to a frequency, of records that have one close enough."""
    out = []
    for record in records:
        at, value = min(record.by_line, key=lambda one: abs(one[0] - hertz), default=(np.inf, 0.0))
        if abs(at - hertz) < most:
            out.append(value)
    return out

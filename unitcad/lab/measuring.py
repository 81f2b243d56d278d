"""A campaign measured: every record, then the level of each unit at its edge and along the skin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.lab.campaign import Campaign, UnitTable
from unitcad.lab.campaign_files import check_files, file_of, source_files
from unitcad.lab.chains.line import Mains
from unitcad.lab.chains.paper import ASSUMED
from unitcad.lab.lab_rules import LabFinding, found
from unitcad.lab.levels import LEAST_REPEATS, Level, level, paired_level
from unitcad.lab.record_result import RecordResult, mains_of, measure_record
from unitcad.lab.signals import sha256

MOST_DISAGREEMENT = 0.15
"""Standard deviation of the repeats' logarithms: three times the usual one."""
NEAR_MOTOR = 0.2
"""Part of the motor's frequency, to either side, in which a unit's line is looked for."""


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
    """A campaign's result: levels, records by unit, findings, hashes of specs, the mains of the motor-off records."""

    campaign: Campaign
    levels: tuple[PlaceLevel, ...]
    records: dict[str, tuple[RecordResult, ...]]
    findings: tuple[LabFinding, ...]
    specs: dict[str, str]
    mains: tuple[tuple[int, float], ...]

    @property
    def assumed(self) -> dict[str, Any]:
        """The parameters of the paper's chain that the paper does not state; none where it was not used."""
        table = self.campaign.chain
        return {name: getattr(table, name) for name in ASSUMED} if "paper" in table.use else {}


def measure(campaign: Campaign, folder: Path, say: Callable[[str], None] = lambda stage: None) -> Measured:
    """Measure a campaign whose files lie in or below `folder`, as its TOML file gives them.

    Raises Refusal for a file that is not there or can't be read without a guess.
    """
    check_files(campaign, folder)
    blanks = [file_of(folder, name, "blank.records") for name in (campaign.blank.records if campaign.blank else ())]
    blank = mains_of(blanks, campaign) if blanks else ()
    mains = Mains(campaign.chain.mains_hz, blank)
    paired = campaign.recording.motor_channel is not None
    levels: list[PlaceLevel] = []
    records: dict[str, tuple[RecordResult, ...]] = {}
    findings: list[LabFinding] = []
    specs = {}
    for i, unit in enumerate(campaign.unit):
        for key, name in source_files(unit):
            specs[name] = sha256(file_of(folder, name, f"unit.{i}.{key}"))
        one = _unit(unit, f"unit.{i}", campaign, folder, mains, say)
        records[unit.name] = tuple(one)
        findings += [finding for record in one for finding in record.findings]
        found_levels, more = _levels(unit, one, campaign, paired)
        levels += found_levels
        findings += more
    return Measured(campaign, tuple(levels), records, tuple(findings), specs, blank)


def _unit(
    unit: UnitTable, field: str, campaign: Campaign, folder: Path, mains: Mains, say: Callable[[str], None]
) -> list[RecordResult]:
    """Measure a unit's records: the motor's first, whose frequency the others' lines are looked for near."""
    motor_sensor = campaign.motor_sensor or campaign.sensor
    paired = campaign.recording.motor_channel is not None
    own = mains if motor_sensor == campaign.sensor else Mains(campaign.chain.mains_hz)
    band = campaign.chain.band_hz
    out = []
    for i, name in enumerate(unit.reference):
        say(name)
        path = file_of(folder, name, f"{field}.reference.{i}")
        out.append(measure_record(path, "reference", campaign, (motor_sensor,), own, band, name))
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
            out.append(measure_record(path, role, campaign, sensors, mains, band, name))
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
        for chain in campaign.chain.use:
            values = [record.by_chain[chain] for record in there]
            if paired:
                result = paired_level(values, shared)
            else:
                result = level(values, [record.by_chain[chain] for record in motor], shared)
            hertz = float(np.median([record.frequency_hz for record in there]))
            levels.append(PlaceLevel(unit.name, distance, chain, result, hertz))
            if result.scatter > MOST_DISAGREEMENT:
                findings.append(found("L109", where, f"by {chain}: logarithms scatter by {result.scatter:.2f}"))
    return levels, findings

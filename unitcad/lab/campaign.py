"""The campaign file: which recordings are of which unit and place, by which sensor, and what no file can tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from unitcad.errors import Refusal
from unitcad.lab.chains.chain import ChainTable
from unitcad.lab.chains.signal_chains import chains_of
from unitcad.lab.quantities import Quantity, to_si
from unitcad.lab.unit_files import Cavity
from unitcad.spec.asked import Table
from unitcad.spec.convert import convert
from unitcad.spec.toml import read_toml

Name = Annotated[str, Meta(min_length=1, max_length=100)]
Record = Annotated[str, Meta(min_length=1, max_length=1000)]
Records = Annotated[tuple[Record, ...], Meta(max_length=1000)]
Positive = Annotated[float, Meta(ge=1e-12, le=1e12)]
Column = Annotated[int, Meta(ge=1, le=4096)] | Name
Rate = Annotated[float, Meta(ge=1, le=1e10)]
TimeUnit = Literal["s", "ms", "us", "ns"]
Delimiter = Literal["", ",", ";", "\t", " "]
DecimalSign = Literal["", ".", ","]
SkippedLines = Annotated[int, Meta(ge=0, le=100000)]


class SensorTable(Table, frozen=True, kw_only=True):
    """What the samples are: quantity and unit after `scale`, which is that unit per unit in the file."""

    quantity: Quantity
    unit: Name
    scale: Positive = 1.0
    full_scale: Annotated[Positive | None, Meta(description="largest value that the sensor gives, in unit")] = None


class OwnRecordingTable(Table, frozen=True, kw_only=True):
    """How some of the records are read: names, or patterns such as "motor-*.mat", and what is their own."""

    records: Records
    rate_hz: Rate | None = None
    channel: Column | None = None
    motor_channel: Column | None = None
    time_column: Column | None = None
    time_unit: TimeUnit | None = None
    delimiter: Delimiter | None = None
    decimal: DecimalSign | None = None
    skip_lines: SkippedLines | None = None


class RecordingTable(Table, frozen=True, kw_only=True):
    """How the files are read, where they don't say it themselves; `own` has other values for some of them."""

    rate_hz: Rate | None = None
    channel: Column | None = None
    motor_channel: Annotated[Column | None, Meta(description="the motor, recorded at the same time")] = None
    time_column: Column | None = None
    time_unit: TimeUnit | None = None
    delimiter: Delimiter = ""
    decimal: DecimalSign = ""
    skip_lines: SkippedLines = 0
    own: Annotated[tuple[OwnRecordingTable, ...], Meta(max_length=100)] = ()


class BlankTable(Table, frozen=True, kw_only=True):
    """Records with the motor off: they tell the mains. Where they have a motor's channel, they tell its mains too."""

    records: Records
    motor_records: Annotated[Records, Meta(description="motor off, by the motor_sensor where it records alone")] = ()


class PointTable(Table, frozen=True, kw_only=True):
    """Records at a distance from the unit's edge along the skin."""

    distance_mm: Annotated[float, Meta(ge=0.01, le=1000)]
    records: Records


class UnitTable(Table, frozen=True, kw_only=True):
    """One unit: its spec or the record of its casting, and its records."""

    name: Name
    spec: Name | None = None
    cast: Name | None = None
    cavity: Cavity | None = None
    reference: Annotated[Records, Meta(description="the motor alone, where no channel has it")] = ()
    edge: Records = ()
    lines: Annotated[int, Meta(ge=1, le=6, description="lines that its records have, one a motor of an array")] = 1
    point: tuple[PointTable, ...] = ()


class Campaign(Table, frozen=True, kw_only=True):
    """A campaign: one sensor, units with their records."""

    name: Name
    note: Annotated[str, Meta(max_length=1000)] = ""
    sensor: SensorTable
    recording: RecordingTable = RecordingTable()
    motor_sensor: SensorTable | None = None
    blank: BlankTable | None = None
    chain: ChainTable = ChainTable()
    unit: Annotated[tuple[UnitTable, ...], Meta(min_length=1, description="one [[unit]] table or more")]


def read_campaign(path: Path) -> Campaign:
    """Return the campaign of a TOML file. Raises Refusal for the first value that is not valid."""
    campaign = convert(read_toml(path), Campaign)
    if campaign.chain.band_hz[0] >= campaign.chain.band_hz[1]:
        raise Refusal("chain.band_hz", list(campaign.chain.band_hz), "must rise", [60.0, 250.0])
    chains_of(campaign.chain)
    to_si(campaign.sensor.unit, campaign.sensor.quantity, "sensor.unit")
    if campaign.motor_sensor is not None:
        to_si(campaign.motor_sensor.unit, campaign.motor_sensor.quantity, "motor_sensor.unit")
    if campaign.blank is not None and campaign.blank.motor_records:
        _expect_own_sensor(campaign, campaign.blank.motor_records)
    names = [unit.name for unit in campaign.unit]
    for i, unit in enumerate(campaign.unit):
        field = f"unit.{i}"
        if names.index(unit.name) != i:
            raise Refusal(f"{field}.name", unit.name, "is the name of two units")
        if not unit.edge and not unit.point:
            raise Refusal(f"{field}.edge", None, "is required, or a [[unit.point]]")
        distances = [point.distance_mm for point in unit.point]
        if len(set(distances)) < len(distances):
            raise Refusal(f"{field}.point", distances, "has a distance twice; put its records together")
        if unit.reference and campaign.recording.motor_channel is not None:
            raise Refusal(f"{field}.reference", list(unit.reference), "stands beside recording.motor_channel")
        if not unit.reference and campaign.recording.motor_channel is None:
            raise Refusal(f"{field}.reference", None, "is required, or recording.motor_channel")
    return campaign


def _expect_own_sensor(campaign: Campaign, records: tuple[str, ...]) -> None:
    """Refuse motor-off records of a motor's sensor where none records alone."""
    if campaign.recording.motor_channel is not None:
        limit = "stands beside recording.motor_channel: the channel of blank.records tells the motor's mains"
        raise Refusal("blank.motor_records", list(records), limit)
    if campaign.motor_sensor is None:
        limit = "stands without [motor_sensor]: blank.records tells the mains of the one sensor"
        raise Refusal("blank.motor_records", list(records), limit)


def plain_data(campaign: Campaign) -> dict[str, object]:
    """Return the campaign as JSON-ready data."""
    return msgspec.to_builtins(campaign)

"""A campaign: its file, and the settings of [recording] for each record."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from unitcad.errors import Refusal
from unitcad.files import sha256
from unitcad.lab.chains import ChainTable, chains_of
from unitcad.lab.readers import Quantity, expect_ending, to_si
from unitcad.lab.unit_files import Cavity, file_of, source_file
from unitcad.spec.convert import convert
from unitcad.spec.raw import Table
from unitcad.validation.typed_files import load_file

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
    """The sensor, and how its samples become the quantity."""

    quantity: Annotated[Quantity, Meta(description="quantity that the sensor measures")]
    unit: Annotated[Name, Meta(description="unit of the samples after scale, such as mm/s")]
    scale: Annotated[Positive, Meta(description="unit per volt, or per the unit in per")] = 1.0
    per: Annotated[Name | None, Meta(description="unit of the numbers in the files; default: V, or no unit")] = None
    full_scale: Annotated[
        Positive | None,
        Meta(
            description="largest value that the sensor gives, in unit; default: unitcad finds clipping in the samples"
        ),
    ] = None


class RecordingOverride(Table, frozen=True, kw_only=True):
    """Settings of some records; they override [recording]."""

    records: Annotated[Records, Meta(description="names of records, or patterns such as motor-*.mat")]
    rate_hz: Annotated[Rate | None, Meta(description="samples per second")] = None
    channel: Annotated[Column | None, Meta(description="the unit's channel: a name, or a number from 1")] = None
    motor_channel: Annotated[Column | None, Meta(description="the motor's channel")] = None
    time_column: Annotated[Column | None, Meta(description="column of the time")] = None
    time_unit: Annotated[TimeUnit | None, Meta(description="unit of the time column")] = None
    delimiter: Annotated[Delimiter | None, Meta(description="sign between two columns")] = None
    decimal: Annotated[DecimalSign | None, Meta(description="decimal sign")] = None
    skip_lines: Annotated[SkippedLines | None, Meta(description="lines to skip at the beginning")] = None


class RecordingTable(Table, frozen=True, kw_only=True):
    """Settings of all records, for what their files do not state."""

    rate_hz: Annotated[Rate | None, Meta(description="samples per second, if the files do not state it")] = None
    channel: Annotated[Column | None, Meta(description="the unit's channel: a name, or a number from 1")] = None
    motor_channel: Annotated[Column | None, Meta(description="the motor's channel, recorded at the same time")] = None
    time_column: Annotated[Column | None, Meta(description="column of the time")] = None
    time_unit: Annotated[TimeUnit | None, Meta(description="unit of the time column")] = None
    delimiter: Annotated[Delimiter, Meta(description="sign between two columns; default: found in the file")] = ""
    decimal: Annotated[DecimalSign, Meta(description="decimal sign; default: found in the file")] = ""
    skip_lines: Annotated[SkippedLines, Meta(description="lines to skip at the beginning of each file")] = 0
    override: Annotated[tuple[RecordingOverride, ...], Meta(max_length=100)] = ()


class BlankTable(Table, frozen=True, kw_only=True):
    """Records with the motor off. They show the mains of the sensor."""

    records: Annotated[Records, Meta(description="records with the motor off")]
    motor_records: Annotated[
        Records, Meta(description="records with the motor off by motor_sensor, if that sensor records alone")
    ] = ()


class PointTable(Table, frozen=True, kw_only=True):
    """Records at a distance from the unit's edge along the skin."""

    distance_mm: Annotated[float, Meta(ge=0.01, le=1000, description="distance from the unit's edge along the skin")]
    records: Annotated[Records, Meta(description="records at this point")]


class UnitTable(Table, frozen=True, kw_only=True):
    """One unit: its spec or the record of its casting, and its records."""

    name: Annotated[Name, Meta(description="a name of the unit")]
    spec: Annotated[Name | None, Meta(description="spec file or template of the unit")] = None
    cast: Annotated[Name | None, Meta(description="cast record of the unit, in place of spec")] = None
    cavity: Annotated[Cavity | None, Meta(description="cavity of the cast record")] = None
    reference: Annotated[Records, Meta(description="records of the motor alone, without motor_channel")] = ()
    edge: Annotated[Records, Meta(description="records at the unit's edge")] = ()
    lines: Annotated[int, Meta(ge=1, description="only 1: one motor runs at a time")] = 1
    point: tuple[PointTable, ...] = ()


class Campaign(Table, frozen=True, kw_only=True):
    """A campaign: one sensor, units with their records."""

    name: Annotated[Name, Meta(description="a name of the campaign")]
    note: Annotated[str, Meta(max_length=1000, description="a remark for the results")] = ""
    sensor: SensorTable
    recording: RecordingTable = RecordingTable()
    motor_sensor: SensorTable | None = None
    blank: BlankTable | None = None
    chain: ChainTable = ChainTable()
    unit: Annotated[tuple[UnitTable, ...], Meta(min_length=1, description="one [[unit]] table or more")]


def read_campaign(path: Path) -> Campaign:
    """Return the campaign of a TOML file. Raises Refusal with every value that is not valid, and its line."""
    return load_file(path, "campaign", lambda data, _: _campaign_of(data))


def _campaign_of(data: dict[str, Any]) -> Campaign:
    campaign = convert(data, Campaign)
    band, motor_channel = campaign.chain.band_hz, campaign.recording.motor_channel
    if band[0] >= band[1]:
        raise Refusal("chain.band_hz", list(band), "must rise", [60.0, 250.0])
    chains_of(campaign.chain)
    for key, sensor in (("sensor", campaign.sensor), ("motor_sensor", campaign.motor_sensor)):
        if sensor is not None:
            to_si(sensor.unit, sensor.quantity, f"{key}.unit")
    excess = "is not allowed together with recording.motor_channel"
    if campaign.blank is not None and campaign.blank.motor_records:
        records = list(campaign.blank.motor_records)
        if motor_channel is not None:
            limit = f"{excess}: the channel of blank.records shows the motor's mains"
            raise Refusal("blank.motor_records", records, limit)
        if campaign.motor_sensor is None:
            limit = "needs [motor_sensor]: blank.records shows the mains of the one sensor"
            raise Refusal("blank.motor_records", records, limit)
    names = [unit.name for unit in campaign.unit]
    for i, unit in enumerate(campaign.unit):
        field = f"unit.{i}"
        if names.index(unit.name) != i:
            raise Refusal(f"{field}.name", unit.name, "is the name of two units")
        if unit.lines > 1:
            raise Refusal(f"{field}.lines", unit.lines, "run one motor at a time, and record each by itself", 1)
        if not unit.edge and not unit.point:
            raise Refusal(f"{field}.edge", None, "is required, or a [[unit.point]]")
        distances = [point.distance_mm for point in unit.point]
        if len(set(distances)) < len(distances):
            raise Refusal(f"{field}.point", distances, "has a distance twice; put its records together")
        if bool(unit.reference) == (motor_channel is not None):
            given = list(unit.reference)
            limit = excess if given else "is required, or recording.motor_channel"
            raise Refusal(f"{field}.reference", given or None, limit)
    return campaign


def blank_files(campaign: Campaign) -> Iterator[tuple[str, str]]:
    """Yield key and name of the motor-off records."""
    if campaign.blank is not None:
        for key in ("records", "motor_records"):
            for i, name in enumerate(getattr(campaign.blank, key)):
                yield f"blank.{key}.{i}", name


def check_files(campaign: Campaign, folder: Path) -> None:
    """Check every name of a campaign with files in or below `folder`, without reading a record.

    Raises Refusal for a spec that is no template, a file that is not there or has no reader, a record given twice in
    one unit by its path or its bytes, a [[recording.override]] of no record.
    """
    names = []
    for field, name in blank_files(campaign):
        expect_ending(file_of(folder, name, field), field)
        names.append(name)
    records = []
    for i, unit in enumerate(campaign.unit):
        places = {"reference": unit.reference, "edge": unit.edge}
        places |= {f"point.{k}.records": point.records for k, point in enumerate(unit.point)}
        records.append(
            [(f"unit.{i}.{at}.{k}", name) for at, several in places.items() for k, name in enumerate(several)]
        )
    _check_own(campaign.recording, list(dict.fromkeys([*names, *(name for unit in records for _, name in unit)])))
    for i, (unit, several) in enumerate(zip(campaign.unit, records, strict=True)):
        source_file(unit, folder, f"unit.{i}")
        paths = [file_of(folder, name, field) for field, name in several]
        for (field, _), path in zip(several, paths, strict=True):
            expect_ending(path, field)
        sizes = [path.stat().st_size for path in paths]
        seen: dict[str, str] = {}
        for (field, name), path, size in zip(several, paths, sizes, strict=True):
            for key in (str(path.resolve()), *([sha256(path)] if sizes.count(size) > 1 else [])):
                if seen.setdefault(key, field) != field:
                    limit = f"is the record of {seen[key]} again; a repeat is a recording of its own"
                    raise Refusal(field, name, limit)


_TIME_KEYS = ("rate_hz", "time_column", "time_unit")
"""Keys that say the same of a record: one of them in `[[recording.override]]` sets aside those of `[recording]`."""


def recording_of(table: RecordingTable, name: str) -> RecordingTable:
    """Return the settings of a record: `table` with the values of the [[recording.override]] that names it."""
    given = next((_given(one) for one in table.override if _matching(one, [name])), {})
    if "rate_hz" in given or "time_column" in given:
        given = dict.fromkeys(_TIME_KEYS) | given
    return msgspec.structs.replace(table, override=(), **given) if given else table


@contextmanager
def own_keys(table: RecordingTable, name: str) -> Iterator[None]:
    """Let a refusal of a key of `[recording]` name the [[recording.override]] of the record, or the one to add."""
    try:
        yield
    except Refusal as refusal:
        key = refusal.field.removeprefix("recording.")
        if refusal.field == key:
            raise
        field, limit = refusal.field, f"{refusal.limit}; [[recording.override]] sets it for some records only"
        for i, own in enumerate(table.override):
            if _matching(own, [name]) and key in _given(own):
                field, limit = f"recording.override.{i}.{key}", refusal.limit
        raise type(refusal)(field, refusal.value, limit, refusal.nearest) from None


def _check_own(table: RecordingTable, names: list[str]) -> None:
    """Refuse a [[recording.override]] that sets nothing, that names no record of the campaign, or one of another's."""
    taken: dict[str, int] = {}
    for i, own in enumerate(table.override):
        field = f"recording.override.{i}"
        if not own.records:
            raise Refusal(f"{field}.records", [], "names no record")
        given = _given(own)
        if not given:
            keys = ", ".join(key for key in msgspec.structs.asdict(own) if key != "records")
            raise Refusal(field, None, f"sets nothing for its records: {keys}")
        if "motor_channel" in given and table.motor_channel is None:
            raise Refusal(f"{field}.motor_channel", given["motor_channel"], "needs recording.motor_channel")
        for k, pattern in enumerate(own.records):
            found = _matching(own, names, pattern)
            if not found:
                close = difflib.get_close_matches(pattern, names, n=1)
                limit = "names no record of the campaign"
                raise Refusal(f"{field}.records.{k}", pattern, limit, close[0] if close else None)
            for name in found:
                if taken.setdefault(name, i) != i:
                    limit = f"names {name}, which recording.override.{taken[name]} does too"
                    raise Refusal(f"{field}.records.{k}", pattern, limit)


def _given(own: RecordingOverride) -> dict[str, Any]:
    """Return the keys that a table sets, without the records."""
    return {key: value for key, value in msgspec.structs.asdict(own).items() if key != "records" and value is not None}


def _matching(own: RecordingOverride, names: list[str], *patterns: str) -> list[str]:
    """Return the names that a table's records name, or some of its patterns do."""
    patterns = patterns or own.records
    return [name for name in names if any(one == name or fnmatchcase(name, one) for one in patterns)]

"""A campaign: its file, and the settings of [recording] for each record."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta

from unitcad.catalogue.entries import between
from unitcad.errors import Refusal
from unitcad.files import path_seen_from, sha256
from unitcad.lab.readers import expect_ending
from unitcad.lab.units import Quantity, to_si
from unitcad.spec.convert import convert
from unitcad.spec.raw import Table
from unitcad.validation.load import load_file

Name = Annotated[str, Meta(min_length=1, max_length=100)]
File = Annotated[str, Meta(min_length=1, max_length=1000)]
Records = Annotated[tuple[File, ...], Meta(max_length=1000)]
Positive = Annotated[float, between(1e-12, 1e12)]
Column = Annotated[int, between(1, 4096)] | Name
Rate = Annotated[float, between(1, 1e10)]
Hertz = Annotated[float, between(1, 500)]
TimeUnit = Literal["s", "ms", "us", "ns"]
Delimiter = Literal[",", ";", "\t", " "]
DecimalSign = Literal[".", ","]
SkippedLines = Annotated[int, between(0, 100000)]


class SensorTable(Table, frozen=True, kw_only=True):
    """The sensor, and how its samples become the quantity."""

    removed: ClassVar = {"full_scale": "unitcad finds clipping in the samples; leave it out"}
    quantity: Annotated[Quantity, Meta(description="quantity that the sensor measures")]
    unit: Annotated[Name, Meta(description="unit of the samples after scale, such as mm/s")]
    scale: Annotated[Positive, Meta(description="unit per volt, or per the unit in per")] = 1.0
    per: Annotated[Name | None, Meta(description="unit of the numbers in the files; default: V, or no unit")] = None


class RecordingTable(Table, frozen=True, kw_only=True):
    """Settings of all records, for what their files do not state."""

    removed: ClassVar = dict.fromkeys(
        ("own", "override"), "all records share [recording]; put others into a campaign of their own"
    )
    rate_hz: Annotated[Rate | None, Meta(description="samples per second, if the files do not state it")] = None
    channel: Annotated[Column | None, Meta(description="the unit's channel: a name, or a number from 1")] = None
    motor_channel: Annotated[Column | None, Meta(description="the motor's channel, recorded at the same time")] = None
    time_column: Annotated[Column | None, Meta(description="column of the time")] = None
    time_unit: Annotated[TimeUnit | None, Meta(description="unit of the time column")] = None
    delimiter: Annotated[Delimiter | None, Meta(description="sign between two columns; default: found in the file")] = (
        None
    )
    decimal: Annotated[DecimalSign | None, Meta(description="decimal sign; default: found in the file")] = None
    skip_lines: Annotated[SkippedLines | None, Meta(description="lines to skip at the beginning of a file")] = None


class ChainTable(Table, frozen=True, kw_only=True):
    """The signal chains, the mains, and the band of the motor."""

    removed: ClassVar = dict.fromkeys(
        ("measure", "order", "q", "trim_s", "zero_phase"),
        "the chain bandpass has constants, which the results name; leave it out",
    )
    use: Annotated[
        tuple[Literal["line", "bandpass"], ...],
        Meta(min_length=1, description="signal chains; the first one's levels are the result"),
    ] = ("line",)
    mains_hz: Annotated[float, between(40, 400, "frequency of the mains")] = 50.0
    band_hz: Annotated[tuple[Hertz, Hertz], Meta(description="band in which the motor's line is searched")] = (
        60.0,
        250.0,
    )


class PointTable(Table, frozen=True, kw_only=True):
    """Records at a distance from the unit's edge along the skin."""

    distance_mm: Annotated[float, between(0.01, 1000, "distance from the unit's edge along the skin")]
    records: Annotated[Records, Meta(description="records at this point")]


class UnitTable(Table, frozen=True, kw_only=True):
    """One unit: its name and its records."""

    removed: ClassVar = {
        **dict.fromkeys(("spec", "cast", "cavity"), "it belongs into [[unit]] of the file of unitcad fit"),
        "lines": "unitcad finds a second line by itself; run one motor at a time and leave it out",
    }
    name: Annotated[Name, Meta(description="a name of the unit; a fit's file has the same")]
    reference: Annotated[Records, Meta(description="records of the motor alone, without motor_channel")] = ()
    edge: Annotated[Records, Meta(description="records at the unit's edge")] = ()
    point: tuple[PointTable, ...] = ()


class Campaign(Table, frozen=True, kw_only=True):
    """A campaign: one sensor, units with their records."""

    removed: ClassVar = {"blank": "unitcad names a line next to the mains by itself; leave it out"}
    name: Annotated[Name, Meta(description="a name of the campaign")]
    note: Annotated[str, Meta(max_length=1000, description="a remark for the results")] = ""
    sensor: SensorTable
    recording: RecordingTable = RecordingTable()
    motor_sensor: SensorTable | None = None
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
    if len(set(use := campaign.chain.use)) < len(use):
        raise Refusal("chain.use", list(use), "has a chain twice", list(dict.fromkeys(use)))
    for key, sensor in (("sensor", campaign.sensor), ("motor_sensor", campaign.motor_sensor)):
        if sensor is not None:
            to_si(sensor.unit, sensor.quantity, f"{key}.unit")
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
        if bool(unit.reference) == (motor_channel is not None):
            both = "is not allowed together with recording.motor_channel"
            limit = both if unit.reference else "is required, or recording.motor_channel"
            raise Refusal(f"{field}.reference", list(unit.reference) or None, limit)
    return campaign


def file_of(folder: Path, name: str, field: str) -> Path:
    """Return the path of a file that a lab's file in `folder` names. Raises Refusal if there is none."""
    path = folder / name
    if not path.is_file():
        raise Refusal(field, name, f"no such file in {path_seen_from(folder)}")
    return path


def check_files(campaign: Campaign, folder: Path) -> None:
    """Check every name of a campaign with files in or below `folder`, without reading a record.

    Raises Refusal for a file that is not there or has no reader, a record given twice in
    one unit by its path or its bytes.
    """
    by_unit = []
    for i, unit in enumerate(campaign.unit):
        places = {"reference": unit.reference, "edge": unit.edge}
        places |= {f"point.{k}.records": point.records for k, point in enumerate(unit.point)}
        by_unit.append([(f"unit.{i}.{at}.{k}", name) for at, names in places.items() for k, name in enumerate(names)])
    for field, name in chain.from_iterable(by_unit):
        expect_ending(file_of(folder, name, field), field)
    for records in by_unit:
        seen: dict[str, str] = {}
        for field, name in records:
            if (before := seen.setdefault(sha256(folder / name), field)) != field:
                raise Refusal(field, name, f"is the record of {before} again; a repeat is a recording of its own")

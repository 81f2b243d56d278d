"""The cast record: weights, times and measures of a casting, as the bench page saves it.

A JSON file, its keys ending in their units. A list may be empty and a number null if nobody looked.

    {"format": "unitcad cast record", "version": 1, "spec_name": "demo", "spec_hash": "0f3a91c27b5e",
     "cast_on": "2026-03-14",
     "pours": [{"index": 1, "material": "ecoflex-00-10", "part_a_g": 10.0, "part_b_g": 10.1, "cure_h": 4.5}],
     "units": [{"cavity": 1, "height_mm": 3.95, "mass_g": 0.61, "walls": [{"layer": 1, "places_mm": [1.2, 1.3]}]}]}
"""

from __future__ import annotations

import datetime
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta

from unitcad.catalogue.entries import between
from unitcad.documents import read_json
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec import convert
from unitcad.spec.raw import Table

FORMAT = "unitcad cast record"
ENDING = ".cast.json"
"""How the bench page names the file: <spec name>-<date> and this."""
LARGEST = 1_000_000
"""Bytes that a record may have."""
HASH_DIGITS = 12

Text = Annotated[str, Meta(max_length=200)]
Line = Annotated[str, Meta(max_length=1000)]
Grams = Annotated[float, between(1e-4, 1e5)]
Millimetres = Annotated[float, between(0.01, 1000)]
Resolution = Annotated[float, between(1e-4, 10)]
Index = Annotated[int, between(1, 99)]
Cavity = Annotated[int, between(1, 999)]


class CastPour(Table, frozen=True, kw_only=True):
    """One pour: weights and times."""

    index: Annotated[Index, Meta(description="number of the pour; 1 casts layer 1")]
    material: Annotated[Text | None, Meta(description="silicone")] = None
    lot: Annotated[Text | None, Meta(description="lot on the bottles")] = None
    part_a_g: Annotated[Grams | None, Meta(description="weight of part A")] = None
    part_b_g: Annotated[Grams | None, Meta(description="weight of part B")] = None
    mixed_at: Annotated[
        Text | None, Meta(description="time of mixing, ISO 8601 with the zone: 2026-03-14T09:30:00+01:00")
    ] = None
    pot_life_min: Annotated[
        Annotated[float, between(0.1, 10000)] | None, Meta(description="time from the first stir to the last strike")
    ] = None
    cure_h: Annotated[
        Annotated[float, between(0.01, 1000)] | None,
        Meta(description="time from that strike to the removal of the cup"),
    ] = None
    notes: Annotated[tuple[Line, ...], Meta(max_length=200, description="remarks")] = ()


class WallPlaces(Table, frozen=True, kw_only=True):
    """One layer's wall, measured at the skin."""

    layer: Annotated[Index, Meta(description="number of the layer; 1 is the innermost")]
    places_mm: Annotated[
        tuple[Millimetres, ...],
        Meta(min_length=1, max_length=100, description="the wall at several places around the unit"),
    ]


class CastUnit(Table, frozen=True, kw_only=True):
    """One unit out of the mould."""

    cavity: Annotated[Cavity, Meta(description="number of the cavity from 1, engraved next to it in hexadecimal")] = 1
    usable: Annotated[bool, Meta(description="false: the unit counts for nothing")] = True
    height_mm: Annotated[Millimetres | None, Meta(description="height over all")] = None
    diameters_mm: Annotated[
        tuple[Millimetres, ...], Meta(max_length=100, description="diameter at the skin, in several directions")
    ] = ()
    mass_g: Annotated[
        Grams | None, Meta(description="mass of the trimmed silicone, without motor, circuit and wires")
    ] = None
    walls: Annotated[tuple[WallPlaces, ...], Meta(max_length=99)] = ()
    notes: Annotated[tuple[Line, ...], Meta(max_length=200, description="remarks")] = ()

    def wall_mm(self, layer: int) -> tuple[float, ...]:
        """Return the measured thicknesses of a layer's wall (from 1), mm; () for none."""
        return next((wall.places_mm for wall in self.walls if wall.layer == layer), ())


class CastRecord(Table, frozen=True, kw_only=True):
    """One casting of one mould set. bench.html writes this file."""

    format: Annotated[Literal["unitcad cast record"], Meta(description="kind of file")]
    version: Annotated[int, between(1, 1, "version of the format")]
    spec_name: Annotated[Text, Meta(description="name of the spec")]
    spec_hash: Annotated[Text, Meta(description="twelve digits at the end of the result's folder")]
    cast_on: Annotated[Text, Meta(description="day of the first pour: 2026-03-14")]
    label: Annotated[Text | None, Meta(description="four characters, as engraved on the moulds")] = None
    spec: Annotated[dict[str, Any] | None, Meta(description="the whole spec with its defaults")] = None
    room_c: Annotated[Annotated[float, between(-20, 80)] | None, Meta(description="temperature of the room")] = None
    scale_resolution_g: Annotated[Resolution | None, Meta(description="smallest step of the scale")] = None
    caliper_resolution_mm: Annotated[Resolution | None, Meta(description="smallest step of the caliper")] = None
    pours: Annotated[tuple[CastPour, ...], Meta(max_length=99)] = ()
    units: Annotated[tuple[CastUnit, ...], Meta(max_length=999)] = ()
    notes: Annotated[tuple[Line, ...], Meta(max_length=200, description="remarks")] = ()

    def unit(self, cavity: int) -> CastUnit | None:
        """Return the unit of a cavity; None if the record has none."""
        return next((unit for unit in self.units if unit.cavity == cavity), None)


def read_cast_record(path: Path, *, links: bool = True) -> CastRecord:
    """Return the record in a JSON file; without `links` a symbolic link is refused.

    Raises UnitcadError if the file can't be read, Refusal for the first value that is not valid.
    """
    data = read_json(path, largest=LARGEST, links=links)
    if not isinstance(data, dict):
        raise UnitcadError(f"{path}: is not a cast record: it has no table")
    if data.get("format") != FORMAT:
        raise UnitcadError(f"{path}: is not a cast record: its key format is not {FORMAT!r}")
    return cast_record(data)


def cast_record(data: dict[str, Any]) -> CastRecord:
    """Return the record of plain data. Raises Refusal for the first value that is not valid."""
    record = convert(data, CastRecord)
    if not re.fullmatch(f"[0-9a-f]{{{HASH_DIGITS}}}", record.spec_hash):
        raise Refusal("spec_hash", record.spec_hash, f"must be {HASH_DIGITS} digits of 0-9 and a-f")
    _expect_day(record.cast_on)
    for i, pour in enumerate(record.pours):
        if pour.mixed_at is not None:
            _expect_time(pour.mixed_at, f"pours.{i}.mixed_at")
    _expect_once([pour.index for pour in record.pours], "pours.{}.index", "pour")
    _expect_once([unit.cavity for unit in record.units], "units.{}.cavity", "cavity")
    for i, unit in enumerate(record.units):
        _expect_once([wall.layer for wall in unit.walls], f"units.{i}.walls.{{}}.layer", "layer")
    return record


def _expect_day(text: str) -> None:
    try:
        day = datetime.date.fromisoformat(text).isoformat()
    except ValueError:
        day = None
    if day != text:
        raise Refusal("cast_on", text, "must be a day such as 2026-03-14", day)


def _expect_time(text: str, field: str) -> None:
    limit = "must be a time with its zone, such as 2026-03-14T09:30:00+01:00"
    try:
        time = datetime.datetime.fromisoformat(text)
    except ValueError:
        raise Refusal(field, text, limit) from None
    if time.tzinfo is None:
        raise Refusal(field, text, limit, time.replace(tzinfo=datetime.UTC).isoformat())


def _expect_once(numbers: list[int], field: str, thing: str) -> None:
    for i, number in enumerate(numbers):
        if number in numbers[:i]:
            raise Refusal(field.format(i), number, f"is a {thing} that the record has already")

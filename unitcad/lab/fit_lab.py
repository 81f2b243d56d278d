"""The file of `unitcad fit`: which units a lab measured, at what level, by which moduli.

name = "bench-2"
moduli = "dynamic"                       # or "quasi-static": as [estimate] of a spec has it
[[unit]]
name = "stiff-inside"
spec = "unit.toml"                       # a template or a spec file beside this one
set = { "layers.0.material" = "dragon-skin-10-medium" }
frequency_hz = 130
level = { value = 0.41, low = 0.36, high = 0.47 }   # edge over motor, 95 %
[[unit]]
name = "u07"
cast = "u07.cast.json"                   # in place of spec: the record of its casting, with the walls as measured
cavity = 2                               # which unit of it, where it has several
measured = "campaign/measured.toml"      # what `unitcad measure` wrote: level and frequency of the unit u07
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from unitcad import files
from unitcad.attenuation.edge.lab_fit import InputFile, OwnLevel
from unitcad.attenuation.edge.shrunk_fit import BETWEEN_LABS
from unitcad.catalogue.entries import Frequency, MaterialEntry
from unitcad.errors import Refusal, unknown_name
from unitcad.lab.unit_files import Cavity, file_of, measured_walls, source_file, specs_of
from unitcad.spec import Spec, convert, read_toml
from unitcad.spec.asked import Table
from unitcad.validation.shipped_files import named_file, shipped_files

Name = Annotated[str, Meta(min_length=1, max_length=100)]
LevelValue = Annotated[float, Meta(ge=1e-6, le=1e3, description="amplitude at the edge over the motor's")]
_TWO_SIDED = 1.96
"""Half-width of a 95 % interval in standard errors."""


class LevelTable(Table, frozen=True, kw_only=True):
    """A level and its 95 % interval."""

    value: LevelValue
    low: LevelValue | None = None
    high: LevelValue | None = None


class FitUnitTable(Table, frozen=True, kw_only=True):
    """A measured unit: its spec with changes, or the record of its casting; its level, or the file that has it."""

    name: Name
    spec: str | None = None
    cast: str | None = None
    cavity: Cavity | None = None
    set: dict[str, Any] = field(default_factory=dict)
    frequency_hz: Frequency | None = None
    level: LevelTable | None = None
    measured: str | None = None


class FitLabFile(Table, frozen=True, kw_only=True):
    """A lab's measured units as typed."""

    name: Name
    note: Annotated[str, Meta(max_length=1000)] = ""
    moduli: Literal["dynamic", "quasi-static"] = "dynamic"
    with_paper: Annotated[bool, Meta(description="the paper's nine units beside the lab's own")] = True
    between_labs: Annotated[
        float, Meta(ge=0, le=100, description="scatter of a constant between labs over that between units")
    ] = BETWEEN_LABS
    materials: dict[str, MaterialEntry] = field(default_factory=dict)
    unit: Annotated[tuple[FitUnitTable, ...], Meta(min_length=1, max_length=1000)]


@dataclass(frozen=True)
class OwnUnit:
    """A measured unit of the lab: its spec as asked and as built, frequency (Hz, None: the spec's), and level."""

    name: str
    spec: Spec
    built: Spec
    frequency_hz: float | None
    level: LevelTable
    source: str

    @property
    def error(self) -> float:
        """The standard error of ln level; 0 where no interval is given: it is then part of the discrepancy."""
        if self.level.low is None or self.level.high is None:
            return 0.0
        return float(np.log(self.level.high / self.level.low)) / (2 * _TWO_SIDED)

    def stored(self, key: str, frequency_hz: float) -> OwnLevel:
        """Return the level as a fit keeps it."""
        level = self.level
        return OwnLevel(
            unit=self.name,
            key=key,
            value=level.value,
            low=level.low,
            high=level.high,
            frequency_hz=frequency_hz,
            source=self.source,
        )


@dataclass(frozen=True)
class FitLab:
    """A validated lab: settings, units, and the files that were read."""

    settings: FitLabFile
    units: tuple[OwnUnit, ...]
    inputs: tuple[InputFile, ...]


def shipped_fits() -> dict[str, Path]:
    """Return the shipped labs by name."""
    return shipped_files("fits")


def load_fit_lab(source: str) -> FitLab:
    """Return the lab of a file (a path separator or .toml in `source`) or a shipped one (a bare name).

    Raises Refusal or UnitcadError for the first value that is not valid.
    """
    path = named_file(source, shipped_fits(), "LAB")
    data = read_toml(path)
    settings = convert(data, FitLabFile)
    names = [unit.name for unit in settings.unit]
    inputs = {path.name: files.sha256(path)}
    entries = {f"materials.{name}": entry for name, entry in data.get("materials", {}).items()}
    units = []
    for i, table in enumerate(settings.unit):
        if table.name in names[:i]:
            raise Refusal(f"unit.{i}.name", table.name, "is the name of two units")
        units.append(_unit(f"unit.{i}", table, path.parent, entries, inputs))
    return FitLab(settings, tuple(units), tuple(InputFile(file=f, sha256=h) for f, h in sorted(inputs.items())))


def _unit(where: str, table: FitUnitTable, folder: Path, entries: Mapping[str, Any], inputs: dict[str, str]) -> OwnUnit:
    if (table.level is None) == (table.measured is None):
        raise Refusal(f"{where}.level", None, "is required, or measured; not both")
    if table.spec is None and table.cast is None:
        raise Refusal(f"{where}.spec", None, "is required, or cast")
    source = source_file(table, folder, where)
    asked, built = specs_of(table, folder, where, table.set, entries)
    if source:
        inputs[source] = files.sha256(folder / source)
    walls = measured_walls(asked, built)
    if table.level is not None:
        _check(f"{where}.level", table.level)
        said = ", ".join(filter(None, ("as typed", walls)))
        return OwnUnit(table.name, asked, built, table.frequency_hz, table.level, said)
    assert table.measured is not None
    path = file_of(folder, table.measured, f"{where}.measured")
    level, hertz, chain = _measured(f"{where}.measured", table, path, inputs.get(source or ""))
    inputs[table.measured] = files.sha256(path)
    said = ", ".join(filter(None, (f"{table.measured}, chain {chain}", walls)))
    return OwnUnit(table.name, asked, built, table.frequency_hz or hertz, level, said)


def _measured(where: str, table: FitUnitTable, path: Path, source_sha256: str | None) -> tuple[LevelTable, float, str]:
    """Return level, frequency and chain of a unit's edge in a file of `unitcad measure`, by the file's first chain."""
    named = str(table.measured)
    data = read_toml(path)
    chain, rows = data.get("chain"), data.get("level")
    if data.get("status") != "measured" or not isinstance(rows, list):
        raise Refusal(where, named, "is no file of unitcad measure")
    edges = [row for row in rows if isinstance(row, dict) and row.get("distance_mm") == 0 and row.get("chain") == chain]
    here = [row for row in edges if row.get("unit") == table.name]
    if not here:
        raise unknown_name(f"{where} (unit)", table.name, [str(row.get("unit")) for row in edges])
    row = here[0]
    level = convert({key: row[key] for key in ("value", "low", "high") if key in row}, LevelTable)
    _check(where, level)
    hertz = row.get("frequency_hz")
    if not isinstance(hertz, int | float):
        raise Refusal(f"{where}.frequency_hz", hertz, "must be a number")
    _expect_same_unit(where, table, row, data, source_sha256)
    return level, float(hertz), str(chain)


def _expect_same_unit(
    where: str, table: FitUnitTable, row: Mapping[str, Any], data: Mapping[str, Any], source_sha256: str | None
) -> None:
    """Refuse a level that was measured of another template, spec file, cast record or cavity.

    A campaign may name a spec where the fit names the record of its casting; then nothing is compared.
    """
    key = "cast" if table.cast is not None else "spec"
    there, here = row.get(key), getattr(table, key)
    if there is None:
        return
    hashes = {str(one.get("file")): one.get("sha256") for one in data.get("source", ())}
    if there in hashes and source_sha256 is not None and hashes[there] != source_sha256:
        raise Refusal(where, table.measured, f"was measured with another {here}: its SHA-256 differs")
    if there not in hashes and source_sha256 is None and there != here:
        raise Refusal(where, table.measured, f"was measured of the template {there}, not {here}")
    if row.get("cavity", table.cavity) != table.cavity:
        raise Refusal(where, table.measured, f"was measured of cavity {row['cavity']}, not {table.cavity}")


def _check(where: str, level: LevelTable) -> None:
    if (level.low is None) != (level.high is None):
        raise Refusal(f"{where}.{'low' if level.low is None else 'high'}", None, "is required beside the other end")
    if level.low is not None and level.high is not None and not level.low <= level.value <= level.high:
        raise Refusal(f"{where}.value", level.value, f"must lie from low {level.low:g} to high {level.high:g}")

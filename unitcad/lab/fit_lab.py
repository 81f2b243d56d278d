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
spec = "u07.toml"
measured = "campaign/measured.toml"      # what `unitcad measure` wrote: level and frequency of the unit u07
"""

from __future__ import annotations

import hashlib
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
from unitcad.experiments.lab_file import spec_with
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
    """A measured unit: its spec, changes in it, and its level or the file that has it."""

    name: Name
    spec: str
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
    """A measured unit of the lab: its spec, frequency (Hz, None: the spec's), level and standard error of its ln."""

    name: str
    spec: Spec
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
    inputs = {path.name: _sha256(path)}
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
    spec = spec_with(where, table.spec, table.set, folder, entries, "spec")
    if table.spec.endswith(".toml"):
        inputs[table.spec] = _sha256(folder / table.spec)
    if table.level is not None:
        _check(f"{where}.level", table.level)
        return OwnUnit(table.name, spec, table.frequency_hz, table.level, "as typed")
    assert table.measured is not None
    level, hertz, chain = _measured(f"{where}.measured", table, folder)
    inputs[table.measured] = _sha256(folder / table.measured)
    return OwnUnit(table.name, spec, table.frequency_hz or hertz, level, f"{table.measured}, chain {chain}")


def _measured(where: str, table: FitUnitTable, folder: Path) -> tuple[LevelTable, float, str]:
    """Return level, frequency and chain of a unit's edge in a file of `unitcad measure`, by the file's first chain."""
    named = str(table.measured)
    if not (folder / named).is_file():
        raise Refusal(where, named, f"no such file in {files.seen_from(folder)}")
    data = read_toml(folder / named)
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
    for source in data.get("source", ()):
        if source.get("file") == table.spec and source.get("sha256") != _sha256(folder / table.spec):
            raise Refusal(where, named, f"was measured with another {table.spec}: its SHA-256 differs")
    return level, float(hertz), str(chain)


def _check(where: str, level: LevelTable) -> None:
    if (level.low is None) != (level.high is None):
        raise Refusal(f"{where}.{'low' if level.low is None else 'high'}", None, "is required beside the other end")
    if level.low is not None and level.high is not None and not level.low <= level.value <= level.high:
        raise Refusal(f"{where}.value", level.value, f"must lie from low {level.low:g} to high {level.high:g}")


def _sha256(path: Path) -> str:
    return hashlib.sha256(files.read(path)).hexdigest()

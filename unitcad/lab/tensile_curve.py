"""A tensile curve from a file: engineering strain and stress of one specimen, with what its header says of the test."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.errors import Refusal, UnitcadError
from unitcad.lab.declared_columns import Declared, column_of, columns, columns_of
from unitcad.lab.readers.formats import open_recording
from unitcad.lab.readers.recording_layout import Layout

LEAST_POINTS = 5
_HEADER_LINES = 200
_FORCES = {"N": 1.0, "kN": 1e3, "mN": 1e-3}


@dataclass(frozen=True)
class Specimen:
    """A specimen and its machine: lengths mm, the cell's full scale N, the speed mm/min; None where not known.

    `crosshead`: the strain is the crosshead's travel over the gauge length, not the specimen's own.
    """

    width_mm: float | None = None
    thickness_mm: float | None = None
    gauge_mm: float | None = None
    area_mm2: float | None = None
    cell_n: float | None = None
    speed_mm_min: float | None = None
    crosshead: bool | None = None

    def over(self, other: Specimen) -> Specimen:
        """Return this specimen with the values that it lacks from another one."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        return replace(other, **given)

    @property
    def area(self) -> float | None:
        """Cross-section, m2."""
        if self.width_mm is not None and self.thickness_mm is not None:
            return self.width_mm * self.thickness_mm * 1e-6
        return None if self.area_mm2 is None else self.area_mm2 * 1e-6


@dataclass(frozen=True)
class TensileCurve:
    """One specimen's curve up to its largest stress: engineering strain rises, engineering stress in Pa; both (n,).

    `rate`: strain per second at the start, None without a time. `skipped`: points left out since the strain had been
    passed before; `lost`: rows left out since a number was missing. `sha256`: of the file; `path`: where it was read.
    """

    name: str
    strain: np.ndarray = field(repr=False)
    stress: np.ndarray = field(repr=False)
    specimen: Specimen
    sha256: str
    rate: float | None = None
    skipped: int = 0
    lost: int = 0
    path: Path | None = field(default=None, repr=False)


def read_curve(
    path: Path, given: Mapping[str, Declared], specimen: Specimen, layout: Layout | None = None
) -> TensileCurve:
    """Return a file's curve. What `specimen` gives goes before the file's header.

    Raises Refusal where a column or a unit is missing or ambiguous, or where the points are no pull; UnitcadError for
    a file that can't be read.
    """
    recording = open_recording(path, layout)
    specimen = specimen.over(header_of(path))
    wanted = {
        q: found for q in ("time", "strain", "stress", "force", "travel") if (found := column_of(recording, q, given))
    }
    if "strain" not in wanted and "travel" not in wanted and (found := column_of(recording, "true_strain", given)):
        wanted["true_strain"] = found
    if "stress" not in wanted and "force" not in wanted and (found := column_of(recording, "true_stress", given)):
        wanted["true_stress"] = found
    for pair in (("strain", "travel", "true_strain"), ("stress", "force", "true_stress")):
        if not any(q in wanted for q in pair):
            limit = f"{path.name} has no column of {pair[0]} or {pair[1]} that is known by name"
            raise Refusal("--column", None, f"{limit}; declare {pair[0]}=COLUMN:UNIT; {columns_of(recording)}")
    data, lost = columns(recording, wanted)
    strain, specimen = _strain(data, specimen, path)
    stress = _stress(data, strain, specimen, path)
    return replace(_trimmed(path, strain, stress, data.get("time"), specimen), lost=lost, path=path)


def header_of(path: Path) -> Specimen:
    """Return what the lines "name;value" before the numbers say of specimen and machine."""
    found: dict[str, float | bool] = {}
    for name, value in _pairs(path):
        number = _NUMBER.match(value)
        for pattern, key in _HEADER:
            if not number or not (match := re.search(pattern, name, re.IGNORECASE)):
                continue
            unit = match[1].lower() if match.groups() else ""
            factor = {"cm": 10.0, "in": 25.4, "cm^2": 100.0, "cm2": 100.0}.get(unit, 1.0)
            if key == "cell_n":
                factor = _FORCES.get(number[2], 0.0)
            amount = float(number[1].replace(",", "."))
            if factor and amount > 0 and not _MAYBE_THOUSANDS.fullmatch(number[1]):
                found.setdefault(key, amount * factor)
        if re.search("strain|elongation", name, re.IGNORECASE):
            if re.search("crosshead|cross-head|grip|traverse", value, re.IGNORECASE):
                found["crosshead"] = True
            elif re.search("extensometer|video|dic", value, re.IGNORECASE):
                found["crosshead"] = False
    if length := found.pop("length_mm", None):  # a bare "Length" is the gauge length where no other line gives one
        found.setdefault("gauge_mm", length)
    return Specimen(**found)  # type: ignore[arg-type]


_HEADER = (
    (r"thickness\s*[\[(](mm|cm|in)[\])]", "thickness_mm"),
    (r"width\s*[\[(](mm|cm|in)[\])]", "width_mm"),
    (r"(?:specimen|gauge|initial) length\s*[\[(](mm|cm|in)[\])]", "gauge_mm"),
    (r"^\s*length\s*[\[(](mm|cm|in)[\])]", "length_mm"),
    (r"(?:cross-?section|area)\s*[\[(](mm2|mm\^2|cm2|cm\^2)[\])]", "area_mm2"),
    (r"(?:speed|rate)\s*[\[(](mm/min)[\])]", "speed_mm_min"),
    (r"load cell", "cell_n"),
)


_NUMBER = re.compile(r"\s*(\d+(?:[.,]\d*)?(?:e-?\d+)?)\s*([a-zA-Z]*)")
_MAYBE_THOUSANDS = re.compile(r"[1-9]\d{0,2},\d{3}")
_UNIT = re.compile(r"\s*[\[(]?(mm|cm|in|mm2|mm\^2|cm2|cm\^2|mm/min)[\])]?\s*")


def _pairs(path: Path) -> Iterator[tuple[str, str]]:
    """Yield name and value of the header's lines; a third cell with a unit counts to the name."""
    with open(path, "rb", opener=files.regular()) as file:
        text = file.read(100_000).decode("utf-8", "replace")
    for line in text.splitlines()[:_HEADER_LINES]:
        cells = [cell.strip(" \"'") for cell in _cells(line)]
        if len(cells) > 1 and cells[0] and not re.match(r"[\d.+-]", cells[0]):
            unit = _UNIT.fullmatch(cells[2]) if len(cells) > 2 else None
            yield (f"{cells[0]} ({unit[1]})" if unit else cells[0]), cells[1]


def _cells(line: str) -> list[str]:
    """Return a header line's cells: at semicolons or tabs, else at a colon, else at commas that no quotes enclose."""
    if ";" in line or "\t" in line:
        return re.split(r"[;\t]", line)
    if '"' not in line and re.search(r":\s", line):
        return re.split(r":\s", line, maxsplit=1)
    try:
        cells = next(csv.reader([line], strict=True, skipinitialspace=True), [])
    except csv.Error:
        return []
    return [] if '"' not in line and re.fullmatch(r"\s*\d+\s*", "".join(cells[2:3])) else cells  # 6,5: one or two?


def _strain(data: Mapping[str, np.ndarray], specimen: Specimen, path: Path) -> tuple[np.ndarray, Specimen]:
    if "strain" in data:
        return data["strain"], specimen
    if "true_strain" in data:
        return np.expm1(data["true_strain"]), specimen
    if specimen.gauge_mm is None:
        raise Refusal("--gauge-mm", None, f"{path.name} gives the travel alone: the gauge length is required")
    travel = (data["travel"] - data["travel"][0]) * 1e3
    return travel / specimen.gauge_mm, replace(specimen, crosshead=specimen.crosshead is not False)


def _stress(data: Mapping[str, np.ndarray], strain: np.ndarray, specimen: Specimen, path: Path) -> np.ndarray:
    if "stress" in data:
        return data["stress"]
    if "true_stress" in data:
        return data["true_stress"] / (1.0 + strain)
    if specimen.area is None:
        raise Refusal("--width-mm", None, f"{path.name} gives the force alone: width and thickness are required")
    return data["force"] / specimen.area


def _trimmed(
    path: Path, strain: np.ndarray, stress: np.ndarray, time: np.ndarray | None, specimen: Specimen
) -> TensileCurve:
    """Return the curve up to its largest stress, without points whose strain had been passed before."""
    if len(stress) == 0:
        raise UnitcadError(f"{path}: no row has a number in each of the columns that are read")
    if np.max(stress) <= 0:
        raise UnitcadError(f"{path}: the stress is nowhere above zero: no pull, or the sign of the force is reversed")
    end = int(np.argmax(stress)) + 1
    strain, stress = strain[:end], stress[:end]
    fresh = np.concatenate([[True], strain[1:] > np.maximum.accumulate(strain)[:-1]])
    rate = None
    if time is not None and fresh.sum() > 1:
        steps, clock = np.diff(strain[fresh][:21]), np.diff(time[:end][fresh][:21])
        rate = float(np.median(steps[clock > 0] / clock[clock > 0])) if (clock > 0).any() else None
    skipped = int((~fresh).sum())
    strain, stress = strain[fresh], stress[fresh]
    if len(strain) < LEAST_POINTS:
        raise UnitcadError(f"{path}: {len(strain)} points before the largest stress; a curve needs {LEAST_POINTS}")
    if strain[0] <= -1.0:
        raise UnitcadError(f"{path}: the strain begins at {strain[0]:.3g}: no body is shorter than nothing")
    return TensileCurve(path.name, strain, stress, specimen, files.sha256(path), rate, skipped)

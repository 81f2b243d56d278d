"""A silicone's modulus from tensile curves, and from storage and loss over frequency. SI inside."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t

from unitcad import files
from unitcad.catalogue import Material
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.lab.readers import AS_FOUND, Layout, Recording, open_recording
from unitcad.lab.toe import Toe, fit_toe
from unitcad.lab.units import COLUMN_UNITS, plain
from unitcad.text import some

_COLUMN_NAMES = {
    "time": r"(?:test )?time|(?:prüf)?zeit|时间",
    "strain": r"(?:(?:engineering|eng\.?|nominal|tensile) )?strain|dehnung|应变",
    "stress": r"(?:(?:engineering|eng\.?|nominal|tensile) )?stress|spannung|应力",
    "force": r"force|load|standard force|(?:standard)?kraft|力|载荷",
    "travel": r"(?:crosshead )?(?:travel|displacement)|crosshead|extension|stroke|position|(?:standard)?weg|位移",
    "frequency": r"(?:angular )?freq(?:uency|\.)?",
    "storage": r"storage(?: modulus)?|[eg](?:'|′)",
    "loss": r"loss(?: modulus)?|[eg](?:''|\"|″)",
    "tan_delta": r"tan ?\(?(?:delta|δ)\)?|loss factor",
}
"""Names of a quantity in instruments' files, without its unit."""
_BARE = ("tan_delta",)
"""Quantities that may lack a unit; a strain may not, since a percentage looks like a ratio."""


Declared = tuple[str | int, str]
"""The column of a declared quantity (a name, or a number from 1) and its unit, "" for the file's."""


def parse_column(texts: Iterable[str]) -> dict[str, Declared]:
    """Parse QUANTITY=COLUMN[:UNIT]. Raises Refusal for anything else."""
    found: dict[str, Declared] = {}
    for text in texts:
        quantity, equals, rest = (part.strip() for part in text.partition("="))
        if not equals or not rest:
            raise Refusal(
                "--column", text, "needs the form QUANTITY=COLUMN or QUANTITY=COLUMN:UNIT, such as stress=3:kPa"
            )
        if quantity not in COLUMN_UNITS:
            raise unknown_name("--column", quantity, COLUMN_UNITS)
        column, colon, unit = rest.rpartition(":") if ":" in rest else (rest, "", "")
        if colon and _unit(unit, quantity) is None:
            raise unknown_name("--column", unit, COLUMN_UNITS[quantity])
        found[quantity] = int(column) if column.isdecimal() else column, unit
    return found


def column_of(recording: Recording, quantity: str, given: Mapping[str, Declared]) -> tuple[int, float] | None:
    """Return the index of a quantity's column and the factor to SI; None if the file has none.

    Raises Refusal if several columns fit, and for a unit that is missing or of another quantity.
    """
    channels = recording.channels
    unit = ""
    if quantity in given:
        column, unit = given[quantity]
        at = recording.index(column, "--column")
    else:
        fitting = [
            i for i, c in enumerate(channels) if re.fullmatch(_COLUMN_NAMES[quantity], c.name.strip(), re.IGNORECASE)
        ]
        if not fitting:
            return None
        if len(fitting) > 1:
            names = recording.numbered(fitting)
            limit = f"{recording.path.name} has several columns for {quantity}: {names}; declare {quantity}=COLUMN:UNIT"
            raise Refusal("--column", None, limit)
        at = fitting[0]
    unit, doubt = unit or channels[at].unit, channels[at].doubt
    factor = _unit(unit, quantity) if unit else 1.0 if quantity in _BARE else None
    if factor is None:
        said = f"has the unit {unit!r}" if unit else f"has no clear unit ({doubt})" if doubt else "has no unit"
        limit = f"{recording.path.name}: column {at + 1} ({channels[at].name}) {said}; declare {quantity}={at + 1}:UNIT"
        units = ", ".join(COLUMN_UNITS[quantity])
        raise Refusal(
            "--column", None, f"{limit} with the unit that it is in, of {units}; its columns: {recording.numbered()}"
        )
    return at, factor


def read_columns(
    recording: Recording, given: Mapping[str, Declared], *choices: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], int]:
    """Return columns (n,) in SI without the rows that lack a number, and how many rows those were.

    Of each choice it is the first quantity that is declared, or else that the file has. Raises Refusal for a choice of
    which there is none, unless it is the time.
    """
    wanted = {}
    for choice in choices:
        by_preference = sorted(choice, key=lambda quantity: quantity not in given)
        found = ((quantity, column_of(recording, quantity, given)) for quantity in by_preference)
        quantity, column = next(((quantity, one) for quantity, one in found if one), ("", None))
        if column:
            wanted[quantity] = column
        elif choice != ("time",):
            limit = f"{recording.path.name} has no column of {' or '.join(choice)} that is known by name"
            limit = f"{limit}; declare {choice[0]}=COLUMN:UNIT; its columns: {recording.numbered()}"
            raise Refusal("--column", None, limit)
    rows = recording.columns([at for at, _ in wanted.values()])
    whole = np.isfinite(rows).all(axis=1)
    data = {name: rows[whole, i] * factor for i, (name, (_, factor)) in enumerate(wanted.items())}
    return data, int((~whole).sum())


def _unit(text: str, quantity: str) -> float | None:
    known = COLUMN_UNITS[quantity]
    return known.get(text.strip(), known.get(plain(text)))


LEAST_POINTS = 5
_HEADER_LINES = 200


@dataclass(frozen=True)
class Specimen:
    """A specimen: lengths in mm; None if not known.

    `crosshead`: the strain is the crosshead's travel over the gauge length, not the specimen's own.
    """

    width_mm: float | None = None
    thickness_mm: float | None = None
    gauge_mm: float | None = None
    crosshead: bool | None = None

    def over(self, other: Specimen) -> Specimen:
        """Return this specimen with the values that it lacks from another one."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        return replace(other, **given)

    @property
    def area_error(self) -> float:
        """Relative error of the cross-section."""
        if self.width_mm is None or self.thickness_mm is None:
            return AREA_ERROR
        return math.hypot(CALLIPER_MM / self.width_mm, CALLIPER_MM / self.thickness_mm)

    @property
    def area(self) -> float | None:
        """Cross-section, m2."""
        if self.width_mm is None or self.thickness_mm is None:
            return None
        return self.width_mm * self.thickness_mm * 1e-6


@dataclass(frozen=True)
class TensileCurve:
    """One specimen's curve up to its largest stress: engineering strain rises, engineering stress in Pa; both (n,).

    `rate`: strain per second at the start, None without a time. `skipped`: points whose strain had been passed before;
    `lost`: rows without a number. `cycles`: how often the strain goes back and rises again, in all of the file.
    `sha256`: of the file.
    """

    name: str
    strain: np.ndarray = field(repr=False)
    stress: np.ndarray = field(repr=False)
    specimen: Specimen
    sha256: str
    rate: float | None = None
    skipped: int = 0
    lost: int = 0
    cycles: int = 0


def read_curve(
    path: Path, given: Mapping[str, Declared], specimen: Specimen, layout: Layout = AS_FOUND
) -> TensileCurve:
    """Return a file's curve. Values of `specimen` override the file's header.

    Raises Refusal if a column or a unit is missing or ambiguous, or if the points are no pull; UnitcadError for
    a file that can't be read.
    """
    recording = open_recording(path, layout)
    specimen = specimen.over(header_of(path))
    data, lost = read_columns(recording, given, ("time",), ("strain", "travel"), ("stress", "force"))
    strain, stress = data.get("strain"), data.get("stress")
    if strain is None:
        if specimen.gauge_mm is None:
            raise Refusal("--gauge-mm", None, f"{path.name} gives only the travel: the gauge length is required")
        strain = (data["travel"] - data["travel"][0]) * 1e3 / specimen.gauge_mm
        specimen = replace(specimen, crosshead=specimen.crosshead is not False)
    if stress is None:
        if specimen.area is None:
            raise Refusal("--width-mm", None, f"{path.name} gives only the force: width and thickness are required")
        stress = data["force"] / specimen.area
    cycles = _cycles(strain)
    # Up to the largest stress, without points whose strain had been passed before.
    if len(stress) == 0:
        raise UnitcadError(f"{path}: no row has a number in each of the columns that are read")
    if np.max(stress) <= 0:
        raise UnitcadError(f"{path}: the stress is nowhere above zero: no pull, or the sign of the force is reversed")
    end = int(np.argmax(stress)) + 1
    fresh = np.concatenate([[True], strain[1:end] > np.maximum.accumulate(strain[:end])[:-1]])
    strain, stress = strain[:end][fresh], stress[:end][fresh]
    rate = None
    if "time" in data and len(strain) > 1:
        steps, clock = np.diff(strain[:21]), np.diff(data["time"][:end][fresh][:21])
        rate = float(np.median(steps[clock > 0] / clock[clock > 0])) if (clock > 0).any() else None
    if len(strain) < LEAST_POINTS:
        raise UnitcadError(f"{path}: {len(strain)} points before the largest stress; a curve needs {LEAST_POINTS}")
    if strain[0] <= -1.0:
        raise UnitcadError(f"{path}: the strain begins at {strain[0]:.3g}: strain cannot be below -1")
    return TensileCurve(
        path.name, strain, stress, specimen, files.sha256(path), rate, int((~fresh).sum()), lost, cycles
    )


def _cycles(strain: np.ndarray) -> int:
    """Return how often the strain goes back by a part of its whole, and then rises by as much."""
    if len(strain) < 2:
        return 0
    least = MOST_BACK * float(np.ptp(strain))
    count, extreme, rising = 0, float(strain[0]), True
    for value in map(float, strain):
        if (value > extreme) == rising:
            extreme = value
        elif abs(value - extreme) > least:
            count, extreme, rising = count + (not rising), value, not rising
    return count


def header_of(path: Path) -> Specimen:
    """Return the specimen from the lines "name;value" before the numbers."""
    with open(path, "rb", opener=files.regular()) as file:
        text = file.read(100_000).decode("utf-8", "replace")
    found: dict[str, float | bool] = {}
    for line in text.splitlines()[:_HEADER_LINES]:
        for key, pattern in _LENGTHS.items():
            size = pattern.match(line)
            if size is None or not (size["mm"] or size["unit"]):
                continue
            number = size["number"].rstrip(",")
            two_cells = "," in number and size["sign"] == "," and not size["quote"]  # 6,5: one or two?
            if _NUMBER.fullmatch(number) and not two_cells and not _MAYBE_THOUSANDS.fullmatch(number):
                found.setdefault(key, float(number.replace(",", ".")))
        if how := _STRAIN.match(line):
            found["crosshead"] = how[1] is not None
    if length := found.pop("length_mm", None):  # a bare "Length" is the gauge length if no other line gives one
        found.setdefault("gauge_mm", length)
    return Specimen(**{key: value for key, value in found.items() if key == "crosshead" or value})  # type: ignore[arg-type]


_CELL = r"""\s*(?P<mm>[\[(]mm[\])])?["']?\s*(?P<sign>[;:,\t])\s*(?P<quote>["']?)(?P<number>\d[\d.,e-]*)["']?"""
_LENGTHS = {
    key: re.compile(rf"""\W*{name}{_CELL}[;,\t\s]*["'\[(]*(?P<unit>mm\b)?""", re.IGNORECASE)
    for key, name in (
        ("thickness_mm", r"[\w -]*thickness"),
        ("width_mm", r"[\w -]*width"),
        ("gauge_mm", r"[\w -]*(?:specimen|gauge|initial) length"),
        ("length_mm", "length"),
    )
}
"""A length's name, a delimiter and a number, with mm in one of three places."""
_STRAIN = re.compile(
    r"[^;,:\t]*(?:strain|elongation)[^;,:\t]*[;,:\t][^;,\t]*?(?:(crosshead|cross-head|grip|traverse)|extensometer|video|dic\b)",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"\d+(?:[.,]\d*)?(?:e-?\d+)?")
_MAYBE_THOUSANDS = re.compile(r"[1-9]\d{0,2},\d{3}")


SECANTS = (0.10, 0.15, 0.25, 0.50, 1.00)
SLOPE_TO = 0.25
WIDEST_GAP = 0.5
"""Between two points of a curve, as a part of the strain of use, or of a secant's strain: nothing is made up beyond."""
Modulus = tuple[str, float | None, str]
"""A method, its Young's modulus of one curve in Pa, and the reason if the method can't be used: the modulus is None."""


def secant(strain: np.ndarray, stress: np.ndarray, at: float) -> float | None:
    """Return stress over strain at a strain, Pa, interpolated; None if no points of the curve are near it."""
    if not strain[0] <= at <= strain[-1]:
        return None
    after = int(np.searchsorted(strain, at))
    if strain[after] > at and strain[after] - strain[after - 1] > WIDEST_GAP * at:
        return None
    return float(np.interp(at, strain, stress)) / at


def moduli(strain: np.ndarray, stress: np.ndarray, low: float, high: float, toe: Toe | None) -> list[Modulus]:
    """Return Young's modulus by every method, the default first; strain rises, stress in Pa, use is `low` to `high`.

    Strains count from the toe's origin, stresses from its offset.
    """
    value, reason, origin = None, "", toe.origin if toe else 0.0
    if toe:
        strain, stress = strain - toe.origin, stress - toe.offset
        strain, stress = strain[strain > 0], stress[strain > 0]
    if len(strain) == 0 or strain[-1] < high:
        reason = f"the curve ends at {100 * strain[-1] if len(strain) else 0:.3g} %"
    elif toe is None:
        reason = f"too few points below {100 * high:.3g} %, or no rising stress there"
    else:
        points = np.concatenate([[low], strain[(strain > low) & (strain < high)], [high]])
        gap = int(np.argmax(np.diff(points)))
        begin, end = points[gap : gap + 2]
        if end - begin > WIDEST_GAP * (high - low):
            span = f"{100 * (begin + origin):.3g} and {100 * (end + origin):.3g} %"
            reason = f"the curve has no point between {span} strain"
        else:
            value = toe.secant
    found: list[Modulus] = [(f"secant over {100 * low:.3g} to {100 * high:.3g} %, toe fitted", value, reason)]
    for at in SECANTS:
        value, reason = secant(strain, stress, at), ""
        if value is None:
            spanned = f"the curve spans {100 * strain[0]:.3g} to {100 * strain[-1]:.3g} %"
            reason = "no points near it" if strain[0] <= at <= strain[-1] else spanned
        found.append((f"secant at {100 * at:g} %{' (ISO 37, ASTM D412)' if at == 1.0 else ''}", value, reason))
    kept = strain <= SLOPE_TO
    value, reason = None, "fewer than three points, or the curve ends before"
    if kept.sum() >= 3 and strain[-1] >= SLOPE_TO:
        value, reason = float(np.polyfit(strain[kept], stress[kept], 1)[0]), ""
    return [*found, (f"slope 0 to {100 * SLOPE_TO:g} % with offset", value, reason)]


CALLIPER_MM = 0.05
"""Error of a specimen's width and thickness (assumed: a calliper on soft rubber)."""
AREA_ERROR = 0.02
"""Relative error of a cross-section of which no lengths are known (assumed)."""
MOST_SCATTER, OTHER_MATERIAL, MOST_OF_SHEET = 1.25, 3.0, 5.0
"""Largest over least specimen that is warned of, and that is no longer one silicone; modulus over the sheet's."""
LATEST_START, MOST_TOE, MOST_OFFSET, MOST_TOE_ERROR = 0.02, 0.02, 0.05, 0.1
"""Limits: strain of the first point, strain of the toe, offset over the stress in use, error by the toe."""
MOST_BACK = 0.05
"""Part of the whole strain by which it goes back, and rises again, in a cycle."""


@dataclass(frozen=True)
class MethodRow:
    """One method over all specimens: the mean of logarithms (Pa) and each specimen's value; None if not usable."""

    method: str
    value: float | None
    by_specimen: tuple[float | None, ...]
    defensible: bool
    reason: str = ""


@dataclass(frozen=True)
class TensileResult:
    """The modulus (Pa) at the strain of use, its range, every method, and the parts of the uncertainty.

    `scatter`, `geometry`, `start`: half-widths of the logarithm; scatter is None for one specimen, and `start` is that
    of the fitted toe. `spread`: the largest over
    the least defensible value. `rate`: strain per second, None if not known. `warnings`: each begins with its name.
    """

    value: float
    low: float
    high: float
    method: str
    rows: tuple[MethodRow, ...]
    toes: tuple[Toe | None, ...]
    curves: tuple[TensileCurve, ...]
    scatter: float | None
    geometry: float
    start: float
    spread: float
    used: tuple[float, float]
    rate: float | None
    warnings: tuple[str, ...]


def evaluate(curves: Sequence[TensileCurve], used: tuple[float, float], sheet: Material | None = None) -> TensileResult:
    """Evaluate the specimens of one material at a strain of use (low, high); `sheet` is compared with it.

    Raises Refusal if no curve spans the strain of use, if a file is given twice, and for specimens that differ so
    much that they are not one silicone's.
    """
    known: dict[str, TensileCurve] = {}
    for curve in curves:
        if before := known.get(curve.sha256):
            raise Refusal("FILES", curve.name, f"has the same content as {before.name}: one specimen counts once")
        known[curve.sha256] = curve
    toes = tuple(fit_toe(curve.strain, curve.stress, *used) for curve in curves)
    by_curve = (moduli(curve.strain, curve.stress, *used, toe) for curve, toe in zip(curves, toes, strict=True))
    rows = tuple(_row(methods) for methods in zip(*by_curve, strict=True))
    chosen = rows[0]
    if chosen.value is None:
        ends = (
            curve.strain[-1] - max(toe.origin if toe else 0.0, 0.0) for curve, toe in zip(curves, toes, strict=True)
        )
        reach = math.floor(1000 * float(min(ends))) / 10
        nearest = f"{100 * used[0]:g}:{reach:g}" if 100 * used[0] < reach < 100 * used[1] else None
        raise Refusal("--strain", f"{100 * used[0]:g}:{100 * used[1]:g}", chosen.reason, nearest)
    by_specimen = [one for one in chosen.by_specimen if one is not None]
    ratio = max(by_specimen) / min(by_specimen)
    if ratio > OTHER_MATERIAL:
        pairs = zip(curves, by_specimen, strict=True)
        shown = some(f"{curve.name} {one / 1e3:.3g} kPa" for curve, one in pairs)
        why = "these are not specimens of one silicone, or a unit is wrong"
        raise Refusal("FILES", None, f"differ by a factor of {ratio:.3g} ({shown}): {why}")
    scatter = None
    if len(by_specimen) > 1:
        count = len(by_specimen)
        scatter = float(t.ppf(0.975, count - 1) * np.std(np.log(by_specimen), ddof=1) / math.sqrt(count))
    geometry = max(curve.specimen.area_error for curve in curves)
    start = math.sqrt(sum(toe.error**2 for toe in toes if toe) / len(toes))
    widened = math.exp(math.hypot(scatter or 0.0, geometry, start))
    rates = [curve.rate for curve in curves if curve.rate]
    values = [row.value for row in rows if row.value is not None and row.defensible]
    warnings = [doubt for curve, toe in zip(curves, toes, strict=True) for doubt in _doubts(curve, toe, used)]
    if len(curves) == 1:
        warnings.append("specimens: one curve: the scatter of specimens is not in the range")
    if ratio > MOST_SCATTER:
        warnings.append(f"scatter: the specimens differ by a factor of {ratio:.3g}: look for an odd one")
    if sheet and sheet.modulus_100pct_kpa:
        off = chosen.value / 1e3 / float(sheet.modulus_100pct_kpa)
        if not 1 / MOST_OF_SHEET <= off <= MOST_OF_SHEET:
            of = f"the 100 % modulus of {sheet.name}, {float(sheet.modulus_100pct_kpa):g} kPa"
            warnings.append(f"sheet: {off:.3g} times {of}: check the units and --like")
    return TensileResult(
        chosen.value, min(values) / widened, max(values) * widened, chosen.method, rows, toes, tuple(curves),
        scatter, geometry, start, max(values) / min(values), used, float(np.median(rates)) if rates else None, tuple(warnings),
    )  # fmt: skip


def quasistatic(result: TensileResult, frequency_hz: float) -> str:
    """Return the sentence that keeps a slow pull from being read as a modulus at the motor's frequency."""
    motor = 2.0 * math.pi * frequency_hz * sum(result.used) / 2.0
    pulled = (
        f"pulled at {result.rate:.2g} /s" if result.rate else "pulled slowly, at a rate that the file does not give"
    )
    return (
        f"quasi-static: {pulled}; at {frequency_hz:g} Hz and {50 * sum(result.used):.3g} % strain the rate is "
        f"{motor:.3g} /s, at which silicone is stiffer"
    )


def _row(methods: Sequence[Modulus]) -> MethodRow:
    values = tuple(value for _, value, _ in methods)
    known = [value for value in values if value is not None]
    defensible = len(known) == len(values) and min(known) > 0
    mean = None
    if len(known) == len(values):
        mean = math.exp(sum(map(math.log, known)) / len(known)) if defensible else sum(known) / len(known)
    reasons = list(dict.fromkeys(reason for _, _, reason in methods if reason))
    return MethodRow(methods[0][0], mean, values, defensible, "; ".join(reasons[:2]))


def _doubts(curve: TensileCurve, toe: Toe | None, used: tuple[float, float]) -> Iterator[str]:
    """Yield the warnings about one curve."""
    name = curve.name
    if curve.strain[0] > LATEST_START:
        yield f"start: {name}: the first point is at {100 * curve.strain[0]:.3g} % strain"
    if toe:
        found = []
        if abs(toe.origin) > MOST_TOE:
            found.append(f"{'slack' if toe.origin > 0 else 'pretension'} of {100 * abs(toe.origin):.3g} % strain")
        if abs(toe.offset) > MOST_OFFSET * toe.secant * sum(used) / 2:
            force = f" ({1e3 * toe.offset * curve.specimen.area:.3g} mN)" if curve.specimen.area else ""
            found.append(f"a stress of {toe.offset / 1e3:.3g} kPa{force} at no strain")
        if found:
            yield f"toe: {name}: {' and '.join(found)}, taken off"
        if toe.error > MOST_TOE_ERROR:
            yield f"toe: {name}: the record shows too little of its beginning: +- {100 * toe.error:.2g} % of the modulus"
    if curve.lost:
        yield f"gaps: {name}: {curve.lost} rows lack a number and are skipped"
    if curve.cycles or curve.skipped > 0.01 * len(curve.strain):
        times = f"rises again {curve.cycles} times" if curve.cycles else f"{curve.skipped} points were passed before"
        yield f"cycles: {name}: the strain goes back, {times}, as in cycles; the first pull counts"
    if curve.specimen.crosshead:
        yield f"crosshead: {name}: strain by the crosshead's travel: grips and shoulders count as gauge length"


Deformation = Literal["shear", "tension"]
GEOMETRY_ERROR = 0.05
"""Relative error of the modulus by the specimen's size and its clamping (assumed); the loss factor has none of it."""
FLOOR_PER_DECADE, UNTESTED_PER_DECADE = 0.1, 0.3
"""Least error of an extrapolation, in logarithms per decade (assumed): a tested one, and one of too few points."""
MOST_MISFIT, NO_LAW = 0.1, 0.5
"""Misfit, in logarithms, that is warned of, and that is refused."""
HELD_OUT = 0.5
"""The part of the span, in logarithms of frequency, that is predicted from the rest to judge an extrapolation."""


@dataclass(frozen=True)
class DynamicCurve:
    """Storage and loss (Pa, (n,)) over frequency (Hz, rising), of Young's modulus ("tension") or of shear.

    `lost`: rows without a number, which are skipped.
    """

    name: str
    frequency: np.ndarray = field(repr=False)
    storage: np.ndarray = field(repr=False)
    loss: np.ndarray = field(repr=False)
    deformation: Deformation
    sha256: str
    lost: int = 0


@dataclass(frozen=True)
class DynamicResult:
    """The law (Young's modulus at rest in Pa, tau in s, n) and its values at the motor's frequency.

    `storage`, `loss_factor`: at `frequency_hz`, Pa and tan delta. `error`, `loss_error`: half-widths (95 %) of their
    logarithms: the fit's (`fit_error`: only that, of the storage), the specimen's geometry, and outside the measured
    span the error of predicting the upper half from the lower, at least `FLOOR_PER_DECADE`.
    """

    static: float
    tau: float
    n: float
    residual: float
    frequency_hz: float
    storage: float
    loss_factor: float
    error: float
    loss_error: float
    fit_error: float
    held_out_error: float | None
    extrapolated: bool
    curve: DynamicCurve
    warnings: tuple[str, ...] = ()


def read_dynamic(
    path: Path, given: Mapping[str, Declared], deformation: str = "", layout: Layout = AS_FOUND
) -> DynamicCurve:
    """Return a file's storage and loss over frequency.

    Raises Refusal for columns and units that are missing, and if the file does not say shear or tension.
    """
    recording = open_recording(path, layout)
    data, lost = read_columns(recording, given, ("frequency",), ("storage",), ("loss", "tan_delta"))
    loss = data["loss"] if "loss" in data else data["tan_delta"] * data["storage"]
    order = np.argsort(data["frequency"], kind="stable")
    frequency, storage, loss = data["frequency"][order], data["storage"][order], loss[order]
    if len(frequency) < LEAST_POINTS:
        raise UnitcadError(f"{path}: {len(frequency)} frequencies; a law of three constants needs {LEAST_POINTS}")
    if min(frequency.min(), storage.min(), loss.min()) <= 0:
        raise UnitcadError(f"{path}: frequency, storage and loss must be above zero everywhere")
    if not deformation and (column := column_of(recording, "storage", given)):
        name = recording.channels[column[0]].name.lower()
        deformation = {"e": "tension", "g": "shear"}.get(name[0], "") if name[1:2] in ("'", "′") else ""
    if deformation not in ("shear", "tension"):
        raise Refusal("--deformation", deformation or None, "must be shear or tension: the file does not say")
    return DynamicCurve(path.name, frequency, storage, loss, deformation, files.sha256(path), lost)  # type: ignore[arg-type]


def evaluate_dynamic(curve: DynamicCurve, frequency_hz: float, poisson_ratio: float = 0.5) -> DynamicResult:
    """Fit the law and evaluate it at a frequency, in terms of Young's modulus: 2 (1 + nu) times that of shear.

    Raises Refusal if the law does not describe the data at all.
    """
    factor = 2.0 * (1.0 + poisson_ratio) if curve.deformation == "shear" else 1.0
    omega, storage, loss = 2.0 * np.pi * curve.frequency, factor * curve.storage, factor * curve.loss
    constants, covariance, residual = _fit(omega, storage, loss)
    over = bool(np.median(loss / storage) > 1.0)
    if residual > NO_LAW:
        hint = ": the loss is above the storage modulus; are the columns swapped?" if over else ""
        limit = f"{curve.name}: no fractional Kelvin-Voigt law comes nearer than {100 * residual:.3g} %{hint}"
        raise Refusal("--dma", None, limit)

    at = np.array([2.0 * np.pi * frequency_hz])
    (storage_at, loss_at), gradient = np.exp(_logs(constants, at)), _jacobian(constants, at)
    student = float(t.ppf(0.975, max(2 * len(omega) - 3, 1)))
    slopes = np.stack([gradient[0], gradient[1] - gradient[0]])  # of ln storage, and of ln tan delta
    variances = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    fit_error, loss_error = (student * math.sqrt(max(float(one), 0.0)) for one in variances)
    low, high = float(curve.frequency[0]), float(curve.frequency[-1])
    outside = not low <= frequency_hz <= high
    # Fit the lower half of the span, in logarithms: the worst misfit of the upper half judges an extrapolation.
    held_out, lower = None, omega <= omega[0] * (omega[-1] / omega[0]) ** (1.0 - HELD_OUT) * (1 + 1e-12)
    if LEAST_POINTS <= lower.sum() < len(omega):
        lower_half, _, _ = _fit(omega[lower], storage[lower], loss[lower])
        measured = np.log(np.concatenate([storage[~lower], loss[~lower]]))
        held_out = float(np.max(np.abs(_logs(lower_half, omega[~lower]) - measured)))
    error = math.hypot(fit_error, GEOMETRY_ERROR)
    if outside:
        span = math.log(high / low) * HELD_OUT
        beyond = math.log(frequency_hz / high) if frequency_hz > high else math.log(low / frequency_hz)
        grown = (FLOOR_PER_DECADE if held_out is not None else UNTESTED_PER_DECADE) * beyond / math.log(10.0)
        if held_out is not None:
            grown = max(grown, held_out * max(1.0, beyond / span))
        error, loss_error = math.hypot(error, grown), math.hypot(loss_error, grown)
    name = curve.name
    warnings = [f"specimens: {name}: one dynamic test: the scatter of specimens is not in the range"]
    if residual > MOST_MISFIT:
        warnings.append(f"misfit: {name}: the law misses the points by {100 * residual:.2g} % (rms of the logarithms)")
    if over:
        hint = "the loss is above the storage modulus, which a cured silicone's is not; are the columns swapped?"
        warnings.append(f"loss: {name}: {hint}")
    if curve.lost:
        warnings.append(f"gaps: {name}: {curve.lost} rows lack a number and are skipped")
    static, tau, n = _constants(constants)
    return DynamicResult(
        static, tau, n, residual, frequency_hz, float(storage_at), float(loss_at / storage_at), error, loss_error,
        fit_error, held_out, outside, curve, tuple(warnings),
    )  # fmt: skip


def _constants(p: np.ndarray) -> tuple[float, float, float]:
    """Return E0, tau and n of ln E0, ln tau and the logit of n."""
    return float(np.exp(p[0])), float(np.exp(p[1])), float(1.0 / (1.0 + np.exp(-p[2])))


def _logs(p: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Return ln storage and ln loss of the law, (2 n,)."""
    static, tau, n = _constants(p)
    modulus = static * (1.0 + (1j * omega * tau) ** n)
    return np.log(np.concatenate([modulus.real, np.maximum(modulus.imag, 1e-300)]))


def _jacobian(p: np.ndarray, omega: np.ndarray) -> np.ndarray:
    steps = 1e-6 * np.eye(3)
    return np.stack([(_logs(p + step, omega) - _logs(p - step, omega)) / 2e-6 for step in steps], axis=1)


def _fit(omega: np.ndarray, storage: np.ndarray, loss: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the constants, their covariance and the rms misfit of the logarithms."""

    wanted = np.log(np.concatenate([storage, loss]))
    middle = math.log(math.sqrt(omega[0] * omega[-1]))
    bounds = [wanted.min() - 20, -60.0, -8.0], [wanted.max() + 5, 30.0, 8.0]
    close: Any = {"x_scale": "jac", "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    starts = [[wanted[0], shift - middle, math.log(n / (1 - n))] for n in (0.2, 0.5, 0.8) for shift in (-3.0, 0.0, 3.0)]
    tries = [least_squares(lambda p: _logs(p, omega) - wanted, start, bounds=bounds, **close) for start in starts]
    best = min(tries, key=lambda found: found.cost)
    gradient = _jacobian(best.x, omega)
    covariance = np.linalg.pinv(gradient.T @ gradient) * 2.0 * best.cost / max(len(wanted) - 3, 1)
    return best.x, covariance, math.sqrt(2.0 * best.cost / len(wanted))

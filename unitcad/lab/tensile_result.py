"""A silicone's quasi-static modulus from the curves of its specimens, with a range and warnings. SI inside.

The range covers what could be defended: the stable methods' least and largest value, widened by the scatter of the
specimens (Student's t, 95 %, of the mean of logarithms) and by the error of the cross-section.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.catalogue import Material
from unitcad.errors import Refusal
from unitcad.lab.modulus_methods import Modulus, Toe, default_method, fit_start, moduli
from unitcad.lab.tensile_curve import TensileCurve

CALLIPER_MM = 0.05
"""Error of a specimen's width and thickness (assumed: a calliper on soft rubber)."""
AREA_ERROR = 0.02
"""Relative error of a cross-section of which no lengths are known (assumed)."""
MOST_SCATTER, OTHER_MATERIAL, MOST_OF_SHEET = 1.25, 3.0, 5.0
"""Largest over least specimen that is warned of, and that is no longer one silicone; modulus over the sheet's."""
LEAST_OF_CELL, LATEST_START, MOST_BREAK, MOST_TOE = 1e-3, 0.02, 1.25, 0.02
"""Limits: force over full scale, strain of the first point, break over the sheet's, strain of the toe."""


@dataclass(frozen=True)
class MethodRow:
    """One method over all specimens: the mean of logarithms (Pa) and each specimen's value; None where not usable."""

    method: str
    value: float | None
    by_specimen: tuple[float | None, ...]
    defensible: bool
    reason: str = ""


@dataclass(frozen=True)
class Warned:
    """One warning: a word that names it, and a sentence."""

    code: str
    message: str


@dataclass(frozen=True)
class TensileResult:
    """The modulus (Pa) at the strain of use, its range, every method, and the parts of the uncertainty.

    `scatter`, `geometry`: half-widths of the logarithm; scatter is None for one specimen. `spread`: the largest over
    the least defensible value. `rate`: strain per second, None where not known.
    """

    value: float
    low: float
    high: float
    method: str
    rows: tuple[MethodRow, ...]
    by_curve: tuple[tuple[Modulus, ...], ...]
    toes: tuple[Toe | None, ...]
    curves: tuple[TensileCurve, ...]
    scatter: float | None
    geometry: float
    spread: float
    used: tuple[float, float]
    rate: float | None
    warnings: tuple[Warned, ...]


def evaluate(curves: Sequence[TensileCurve], used: tuple[float, float], sheet: Material | None = None) -> TensileResult:
    """Evaluate the specimens of one material at a strain of use (low, high); `sheet` is compared with the break.

    Raises Refusal where no curve spans the strain of use, where a file is given twice, and for specimens that differ so
    much that they are not one silicone's.
    """
    _expect_different(curves)
    by_curve = tuple(moduli(curve.strain, curve.stress, *used) for curve in curves)
    rows = tuple(_row([methods[i] for methods in by_curve]) for i in range(len(by_curve[0])))
    name = default_method(*used)
    chosen = next(row for row in rows if row.method == name)
    if chosen.value is None:
        reach = math.floor(1000 * min(float(curve.strain[-1]) for curve in curves)) / 10
        nearest = f"{100 * used[0]:g}:{reach:g}" if 100 * used[0] < reach < 100 * used[1] else None
        raise Refusal("--strain", f"{100 * used[0]:g}:{100 * used[1]:g}", chosen.reason, nearest)
    ratio = _ratio(chosen)
    if ratio > OTHER_MATERIAL:
        shown = ", ".join(
            f"{curve.name} {one / 1e3:.3g} kPa"
            for curve, one in zip(curves, chosen.by_specimen, strict=True)
            if one is not None
        )
        limit = (
            f"differ by a factor of {ratio:.3g} ({shown}): these are not specimens of one silicone, or a unit is wrong"
        )
        raise Refusal("FILES", None, limit)
    values = [row.value for row in rows if row.value is not None and row.defensible]
    scatter = _scatter([v for v in chosen.by_specimen if v is not None])
    geometry = max(_area_error(curve) for curve in curves)
    widened = math.exp(math.hypot(scatter or 0.0, geometry))
    rates = [curve.rate for curve in curves if curve.rate]
    toes = tuple(fit_start(curve.strain, curve.stress, used[1]) for curve in curves)
    spread = max(values) / min(values)
    warnings = [*_curve_warnings(curves, used, toes, sheet), *_warnings(by_curve, len(curves))]
    if ratio > MOST_SCATTER:
        warnings.append(Warned("scatter", f"the specimens differ by a factor of {ratio:.3g}: look for an odd one"))
    if sheet:
        off = chosen.value / 1e3 / float(sheet.modulus_100pct_kpa)
        if not 1 / MOST_OF_SHEET <= off <= MOST_OF_SHEET:
            message = f"{off:.3g} times the 100 % modulus of {sheet.name}, {float(sheet.modulus_100pct_kpa):g} kPa"
            warnings.append(Warned("sheet", f"{message}: check the units and --like"))
    low, high = min(values) / widened, max(values) * widened
    rate = float(np.median(rates)) if rates else None
    return TensileResult(
        chosen.value,
        low,
        high,
        name,
        rows,
        by_curve,
        toes,
        tuple(curves),
        scatter,
        geometry,
        spread,
        used,
        rate,
        tuple(warnings),
    )


def quasistatic(result: TensileResult, frequency_hz: float) -> str:
    """Return the sentence that keeps a slow pull from being read as a modulus at the motor's frequency."""
    motor = 2.0 * math.pi * frequency_hz * sum(result.used) / 2.0
    pulled = (
        f"pulled at {result.rate:.2g} /s" if result.rate else "pulled slowly, at a rate that the file does not give"
    )
    return (
        f"quasi-static: {pulled}; at {frequency_hz:g} Hz and {50 * sum(result.used):.3g} % strain the rate is "
        f"{motor:.3g} /s, where silicone is stiffer"
    )


def _row(methods: Sequence[Modulus]) -> MethodRow:
    values = tuple(one.value for one in methods)
    known = [v for v in values if v is not None]
    positive = [v for v in known if v > 0]
    mean = None
    if known and len(known) == len(values):
        mean = (
            math.exp(sum(map(math.log, known)) / len(known)) if len(positive) == len(known) else sum(known) / len(known)
        )
    reasons = list(dict.fromkeys(one.reason for one in methods if one.reason))
    defensible = all(one.defensible for one in methods) and len(positive) == len(values)
    return MethodRow(methods[0].method, mean, values, defensible, "; ".join(reasons[:2]))


def _expect_different(curves: Sequence[TensileCurve]) -> None:
    known: dict[str, TensileCurve] = {}
    for curve in curves:
        if before := known.get(curve.sha256):
            limit = "is given twice" if before.path == curve.path else f"has the same content as {before.name}"
            raise Refusal("FILES", curve.name, f"{limit}: one specimen counts once")
        known[curve.sha256] = curve


def _ratio(row: MethodRow) -> float:
    """Return the largest over the least specimen."""
    values = [one for one in row.by_specimen if one is not None]
    return max(values) / min(values)


def _scatter(values: Sequence[float]) -> float | None:
    """Return the half-width of the mean logarithm's 95 % interval by Student's t; None for one specimen."""
    if len(values) < 2:
        return None
    from scipy.stats import t

    logs = np.log(values)
    return float(t.ppf(0.975, len(values) - 1) * np.std(logs, ddof=1) / math.sqrt(len(values)))


def _area_error(curve: TensileCurve) -> float:
    lengths = (curve.specimen.width_mm, curve.specimen.thickness_mm)
    if None in lengths:
        return AREA_ERROR
    return math.hypot(*(CALLIPER_MM / length for length in lengths if length))


def _curve_warnings(
    curves: Sequence[TensileCurve], used: tuple[float, float], toes: Sequence[Toe | None], sheet: Material | None
) -> list[Warned]:
    found = []
    for curve, toe in zip(curves, toes, strict=True):
        middle, specimen = sum(used) / 2.0, curve.specimen
        if specimen.area and specimen.cell_n:
            force = float(np.interp(middle, curve.strain, curve.stress)) * specimen.area
            if force < LEAST_OF_CELL * specimen.cell_n:
                message = (
                    f"{force:.2g} N at {100 * middle:.3g} %, below a thousandth of the cell's {specimen.cell_n:g} N"
                )
                found.append(Warned("force", f"{curve.name}: {message}: use a smaller cell"))
        if curve.strain[0] > LATEST_START:
            found.append(Warned("start", f"{curve.name}: the first point lies at {100 * curve.strain[0]:.3g} % strain"))
        if toe and abs(toe.origin) > MOST_TOE:
            found.append(
                Warned(
                    "toe", f"{curve.name}: the fitted curve begins at {100 * toe.origin:.3g} % strain (slack or offset)"
                )
            )
        if curve.lost:
            found.append(Warned("gaps", f"{curve.name}: {curve.lost} rows lack a number and are left out"))
        if curve.skipped > 0.01 * len(curve.strain):
            message = f"{curve.skipped} points left out: the strain goes back, as in cycles; the first pull counts"
            found.append(Warned("cycles", f"{curve.name}: {message}"))
        if sheet:
            at, expected = 100 * curve.strain[-1], float(sheet.elongation_pct)
            if not 1 / MOST_BREAK <= at / expected <= MOST_BREAK:
                message = f"breaks at {at:.4g} %, {at / expected:.2g} times the sheet's {expected:g} %"
                found.append(Warned("break", f"{curve.name}: {message}: the gauge length or the strain is doubtful"))
        if specimen.crosshead:
            message = "strain by the crosshead's travel: grips and shoulders count as gauge length"
            found.append(Warned("crosshead", f"{curve.name}: {message}"))
    return found


def _warnings(by_curve: Sequence[Sequence[Modulus]], specimens: int) -> list[Warned]:
    found = []
    unstable = {one.method: one.reason for methods in by_curve for one in methods if one.fit and one.fit.unstable}
    for method, reason in unstable.items():
        found.append(Warned("unstable", f"{method}: {reason}; its constants hold for no simulation"))
    if specimens == 1:
        found.append(Warned("specimens", "one curve: the scatter of specimens is not in the range"))
    return found

"""Storage and loss modulus over frequency to a fractional Kelvin-Voigt law, and on to the motor's frequency. SI.

E*(w) = E0 (1 + (i w tau)^n), fitted in the logarithms of storage and loss, so that every point counts alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t

from unitcad import files
from unitcad.errors import Refusal, UnitcadError
from unitcad.lab.columns import Declared, column_of, columns, columns_of
from unitcad.lab.readers import AS_FOUND, Layout, open_recording
from unitcad.lab.tensile import Warned

Deformation = Literal["shear", "tension"]
LEAST_POINTS = 5
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
    warnings: tuple[Warned, ...] = ()


def read_dynamic(
    path: Path, given: Mapping[str, Declared], deformation: str = "", layout: Layout = AS_FOUND
) -> DynamicCurve:
    """Return a file's storage and loss over frequency.

    Raises Refusal for columns and units that are missing, and if the file does not say shear or tension.
    """
    recording = open_recording(path, layout)
    wanted = {q: found for q in ("frequency", "storage", "loss") if (found := column_of(recording, q, given))}
    if "loss" not in wanted and (found := column_of(recording, "tan_delta", given)):
        wanted["tan_delta"] = found
    for quantity in ("frequency", "storage"):
        if quantity not in wanted:
            limit = f"{path.name} has no column of {quantity}; declare {quantity}=COLUMN:UNIT"
            raise Refusal("--column", None, f"{limit}; {columns_of(recording)}")
    if len(wanted) < 3:
        limit = f"{path.name} has neither loss nor tan_delta; declare loss=COLUMN:UNIT or tan_delta=COLUMN"
        raise Refusal("--column", None, f"{limit}; {columns_of(recording)}")
    data, lost = columns(recording, wanted)
    loss = data["loss"] if "loss" in data else data["tan_delta"] * data["storage"]
    order = np.argsort(data["frequency"], kind="stable")
    frequency, storage, loss = data["frequency"][order], data["storage"][order], loss[order]
    if len(frequency) < LEAST_POINTS:
        raise UnitcadError(f"{path}: {len(frequency)} frequencies; a law of three constants needs {LEAST_POINTS}")
    if min(frequency.min(), storage.min(), loss.min()) <= 0:
        raise UnitcadError(f"{path}: frequency, storage and loss must be above zero everywhere")
    name = recording.channels[wanted["storage"][0]].name.lower()
    if not deformation:
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
    said = {"specimens": "one dynamic test: the scatter of specimens is not in the range"}
    if residual > MOST_MISFIT:
        said["misfit"] = f"the law misses the points by {100 * residual:.2g} % (rms of the logarithms)"
    if over:
        said["loss"] = (
            "the loss is above the storage modulus, which a cured silicone's is not; are the columns swapped?"
        )
    if curve.lost:
        said["gaps"] = f"{curve.lost} rows lack a number and are skipped"
    static, tau, n = _constants(constants)
    return DynamicResult(
        static, tau, n, residual, frequency_hz, float(storage_at), float(loss_at / storage_at), error, loss_error,
        fit_error, held_out, outside, curve, tuple(Warned(code, f"{curve.name}: {one}") for code, one in said.items()),
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

"""The three models of the edge level as functions of arrays, their fitted constants, and the null model beside them.

`paper` and `consistent` leave the level at the motor open (f1, f2 are not printed): one constant, the geometric mean
over the table. `fitted` has two constants. `crossings`, layer propagation alone (k_t once for each pass of an
interface), is compared with the table but gives no estimate. All are made from the catalogue's measured table when they
are asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured_levels import Assessment, Fit, MeasuredTable, Predict, assess, measured_table

MODELS = ("paper", "consistent", "fitted")
STORED_FIT = {"kappa": 0.282048, "s": 0.659429, "left_out_levels": 1.3345, "left_out_ratios": 1.3299}
"""The divider's constants and its leave-one-unit-out errors (geometric-mean factors) over the catalogue's nine levels.

Made by `fit_divider(measured_table(), everyone)`, least squares of the log, and `assessments()["fitted"]`; shown by
`unitcad accuracy models`; a test makes them again.
"""


def scale_of(path: Predict, table: MeasuredTable, chosen: np.ndarray) -> float:
    """Return the one constant s of level = s path: geometric mean of measured / path over the chosen units."""
    return float(np.exp(np.mean(np.log(table.levels / table.evaluate(path))[chosen])))


def one_constant(path: Predict) -> Fit:
    """Return the fit of the one constant s in level = s path."""

    def fit(table: MeasuredTable, chosen: np.ndarray) -> Callable[[MeasuredTable], np.ndarray]:
        s = scale_of(path, table, chosen)
        return lambda other: s * other.evaluate(path)

    return fit


def fit_divider(table: MeasuredTable, chosen: np.ndarray) -> tuple[float, float]:
    """Fit (kappa, s) of level = s / (1 + kappa n E_outer/E_inner): least squares of the log, golden section."""
    logs, contrast = np.log(table.levels[chosen]), table.contrast[chosen]

    def parts(log_kappa: float) -> np.ndarray:
        return logs + np.log1p(np.exp(log_kappa) * contrast)

    def misfit(log_kappa: float) -> float:
        return float(np.var(parts(log_kappa)))

    low, high = np.log(1e-3), np.log(1e2)
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    left, right = high - golden * (high - low), low + golden * (high - low)
    at_left, at_right = misfit(left), misfit(right)
    while high - low > 1e-9:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - golden * (high - low)
            at_left = misfit(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + golden * (high - low)
            at_right = misfit(right)
    best = (low + high) / 2.0
    return float(np.exp(best)), float(np.exp(np.mean(parts(best))))


def two_constants(table: MeasuredTable, chosen: np.ndarray) -> Callable[[MeasuredTable], np.ndarray]:
    """Return the divider fitted to the chosen units."""
    kappa, s = fit_divider(table, chosen)
    return lambda other: s / (1.0 + kappa * other.contrast)


def null(table: MeasuredTable, chosen: np.ndarray) -> Callable[[MeasuredTable], np.ndarray]:
    """Fit two constants: one level where the inner layer is the softer one, one for all others."""
    logs = np.log(table.levels)
    soft = table.soft_inside
    levels = [float(np.exp(np.mean(logs[chosen & (soft == side)]))) for side in (False, True)]
    return lambda other: np.where(other.soft_inside, levels[1], levels[0])


def paths() -> dict[str, Predict]:
    """Return each model, and the reading with k_t alone, as a function of units, before any constant."""
    return {
        "paper": cf.paper_path,
        "consistent": cf.consistent_path,
        "fitted": lambda units: cf.divider(units, STORED_FIT["kappa"]),
        "crossings": cf.transmission_only,
    }


@cache
def assessments() -> dict[str, Assessment]:
    """Compare every model, the reading with k_t alone and the null with the measured table."""
    by_model = paths()
    fits: dict[str, tuple[Fit, bool]] = {
        "paper": (one_constant(by_model["paper"]), False),
        "consistent": (one_constant(by_model["consistent"]), False),
        "fitted": (two_constants, True),
        "crossings": (one_constant(by_model["crossings"]), False),
        "null": (null, True),
    }
    return {name: assess(fit, in_ratios) for name, (fit, in_ratios) in fits.items()}


@cache
def scales() -> dict[str, float]:
    """Return the constant s of every model, from all nine levels; the divider's is stored."""
    table = measured_table()
    everyone = np.ones(len(table.names), dtype=bool)
    constants = {name: scale_of(path, table, everyone) for name, path in paths().items() if name != "fitted"}
    return {**constants, "fitted": STORED_FIT["s"]}


def edge_levels(units: Units, model: str) -> Any:
    """Return the edge level (motor amplitude = 1) by `paper`, `consistent` or `fitted`, shape (...)."""
    return scales()[model] * paths()[model](units)

"""The models of the edge level, what is fitted to a measured table, and how well each does there.

`paper`, `consistent` and `bush` leave the level at the motor open: one constant s, the geometric mean over the table.
`fitted`, the divider, has two constants. `crossings` (layer propagation alone, k_t once for each pass of an interface)
and the null model of two levels are compared with the table but give no estimate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, get_args

import numpy as np

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.bush import CHOSEN, Form, bush
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured_levels import MeasuredTable, Moduli, Predict, measured_table
from unitcad.attenuation.edge.scores import Assessment, Choice, Fit, assess, choose_without, sign_flip_p
from unitcad.attenuation.edge.variant_units import MOST_LAYERS

MODELS = ("bush", "fitted", "paper", "consistent")
"""The models that give an estimate."""


def one_constant(path: Predict) -> Fit:
    """Return the fit of the one constant s in level = s path: the geometric mean of measured / path."""

    def fit(table: MeasuredTable, chosen: np.ndarray) -> np.ndarray:
        levels = table.evaluate(path)
        s = np.exp(chosen @ np.log(table.levels / levels) / chosen.sum(axis=1))
        return s[:, None] * levels

    return fit


KAPPA = (1e-3, 1e2)
"""Bounds of the search for the divider's kappa: a fit that ends on one does not determine it."""


_HALVINGS = 50


def fit_divider(table: MeasuredTable, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit (kappa, s) of level = s / (1 + kappa n E_outer/E_inner) for masks or counts (M, units), shape (M,) each.

    Least squares of the log: the root of its slope over ln kappa, by bisection. A search of the least sum itself could
    tell its place to half of the digits only, and processors would differ in the ninth.
    """
    logs, contrast, count = np.log(table.levels), table.contrast, chosen.sum(axis=1)

    def mean_and_slope(log_kappa: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = np.exp(log_kappa)[:, None] * contrast
        each = logs + np.log1p(x)
        mean = np.sum(each * chosen, axis=1) / count
        return mean, np.sum((each - mean[:, None]) * chosen * x / (1.0 + x), axis=1)

    low, high = (np.full(len(chosen), np.log(end)) for end in KAPPA)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        rising = mean_and_slope(middle)[1] > 0.0
        low, high = np.where(rising, low, middle), np.where(rising, middle, high)
    best = (low + high) / 2.0
    return np.exp(best), np.exp(mean_and_slope(best)[0])


def two_constants(table: MeasuredTable, chosen: np.ndarray) -> np.ndarray:
    """Return the divider's levels, fitted to each mask's units."""
    kappa, s = fit_divider(table, chosen)
    return s[:, None] / (1.0 + kappa[:, None] * table.contrast)


def null(table: MeasuredTable, chosen: np.ndarray) -> np.ndarray:
    """Fit two constants: one level where the inner layer is the softer one, one for all others."""
    logs, soft = np.log(table.levels), table.soft_inside
    sides = []
    for side in (soft, ~soft):
        used = chosen * side
        used = np.where(used.any(axis=1, keepdims=True), used, chosen)
        sides.append(np.exp(np.sum(logs * used, axis=1) / used.sum(axis=1)))
    return np.where(soft, sides[0][:, None], sides[1][:, None])


@dataclass(frozen=True)
class Compared:
    """A model as it is compared with a table: its fit, how many constants, whether they enter ratios too."""

    fit: Fit
    constants: int
    in_ratios: bool = False


def compared() -> dict[str, Compared]:
    """Return every model, the reading with k_t alone and the null."""
    return {
        **{name: Compared(one_constant(path), 1) for name, path in _PATHS.items()},
        "fitted": Compared(two_constants, 2, in_ratios=True),
        "null": Compared(null, 2, in_ratios=True),
    }


def forms() -> dict[str, Fit]:
    """Return every form that was tried: each model in each of its readings."""
    tried: dict[str, Fit] = {}
    for wave in get_args(cf.Wave):
        for reading in get_args(cf.Reading):
            path = partial(cf.paper_path, wave=wave, reading=reading)
            tried[f"paper, {wave.upper()} wave, {reading}"] = one_constant(path)
        tried[f"consistent, {wave.upper()} wave"] = one_constant(partial(cf.consistent_path, wave=wave))
    for form in bush_forms():
        words = ("long" if form.long else "short", "filled" if form.filled else "gap as drawn")
        name = ", ".join(("bush", *words, "floors" if form.floors else "no floors"))
        tried[name] = one_constant(partial(bush, form=form))
    return {**tried, **{name: compared()[name].fit for name in ("fitted", "crossings", "null")}}


def bush_forms() -> list[Form]:
    """Return the forms of `bush` that were tried, the chosen one first."""
    every = [
        Form(floors, filled, long) for long in (False, True) for floors in (True, False) for filled in (False, True)
    ]
    return sorted(every, key=lambda form: form != CHOSEN)


_PATHS: dict[str, Predict] = {
    "bush": bush,
    "paper": cf.paper_path,
    "consistent": cf.consistent_path,
    "crossings": cf.transmission_only,
}
"""The models of one constant, before it."""


@cache
def assessments(moduli: Moduli = "dynamic") -> dict[str, Assessment]:
    """Compare every model, the reading with k_t alone and the null with the catalogue's table, by such moduli."""
    return assess_all(measured_table(moduli))


def assess_all(table: MeasuredTable) -> dict[str, Assessment]:
    """Compare every model, the reading with k_t alone and the null with a measured table."""
    return {name: assess(one.fit, one.in_ratios, table) for name, one in compared().items()}


def in_order(found: dict[str, Assessment]) -> list[str]:
    """Return the models by their score with a unit left out, the best first; of equals the one of fewer constants."""
    return sorted(found, key=lambda name: (round(found[name].left_out.geometric_mean, 3), compared()[name].constants))


def pairwise(found: dict[str, Assessment]) -> list[tuple[str, str, float]]:
    """Return (better, worse, p) of each pair, in order: the sign-flip test of their errors with the unit left out."""
    names = in_order(found)
    return [
        (a, b, sign_flip_p(found[a].left_out_errors, found[b].left_out_errors))
        for i, a in enumerate(names)
        for b in names[i + 1 :]
    ]


@cache
def choice(moduli: Moduli = "dynamic") -> Choice:
    """Choose among all `forms` without the unit, over the catalogue's measured table, by such moduli."""
    return choose_without(forms(), measured_table(moduli))


def constants(table: MeasuredTable) -> dict[str, dict[str, float]]:
    """Return the constants of every model that gives an estimate, from all units of the table, to six digits."""
    everyone = np.ones((1, len(table.names)), dtype=bool)
    kappa, s = fit_divider(table, everyone)
    made = {"fitted": {"kappa": float(kappa[0]), "s": float(s[0])}}
    for name, path in _PATHS.items():
        made[name] = {"s": float(np.exp(np.mean(np.log(table.levels / table.evaluate(path)))))}
    return {name: {key: float(f"{v:.6g}") for key, v in made[name].items()} for name in MODELS}


@cache
def stored(moduli: Moduli = "dynamic") -> dict[str, dict[str, float]]:
    """Return the constants from the catalogue's measured table, by such moduli."""
    return constants(measured_table(moduli))


def path_of(model: str, constants: Mapping[str, float] | None = None) -> Predict:
    """Return a model as a function of units, before its constant s. Raises KeyError for the null model.

    `constants` stand in for the stored ones.
    """
    if model == "fitted":
        return partial(cf.divider, kappa=(constants or stored()["fitted"])["kappa"])
    return _PATHS[model]


def edge_levels(units: Units, model: str, constants: Mapping[str, float] | None = None) -> Any:
    """Return the edge level (motor amplitude = 1) by a model of `MODELS`, shape (...), by the stored
    constants of moduli at the motor's frequency where none are given. NaN for units of more than `MOST_LAYERS`.
    """
    if units.thickness.shape[-1] > MOST_LAYERS:
        return np.full(units.thickness.shape[:-1], np.nan)
    return (constants or stored()[model])["s"] * path_of(model, constants)(units)

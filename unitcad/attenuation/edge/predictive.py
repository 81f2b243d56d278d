"""Where a new unit's level may lie: each model's Student-t distribution of ln level, stacked over the models.

A model's distribution stands at its own ln level. Its scale is the standard deviation of the left-out residuals, the
root of their squares' sum over n - 1; its degrees of freedom are n less the model's constants. The weights of the
models maximise the sum over the measured units of the logarithm of the mixture's density at the level measured, each
unit predicted by constants fitted without it (Yao, Vehtari, Simpson and Gelman, Bayesian Analysis 13, 917, 2018).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.fitted_models import MODELS, compared, edge_levels
from unitcad.attenuation.edge.lab_fit import PERCENT, LabFit, gradient
from unitcad.attenuation.edge.measured_levels import MeasuredTable, Moduli, measured_table
from unitcad.attenuation.edge.scores import all_but_one
from unitcad.attenuation.edge.shrunk_fit import models as fitted_forms
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.attenuation.inputs import EstimateInput
from unitcad.errors import Refusal, unknown_name

STACKED = (*MODELS, "crossings")
"""The closed forms that are stacked where none are named."""
HELD: dict[tuple[str, ...], int] = {STACKED: 6}
"""How many of the nine measured units lie in the 10 to 90 % range of models stacked without the unit; a test recounts.

By moduli at the motor's frequency. Stored, since the count takes longer than an estimate.
"""
_LEAST_WEIGHT = 1e-3
_STEPS, _SETTLED = 200_000, 1e-12


@dataclass(frozen=True)
class Predictive:
    """Mixtures of Student-t distributions of ln level, one for each of any number of units, shape (...).

    `weights` and `degrees_of_freedom` have the shape (models,), `centre` and `scale` (..., models). The centre is NaN
    where an input is not known; so is what follows from it.
    """

    models: tuple[str, ...]
    weights: np.ndarray
    degrees_of_freedom: np.ndarray
    centre: np.ndarray
    scale: np.ndarray

    def at_most(self, level: float | np.ndarray) -> np.ndarray:
        """Return the probability that the level (motor = 1) is at most `level`, shape (...)."""
        return self.each_at_most(level) @ self.weights

    def each_at_most(self, level: float | np.ndarray) -> np.ndarray:
        """Return the same by each model alone, shape (..., models)."""
        from scipy.special import stdtr

        t = (np.log(np.asarray(level, dtype=float))[..., None] - self.centre) / self.scale
        return stdtr(self.degrees_of_freedom, t)

    def quantile(self, share: float | Sequence[float]) -> np.ndarray:
        """Return the level that a share of the distribution lies below, shape (...), to 1e-9 of it.

        Of n shares, shape (n, ...).
        """
        from scipy.special import stdtrit

        shares = np.asarray(share, dtype=float)
        shares = shares.reshape(shares.shape + (1,) * (self.centre.ndim - 1))
        each = self.centre + self.scale * stdtrit(self.degrees_of_freedom, shares[..., None])
        low, high = each.min(axis=-1), each.max(axis=-1)
        widest = float(np.nanmax(high - low, initial=0.0))
        for _ in range(math.ceil(math.log2(max(widest / 1e-9, 1.0)))):
            middle = (low + high) / 2.0
            below = self.at_most(np.exp(middle)) < shares
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.exp((low + high) / 2.0)

    @property
    def range(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The level's 10 %, 50 % and 90 % points, each of shape (...)."""
        low, high = (percent / 100 for percent in PERCENT)
        return tuple(self.quantile((low, 0.5, high)))


@dataclass(frozen=True)
class Stack:
    """Models with their weights, constants and predictive scales from a measured table; no weight is zero.

    `left_out` names the models that were asked for and have no weight.
    """

    models: tuple[str, ...]
    weights: np.ndarray
    degrees_of_freedom: np.ndarray
    scale: np.ndarray
    constants: tuple[Mapping[str, float], ...]
    left_out: tuple[str, ...] = ()

    def predictive(self, units: Units) -> Predictive:
        """Return the distribution of further units' ln level."""
        levels = [edge_levels(units, model, own) for model, own in zip(self.models, self.constants, strict=True)]
        with np.errstate(divide="ignore", invalid="ignore"):
            centre = np.log(np.stack(np.broadcast_arrays(*levels), axis=-1))
        return Predictive(
            self.models, self.weights, self.degrees_of_freedom, centre, np.broadcast_to(self.scale, centre.shape)
        )


@dataclass(frozen=True)
class LabStack:
    """A lab's own models with their weights; what it was fitted to gives centre and scale of each unit."""

    fit: LabFit
    models: tuple[str, ...]
    weights: np.ndarray

    def predictive(self, units: Units) -> Predictive:
        """Return the distribution of further units' ln level in the lab."""
        centres, scales = [], []
        for model in self.models:
            one = self.fit.model[model]
            with np.errstate(divide="ignore", invalid="ignore"):
                centres.append(np.log(edge_levels(units, model, one.constants)))
            g = gradient(model, units, one.constants)
            covariance = np.array(one.covariance)
            scales.append(one.discrepancy * np.sqrt(1.0 + np.einsum("...i,ij,...j", g, covariance, g)))
        df = np.array([self.fit.model[model].degrees_of_freedom for model in self.models])
        return Predictive(self.models, self.weights, df, np.stack(centres, axis=-1), np.stack(scales, axis=-1))


def stack_of(
    models: Sequence[str] | None = None, fit: LabFit | None = None, moduli: Moduli = "dynamic"
) -> Stack | LabStack:
    """Return the models of a lab's `fit`, without one those of the paper's nine levels by such moduli.

    Raises Refusal as `stack`.
    """
    if fit is None:
        return stack(models or STACKED, moduli=moduli)
    weights = {model: w for model, w in lab_weights(fit, models or MODELS).items() if w > 0}
    return LabStack(fit, tuple(weights), np.array(list(weights.values())))


def stack(models: Sequence[str] = STACKED, table: MeasuredTable | None = None, moduli: Moduli = "dynamic") -> Stack:
    """Stack models over a measured table, the paper's nine levels by such moduli where none is given.

    Raises Refusal for a name that is no closed form, for one that is there twice, and for an empty list.
    """
    check_models(models, STACKED)
    return _stacked_on_paper(tuple(models), moduli) if table is None else _stacked(tuple(models), table)


def lab_weights(fit: LabFit, models: Sequence[str] = MODELS) -> dict[str, float]:
    """Return the models' weights in a lab, of a fit that stores scores only: ln(left-out factor)^-n, summing to one.

    n is the number of units behind the fit. That is the weight by the left-out likelihood of errors of that mean size
    (pseudo-BMA in the source above). Raises Refusal for a model that the fit does not have.
    """
    check_models(models, fit.model)
    logs = []
    for model in models:
        one = fit.model[model]
        count = one.degrees_of_freedom + len(one.constants)
        logs.append(-count * np.log(max(np.log(max(one.left_out, 1.0)), 1e-6)))
    weights = np.exp(np.array(logs) - max(logs))
    weights = np.where(weights < _LEAST_WEIGHT * weights.sum(), 0.0, weights)
    return {m: float(w) for m, w in zip(models, weights / weights.sum(), strict=True)}


def predictive_of(
    variants: Sequence[EstimateInput], models: Sequence[str] | None = None, fit: LabFit | None = None
) -> Predictive:
    """Return the distribution of ln level of variants of one number of layers, at the middle of their inputs' ranges.

    By a lab's `fit` its own constants and scales; without one by the paper's nine levels and the moduli that the
    variants have. Raises Refusal as `stack`.
    """
    return stack_of(models, fit, variants[0].moduli).predictive(stacked(variants))


@cache
def _stacked_on_paper(models: tuple[str, ...], moduli: Moduli) -> Stack:
    return _stacked(models, measured_table(moduli))


def _stacked(models: tuple[str, ...], table: MeasuredTable) -> Stack:
    count = table.levels.size
    forms = fitted_forms()
    df = np.array([count - len(forms[model].names) for model in models])
    residuals = np.stack([left_out_residuals(model, table) for model in models], axis=-1)
    scale = np.sqrt(np.sum(residuals**2, axis=0) / (count - 1))
    weights = stacking_weights(_log_density(residuals / scale, df) - np.log(scale))
    kept = np.flatnonzero(weights)
    everyone = np.ones(count)
    constants = [
        dict(zip(forms[models[k]].names, forms[models[k]].fit(table, everyone).tolist(), strict=True)) for k in kept
    ]
    return Stack(
        models=tuple(models[k] for k in kept),
        weights=weights[kept],
        degrees_of_freedom=df[kept],
        scale=scale[kept],
        constants=tuple(constants),
        left_out=tuple(model for model, weight in zip(models, weights, strict=True) if not weight),
    )


def left_out_residuals(model: str, table: MeasuredTable) -> np.ndarray:
    """Return ln(measured/predicted) of each unit, predicted by constants fitted without it."""
    return np.log(table.levels / np.diagonal(compared()[model].fit(table, all_but_one(table))))


def stacking_weights(log_densities: np.ndarray) -> np.ndarray:
    """Return the weights (K,) that maximise sum_i log sum_k w_k p_ik, of log densities (units, K); least ones are zero.

    By expectation and maximisation, which raises a concave sum at each step.
    """
    density = np.exp(log_densities - log_densities.max(axis=1, keepdims=True))
    weights = np.full(density.shape[1], 1.0 / density.shape[1])
    for _ in range(_STEPS):
        shares = density * weights
        after = np.mean(shares / shares.sum(axis=1, keepdims=True), axis=0)
        settled = np.max(np.abs(after - weights)) < _SETTLED
        weights = after
        if settled:
            break
    weights = np.where(weights < _LEAST_WEIGHT, 0.0, weights)
    return weights / weights.sum()


def _log_density(t: np.ndarray, df: np.ndarray) -> np.ndarray:
    """Return the logarithm of Student's density at t."""
    from scipy.special import gammaln

    norm = gammaln((df + 1) / 2) - gammaln(df / 2) - np.log(df * np.pi) / 2
    return norm - (df + 1) / 2 * np.log1p(t**2 / df)


def check_models(models: Sequence[str], known: Sequence[str] | Mapping[str, object], field: str = "models") -> None:
    """Raise Refusal for a name that is not known, for one that is there twice, and for an empty list."""
    if not models:
        raise Refusal(field, [], "at least one model is needed", next(iter(known)))
    for i, model in enumerate(models):
        if model not in known:
            raise unknown_name(f"{field}.{i}", model, known)
        if model in models[:i]:
            raise Refusal(f"{field}.{i}", model, "is there twice")

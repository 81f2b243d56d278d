"""The range of a new unit's level, by the paper's nine units or by a lab's stored fit.

By a lab's fit a new unit's ln level is Student-t distributed: `scale`^2 = model_error^2 (1 + g' C g). g is the gradient
of the model's ln level in the logarithms of its constants, and C their covariance over model_error^2.

The range is a Student-t distribution of ln level about the model that leads. Its scale is the standard deviation of the
leading model's left-out residuals (of a lab's fit: the fit's own). It grows with everything that no measured unit had.
The residual of measured units that are near enters with half its weight, less the farther they are.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, Struct

from unitcad.attenuation.edge.closed_form import Units, borders
from unitcad.attenuation.edge.measured import (
    COORDINATES,
    LENGTHS,
    Lengths,
    MeasuredTable,
    Moduli,
    coordinates,
    lengths,
    measured_table,
    nominal,
    stack_inputs,
)
from unitcad.attenuation.edge.models import (
    BASELINE,
    COMPARED,
    MODELS,
    RULE,
    assessments,
    edge_levels,
    leader,
    leave_one_out_logs,
    stored,
)
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue.entries import between
from unitcad.lean_scipy import special
from unitcad.text import some

Positive = Annotated[float, between(1e-9, 1e9)]
PERCENT = (10, 90)
"""Ends of a predictive range."""


class ModelFit(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A model fitted to a lab's units: constants, their stored values, and the predictive.

    `model_error`: standard deviation of a unit's ln level about the model. `covariance`: of the constants' logarithms,
    in the order of `constants`, over model_error^2. `leave_one_out`: the typical factor error.
    `coverage`: units in their 80 % range.
    `at_bound`: the constant that the search left on its bound, None if the units determine all.
    """

    constants: dict[str, Positive]
    low: dict[str, Positive]
    high: dict[str, Positive]
    stored: dict[str, Positive]
    degrees_of_freedom: Annotated[int, between(1, 100000)]
    model_error: Annotated[float, between(1e-6, 10)]
    covariance: list[list[Annotated[float, between(-1e9, 1e9)]]]
    leave_one_out: Positive
    leave_one_out_low: Positive
    leave_one_out_high: Positive
    own_leave_one_out: Positive | None = None
    own_by_stored: Positive | None = None
    against_baseline: float | None = None
    against_baseline_error: float | None = None
    against_baseline_p: float | None = None
    coverage: str = ""
    at_bound: str | None = None


class OwnLevel(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A unit's level as the lab measured it, with its 95 % interval; `key` is its `unit_key`.

    `place`: its `measured.COORDINATES`; `residual`: ln(measured/predicted) by the model that leads.
    """

    unit: str
    key: str
    value: Positive
    low: Positive | None = None
    high: Positive | None = None
    frequency_hz: Positive
    place: Annotated[list[float], Meta(min_length=len(COORDINATES), max_length=len(COORDINATES))]
    residual: float
    source: str = ""


class InputFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A file that the fit read."""

    file: str
    sha256: str


class LabFit(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A lab's fit: `units` of its own, with or without the paper's nine, by which moduli; `leads`: `models.leader`.

    `between_labs`: standard deviation between labs of a constant's logarithm over that between units of one lab.
    """

    format: Annotated[int, between(1, 1)]
    name: Annotated[str, Meta(min_length=1, max_length=100)]
    units: Annotated[int, between(1, 100000)]
    moduli: Literal["small-strain", "quasi-static"]
    include_paper_units: bool
    between_labs: Annotated[float, between(0, 100)]
    seed: int
    leads: Literal["rule", "published", "corrected", "divider"]
    model: dict[str, ModelFit]
    measured: Annotated[list[OwnLevel], Meta(min_length=1)]
    input: list[InputFile] = []

    def constants(self, model: str) -> dict[str, float]:
        """Return a model's constants. Raises KeyError for one that it does not have."""
        return self.model[model].constants


def fault(fit: LabFit) -> tuple[str, Any, str] | None:
    """Return (field, value, limit) of the first thing wrong with a fit that its types do not show."""
    for model in (*MODELS, BASELINE):
        names = set(COMPARED[model].names)
        if model not in fit.model:
            return f"model.{model}", None, "is required"
        one = fit.model[model]
        if set(one.constants) != names:
            return f"model.{model}.constants", some(sorted(one.constants)), f"must be {' and '.join(sorted(names))}"
        matrix = one.covariance
        if [len(row) for row in matrix] != [len(names)] * len(names):
            return f"model.{model}.covariance", len(matrix), f"needs {len(names)} rows of as many numbers"
        # A file has six digits; a combination of constants that the units do not determine has eigenvalues near 0.
        size = float(np.max(np.abs(matrix)))
        symmetric = np.allclose(matrix, np.transpose(matrix), rtol=1e-5, atol=1e-5 * size)
        if not symmetric or np.linalg.eigvalsh(matrix).min() < -1e-5 * size:
            return f"model.{model}.covariance", None, "is no covariance: not symmetric, or negative in a direction"
    return None


def predictive(fit: LabFit, model: str, variant: EstimateInput) -> tuple[int, float, float]:
    """Return (degrees of freedom, centre, scale) of the Student-t distribution of a variant's ln level in the lab.

    At the middle of the inputs' ranges, for a unit like the measured ones; centre and scale are NaN if an input is not
    known.
    """
    units, one = nominal(variant), fit.model[model]
    centre = float(np.log(edge_levels(units, model, one.constants))[0])
    own = np.array([one.constants[name] for name in COMPARED[model].names])
    g = COMPARED[model].gradient(units, own)[0]
    scale = one.model_error * float(np.sqrt(1.0 + g @ np.array(one.covariance) @ g))
    return one.degrees_of_freedom, centre, scale if np.isfinite(centre) else float("nan")


def quantiles(df: int, centre: float, scale: float) -> tuple[float, ...]:
    """Return the levels at `PERCENT` of a predictive of ln level."""
    return tuple(float(np.exp(centre + scale * special.stdtrit(df, percent / 100))) for percent in PERCENT)


def predictive_block(fit: LabFit, model: str, variant: EstimateInput, reason: str) -> dict[str, Any]:
    """Return a variant's predictive as data: P10, P90, and the distribution of ln level; `reason` says why not."""
    df, centre, scale = predictive(fit, model, variant)
    if not np.isfinite(centre):
        return {"p10": None, "p90": None, "reason": reason}
    low, high = quantiles(df, centre, scale)
    return {
        "p10": low,
        "p90": high,
        "degrees_of_freedom": df,
        "centre": centre,
        "scale": scale,
        "model_error": fit.model[model].model_error,
        "what": "where a new unit of this kind is expected in this lab: Student-t of ln level, at the inputs' middle",
    }


def error_block(fit: LabFit, model: str) -> dict[str, Any]:
    """Return a model's error by a fit, as factors: leave-one-out, over all units and over the lab's own.

    `own_by_stored`: the own units' by the stored constants, without the fit. `baseline`: of the means of four classes.
    """
    one = fit.model[model]
    return {
        "leave_one_out": {
            "geometric_mean": one.leave_one_out,
            "low": one.leave_one_out_low,
            "high": one.leave_one_out_high,
        },
        "own_leave_one_out": one.own_leave_one_out,
        "own_by_stored": one.own_by_stored,
        "coverage": one.coverage,
        BASELINE: fit.model[BASELINE].leave_one_out,
    }


def unit_key(variant: EstimateInput) -> str:
    """Return the identity of a unit: a hash of design, silicones and lengths; not of tissue or frequency."""
    geometry = variant.geometry
    lengths = [
        geometry.cavity_radius,
        geometry.core_height,
        geometry.motor_radius,
        geometry.motor_height,
        *(length for layer in geometry.layers for length in (layer.outer_radius, layer.top, layer.cap)),
    ]
    names = [layer.material for layer in variant.layers]
    text = json.dumps([variant.design, names, [f"{1e3 * length:.6f}" for length in lengths]])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def own_block(fit: LabFit, variant: EstimateInput) -> list[dict[str, Any]]:
    """Return the lab's own measurements of this unit."""
    key = unit_key(variant)
    return [
        {name: getattr(one, name) for name in ("unit", "value", "low", "high", "frequency_hz", "source")}
        for one in fit.measured
        if one.key == key
    ]


LENGTH_SLOPES = np.array([1.2, 0.5, 0.5, 0.5, 1.0, 0.5, 0.5, 0.5, 0.5])
MODULUS_SLOPE = 1.0
"""Standard deviations of d ln level / d ln input without measurement, of the first `COORDINATES`: assumed.

Finite elements give 0.1 for walls and caps, up to 1.2 for the diameter, and factors of 0.2 to 3 from 60 to 200 Hz. The
two measured pairs that differ in one modulus give +0.7 and +1.6.
"""
OF_THE_KIND = 0.5
"""Part of a residual's variance that belongs to the kind of unit, not to cast and reading: assumed."""
_KIND_LENGTHS = np.array([1.0] * LENGTHS + [0.1, 0.1, 0.3])
"""Differences of the coordinates at which a residual counts exp(-1/2): units of other silicones are other kinds."""
_EDGE = 0.05
"""A border that counts more than this and less than 1 less this has a range that holds both ends."""


@dataclass(frozen=True)
class Predictive:
    """Student-t distributions of ln level of any number of units, shape (...); NaN if an input is not known.

    Half of each is below `centre`, with the scale `below`, half above it with the scale `above`.
    """

    degrees_of_freedom: int
    centre: np.ndarray
    below: np.ndarray
    above: np.ndarray

    def at_most(self, level: float | np.ndarray) -> np.ndarray:
        """Return the probability that the level (motor = 1) is at most `level`, shape (...)."""
        away = np.log(np.asarray(level, dtype=float)) - self.centre
        return special.stdtr(self.degrees_of_freedom, away / np.where(away < 0, self.below, self.above))

    def quantile(self, share: float) -> np.ndarray:
        """Return the level that a share of the distribution lies below, shape (...)."""
        scale = self.below if share < 0.5 else self.above
        return np.exp(self.centre + scale * special.stdtrit(self.degrees_of_freedom, share))

    @property
    def range(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The level's 10, 50 and 90 % points, each of shape (...)."""
        low, high = (percent / 100 for percent in PERCENT)
        return self.quantile(low), self.quantile(0.5), self.quantile(high)


@dataclass(frozen=True)
class Lead:
    """The model that leads, with its constants, and the measured units behind it.

    `places`: coordinates of the measured units; `residuals`: ln(measured/model) of the first of them. `moduli`: ln of
    the least and the largest modulus among them, Pa. `covariance`: of the constants' logarithms over sigma^2; None if
    sigma has their error in it.
    """

    model: str
    constants: Mapping[str, float]
    degrees_of_freedom: int
    sigma: float
    places: np.ndarray
    residuals: np.ndarray
    moduli: tuple[float, float]
    covariance: np.ndarray | None = None

    @np.errstate(all="ignore")  # unknown inputs are NaN; a legal extreme may overflow
    def predictive(self, units: Units, of: Lengths) -> Predictive:
        """Return the distribution of further units' ln level."""
        model = COMPARED[self.model]
        own = np.array([self.constants[name] for name in model.names])
        at = coordinates(units, of)
        kinds = self.places[: len(self.residuals)]
        near = _kernel(at, kinds)
        weights = np.linalg.solve(_kernel(kinds, kinds) + (1.0 - OF_THE_KIND) * np.eye(len(kinds)), near.T)
        kept = 1.0 - np.einsum("ij,ji->i", near, weights)
        if self.covariance is not None:
            g = model.gradient(units, own)
            kept = kept + np.einsum("...i,ij,...j", g, self.covariance, g)
        variance = self.sigma**2 * kept + self._far(at)
        below, above = (np.sqrt(variance + more) for more in self._unmeasured_borders(units))
        centre = model.logs(units, own) + weights.T @ self.residuals
        return Predictive(self.degrees_of_freedom, centre, below, above)

    def _far(self, at: np.ndarray) -> np.ndarray:
        """Return the variance added by lengths, frequency and moduli outside the measured ones."""
        # A place at a time: a search has many rows.
        places = np.unique(self.places, axis=0)[:, :LENGTHS]
        apart = [np.sum((LENGTH_SLOPES * (at[:, :LENGTHS] - own)) ** 2, axis=-1) for own in places]
        away = np.min(apart, axis=0)
        ends = at[:, LENGTHS : LENGTHS + 2]
        outside = np.sum((ends - np.clip(ends, *self.moduli)) ** 2, axis=-1)
        return away + MODULUS_SLOPE**2 * outside

    def _unmeasured_borders(self, units: Units) -> tuple[np.ndarray, np.ndarray]:
        """Return the variance below and above the centre added by borders that no measured unit had.

        The rule between equal moduli and the least measured ratio: its range holds both ends. Each border but the
        strongest may count or not: half its effect.
        """
        counts = borders(units)
        effect = (units.passes * -math.log(stored()[RULE]["q"]))[..., None]
        size = np.sort(np.abs(counts), axis=-1)[..., :-1]
        either = np.sum((effect * size / 2.0) ** 2, axis=-1)
        if self.model != RULE:
            return either, either
        soft = np.maximum(counts, 0.0)
        effect = effect * np.minimum(1.0, np.minimum(soft, 1.0 - soft) / _EDGE)
        end = special.stdtrit(self.degrees_of_freedom, PERCENT[1] / 100)
        down, up = (np.sum((effect * far / end) ** 2, axis=-1) for far in (1.0 - soft, soft))
        return either + down, either + up


def _kernel(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the correlation of residuals between units at coordinates (n, 12) and (m, 12), shape (n, m)."""
    apart = [np.sum(((one - own) / _KIND_LENGTHS) ** 2, axis=-1) for own in other]
    return OF_THE_KIND * np.exp(-0.5 * np.reshape(apart, (len(other), len(one))).T)


def lead_of(moduli: Moduli = "small-strain", fit: LabFit | None = None) -> Lead:
    """Return the leading model: by a lab's fit, or on the paper's nine units by such moduli."""
    return _of_paper(moduli) if fit is None else _of_lab(fit)


def predictive_of(variants: Sequence[EstimateInput], fit: LabFit | None = None) -> Predictive:
    """Return the distribution of ln level of variants of one number of layers, at their inputs' middle values."""
    return lead_of(variants[0].moduli, fit).predictive(stack_inputs(variants), lengths(variants))


@cache
def _of_paper(moduli: Moduli) -> Lead:
    found = assessments(moduli)
    return lead_on(measured_table(moduli), leader({name: one.leave_one_out_errors for name, one in found.items()}))


def lead_on(table: MeasuredTable, name: str) -> Lead:
    """Return a model as the leading one on the paper's units, or on some of them."""
    model, everyone = COMPARED[name], np.ones((1, len(table.names)))
    constants = model.fit(table, everyone)[0]
    off = leave_one_out_logs(name, table)
    e = np.concatenate([units.youngs_modulus.ravel() for units in table.inputs])
    return Lead(
        model=name,
        constants=dict(zip(model.names, constants.tolist(), strict=True)),
        degrees_of_freedom=off.size - len(model.names),
        sigma=float(np.sqrt(np.sum(off**2) / (off.size - 1))),
        places=np.concatenate([_paper_place(units) for units in table.inputs]),
        residuals=np.log(table.levels / model.levels(table, everyone)[0]),
        moduli=(float(np.log(e.min())), float(np.log(e.max()))),
    )


def _paper_place(units: Units) -> np.ndarray:
    """Return the coordinates of a unit of the paper, (1, 12): a control's of unknown design are alike in both."""
    counts = borders(units)[:1].sum(axis=-1)
    ends = np.log(units.youngs_modulus[0, [0, -1]])
    return np.array([[*[0.0] * LENGTHS, *ends, float(units.passes[0] * counts[0])]])


def _of_lab(fit: LabFit) -> Lead:
    one = fit.model[fit.leads]
    paper = _of_paper(fit.moduli)
    own = np.array([unit.place for unit in fit.measured])
    ends = own[:, LENGTHS : LENGTHS + 2]
    low, high = float(ends.min()), float(ends.max())
    if fit.include_paper_units:
        low, high = min(low, paper.moduli[0]), max(high, paper.moduli[1])
    return Lead(
        model=fit.leads,
        constants=one.constants,
        degrees_of_freedom=one.degrees_of_freedom,
        sigma=one.model_error,
        # The paper's units count as places; their residuals belong to another lab.
        places=np.concatenate([own, paper.places]) if fit.include_paper_units else own,
        residuals=np.array([unit.residual for unit in fit.measured]),
        moduli=(low, high),
        covariance=np.array(one.covariance),
    )


@cache
def coverage(moduli: Moduli = "small-strain") -> int:
    """Return how many of the nine measured units lie in the leading model's 80 % range, predicted without the unit."""
    table, name = measured_table(moduli), _of_paper(moduli).model
    count = 0
    for i in range(len(table.names)):
        lead, units = lead_on(table.without(i), name), table.inputs[i]
        model, own = COMPARED[name], np.array(list(lead.constants.values()))
        off = abs(float(np.log(table.levels[i]) - np.mean(model.logs(units, own))))
        alone = Predictive(lead.degrees_of_freedom, np.zeros(()), np.array(lead.sigma), np.array(lead.sigma))
        count += off <= float(np.log(alone.quantile(PERCENT[1] / 100)))
    return count

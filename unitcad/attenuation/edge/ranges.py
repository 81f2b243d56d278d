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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, Struct

from unitcad.attenuation.edge.closed_form import Units, borders
from unitcad.attenuation.edge.contrast import counts
from unitcad.attenuation.edge.measured import (
    CLASSES,
    COORDINATES,
    LENGTH_NAMES,
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
    edge_levels,
    stored,
)
from unitcad.attenuation.edge.scores import LeadScore, scores
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue.entries import between
from unitcad.catalogue.moduli import method_spread
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

    `place`: its `measured.COORDINATES`; `residual`: ln(measured/predicted) by the model that leads; `features`: names
    of those that no unit of the paper had; `lab`: the other lab that measured it, None for the fit's own.
    """

    unit: str
    key: str
    value: Positive
    low: Positive | None = None
    high: Positive | None = None
    frequency_hz: Positive
    place: Annotated[list[float], Meta(min_length=len(COORDINATES), max_length=len(COORDINATES))]
    residual: float
    features: list[str] = []
    lab: str | None = None
    source: str = ""


class InputFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A file that the fit read."""

    file: str
    sha256: str


class LabFit(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A lab's fit: `units` of its own, with or without the paper's nine, by which moduli; `leads`: `models.leader`.

    `between_labs`, `between_batches`: expected standard deviation of ln level between labs and between batches, over
    that between units.
    """

    format: Annotated[int, between(1, 1)]
    name: Annotated[str, Meta(min_length=1, max_length=100)]
    units: Annotated[int, between(0, 100000)]
    moduli: Literal["small-strain", "quasi-static"]
    include_paper_units: bool
    between_labs: Annotated[float, between(0, 100)]
    between_batches: Annotated[float, between(0, 100)]
    seed: int
    leads: Literal["rule", "published", "corrected"]
    model: dict[str, ModelFit]
    measured: Annotated[list[OwnLevel], Meta(min_length=1)]
    input: list[InputFile] = []

    @property
    def own(self) -> list[OwnLevel]:
        """The levels that the fit's own lab measured."""
        return [one for one in self.measured if one.lab is None]

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
        for one in fit.own
        if one.key == key
    ]


LENGTH_SLOPES = np.array([1.2, 0.5, 0.5, 0.5, 1.0, 0.5, 0.5, 0.5, 0.5])
"""Standard deviations of d ln level / d ln input without measurement, of the first `COORDINATES`: assumed.

Finite elements give 0.1 for walls and caps, up to 1.2 for the diameter, and factors of 0.2 to 3 from 60 to 200 Hz.
"""
FEATURES: dict[str, Callable[[float], float]] = {
    "shape of its own": lambda size: 0.5,
    "axial drive": lambda size: 1.8,
    "tissue": lambda size: 0.6 * size,
    "film on the skin side": lambda mm: 0.17 * mm,
    "silicone round the motor": lambda size: 0.2,
    "lip": lambda mm: 0.4 * mm,
    "draft": lambda degrees: math.tan(math.radians(degrees)),
    "wires in place of a circuit": lambda size: 0.0,
    "missing circuit": lambda size: 0.0,
}
"""Standard deviation of ln level that a feature adds, by its size.

By finite elements: 80 % of |ln(level with / level without)|, over the unknowns of six units, both readings and both
drives, over the same quantile of a normal distribution. 1.81 axial over flat; 0.16 for a gel of 50 kPa, whose ln
compliance is 0.28 from the forearm's; 0.07, 0.10, 0.18 and 0.31 for a film of 0.3, 0.5, 1 and 2 mm; 0.20 for a filled
ring. Assumed: a lip of 0.5 mm as a filled ring, a draft as thicker walls, a shape of its own as walls that differ by a
factor e. A missing circuit adds nothing: the paper does not say how its own stiffens the unit, nor whether it does.
"""
OF_THE_KIND = 0.5
"""Part of a residual's variance that belongs to the kind of unit, not to cast and reading: assumed."""
_PASSES_LENGTH = 0.3


@cache
def _kind_lengths() -> np.ndarray:
    """Return differences of the coordinates at which a residual counts exp(-1/2): other silicones are other kinds.

    Two silicones are told apart by the scatter of one method's modulus about its true value.
    """
    reading = method_spread() / math.sqrt(2.0)
    return np.array([1.0] * LENGTHS + [reading, reading, _PASSES_LENGTH])


@dataclass(frozen=True)
class Predictive:
    """Student-t distributions of ln level of any number of units, shape (...); NaN if an input is not known."""

    degrees_of_freedom: int
    centre: np.ndarray
    scale: np.ndarray

    def at_most(self, level: float | np.ndarray) -> np.ndarray:
        """Return the probability that the level (motor = 1) is at most `level`, shape (...)."""
        away = np.log(np.asarray(level, dtype=float)) - self.centre
        return special.stdtr(self.degrees_of_freedom, away / self.scale)

    def quantile(self, share: float) -> np.ndarray:
        """Return the level that a share of the distribution lies below, shape (...)."""
        return np.exp(self.centre + self.scale * special.stdtrit(self.degrees_of_freedom, share))

    @property
    def range(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The level's 10, 50 and 90 % points, each of shape (...)."""
        low, high = (percent / 100 for percent in PERCENT)
        return self.quantile(low), self.quantile(0.5), self.quantile(high)


@dataclass(frozen=True)
class Lead:
    """The model that leads, with its constants, and the measured units behind it.

    `places`: coordinates of the measured units; `residuals`: ln(measured/model) of the first of them. `silicones`: the
    least and the largest place of a silicone among them; `contrast`: the largest difference between neighbours.
    `common_slope`, `contrast_slope`: see `LeadScore`. `features`: names of those that some measured unit had.
    `covariance`: of the constants' logarithms over sigma^2; None if sigma has their error in it.
    """

    model: str
    constants: Mapping[str, float]
    degrees_of_freedom: int
    sigma: float
    places: np.ndarray
    residuals: np.ndarray
    silicones: tuple[float, float]
    contrast: float
    common_slope: float
    contrast_slope: float
    features: frozenset[str] = frozenset()
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
        added = sum(self.unmeasured(units, of).values())
        centre = model.logs(units, own) + weights.T @ self.residuals
        return Predictive(self.degrees_of_freedom, centre, np.sqrt(self.sigma**2 * kept + added))

    def unmeasured(self, units: Units, of: Lengths) -> dict[str, np.ndarray]:
        """Return the variance of ln level that each input adds that no measured unit had, by its name."""
        at = coordinates(units, of)[:, :LENGTHS]
        # A place at a time: a search has many rows.
        apart = np.array([(LENGTH_SLOPES * (at - own)) ** 2 for own in np.unique(self.places, axis=0)[:, :LENGTHS]])
        nearest = np.argmin(apart.sum(axis=-1), axis=0)
        away = apart[nearest, np.arange(len(at))]
        found: dict[str, np.ndarray] = {}
        for i, name in enumerate(LENGTH_NAMES):
            found[name] = found.get(name, 0.0) + away[:, i]
        for name in {feature.name for own in set(of.features) for feature in own} - self.features:
            sizes = [sum(feature.size for feature in own if feature.name == name) for own in of.features]
            found[name] = np.array([FEATURES[name](size) ** 2 if size else 0.0 for size in sizes])
        return {**found, "silicones": self._silicones(units), "number of layers": self._more_layers(units)}

    def _silicones(self, units: Units) -> np.ndarray:
        """Return the variance of silicones that no measured unit had.

        Below the measured difference a border counts or not: half of its effect is in the range if both are as likely.
        """
        middle = units.place.mean(axis=-1)
        variance = (self.common_slope * (middle - np.clip(middle, *self.silicones))) ** 2
        apart = np.diff(units.place, axis=-1)
        if not apart.shape[-1]:
            return variance
        beyond = np.maximum(np.max(np.abs(apart), axis=-1) - self.contrast, 0.0)
        variance = variance + (self.contrast_slope * beyond) ** 2
        return variance + np.sum(self._doubtful(units) ** 2, axis=-1)

    def _doubtful(self, units: Units) -> np.ndarray:
        """Return the standard deviation of ln level of each border that may count or not, shape (..., N - 1)."""
        if self.model != RULE:
            return np.zeros((*units.place.shape[:-1], units.place.shape[-1] - 1))
        share = counts(units.place, units.doubt)
        return self._effect(units) * np.minimum(share, 1.0 - share)

    def _more_layers(self, units: Units) -> np.ndarray:
        """Return the variance, on top of the silicones', of borders that no measured unit had.

        Each but the strongest may count or not, so that half of its effect is in the range.
        """
        found, doubtful = borders(units), self._doubtful(units)
        stiff = math.log(stored()[BASELINE][CLASSES[1]] / stored()[BASELINE][CLASSES[0]]) / self._half_width
        half = np.maximum(found, 0.0) * self._effect(units) / 2.0 + np.maximum(-found, 0.0) * stiff
        more = np.maximum(half**2 - doubtful**2, 0.0)
        return more.sum(axis=-1) - more.max(axis=-1, initial=0.0)

    @property
    def _half_width(self) -> float:
        """Half the width of a range in standard deviations."""
        return float(special.stdtrit(self.degrees_of_freedom, PERCENT[1] / 100))

    def _effect(self, units: Units) -> np.ndarray:
        """Return the standard deviation of ln level at which a range is as wide as twice a border's effect."""
        return (units.passes * -math.log(stored()[RULE]["q"]))[..., None] / self._half_width


def _kernel(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the correlation of residuals between units at coordinates (n, 12) and (m, 12), shape (n, m)."""
    apart = [np.sum(((one - own) / _kind_lengths()) ** 2, axis=-1) for own in other]
    return OF_THE_KIND * np.exp(-0.5 * np.reshape(apart, (len(other), len(one))).T)


def lead_of(moduli: Moduli = "small-strain", fit: LabFit | None = None) -> Lead:
    """Return the leading model: by a lab's fit, or on the paper's nine units by such moduli."""
    return _of_paper(moduli) if fit is None else _of_lab(fit)


def predictive_of(variants: Sequence[EstimateInput], fit: LabFit | None = None) -> Predictive:
    """Return the distribution of ln level of variants of one number of layers, at their inputs' middle values."""
    return lead_of(variants[0].moduli, fit).predictive(stack_inputs(variants), lengths(variants))


@cache
def _of_paper(moduli: Moduli) -> Lead:
    known = scores(moduli)
    return _lead(measured_table(moduli), known.lead.model, known.constants[known.lead.model], known.lead)


def lead_on(table: MeasuredTable, name: str) -> Lead:
    """Return a model as the leading one on the paper's units, or on some of them, fitted anew."""
    model, count = COMPARED[name], len(table.names)
    constants = dict(zip(model.names, model.fit(table, np.ones((1, count)))[0].tolist(), strict=True))
    out = np.diagonal(model.levels(table, ~np.eye(count, dtype=bool)))
    sigma = float(np.sqrt(np.sum(np.log(table.levels / out) ** 2) / (count - 1)))
    residuals = np.log(table.levels / model.levels(table, np.ones((1, count)))[0]).tolist()
    alone = [float(units.place[0, 0]) for units in table.inputs if units.place.shape[-1] == 1]
    common = sigma / math.sqrt(float(np.sum((np.array(alone) - np.mean(alone)) ** 2)))
    return _lead(table, name, constants, LeadScore(name, sigma, residuals, common, _contrast_slope(table), 0))


def _contrast_slope(table: MeasuredTable) -> float:
    """Return the root mean square of d ln level / d place over soft-inside units that differ in one silicone."""
    slopes = []
    for i, j in combinations(range(len(table.names)), 2):
        one, other = (table.inputs[row].place[0] for row in (i, j))
        soft = table.classes[i] == table.classes[j] >= 2
        if soft and table.designs[i] == table.designs[j] and np.count_nonzero(one != other) == 1:
            slopes.append(math.log(table.levels[j] / table.levels[i]) / float(np.sum(other - one)))
    return math.sqrt(float(np.mean(np.square(slopes)))) if slopes else math.nan


def _lead(table: MeasuredTable, name: str, constants: Mapping[str, float], score: LeadScore) -> Lead:
    every = np.concatenate([units.place.ravel() for units in table.inputs])
    apart = np.concatenate([np.diff(units.place, axis=-1).ravel() for units in table.inputs])
    return Lead(
        model=name,
        constants=constants,
        degrees_of_freedom=len(table.names) - len(constants),
        sigma=score.sigma,
        places=np.concatenate([_paper_place(units) for units in table.inputs]),
        residuals=np.array(score.residuals),
        silicones=(float(every.min()), float(every.max())),
        contrast=float(np.max(np.abs(apart))),
        common_slope=score.common_slope,
        contrast_slope=score.contrast_slope,
    )


def _paper_place(units: Units) -> np.ndarray:
    """Return the coordinates of a unit of the paper, (1, 12): a control's of unknown design are alike in both."""
    counted = borders(units)[:1].sum(axis=-1)
    return np.array([[*[0.0] * LENGTHS, *units.place[0, [0, -1]], float(units.passes[0] * counted[0])]])


def _of_lab(fit: LabFit) -> Lead:
    one = fit.model[fit.leads]
    paper = _of_paper(fit.moduli)
    # Residuals of other labs and of the paper have those labs' circumstances in them: their units are places only.
    known = [*fit.own, *(unit for unit in fit.measured if unit.lab is not None)]
    places = np.array([unit.place for unit in known])
    inside, outside = places[:, LENGTHS : LENGTHS + 2].T
    silicones = [float(inside.min()), float(inside.max()), float(outside.min()), float(outside.max())]
    contrast = float(np.max(np.abs(outside - inside)))
    if fit.include_paper_units:
        silicones.extend(paper.silicones)
        contrast = max(contrast, paper.contrast)
    return Lead(
        model=fit.leads,
        constants=one.constants,
        degrees_of_freedom=one.degrees_of_freedom,
        sigma=one.model_error,
        places=np.concatenate([places, paper.places]) if fit.include_paper_units else places,
        residuals=np.array([unit.residual for unit in fit.own]),
        silicones=(min(silicones), max(silicones)),
        contrast=contrast,
        common_slope=paper.common_slope,
        contrast_slope=paper.contrast_slope,
        features=frozenset(name for unit in fit.measured for name in unit.features),
        covariance=np.array(one.covariance),
    )


def held(table: MeasuredTable, name: str) -> list[bool]:
    """Return whether each measured unit lies in the model's 80 % range, predicted without the unit."""
    inside = []
    for i in range(len(table.names)):
        lead, units = lead_on(table.without(i), name), table.inputs[i]
        model, own = COMPARED[name], np.array(list(lead.constants.values()))
        off = abs(float(np.log(table.levels[i]) - np.mean(model.logs(units, own))))
        inside.append(bool(off <= lead.sigma * special.stdtrit(lead.degrees_of_freedom, PERCENT[1] / 100)))
    return inside

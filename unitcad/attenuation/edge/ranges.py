"""The range of a new unit's level: a Student-t distribution of ln level about the model that leads.

Its scale is the standard deviation of the leading model's left-out residuals (of a lab's fit: the fit's own). It grows
with everything that no measured unit had, and the residual of measured units that are near enters with half its
weight, less the farther they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import stdtr, stdtrit

from unitcad.attenuation.edge.closed_form import Units, borders
from unitcad.attenuation.edge.lab_fit import PERCENT, LabFit
from unitcad.attenuation.edge.measured_levels import MeasuredTable, Moduli, measured_table
from unitcad.attenuation.edge.models import COMPARED, RULE, assessments, leader, left_out_logs, stored
from unitcad.attenuation.edge.nearest import LENGTHS, Lengths, coordinates, lengths
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.attenuation.inputs import EstimateInput

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
        return stdtr(self.degrees_of_freedom, away / np.where(away < 0, self.below, self.above))

    def quantile(self, share: float) -> np.ndarray:
        """Return the level that a share of the distribution lies below, shape (...)."""
        scale = self.below if share < 0.5 else self.above
        return np.exp(self.centre + scale * stdtrit(self.degrees_of_freedom, share))

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

    def predictive(self, units: Units, of: Lengths) -> Predictive:
        """Return the distribution of further units' ln level."""
        with np.errstate(all="ignore"):  # unknown inputs are NaN; a legal extreme may overflow
            return self._predictive(units, of)

    def _predictive(self, units: Units, of: Lengths) -> Predictive:
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
        end = stdtrit(self.degrees_of_freedom, PERCENT[1] / 100)
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
    return lead_of(variants[0].moduli, fit).predictive(stacked(variants), lengths(variants))


@cache
def _of_paper(moduli: Moduli) -> Lead:
    found = assessments(moduli)
    return lead_on(measured_table(moduli), leader({name: one.left_out_errors for name, one in found.items()}))


def lead_on(table: MeasuredTable, name: str) -> Lead:
    """Return a model as the leading one on the paper's units, or on some of them."""
    model, everyone = COMPARED[name], np.ones((1, len(table.names)))
    constants = model.fit(table, everyone)[0]
    off = left_out_logs(name, table)
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
def held(moduli: Moduli = "small-strain") -> int:
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

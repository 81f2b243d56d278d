"""Models fitted to two campaigns, the paper's and a lab's, whose constants may differ: shrunk, judged, predictive.

A unit's ln level scatters about its model with the standard deviation sigma (the model error). Between campaigns the
logarithms of a model's constants scatter by `between_labs` times the information of a unit of the other campaign. The
likelihood of a campaign of n units then counts for another one with the weight 1/(n between_labs^2 + 1) a unit. That is
a power prior (Ibrahim and Chen, Statistical Science 15, 46, 2000). For a model that is linear in its constants it is
the conjugate normal prior centred at the other campaign's own fit. Nine units count as 0.9 of a lab's own if
between_labs is 1. sigma^2 has the conjugate inverse gamma's estimate, so a prediction is Student-t with units less
constants degrees of freedom. A unit measured with the standard error u of ln level counts 1/(1 + (u/sigma0)^2), sigma0
being the paper's own sigma.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtr

from unitcad.attenuation.edge.measured import MeasuredTable
from unitcad.attenuation.edge.models import Model
from unitcad.attenuation.edge.scoring import sign_flip_p

BETWEEN_LABS = 1.0
"""Assumed: another phantom, motor and axis shift a model as much as one unit scatters."""


@dataclass(frozen=True)
class Campaigns:
    """Units of two campaigns: which are the lab's own, and the standard error of each ln level (0: in sigma)."""

    table: MeasuredTable
    own: np.ndarray
    error: np.ndarray
    between_labs: float = BETWEEN_LABS

    def without(self, index: int) -> Campaigns:
        """Return the campaigns without one unit."""
        kept = np.arange(self.own.size) != index
        return replace(self, table=self.table.without(index), own=self.own[kept], error=self.error[kept])


@dataclass(frozen=True)
class Shrunk:
    """Constants for one campaign: values, covariance of their logarithms over sigma^2, sigma, degrees of freedom."""

    constants: np.ndarray
    covariance: np.ndarray
    sigma: float
    df: int


@dataclass(frozen=True)
class Judged:
    """A model with each unit left out, unit by unit: ln(predicted/measured), and the predictive of ln measured.

    `by_stored`: the errors by the constants of the paper's units alone, None without them.
    """

    errors: np.ndarray
    centre: np.ndarray
    scale: np.ndarray
    df: int
    own: np.ndarray
    by_stored: np.ndarray | None

    @property
    def score(self) -> float:
        """The geometric-mean factor."""
        return _factor(self.errors)

    @property
    def own_score(self) -> float:
        """The factor over the lab's own units."""
        return _factor(self.errors[self.own])

    @property
    def stored_score(self) -> float | None:
        """The same by the stored constants."""
        return None if self.by_stored is None else _factor(self.by_stored[self.own])

    @property
    def coverage(self) -> int:
        """How many units are in the middle 80 % of their prediction without them."""
        return int(np.sum(np.abs(stdtr(self.df, -self.errors / self.scale) - 0.5) <= 0.4))


def shrunk(model: Model, campaigns: Campaigns, own: bool = True) -> Shrunk:
    """Fit a model for the lab (`own`) or for the paper, the other campaign's units as prior.

    Raises ValueError if units are no more than the constants that they determine.
    """
    table, here = campaigns.table, campaigns.own == own
    logs, count = np.log(table.levels), table.levels.size
    precision = _precision(model, campaigns)
    there = int(np.sum(~here))
    power = 1.0 / (there * campaigns.between_labs**2 + 1.0)
    weights = np.where(here, precision, power * precision)
    constants = _fitted(model, table, weights)
    left = float(weights @ (logs - _logs(model, table, constants)) ** 2)
    if there:
        others = np.where(here, 0.0, precision)
        misfit = float(others @ (logs - _logs(model, table, _fitted(model, table, others))) ** 2)
        left += (1.0 - power) * misfit
    g = gradients(model, table, constants)
    df = count - int(np.linalg.matrix_rank(g))
    if df < 1:
        raise ValueError(f"{count} units fit no model of {count - df} constants")
    covariance = np.linalg.pinv(g.T @ (weights[:, None] * g), hermitian=True)
    return Shrunk(constants, covariance, float(np.sqrt(left / df)), df)


def judge(model: Model, campaigns: Campaigns) -> Judged:
    """Predict each unit by the constants of its campaign, fitted without it, and by only the paper's."""
    table, logs = campaigns.table, np.log(campaigns.table.levels)
    centre, scale, df = np.empty(logs.size), np.empty(logs.size), 1
    for i in range(logs.size):
        found = shrunk(model, campaigns.without(i), bool(campaigns.own[i]))
        gradient = gradients(model, table, found.constants)[i]
        df, centre[i] = found.df, _logs(model, table, found.constants)[i]
        scale[i] = found.sigma * np.sqrt(1.0 + gradient @ found.covariance @ gradient)
    scale = np.hypot(scale, campaigns.error)
    errors = centre - logs
    paper = ~campaigns.own
    by_stored = None
    if paper.any():
        by_stored = _logs(model, table, _fitted(model, table, paper.astype(float))) - logs
    return Judged(errors, centre, scale, df, campaigns.own, by_stored)


def paired_difference(judged: Judged, other: Judged) -> tuple[float, float, float]:
    """Return the mean difference of |ln(predicted/measured)| to another model's, its standard error, sign-flip p."""
    one, two = np.abs(judged.errors), np.abs(other.errors)
    differences = one - two
    error = float(differences.std(ddof=1) / np.sqrt(differences.size))
    return float(differences.mean()), error, sign_flip_p(one, two)


def _factor(errors: np.ndarray) -> float:
    return float(np.exp(np.mean(np.abs(errors))))


def _precision(model: Model, campaigns: Campaigns) -> np.ndarray:
    """Return 1/(1 + (u/sigma0)^2) of every unit, sigma0 of the units whose error is not known, or of all."""
    if not campaigns.error.any():
        return np.ones(campaigns.own.size)
    table = campaigns.table
    used = ~campaigns.own if np.sum(~campaigns.own) > len(model.names) else np.ones(campaigns.own.size, dtype=bool)
    weights = used.astype(float)
    left = np.log(table.levels) - _logs(model, table, _fitted(model, table, weights))
    sigma2 = float(weights @ left**2) / max(int(used.sum()) - len(model.names), 1)
    return sigma2 / (sigma2 + campaigns.error**2) if sigma2 > 0 else np.ones(campaigns.own.size)


def gradients(model: Model, table: MeasuredTable, constants: np.ndarray) -> np.ndarray:
    """Return d ln level / d ln constant of every unit, (units, constants)."""
    return table.mean(lambda units: model.gradient(units, constants))


def _logs(model: Model, table: MeasuredTable, constants: np.ndarray) -> np.ndarray:
    """Return ln level of every unit, (units,)."""
    return table.mean(lambda units: model.logs(units, constants))


def _fitted(model: Model, table: MeasuredTable, weights: np.ndarray) -> np.ndarray:
    return model.fit(table, weights[None])[0]

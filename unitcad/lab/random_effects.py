"""Models fitted to units of several labs and batches: level = model x lab x batch x unit.

ln level of unit i, of lab l and batch m, is x_i b + u_l + v_m + e_i. b are the logarithms of the model's constants, in
which every model is linear. u, v and e are normal with the standard deviations t, w and s. A unit measured with the
standard error r of its logarithm has s^2 (1 + (r/s0)^2), s0 being the scatter without it.

The ratios t/s and w/s are not estimated by one number, which few labs don't give. They have half Student-t priors
with 3 degrees of freedom and the medians `between_labs` and `between_batches` (Gelman, Bayesian Analysis 1, 515, 2006).
At each pair of a grid of both, the rest is solved exactly by Henderson's mixed-model equations (Biometrics 31, 423,
1975), b with a flat prior and s^2 with 1/s^2. The weight of a pair is its restricted likelihood. So there is no
sampling: the same input gives the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri, stdtr, stdtrit

from unitcad.attenuation.edge.measured import MeasuredTable
from unitcad.attenuation.edge.models import Model
from unitcad.attenuation.edge.scoring import sign_flip_p

BETWEEN_LABS = 1.0
"""Assumed: another phantom, motor and axis change a level as much as one unit scatters."""
BETWEEN_BATCHES = 1.0
"""Assumed: another batch changes a level as much as one unit scatters."""
OWN, PAPER = 0, 1
"""Numbers of the lab that the fit is for, and of the paper's; further labs count on."""
_FREEDOM = 3
_RATIOS = np.geomspace(0.05, 50.0, 14)
"""The grid of ratios over their priors' scales. Units can't tell smaller ones from 0; larger ones leave a lab alone."""
_NEARLY_ALL = 1.0 - 1e-9
_LEAST_VARIANCE = 1e-10
"""Of ln level: units that a model meets exactly have no scatter."""
_SHARES = 64
"""Steps of probability in the quantiles of a scatter."""
_ALONE = 1e-8
"""A unit that only itself determines has a leverage of 1 but for rounding."""


@dataclass(frozen=True)
class Campaigns:
    """Units of labs: the number of each one's lab and of its batch (-1: one of its own).

    `stored`: which units the stored constants are fitted to. `error`: standard error of ln level, 0 if it is in s.
    """

    table: MeasuredTable
    lab: np.ndarray
    batch: np.ndarray
    stored: np.ndarray
    error: np.ndarray
    between_labs: float = BETWEEN_LABS
    between_batches: float = BETWEEN_BATCHES

    @property
    def own(self) -> np.ndarray:
        """Which units are those of the lab that the fit is for."""
        return self.lab == OWN

    def without(self, index: int) -> Campaigns:
        """Return the campaigns without one unit."""
        kept = np.arange(self.lab.size) != index
        each = {name: getattr(self, name)[kept] for name in ("lab", "batch", "stored", "error")}
        return replace(self, table=self.table.without(index), **each)


@dataclass(frozen=True)
class Effect:
    """A factor on the level with its 90 % range."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class MixedFit:
    """A model for one lab: constants, covariance of their logarithms over sigma^2, sigma, degrees of freedom.

    `sigma`: standard deviation of ln level of units of further batches. `labs`: level of each other lab over this lab's,
    by its number. `batches`: level of each batch over the mean batch's. `scatter`: standard deviations of ln level between
    labs, mixes and units, with 90 % ranges; batches and units are one if no two units share a batch.
    """

    constants: np.ndarray
    covariance: np.ndarray
    sigma: float
    df: int
    labs: dict[int, Effect]
    batches: dict[int, Effect]
    scatter: dict[str, Effect]


@dataclass(frozen=True)
class Judged:
    """A model with each unit left out, unit by unit: ln(predicted/measured), and the predictive of ln measured.

    `by_stored`: the errors by the constants of the paper's units alone, None without them.
    """

    errors: np.ndarray
    centre: np.ndarray
    scale: np.ndarray
    df: np.ndarray
    own: np.ndarray
    by_stored: np.ndarray | None

    @property
    def score(self) -> float:
        """The geometric-mean factor."""
        return _factor(self.errors)

    @property
    def own_score(self) -> float | None:
        """The factor over the lab's own units, None without any."""
        return _factor(self.errors[self.own]) if self.own.any() else None

    @property
    def stored_score(self) -> float | None:
        """The same by the stored constants."""
        return None if self.by_stored is None or not self.own.any() else _factor(self.by_stored[self.own])

    @property
    def coverage(self) -> int:
        """How many units are in the middle 80 % of their prediction without them."""
        return int(np.sum(np.abs(stdtr(self.df, -self.errors / self.scale) - 0.5) <= 0.4))


def mixed_fit(model: Model, campaigns: Campaigns) -> MixedFit:
    """Fit a model for the lab `OWN`, which may have no unit.

    Raises ValueError if units are no more than the constants that they determine.
    """
    solved = _Solved.of(model, campaigns)
    weights, columns, unit = solved.weights, solved.columns, np.eye(solved.effects.shape[1])
    lab, batch = solved.ratios.T
    # From the effects to the constants of this lab: its factor is on all constants that are levels.
    own = np.broadcast_to(unit[columns.index(("lab", OWN))], (len(model.names), len(unit)))
    to_own = solved.to_constants + np.einsum("k,c,cm->kcm", lab, model.is_level, own)
    logs, variance = solved.combined(to_own)
    centre = weights @ logs
    apart = logs - centre
    covariance = np.einsum("k,kcd->cd", weights, variance) + np.einsum("k,kc,kd->cd", weights, apart, apart)
    sigma2 = float(weights @ (solved.variance * (1.0 + batch**2)))
    labs, batches = {}, {}
    for i, (kind, number) in enumerate(columns):
        if kind == "lab" and number != OWN:
            labs[number] = solved.factor(np.outer(lab, unit[i] - own[0]))
        elif kind == "batch":
            batches[number] = solved.factor(np.outer(batch, unit[i]))
    scatter = {"labs": solved.scatter(lab), "units": solved.scatter(np.ones_like(lab))}
    if batches:
        scatter["batches"] = solved.scatter(batch)
    constants = np.exp(centre + solved.mean * model.is_level)
    return MixedFit(constants, covariance / sigma2, float(np.sqrt(sigma2)), solved.df, labs, batches, scatter)


def judge(model: Model, campaigns: Campaigns) -> Judged:
    """Predict each unit by all others, of its lab and batch too, and by only the paper's."""
    table, logs = campaigns.table, np.log(campaigns.table.levels)
    solved = _Solved.of(model, campaigns)
    found = [
        solved.left_out(i) if solved.leverage[:, i].max() < 1.0 - _ALONE else _predicted(model, campaigns, i)
        for i in range(logs.size)
    ]
    centre, scale, df = (np.array(values) for values in zip(*found, strict=True))
    centre = centre + _logs(model, table, np.ones(len(model.names)))
    by_stored = None
    if campaigns.stored.any():
        by_stored = _logs(model, table, model.fit(table, campaigns.stored[None].astype(float))[0]) - logs
    return Judged(centre - logs, centre, scale, df, campaigns.own, by_stored)


def paired_difference(judged: Judged, other: Judged) -> tuple[float, float, float]:
    """Return the mean difference of |ln(predicted/measured)| to another model's, its standard error, sign-flip p."""
    one, two = np.abs(judged.errors), np.abs(other.errors)
    differences = one - two
    error = float(differences.std(ddof=1) / np.sqrt(differences.size))
    return float(differences.mean()), error, sign_flip_p(one, two)


def gradients(model: Model, table: MeasuredTable, constants: np.ndarray) -> np.ndarray:
    """Return d ln level / d ln constant of every unit, (units, constants)."""
    return table.mean(lambda units: model.gradient(units, constants))


@dataclass(frozen=True)
class _Solved:
    """The mixed-model equations solved at all K pairs of ratios: m effects, the model's first, then labs' and batches'.

    `effects` (K, m) over the ratios; `inverse` (K, m, m): their covariance over s^2; `variance` (K,): s^2; `weights`
    (K,). `columns`: the kind and number of each effect. `to_constants` (K, constants, m). `mean`: taken off ln level.
    `leverage`, `left`, `noise` (K, units): of each unit, its residual, its variance over s^2.
    """

    ratios: np.ndarray
    weights: np.ndarray
    logs: np.ndarray
    effects: np.ndarray
    inverse: np.ndarray
    variance: np.ndarray
    df: int
    columns: list[tuple[str, int]]
    to_constants: np.ndarray
    mean: float
    y: np.ndarray
    leverage: np.ndarray
    left: np.ndarray
    noise: np.ndarray
    unit_variance: float

    @classmethod
    def of(cls, model: Model, campaigns: Campaigns) -> _Solved:
        table, ones = campaigns.table, np.ones(len(model.names))
        gradient = gradients(model, table, ones)
        y = np.log(table.levels) - _logs(model, table, ones)
        unit_variance = _unit_variance(gradient, y, campaigns)
        extra = campaigns.error**2 / unit_variance
        mean = float(np.average(y, weights=1.0 / (1.0 + extra)))
        # What the units do not determine is left out: such a constant is the mean level, or 1.
        _, singular, right = np.linalg.svd(gradient, full_matrices=False)
        basis = right[singular > singular.max(initial=0.0) * 1e-10].T
        count, rank = len(y), basis.shape[1]
        if count - rank < 1:
            raise ValueError(f"{count} units fit no model of {rank} constants")
        numbers, sizes = np.unique(campaigns.batch[campaigns.batch >= 0], return_counts=True)
        shared = numbers[sizes > 1]
        labs = np.unique([OWN, *campaigns.lab])
        columns = [("model", i) for i in range(rank)]
        columns += [("lab", int(one)) for one in labs] + [("batch", int(one)) for one in shared]
        lab, prior = _grid(campaigns.between_labs)
        batch, also = _grid(campaigns.between_batches) if len(shared) else (np.zeros(1), np.zeros(1))
        ratios = np.stack([np.repeat(lab, len(batch)), np.tile(batch, len(lab))], axis=1)
        priors = np.add.outer(prior, also).ravel()
        own_batch = ~np.isin(campaigns.batch, shared)
        noise = 1.0 + extra + np.outer(ratios[:, 1] ** 2, own_batch)
        design = np.concatenate(
            [
                np.broadcast_to(gradient @ basis, (len(ratios), count, rank)),
                ratios[:, :1, None] * (campaigns.lab[:, None] == labs),
                ratios[:, 1:, None] * (campaigns.batch[:, None] == shared),
            ],
            axis=2,
        )
        weighted = design / noise[:, :, None]
        system = np.swapaxes(weighted, 1, 2) @ design
        system[:, range(rank, len(columns)), range(rank, len(columns))] += 1.0
        inverse = np.linalg.inv(system)
        effects = (inverse @ ((y - mean) @ weighted)[:, :, None])[:, :, 0]
        left = y - mean - (design @ effects[:, :, None])[:, :, 0]
        squares = np.maximum(np.einsum("ki,i->k", left / noise, y - mean), count * _LEAST_VARIANCE)
        df = count - rank
        logs = priors - 0.5 * (np.linalg.slogdet(system)[1] + np.log(noise).sum(axis=1) + df * np.log(squares))
        to_constants = np.zeros((len(ratios), len(ones), len(columns)))
        to_constants[:, :, :rank] = basis
        leverage = np.sum((weighted @ inverse) * design, axis=2)
        return cls(
            ratios, _normalised(logs), logs, effects, inverse, squares / df, df, columns, to_constants, mean, y,
            leverage, left, noise, unit_variance,
        )  # fmt: skip

    def combined(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return combinations of the effects by `rows` (K, c, m) at each pair, (K, c), and covariances, (K, c, c)."""
        covariance = rows @ (self.variance[:, None, None] * self.inverse) @ np.swapaxes(rows, 1, 2)
        return np.einsum("kcm,km->kc", rows, self.effects), covariance

    def factor(self, row: np.ndarray) -> Effect:
        """Return exp of a combination of effects, (K, m)."""
        centre, covariance = self.combined(row[:, None])
        scale = np.maximum(np.sqrt(covariance[:, 0, 0]), 1e-12)
        reach = np.max(np.abs(centre[:, 0]) + scale * stdtrit(self.df, _NEARLY_ALL))
        low, high = np.full(3, -reach), np.full(3, reach)
        for _ in range(60):  # the quantiles of the mixture, by bisection
            middle = (low + high) / 2
            below = stdtr(self.df, (middle[:, None] - centre[:, 0]) / scale) @ self.weights < (0.05, 0.5, 0.95)
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        first, value, last = np.exp(middle).tolist()
        return Effect(value, first, last)

    def scatter(self, ratio: np.ndarray) -> Effect:
        """Return the standard deviation that has a ratio (K,) to s: median and 90 % range."""
        shares = (np.arange(_SHARES) + 0.5) / _SHARES
        values = ratio[:, None] * np.sqrt(self.variance[:, None] * self.df / chdtri(self.df, shares))
        order = np.argsort(values, axis=None, kind="stable")
        total = np.cumsum(np.repeat(self.weights / _SHARES, _SHARES)[order])
        low, middle, high = np.interp([0.05, 0.5, 0.95], total, values.ravel()[order])
        return Effect(float(middle), float(low), float(high))

    def left_out(self, index: int) -> tuple[float, float, float]:
        """Return centre, scale and degrees of freedom of a unit's ln level without the offset, by the others."""
        kept = 1.0 - self.leverage[:, index]
        left, noise = self.left[:, index], self.noise[:, index]
        squares = np.maximum(self.variance * self.df - left**2 / (noise * kept), _LEAST_VARIANCE)
        df = self.df - 1
        logs = self.logs + 0.5 * (self.df * np.log(self.variance * self.df) + np.log(noise) - np.log(kept))
        weights = _normalised(logs - 0.5 * df * np.log(squares))
        return *_mixed(weights, self.y[index] - left / kept, squares / df * noise / kept), df

    def predicted(self, gradient: np.ndarray, lab: int, batch: int, extra: float) -> tuple[float, float, int]:
        """Return centre, scale and degrees of freedom of a further unit's ln level, without the model's offset."""
        rows, noise = np.einsum("c,kcm->km", gradient, self.to_constants), np.full(len(self.weights), 1.0 + extra)
        for kind, number, ratio in (("lab", lab, self.ratios[:, 0]), ("batch", batch, self.ratios[:, 1])):
            if (kind, number) in self.columns:
                rows[:, self.columns.index((kind, number))] += ratio
            else:
                noise += ratio**2
        centre, covariance = self.combined(rows[:, None])
        return *_mixed(self.weights, centre[:, 0], covariance[:, 0, 0] + self.variance * noise), self.df


def _mixed(weights: np.ndarray, centre: np.ndarray, variance: np.ndarray) -> tuple[float, float]:
    """Return centre and scale of a mixture of distributions."""
    middle = float(weights @ centre)
    return middle, float(np.sqrt(weights @ (variance + (centre - middle) ** 2)))


def _normalised(logs: np.ndarray) -> np.ndarray:
    weights = np.exp(logs - logs.max())
    return weights / weights.sum()


def _grid(median: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the ratios of the grid, and the logarithms of their probabilities by the half Student-t prior."""
    between = np.sqrt(_RATIOS[1:] * _RATIOS[:-1])
    below = 2.0 * stdtr(_FREEDOM, np.array([0.0, *between, np.inf])) - 1.0
    return median / stdtrit(_FREEDOM, 0.75) * _RATIOS, np.log(np.diff(below))


def _predicted(model: Model, campaigns: Campaigns, index: int) -> tuple[float, float, int]:
    """Return centre, scale and degrees of freedom of a unit's ln level without the offset, by a fit without it."""
    solved = _Solved.of(model, campaigns.without(index))
    gradient = gradients(model, campaigns.table, np.ones(len(model.names)))[index]
    extra = campaigns.error[index] ** 2 / solved.unit_variance
    centre, scale, df = solved.predicted(gradient, campaigns.lab[index], campaigns.batch[index], extra)
    return centre + solved.mean * float(gradient @ model.is_level), scale, df


def _unit_variance(gradient: np.ndarray, y: np.ndarray, campaigns: Campaigns) -> float:
    """Return s0^2 of the units whose error is not known if they are enough, or of all; labs may differ."""
    unknown = campaigns.error == 0
    used = unknown if unknown.sum() > gradient.shape[1] + len(set(campaigns.lab[unknown])) else np.ones(len(y), bool)
    labs = campaigns.lab[used][:, None] == np.unique(campaigns.lab[used])
    design = np.concatenate([gradient[used], labs], axis=1)
    constants, _, rank, _ = np.linalg.lstsq(design, y[used], rcond=None)
    squares = float(np.sum((y[used] - design @ constants) ** 2))
    return max(squares / max(int(used.sum()) - int(rank), 1), _LEAST_VARIANCE)


def _logs(model: Model, table: MeasuredTable, constants: np.ndarray) -> np.ndarray:
    """Return ln level of every unit, (units,)."""
    return table.mean(lambda units: model.logs(units, constants))


def _factor(errors: np.ndarray) -> float:
    return float(np.exp(np.mean(np.abs(errors))))

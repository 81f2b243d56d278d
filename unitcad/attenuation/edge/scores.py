"""How far a model is from measured units: levels, ratios and directions; each unit left out, with range and tests.

A fit takes a table and masks (M, units) of the units to fit to, and returns levels (M, units): all that is left out
here, one unit or two, is one call.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.edge.measured_levels import MeasuredTable

Fit = Callable[[MeasuredTable, np.ndarray], np.ndarray]
"""From a table and masks (M, units) of the units to fit to, the levels of all units by each fit, (M, units)."""
RANGE_PERCENT = (5.0, 95.0)
"""Ends of a bootstrap range."""
RANGE_HOLDS = 0.75
"""In this share of simulated tables of nine units, at least, such a range holds the true score."""
_DRAWS, SEED = 10_000, 1954
_MOST_EXACT = 12
"""Up to this many units every pattern of signs is tried."""


@dataclass(frozen=True)
class Score:
    """Geometric-mean and worst factor error (1 is exact) of a set of figures, and which one is the worst."""

    geometric_mean: float
    worst: float
    worst_at: str
    count: int


@dataclass(frozen=True)
class Assessment:
    """A model against the table. `directions`: of how many ratios the side of 1 is right.

    `left_out` and `left_out_ratios`: each unit predicted by constants fitted without it (None: none in it).
    `left_out_errors`: |ln(predicted/measured)| of each of them; `left_out_range`: the score's over resampled units.
    """

    levels: Score
    ratios: Score
    directions: int
    left_out: Score
    left_out_ratios: Score | None
    left_out_errors: np.ndarray
    left_out_range: tuple[float, float]


def assess(fit: Fit, fitted_ratios: bool, table: MeasuredTable) -> Assessment:
    """Fit to all units and to all but one, and compare. `fitted_ratios`: a fitted constant enters the ratios too."""
    everyone = np.ones((1, len(table.names)), dtype=bool)
    levels, *without = fit(table, np.concatenate([everyone, all_but_one(table)]))
    left_out = np.diagonal(without)
    pairs = table.pairs
    measured = np.array([table.levels[i] / table.levels[c] for i, c in pairs])
    ratios = np.array([levels[i] / levels[c] for i, c in pairs])
    names = [f"{table.names[i]} to {table.names[c]}" for i, c in pairs]
    errors = np.abs(np.log(left_out / table.levels))
    return Assessment(
        levels=_score(levels, table.levels, table.names),
        ratios=_score(ratios, measured, names),
        directions=int(np.sum(np.sign(_log(ratios)) == np.sign(np.log(measured)))),
        left_out=_score(left_out, table.levels, table.names),
        left_out_ratios=_score(np.array([without[i][i] / without[i][c] for i, c in pairs]), measured, names)
        if fitted_ratios
        else None,
        left_out_errors=errors,
        left_out_range=bootstrap_range(errors),
    )


def left_out_levels(fit: Fit, table: MeasuredTable) -> np.ndarray:
    """Return the level of each unit, predicted by constants fitted without it."""
    return np.diagonal(fit(table, all_but_one(table)))


def left_out_errors(fit: Fit, table: MeasuredTable) -> np.ndarray:
    """Return |ln(predicted/measured)| of each unit, predicted by constants fitted without it."""
    return np.abs(np.log(left_out_levels(fit, table) / table.levels))


def all_but_one(table: MeasuredTable) -> np.ndarray:
    """Return the masks that leave out one unit each."""
    return ~np.eye(len(table.names), dtype=bool)


def bootstrap_range(errors: np.ndarray) -> tuple[float, float]:
    """Return the `RANGE_PERCENT` of exp(mean error) over units drawn again with replacement, seeded."""
    drawn = np.random.default_rng(SEED).integers(0, errors.size, (_DRAWS, errors.size))
    low, high = np.exp(np.percentile(errors[drawn].mean(axis=1), RANGE_PERCENT))
    return float(low), float(high)


def sign_flip_p(errors: np.ndarray, others: np.ndarray) -> float:
    """Return the two-sided p of the mean paired difference under flips of each unit's sign.

    All 2^n patterns up to twelve units; above, seeded patterns with the observed one among them.
    """
    differences = errors - others
    count = differences.size
    if count <= _MOST_EXACT:
        signs = 1.0 - 2.0 * ((np.arange(2**count)[:, None] >> np.arange(count)) & 1)
    else:
        signs = np.random.default_rng(SEED).choice((-1.0, 1.0), (_DRAWS, count))
        signs[0] = 1.0
    means = np.abs(signs @ differences)
    return float(np.mean(means >= abs(differences.sum()) * (1 - 1e-9) - 1e-15))


@dataclass(frozen=True)
class Choice:
    """The score when the form is chosen without the unit too, and the form chosen for each unit."""

    score: Score
    range: tuple[float, float]
    chosen: tuple[str, ...]


def choose_without(forms: Mapping[str, Fit], table: MeasuredTable) -> Choice:
    """Choose, for each unit, the form with the best left-out score on the others, and predict the unit by it.

    The form's constants are fitted without the unit too (Varma and Simon, BMC Bioinformatics 7, 91, 2006).
    """
    count = len(table.names)
    single = all_but_one(table)
    double = (single[:, None] & single[None]).reshape(-1, count)
    inner, outer = [], []
    for fit in forms.values():
        both = fit(table, double).reshape(count, count, count)
        errors = np.abs(np.log(np.einsum("ijj->ij", both) / table.levels))
        inner.append(np.sum(errors * single, axis=1) / (count - 1))
        outer.append(np.einsum("iii->i", both))
    best = np.argmin(inner, axis=0)
    predicted = np.array(outer)[best, np.arange(count)]
    names = tuple(forms)
    return Choice(
        _score(predicted, table.levels, table.names),
        bootstrap_range(np.abs(np.log(predicted / table.levels))),
        tuple(names[i] for i in best),
    )


def _log(ratios: np.ndarray) -> np.ndarray:
    return np.where(np.abs(ratios - 1.0) < 1e-9, 0.0, np.log(ratios))


def _score(predicted: np.ndarray, measured: np.ndarray, names: tuple[str, ...] | list[str]) -> Score:
    off = np.abs(np.log(predicted / measured))
    worst = int(np.argmax(off))
    return Score(float(np.exp(off.mean())), float(np.exp(off[worst])), str(names[worst]), off.size)

"""Experiments by what they would say about the rivals: single ratios, the best sets, and what they leave open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from unitcad.experiments.conditioning import Held
from unitcad.experiments.information import Information, entropy, expected_information
from unitcad.experiments.protocol import Condition, Ratio, contrasts

_PARTNERS = 40
"""Single ratios, the most informative ones, among which the next one of a set is sought."""
_PARTS = ("unit", "frequency_hz", "body")
_APART = 0.5
"""Bits about two rivals, of the one there is, below which a set is said not to tell them apart."""


@dataclass(frozen=True)
class Predictions:
    """Log readings of every rival, an array (draws, conditions) each, with the errors of a reading.

    weights      prior probability of each rival, (rivals,)
    shares       of each draw within its rival, (draws,) each, summing to 1
    noise        standard deviation of the log of a reading when it is repeated
    indices      of each draw, (draws,) each: those of one index may depend on each other over the rivals
    held         the draws, and how well they give the measured levels
    unread       where an instrument shows its own noise instead of a reading, (draws, conditions) each
    discrepancy  of the log of a rival's reading from the truth though the rival holds: see `errors`
    """

    rivals: tuple[str, ...]
    conditions: tuple[Condition, ...]
    logs: tuple[np.ndarray, ...]
    noise: float
    discrepancy: float
    seed: int
    weights: np.ndarray = field(default_factory=lambda: np.empty(0))
    shares: tuple[np.ndarray, ...] = ()
    unread: tuple[np.ndarray, ...] = ()
    indices: tuple[np.ndarray, ...] = ()
    held: tuple[Held, ...] = ()

    def __post_init__(self) -> None:
        if not len(self.weights):
            object.__setattr__(self, "weights", np.full(len(self.rivals), 1.0 / len(self.rivals)))
        if not self.shares:
            object.__setattr__(self, "shares", tuple(np.full(len(log), 1.0 / len(log)) for log in self.logs))
        if not self.indices:
            object.__setattr__(self, "indices", tuple(np.arange(len(log)) for log in self.logs))
        if not self.unread:
            object.__setattr__(self, "unread", tuple(np.zeros(log.shape, dtype=bool) for log in self.logs))

    @property
    def most_bits(self) -> float:
        """What there is to know: the entropy of the rivals' probabilities."""
        return entropy(self.weights)

    @property
    def effective_draws(self) -> tuple[float, ...]:
        """How many equal draws each rival's shares are worth."""
        return tuple(float(1.0 / np.sum(share**2)) for share in self.shares)

    @cached_property
    def errors(self) -> np.ndarray:
        """Covariance of the errors of log readings, (conditions, conditions).

        The noise is each reading's own. A quarter of the discrepancy's variance belongs to the unit, the frequency, the
        body and the single condition each: a ratio of two readings that differ in one thing then misses by
        `discrepancy`, and the same comparison at another frequency or on another body repeats half of that variance.
        """
        units, frequencies, bodies = ([getattr(c, name) for c in self.conditions] for name in _PARTS)
        same = sum(np.equal.outer(np.array(of), np.array(of)).astype(float) for of in (units, frequencies, bodies))
        own = np.eye(len(self.conditions))
        return self.noise**2 * own + self.discrepancy**2 / 4.0 * (same + own)

    def log_ratios(self, chosen: Sequence[Ratio]) -> tuple[list[np.ndarray], np.ndarray]:
        """Return each rival's (draws, ratios) and the covariance of their errors.

        A reading that two ratios share is taken once: it has the same errors in both.
        """
        matrix = contrasts(chosen, self.conditions)
        return [log @ matrix.T for log in self.logs], matrix @ self.errors @ matrix.T

    def information(self, chosen: Sequence[Ratio]) -> Information:
        """Return what measuring all of `chosen`, none of which follows from the others, says about the rivals."""
        predicted, covariance = self.log_ratios(chosen)
        return expected_information(predicted, covariance, self.weights, self.shares, self.seed, self.indices)

    def of(self, rivals: Sequence[str]) -> Predictions:
        """Return the predictions of some rivals alone, which count as equally probable."""
        at = [self.rivals.index(name) for name in rivals]
        return replace(
            self,
            rivals=tuple(rivals),
            logs=tuple(self.logs[i] for i in at),
            shares=tuple(self.shares[i] for i in at),
            unread=tuple(self.unread[i] for i in at),
            indices=tuple(self.indices[i] for i in at),
            held=tuple(self.held[i] for i in at) if self.held else (),
            weights=np.full(len(at), 1.0 / len(at)),
        )

    def updated(self, measured: Sequence[tuple[Ratio, float]]) -> Predictions:
        """Return the predictions after ratios were measured, each given as its value: Bayes' rule, draw by draw."""
        if not measured:
            return self
        predicted, covariance = self.log_ratios([ratio for ratio, _ in measured])
        values = np.log([value for _, value in measured])
        inverse = np.linalg.pinv(covariance)
        misfits = [np.einsum("si,ij,sj->s", one - values, inverse, one - values) for one in predicted]
        least = min(float(misfit.min()) for misfit in misfits)
        likelihoods = [
            np.exp((least - misfit) / 2.0) * share for misfit, share in zip(misfits, self.shares, strict=True)
        ]
        evidence = np.array([float(one.sum()) for one in likelihoods])
        shares = tuple(
            one / total if total > 0 else share
            for one, total, share in zip(likelihoods, evidence, self.shares, strict=True)
        )
        return replace(self, weights=self.weights * evidence / np.sum(self.weights * evidence), shares=shares)


@dataclass(frozen=True)
class Ranked:
    """Ratios that are measured together and what they say; `open`: pairs of rivals with the bits about the two."""

    ratios: tuple[Ratio, ...]
    information: Information
    open: tuple[tuple[str, str, float], ...] = ()


def singles(predictions: Predictions, ratios: Sequence[Ratio], step: Callable[[str], None]) -> list[Ranked]:
    """Rank single ratios, the most informative first; equal ones keep their order."""
    found = []
    for i, ratio in enumerate(ratios):
        if i % 20 == 0:
            step(f"ratio {i + 1} of {len(ratios)}")
        found.append(Ranked((ratio,), predictions.information([ratio])))
    return sorted(found, key=lambda one: -one.information.bits)


def best_sets(
    predictions: Predictions, ranked: Sequence[Ranked], largest: int, step: Callable[[str], None]
) -> list[Ranked]:
    """Return the best ratio and the sets that grow from it, one more ratio at a time, up to `largest`.

    Each time the ratio is added that makes the set as a whole say most, of the `_PARTNERS` best single ones. One
    that follows from those already there adds nothing and is passed over.
    """
    chosen, sets = ranked[0], [ranked[0]]
    while len(sets) < largest:
        step(f"a set of {len(sets) + 1}")
        candidates = [(*chosen.ratios, one.ratios[0]) for one in ranked[:_PARTNERS]]
        independent = [c for c in candidates if _independent(c, predictions.conditions)]
        if not independent:
            break
        grown = [Ranked(c, predictions.information(c)) for c in independent]
        chosen = max(grown, key=lambda one: one.information.bits)
        sets.append(chosen)
    return [replace(one, open=open_pairs(predictions, one.ratios)) for one in sets]


def open_pairs(predictions: Predictions, chosen: Sequence[Ratio]) -> tuple[tuple[str, str, float], ...]:
    """Return the pairs of rivals that measuring `chosen` does not tell apart, the worst first.

    Each comes with the bits about the two, were they equally probable: 1 tells them apart for certain.
    """
    possible = [name for name, weight in zip(predictions.rivals, predictions.weights, strict=True) if weight > 0.01]
    pairs = [(*pair, predictions.of(pair).information(chosen).bits) for pair in combinations(possible, 2)]
    return tuple(sorted((pair for pair in pairs if pair[2] < _APART), key=lambda pair: pair[2]))


def _independent(chosen: Sequence[Ratio], conditions: Sequence[Condition]) -> bool:
    return int(np.linalg.matrix_rank(contrasts(chosen, conditions))) == len(chosen)

"""Expected information, in bits, of a measurement about which of several rivals holds, with its own error.

A rival's prediction is a set of draws; the measurement adds Gaussian errors of known covariance. With the errors
whitened, rival m's predictive density is the kernel mixture p_m(y) = sum_s v_s N(y; z_s, I), and the information is

    I = sum_m w_m E_{y ~ p_m} log2(p_m(y) / sum_k w_k p_k(y)),    0 <= I <= H(w) <= log2(number of rivals).

A finite number of draws biases it. Two estimates lie on either side of the true value, in expectation:

- with the draws themselves, too high: I is convex in the densities (Jensen's inequality);
- with each draw tested by the mixture of all others, too low: for any classifier q, I >= H(w) + E log2 q(m | y)
  (Barber and Agakov, 2003). Where the ends are apart wider kernels are tried too, since this holds for any of them.

The standard error is that of the mean over draws of log2(p_m / p), the first-order influence of a draw on I.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

_STEP, _TAIL = 0.25, 6.0
"""Of the grid in one dimension, in standard deviations of the kernel: the trapezoidal rule is exact to 1e-9 there."""
_WIDTHS = (1.5, 2.2, 3.3)
"""Widths of the classifier's kernel over the measurement's, tried where the ends are not within `_CLOSE` bits."""
_CLOSE = 0.01
_LEAST = 1e-300
"""Added to densities, so that a quotient of two that underflow is no NaN."""


@dataclass(frozen=True)
class Information:
    """Bits, with the ends that a finite number of draws leaves (`low`, `high`) and the standard error of both."""

    low: float
    high: float
    standard_error: float

    @property
    def bits(self) -> float:
        return (self.low + self.high) / 2.0

    @property
    def error(self) -> float:
        """Half the distance of the ends, and two standard errors."""
        return (self.high - self.low) / 2.0 + 2.0 * self.standard_error


def entropy(weights: np.ndarray) -> float:
    """Return the entropy of probabilities in bits."""
    kept = weights[weights > 0]
    return float(-np.sum(kept * np.log2(kept)))


def expected_information(
    predicted: Sequence[np.ndarray],
    covariance: np.ndarray,
    weights: np.ndarray,
    shares: Sequence[np.ndarray] | None = None,
    seed: int = 0,
    indices: Sequence[np.ndarray] | None = None,
) -> Information:
    """Return the information of measuring d numbers about which rival holds.

    `predicted`: an array (draws, d) for each rival; `covariance` (d, d) of the measurement's errors; `weights`: prior
    probability of each rival; `shares`: of each draw within its rival, summing to 1, else equal; `indices`: of each
    draw, else its place. Two dimensions and more are integrated by Monte Carlo with that seed: its error is in the
    standard error. Draws of one index may depend on each other over the rivals, those of different ones may not; such
    as are spread more evenly than independent ones have a smaller error than the one stated. Raises ValueError for a
    rival with fewer than two draws, numpy's LinAlgError for a covariance that is not positive definite.
    """
    counts = np.array([len(one) for one in predicted])
    if counts.min() < 2:
        raise ValueError("a rival needs two draws or more")
    draws = np.concatenate([np.asarray(one, dtype=float) for one in predicted])
    rival = np.repeat(np.arange(len(counts)), counts)
    mixture = _Mixture(
        # The mean is taken off for accuracy: only differences count.
        white=np.linalg.solve(np.linalg.cholesky(covariance), (draws - draws.mean(axis=0)).T).T,
        rival=rival,
        share=np.concatenate(shares) if shares is not None else 1.0 / counts[rival],
        counts=counts,
        weights=np.asarray(weights, dtype=float),
        index=np.concatenate(indices if indices is not None else [np.arange(count) for count in counts]),
    )
    one_dimension = mixture.white.shape[1] == 1
    score = _by_quadrature(mixture) if one_dimension else _by_sampling(mixture, seed)
    return _bracket(mixture, score)


@dataclass(frozen=True)
class _Mixture:
    """Whitened draws of all rivals (N, d); of each its rival, share, index (N,); draws, weight of each rival (M,)."""

    white: np.ndarray
    rival: np.ndarray
    share: np.ndarray
    counts: np.ndarray
    weights: np.ndarray
    index: np.ndarray

    @property
    def of_rival(self) -> np.ndarray:
        """Shares as (N, M), 0 for the other rivals: kernels @ this are the rivals' densities."""
        return np.where(self.rival[:, None] == np.arange(len(self.weights)), self.share[:, None], 0.0)


Score = Callable[[float, bool], np.ndarray]
"""From a kernel's width, and whether a draw's own kernel is left out, to E log2(q(m | y) / w_m) of each draw (N,)."""


def _bracket(mixture: _Mixture, score: Score) -> Information:
    total = mixture.weights[mixture.rival] * mixture.share
    with_itself = score(1.0, False)
    without = score(1.0, True)
    if total @ (with_itself - without) > _CLOSE:
        without = max((without, *(score(width, True) for width in _WIDTHS)), key=lambda scores: float(total @ scores))
    most = entropy(mixture.weights)
    high, low = (float(np.clip(total @ scores, 0.0, most)) for scores in (with_itself, without))
    # Summed over rivals before it is squared: draws of one number may share what they drew, and then go together.
    influence = np.zeros(int(mixture.index.max()) + 1)
    for m, weight in enumerate(mixture.weights):
        mine = mixture.rival == m
        share = mixture.share[mine]
        np.add.at(influence, mixture.index[mine], weight * share * (without[mine] - share @ without[mine]))
    return Information(min(low, high), max(low, high), float(np.sqrt(np.sum(influence**2))))


def _by_quadrature(mixture: _Mixture) -> Score:
    """Integrate over one number by the trapezoidal rule on a grid that all kernels share, empty stretches left out."""
    z = mixture.white[:, 0]
    cells = np.unique(np.floor(z / _STEP).astype(np.int64))
    reach = np.arange(-int(_TAIL / _STEP), int(_TAIL / _STEP) + 2)
    points = np.unique(cells[:, None] + reach) * _STEP
    kernel = np.exp((points[:, None] - z) ** 2 / -2.0)
    at_draw = kernel / kernel.sum(axis=0)

    def score(width: float, leave_out: bool) -> np.ndarray:
        classifier = kernel if width == 1.0 else kernel ** (1.0 / width**2)
        densities = (classifier @ mixture.of_rival)[:, mixture.rival]
        all_densities = (classifier @ (mixture.weights[mixture.rival] * mixture.share))[:, None]
        gains = _gains(mixture, densities, all_densities, classifier, np.arange(len(z)), leave_out)
        return np.sum(at_draw * gains, axis=0)

    return score


def _by_sampling(mixture: _Mixture, seed: int) -> Score:
    """Integrate by two points for each draw: its prediction with an error, and with the opposite one."""
    white = mixture.white
    noise = np.random.default_rng(seed).standard_normal(white.shape)
    points = np.concatenate([white + noise, white - noise])
    owner = np.tile(np.arange(len(white)), 2)
    squared = np.sum(points**2, axis=1)[:, None] + np.sum(white**2, axis=1) - 2.0 * points @ white.T
    kernel = np.exp(np.maximum(squared, 0.0) / -2.0)

    def score(width: float, leave_out: bool) -> np.ndarray:
        classifier = kernel if width == 1.0 else kernel ** (1.0 / width**2)
        by_rival = classifier @ mixture.of_rival
        rows = np.arange(len(points))
        densities, own = by_rival[rows, mixture.rival[owner]], classifier[rows, owner]
        gains = _gains(mixture, densities, by_rival @ mixture.weights, own, owner, leave_out)
        return gains.reshape(2, -1).mean(axis=0)

    return score


def _gains(
    mixture: _Mixture, density: np.ndarray, all_densities: np.ndarray, own: np.ndarray, owner: np.ndarray, without: bool
) -> np.ndarray:
    """Return log2(q(m | y) / w_m) where rival m of draw `owner` has that density and the mixture `all_densities`.

    Without the draw's own kernel q is the posterior, with a share 1/(draws + 1) of the prior: it is then never 0.
    """
    weight, share = mixture.weights[mixture.rival[owner]], mixture.share[owner]
    others = np.maximum(all_densities - weight * density, 0.0)
    doubt: np.ndarray | float = 0.0
    if without:
        density = np.maximum(density - own * share, 0.0) / np.maximum(1.0 - share, _LEAST)
        doubt = 1.0 / (mixture.counts[mixture.rival[owner]] + 1.0)
    posterior_over_prior = (density + _LEAST) / (weight * density + others + _LEAST)
    return np.log2(np.maximum((1.0 - doubt) * posterior_over_prior + doubt, _LEAST))

"""Expected information against integrals of Gaussian rivals, whose predictive densities are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.stats import multivariate_normal, norm

from unitcad.experiments.information import entropy, expected_information

MEANS, SPREADS, SIGMA = (0.0, 0.4, 1.1), (0.3, 0.05, 0.5), 0.25
WEIGHTS = np.array([0.5, 0.2, 0.3])


def _true_information() -> float:
    """Adaptive quadrature of the exact densities N(mean, spread^2 + sigma^2)."""
    rivals = [norm(m, np.hypot(s, SIGMA)) for m, s in zip(MEANS, SPREADS, strict=True)]

    def integrand(y: float) -> float:
        p = np.array([r.pdf(y) for r in rivals])
        return float(np.sum(WEIGHTS * p * np.log2(p / (WEIGHTS @ p))))

    return quad(integrand, -3, 4, epsabs=1e-9, limit=200)[0]


def _draws(rng: np.random.Generator, count: int) -> list[np.ndarray]:
    return [rng.normal(m, s, (count, 1)) for m, s in zip(MEANS, SPREADS, strict=True)]


def test_two_gaussian_rivals_without_unknowns_are_exact() -> None:
    true = quad(
        lambda y: norm.pdf(y, 1.0) * np.log2(2 * norm.pdf(y, 1.0) / (norm.pdf(y, 1.0) + norm.pdf(y, -1.0))), -9, 9
    )[0]
    # All draws of a rival are equal, so that its density is exact with any number of them.
    rivals = [np.full((5000, 1), x) for x in (-0.5, 0.5)]
    found = expected_information([one[:3] for one in rivals], np.array([[0.25]]), np.array([0.5, 0.5]))
    assert found.high == pytest.approx(true, abs=1e-7)
    assert found.standard_error < 1e-9


def test_few_draws_of_one_and_the_same_prediction_are_no_information() -> None:
    """Twenty draws each of N(0, 1), read to 0.05: no reading lies under two kernels, yet there is nothing to know."""
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rivals = [rng.normal(0, 1, (20, 1)) for _ in range(2)]
        found.append(expected_information(rivals, np.array([[0.05**2]]), np.array([0.5, 0.5])))
    assert np.mean([one.high for one in found]) > 0.3  # the draws alone would say so
    assert np.mean([one.low for one in found]) < 0.02
    assert all(one.bits - one.error <= 0.01 for one in found)


def test_numbers_that_say_the_same_are_integrated_alike_in_one_and_two_dimensions() -> None:
    """Two points two standard deviations apart: turned in the plane, their distance is all that counts."""
    even = np.array([0.5, 0.5])
    line = expected_information([np.full((3, 1), x) for x in (-1.0, 1.0)], np.eye(1), even)
    turned = np.array([0.6, 0.8])
    rivals = [np.tile(x * turned, (300, 1)) for x in (-1.0, 1.0)]
    found = [expected_information(rivals, np.eye(2), even, seed=seed) for seed in range(10)]
    of_mean = np.sqrt(np.mean([one.standard_error**2 for one in found]) / len(found))
    assert of_mean < 0.01
    assert np.mean([one.high for one in found]) == pytest.approx(line.high, abs=3 * of_mean)


@pytest.mark.parametrize("count", [30, 200])
def test_the_stated_error_covers_the_true_information(count: int) -> None:
    true = _true_information()
    found = [
        expected_information(_draws(np.random.default_rng(seed), count), np.array([[SIGMA**2]]), WEIGHTS)
        for seed in range(60)
    ]
    covered = sum(abs(one.bits - true) <= one.error for one in found)
    assert covered >= 55
    # The ends lie on either side on average; how far the mean of 60 may be off follows from the stated errors.
    of_mean = np.sqrt(np.mean([one.standard_error**2 for one in found]) / len(found))
    assert np.mean([one.low for one in found]) < true + 3 * of_mean
    assert np.mean([one.high for one in found]) > true - 3 * of_mean


def test_the_standard_error_is_the_scatter_over_seeds() -> None:
    found = [
        expected_information(_draws(np.random.default_rng(seed), 100), np.array([[SIGMA**2]]), WEIGHTS)
        for seed in range(80)
    ]
    stated = np.mean([one.standard_error for one in found])
    assert 0.75 < stated / np.std([one.bits for one in found]) < 1.35  # the scatter of 80 is known to 8 %


def test_the_standard_error_counts_what_rivals_draw_together() -> None:
    """Two rivals whose predictions move against each other with one unknown: their information scatters more."""
    found = []
    for seed in range(80):
        unknown = np.random.default_rng(seed).normal(0.0, 0.5, (60, 1))
        found.append(expected_information([unknown, 1.0 - unknown], np.array([[SIGMA**2]]), np.array([0.5, 0.5])))
    stated = np.mean([one.standard_error for one in found])
    assert 0.75 < stated / np.std([one.bits for one in found]) < 1.35


def test_the_error_covers_two_correlated_numbers() -> None:
    covariance = np.array([[0.06, 0.03], [0.03, 0.06]])
    spread = np.array([[0.1, -0.04], [-0.04, 0.05]])
    means = ([0.0, 0.0], [0.3, -0.3])
    rivals = [multivariate_normal(m, covariance + spread) for m in means]

    def integrand(y: float, x: float) -> float:
        p = np.array([r.pdf([x, y]) for r in rivals])
        return float(np.sum(0.5 * p * np.log2(p / p.mean())))

    true = dblquad(integrand, -2.5, 2.8, -2.8, 2.5, epsabs=1e-4)[0]
    found = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        draws = [rng.multivariate_normal(m, spread, 150) for m in means]
        found.append(expected_information(draws, covariance, np.array([0.5, 0.5]), seed=seed))
    assert sum(abs(one.bits - true) <= one.error for one in found) >= 27
    of_mean = np.sqrt(np.mean([one.standard_error**2 for one in found]) / len(found))
    assert np.mean([one.low for one in found]) < true + 3 * of_mean
    assert np.mean([one.high for one in found]) > true - 3 * of_mean
    assert of_mean < 0.01


def test_shares_count_like_repeated_draws() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.normal(0, 1, (40, 1)), rng.normal(1, 1, (40, 1))
    cov, even = np.array([[0.5]]), np.array([0.5, 0.5])
    doubled = np.concatenate([first, first[:10]])
    shares = np.full(40, 1 / 50)
    shares[:10] *= 2
    repeated = expected_information([doubled, second], cov, even)
    shared = expected_information([first, second], cov, even, [shares, np.full(40, 1 / 40)])
    assert shared.high == pytest.approx(repeated.high, abs=1e-12)
    assert shared.low < repeated.low  # a repeated draw is no new one


def test_it_is_at_most_what_there_is_to_know() -> None:
    apart = [np.full((4, 2), 100.0 * m) for m in range(3)]
    found = expected_information(apart, np.eye(2), WEIGHTS)
    assert found.high == pytest.approx(entropy(WEIGHTS), abs=1e-12)
    alike = expected_information([apart[0], apart[0], apart[0]], np.eye(2), WEIGHTS)
    assert (alike.low, alike.high) == (0.0, pytest.approx(0.0, abs=1e-12))
    assert entropy(np.array([0.25] * 4)) == pytest.approx(2.0)

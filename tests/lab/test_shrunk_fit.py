"""Shrunk fits against full covariance matrices, scipy, normal theory and the scores of the other implementation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from unitcad.attenuation.edge.measured import MeasuredTable, measured_table
from unitcad.attenuation.edge.models import COMPARED, Model, assess_all, stored
from unitcad.attenuation.edge.ranges import quantiles
from unitcad.lab.shrunk_fit import Campaigns, gradients, judge, paired, shrunk

TABLE = measured_table()
MODELS = COMPARED


def logs_of(model: Model, table: MeasuredTable, constants: np.ndarray) -> np.ndarray:
    return table.mean(lambda units: model.logs(units, constants))


def fit_of(model: Model, table: MeasuredTable, weights: np.ndarray) -> np.ndarray:
    return model.fit(table, weights[None])[0]


def _picked(indices: list[int], logs: np.ndarray) -> MeasuredTable:
    def pick(values: tuple) -> tuple:
        return tuple(values[i] for i in indices)

    return replace(
        TABLE,
        names=pick(TABLE.names),
        designs=pick(TABLE.designs),
        layers=pick(TABLE.layers),
        levels=np.exp(logs),
        inputs=pick(TABLE.inputs),
    )


def _campaigns(own: list[int], rng: np.random.Generator, between: float, errors: float = 0.0) -> Campaigns:
    indices = [*range(9), *own]
    table = _picked(indices, rng.normal(-1.0, 0.7, len(indices)))
    ours = np.arange(len(indices)) >= 9
    return Campaigns(table, ours, np.where(ours, errors, 0.0), between)


@pytest.mark.parametrize("name", ["crossings", "published", "rule", "baseline"])
@pytest.mark.parametrize("between", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("for_lab", [True, False])
def test_a_linear_model_is_generalised_least_squares(name: str, between: float, for_lab: bool) -> None:
    """The lab's constants are the paper's plus a normal step: one covariance matrix over all units, no prior's weight.

    The step's covariance is n between^2 (J'J)^-1 of the other campaign, and its mean is flat.
    """
    model = MODELS[name]
    campaigns = _campaigns([3, 5, 7, 1], np.random.default_rng(8), between)
    table, here = campaigns.table, campaigns.own == for_lab
    found = shrunk(model, campaigns, for_lab)
    size = len(model.names)
    j = gradients(model, table, np.ones(size))
    y = np.log(table.levels) - logs_of(model, table, np.ones(size))
    there = ~here
    step = there.sum() * between**2 * np.linalg.inv(j[there].T @ j[there])
    # Unknown are the lab's constants; the other campaign's units are those less the step.
    covariance = np.eye(y.size)
    covariance[np.ix_(there, there)] += j[there] @ step @ j[there].T
    inverse = np.linalg.inv(covariance)
    information = j.T @ inverse @ j
    mean = np.linalg.solve(information, j.T @ inverse @ y)
    residual = y - j @ mean
    assert np.log(found.constants) == pytest.approx(mean, rel=1e-9)
    assert found.covariance == pytest.approx(np.linalg.inv(information), rel=1e-9)
    assert found.df == y.size - size
    assert found.sigma == pytest.approx(np.sqrt(residual @ inverse @ residual / found.df), rel=1e-9)


def test_the_predictive_is_students_t() -> None:
    """Quantiles by scipy.stats; and by draws of sigma^2, constants and a unit from the conjugate posterior."""
    model, campaigns = MODELS["rule"], _campaigns([3, 0], np.random.default_rng(2), 1.0)
    found = shrunk(model, campaigns)
    g = gradients(model, campaigns.table, found.constants)[3]
    df, centre, scale = found.predictive(-0.7, g)
    low, high = quantiles(df, centre, scale)
    assert np.log([low, high]) == pytest.approx(stats.t.ppf([0.1, 0.9], df, centre, scale), rel=1e-9)
    rng, count = np.random.default_rng(4), 200_000
    sigma = found.sigma * np.sqrt(df / rng.chisquare(df, count))
    shift = rng.multivariate_normal([0, 0], found.covariance, count) @ g
    drawn = -0.7 + sigma * (shift + rng.normal(size=count))
    assert np.quantile(drawn, [0.1, 0.9]) == pytest.approx(np.log([low, high]), abs=0.01)


def test_the_divider_s_gradient_is_its_slope() -> None:
    model, constants = MODELS["divider"], np.array([0.3, 0.7])
    for k, step in enumerate(np.eye(2) * 1e-6):
        ends = [logs_of(model, TABLE, constants * np.exp(sign * step)) for sign in (1, -1)]
        assert gradients(model, TABLE, constants)[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-8)


@pytest.mark.parametrize("moduli", ["small-strain", "quasi-static", "data sheet"])
def test_without_a_lab_s_units_the_scores_are_the_table_s(moduli: str) -> None:
    """The other implementation masks units in closed forms; so do the scores by source that were measured before."""
    table = measured_table(moduli)  # type: ignore[arg-type]
    alone = Campaigns(table, np.zeros(9, dtype=bool), np.zeros(9))
    judged = {name: judge(model, alone) for name, model in MODELS.items()}
    for name, one in assess_all(table).items():
        assert np.abs(judged[name].errors) == pytest.approx(one.left_out_errors, rel=1e-6, abs=1e-9), name
    before = {"small-strain": (1.33, 1.35), "quasi-static": (1.76, 1.59), "data sheet": (1.89, 1.86)}[moduli]
    scores = [judged[name].score for name in ("divider", "crossings")]
    assert scores == pytest.approx(before, abs=0.025)
    assert judged["baseline"].score == pytest.approx(1.327, abs=0.001)
    assert judged["rule"].score == pytest.approx(1.290, abs=0.001)


def test_intervals_that_were_measured_before() -> None:
    alone = Campaigns(TABLE, np.zeros(9, dtype=bool), np.zeros(9))
    judged = {name: judge(MODELS[name], alone) for name in ("divider", "crossings", "published", "baseline")}
    assert [judged[name].held() for name in ("published", "crossings", "divider", "baseline")] == [8, 7, 7, 7]
    one, two = (np.abs(judged[name].errors) for name in ("divider", "baseline"))
    assert paired(judged["divider"], judged["baseline"])[:2] == pytest.approx(
        (np.mean(one - two), stats.sem(one - two))
    )


def test_a_unit_counts_by_its_error_of_measurement() -> None:
    rng = np.random.default_rng(9)
    exact = _campaigns([3], rng, 1.0)
    sigma = shrunk(MODELS["crossings"], Campaigns(TABLE, np.zeros(9, dtype=bool), np.zeros(9)), False).sigma
    exact = replace(exact, table=replace(exact.table, levels=np.array([*TABLE.levels, 0.9])))
    at = {
        error: float(np.log(shrunk(MODELS["crossings"], replace(exact, error=exact.own * error)).constants[0]))
        for error in (0.0, sigma, 1e3)
    }
    own = np.log(0.9) - float(logs_of(MODELS["crossings"], exact.table, np.ones(1))[-1])
    kept = np.log(stored_crossings())
    for error, weight in ((0.0, 1.0), (sigma, 0.5), (1e3, 0.0)):
        assert at[error] == pytest.approx((0.9 * kept + weight * own) / (0.9 + weight), abs=1e-4)


def stored_crossings() -> float:
    model = MODELS["crossings"]
    return float(np.exp(np.mean(np.log(TABLE.levels) - logs_of(model, TABLE, np.ones(1)))))


def test_stored_constants_are_the_catalogue_s() -> None:
    for name, constants in stored().items():
        fitted = fit_of(MODELS[name], TABLE, np.ones(9))
        assert dict(zip(MODELS[name].names, fitted, strict=True)) == pytest.approx(constants, rel=1e-5)

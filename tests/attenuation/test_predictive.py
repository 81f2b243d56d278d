"""The predictive of a level: against scipy's own distributions and optimiser, and the answers that are known."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from unitcad.attenuation.edge import predictive
from unitcad.attenuation.edge.closed_form import divider, transmission_only
from unitcad.attenuation.edge.lab_fit import LabFit, ModelFit
from unitcad.attenuation.edge.lab_fit import predictive as of_one_model
from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.attenuation.edge.predictive import Predictive, lab_weights, left_out_residuals, predictive_of, stack
from unitcad.errors import Refusal
from unitcad.estimating import estimate_input
from unitcad.validation import load

OF_THE_NINE = ("crossings", "fitted", "paper")
PAIRS = [
    ("encapsulating", "ecoflex-00-10", "dragon-skin-30"),
    ("encapsulating", "ecoflex-00-10", "dragon-skin-10-medium"),
    ("embedded", "ecoflex-00-10", "dragon-skin-30"),
    ("embedded", "ecoflex-00-10", "dragon-skin-10-medium"),
    ("embedded", "dragon-skin-10-medium", "ecoflex-00-10"),
    ("encapsulating", "dragon-skin-10-medium", "ecoflex-00-10"),
]


def _unit(design: str, inner: str, outer: str):
    changes = {"layers.0.material": inner, "layers.1.material": outer}
    return estimate_input(load(design, changes))


def test_units_of_the_nine_meet_six_per_cent_as_is_known() -> None:
    found = predictive_of([_unit(*pair) for pair in PAIRS], OF_THE_NINE)
    assert found.models == ("crossings", "fitted")
    assert found.weights == pytest.approx([0.6, 0.4], abs=0.02)
    p = found.at_most(0.06)
    assert p[:3] == pytest.approx([0.79, 0.52, 0.10], abs=0.006)
    assert max(p[3:]) < 0.045
    low, _, high = (100 * end[0] for end in found.range)
    assert low == pytest.approx(2.6, abs=0.1)
    assert high == pytest.approx(7.4, abs=0.1)


def test_every_closed_form_is_stacked_where_none_is_named() -> None:
    made = stack()
    assert made.models == ("bush", "crossings")
    assert made.left_out == ("fitted", "paper", "consistent")
    assert made.weights == pytest.approx([0.84, 0.16], abs=0.02)


def test_residuals_are_those_of_constants_fitted_without_the_unit() -> None:
    """The crossings' constant is a mean of logarithms; the divider's two come from scipy's own minimiser."""
    table = measured_table()
    logs = np.log(table.levels)
    crossings = np.log(table.evaluate(transmission_only))
    contrast = table.evaluate(lambda units: 1.0 / divider(units, 1.0) - 1.0)
    for i in range(9):
        others = np.arange(9) != i
        centre = crossings[i] + np.mean((logs - crossings)[others])
        assert left_out_residuals("crossings", table)[i] == pytest.approx(logs[i] - centre, abs=1e-9)

        def misfit(x, others=others):
            return (logs - x[1] + np.log1p(np.exp(x[0]) * contrast))[others]

        x = optimize.least_squares(misfit, [-1.0, 0.0], xtol=1e-14, ftol=1e-14).x
        centre = x[1] - np.log1p(np.exp(x[0]) * contrast[i])
        assert left_out_residuals("fitted", table)[i] == pytest.approx(logs[i] - centre, abs=1e-5)


@pytest.mark.parametrize("models", [OF_THE_NINE, predictive.STACKED, ("paper", "consistent", "fitted")])
def test_weights_maximise_the_left_out_score(models: tuple[str, ...]) -> None:
    table = measured_table()
    residuals = np.stack([left_out_residuals(model, table) for model in models], axis=-1)
    df = [9 - 2 if model == "fitted" else 9 - 1 for model in models]
    scale = np.sqrt((residuals**2).sum(axis=0) / 8)
    density = stats.t.pdf(residuals, df, scale=scale)

    def loss(w):
        return -np.sum(np.log(density @ w))

    best = optimize.minimize(
        loss,
        np.full(len(models), 1 / len(models)),
        bounds=[(0, 1)] * len(models),
        constraints={"type": "eq", "fun": lambda w: w.sum() - 1},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    made = stack(models)
    weights = np.array([dict(zip(made.models, made.weights, strict=True)).get(model, 0.0) for model in models])
    assert loss(weights) <= best.fun + 1e-6
    assert weights == pytest.approx(best.x, abs=3e-3)


def test_mixture_is_that_of_its_density_integrated() -> None:
    mixture = Predictive(
        ("a", "b"),
        np.array([0.3, 0.7]),
        np.array([3, 8]),
        np.array([[-1.0, -3.0], [0.5, -0.5], [np.nan, -1.0]]),
        np.array([[0.2, 0.6], [1.4, 0.1], [0.3, 0.3]]),
    )
    for row, level in itertools.product((0, 1), (0.02, 0.4, 1.3)):

        def density(x, row=row):
            each = stats.t.pdf(x, mixture.degrees_of_freedom, mixture.centre[row], mixture.scale[row])
            return each @ mixture.weights

        edges = [-60.0, -4.0, -2.0, np.log(level)]
        edges = sorted({e for e in edges if e <= np.log(level)})
        share = sum(integrate.quad(density, a, b, limit=200)[0] for a, b in itertools.pairwise(edges))
        assert mixture.at_most(level)[row] == pytest.approx(share, abs=1e-5)
    for share in (0.1, 0.5, 0.9, 0.999):
        assert mixture.at_most(mixture.quantile(share))[:2] == pytest.approx([share, share], abs=1e-8)
    assert np.isnan(mixture.quantile(0.5)[2])
    assert np.isnan(mixture.at_most(0.1)[2])


def test_silicone_without_a_modulus_has_no_predictive_and_leaves_the_others_alone() -> None:
    known = _unit(*PAIRS[0])
    without = load("encapsulating", {"layers.0.material": "ecoflex-00-50"})
    found = predictive_of([known, estimate_input(without)])
    assert np.isfinite(found.at_most(0.06)[0])
    assert np.isnan(found.at_most(0.06)[1])


def _fit(left_out: dict[str, float]) -> LabFit:
    def one(model: str, factor: float) -> ModelFit:
        names: tuple[str, ...] = ("kappa", "s") if model == "fitted" else ("s",)
        values: dict[str, float] = dict.fromkeys(names, 0.4)
        return ModelFit(
            constants=values, low=values, high=values, stored=values, degrees_of_freedom=13 - len(names),
            discrepancy=0.3, covariance=np.diag([0.1] * len(names)).tolist(),
            left_out=factor, left_out_low=1.1, left_out_high=2.0,
        )  # fmt: skip

    made = {model: one(model, factor) for model, factor in left_out.items()}
    return LabFit(
        format=1, name="lab", units=4, moduli="dynamic", with_paper=True, between_labs=1.0, seed=1,
        model=made, null=made["bush"],
    )  # fmt: skip


def test_a_labs_fit_gives_its_own_distribution() -> None:
    fit = _fit({"bush": 1.3, "fitted": 1.35, "paper": 1.9, "consistent": 1.9})
    weights = lab_weights(fit)
    expected = np.array([np.log(f) ** -13.0 for f in (1.3, 1.35, 1.9, 1.9)])
    assert list(weights.values()) == pytest.approx(expected / expected.sum(), abs=2e-3)
    found = predictive_of([_unit(*PAIRS[0])], fit=fit)
    for k, model in enumerate(found.models):
        alone = of_one_model(fit, model, _unit(*PAIRS[0]))
        assert (found.degrees_of_freedom[k], found.centre[0, k], found.scale[0, k]) == pytest.approx(alone)
    assert found.models == ("bush", "fitted")
    assert found.degrees_of_freedom.tolist() == [12, 11]
    assert found.scale[0][0] == pytest.approx(0.3 * np.sqrt(1.1))


def test_names_that_are_no_models_are_refused() -> None:
    with pytest.raises(Refusal, match=r"models\.1 = 'crosings': not known; closest: crossings"):
        stack(("bush", "crosings"))
    with pytest.raises(Refusal, match=r"models\.1 = 'bush': is there twice"):
        stack(("bush", "bush"))
    with pytest.raises(Refusal, match="at least one model"):
        stack(())

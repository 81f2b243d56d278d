"""Scores against scipy's bootstrap and permutation test, brute-force loops, and tables whose truth is known."""

import itertools
import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from scipy import stats

from benchmarks.accuracy.level_scores import forms, leave_one_out_errors, with_levels
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.models import COMPARED
from unitcad.attenuation.edge.scores import FILE, MODULI, scores
from unitcad.attenuation.edge.scoring import (
    assess_all,
    assessments,
    bootstrap_range,
    choice,
    choose_without,
    in_order,
    rules,
    sign_flip_p,
    text,
)
from unitcad.estimate_inputs import estimate_spec
from unitcad.validation import load

TABLE = measured_table()
RNG = np.random.default_rng(3)


def test_leave_one_out_errors_are_those_of_single_fits():
    """Each mask on its own; with one constant also the closed form n/(n - 1) of the residual."""
    for name, model in COMPARED.items():
        errors = leave_one_out_errors(model.levels, TABLE)
        for i in range(9):
            mask = np.arange(9) != i
            alone = model.levels(TABLE, mask[None])[0, i]
            assert errors[i] == pytest.approx(abs(np.log(alone / TABLE.levels[i])), rel=1e-6), name
        if len(model.names) == 1:
            residuals = np.log(TABLE.levels / model.levels(TABLE, np.ones((1, 9), dtype=bool))[0])
            assert errors == pytest.approx(np.abs(residuals) * 9 / 8, rel=1e-9)


@pytest.mark.parametrize("name", ["rule", "published", "baseline"])
def test_the_range_is_scipy_s_percentile_bootstrap(name):
    errors = assessments()[name].leave_one_out_errors
    reference = stats.bootstrap(
        (errors,), np.mean, confidence_level=0.9, n_resamples=40_000, method="percentile", rng=np.random.default_rng(1)
    ).confidence_interval
    found = bootstrap_range(errors)
    assert (found.low, found.high) == pytest.approx(tuple(np.exp(reference)), rel=0.01)


@pytest.mark.parametrize(("a", "b"), [("rule", "baseline"), ("rule", "published"), ("published", "baseline")])
def test_sign_flips_are_scipy_s_exact_permutation_test(a, b):
    errors, others = (assessments()[name].leave_one_out_errors for name in (a, b))
    reference = stats.permutation_test(
        (errors, others),
        lambda x, y, axis: np.mean(x - y, axis=axis),
        permutation_type="samples",
        n_resamples=np.inf,
        vectorized=True,
    )
    assert sign_flip_p(errors, others) == pytest.approx(reference.pvalue, abs=1e-12)
    assert sign_flip_p(others, errors) == sign_flip_p(errors, others)


def test_sign_flips_of_many_units_are_drawn_and_agree_with_all_of_them():
    errors, others = RNG.normal(0.3, 1, 14), np.zeros(14)
    signs = np.array(list(itertools.product((1, -1), repeat=14)))
    exact = np.mean(np.abs(signs @ errors) >= abs(errors.sum()) - 1e-12)
    assert sign_flip_p(errors, others) == pytest.approx(exact, abs=0.02)
    assert sign_flip_p(errors, errors) == 1
    assert sign_flip_p(np.full(9, 1.0), np.zeros(9)) == 2 / 512


def test_the_choice_without_a_unit_is_what_loops_give():
    fits = rules()
    found = choose_without(fits, TABLE)
    errors = []
    for i in range(9):
        others = [j for j in range(9) if j != i]

        def error(fit, unit, without):
            mask = np.array([j not in without for j in range(9)])
            return abs(np.log(fit(TABLE, mask[None])[0, unit] / TABLE.levels[unit]))

        inner = {name: np.mean([error(fit, j, (i, j)) for j in others]) for name, fit in fits.items()}
        best = min(inner, key=inner.__getitem__)
        assert inner[found.chosen[i]] == pytest.approx(inner[best], rel=1e-9)
        errors.append(error(fits[found.chosen[i]], i, (i,)))
    assert found.score.geometric_mean == pytest.approx(np.exp(np.mean(errors)), rel=1e-9)
    assert choice().score == found.score
    assert found.score.geometric_mean > min(one.leave_one_out.geometric_mean for one in assessments().values())


def test_a_true_model_is_first_and_chosen_and_the_order_follows_the_scores():
    true = with_levels(TABLE, COMPARED["published"].levels(TABLE, np.ones((1, 9), dtype=bool))[0])
    found = assess_all(true)
    assert in_order(found)[0] == "published"
    assert found["published"].leave_one_out.geometric_mean == pytest.approx(1, abs=1e-9)
    assert set(choose_without(forms(), true).chosen) == {"published, S wave, loss_modulus"}
    leave_one_out = [found[name].leave_one_out.geometric_mean for name in in_order(found)]
    assert leave_one_out == sorted(leave_one_out)
    estimated = estimate_spec(load("embedded"))
    assert estimated["table_error"]["order"] == in_order(assessments())
    assert list(estimated["models"]) == [n for n in in_order(assessments()) if n in estimated["models"]]


def test_the_stored_scores_are_those_that_the_nine_units_give():
    """The file is made again; its numbers have six digits."""
    stored = (resources.files("unitcad.attenuation.edge") / FILE).read_text("utf-8")
    again = json.loads(text())
    assert not list(unlike(json.loads(stored), again))
    for moduli in MODULI:
        again[moduli]["constants"]["rule"]["s"] *= 1.0001
    assert len(list(unlike(json.loads(stored), again))) == len(MODULI)
    for moduli in MODULI:
        assert scores(moduli).models["rule"].leave_one_out.geometric_mean == pytest.approx(
            assessments(moduli)["rule"].leave_one_out.geometric_mean, rel=1e-5
        )


def unlike(one, other, path=""):
    """Yield the paths at which two trees differ, numbers by more than the stored digits."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            yield from unlike(one[key], other[key], f"{path}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for i, pair in enumerate(zip(one, other, strict=True)):
            yield from unlike(*pair, f"{path}.{i}")
    elif one != (pytest.approx(other, rel=1.1e-5) if isinstance(other, float) else other):
        yield path


def test_a_table_of_other_units_is_scored_as_well():
    """Seven of the units in another order: nothing holds the number nine."""
    kept = [8, 0, 3, 4, 1, 6, 2]
    part = {name: tuple(getattr(TABLE, name)[i] for i in kept) for name in ("names", "designs", "layers", "inputs")}
    found = assess_all(replace(TABLE, **part, levels=TABLE.levels[kept]))
    assert all(one.leave_one_out.count == 7 for one in found.values())
    assert found["rule"].leave_one_out_errors.shape == (7,)

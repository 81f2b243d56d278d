"""Draws that are held to the nine measured levels: weights against their integral, rivals of known truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.attenuation.inputs import EstimateInput
from unitcad.experiments.conditioning import drawn, misfits, weights_of
from unitcad.experiments.draws import Draws, Rival
from unitcad.experiments.lab_file import Lab, LabFile, lab_of_data
from unitcad.experiments.rivals import KAPPA, _resampled_kappas, available
from unitcad.experiments.study import few_draws, predictions, study
from unitcad.experiments.study_files import page

SETTINGS = LabFile(units={}, frequencies_hz=[125.0], bodies=["forearm"])
LEVELS = measured_table().levels


def test_a_weight_is_the_likelihood_over_all_larger_discrepancies() -> None:
    """The definition, by adaptive quadrature over s from 1 to infinity."""
    chi2 = np.array([0.01, 2.0, 8.0, 30.0, 400.0, np.inf])
    exact = [quad(lambda s, x=x: s**-9 * np.exp(-x / (2 * s * s)), 1, np.inf)[0] for x in chi2[:-1]]
    assert weights_of(chi2, 8) == pytest.approx(np.array([*exact, 0.0]) / sum(exact), rel=1e-6)
    assert weights_of(np.full(3, np.inf), 8) == pytest.approx(np.full(3, 1 / 3))


def _rival(spread: float, costly: bool = False) -> Rival:
    """Say each unit's measured level times 7, to a power between 1/2 and 3/2, and where `spread` is not 0 off by it."""

    def levels(variant: EstimateInput, draws: Draws) -> np.ndarray:
        design = "single" if len(variant.layers) == 1 else variant.design
        names = measured_table().names
        at = names.index(f"{design} {variant.name}")
        power = draws.between("power", 0.5, 1.5)
        off = np.exp(spread * np.random.default_rng(at).normal())
        return 7.0 * measured_table().levels[at] ** power * off

    return Rival("power", "a test's", levels, costly)


def test_draws_that_explain_the_levels_are_kept() -> None:
    held = drawn(_rival(0.0), SETTINGS)
    powers = held.draws.between("power", 0.5, 1.5)
    assert held.shares.sum() == pytest.approx(1)
    assert held.shares @ powers == pytest.approx(1, abs=0.01)
    # By hand: the levels' log has this spread, a reading this error.
    sigma = np.hypot(0.1, 0.15 / np.sqrt(2)) / np.sqrt(np.sum((lambda x: (x - x.mean()) ** 2)(np.log(LEVELS))))
    assert np.sqrt(held.shares @ (powers - 1) ** 2) == pytest.approx(sigma, rel=0.25)
    assert held.misses is not None
    assert held.misses < 1.1
    assert held.effective is not None
    assert 1.5 * len(powers) < held.effective < held.draws.count / 2


def test_what_misses_the_levels_is_held_the_less() -> None:
    exact, far = drawn(_rival(0.0), SETTINGS), drawn(_rival(0.6), SETTINGS)
    assert exact.effective is not None
    assert far.effective is not None
    assert far.misses is not None
    assert far.effective > 2 * exact.effective
    assert far.misses > 1.4


def test_the_prior_is_kept_where_a_lab_asks_for_it() -> None:
    settings = LabFile(units={}, frequencies_hz=[125.0], bodies=["forearm"], held_to_levels=False)
    held = drawn(_rival(0.0), settings)
    assert (held.effective, held.misses, held.draws.count) == (None, None, settings.draws)
    assert held.draws.between("power", 0.5, 1.5) @ held.shares == pytest.approx(0.95, abs=0.05)


def test_the_divider_is_fitted_once() -> None:
    """Held, its constant has a wide prior, and comes out where least squares over resampled units has it."""
    (rival,) = available(["fitted"]).rivals
    settings = LabFile(units={}, frequencies_hz=[125.0], bodies=["forearm"], modulus_factor=1.0, draws=400)
    held = drawn(rival, settings)
    kappa = held.draws.between("kappa", *KAPPA)
    low, high = np.percentile(_resampled_kappas(), (10, 90))
    assert low < np.exp(held.shares @ np.log(kappa)) < high
    rms = np.sqrt(np.mean(misfits(rival, held.draws, settings) ** 2, axis=1))
    assert np.exp(held.shares @ rms) == pytest.approx(held.misses, rel=0.03)


def _lab(**changes: Any) -> Lab:
    units = {"open": {"base": "embedded"}, "closed": {"base": "encapsulating"}}
    data = {"units": units, "frequencies_hz": [125], "bodies": ["forearm"], "rivals": ["crossings", "fitted"]}
    return lab_of_data({**data, "draws": 40, **changes}, Path(), "test")


def test_a_study_says_how_well_each_rival_gives_the_levels() -> None:
    data = study(_lab())
    assert data["held_to_levels"] is True
    assert [round(one["held"]["misses"], 1) for one in data["rivals"]] == [1.3, 1.3]
    assert "| fitted | the empirical divider" in page(data)
    assert "| a factor of 1.2" in page(data) or "| a factor of 1.3" in page(data)
    prior = study(_lab(held_to_levels=False))
    assert [one["held"] for one in prior["rivals"]] == [None, None]
    assert prior["experiments"][0]["bits"] != data["experiments"][0]["bits"]
    assert "nothing holds them" in page(prior)


def test_few_draws_are_said() -> None:
    """A ratio that only the widest draws give leaves next to none of them."""
    reading = {"frequency_hz": 125, "body": "forearm"}
    ends = {"above": {"unit": "open", **reading}, "below": {"unit": "closed", **reading}}
    lab = _lab(
        rivals=["crossings", "paper"],
        measured=[{**ends, "ratio": 30.0}],
        noise=0.01,
        discrepancy=0.01,
        frequencies_hz=[125, 200],
    )
    lines = study(lab)["few_draws"]
    assert lines
    assert all("effective draws of 640" in line for line in lines)
    assert few_draws(predictions(_lab(), available(["crossings"]).rivals)) == []

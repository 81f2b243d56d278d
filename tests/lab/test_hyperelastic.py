"""Rubber laws: constants recovered from exact curves, stress and tangent against differences of the energy itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from unitcad.lab import tensile as hyper
from unitcad.lab.tensile import Law, default_method, fit_start, moduli, secant

KNOWN: dict[Law, dict[str, float]] = {
    "neo-Hooke": {"c10": 5e3},
    "Mooney": {"c10": 4e3, "c01": 1.5e3},
    "Yeoh": {"c10": 6e3, "c20": -150.0, "c30": 12.0},
    "Ogden": {"mu": 9e3, "alpha": 2.7},
}
STRAIN = np.linspace(0.0, 1.0, 101)


def _energy(law: Law, constants: dict[str, float], stretches: tuple[float, float, float]) -> float:
    """The energy as the textbooks print it, Pa."""
    if law == "Ogden":
        mu, alpha = constants["mu"], constants["alpha"]
        return 2 * mu / alpha**2 * (sum(s**alpha for s in stretches) - 3)
    i1, i2 = sum(s**2 for s in stretches), sum(s**-2 for s in stretches)
    powers = sum(constants.get(f"c{k}0", 0.0) * (i1 - 3) ** k for k in (1, 2, 3))
    return powers + constants.get("c01", 0.0) * (i2 - 3)


@pytest.mark.parametrize("law", KNOWN)
def test_the_stress_is_the_slope_of_the_energy(law: Law) -> None:
    def energy(stretch: float) -> float:
        return _energy(law, KNOWN[law], (stretch, stretch**-0.5, stretch**-0.5))

    for strain in (-0.3, 0.05, 0.4, 1.5):
        step = 1e-5
        slope = (energy(1 + strain + step) - energy(1 + strain - step)) / (2 * step)
        assert float(hyper.nominal_stress(law, KNOWN[law], np.array(strain))) == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("law", KNOWN)
def test_the_tangent_is_the_bend_of_the_energy(law: Law) -> None:
    def energy(e1: float, e2: float) -> float:
        return _energy(law, KNOWN[law], (math.exp(e1), math.exp(e2), math.exp(-e1 - e2)))

    a, b, d = 0.31, -0.12, 1e-4
    corner = energy(a + d, b + d) - energy(a + d, b - d) - energy(a - d, b + d) + energy(a - d, b - d)
    bend = [
        [(energy(a + d, b) - 2 * energy(a, b) + energy(a - d, b)) / d**2, corner / (4 * d**2)],
        [corner / (4 * d**2), (energy(a, b + d) - 2 * energy(a, b) + energy(a, b - d)) / d**2],
    ]
    tangent = hyper.log_tangent(law, KNOWN[law], np.array([a]), np.array([b]))[0]
    np.testing.assert_allclose(tangent, bend, rtol=1e-5)


@pytest.mark.parametrize("law", KNOWN)
def test_the_constants_of_an_exact_curve_are_recovered(law: Law) -> None:
    stress = hyper.nominal_stress(law, KNOWN[law], STRAIN)
    fit = hyper.fit_law(law, STRAIN, stress, 1.0, 0.24)
    assert dict(fit.constants) == pytest.approx(KNOWN[law], rel=1e-5)
    assert fit.residual < 1e-6
    slope = (stress[1] - stress[0]) / 0.01
    assert fit.youngs_modulus == pytest.approx(slope, rel=0.02)  # the chord over the first 1 %
    assert fit.unstable == {}


def test_a_mooney_law_is_unstable_where_its_stress_falls() -> None:
    """c10 < 0 < c01: the true stress of a bar has a maximum, where Hill's condition fails in tension at the latest."""
    constants = {"c10": -2e3, "c01": 6e3}
    stretch = np.linspace(1.0, 2.0, 20001)
    true = hyper.nominal_stress("Mooney", constants, stretch - 1) * stretch
    summit = float(stretch[np.argmax(true)] - 1)
    unstable = hyper.first_unstable("Mooney", constants, {"tension": 1.0, "biaxial": 1.0})
    assert 0 < unstable["tension"] <= summit + 0.0025 < 1.0
    assert unstable["biaxial"] < unstable["tension"]
    assert hyper.first_unstable("Mooney", {"c10": 1e3, "c01": -2e3}, {"tension": 0.5}) == {"tension": 0.0}


def test_an_exact_law_gives_its_modulus_by_every_method_that_tends_to_it() -> None:
    """A stiff start is small strain: secants of neo-Hooke's law are E (1 + 1/L + 1/L^2) / 3 with L the stretch."""
    strain = np.linspace(0.001, 3.5, 3500)
    stress = hyper.nominal_stress("neo-Hooke", {"c10": 1e4}, strain)
    found = {one.method: one for one in moduli(strain, stress, 0.12, 0.24)}
    for at in (0.1, 0.15, 0.25, 0.5):
        stretch = 1 + at
        exact = 6e4 * (1 + 1 / stretch + 1 / stretch**2) / 3  # (L - 1/L^2) / (L - 1) = (L^2 + L + 1) / L^2
        assert secant(strain, stress, at) == pytest.approx(exact, rel=1e-4)
    for name in ("neo-Hooke up to 50 %", "Mooney up to 100 %", "Mooney up to 300 %", "Yeoh up to 100 %"):
        assert found[name].value == pytest.approx(6e4, rel=1e-6)
    assert found["Ogden, one term, up to 100 %"].value == pytest.approx(6e4, rel=1e-6)
    assert not found["Mooney up to 300 %"].defensible


@pytest.mark.parametrize("slack", [0.0, 0.03, -0.02])
def test_slack_and_an_offset_of_the_force_do_not_move_the_default(slack: float) -> None:
    strain = np.linspace(0.04, 0.6, 60)
    bar = hyper.nominal_stress("neo-Hooke", {"c10": 1e4}, strain - slack)
    toe = fit_start(strain, bar, 0.24)
    assert toe is not None
    assert toe.origin == pytest.approx(slack, abs=1e-6)
    exact = np.mean([20e3 * (s**2 + s + 1) / s**2 for s in np.linspace(1.12, 1.24, 1001)])
    assert {one.method: one for one in moduli(strain, bar, 0.12, 0.24)}[
        default_method(0.12, 0.24)
    ].value == pytest.approx(exact, rel=1e-4)
    plain = secant(strain, bar, 0.15)
    assert plain is not None
    assert (abs(plain / exact - 1) > 0.1) == (slack != 0)


def test_a_method_that_a_curve_does_not_reach_says_so() -> None:
    strain = np.linspace(0.05, 0.4, 30)
    found = {one.method: one for one in moduli(strain, 1e5 * strain, 0.12, 0.24)}
    assert found["secant at 50 %"].value is None
    assert "5 to 40 %" in found["secant at 50 %"].reason
    assert found["Yeoh up to 100 %"].value is None
    short = moduli(strain[:10], 1e5 * strain[:10], 0.12, 0.24)[0]
    assert short.value is None
    assert "ends" in short.reason

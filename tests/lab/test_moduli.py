"""Young's modulus by secants and slope of curves that are known exactly."""

import numpy as np
import pytest

from unitcad.lab.material import default_method, fit_start, moduli, secant

YOUNG = 6e4


def neo_hooke(strain):
    """The nominal stress of a bar by neo-Hooke's law, Pa."""
    stretch = 1.0 + strain
    return YOUNG / 3 * (stretch - stretch**-2)


@pytest.mark.parametrize("at", [0.1, 0.15, 0.25, 0.5, 1.0])
def test_a_secant_of_neo_hookes_law_is_exact(at):
    """E (1 + 1/L + 1/L^2) / 3 with L the stretch: (L - 1/L^2) / (L - 1) = (L^2 + L + 1) / L^2."""
    strain = np.linspace(0.001, 3.5, 3500)
    stretch = 1 + at
    exact = YOUNG * (1 + 1 / stretch + 1 / stretch**2) / 3
    assert secant(strain, neo_hooke(strain), at) == pytest.approx(exact, rel=1e-4)


def test_every_method_gives_a_straight_lines_slope():
    strain = np.linspace(0.0, 1.5, 151)
    values = {one.method: one.value for one in moduli(strain, YOUNG * strain, 0.12, 0.24)}
    toe = values.pop(default_method(0.12, 0.24))  # its law bends
    assert values == pytest.approx(dict.fromkeys(values, YOUNG))
    assert toe is not None


@pytest.mark.parametrize("slack", [0.0, 0.03, -0.02])
def test_slack_and_an_offset_of_the_force_do_not_move_the_default(slack):
    strain = np.linspace(0.04, 0.6, 60)
    bar = neo_hooke(strain - slack)
    toe = fit_start(strain, bar, 0.24)
    assert toe is not None
    assert toe.origin == pytest.approx(slack, abs=1e-6)
    exact = np.mean([YOUNG / 3 * (s**2 + s + 1) / s**2 for s in np.linspace(1.12, 1.24, 1001)])
    assert moduli(strain, bar, 0.12, 0.24)[0].value == pytest.approx(exact, rel=1e-4)
    plain = secant(strain, bar, 0.15)
    assert plain is not None
    assert (abs(plain / exact - 1) > 0.1) == (slack != 0)


def test_a_method_that_a_curve_does_not_reach_says_so():
    strain = np.linspace(0.05, 0.4, 30)
    found = {one.method: one for one in moduli(strain, 1e5 * strain, 0.12, 0.24)}
    assert found["secant at 50 %"].value is None
    assert "5 to 40 %" in found["secant at 50 %"].reason
    short = moduli(strain[:10], 1e5 * strain[:10], 0.12, 0.24)[0]
    assert short.value is None
    assert "ends" in short.reason

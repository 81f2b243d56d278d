"""Closed forms against hand arithmetic and identities, the fit made again, the table of the design's section 5."""

from typing import get_args

import numpy as np
import pytest
from scipy.optimize import least_squares

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.fitted_models import (
    MODELS,
    assessments,
    compared,
    edge_levels,
    fit_divider,
    measured_table,
    stored,
)
from unitcad.attenuation.edge.scores import assess
from unitcad.catalogue import measurements
from unitcad.designs import shipped
from unitcad.estimating import MECHANICS
from unitcad.spec.asked import Model

E10, D10, D30 = 15e3, 250e3, 355e3


def units(*moduli, nu=0.4999, tan_delta=0.2, density=1070.0, wall=1.25e-3, passes=1.0, hertz=125.0):
    return cf.Units(
        youngs_modulus=moduli,
        density=[density] * len(moduli),
        poisson_ratio=[nu] * len(moduli),
        tan_delta=[tan_delta] * len(moduli),
        thickness=[wall] * len(moduli),
        omega=2 * np.pi * hertz,
        passes=passes,
    )


def test_speeds_of_equations_1c_and_1d():
    e, rho, nu = 2.6e5, 1000.0, 0.3
    lame = e * nu / ((1 + nu) * (1 - 2 * nu))
    assert cf.wave_speed(e, rho, nu, "p") == pytest.approx(np.sqrt((lame + 2e5) / rho))
    assert cf.wave_speed(e, rho, nu, "s") == pytest.approx(10.0)
    assert cf.wave_speed(e, rho, 0.5, "p") == np.inf


def test_coefficients_of_equation_4():
    """1 + k_r = k_t, no reflection between equals, and energy: k_r^2 + k_t^2 Z2/Z1 = 1."""
    z1, z2 = np.array([1.0, 2.0, 5.0]), np.array([3.0, 2.0, 0.0])
    kt, kr = cf.transmission(z1, z2), cf.reflection(z1, z2)
    assert 1 + kr == pytest.approx(kt)
    assert kr**2 + kt**2 * z2 / z1 == pytest.approx(1.0)
    assert kr[1] == 0
    assert kt[2] == 2


def test_paper_path_by_hand():
    """k_t of E10/D10 is 2 sqrt(15)/(sqrt(15) + sqrt(250)), then 2 into air; exponents omega tan d / v_s."""
    unit = units(E10, D10)
    inner = 2 * np.sqrt(15) / (np.sqrt(15) + np.sqrt(250))
    speed = np.sqrt(np.array([E10, D10]) / (2 * 1.4999) / 1070)
    loss = np.sum(2 * np.pi * 125 * 0.2 * 1.25e-3 / speed)
    assert cf.paper_path(unit) == pytest.approx(2 * inner * np.exp(-loss), rel=1e-12)
    assert cf.paper_path(unit, reading="kelvin_voigt") == pytest.approx(2 * inner * np.exp(-loss / 2), rel=1e-12)
    literal = loss / (2 * np.pi * 125)
    assert cf.paper_path(unit, reading="literal") == pytest.approx(2 * inner * np.exp(-literal), rel=1e-12)


def test_consistent_becomes_the_paper_at_low_loss():
    for tan_delta in (1e-3, 1e-2):
        unit = units(E10, D30, tan_delta=tan_delta)
        print_ = cf.paper_path(unit, reading="kelvin_voigt")
        assert cf.consistent_path(unit) == pytest.approx(print_, rel=2 * tan_delta**2)
    high = units(E10, D30, tan_delta=1.0)
    assert abs(cf.consistent_path(high) / cf.paper_path(high, reading="kelvin_voigt") - 1) > 0.02


def test_exact_attenuation_is_the_decay_of_the_wave():
    """-Im(omega sqrt(rho/M)) d for one layer, M = mu (1 + i tan delta), against the field itself."""
    one = units(E10, tan_delta=0.4)
    mu = E10 / (2 * 1.4999) * (1 + 0.4j)
    field = np.exp(-1j * 2 * np.pi * 125 * np.sqrt(1070 / mu) * 1.25e-3)
    assert cf.consistent_path(one) == pytest.approx(2 * abs(field), rel=1e-12)


def test_layers_of_one_material_are_one_layer():
    for path in (cf.paper_path, cf.consistent_path):
        three, one = units(D10, D10, D10, wall=1e-3), units(D10, wall=3e-3)
        assert path(three) == pytest.approx(path(one), rel=1e-12)


def test_constraints_of_equation_6():
    unit = units(E10, D30)
    found = {c.name: c for c in cf.constraints(unit, unit.control(1))}
    e, nu, eta = np.array([E10, D30]), 0.4999, 0.2 * np.array([E10, D30]) / (2 * np.pi * 125)
    rho, d = 1070.0, 1.25e-3
    terms_a = eta * d * np.sqrt((1 + nu) * (1 - 2 * nu) * rho) / (e * np.sqrt(e * (1 - nu)))
    terms_b = eta * d * np.sqrt(2 * (1 + nu) * rho) / (e * np.sqrt(e))
    assert found["6a"].left == pytest.approx(terms_a.sum(), rel=1e-9)
    assert found["6a"].right == pytest.approx(2 * terms_a[1], rel=1e-9)
    assert found["6b"].left == pytest.approx(terms_b.sum(), rel=1e-9)
    assert found["6c"].left == pytest.approx(E10 * rho * (1 - nu) / ((1 + nu) * (1 - 2 * nu)), rel=1e-9)
    assert found["6d"].right == pytest.approx(D30 * rho / (1 + nu), rel=1e-9)
    assert all(c.margin > 0 for c in found.values())
    against_soft = {c.name: c for c in cf.constraints(unit, unit.control(0))}
    assert against_soft["6b"].margin < 0  # (b) fails against the softer control


def test_constraint_a_is_zero_above_zero_at_one_half():
    unit = units(E10, D30, nu=0.5)
    constraint = cf.constraints(unit, unit.control(1))[0]
    assert constraint.left == constraint.right == 0
    assert not constraint.margin > 0


def test_n_layers():
    unit = units(E10, D10, D30)
    assert cf.paper_transmissions(unit).shape == (3,)
    assert len(cf.constraints(unit, unit.control(0))) == 2 + 2 * 2
    assert np.isfinite(cf.paper_path(unit))


@pytest.mark.parametrize("model", ["paper", "consistent", "fitted"])
def test_arrays_give_what_single_calls_give(model):
    rng = np.random.default_rng(1)
    moduli = 10 ** rng.uniform(4, 6, (50, 2))
    walls, hertz = rng.uniform(0.5e-3, 5e-3, (50, 2)), rng.uniform(50, 300, 50)
    many = cf.Units(moduli, [1070.0] * 2, [0.4999] * 2, [0.2] * 2, walls, 2 * np.pi * hertz, 2.0)
    levels = edge_levels(many, model)
    assert levels.shape == (50,)
    for i in (0, 17, 49):
        one = cf.Units(moduli[i], [1070.0] * 2, [0.4999] * 2, [0.2] * 2, walls[i], 2 * np.pi * hertz[i], 2.0)
        assert levels[i] == pytest.approx(float(edge_levels(one, model)), rel=1e-14)


def test_the_table_is_the_catalogues():
    table = measured_table()
    assert len(table.names) == 9
    assert len(table.pairs) == 12
    data = measurements()
    tables = (data.controls, *(measured.levels for measured in data.designs.values()))
    assert set(table.levels) == {level for one in tables for level in one.values()}


def test_the_measured_designs_are_the_shipped_ones() -> None:
    assert {name: (design.passes, design.caps) for name, design in shipped().items()} == {
        name: (measured.passes, measured.caps) for name, measured in measurements().designs.items()
    }


def test_the_divider_s_constants_are_those_of_a_general_least_squares():
    """For all nine units and for each of them left out."""
    table = measured_table()
    masks = np.concatenate([np.ones((1, 9), dtype=bool), ~np.eye(9, dtype=bool)])
    kappas, scales = fit_divider(table, masks)
    for mask, kappa, s in zip(masks, kappas, scales, strict=True):

        def off(x, mask=mask):
            return (np.log(table.levels) - x[1] + np.log1p(np.exp(x[0]) * table.contrast))[mask]

        best = least_squares(off, [0.0, 0.0], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
        assert (kappa, s) == pytest.approx(tuple(np.exp(best)), rel=1e-5)
    assert stored()["fitted"] == pytest.approx({"kappa": kappas[0], "s": scales[0]}, rel=1e-5)
    assert stored()["fitted"] == {"kappa": 0.282048, "s": 0.659429}


def test_fit_is_a_minimum():
    table = measured_table()
    kappa, s = (float(each[0]) for each in fit_divider(table, np.ones((1, 9), dtype=bool)))

    def misfit(k, level):
        return np.sum(np.log(table.levels * (1 + k * table.contrast) / level) ** 2)

    best = misfit(kappa, s)
    for factor in (0.99, 1.01):
        assert misfit(kappa * factor, s) > best
        assert misfit(kappa, s * factor) > best


@pytest.mark.parametrize(
    ("model", "levels", "left_out", "ratios", "directions"),
    [
        ("crossings", 1.30, 1.35, 1.39, 12),
        ("fitted", 1.25, 1.33, None, 12),
        ("bush", 1.26, 1.30, 1.30, 12),
        ("null", 1.37, 1.51, None, 8),
    ],
)
def test_what_was_found_before(model, levels, left_out, ratios, directions):
    """Figures that were found by another program; a model's own ratios where no constant enters them."""
    found = assessments()[model]
    assert found.levels.geometric_mean == pytest.approx(levels, abs=0.006)
    assert found.left_out.geometric_mean == pytest.approx(left_out, abs=0.006)
    assert found.directions == directions
    if ratios:
        assert found.ratios.geometric_mean == pytest.approx(ratios, abs=0.006)


def test_null_and_divider_leave_one_unit_out_in_ratios():
    found = assessments()
    assert found["null"].left_out_ratios.geometric_mean == pytest.approx(1.75, abs=0.006)
    assert found["fitted"].left_out_ratios.geometric_mean == pytest.approx(1.33, abs=0.006)


def test_judge_of_a_perfect_model_is_one():
    table = measured_table()
    found = assess(lambda _, masks: np.broadcast_to(table.levels, masks.shape), False, table)
    assert found.levels.geometric_mean == 1
    assert found.ratios.worst == pytest.approx(1, abs=1e-15)
    assert found.directions == 12


def test_a_spec_may_ask_for_every_model():
    assert set(get_args(Model)) == {*MODELS, MECHANICS}
    assert {*MODELS, "crossings", "null"} == set(compared())

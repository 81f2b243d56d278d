"""Closed forms against hand arithmetic and identities, the fit made again, the table of the design's section 5."""

from typing import get_args

import numpy as np
import pytest

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.contrast import unit_of_scale
from unitcad.attenuation.edge.measured import CLASSES, measured_table
from unitcad.attenuation.edge.models import COMPARED, MODELS, edge_levels, stored
from unitcad.attenuation.edge.scoring import assessments, leader, leave_one_class_out
from unitcad.catalogue import measurements
from unitcad.designs import shipped
from unitcad.estimate_inputs import FEM
from unitcad.spec.raw import Model

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
    assert cf.published_path(unit) == pytest.approx(2 * inner * np.exp(-loss), rel=1e-12)


def test_consistent_becomes_the_paper_at_low_loss():
    """With half of the paper's exponent, which is the true decay."""

    def half(unit):
        return cf.published_path(unit) * np.exp(np.sum(cf.exponents(unit), axis=-1) / 2)

    for tan_delta in (1e-3, 1e-2):
        unit = units(E10, D30, tan_delta=tan_delta)
        assert cf.corrected_path(unit) == pytest.approx(half(unit), rel=2 * tan_delta**2)
    high = units(E10, D30, tan_delta=1.0)
    assert abs(cf.corrected_path(high) / half(high) - 1) > 0.02


def test_exact_attenuation_is_the_decay_of_the_wave():
    """-Im(omega sqrt(rho/M)) d for one layer, M = mu (1 + i tan delta), against the field itself."""
    one = units(E10, tan_delta=0.4)
    mu = E10 / (2 * 1.4999) * (1 + 0.4j)
    field = np.exp(-1j * 2 * np.pi * 125 * np.sqrt(1070 / mu) * 1.25e-3)
    assert cf.corrected_path(one) == pytest.approx(2 * abs(field), rel=1e-12)


def test_constraints_of_equations_5_and_6():
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
    assert found["5b"].left == pytest.approx(cf.published_path(unit), rel=1e-12)
    assert found["5b"].right == pytest.approx(
        2 * np.exp(-2 * np.pi * 125 * 0.2 * 2.5e-3 / np.sqrt(D30 / (2 * (1 + nu)) / rho)), rel=1e-9
    )
    assert found["6d"].right == pytest.approx(D30 * rho / (1 + nu), rel=1e-9)
    assert all(c.margin > 0 for c in found.values())
    against_soft = {c.name: c for c in cf.constraints(unit, unit.control(0))}
    assert against_soft["6b"].margin < 0  # (b) fails against the softer control


@pytest.mark.parametrize("model", MODELS)
def test_arrays_give_what_single_calls_give(model):
    rng = np.random.default_rng(1)
    moduli = 10 ** rng.uniform(4, 6, (50, 2))
    walls, hertz = rng.uniform(0.5e-3, 5e-3, (50, 2)), rng.uniform(50, 300, 50)
    many = cf.Units(moduli, [1070.0] * 2, [0.4999] * 2, [0.2] * 2, walls, 2 * np.pi * hertz, [2.0] * 50)
    levels = edge_levels(many, model)
    assert levels.shape == (50,)
    for i in (0, 17, 49):
        one = cf.Units(moduli[i], [1070.0] * 2, [0.4999] * 2, [0.2] * 2, walls[i], 2 * np.pi * hertz[i], 2.0)
        assert levels[i] == pytest.approx(float(edge_levels(one, model)), rel=1e-14)


def test_the_measured_designs_are_shipped_and_alone_have_passes():
    assert {name: (design.passes, design.caps) for name, design in shipped().items() if design.passes} == {
        name: (measured.passes, measured.caps) for name, measured in measurements().designs.items()
    }


def test_the_log_linear_models_are_fitted_as_by_lstsq():
    table = measured_table()
    y = np.log(table.levels)
    soft = np.array([0, 0, 0, 1, 1, 0, 2, 2, 0.0])
    assert table.names[6:8] == ("encapsulating E10/D10", "encapsulating E10/D30")
    for i in range(9):
        kept = np.arange(9) != i
        ln_s, ln_q = np.linalg.lstsq(np.stack([np.ones(9), soft], axis=1)[kept], y[kept], rcond=None)[0]
        found = COMPARED["rule"].fit(table, kept[None].astype(float))[0]
        assert found == pytest.approx(np.exp([ln_s, ln_q]), rel=1e-9)
        means = COMPARED["baseline"].fit(table, kept[None].astype(float))[0]
        own = [np.exp(np.mean(y[kept & (table.classes == k)])) for k in range(4)]
        assert means == pytest.approx(own, rel=1e-9)
    assert stored()["rule"] == pytest.approx({"s": 0.513, "q": 0.282}, abs=0.001)


def test_a_class_without_units_has_the_mean_of_the_others():
    table = measured_table()
    kept = table.classes != 3
    level = COMPARED["baseline"].levels(table, kept[None].astype(float))[0][-2]
    assert level == pytest.approx(np.exp(np.mean(np.log(table.levels[kept]))), rel=1e-9)


def test_the_rule_between_equal_moduli_and_the_measured_ratio():
    """From s to s q^n in the logarithm of the ratio; then s q^n; s if the inside is stiffer."""
    s, q = stored()["rule"].values()
    whole = np.exp(unit_of_scale())
    assert whole == pytest.approx(250 / 15)
    for ratio, share in ((1 / 30, 0), (1, 0), (whole**0.25, 0.25), (whole**0.5, 0.5), (whole, 1), (100, 1)):
        unit = units(E10, E10 * ratio, passes=2.0)
        assert edge_levels(unit, "rule") == pytest.approx(s * q ** (2 * share), rel=1e-5)
    three = units(E10, 1e4 * E10, 1e8 * E10)
    assert edge_levels(three, "rule") == pytest.approx(s * q**2, rel=1e-5)


def test_a_class_left_out_costs_more():
    """By fits to the table without the class."""
    table, found = measured_table(), leave_one_class_out()
    assert tuple(found) == CLASSES
    for i, (_, errors) in enumerate(found.items()):
        kept = [int(row) for row in np.flatnonzero(table.classes != i)]
        for name, model in COMPARED.items():
            constants = model.fit(table.rows(kept), np.ones((1, len(kept))))
            predicted = np.exp(table.mean(lambda u, c=constants, m=model: m.logs(u, c).T)[:, 0])
            off = np.abs(np.log(predicted / table.levels))[table.classes == i]
            assert errors[name] == pytest.approx(np.exp(off.mean()), rel=1e-6)
    assert found["soft inside, two passes"]["rule"] == pytest.approx(1.76, abs=0.01)
    assert found["soft inside, two passes"]["baseline"] > 5


def test_what_leads_is_the_rule_unless_a_model_is_told_apart_from_it_and_the_baseline():
    own = {name: one.leave_one_out_errors for name, one in assessments().items()}
    assert leader(own) == "rule"
    n = np.ones(8)
    errors = {"rule": 0.4 * n, "baseline": 0.4 * n, "published": 0.1 * n, "corrected": 0.2 * n}
    assert leader(errors) == "published"
    assert leader({**errors, "baseline": 0.05 * n}) == "rule"  # worse than the baseline
    assert leader({**errors, "rule": 0.05 * n}) == "rule"
    assert leader({name: e[:5] for name, e in errors.items()}) == "rule"  # five units can't tell
    assert leader({name: e[:6] for name, e in errors.items()}) == "published"
    assert leader({**errors, "other": 0.0 * n}) == "published"  # gives no estimate


def test_a_spec_may_ask_for_every_model():
    assert set(get_args(Model)) == {*MODELS, FEM}
    assert {*MODELS, "baseline"} == set(COMPARED)

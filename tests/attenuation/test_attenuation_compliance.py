"""Surface compliance against 60-digit values, exact identities and refusals."""

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from benchmarks.accuracy import layered_mp
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import KelvinVoigt, LossFactor

COMPLIANCE = Path(layered_mp.__file__).parent / "references" / "compliance.json"
CASES = json.loads(COMPLIANCE.read_text("utf-8"))
LIMIT = 1e-13


def damping_of(tan_delta, viscosity):
    assert not (tan_delta and viscosity)
    return KelvinVoigt(viscosity) if viscosity else LossFactor(tan_delta) if tan_delta else None


def medium_of(bodies):
    layers = [Layer(h, rho, e, nu, damping_of(*loss)) for h, rho, e, nu, *loss in bodies[:-1]]
    _, rho, e, nu, *loss = bodies[-1]
    return LayeredMedium(layers, HalfSpace(rho, e, nu, damping_of(*loss)))


def relative_error(found, reference):
    return float(np.linalg.norm(found - reference) / np.linalg.norm(reference))


def case_error(case):
    found = medium_of(case["bodies"]).compliance(case["k"], case["omega"])
    reference = np.array([complex(*pair) for pair in case["compliance"]]).reshape(2, 2)
    return relative_error(found, reference) / case["condition"]


def test_sixty_digits_everywhere():
    errors = [case_error(case) for case in CASES]
    worst = int(np.argmax(errors))
    assert len(errors) == 450
    assert errors[worst] <= LIMIT, CASES[worst]


def _live(bodies, k, omega):
    with mp.workdps(60):
        bodies = [layered_mp.Body(*body) for body in bodies]
        found = layered_mp.compliance(bodies, k, omega)
        cond = layered_mp.condition(bodies, k, omega, found)
        return np.array(found.tolist(), dtype=complex), float(cond)


@pytest.mark.parametrize("nu", [0.3, 0.45, 0.5 - 1e-12, 0.5])
@pytest.mark.parametrize("off", [0.0, 1e-14, -1e-9])
def test_on_the_branch_points_of_a_thick_layer(nu, off):
    """Up and down are one and the same wave there; a reflection would lose six digits and more."""
    omega, mu = 6e3, 1e5 / (2 * (1 + nu))
    ks = omega / np.sqrt(mu / 1000)
    kp = ks * np.sqrt((1 - 2 * nu) / (2 * (1 - nu)))
    bodies = [(1e-2, 1000, 1e5, nu), (None, 1000, 3e6, 0.3)]
    for k in (ks * (1 + off), (kp or 1e-6 * ks) * (1 + off)):
        reference, cond = _live(bodies, k, omega)
        assert relative_error(medium_of([[*b, 0, 0] for b in bodies]).compliance(k, omega), reference) <= LIMIT * cond


@pytest.mark.parametrize("omega", [785.0, 0.0])
def test_ten_thousand_sublayers_change_nothing(omega):
    count, h, k = 10_000, 0.02, np.array([0.3, 80.0, 9e3])
    body = (1040.0, 15e3, 0.4999, LossFactor(0.2))
    base = HalfSpace(1900.0, 15e9, 0.3)
    whole = LayeredMedium([Layer(h, *body)], base).compliance(k, omega)
    cut = LayeredMedium([Layer(h / count, *body)] * count, base).compliance(k, omega)
    assert max(relative_error(one, other) for one, other in zip(cut, whole, strict=True)) < LIMIT


def test_shapes_and_complex_wavenumbers():
    medium = LayeredMedium([Layer(1e-3, 1000, 1e5, 0.45)], HalfSpace(1000, 3e4, 0.45))
    k = np.array([[10.0, 20.0, 30.0], [1e2, 1e3, 1e4]]) + 5j
    assert medium.compliance(k, 785.0).shape == (2, 3, 2, 2)
    assert np.array_equal(medium.compliance(k, 785.0)[1, 2], medium.compliance(k[1, 2], 785.0))

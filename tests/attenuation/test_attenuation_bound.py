"""Response.error is a bound on seeded random media, loads and tolerances; what has no answer is refused."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import FractionalKelvinVoigt, KelvinVoigt, LossFactor, UniformDisc
from unitcad.attenuation.layered.quadrature import Problem, evaluate
from unitcad.errors import Refusal, UnitcadError


def _random_case(seed):
    """(medium, load, omega, radii, rtol): 0 to 4 layers of mixed dampings, omega 0 to 3000, all drawn."""
    rng = np.random.default_rng(seed)

    def damping():
        laws = [
            None,
            LossFactor(rng.uniform(0, 0.5)),
            KelvinVoigt(10 ** rng.uniform(-1, 1.5)),
            FractionalKelvinVoigt(10 ** rng.uniform(-5, -2), 0.3),
        ]
        return laws[rng.integers(0, 4)]

    def material():
        nu = float(rng.choice([0.0, 0.3, 0.45, 0.49, 0.4999, 0.5]))
        return rng.uniform(500, 3000), 10 ** rng.uniform(3.5, 7), nu, damping()

    layers = [Layer(10 ** rng.uniform(-4, -1.5), *material()) for _ in range(rng.integers(0, 5))]
    medium = LayeredMedium(layers, HalfSpace(*material()))
    a = 10 ** rng.uniform(-3, -2)
    load = UniformDisc(a, "tangential" if rng.integers(0, 2) else "normal")
    omega = float(rng.choice([0.0, 1e-3, 10.0, 785.0, 785.0, 3000.0]))
    r = np.sort(10 ** rng.uniform(-3.5, -1.3, 5))
    return medium, load, omega, r, float(rng.choice([1e-2, 1e-3, 1e-4, 1e-6]))


def _off(found, truth):
    parts = ("u_r", "u_theta", "u_z")
    return float(max(np.max(np.abs(getattr(found, part) - getattr(truth, part))) for part in parts))


@pytest.mark.parametrize("block", [2, *(pytest.param(i, marks=pytest.mark.long) for i in (0, 1, 3, 4))])
def test_error_bounds_the_true_error_of_random_cases(block):
    for seed in range(40 * block, 40 * block + 40):
        medium, load, omega, r, rtol = _random_case(seed)
        found = medium.response(load, omega, r, rtol=rtol)
        truth = medium.response(load, omega, r, rtol=1e-4 * rtol)
        assert _off(found, truth) <= found.error + truth.error, seed
        assert truth.error < 0.3 * rtol * truth.largest, seed
        assert found.error <= 1.01 * rtol * truth.largest, seed


def test_error_under_a_disc_at_low_frequency():
    """Nearly incompressible: a pole next to the path, which only the last coefficients of a panel show."""
    medium = LayeredMedium([], HalfSpace(1156.455, 7520.563, 0.4999, FractionalKelvinVoigt(0.0017520116, 0.3)))
    r = [4.2379e-4, 1.20883e-3, 1.29139e-3, 1.68537e-3, 7.2161e-3, 0.01934345]
    found, truth = (medium.response(UniformDisc(1.0114377e-3), 10.0, r, rtol=rtol) for rtol in (1e-3, 1e-10))
    assert _off(found, truth) <= found.error


def test_no_answer_that_is_no_number_is_returned(monkeypatch):
    medium = LayeredMedium([Layer(1e-3, 1000, 1e5, 0.3)], HalfSpace(1000, 1e4, 0.3))
    monkeypatch.setattr(Problem, "kernel", lambda self, k: np.full((2, k.size), np.nan, dtype=complex))
    with pytest.raises(UnitcadError, match="no finite answer"):
        medium.response(UniformDisc(3e-3), 785.0, [1e-3, 1e-2], rtol=1e-3)


def test_waves_too_short_are_refused_before_any_work():
    medium = LayeredMedium([Layer(1e-3, 1000, 1e4, 0.5)], HalfSpace(1900, 15e9, 0.3))
    with pytest.raises(Refusal) as refused:
        medium.response(UniformDisc(3.5e-3), 1e9, [0.05])
    assert refused.value.field == "omega"
    nearest = refused.value.nearest
    assert isinstance(nearest, float)
    assert 1e4 < nearest < 1e9
    far = medium.response(UniformDisc(3.5e-3), nearest, [0.05], rtol=0.1)
    assert np.isfinite(far.error)


def test_a_pole_next_to_the_path_takes_few_rounds(monkeypatch):
    """With tan delta 0.01 the forearm's poles are 1 /m from the path: eight rounds when each panel was cut in two."""
    rounds = []
    monkeypatch.setattr(
        "unitcad.attenuation.layered.integral.evaluate", lambda *args: rounds.append(0) or evaluate(*args)
    )
    layers = [Layer(h, 1000, e, 0.49, LossFactor(0.01)) for h, e in ((1.5e-3, 130e3), (4e-3, 9e3), (25e-3, 12e3))]
    medium = LayeredMedium(layers, HalfSpace(1900, 15e9, 0.3, LossFactor(0.01)))
    found = medium.response(UniformDisc(3.5e-3), 785.0, [1e-3, 30e-3], rtol=1e-8)
    assert found.error <= 1e-8 * np.max(np.abs(found.u_z))
    assert len(rounds) <= 6

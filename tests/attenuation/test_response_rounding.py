"""Where only rounding is left, the errors of a response still hold: one material at rest, known in 30 digits."""

import mpmath as mp
import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import LossFactor, UniformDisc


def _order(order, s):
    """Integral of J1(k) J_order(ks) / k."""
    if order == 0:
        return mp.hyp2f1(0.5, -0.5, 1, s * s) if s <= 1 else mp.hyp2f1(0.5, 0.5, 2, s**-2) / (2 * s)
    if order == 1:
        return s / 2 if s <= 1 else 1 / (2 * s)
    return s * s / 8 * mp.hyp2f1(0.5, 1.5, 3, s * s) if s <= 1 else mp.hyp2f1(1.5, -0.5, 2, s**-2) / (2 * s)


def _integrals(load, r):
    """Integrals of q(k) J_n(kr) dk, n = 0, 1, 2."""
    a = mp.mpf(load.radius)
    s = mp.mpf(r) / a
    return a * _order(0, s), a * _order(1, s), a * _order(2, s)


def _exact(load, body, r):
    """(u_r, u_theta, u_z) by Boussinesq and Cerruti."""
    nu, loss = mp.mpf(body.poisson_ratio), body.damping
    mu = mp.mpf(body.youngs_modulus) / (2 * (1 + nu)) * mp.mpc(1, loss.tan_delta if loss else 0)
    along, across = (1 - nu) / mu, -(1 - 2 * nu) / (2 * mu)
    zeroth, first, second = _integrals(load, r)
    if load.direction == "tangential":
        a, b = (along + 1 / mu) / 2 * zeroth, (along - 1 / mu) / 2 * second
        return [a - b, -(a + b), -across * first]
    return [across * first, mp.mpf(0), along * zeroth]


def _case(seed):
    """Draw a body, whole or cut in up to three layers, a load, and radii: some at the rim, some far away."""
    rng = np.random.default_rng(seed)
    nu = float(rng.choice([-0.9, -0.3, 0.0, 0.01, 0.3, 0.45, 0.4999999, 0.5, rng.uniform(-0.5, 0.5)]))
    loss = LossFactor(rng.uniform(0.01, 0.5)) if rng.random() < 0.5 else None
    body = HalfSpace(1000.0, float(10 ** rng.uniform(3, 10)), nu, loss)
    layers = [
        Layer(10 ** rng.uniform(-4, -2), 1000.0, body.youngs_modulus, nu, loss) for _ in range(rng.integers(0, 4))
    ]
    radius = float(10 ** rng.uniform(-3.3, -2))
    load = UniformDisc(radius, "tangential" if seed % 3 else "normal")
    rim = radius * (1.0 + rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-15, -1))
    return LayeredMedium(layers, body), load, np.array([rim, *10 ** rng.uniform(-3.5, -1.3, 4)])


@pytest.mark.parametrize("seeds", [range(14), pytest.param(range(14, 210), marks=pytest.mark.long)])
def test_errors_hold_where_only_rounding_is_left_and_stay_as_small(seeds):
    """The closed form of the static half-space, its argument, the compliance that it is taken from."""
    for seed in seeds:
        medium, load, r = _case(seed)
        found = medium.response(load, 0.0, r, rtol=1e-9)
        with mp.workdps(30):
            exact = [_exact(load, medium.half_space, float(one)) for one in r]
            for i, name in enumerate(("r", "theta", "z")):
                u, bound = getattr(found, f"u_{name}"), getattr(found, f"error_{name}")
                wrong = [float(abs(mp.mpc(complex(one)) - true[i])) for one, true in zip(u, exact, strict=True)]
                assert np.all(wrong <= bound), (seed, name, np.max(np.array(wrong) / bound))
        assert found.error < 3e-14 * max(float(abs(part)) for true in exact for part in true), seed

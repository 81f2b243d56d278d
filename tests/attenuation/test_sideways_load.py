"""A load in the plane of the surface: Cerruti's closed forms, reciprocity, and SH waves against mpmath."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import special

from unitcad.attenuation import HalfSpace, KelvinVoigt, Layer, LayeredMedium, LossFactor, UniformDisc
from unitcad.attenuation.layered.loads import bessel_bounds, bessels

NU, E = 0.3, 3e4
MU = E / (2 * (1 + NU))
BODY = LayeredMedium([], HalfSpace(1000, E, NU))
FOREARM = LayeredMedium(
    [
        Layer(1.5e-3, 1100, 130e3, 0.49, LossFactor(0.14)),
        Layer(4e-3, 950, 9e3, 0.495, KelvinVoigt(3.0)),
        Layer(25e-3, 1050, 12e3, 0.495, KelvinVoigt(4.5)),
    ],
    HalfSpace(1900, 15e9, 0.3, LossFactor(0.01)),
)


A = 3.5e-3


def _cerruti(x, y):
    """Displacement (x, y, z) under a newton in x at the origin of the surface (Johnson, Contact Mechanics, 3.75)."""
    far, part = np.hypot(x, y), 1 - 2 * NU
    u_x = (1 + part) / far + (1 - part) * x**2 / far**3
    u_y = (1 - part) * x * y / far**3
    u_z = part * x / far**2
    return np.array([u_x, u_y, u_z]) / (4 * np.pi * MU)


def _on_a_disc(x, y):
    """The same under a pascal on a disc: beyond its edge, by Gauss over the radius and even steps around."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    rho, turn = A * (nodes + 1) / 2, np.linspace(0, 2 * np.pi, 200, endpoint=False)
    at = [part[..., None, None] - rho[:, None] * of(turn) for part, of in ((x, np.cos), (y, np.sin))]
    return _cerruti(*at).mean(axis=-1) @ (weights * np.pi * A * rho)


def test_a_traction_sideways_is_cerrutis():
    r = np.array([5e-3, 9e-3, 2e-2])
    response = BODY.response(UniformDisc(A, "tangential"), 0.0, r, rtol=1e-9)
    ahead, beside = _on_a_disc(r, 0 * r), _on_a_disc(0 * r, r)
    for value, exact in ((response.u_r, ahead[0]), (-response.u_theta, beside[0]), (response.u_z, ahead[2])):
        assert np.max(np.abs(value - exact)) <= response.error
    assert response.error < 1e-9 * np.max(np.abs(ahead))


@pytest.mark.parametrize("hertz", [0, 50, 125, 250])
def test_a_sideways_force_and_a_normal_one_are_reciprocal(hertz):
    """Betti: a force in x lifts the skin at r by what a force at r in z moves the origin in x."""
    r = np.linspace(7e-3, 37e-3, 5)
    sideways = FOREARM.response(UniformDisc(A, "tangential"), 2 * np.pi * hertz, r, rtol=1e-8)
    normal = FOREARM.response(UniformDisc(A), 2 * np.pi * hertz, r, rtol=1e-8)
    assert np.all(np.abs(sideways.u_z + normal.u_r) <= sideways.error_z + normal.error_r)


def _layers_in_mpmath(layers, base, k, omega):
    """SH compliance at the surface by Thomson and Haskell's matrices, in 60 digits."""

    def material(body):
        mu = mp.mpf(body.youngs_modulus) / (2 * (1 + mp.mpf(body.poisson_ratio))) * mp.mpc(1, body.damping.tan_delta)
        return mu, mp.sqrt(mp.mpf(k) ** 2 - mp.mpf(body.density) * mp.mpf(omega) ** 2 / mu)

    mu, rate = material(base)
    u, t = mp.mpc(1), mu * rate
    for layer in reversed(layers):
        mu, rate = material(layer)
        cosh, sinh = mp.cosh(rate * layer.thickness), mp.sinh(rate * layer.thickness)
        u, t = cosh * u + sinh / (mu * rate) * t, mu * rate * sinh * u + cosh * t
    return u / t


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_horizontal_shear_at_every_contrast(data):
    """Thicknesses over 8 decades, moduli over 12, k h up to 2,000."""

    def number(low, high):
        return 10 ** data.draw(st.floats(np.log10(low), np.log10(high)))

    layers = [
        Layer(number(1e-7, 10), number(1, 2e4), number(1e-2, 1e10), 0.3, LossFactor(number(1e-3, 1)))
        for _ in range(data.draw(st.integers(0, 4)))
    ]
    base = HalfSpace(number(1, 2e4), number(1e-2, 1e10), 0.3, LossFactor(number(1e-3, 1)))
    k, omega = number(1e-2, 300), number(1, 1e4)
    medium = LayeredMedium(layers, base)
    phase = 1 + sum(_phase(layer, k, omega) for layer in layers)
    assume(phase < 2000)
    ours = medium.shear_column(np.array([k], dtype=complex), omega)[0]
    with mp.workdps(60 + int(phase)):
        exact = _layers_in_mpmath(layers, base, k, omega)
        wrong = abs(mp.mpc(complex(ours)) - exact)
    assert wrong <= 4e-15 * phase / 1e-3 * abs(exact) + 1e-300


def _phase(layer, k, omega):
    mu = layer.youngs_modulus / 2.6
    return abs(np.sqrt(complex(k * k - layer.density * omega**2 / (mu * (1 + 1j * layer.damping.tan_delta))))) * (
        layer.thickness
    )


def test_bessel_functions_and_their_bounds():
    x = np.concatenate([[0.0], np.geomspace(1e-9, 300, 20001), np.linspace(0.5, 12, 20001)])
    for order, values in zip((0, 2, 1), bessels((0, 2, 1), x), strict=True):
        exact = special.jv(order, x)
        assert np.max(np.abs(values - exact)) < 2e-15
        small = (x > 0) & (x < 1)
        assert np.max(np.abs(values[small] / exact[small] - 1)) < 1e-14
        assert np.all(np.abs(values) <= bessel_bounds((order,), x)[0])

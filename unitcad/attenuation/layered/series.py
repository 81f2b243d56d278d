"""The exponential of a layer that is thin for one of its waves, without waves: no branch point, no pair that merges.

Elastodynamics in a layer is y' = A y. It couples a = (u_r, t_z) and b = (u_z, t_r) by a' = B b, b' = C a, so with
M = B C, and N = C B its adjugate, a layer upwards is cosh(h sqrt(M)), cosh(h sqrt(N)) and the sinh between them. A
function of h^2 M is p h^2 M + q, and with the same p and q of h^2 N: the four numbers of cosh and sinh follow from the
trace and the determinant of h^2 M alone. Its eigenvalues are (g_p h)^2 and (g_s h)^2.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w

THIN = 0.4
"""Below this max(|k|, |k_s|) h the series is summed: stiffness blocks, like 1/h, lose digits."""
_TERMS = 9
"""The next term is below 1e-18: the eigenvalues of h^2 M are at most 2 THIN^2."""
_COEFFICIENTS = np.array([[1.0 / factorial(2 * n + first) for n in range(_TERMS)] for first in (2, 4, 3, 5)])


class Gain(NamedTuple):
    """exp(-A h) - 1 in blocks of shape (2, 2, n): a gains `a_of_a` a + `a_of_b` b, b `b_of_a` a + `b_of_b` b."""

    a_of_a: w.Array
    a_of_b: w.Array
    b_of_a: w.Array
    b_of_b: w.Array

    def added(self, u: w.Array, t: w.Array) -> tuple[w.Array, w.Array]:
        """Return the states (u, t) at the top, shape (2, m, n) each, of those at the bottom."""
        a, b = np.array([u[0], t[1]]), np.array([u[1], t[0]])
        top_a = a + (w.product(self.a_of_a, a) + w.product(self.a_of_b, b))
        top_b = b + (w.product(self.b_of_a, a) + w.product(self.b_of_b, b))
        return np.array([top_a[0], top_b[0]]), np.array([top_b[1], top_a[1]])


def gain(material: w.Material, k: w.Array, h: float) -> Gain:
    """Return what a state gains over a layer of thickness h (m), at wavenumbers k (1/m), shape (n,).

    By the series of a thin layer, doubled until it is h thick: cosh 2x - 1 = 2 sinh^2 x, sinh 2x = 2 sinh x cosh x.
    """
    mu, eps, ks2 = material.shear, material.eps, material.ks2
    size = max(float(np.max(np.abs(k))), abs(ks2) ** 0.5) * h
    doublings = int(np.ceil(np.log2(max(size / THIN, 1.0))))
    thin = h / 2**doublings
    k2 = k * k
    trace = (2.0 * k2 - (1.0 + eps) * ks2) * thin**2
    determinant = (k2 - eps * ks2) * (k2 - ks2) * thin**4
    cosh, sinh = _series(trace, determinant)
    for _ in range(doublings):
        square = _product(sinh, sinh, trace, determinant)
        sinh = sinh + _product(sinh, cosh, trace, determinant)
        # times 2 h^2 M; and in terms of the doubled layer's h^2 M, which is four times as large
        cosh = np.array([trace * square[0] + square[1], -determinant * square[0]]) * 2.0
        cosh[0] /= 4.0
        sinh[0] /= 4.0
        trace, determinant = 4.0 * trace, 16.0 * determinant
    lame = (1.0 - 2.0 * eps) * k
    stiff = (4.0 * (1.0 - eps) * k2 - ks2) * mu
    one = np.ones_like(k)
    of_b = np.array([[k, -one / mu], [ks2 * mu * one, -k]])
    of_a = np.array([[-lame, -eps / mu * one], [-stiff, lame]])
    m = np.array(
        [
            [(3.0 - 2.0 * eps) * k2 - ks2, (eps - 1.0) / mu * k],
            [2.0 * (1.0 - eps) * mu * k * (2.0 * k2 - ks2), -(1.0 - 2.0 * eps) * k2 - eps * ks2],
        ]
    ) * (h * h)
    n = w.adjugate(m)
    return Gain(
        _function(cosh, m),
        w.product(_function(-h * sinh, m), of_b),
        w.product(_function(-h * sinh, n), of_a),
        _function(cosh, n),
    )


def _series(trace: w.Array, determinant: w.Array) -> tuple[w.Array, w.Array]:
    """Return (p, q), shape (2, n), of cosh(x) - 1 and of sinh(x) / x, for small x^2 of that trace and determinant.

    (x^2)^n is H_(n-1) x^2 - determinant H_(n-2), H the complete homogeneous polynomials of its eigenvalues.
    """
    powers = np.empty((_TERMS, trace.size), dtype=np.complex128)
    powers[0], powers[1] = 1.0, trace
    for n in range(2, _TERMS):
        powers[n] = trace * powers[n - 1] - determinant * powers[n - 2]
    sums = _COEFFICIENTS @ powers
    sums[1::2] *= -determinant
    sums[3] += 1.0
    return sums[:2], sums[2:]


def _product(one: w.Array, other: w.Array, trace: w.Array, determinant: w.Array) -> w.Array:
    """Return (p, q) of the product of two functions of one matrix: M^2 = trace M - determinant."""
    both = one[0] * other[0]
    return np.array([one[0] * other[1] + one[1] * other[0] + trace * both, one[1] * other[1] - determinant * both])


def _function(pq: w.Array, matrix: w.Array) -> w.Array:
    """Return p matrix + q, shape (2, 2, n)."""
    out = pq[0] * matrix
    out[0, 0] += pq[1]
    out[1, 1] += pq[1]
    return out

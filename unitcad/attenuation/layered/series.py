"""The exponential of a layer that is thin for one of its waves, without waves: no branch point, no pair that merges.

Elastodynamics in a layer is y' = A y. It couples a = (u_r, t_z) and b = (u_z, t_r) by a' = B b, b' = C a, so with
M = B C, and N = C B its adjugate, a layer upwards is cosh(h sqrt(M)), cosh(h sqrt(N)) and the sinh between them. A
function of h^2 M is p h^2 M + q, and with the same p and q of h^2 N: the four numbers of cosh and sinh follow from the
trace and the determinant of h^2 M alone. Its eigenvalues are (g_p h)^2 and (g_s h)^2.
"""

from __future__ import annotations

from bisect import bisect_left
from math import factorial
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w

THIN = 0.4
"""Below this max(|k|, |k_s|) h the series is summed: stiffness blocks, like 1/h, lose digits."""
_SUMMED = 1.6
"""Of the same: up to where the series is summed at once."""
_LEFT_OUT = 1e-18
"""Of 1: the first term that is not summed. The eigenvalues of h^2 M are at most 2 (max(|k|, |k_s|) h)^2."""
_MOST_TERMS = 14
_REACH = [(0.5 * (_LEFT_OUT * factorial(2 * n)) ** (1.0 / n)) ** 0.5 for n in range(1, _MOST_TERMS + 1)]
"""Up to which max(|k|, |k_s|) h one term, two and so on are enough."""
_COEFFICIENTS = np.array([[1.0 / factorial(2 * n + first) for n in range(_MOST_TERMS)] for first in (2, 4, 3, 5)])


class Exponential(NamedTuple):
    """exp(-A h) at wavenumbers k, shape (n,), by what it does to a state.

    rates (2, 2, 2, n): B and C; cosh, sinh (2, n): the p and q of cosh(h sqrt(M)) - 1 and of -h times sinh(h sqrt(M)) /
    (h sqrt(M)), where p is of M itself.
    """

    rates: w.Array
    cosh: w.Array
    sinh: w.Array

    def raised(self, states: w.Array) -> w.Array:
        """Return the states (u_r, u_z, t_r, t_z) at the top, shape (4, m, n), of those at the bottom."""
        both = states[[0, 3, 1, 2]].reshape(2, 2, *states.shape[1:])  # a and b
        first = w.product(self.rates, both[::-1])
        second = w.product(self.rates, first[::-1])
        third = w.product(self.rates, second[::-1])
        top = both + (self.cosh[1] * both + self.sinh[1] * first + self.cosh[0] * second + self.sinh[0] * third)
        return top.reshape(states.shape)[[0, 2, 3, 1]]


def exponential(material: w.Material, k: w.Array, h: float) -> Exponential:
    """Return what a layer of thickness h (m) does to a state at wavenumbers k (1/m), shape (n,).

    By the series of a thin layer, doubled until it is h thick: cosh 2x - 1 = 2 sinh^2 x, sinh 2x = 2 sinh x cosh x.
    """
    mu, eps, ks2 = material.shear, material.eps, material.ks2
    size = max(float(np.max(np.abs(k))), abs(ks2) ** 0.5) * h
    doublings = int(np.ceil(np.log2(max(size / _SUMMED, 1.0))))
    thin = h / 2**doublings
    k2 = k * k
    trace = (2.0 * k2 - (1.0 + eps) * ks2) * thin**2
    determinant = (k2 - eps * ks2) * (k2 - ks2) * thin**4
    cosh, sinh = _series(trace, determinant, max(2, 1 + bisect_left(_REACH, size / 2**doublings)))
    for _ in range(doublings):
        square = _product(sinh, sinh, trace, determinant)
        sinh = sinh + _product(sinh, cosh, trace, determinant)
        # times 2 h^2 M; and in terms of the doubled layer's h^2 M, which is four times as large
        cosh = np.array([trace * square[0] + square[1], -determinant * square[0]]) * 2.0
        cosh[0] /= 4.0
        sinh[0] /= 4.0
        trace, determinant = 4.0 * trace, 16.0 * determinant
    rates = np.empty((2, 2, 2, k.size), dtype=np.complex128)
    of_b, of_a = rates
    lame, stiff = (1.0 - 2.0 * eps) * k, (4.0 * (1.0 - eps) * k2 - ks2) * mu
    of_b[0, 0], of_b[0, 1] = k, -1.0 / mu
    of_b[1, 0], of_b[1, 1] = ks2 * mu, -k
    of_a[0, 0], of_a[0, 1] = -lame, -eps / mu
    of_a[1, 0], of_a[1, 1] = -stiff, lame
    scale = np.array([[h * h], [1.0]])
    return Exponential(rates, cosh * scale, sinh * (-h * scale))


def _series(trace: w.Array, determinant: w.Array, terms: int) -> tuple[w.Array, w.Array]:
    """Return (p, q), shape (2, n), of cosh(x) - 1 and of sinh(x) / x, for small x^2 of that trace and determinant.

    (x^2)^n is H_(n-1) x^2 - determinant H_(n-2), H the complete homogeneous polynomials of its eigenvalues.
    """
    powers = np.empty((terms, trace.size), dtype=np.complex128)
    powers[0], powers[1] = 1.0, trace
    for n in range(2, terms):
        powers[n] = trace * powers[n - 1] - determinant * powers[n - 2]
    sums = (_COEFFICIENTS[:, :terms] @ powers.view(np.float64)).view(np.complex128)
    sums[1::2] *= -determinant
    sums[3] += 1.0
    return sums[:2], sums[2:]


def _product(one: w.Array, other: w.Array, trace: w.Array, determinant: w.Array) -> w.Array:
    """Return (p, q) of the product of two functions of one matrix: M^2 = trace M - determinant."""
    both = one[0] * other[0]
    return np.array([one[0] * other[1] + one[1] * other[0] + trace * both, one[1] * other[1] - determinant * both])

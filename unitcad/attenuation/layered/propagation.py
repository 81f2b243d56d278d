"""Waves of one material in the Hankel domain, and a stack's state carried through a layer, at many wavenumbers.

Plane strain, in 2x2 blocks: a field is u_r = U(z) J1(kr), u_z = W(z) J0(kr); its traction on a plane z = const, acting
on the medium below, is (-sigma_rz, -sigma_zz). A block is an array of shape (2, 2, n): rows (r, z), columns the two
waves, n wavenumbers.

The two waves going down are P = (k, g_p) e^{-g_p z} and Q = (S - P) / k_s^2, where S = (g_s, k) e^{-g_s z},
g_p^2 = k^2 - eps k_s^2, g_s^2 = k^2 - k_s^2, k_s^2 = rho omega^2 / mu. P and S become one and the same as omega -> 0;
P and Q do not, because each difference is written cancelled (k - g_s = k_s^2 / (k + g_s)). At nu = 1/2 only eps = 0
remains of the Poisson's ratio. A wave going up is the mirror image: W and sigma_rz change sign.

The exponential of a layer that is thin for one of its waves, without waves: no branch point, no pair that merges.

Elastodynamics in a layer is y' = A y. It couples a = (u_r, t_z) and b = (u_z, t_r) by a' = B b, b' = C a, so with
M = B C, and N = C B its adjugate, a layer upwards is cosh(h sqrt(M)), cosh(h sqrt(N)) and the sinh between them. A
function of h^2 M is p h^2 M + q, and with the same p and q of h^2 N: the four numbers of cosh and sinh follow from the
trace and the determinant of h^2 M alone. Its eigenvalues are (g_p h)^2 and (g_s h)^2.

Propagation of a stack's state through one layer, upwards, at many wavenumbers.

A state is (u_r, u_z, t_r, t_z). A plane is a (4, 2, n) block of them, (U, T): all states u = U c, t = T c that the
stack below can carry. By reciprocity any two of them have u . t' = t . u', so the plane's own equation is
T^T u = U^T t.

Horizontally polarised shear (SH) in a stack: the waves of a sideways force besides those of an axial one.

A field is u_theta = V(z) J'(kr) and the like; its traction on a plane z = const, acting on the medium below, is -mu V'.
Per wavenumber the state is the pair (V, -mu V'), carried upwards from the half-space by decaying exponentials only:
the two terms of each sum are of one sign but at a resonance of the stack, so that nothing is lost to cancellation.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from math import factorial
from typing import Any, NamedTuple

import numpy as np

Array = Any  # a complex numpy array


@dataclass(frozen=True)
class Material:
    """One material at one frequency: complex shear modulus mu (Pa), eps = mu / (lambda + 2 mu), k_s^2 (1/m^2)."""

    shear: complex
    eps: float
    ks2: complex

    @property
    def branch_points(self) -> tuple[complex, complex]:
        """Wavenumbers (1/m) of the two waves, k_p and k_s: next to them a vertical rate is a square root."""
        ks = np.sqrt(self.ks2)
        return np.sqrt(self.eps) * ks, ks


@dataclass(frozen=True)
class Waves:
    """The waves of a material that go down, at wavenumbers k: vertical rates g_p, g_s (1/m), states (4, 2, n)."""

    gp: Array
    gs: Array
    down: Array


UPWARDS = np.array([1.0, -1.0, -1.0, 1.0])[:, None, None]
"""Times the states of a wave that goes down: those of the one that goes up."""


def product(a: Array, b: Array) -> Array:
    """Return the matrix products of (.., l, 2, n) blocks and (.., 2, m, n) ones."""
    return a[..., 0, None, :] * b[..., None, 0, :, :] + a[..., 1, None, :] * b[..., None, 1, :, :]


def det(a: Array) -> Array:
    """Return the determinant of a (2, 2, n) block, shape (n,)."""
    return a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]


def adjugate(a: Array) -> Array:
    """Return the adjugate of a (2, 2, n) block: its inverse times its determinant."""
    return np.array([[a[1, 1], -a[0, 1]], [-a[1, 0], a[0, 0]]])


def decaying_root(squared: Array) -> Array:
    """Return sqrt with Re >= 0, and +i on the negative real axis: waves decay or leave downwards.

    Below that axis it goes on from there, so that a wavenumber may leave the real axis either way.
    """
    root = np.sqrt(squared)
    below = (squared.real < 0) & np.signbit(squared.imag)
    return np.where(below, -root, root) if np.any(below) else root


def vertical_rates(material: Material, k: Array) -> tuple[Array, Array]:
    """Return vertical rates g_p and g_s (1/m), factored so that they keep their digits next to the branch points."""
    kp, ks = material.branch_points
    return decaying_root((k - kp) * (k + kp)), decaying_root((k - ks) * (k + ks))


def solve_waves(material: Material, k: Array, gp: Array, gs: Array) -> Waves:
    """Return the waves P and Q of `material` at complex wavenumbers k (1/m), shape (n,), by their `vertical_rates`."""
    eps, ks2, mu = material.eps, material.ks2, material.shear
    below_p, below_s = 1.0 / (gp + k), 1.0 / (gs + k)
    down = np.empty((4, 2, k.size), dtype=np.complex128)
    down[0, 0], down[0, 1] = k, -below_s
    down[1, 0], down[1, 1] = gp, eps * below_p
    down[2, 0], down[2, 1] = 2.0 * mu * k * gp, mu * (2.0 * eps * k * below_p - 1.0)
    down[3, 0], down[3, 1] = mu * (2.0 * k * k - ks2), -mu * ks2 * below_s * below_s
    return Waves(gp, gs, down)


def decay_over(material: Material, solved: Waves, h: float) -> Array:
    """Return E(h): amplitudes of (P, Q) a depth h lower, upper triangular; only decaying exponentials are formed."""
    ep, es = np.exp(-solved.gp * h), np.exp(-solved.gs * h)
    sum_ = solved.gp + solved.gs
    phase = material.ks2 * (1.0 - material.eps) * h / sum_  # (g_p - g_s) h
    turned = phase.real > 0
    towards = np.where(turned, -phase, phase)
    safe = np.where(towards == 0, 1.0, towards)
    regular = np.where(towards == 0, 1.0, np.expm1(safe) / safe) * np.where(turned, es, ep)
    return np.array([[ep, (1.0 - material.eps) * h / sum_ * regular], [np.zeros_like(ep), es]])


THIN = 0.4
"""Below this max(|k|, |k_s|) h the series is summed: stiffness blocks, like 1/h, lose digits."""
_SUMMED = 1.6
"""Of the same: up to this the series is summed at once."""
_LEFT_OUT = 1e-18
"""Of 1: the first term that is not summed. The eigenvalues of h^2 M are at most 2 (max(|k|, |k_s|) h)^2."""
_MOST_TERMS = 14
_REACH = [(0.5 * (_LEFT_OUT * factorial(2 * n)) ** (1.0 / n)) ** 0.5 for n in range(1, _MOST_TERMS + 1)]
"""Up to which max(|k|, |k_s|) h one term, two and so on are enough."""
_COEFFICIENTS = np.array([[1.0 / factorial(2 * n + first) for n in range(_MOST_TERMS)] for first in (2, 4, 3, 5)])


class Exponential(NamedTuple):
    """exp(-A h) at wavenumbers k, shape (n,), by its effect on a state.

    rates (2, 2, 2, n): B and C; cosh, sinh (2, n): the p and q of cosh(h sqrt(M)) - 1 and of -h times sinh(h sqrt(M)) /
    (h sqrt(M)), where p is of M itself.
    """

    rates: Array
    cosh: Array
    sinh: Array

    def raised(self, states: Array) -> Array:
        """Return the states (u_r, u_z, t_r, t_z) at the top, shape (4, m, n), of those at the bottom."""
        both = states[[0, 3, 1, 2]].reshape(2, 2, *states.shape[1:])  # a and b
        first = product(self.rates, both[::-1])
        second = product(self.rates, first[::-1])
        third = product(self.rates, second[::-1])
        top = both + (self.cosh[1] * both + self.sinh[1] * first + self.cosh[0] * second + self.sinh[0] * third)
        return top.reshape(states.shape)[[0, 2, 3, 1]]


def exponential(material: Material, k: Array, h: float) -> Exponential:
    """Return the effect of a layer of thickness h (m) on a state at wavenumbers k (1/m), shape (n,).

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


def _series(trace: Array, determinant: Array, terms: int) -> tuple[Array, Array]:
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


def _product(one: Array, other: Array, trace: Array, determinant: Array) -> Array:
    """Return (p, q) of the product of two functions of one matrix: M^2 = trace M - determinant."""
    both = one[0] * other[0]
    return np.array([one[0] * other[1] + one[1] * other[0] + trace * both, one[1] * other[1] - determinant * both])


class Plane(NamedTuple):
    """States at an interface per parameter c, shape (4, 2, n).

    summed: whether some are as the series left them, not `charted`.
    """

    states: Array
    summed: bool = False

    @property
    def u(self) -> Array:
        return self.states[:2]

    @property
    def t(self) -> Array:
        return self.states[2:]


def underside(material: Material, k: Array) -> Plane:
    """Return the plane at the top of a half-space (or of nothing, if its modulus is 0)."""
    if material.shear == 0:
        free = np.zeros((4, 2, k.size), dtype=np.complex128)
        free[0, 0] = free[1, 1] = 1.0
        return Plane(free)
    return Plane(solve_waves(material, k, *vertical_rates(material, k)).down)


def raise_plane(material: Material, h: float, k: Array, below: Plane) -> Plane:
    """Return the plane at a layer's top from the plane at its bottom, each wavenumber by the method that suits it."""
    if h == 0.0:
        return below
    rates = vertical_rates(material, k)
    by_series = merging(material, h, k, rates)
    parts = [(_thick, np.flatnonzero(~by_series)), (_thin, np.flatnonzero(by_series))]
    for method, part in parts:
        if part.size == k.size:
            return method(material, h, k, rates, below)
    states = np.empty_like(below.states)
    for method, part in parts:
        plane = Plane(below.states[..., part], below.summed)
        states[..., part] = method(material, h, k[part], (rates[0][part], rates[1][part]), plane).states
    return Plane(states, summed=True)


def merging(material: Material, h: float, k: Array, rates: tuple[Array, Array]) -> np.ndarray:
    """Return at which wavenumbers the waves down and up are alike, so that reflection would lose digits.

    The layer is thin for both waves, or one of them hardly changes over it: next to its branch point, or k h small
    where k_s h is not.
    """
    thin = np.maximum(np.abs(k), abs(material.ks2) ** 0.5) * h < THIN
    return thin | (np.minimum(np.abs(rates[0]), np.abs(rates[1])) * h < THIN)


def _thin(material: Material, h: float, k: Array, rates: tuple[Array, Array], below: Plane) -> Plane:
    """Propagate by the series, in pieces across which nothing grows by more than e.

    One piece leaves a plane as well conditioned as it was, or nearly so: it is charted before the next one.
    """
    pieces = max(1, int(np.ceil(max(float(np.max(rate.real)) for rate in rates) * h)))
    layer = exponential(material, k, h / pieces)
    for _ in range(pieces):
        if below.summed:
            below = charted(below)
        below = Plane(layer.raised(below.states), summed=True)
    return below


def _thick(material: Material, h: float, k: Array, rates: tuple[Array, Array], below: Plane) -> Plane:
    """Propagate by reflection.

    The amplitudes are a down at the top and R E a up at the bottom, with R from the plane's own equation.
    """
    waves = solve_waves(material, k, *rates)
    terms = below.states[[2, 3, 0, 1], :, None] * waves.down[:, None]
    # The waves up are those down but for signs, so both sides have the same terms.
    of_r, of_z = terms[::2], terms[1::2]
    less, more = of_r - of_z, of_r + of_z
    system, given = less[0] + less[1], more[1] - more[0]
    e = decay_over(material, waves, h)
    reflected = product(adjugate(system), product(given, e)) / det(system)
    return Plane(waves.down + UPWARDS * product(waves.down, product(e, reflected)))


def charted(raw: Plane) -> Plane:
    """Return the same plane with u or t the identity, whichever inverse is better conditioned."""
    det_u, det_t = det(raw.u), det(raw.t)
    # of the Frobenius norms
    square_u, square_t = np.square(np.abs(raw.states)).reshape(2, 4, -1).sum(axis=1)
    by_u = square_u * np.abs(det_t) <= square_t * np.abs(det_u)
    inverse = adjugate(np.where(by_u, raw.u, raw.t)) / np.where(by_u, det_u, det_t)
    ratio = product(np.where(by_u, raw.t, raw.u), inverse)
    states = np.empty_like(raw.states)
    one = np.eye(2)[..., None]
    states[:2], states[2:] = np.where(by_u, one, ratio), np.where(by_u, ratio, one)
    return Plane(states)


def shear_compliance(half_space: Material, layers: Iterable[tuple[Material, float]], k: Array) -> Array:
    """Return the SH displacement per surface traction (m/Pa), shape (n,), for wavenumbers k (n,) in 1/m.

    layers: material and thickness (m), the lowest first.
    """
    rate = vertical_rates(half_space, k)[1]
    u, t = np.ones_like(rate), half_space.shear * rate
    for material, h in layers:
        u, t = _raise_shear(material, h, k, u, t)
    return u / t


def _raise_shear(material: Material, h: float, k: Array, u: Array, t: Array) -> tuple[Array, Array]:
    """Return the state at a layer's top for that at its bottom, up to a factor.

    exp(-g h) times cosh and sinh; then over the larger of the two entries, each in its own unit, so that neither
    overflows over many layers.
    """
    rate = vertical_rates(material, k)[1]
    once = np.exp(-rate * h)
    cosh = (1.0 + once * once) / 2.0
    safe = np.where(rate == 0, 1.0, rate)
    sinh_over_rate = np.where(rate == 0, h, -np.expm1(-2.0 * rate * h) / (2.0 * safe))
    top_u = cosh * u + sinh_over_rate / material.shear * t
    top_t = material.shear * rate * rate * sinh_over_rate * u + cosh * t
    stiffness = abs(material.shear) * np.maximum(np.abs(k), abs(material.ks2) ** 0.5)
    size = np.maximum(np.abs(top_u), np.abs(top_t) / stiffness)
    return top_u / size, top_t / size

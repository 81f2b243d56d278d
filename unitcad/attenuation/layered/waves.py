"""Plane-strain waves of one material in the Hankel domain, in 2x2 blocks over many wavenumbers at once.

A field is u_r = U(z) J1(kr), u_z = W(z) J0(kr); its traction on a plane z = const, acting on the body below, is
(-sigma_rz, -sigma_zz). A block is an array of shape (2, 2, n): rows (r, z), columns the two waves, n wavenumbers.

The two waves going down are P = (k, g_p) e^{-g_p z} and Q = (S - P) / k_s^2, where S = (g_s, k) e^{-g_s z},
g_p^2 = k^2 - eps k_s^2, g_s^2 = k^2 - k_s^2, k_s^2 = rho omega^2 / mu. P and S become one and the same as omega -> 0;
P and Q do not, because each difference is written cancelled (k - g_s = k_s^2 / (k + g_s)). At nu = 1/2 only eps = 0
remains of the Poisson's ratio. A wave going up is the mirror image: W and sigma_rz change sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = Any  # a complex numpy array
THIN = 0.4  # below this max(|k|, |k_s|) h a layer is propagated by series: its stiffness blocks, like 1/h, lose digits
_TERM = 1e-18


@dataclass(frozen=True)
class Material:
    """One material at one frequency: complex shear modulus mu (Pa), eps = mu / (lambda + 2 mu), k_s^2 (1/m^2)."""

    shear: complex
    eps: float
    ks2: complex


@dataclass(frozen=True)
class Waves:
    """The waves of a material at wavenumbers k: vertical rates g_p, g_s (1/m), displacement and traction blocks."""

    gp: Array
    gs: Array
    displacement: Array
    traction: Array


def product(a: Array, b: Array) -> Array:
    """Return the matrix product of two (2, 2, n) blocks (or of a block and an (2, m, n) one)."""
    return a[:, 0, None] * b[None, 0] + a[:, 1, None] * b[None, 1]


def determinant(a: Array) -> Array:
    """Return the determinant of a (2, 2, n) block, shape (n,)."""
    return a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]


def adjugate(a: Array) -> Array:
    """Return the adjugate of a (2, 2, n) block: its inverse times its determinant."""
    return np.array([[a[1, 1], -a[0, 1]], [-a[1, 0], a[0, 0]]])


def mirrored(a: Array) -> Array:
    """Return J a with J = diag(1, -1): the block of the waves that go up."""
    return np.array([a[0], -a[1]])


def decaying_root(squared: Array) -> Array:
    """Return sqrt with Re >= 0, and +i on the negative real axis: waves decay or leave downwards.

    Below that axis it goes on from there, so that a wavenumber may leave the real axis either way.
    """
    root = np.sqrt(squared.real + 1j * (squared.imag + 0.0))
    return np.where((squared.real < 0) & (squared.imag < 0), -root, root)


def rates(material: Material, k: Array) -> tuple[Array, Array]:
    """Return vertical rates g_p and g_s (1/m), factored so that they keep their digits next to the branch points."""
    ks = np.sqrt(material.ks2)
    kp = np.sqrt(material.eps) * ks
    return decaying_root((k - kp) * (k + kp)), decaying_root((k - ks) * (k + ks))


def waves(material: Material, k: Array) -> Waves:
    """Return the waves P and Q of `material` at complex wavenumbers k, shape (n,), in 1/m."""
    eps, ks2, mu = material.eps, material.ks2, material.shear
    gp, gs = rates(material, k)
    below_p, below_s = 1.0 / (gp + k), 1.0 / (gs + k)
    displacement = np.array([[k, -below_s], [gp, eps * below_p]])
    traction = mu * np.array(
        [[2.0 * k * gp, 2.0 * eps * k * below_p - 1.0], [2.0 * k * k - ks2, -ks2 * below_s * below_s]]
    )
    return Waves(gp, gs, displacement, traction)


def decay(material: Material, solved: Waves, h: float) -> Array:
    """Return E(h): amplitudes of (P, Q) a depth h lower, upper triangular; only decaying exponentials are formed."""
    ep, es = np.exp(-solved.gp * h), np.exp(-solved.gs * h)
    sum_ = solved.gp + solved.gs
    phase = material.ks2 * (1.0 - material.eps) * h / sum_  # (g_p - g_s) h
    turned = phase.real > 0
    towards = np.where(turned, -phase, phase)
    regular = _expm1_over(towards) * np.where(turned, es, ep)
    return np.array([[ep, (1.0 - material.eps) * h / sum_ * regular], [np.zeros_like(ep), es]])


def _expm1_over(x: Array) -> Array:
    """Return (e^x - 1) / x, 1 at x = 0."""
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, np.expm1(safe) / safe)


def thin_step(material: Material, k: Array, h: float, u: Array, t: Array, up: bool = True) -> tuple[Array, Array]:
    """Return what (u, t), shape (2, m, n), gain over a thin layer of thickness h: the series of exp(-+A h) - 1.

    `up`: from the layer's bottom to its top, else from top to bottom. Equation y' = A y of elastodynamics in (u, t).
    """
    mu, eps, ks2 = material.shear, material.eps, material.ks2
    step = -h if up else h
    size = 2.0 * h * max(float(np.max(np.abs(k))), abs(ks2) ** 0.5)
    stiff = (4.0 * (1.0 - eps) * k * k - ks2) * mu
    mass = ks2 * mu
    k_lame = (1.0 - 2.0 * eps) * k
    gained_u, gained_t = np.zeros_like(u), np.zeros_like(t)
    bound, term = 1.0, 0
    while bound > _TERM:
        term += 1
        bound *= size / term
        u, t = (
            np.array([k * u[1] - t[0] / mu, -k_lame * u[0] - eps / mu * t[1]]) * (step / term),
            np.array([k_lame * t[1] - stiff * u[0], mass * u[1] - k * t[0]]) * (step / term),
        )
        gained_u += u
        gained_t += t
    return gained_u, gained_t


def squared_step(material: Material, k: Array, h: float) -> Array:
    """Return exp(-A h) - 1 as (4, 4, n) in (u_r, u_z, t_r, t_z): a thin layer's, doubled until it is h thick."""
    size = max(float(np.max(np.abs(k))), abs(material.ks2) ** 0.5) * h
    doublings = max(0, int(np.ceil(np.log2(size / THIN))))
    one: Array = np.zeros((4, 4, k.size), dtype=np.complex128)
    one[range(4), range(4)] = 1.0
    gained = np.concatenate(thin_step(material, k, h / 2**doublings, one[:2], one[2:]))
    for _ in range(doublings):
        gained = 2.0 * gained + np.einsum("ijn,jkn->ikn", gained, gained)
    return gained

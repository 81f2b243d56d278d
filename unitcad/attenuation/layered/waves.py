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


@dataclass(frozen=True)
class Material:
    """One material at one frequency: complex shear modulus mu (Pa), eps = mu / (lambda + 2 mu), k_s^2 (1/m^2)."""

    shear: complex
    eps: float
    ks2: complex


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


def determinant(a: Array) -> Array:
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


def rates(material: Material, k: Array) -> tuple[Array, Array]:
    """Return vertical rates g_p and g_s (1/m), factored so that they keep their digits next to the branch points."""
    ks = np.sqrt(material.ks2)
    kp = np.sqrt(material.eps) * ks
    return decaying_root((k - kp) * (k + kp)), decaying_root((k - ks) * (k + ks))


def waves(material: Material, k: Array, gp: Array, gs: Array) -> Waves:
    """Return the waves P and Q of `material` at complex wavenumbers k, shape (n,), in 1/m, with their `rates`."""
    eps, ks2, mu = material.eps, material.ks2, material.shear
    below_p, below_s = 1.0 / (gp + k), 1.0 / (gs + k)
    down = np.empty((4, 2, k.size), dtype=np.complex128)
    down[0, 0], down[0, 1] = k, -below_s
    down[1, 0], down[1, 1] = gp, eps * below_p
    down[2, 0], down[2, 1] = 2.0 * mu * k * gp, mu * (2.0 * eps * k * below_p - 1.0)
    down[3, 0], down[3, 1] = mu * (2.0 * k * k - ks2), -mu * ks2 * below_s * below_s
    return Waves(gp, gs, down)


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

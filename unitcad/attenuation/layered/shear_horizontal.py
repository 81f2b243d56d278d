"""Horizontally polarised shear (SH) in a stack: what a sideways force adds to the waves of an axial one.

A field is u_theta = V(z) J'(kr) and the like; its traction on a plane z = const, acting on the body below, is -mu V'.
Per wavenumber the state is the pair (V, -mu V'), carried upwards from the half-space by decaying exponentials only:
the two terms of each sum are of one sign but at a resonance of the stack, so that nothing is lost to cancellation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unitcad.attenuation.layered import waves as w

Piece = tuple[w.Material, float, bool]
"""Material, thickness (m), and whether the piece lies above the depth that is asked for; top first."""


def compliance(half_space: w.Material, pieces: Sequence[Piece], k: w.Array) -> w.Array:
    """Return the SH displacement at the depth per surface traction (m/Pa), shape (n,), for wavenumbers k (n,) in 1/m.

    The depth is the top of the first piece that is not above it, or of the half-space; 0 where no piece is above.
    """
    rate = _rate(half_space, k)
    u, t = np.ones_like(rate), half_space.shear * rate
    seen = u
    for material, h, above in reversed(pieces):
        u, t, scale = _raised(material, h, k, u, t)
        seen = seen * scale if above else u
    return seen / t


def _raised(material: w.Material, h: float, k: w.Array, u: w.Array, t: w.Array) -> tuple[w.Array, w.Array, w.Array]:
    """Return the state at a layer's top for that at its bottom, up to a factor, and that factor.

    exp(-g h) times cosh and sinh; then over the larger of the two entries, each in its own unit, so that neither
    overflows over many layers.
    """
    rate = _rate(material, k)
    once = np.exp(-rate * h)
    cosh = (1.0 + once * once) / 2.0
    safe = np.where(rate == 0, 1.0, rate)
    sinh_over_rate = np.where(rate == 0, h, -np.expm1(-2.0 * rate * h) / (2.0 * safe))
    top_u = cosh * u + sinh_over_rate / material.shear * t
    top_t = material.shear * rate * rate * sinh_over_rate * u + cosh * t
    stiffness = abs(material.shear) * np.maximum(np.abs(k), abs(material.ks2) ** 0.5)
    size = np.maximum(np.abs(top_u), np.abs(top_t) / stiffness)
    return top_u / size, top_t / size, once / size


def _rate(material: w.Material, k: w.Array) -> w.Array:
    return w.rates(material, k)[1]

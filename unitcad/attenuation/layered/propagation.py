"""Propagation of a stack's state through one layer, upwards, at many wavenumbers.

A plane is a pair of (2, 2, n) blocks (U, T): all states u = U c, t = T c that the stack below can carry. By reciprocity
any two of them have u . t' = t . u', so the plane's own equation is T^T u = U^T t.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.series import THIN, gain


class Plane(NamedTuple):
    """State (u, t) at an interface per parameter c; `bottom`, if asked, that at the layer's bottom per the same c."""

    u: w.Array
    t: w.Array
    bottom: tuple[w.Array, w.Array] | None = None


def underside(material: w.Material, k: w.Array) -> Plane:
    """Return the plane at the top of a half-space (or of nothing, if its modulus is 0)."""
    if material.shear == 0:
        return Plane(_identity(k.size), np.zeros((2, 2, k.size), dtype=np.complex128))
    waves = w.waves(material, k, *w.rates(material, k))
    return Plane(waves.displacement, waves.traction)


def raised(material: w.Material, h: float, k: w.Array, below: Plane, with_bottom: bool = False) -> Plane:
    """Return the plane at a layer's top from the plane at its bottom, each wavenumber by the method that suits it."""
    below = Plane(below.u, below.t, (below.u, below.t) if with_bottom else None)
    if h == 0.0:
        return below
    rates = w.rates(material, k)
    by_series = merging(material, h, k, rates)
    parts = [(_thick, np.flatnonzero(~by_series)), (_series, np.flatnonzero(by_series))]
    for method, part in parts:
        if part.size == k.size:
            return method(material, h, k, rates, below)
    out = Plane(
        np.empty_like(below.u),
        np.empty_like(below.t),
        (np.empty_like(below.u), np.empty_like(below.t)) if with_bottom else None,
    )
    for method, part in parts:
        bottom = (below.u[..., part], below.t[..., part])
        plane = Plane(*bottom, bottom if with_bottom else None)
        top = method(material, h, k[part], (rates[0][part], rates[1][part]), plane)
        out.u[..., part], out.t[..., part] = top.u, top.t
        if out.bottom and top.bottom:
            out.bottom[0][..., part], out.bottom[1][..., part] = top.bottom
    return out


def merging(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array]) -> np.ndarray:
    """Return at which wavenumbers the waves down and up are alike, so that reflection would lose digits.

    The layer is thin for both waves, or one of them hardly changes over it: next to its branch point, or k h small
    where k_s h is not.
    """
    thin = np.maximum(np.abs(k), abs(material.ks2) ** 0.5) * h < THIN
    return thin | (np.minimum(np.abs(rates[0]), np.abs(rates[1])) * h < THIN)


def _series(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array], below: Plane) -> Plane:
    """Propagate by the series, in pieces across which nothing grows by more than e."""
    pieces = max(1, int(np.ceil(max(float(np.max(rate.real)) for rate in rates) * h)))
    gained = gain(material, k, h / pieces)
    for _ in range(pieces):
        below = charted(Plane(*gained.added(below.u, below.t), below.bottom))
    return below


def _thick(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array], below: Plane) -> Plane:
    """Propagate by reflection.

    The amplitudes are a down at the top and R E a up at the bottom, with R from the plane's own equation.
    """
    waves = w.waves(material, k, *rates)
    d, tr = waves.displacement, waves.traction
    of_u, of_t = below.t.swapaxes(0, 1), below.u.swapaxes(0, 1)
    # The waves up are those down but for signs (J d and -J t), so both sides have the same terms.
    u_r, u_z = of_u[:, 0, None] * d[0], of_u[:, 1, None] * d[1]
    t_r, t_z = of_t[:, 0, None] * tr[0], of_t[:, 1, None] * tr[1]
    system = (u_r - u_z) + (t_r - t_z)
    given = (t_r + t_z) - (u_r + u_z)
    e = w.decay(material, waves, h)
    reflected = w.product(w.adjugate(system), w.product(given, e)) / w.determinant(system)
    back = w.product(e, reflected)
    bottom = None
    if below.bottom is not None:
        bottom = (
            w.product(d, e) + w.mirrored(w.product(d, reflected)),
            w.product(tr, e) - w.mirrored(w.product(tr, reflected)),
        )
    return Plane(d + w.mirrored(w.product(d, back)), tr - w.mirrored(w.product(tr, back)), bottom)


def charted(raw: Plane) -> Plane:
    """Return the same plane with u or t the identity, whichever inverse is better conditioned."""
    det_u, det_t = w.determinant(raw.u), w.determinant(raw.t)
    by_u = _square(raw.u) * np.abs(det_t) <= _square(raw.t) * np.abs(det_u)
    inverse = w.adjugate(np.where(by_u, raw.u, raw.t)) / np.where(by_u, det_u, det_t)
    ratio = w.product(np.where(by_u, raw.t, raw.u), inverse)
    one = _identity(by_u.size)
    bottom = raw.bottom and (w.product(raw.bottom[0], inverse), w.product(raw.bottom[1], inverse))
    return Plane(np.where(by_u, one, ratio), np.where(by_u, ratio, one), bottom)


def parameter(plane: Plane, u: w.Array, t: w.Array, stiffness: w.Array) -> w.Array:
    """Return the c, shape (2, m, n), of a state (u, t) that lies on a plane and comes from a layer above it.

    stiffness: traction over displacement of that layer's waves (Pa/m), which is how their rounding compares. On
    something stiffer u is what is left of waves that cancel, on something softer t is: each would lose the contrast.
    """
    det_u, det_t = w.determinant(plane.u), w.determinant(plane.t)
    with np.errstate(divide="ignore", invalid="ignore"):  # of the one that is singular, which is not taken
        by_t = np.sqrt(_square(plane.t)) * np.abs(det_u) * stiffness < np.sqrt(_square(plane.u)) * np.abs(det_t)
    block, det = np.where(by_t, plane.t, plane.u), np.where(by_t, det_t, det_u)
    return w.product(w.adjugate(block), np.where(by_t, t, u)) / det


def _square(a: w.Array) -> np.ndarray:
    return np.sum(a.real**2 + a.imag**2, axis=(0, 1))


def _identity(count: int) -> w.Array:
    one = np.zeros((2, 2, count), dtype=np.complex128)
    one[0, 0] = one[1, 1] = 1.0
    return one

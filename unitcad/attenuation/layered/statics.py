"""A static homogeneous half-space under each load, in closed form.

It is what is taken out of a Hankel integral at the surface.

Rows are those of a load's kernel, with its `orders`: (u_r, u_z) under an axisymmetric load, and under a sideways one
(A, B, Z), of which u_r = A - B, u_theta = -(A + B) and u_z = -Z are made.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

import numpy as np
from scipy import special

from unitcad.attenuation.layered import waves as w

Direction = Literal["normal", "radial", "tangential"]
_CATALAN = 0.915965594177219015


def static_kernel(material: w.Material, direction: Direction) -> w.Array:
    """Return k C(k) of a static half-space, a value a row, 1/Pa (Boussinesq and Cerruti); nu by eps.

    (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across, and 1 / mu for horizontally polarised shear.
    """
    nu = (1.0 - 2.0 * material.eps) / (2.0 * (1.0 - material.eps))
    along, across = (1.0 - nu) / material.shear, -(1.0 - 2.0 * nu) / (2.0 * material.shear)
    if direction == "tangential":
        return np.array([(2.0 - nu) / (2.0 * material.shear), -nu / (2.0 * material.shear), across])
    return np.array([across, along] if direction == "normal" else [along, across])


def disc_integrals(s: Any, direction: Direction) -> Any:
    """Return the integrals of q(k) J_n(kr) dk of a disc of radius 1 under 1 Pa at r = s, rows as the kernel's.

    q(k) = J1(k) / k but of a radial load: Weber and Schafheitlin's integrals of J1(k) J_n(ks) / k.
    """
    s = np.asarray(s, dtype=float)
    if direction == "radial":
        return np.array([_radial(s), np.where(s < 1, 1.0 - s, 0.0)])
    zeroth, first = _zeroth(s), np.where(s <= 1, s / 2.0, 0.5 / np.maximum(s, 1.0))
    return np.array([first, zeroth] if direction == "normal" else [zeroth, _second(s), first])


def _zeroth(s: Any) -> Any:
    """Return the integral of J1(k) J0(ks) / k by Legendre's E and K."""
    inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
    m = 1.0 / outside**2
    far = outside * (special.ellipe(m) - (1.0 - m) * special.ellipkm1(np.maximum(1.0 - m, 1e-300)))
    return 2.0 / np.pi * np.where(s <= 1, special.ellipe(inside**2), far)


_ELLIPTIC = 0.6  # m from which E and K give the second order without a loss of digits; below it the series does


def _second(s: Any) -> Any:
    """Return the integral of J1(k) J2(ks) / k: s^2/8 F(1/2, 3/2; 3; s^2) and 1/(2s) F(3/2, -1/2; 2; 1/s^2)."""
    inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
    m, rest = inside**2, np.maximum((1.0 - inside) * (1.0 + inside), 1e-300)
    whole = np.maximum(m, _ELLIPTIC)
    near = 2.0 / (3.0 * np.pi * whole) * ((2.0 - whole) * special.ellipe(whole) - 2.0 * rest * special.ellipkm1(rest))
    near = np.where(m < _ELLIPTIC, m / 8.0 * special.hyp2f1(0.5, 1.5, 3.0, np.minimum(m, _ELLIPTIC)), near)
    m, rest = outside**-2.0, np.maximum((outside - 1.0) * (outside + 1.0) / outside**2, 1e-300)
    whole = np.maximum(m, _ELLIPTIC)
    elliptic = (2.0 * whole - 1.0) * special.ellipe(whole) + rest * special.ellipkm1(rest)
    series = special.hyp2f1(1.5, -0.5, 2.0, np.minimum(m, _ELLIPTIC))
    far = np.where(m < _ELLIPTIC, series, 4.0 / (3.0 * np.pi * whole) * elliptic) / (2.0 * outside)
    return np.where(s <= 1, near, far)


def _radial(s: Any) -> Any:
    """Return the integral of J1(ks) q(k) dk of the radial disc: K - E of Legendre, integrated.

    The kernel of a ring of radius x is the integral of J1(kx) J1(ks) dk = 2 (K - E)(m) / (pi max(s, x)), with
    m = (min / max)^2.
    """
    inside, outside = np.clip(s, 1e-300, 1.0), np.maximum(s, 1.0)
    near = inside * (_CATALAN - 0.5 + _legendre_integral(1.0, 3) - _legendre_integral(inside, 3))
    far = outside * _legendre_integral(1.0 / outside, 0)
    return 2.0 / np.pi * np.where(s > 1.0, far, np.where(s > 0.0, near, 0.0))


_SMALL = 2.0**-30  # of x: below it (K - E)(x^2) is pi x^2 / 4


def _legendre_integral(x: Any, power: int) -> Any:
    """Return the integral of (K - E)(t^2) / t^power from 0 (power 0) or from `_SMALL` (power 3) to x, 0 < x <= 1."""
    edges, sums = _legendre_sums(power)
    x = np.asarray(x, dtype=float)
    whole = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    integral = sums[whole] + _legendre_panel(edges[whole], x, power)
    if power == 0:
        return np.where(x < _SMALL, np.pi / 12.0 * x**3, integral)
    return np.where(x < _SMALL, np.pi / 4.0 * np.log(x / _SMALL), integral)


@cache
def _legendre_sums(power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return edges from `_SMALL` to 1, graded towards both ends, and the integral up to each of them."""
    halves = 2.0 ** -np.arange(1, 50)
    edges = np.unique([_SMALL, *halves[halves > _SMALL], *(1.0 - halves), 1.0])
    panels = _legendre_panel(edges[:-1], edges[1:], power)
    start = np.pi / 12.0 * _SMALL**3 if power == 0 else 0.0
    return edges, start + np.concatenate([[0.0], np.cumsum(panels)])


def _legendre_panel(low: Any, high: Any, power: int) -> Any:
    """Integrate by Gauss-Legendre with 20 nodes over each panel."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    low, high = np.broadcast_arrays(low, high)
    x = ((low + high) / 2.0)[..., None] + ((high - low) / 2.0)[..., None] * nodes
    near_one = np.maximum((1.0 - x) * (1.0 + x), 1e-300)
    k_minus_e = special.elliprd(0.0, near_one, 1.0) / 3.0  # over x^2; written as a difference it loses digits
    return (high - low) / 2.0 * ((k_minus_e * x ** (2 - power)) @ weights)

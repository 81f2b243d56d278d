"""A static homogeneous half-space under each load, in closed form.

It is what is taken out of a Hankel integral at the surface.

Rows are those of a load's kernel, with its `orders`: (u_r, u_z) under an axisymmetric load, and under a sideways one
(A, B, Z), of which u_r = A - B, u_theta = -(A + B) and u_z = -Z are made.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any, Literal

import numpy as np
from scipy import special

from unitcad.attenuation.layered import waves as w

Direction = Literal["normal", "radial", "tangential"]
_CATALAN = 0.915965594177219015


def static_kernel(material: w.Material, direction: Direction) -> w.Array:
    """Return k C(k) of a static half-space, a value a row, 1/Pa (Boussinesq and Cerruti).

    (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across, and 1 / mu for horizontally polarised shear; by eps,
    1 - nu is 1 / (2 (1 - eps)) and 1 - 2 nu, which keeps its digits next to nu = 1/2, is eps / (1 - eps).
    """
    eps, twice = material.eps, 2.0 * (1.0 - material.eps) * material.shear
    along, across = 1.0 / twice, -eps / twice
    if direction == "tangential":
        return np.array([(1.5 - eps) / twice, -(0.5 - eps) / twice, across])
    return np.array([across, along] if direction == "normal" else [along, across])


@lru_cache(maxsize=64)
def static_kernels(material: w.Material, directions: tuple[Direction, ...]) -> w.Array:
    """Return the rows of `static_kernel` of each direction, one after the other, read-only."""
    rows = np.concatenate([static_kernel(material, direction) for direction in directions])
    rows.flags.writeable = False
    return rows


def disc_integrals(s: Any, direction: Direction) -> Any:
    """Return the integrals of q(k) J_n(kr) dk of a disc of radius 1 under 1 Pa at r = s, rows as the kernel's.

    q(k) = J1(k) / k but of a radial load: Weber and Schafheitlin's integrals of J1(k) J_n(ks) / k.
    """
    s = np.asarray(s, dtype=float)
    if direction == "radial":
        return np.array([_radial(s), np.where(s < 1, 1.0 - s, 0.0)])
    zeroth, first = _zeroth(s), np.where(s <= 1, s / 2.0, 0.5 / np.maximum(s, 1.0))
    return np.array([first, zeroth] if direction == "normal" else [zeroth, _second(s), first])


_UNIT = 2.0**-53
"""Of one rounding, relative."""


def static_rounding(integrals: Any, s: Any = None) -> Any:
    """Bound the rounding of `static_kernel` times the integrals of a load, shape (rows, n); s: radii over the disc's.

    It is over the kernel's largest row: the rows of a compliance come from one solution, and what is taken out of the
    integrand leaves the compliance's rounding in the integral: that of 1 / k all over, which adds up to the closed form
    again. In units of 2^-53, times the integral:

    - 16: the moduli with their damping and eps 3 each, the solution for the compliance 6, the kernel 2, the product
      and the sum 2;
    - 24: the integral itself. That is what the second order needs, at m next to `_ELLIPTIC`, where its terms are seven
      times their sum; the others are within 8, a point's within 4.

    And beside it: s is rounded, once, and the integral follows by s times its slope. That is at most
    three times the integral and min(s, 1 / s) (1 - ln |1 - s|): the slope is logarithmic at the rim, and a radial
    load's 1 - s goes to 0 there.
    """
    size = 40.0 * np.abs(integrals)
    if s is not None:
        with np.errstate(divide="ignore"):
            near = np.minimum(s, 1.0 / s) * (1.0 - np.log(np.clip(np.abs(1.0 - s), _UNIT, 1.0)))
        size = size + 3.0 * np.abs(integrals) + near
    return _UNIT * size


def _zeroth(s: Any) -> Any:
    """Return the integral of J1(k) J0(ks) / k: E inside; outside s (E - (1 - m) K), m = 1 / s^2.

    The latter by Carlson's R_D: for small m the difference of E and K has no digits.
    """
    inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
    rest = np.maximum((outside - 1.0) * (outside + 1.0) / outside**2, 1e-300)
    far = rest * special.elliprd(0.0, 1.0, rest) / (3.0 * outside)
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

    The kernel of a ring of radius x is the integral of J1(kx) J1(ks) dk = 2 (K - E)(m) / (pi min(s, x)), with
    m = (min / max)^2.
    """
    inside, outside = np.clip(s, 1e-300, 1.0), np.maximum(s, 1.0)
    near = inside * (_CATALAN - 0.5 + _legendre_to_1(inside))
    far = outside * _legendre_from_0(1.0 / outside)
    return 2.0 / np.pi * np.where(s > 1.0, far, np.where(s > 0.0, near, 0.0))


_SMALL = 2.0**-30  # of x: below it (K - E)(x^2) is pi x^2 / 4


def _legendre_from_0(x: Any) -> Any:
    """Return the integral of (K - E)(t^2) from 0 to x, 0 < x <= 1."""
    edges, panels = _legendre_panels(0)
    x = np.asarray(x, dtype=float)
    whole = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    sums = np.pi / 12.0 * _SMALL**3 + np.concatenate([[0.0], np.cumsum(panels)])
    return np.where(x < _SMALL, np.pi / 12.0 * x**3, sums[whole] + _legendre_panel(edges[whole], x, 0))


def _legendre_to_1(x: Any) -> Any:
    """Return the integral of (K - E)(t^2) / t^3 from x to 1, 0 < x <= 1; summed from 1, where it is small."""
    edges, panels = _legendre_panels(3)
    x = np.asarray(x, dtype=float)
    next_edge = np.clip(np.searchsorted(edges, x, side="right"), 1, edges.size - 1)
    sums = np.concatenate([np.cumsum(panels[::-1])[::-1], [0.0]])
    low = np.maximum(x, _SMALL)
    integral = sums[next_edge] + _legendre_panel(low, edges[next_edge], 3)
    return integral + np.pi / 4.0 * np.log(low / x)


@cache
def _legendre_panels(power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return edges from `_SMALL` to 1, graded towards both ends, and the integral over (K - E) / t^power between."""
    halves = 2.0 ** -np.arange(1, 50)
    edges = np.unique([_SMALL, *halves[halves > _SMALL], *(1.0 - halves), 1.0])
    return edges, _legendre_panel(edges[:-1], edges[1:], power)


def _legendre_panel(low: Any, high: Any, power: int) -> Any:
    """Integrate by Gauss-Legendre with 20 nodes over each panel."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    low, high = np.broadcast_arrays(low, high)
    x = ((low + high) / 2.0)[..., None] + ((high - low) / 2.0)[..., None] * nodes
    below_1 = (1.0 - high)[..., None] + ((high - low) / 2.0)[..., None] * (1.0 - nodes)  # 1 - x, with all its digits
    near_one = np.maximum(below_1 * (1.0 + x), 1e-300)
    k_minus_e = special.elliprd(0.0, near_one, 1.0) / 3.0  # over x^2; written as a difference it loses digits
    return (high - low) / 2.0 * ((k_minus_e * x ** (2 - power)) @ weights)

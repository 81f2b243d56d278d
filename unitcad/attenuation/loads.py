"""Loads on the surface, in the Hankel domain, and what they do to a static homogeneous half-space in closed form.

A normal load (F1 of the paper's equation 2a) is a pressure, positive into the body, with a J0 transform; a radial load
(F2, equation 2b) is a traction outwards from the axis, with a J1 transform. q(k) = integral of q(r) J(kr) r dr.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy import special

from unitcad.attenuation.rheology import finite
from unitcad.errors import Refusal, unknown_name

Direction = Literal["normal", "radial"]
_CATALAN = 0.915965594177219015


def _check(direction: str) -> None:
    if direction not in ("normal", "radial"):
        raise unknown_name("load.direction", direction, ("normal", "radial"))


@dataclass(frozen=True)
class Point:
    """One newton at the origin. Radial: the traction 1 / (2 pi r^2), its transform as constant as the normal one's.

    (A radial traction that vanishes outside a point has no resultant and no effect; this one is what the paper's F2
    means once its F1 is a point.)
    """

    direction: Direction = "normal"

    def __post_init__(self) -> None:
        _check(self.direction)

    @property
    def reach(self) -> float:
        return 0.0

    def transform(self, k: Any) -> Any:
        """q(k) per newton: 1 / (2 pi)."""
        return np.full(np.shape(k), 1.0 / (2.0 * np.pi))

    def envelope(self, k: Any) -> Any:
        """A bound of |q(k)| for real k."""
        return self.transform(k)

    def static(self, r: Any) -> tuple[Any, Any]:
        """(along, across): integrals of q(k) J(kr) dk with the load's own Bessel function and with the other one."""
        if np.any(r == 0):
            raise Refusal("r", 0.0, "under a point load the surface goes to infinity: give r > 0, z > 0 or a disc")
        return 1.0 / (2.0 * np.pi * r), 1.0 / (2.0 * np.pi * r)


@dataclass(frozen=True)
class UniformDisc:
    """One pascal, everywhere the same, on a disc of `radius` (m): a pressure, or a traction outwards from the axis."""

    radius: float
    direction: Direction = "normal"

    def __post_init__(self) -> None:
        finite("load.radius", self.radius, above=True)
        _check(self.direction)

    @property
    def reach(self) -> float:
        return self.radius

    def transform(self, k: Any) -> Any:
        """q(k) in m2 per pascal: a J1(ka) / k, or the integral of J1(kr) r dr up to a."""
        a = self.radius
        if self.direction == "normal":
            return a * bessel(1, k * a) / k
        return a * a * _mean_bessel(k * a)

    def envelope(self, k: Any) -> Any:
        """A bound of |q(k)| for real k."""
        x = np.asarray(k) * self.radius
        if self.direction == "normal":
            return self.radius**2 * np.minimum(0.5, 1.01 * np.sqrt(2.0 / (np.pi * x)) / x)
        return self.radius**2 * np.minimum(0.3, (1.0 + np.sqrt(2.0 * x / np.pi)) * 1.1 / x**2)

    def static(self, r: Any) -> tuple[Any, Any]:
        """(along, across): integrals of q(k) J(kr) dk with the load's own Bessel function and with the other one.

        Normal: Weber and Schafheitlin's integrals of J1(ka) J0(kr) / k and J1(ka) J1(kr) / k.
        """
        a, s = self.radius, np.asarray(r, dtype=float) / self.radius
        if self.direction == "radial":
            return a * _radial_static(s), np.where(s < 1, a * (1.0 - s), 0.0)
        inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
        m = 1.0 / outside**2
        far = outside * (special.ellipe(m) - (1.0 - m) * special.ellipkm1(np.maximum(1.0 - m, 1e-300)))
        along = 2.0 / np.pi * np.where(s <= 1, special.ellipe(inside**2), far)
        return a * along, a * np.where(s <= 1, s / 2.0, 0.5 / outside)


Load = Point | UniformDisc


def bessel(order: int, x: Any) -> Any:
    """J0 or J1 of a real or complex array."""
    if np.iscomplexobj(x):
        return special.jv(order, x)
    return special.j0(x) if order == 0 else special.j1(x)


def _mean_bessel(x: Any) -> Any:
    """Integral of t J1(x t) over t from 0 to 1: Struve functions for a large real x, else Gauss-Legendre."""
    x = np.asarray(x)
    if not np.iscomplexobj(x):
        far = np.maximum(x, 8.0)
        struve = special.j1(far) * special.struve(0, far) - special.j0(far) * special.struve(1, far)
        by_struve = np.pi / 2.0 * struve / far
        return np.where(x > 8.0, by_struve, _mean_bessel(np.minimum(x, 8.0) + 0j).real)
    nodes, weights = np.polynomial.legendre.leggauss(24 + int(0.7 * np.max(np.abs(x), initial=0.0)))
    t = (nodes + 1.0) / 2.0
    return special.jv(1, x[..., None] * t) @ (weights / 2.0 * t)


def _radial_static(s: Any) -> Any:
    """1/a times the integral of J1(kr) q(k) dk for the radial disc at s = r/a: K - E of Legendre, integrated.

    The kernel of a ring of radius x a is the integral of J1(kxa) J1(kr) dk = 2 (K - E)(m) / (pi max(r, xa)), with
    m = (min / max)^2.
    """
    s = np.atleast_1d(np.asarray(s, dtype=float))
    out = np.zeros_like(s)
    for i, one in np.ndenumerate(s):
        if one > 1.0:
            out[i] = 2.0 * one / np.pi * _legendre_integral(0.0, 1.0 / one, 0)
        elif one > 0.0:
            out[i] = 2.0 * one / np.pi * (_CATALAN - 0.5 + _legendre_integral(one, 1.0, 3))
    return out


def _legendre_integral(low: float, high: float, power: int) -> float:
    """Integral of (K - E)(x^2) / x^power from low to high <= 1, graded towards both ends of (0, 1)."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    edges = [low, high]
    edges += [e for j in range(1, 50) for e in (2.0**-j, 1.0 - 2.0**-j) if low < e < high]
    edges.sort()
    total = 0.0
    for a, b in pairwise(edges):
        x = (a + b) / 2.0 + (b - a) / 2.0 * nodes
        near_one = np.maximum((1.0 - x) * (1.0 + x), 1e-300)
        k_minus_e = special.ellipkm1(near_one) - special.ellipe(x * x)
        small = x < 1e-3
        k_minus_e = np.where(small, np.pi / 4 * x * x * (1 + 3 / 8 * x * x), k_minus_e)
        total += float((b - a) / 2.0 * np.sum(weights * k_minus_e / x**power))
    return total

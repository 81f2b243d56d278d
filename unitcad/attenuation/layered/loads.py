"""Loads on the surface, in the Hankel domain, and what they do to a static homogeneous half-space in closed form.

A normal load (F1 of the paper's equation 2a) is a pressure, positive into the body, with a J0 transform; a radial load
(F2, equation 2b) is a traction outwards from the axis, with a J1 transform. q(k) = integral of q(r) J(kr) r dr.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from scipy import special

from unitcad.attenuation.layered.bessel import bessel, moment
from unitcad.attenuation.layered.rheology import finite
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

    @property
    def weight(self) -> float:
        """Total weight of the e^{ikx}, |x| up to `reach`, that the transform is a mean of."""
        return 1.0 / (2.0 * np.pi)

    def transform(self, k: Any) -> Any:
        """Return q(k) per newton: 1 / (2 pi)."""
        return np.full(np.shape(k), 1.0 / (2.0 * np.pi))

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        return self.transform(k)

    def static(self, r: Any) -> tuple[Any, Any]:
        """Return (along, across): integrals of q(k) J(kr) dk with the load's own Bessel function and with the other."""
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

    @property
    def weight(self) -> float:
        """Total weight of the e^{ikx}, |x| up to `reach`, that the transform is a mean of (Poisson's integrals)."""
        return self.radius**2 * (0.5 if self.direction == "normal" else 1.0 / np.pi)

    def transform(self, k: Any) -> Any:
        """Return q(k) in m2 per pascal: a J1(ka) / k, or the integral of J1(kr) r dr up to a."""
        a = self.radius
        if self.direction == "normal":
            return a * bessel(1, k * a) / k
        return a * a * moment(k * a)

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        x = np.asarray(k) * self.radius
        if self.direction == "normal":
            return self.radius**2 * np.minimum(0.5, 1.01 * np.sqrt(2.0 / (np.pi * x)) / x)
        return self.radius**2 * np.minimum(0.3, (1.0 + np.sqrt(2.0 * x / np.pi)) * 1.1 / x**2)

    def static(self, r: Any) -> tuple[Any, Any]:
        """Return (along, across): integrals of q(k) J(kr) dk with the load's own Bessel function and with the other.

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


def _radial_static(s: Any) -> Any:
    """Return 1/a times the integral of J1(kr) q(k) dk for the radial disc at s = r/a: K - E of Legendre, integrated.

    The kernel of a ring of radius x a is the integral of J1(kxa) J1(kr) dk = 2 (K - E)(m) / (pi max(r, xa)), with m =
    (min / max)^2.
    """
    s = np.asarray(s, dtype=float)
    inside, outside = np.clip(s, 1e-300, 1.0), np.maximum(s, 1.0)
    near = inside * (_CATALAN - 0.5 + _legendre_integral(1.0, 3) - _legendre_integral(inside, 3))
    far = outside * _legendre_integral(1.0 / outside, 0)
    return 2.0 / np.pi * np.where(s > 1.0, far, np.where(s > 0.0, near, 0.0))


_SMALL = 2.0**-30  # of x: below it (K - E)(x^2) is pi x^2 / 4


def _legendre_integral(x: Any, power: int) -> Any:
    """Integrate (K - E)(t^2) / t^power from 0 (power 0) or from `_SMALL` (power 3) to x, 0 < x <= 1."""
    edges, sums = _legendre_sums(power)
    x = np.asarray(x, dtype=float)
    whole = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    found = sums[whole] + _legendre_panel(edges[whole], x, power)
    if power == 0:
        return np.where(x < _SMALL, np.pi / 12.0 * x**3, found)
    return np.where(x < _SMALL, np.pi / 4.0 * np.log(x / _SMALL), found)


@cache
def _legendre_sums(power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return edges from `_SMALL` to 1, graded towards both ends, and the integral up to each of them."""
    halves = 2.0 ** -np.arange(1, 50)
    edges = np.unique([_SMALL, *halves[halves > _SMALL], *(1.0 - halves), 1.0])
    panels = _legendre_panel(edges[:-1], edges[1:], power)
    start = np.pi / 12.0 * _SMALL**3 if power == 0 else 0.0
    return edges, start + np.concatenate([[0.0], np.cumsum(panels)])


def _legendre_panel(low: Any, high: Any, power: int) -> Any:
    """Integrate each panel by Gauss-Legendre with 20 nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    low, high = np.broadcast_arrays(low, high)
    x = ((low + high) / 2.0)[..., None] + ((high - low) / 2.0)[..., None] * nodes
    near_one = np.maximum((1.0 - x) * (1.0 + x), 1e-300)
    k_minus_e = special.elliprd(0.0, near_one, 1.0) / 3.0  # over x^2; written as a difference it loses digits
    return (high - low) / 2.0 * ((k_minus_e * x ** (2 - power)) @ weights)

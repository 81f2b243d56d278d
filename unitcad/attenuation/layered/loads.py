"""Loads on the surface, in the Hankel domain.

A normal load (F1 of the paper's equation 2a) is a pressure, positive into the body, with a J0 transform; a radial load
(F2, equation 2b) is a traction outwards from the axis, with a J1 transform. q(k) = integral of q(r) J(kr) r dr.
A tangential load is a traction in one direction of the plane, theta = 0, the same everywhere on the disc: a motor that
drives sideways. Its transform is that of the normal one.

A force that turns in the plane, as a coin ERM's does, is two tangential ones in quadrature: F along theta = 0 and -i F
along theta = pi/2. Together they move a point at theta by F e^{-i theta} (u_r, i u_theta, u_z), in the amplitudes
`response.Response` has: the same at every theta. The motion is an ellipse; its mean square over a turn is
(|u_r|^2 + |u_theta|^2 + |u_z|^2) |F|^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from unitcad.attenuation.layered.bessel import bessel, bessel_bounds, moment
from unitcad.attenuation.layered.kept import kept
from unitcad.attenuation.layered.rheology import MOST, finite
from unitcad.attenuation.layered.statics import Direction, disc_integrals, static_rounding
from unitcad.errors import Refusal, unknown_name


def _check(direction: str) -> None:
    if direction not in get_args(Direction):
        raise unknown_name("load.direction", str(direction), get_args(Direction))


def _check_wavenumbers(k: Any) -> None:
    values = np.asarray(k)
    wrong = values[~(np.abs(values) <= MOST)]
    if wrong.size:
        raise Refusal("k", str(wrong.flat[0]), f"wavenumbers must be finite, at most {MOST:g}")


def _orders(direction: Direction) -> tuple[int, ...]:
    return (0, 2, 1) if direction == "tangential" else (1, 0)


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
    def orders(self) -> tuple[int, ...]:
        """Orders of the Bessel functions that the rows of the kernel meet."""
        return _orders(self.direction)

    @property
    def reach(self) -> float:
        return 0.0

    @property
    def weight(self) -> float:
        """Total weight of the e^{ikx}, |x| up to `reach`, that the transform is a mean of."""
        return 1.0 / (2.0 * np.pi)

    def transform(self, k: Any) -> Any:
        """Return q(k) per newton: 1 / (2 pi). Raises `Refusal` for a k that is not finite."""
        _check_wavenumbers(k)
        return np.full(np.shape(k), 1.0 / (2.0 * np.pi))

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        return self.transform(k)

    def static(self, r: Any) -> Any:
        """Return the integrals of q(k) J_n(kr) dk, a row an order, r in m: 1 / (2 pi r) at every order.

        Raises `Refusal` at r = 0.
        """
        if np.any(r == 0):
            raise Refusal("r", 0.0, "under a point load the surface goes to infinity: give r > 0, z > 0 or a disc")
        return np.broadcast_to(1.0 / (2.0 * np.pi * r), (len(self.orders), *np.shape(r)))

    def static_rounding(self, r: Any) -> Any:
        """Return a bound of the rounding of `statics.static_kernel` times `static`, over the kernel's largest row."""
        return static_rounding(self.static(r))


@dataclass(frozen=True)
class UniformDisc:
    """One pascal, everywhere the same, on a disc of `radius` (m): a pressure, a traction outwards or one sideways."""

    radius: float
    direction: Direction = "normal"

    def __post_init__(self) -> None:
        finite("load.radius", self.radius, above=True)
        _check(self.direction)

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the Bessel functions that the rows of the kernel meet."""
        return _orders(self.direction)

    @property
    def reach(self) -> float:
        return self.radius

    @property
    def weight(self) -> float:
        """Total weight of the e^{ikx}, |x| up to `reach`, that the transform is a mean of (Poisson's integrals)."""
        return self.radius**2 * (1.0 / np.pi if self.direction == "radial" else 0.5)

    def transform(self, k: Any) -> Any:
        """Return q(k) in m2 per pascal: a J1(ka) / k, or the integral of J1(kr) r dr up to a of a radial load.

        Raises `Refusal` for a k that is not finite.
        """
        _check_wavenumbers(k)
        a = self.radius
        if self.direction == "radial":
            return a * a * moment(k * a)
        at_zero = np.abs(k) * a < 1e-8  # the next term is (ka)^2 / 8 of the first
        return np.where(at_zero, a * a / 2.0, a * bessel(1, k * a) / np.where(at_zero, 1.0, k))[()]

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        x = np.asarray(k) * self.radius
        if self.direction == "radial":
            return self.radius**2 * np.minimum(0.3, (1.0 + np.sqrt(2.0 * x / np.pi)) * 1.1 / x**2)
        return self.radius**2 * np.minimum(0.5, bessel_bounds((1,), x)[0] / x)

    def static(self, r: Any) -> Any:
        """Return the integrals of q(k) J_n(kr) dk in m, a row an order, r in m."""
        return self._static(np.asarray(r, dtype=float))[0]

    def static_rounding(self, r: Any) -> Any:
        """Return a bound of the rounding of `statics.static_kernel` times `static`, over the kernel's largest row."""
        return self._static(np.asarray(r, dtype=float))[1]

    @kept
    def _static(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = r / self.radius
        integrals = disc_integrals(s, self.direction)
        return self.radius * integrals, self.radius * static_rounding(integrals, s)


Load = Point | UniformDisc

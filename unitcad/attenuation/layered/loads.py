"""The load on the surface, in the Hankel domain: its transform, Bessel functions, a static half-space under it.

A static homogeneous half-space, known in closed form, is taken out of a Hankel integral.

Rows are those of a load's kernel, with its `orders`: (u_r, u_z) under a normal load, and under a tangential one
(A, B, Z), of which u_r = A - B, u_theta = -(A + B) and u_z = -Z are made.

A normal load (F1 of the paper's equation 2a) is a pressure, positive into the medium. A tangential load is a traction
in one direction of the plane, theta = 0: a motor that drives sideways. Either is the same everywhere on the disc, and
q(k) = integral of q(r) J0(kr) r dr is its transform.

A force that turns in the plane, as a coin ERM's does, is two tangential ones in quadrature: F along theta = 0 and -i F
along theta = pi/2. Together they move a point at theta by F e^{-i theta} (u_r, i u_theta, u_z), in the amplitudes
`Response` has: the same at every theta. The motion is an ellipse; its mean square over a turn is
(|u_r|^2 + |u_theta|^2 + |u_z|^2) |F|^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from unitcad.attenuation.layered.medium import MOST, finite
from unitcad.attenuation.layered.propagation import Array, Material
from unitcad.errors import Refusal, unknown_name
from unitcad.lean_scipy import special


def bessels(orders: tuple[int, ...], x: Any) -> Any:
    """Return J of each of the orders 0, 1 or 2 at real x >= 0 or complex x, shape (orders,) + x.shape."""
    if np.iscomplexobj(x):
        return np.array([special.jv(order, x) for order in orders])
    zeroth, first = special.j0(x), special.j1(x)
    values = {0: zeroth, 1: first}
    if 2 in orders:
        # The recurrence keeps an absolute error of 1e-16; below 1 the series keeps the relative one.
        quarter = np.minimum(x, 1.0) ** 2 / 4.0
        series = np.zeros_like(quarter)
        for m in range(8, 0, -1):
            series = (1.0 + series) * -quarter / (m * (m + 2.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            values[2] = np.where(x < 1.0, quarter / 2.0 * (1.0 + series), 2.0 * first / x - zeroth)
    return np.array([values[order] for order in orders])


_ABOVE_ASYMPTOTE = np.array([1.0, 1.035, 1.089])
"""The most that |J_n| sqrt(pi x / 2) is, for n = 0, 1, 2: at infinity, x = 2.17 and x = 3.31."""


def bessel_bounds(orders: tuple[int, ...], x: Any) -> Any:
    """Return a bound of |J| of each of the orders 0, 1 or 2 for real x >= 0, shape (orders,) + x.shape."""
    with np.errstate(divide="ignore"):
        root = np.sqrt(2.0 / (np.pi * np.asarray(x)))
    return np.minimum(1.0, np.multiply.outer(_ABOVE_ASYMPTOTE[list(orders)], root))


Direction = Literal["normal", "tangential"]


def static_kernel(material: Material, direction: Direction) -> Array:
    """Return k C(k) of a static half-space, a value a row, 1/Pa (Boussinesq and Cerruti).

    (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across, and 1 / mu for horizontally polarised shear; by eps,
    1 - nu is 1 / (2 (1 - eps)) and 1 - 2 nu, which keeps its digits next to nu = 1/2, is eps / (1 - eps).
    """
    eps, twice = material.eps, 2.0 * (1.0 - material.eps) * material.shear
    along, across = 1.0 / twice, -eps / twice
    if direction == "tangential":
        return np.array([(1.5 - eps) / twice, -(0.5 - eps) / twice, across])
    return np.array([across, along])


def disc_integrals(s: Any, direction: Direction) -> Any:
    """Return the integrals of q(k) J_n(kr) dk of a disc of radius 1 under 1 Pa at r = s, rows as the kernel's.

    Weber and Schafheitlin's integrals of J1(k) J_n(ks) / k. The zeroth order is E inside; outside s (E - (1 - m) K),
    m = 1 / s^2, by Carlson's R_D: for small m the difference of E and K has no digits.
    """
    s = np.asarray(s, dtype=float)
    inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
    rest = np.maximum((outside - 1.0) * (outside + 1.0) / outside**2, 1e-300)
    far = rest * special.elliprd(0.0, 1.0, rest) / (3.0 * outside)
    zeroth = 2.0 / np.pi * np.where(s <= 1, special.ellipe(inside**2), far)
    first = np.where(s <= 1, s / 2.0, 0.5 / outside)
    return np.array([first, zeroth] if direction == "normal" else [zeroth, _second(s), first])


_UNIT = 2.0**-53
"""Of one rounding, relative."""


def static_rounding(integrals: Any, s: Any) -> Any:
    """Bound the rounding of `static_kernel` times a disc's integrals, shape (rows, n); s: radii over the disc's.

    It is over the kernel's largest row: the rows of a compliance come from one solution, and the part taken out of the
    integrand leaves the compliance's rounding in the integral: that of 1 / k all over, which adds up to the closed form
    again. In units of 2^-53, times the integral:

    - 16: the moduli with their damping and eps 3 each, the solution for the compliance 6, the kernel 2, the product
      and the sum 2;
    - 24: the integral itself. The second order needs it, at m next to `_ELLIPTIC`, where its terms are seven
      times their sum; the others are within 8.

    In addition: s is rounded, once, and the integral follows by s times its slope. That is at most
    three times the integral and min(s, 1 / s) (1 - ln |1 - s|): the slope is logarithmic at the rim.
    """
    with np.errstate(divide="ignore"):
        near = np.minimum(s, 1.0 / s) * (1.0 - np.log(np.clip(np.abs(1.0 - s), _UNIT, 1.0)))
    return _UNIT * (43.0 * np.abs(integrals) + near)


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


@dataclass(frozen=True)
class UniformDisc:
    """A uniform stress of one pascal on a disc.

    Parameters
    ----------
    radius : float
        Radius of the disc, m, above 0.
    direction : {"normal", "tangential"}, default "normal"
        A pressure, or a traction sideways.

    Raises
    ------
    Refusal
        For a radius that is not positive, and for an unknown direction.

    Examples
    --------
    >>> from unitcad.attenuation import UniformDisc
    >>> UniformDisc(3.5e-3, "tangential").orders
    (0, 2, 1)
    """

    radius: float
    direction: Direction = "normal"

    def __post_init__(self) -> None:
        finite("load.radius", self.radius, above=True)
        if self.direction not in get_args(Direction):
            raise unknown_name("load.direction", str(self.direction), get_args(Direction))

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the Bessel functions that the rows of the kernel meet."""
        return (0, 2, 1) if self.direction == "tangential" else (1, 0)

    @property
    def weight(self) -> float:
        """Total weight of the e^{ikx}, |x| up to the radius, that the transform is a mean of (Poisson's integral)."""
        return self.radius**2 / 2.0

    def transform(self, k: Any) -> Any:
        """Return q(k) = a J1(ka) / k in m2 per pascal. Raises `Refusal` for a k that is not finite."""
        wrong = np.extract(~(np.abs(k) <= MOST), k)
        if wrong.size:
            raise Refusal("k", str(wrong[0]), f"wavenumbers must be finite, at most {MOST:g}")
        a = self.radius
        at_zero = np.abs(k) * a < 1e-8  # the next term is (ka)^2 / 8 of the first
        return np.where(at_zero, a * a / 2.0, a * bessels((1,), k * a)[0] / np.where(at_zero, 1.0, k))[()]

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        x = np.asarray(k) * self.radius
        return self.radius**2 * np.minimum(0.5, bessel_bounds((1,), x)[0] / x)

    def static(self, r: Any) -> Any:
        """Return the integrals of q(k) J_n(kr) dk in m, a row an order, r in m."""
        return self.radius * disc_integrals(np.asarray(r, dtype=float) / self.radius, self.direction)

    def static_rounding(self, r: Any) -> Any:
        """Return a bound of the rounding of `static_kernel` times `static`, over the kernel's largest row."""
        s = np.asarray(r, dtype=float) / self.radius
        return self.radius * static_rounding(disc_integrals(s, self.direction), s)

"""Loads on the surface, in the Hankel domain: their transforms, Bessel functions, a static half-space under each.

A static homogeneous half-space, known in closed form, is taken out of a Hankel integral at the surface.

Rows are those of a load's kernel, with its `orders`: (u_r, u_z) under an axisymmetric load, and under a sideways one
(A, B, Z), of which u_r = A - B, u_theta = -(A + B) and u_z = -Z are made.

A normal load (F1 of the paper's equation 2a) is a pressure, positive into the medium, with a J0 transform. A radial
load (F2, equation 2b) is a traction outwards from the axis, with a J1 transform. q(k) = integral of q(r) J(kr) r dr.
A tangential load is a traction in one direction of the plane, theta = 0. It is the same everywhere on the disc: a
motor that drives sideways. Its transform is that of the normal one.

A force that turns in the plane, as a coin ERM's does, is two tangential ones in quadrature: F along theta = 0 and -i F
along theta = pi/2. Together they move a point at theta by F e^{-i theta} (u_r, i u_theta, u_z), in the amplitudes
`Response` has: the same at every theta. The motion is an ellipse; its mean square over a turn is
(|u_r|^2 + |u_theta|^2 + |u_z|^2) |F|^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from scipy import special

from unitcad.attenuation.layered.medium import MOST, finite
from unitcad.attenuation.layered.propagation import Array, Material
from unitcad.errors import Refusal, unknown_name

_SERIES = 1.0  # |x| up to which the power series of the moment is summed
_FAR = 40.0  # |x| from which the expansion in 1/x is good to 1e-16
_FIRST_ORDER = 100  # J of this order is below 1e-25 for |x| up to _FAR
_LEAST = 1e-220  # start of the downward recurrence: at |x| = _SERIES it grows by 1e189


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


def moment(x: Any) -> Any:
    """Integrate t J1(x t) over t from 0 to 1, for real or complex x with Re x >= 0, any shape.

    Equal to (pi / 2x) (J1 H0 - J0 H1) with Struve's H, which scipy has for real x only, and not for all of them.
    """
    x = np.asarray(x)
    flat = x.ravel()
    out = np.empty(flat.shape, dtype=np.result_type(flat, float))
    size = np.abs(flat)
    near, far = size < _SERIES, size >= _FAR
    for part, formula in ((near, _by_series), (~near & ~far, _by_recurrence), (far, _by_expansion)):
        if np.any(part):
            out[part] = formula(flat[part])
    return out.reshape(x.shape)


def _by_series(x: Any) -> Any:
    """Sum the power series: (-1)^m (x/2)^(2m+1) / (m! (m+1)! (2m+3))."""
    quarter = -(x * x) / 4.0
    term, total = x / 2.0, x / 6.0
    for m in range(1, 12):
        term = term * quarter / (m * (m + 1.0))
        total = total + term / (2 * m + 3)
    return total


def _by_recurrence(x: Any) -> Any:
    """Sum the Neumann series, the orders by downward recurrence.

    x^2 times the moment is x J2 + 2 (J3 + J5 + ...).
    """
    above, here = np.zeros_like(x), np.full_like(x, _LEAST)
    odd = np.zeros_like(x)
    inverse = 2.0 / x
    for order in range(_FIRST_ORDER, 0, -1):  # `here` is of this order, up to one common factor
        if order % 2 == 1 and order > 1:
            odd = odd + here
        if order == 2:
            second = here
        above, here = here, order * inverse * here - above
    true0, true1 = bessels((0, 1), x)
    # J0 and J1 have no common zero: the larger one gives the factor.
    by0 = np.abs(true0) > np.abs(true1)
    factor = np.where(by0, true0, true1) / np.where(by0, here, above)
    return factor * (x * second + 2.0 * odd) / (x * x)


def _by_expansion(x: Any) -> Any:
    """Expand in 1/x: 1 / x^2 + (pi / 2x) (J1 K0 - J0 K1), K = H - Y.

    The Wronskian gives the first term.
    """
    inverse = 1.0 / (x * x)
    zero, one = np.zeros_like(x), np.zeros_like(x)
    for of_zero, of_one in reversed(_coefficients()):  # Horner
        zero, one = zero * inverse + of_zero, one * inverse + of_one
    zeroth, first = bessels((0, 1), x)
    return inverse + (first * zero / x - zeroth * one) / x


@cache
def _coefficients() -> tuple[tuple[float, float], ...]:
    """Return those of x^-2n in (pi/2) x K0 and (pi/2) K1: 1, -1, 9, -225, ... and 1, 1, -3, 45, ..."""
    zero, one = [1.0], [1.0]
    for n in range(20):
        zero.append(-zero[-1] * (2 * n + 1) ** 2)
        one.append(-one[-1] * (2 * n + 1) * (2 * n - 1))
    return tuple(zip(zero, one, strict=True))


Direction = Literal["normal", "radial", "tangential"]
_CATALAN = 0.915965594177219015


def static_kernel(material: Material, direction: Direction) -> Array:
    """Return k C(k) of a static half-space, a value a row, 1/Pa (Boussinesq and Cerruti).

    (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across, and 1 / mu for horizontally polarised shear; by eps,
    1 - nu is 1 / (2 (1 - eps)) and 1 - 2 nu, which keeps its digits next to nu = 1/2, is eps / (1 - eps).
    """
    eps, twice = material.eps, 2.0 * (1.0 - material.eps) * material.shear
    along, across = 1.0 / twice, -eps / twice
    if direction == "tangential":
        return np.array([(1.5 - eps) / twice, -(0.5 - eps) / twice, across])
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


_UNIT = 2.0**-53
"""Of one rounding, relative."""


def static_rounding(integrals: Any, s: Any = None) -> Any:
    """Bound the rounding of `static_kernel` times the integrals of a load, shape (rows, n); s: radii over the disc's.

    It is over the kernel's largest row: the rows of a compliance come from one solution, and the part taken out of the
    integrand leaves the compliance's rounding in the integral: that of 1 / k all over, which adds up to the closed form
    again. In units of 2^-53, times the integral:

    - 16: the moduli with their damping and eps 3 each, the solution for the compliance 6, the kernel 2, the product
      and the sum 2;
    - 24: the integral itself. The second order needs it, at m next to `_ELLIPTIC`, where its terms are seven
      times their sum; the others are within 8, a point's within 4.

    In addition: s is rounded, once, and the integral follows by s times its slope. That is at most
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


def _check(direction: str) -> None:
    if direction not in get_args(Direction):
        raise unknown_name("load.direction", str(direction), get_args(Direction))


def _check_wavenumbers(k: Any) -> None:
    values = np.asarray(k)
    wrong = values[~(np.abs(values) <= MOST)]
    if wrong.size:
        raise Refusal("k", str(wrong.flat[0]), f"wavenumbers must be finite, at most {MOST:g}")


class _Directed:
    direction: Direction

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the Bessel functions that the rows of the kernel meet."""
        return (0, 2, 1) if self.direction == "tangential" else (1, 0)


@dataclass(frozen=True)
class Point(_Directed):
    """A force of one newton at the origin.

    A radial point load is the traction 1 / (2 pi r^2), whose transform is constant like that of the normal one.

    Parameters
    ----------
    direction : {"normal", "radial", "tangential"}, default "normal"
        Direction of the force.

    Raises
    ------
    Refusal
        For an unknown direction.

    Examples
    --------
    >>> from unitcad.attenuation import Point
    >>> Point("tangential").reach
    0.0
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
        """Return a bound of the rounding of `static_kernel` times `static`, over the kernel's largest row."""
        return static_rounding(self.static(r))


@dataclass(frozen=True)
class UniformDisc(_Directed):
    """A uniform stress of one pascal on a disc.

    Parameters
    ----------
    radius : float
        Radius of the disc, m, above 0.
    direction : {"normal", "radial", "tangential"}, default "normal"
        A pressure, a traction outwards, or one sideways.

    Raises
    ------
    Refusal
        For a radius that is not positive, and for an unknown direction.

    Examples
    --------
    >>> from unitcad.attenuation import UniformDisc
    >>> UniformDisc(3.5e-3).reach
    0.0035
    """

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
        return np.where(at_zero, a * a / 2.0, a * bessels((1,), k * a)[0] / np.where(at_zero, 1.0, k))[()]

    def envelope(self, k: Any) -> Any:
        """Return a bound of |q(k)| for real k."""
        x = np.asarray(k) * self.radius
        if self.direction == "radial":
            return self.radius**2 * np.minimum(0.3, (1.0 + np.sqrt(2.0 * x / np.pi)) * 1.1 / x**2)
        return self.radius**2 * np.minimum(0.5, bessel_bounds((1,), x)[0] / x)

    def static(self, r: Any) -> Any:
        """Return the integrals of q(k) J_n(kr) dk in m, a row an order, r in m."""
        return self.radius * disc_integrals(np.asarray(r, dtype=float) / self.radius, self.direction)

    def static_rounding(self, r: Any) -> Any:
        """Return a bound of the rounding of `static_kernel` times `static`, over the kernel's largest row."""
        s = np.asarray(r, dtype=float) / self.radius
        return self.radius * static_rounding(disc_integrals(s, self.direction), s)


Load = Point | UniformDisc

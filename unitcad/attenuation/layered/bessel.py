"""Bessel functions of the Hankel transforms, and the moment of J1 that is a radial disc's transform."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy import special

_SERIES = 1.0  # |x| up to which the power series of the moment is summed
_FAR = 40.0  # |x| from which the expansion in 1/x is good to 1e-16
_FIRST_ORDER = 100  # J of this order is below 1e-25 for |x| up to _FAR
_LEAST = 1e-220  # where the downward recurrence starts: at |x| = _SERIES it grows by 1e189


def bessel(order: int, x: Any) -> Any:
    """Return J0 or J1 of a real or complex array."""
    if np.iscomplexobj(x):
        return special.jv(order, x)
    return special.j0(x) if order == 0 else special.j1(x)


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
    true0, true1 = bessel(0, x), bessel(1, x)
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
    return inverse + (bessel(1, x) * zero / x - bessel(0, x) * one) / x


@cache
def _coefficients() -> tuple[tuple[float, float], ...]:
    """Return those of x^-2n in (pi/2) x K0 and (pi/2) K1: 1, -1, 9, -225, ... and 1, 1, -3, 45, ..."""
    zero, one = [1.0], [1.0]
    for n in range(20):
        zero.append(-zero[-1] * (2 * n + 1) ** 2)
        one.append(-one[-1] * (2 * n + 1) * (2 * n - 1))
    return tuple(zip(zero, one, strict=True))

"""The response of a layered medium by another method: global matrix in ball arithmetic, own path, own closed forms.

Nothing here is shared with `unitcad.attenuation` but the description of the medium. `ball_kernel` gives k C(k), which
is interpolated on panels that are halved until it is a polynomial there; its products with the Bessel functions are
then integrated on as many points as they need. The path is the real axis: damping puts each pole on its side. Bodies
without damping get small losses, from which a polynomial extrapolates to no loss.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import special

from benchmarks.accuracy.ball_kernel import Kernel, TooHard
from unitcad.attenuation.layered import LayeredMedium, LossFactor, UniformDisc

_DEGREE = 24
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_DEGREE)
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _DEGREE - 1))
_DENSE, _DENSE_WEIGHTS = np.polynomial.legendre.leggauss(32)
_PIECE = 24.0  # phase over those: their error is J of order 64 - _DEGREE at half of it, 1e-18
_DEEPEST = 60  # halvings of a panel
_MOST_POINTS = 3_000_000
_FINE = 1e-12
_LEAST_LOSS = 1e-6  # over 1: below it a body counts as undamped
_LOSSES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])


@dataclass(frozen=True)
class Reference:
    """(u_r, u_z) at the radii, shape (2, n), the estimated error of each, and the number of wavenumbers.

    Under a sideways load (u_r, u_theta, u_z).
    """

    u: np.ndarray
    doubt: np.ndarray
    wavenumbers: int


def response(medium: LayeredMedium, load: UniformDisc, omega: float, r: np.ndarray) -> Reference:
    """Return the displacement (m per pascal) at radii r (m).

    Raises UnitcadError without python-flint, TooHard where it takes too many points.
    """
    r = np.asarray(r, dtype=float)
    kernel = Kernel(medium, omega, load)
    if omega == 0.0 or kernel.least_loss >= _LEAST_LOSS:
        u, doubt = _along(kernel, load, r)
        return Reference(u, doubt, kernel.count)
    losses = _LOSSES * 1e-3 / max(1.0, kernel.slowest * (float(r.max()) + load.radius))
    kernels = [Kernel(_with_loss(medium, float(loss)), omega, load) for loss in losses]
    values, doubts = zip(*(_along(one, load, r) for one in kernels), strict=True)
    weights, fewer = _weights_at_0(losses), np.append(_weights_at_0(losses[:-1]), 0.0)
    u = np.tensordot(weights, values, 1)
    doubt = np.tensordot(np.abs(weights), doubts, 1) + np.abs(u - np.tensordot(fewer, values, 1))
    return Reference(u, doubt, sum(one.count for one in kernels))


def _with_loss(medium: LayeredMedium, tan_delta: float) -> LayeredMedium:
    """Return the medium with that loss factor in the bodies without damping."""
    loss = LossFactor(tan_delta)
    layers = [layer if layer.damping else replace(layer, damping=loss) for layer in medium.layers]
    base = medium.half_space
    return LayeredMedium(layers, base if base.damping else replace(base, damping=loss))


def _weights_at_0(x: np.ndarray) -> np.ndarray:
    """Return Lagrange's weights of values at `x` in their polynomial's value at 0."""
    return np.array([np.prod([other / (other - one) for other in x if other != one]) for one in x])


def _along(kernel: Kernel, load: UniformDisc, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrate along the real axis; return the integral and its doubt."""
    taken, total = kernel.static, _static(kernel, load, r).astype(complex)
    doubt = 1e-15 * np.abs(total)
    end = 3.0 * kernel.slowest or 0.1 / (float(r.max()) + load.radius)
    corners = np.concatenate([[0.0], end * 2.0 ** np.arange(-6.0, 1.0)])
    scale, spent = float(np.max(np.abs(total))), 0
    while True:
        span = float(r.max()) + load.radius
        spent += int(abs(corners[-1] - corners[0]) * span * 3)
        part, off, scale = _panels(kernel, load, r, corners, taken, scale, total)
        total, doubt = total + part, doubt + off
        at = float(corners[-1])
        last = np.abs(kernel(np.array([at], complex))[0] - taken)
        rest = _mixed(kernel, last)[:, None] * _tail(load, at, r)
        if np.max(rest) < _FINE * scale or spent > _MOST_POINTS:
            return total, doubt + rest
        corners = np.array([at, 2.0 * at])


def _tail(load: UniformDisc, k: float, r: np.ndarray) -> np.ndarray:
    """Bound what lies beyond k, over |kernel| there, for a kernel that falls as 1/k^2.

    By envelopes, and by parts where they oscillate.
    """
    wave = np.minimum(1.0, 1.0 / np.sqrt(np.maximum(k * r, 1e-300)))
    return _size(load, k) * wave * np.minimum(k, 4.0 / np.maximum(np.abs(r - load.radius), 1e-300))


def _size(load: UniformDisc, k: float) -> float:
    return load.radius**2 * min(0.5, (k * load.radius) ** -1.5)


def _panels(
    kernel: Kernel,
    load: UniformDisc,
    r: np.ndarray,
    corners: np.ndarray,
    taken: np.ndarray,
    scale: float,
    known: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Integrate over the panels between `corners`; return (integral, doubt, scale).

    A panel on which the kernel is no polynomial yet is halved.

    Doubt: the last two Legendre coefficients of the kernel times the largest that the rest of the integrand can be.
    """
    pending = [(a, b, 0) for a, b in pairwise(corners)]
    total, doubt = np.zeros(known.shape, dtype=complex), np.zeros(known.shape)
    while pending:
        some = []
        for a, b, depth in pending:
            k = (a + b) / 2 + (b - a) / 2 * _NODES
            values = kernel(k) - taken
            coefficients = _TO_LEGENDRE @ values
            part = _dense(kernel, load, r, a, b, coefficients)
            last = np.abs(coefficients[-2:]).sum(axis=0)
            wave = np.minimum(1.0, 1.0 / np.sqrt(np.maximum(abs(k[0]) * r, 1e-300)))
            off = 2.0 * _mixed(kernel, last)[:, None] * abs(b - a) * _size(load, abs(k[0])) * wave
            some.append((a, b, depth, part, off, last, np.abs(values).max(axis=0)))
        whole = known + total + np.sum([one[3] for one in some], axis=0)
        scale = max(scale, float(np.max(np.abs(whole))))
        pending = []
        for a, b, depth, part, off, last, most in some:
            noise = 1e-14 + 1e-16 * abs(b / (b - a))  # the last from the rounding of k
            if np.max(off) > 0.1 * _FINE * scale and np.any(last > noise * most) and depth < _DEEPEST:
                middle = (a + b) / 2
                pending += [(a, middle, depth + 1), (middle, b, depth + 1)]
            else:
                total, doubt = total + part, doubt + off
        if len(pending) > 3000:
            raise TooHard(f"{len(pending)} panels to halve")
    return total, doubt, scale


def _dense(
    kernel: Kernel, load: UniformDisc, r: np.ndarray, a: float, b: float, coefficients: np.ndarray
) -> np.ndarray:
    """Integrate the kernel's polynomial times transform and Bessel functions from a to b."""
    pieces = max(1, math.ceil(abs(b - a) * (float(r.max()) + load.radius) / _PIECE))
    out: np.ndarray = np.zeros((coefficients.shape[1], r.size), dtype=complex)
    step = max(1, 2_000_000 // (32 * r.size))
    for first in range(0, pieces, step):
        index = np.arange(first, min(first + step, pieces))
        t = ((2 * index + 1)[:, None] + _DENSE).ravel() / pieces - 1.0
        values = np.polynomial.legendre.legval(t, coefficients)
        k = (a + b) / 2 + (b - a) / 2 * t
        weight = (b - a) / 2 / pieces * np.tile(_DENSE_WEIGHTS, index.size)
        weighted, x = values * load.radius * special.j1(k * load.radius) / k * weight, k[:, None] * r
        if not kernel.sideways:
            out += np.stack([weighted[0] @ special.j1(x), weighted[1] @ special.j0(x)])
            continue
        slope, ratio = special.jvp(1, x), np.where(x > 0, special.j1(x) / np.where(x > 0, x, 1.0), 0.5)
        out[0] += weighted[0] @ slope + weighted[1] @ ratio
        out[1] -= weighted[0] @ ratio + weighted[1] @ slope
        out[2] -= weighted[2] @ special.j1(x)
    return out


def _mixed(kernel: Kernel, last: np.ndarray) -> np.ndarray:
    """Return what of the kernel's rows can meet in each component."""
    return np.array([last[0] + last[1], last[0] + last[1], last[2]]) if kernel.sideways else last


def _static(kernel: Kernel, load: UniformDisc, r: np.ndarray) -> np.ndarray:
    """Return the static half-space's displacement by hypergeometric functions, shape (components, n)."""
    zeroth, first, second = _static_orders(load, r)
    if kernel.sideways:
        along, shear, across = kernel.static
        slope, ratio = (zeroth - second) / 2.0, (zeroth + second) / 2.0
        return np.array([along * slope + shear * ratio, -along * ratio - shear * slope, -across * first])
    return kernel.static[:, None] * np.array([first, zeroth])


def _static_orders(load: UniformDisc, r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate q(k) J_n(kr) dk for n = 0, 1 and 2."""
    a, s = load.radius, r / load.radius
    low, high = np.minimum(s, 1.0), np.maximum(s, 1.0)
    inside = special.hyp2f1(0.5, -0.5, 1.0, low**2)
    outside = special.hyp2f1(0.5, 0.5, 2.0, high**-2.0) / (2.0 * high)
    zeroth, first = np.where(s <= 1, inside, outside), np.where(s <= 1, s / 2, 0.5 / high)
    inside = low**2 / 8.0 * special.hyp2f1(0.5, 1.5, 3.0, low**2)
    outside = special.hyp2f1(1.5, -0.5, 2.0, high**-2.0) / (2.0 * high)
    return a * zeroth, a * first, a * np.where(s <= 1, inside, outside)

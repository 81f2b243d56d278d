"""The response of a layered medium by another method: global matrix in ball arithmetic, own path, own closed forms.

Nothing here is shared with `unitcad.attenuation` but the description of the medium. Per wavenumber the amplitudes of
the P and S waves of all layers solve one linear system (the global matrix method) in balls of 320 bits
(python-flint). So neither growing exponentials nor similar P and S waves cost a digit. k C(k) is interpolated on panels
that are halved until it is a polynomial there; its products with the Bessel functions are then integrated on as many
points as they need. The path is the real axis: damping puts each pole on its side. Bodies without damping get small
losses, from which a polynomial extrapolates to no loss.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import special

from unitcad.attenuation.layered.loads import Load, Point
from unitcad.attenuation.layered.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt, KelvinVoigt, LossFactor
from unitcad.errors import Missing

BITS = 320
_DEGREE = 16
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_DEGREE)
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _DEGREE - 1))
_DENSE, _DENSE_WEIGHTS = np.polynomial.legendre.leggauss(32)

_DEEPEST = 60  # halvings of a panel
_MOST_POINTS = 3_000_000
_FINE = 1e-12
_LEAST_LOSS = 1e-6  # over 1: below it a body counts as undamped
_LOSSES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])


@dataclass(frozen=True)
class Reference:
    """(u_r, u_z) at the radii, shape (2, n), the estimated error of each, and the number of wavenumbers."""

    u: np.ndarray
    doubt: np.ndarray
    wavenumbers: int


class TooHard(Exception):
    """A medium for which the reference needs too long."""


def response(medium: LayeredMedium, load: Load, omega: float, r: np.ndarray, z: float = 0.0) -> Reference:
    """Return the displacement (m per pascal or newton) at radii r and depth z (m); r > 0 under a surface point load.

    Raises UnitcadError without python-flint, TooHard where it takes too many points.
    """
    r = np.asarray(r, dtype=float)
    kernel = Kernel(medium, omega, z)
    if omega == 0.0 or kernel.least_loss >= _LEAST_LOSS:
        u, doubt = _along(kernel, load, r)
        return Reference(u, doubt, kernel.count)
    losses = _LOSSES * 1e-3 / max(1.0, kernel.slowest * (float(r.max()) + load.reach))
    kernels = [Kernel(_with_loss(medium, float(loss)), omega, z) for loss in losses]
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


class Kernel:
    """k C(k) of a medium at omega (rad/s) and depth z (m), both tractions, shape (n, 2, 2) for n wavenumbers."""

    def __init__(self, medium: LayeredMedium, omega: float, z: float) -> None:
        try:
            import flint
            import mpmath  # noqa: F401  for the static radial disc
        except ImportError:
            raise Missing("the reference needs python-flint and mpmath: pip install 'unitcad[test]'") from None
        self.flint, self.omega, self.z, self.count = flint, omega, z, 0
        self.least_loss, self.slowest = math.inf, 0.0
        flint.ctx.prec = BITS
        self.bodies = []
        bodies = [layer for layer in medium.layers if layer.thickness > 0]
        mass = sum(layer.density * layer.thickness for layer in bodies)
        for body in (*bodies, medium.half_space):
            mu, eps, ks2 = self._material(body)
            h = flint.arb(body.thickness) if isinstance(body, Layer) else None
            self.bodies.append((mu, eps, ks2, h))
            if body.youngs_modulus == 0.0:
                continue
            slow = abs(complex(ks2)) ** 0.5
            if isinstance(body, Layer):  # and bending as a plate
                bend = (12 * mass * omega**2 / (body.youngs_modulus * body.thickness**3)) ** 0.25
                slow = max(slow, min(bend, 40 * slow))
            self.slowest = max(self.slowest, slow)
            self.least_loss = min(self.least_loss, complex(mu).imag / abs(complex(mu)))
        mu, eps, _, _ = self.bodies[0]
        self.static = self._static(complex(mu), float(eps)) if complex(mu) else np.zeros((2, 2), complex)

    def _material(self, body: Layer | HalfSpace) -> tuple[Any, Any, Any]:
        arb, acb = self.flint.arb, self.flint.acb
        nu, omega, damping = arb(body.poisson_ratio), arb(self.omega), body.damping
        mu = acb(arb(body.youngs_modulus) / (2 * (1 + nu)))
        if isinstance(damping, LossFactor):
            mu = mu * acb(1, damping.tan_delta)
        elif isinstance(damping, KelvinVoigt):
            mu = mu + acb(0, omega * arb(damping.viscosity))
        elif isinstance(damping, FractionalKelvinVoigt) and self.omega > 0:
            mu = mu * (1 + acb(0, omega * arb(damping.tau)) ** acb(arb(damping.n)))
        ks2 = arb(body.density) * omega**2 / mu if body.youngs_modulus else acb(0)
        return mu, (1 - 2 * nu) / (2 * (1 - nu)), ks2

    @staticmethod
    def _static(mu: complex, eps: float) -> np.ndarray:
        """Return the limit of k C(k) for large k: the top layer as a half-space (Boussinesq and Cerruti)."""
        along = 1.0 / (2.0 * mu * (1.0 - eps))
        across = -eps / (2.0 * mu * (1.0 - eps))
        return np.array([[along, across], [across, along]])

    def __call__(self, k: np.ndarray) -> np.ndarray:
        self.count += k.size
        return np.array([self._one(complex(one)) for one in k])

    def _one(self, k: complex) -> np.ndarray:
        acb, mat = self.flint.acb, self.flint.acb_mat
        at, last, scale = acb(k), len(self.bodies) - 1, abs(complex(self.bodies[0][0]))
        free = complex(self.bodies[last][0]) == 0
        size = 4 * last + (0 if free else 2)
        rows = [[acb(0)] * size for _ in range(size)]
        seen = [[acb(0)] * size for _ in range(2)]

        def place(interface: int, column: int, state: list[Any]) -> None:
            """Enter tractions at the surface and at a free underside, all four components at an interface."""
            underside = free and interface == last
            first = 4 * interface - (4 if underside else 2)
            for c in range(2 if interface == 0 or underside else 0, 4):
                rows[first + c][column] = state[c]

        top, depth = self.flint.arb(0), self.flint.arb(self.z)
        for i, (mu, eps, ks2, h) in enumerate(self.bodies[: last if free else last + 1]):
            inside = bool(depth >= top) and (h is None or bool(depth < top + h) or (free and i == last - 1))
            for j, (shape, rate) in enumerate(self._waves(mu / scale, eps, ks2, at)):
                column = 4 * i + j
                place(i, column, shape(acb(0)))
                if inside:
                    here, fall = shape(acb(depth - top)), (-rate * (depth - top)).exp()
                    seen[0][column], seen[1][column] = here[0] * fall, here[1] * fall
                if h is None:
                    continue
                fall, end = (-rate * h).exp(), shape(acb(h))
                place(i + 1, column, [-value * fall for value in end])
                # The wave that goes up from the bottom is the mirror image.
                place(i, column + 2, [value * sign * fall for value, sign in zip(end, _MIRROR, strict=True)])
                start = shape(acb(0))
                place(i + 1, column + 2, [-value * sign for value, sign in zip(start, _MIRROR, strict=True)])
                if inside:
                    up = top + h - depth
                    here, fall = shape(acb(up)), (-rate * up).exp()
                    seen[0][column + 2], seen[1][column + 2] = here[0] * fall, -here[1] * fall
            top = top + h if h is not None else top
        right = [[acb(0), acb(0)] for _ in range(size)]
        right[0][0] = right[1][1] = acb(1) / scale
        for one, given in zip(rows, right, strict=True):
            most = acb(max(abs(complex(value)) for value in one))
            one[:], given[:] = [value / most for value in one], [value / most for value in given]
        solved = mat(seen) * mat(rows).solve(mat(right))
        return np.array([[complex(at * solved[a, b]) for b in range(2)] for a in range(2)])

    def _waves(self, mu: Any, eps: Any, ks2: Any, k: Any) -> list[tuple[Callable[[Any], list[Any]], Any]]:
        """Return the two waves that go down: (u_r, u_z, t_r, t_z) at a depth less its exponential, and its rate."""
        if self.omega == 0.0:
            turn = -(1 + eps) / (1 - eps)

            def linear(z: Any) -> list[Any]:
                u, w = turn + k * z, k * z
                shear = mu * (k - k * turn - k * k * z - k * w)
                normal = -2 * mu * k * (1 - 2 * eps) / (1 - eps) + 2 * mu * (k - k * k * z)
                return [u, w, -shear, -normal]

            return [(lambda z: [k, k, 2 * mu * k * k, 2 * mu * k * k], k), (linear, k)]
        gp, gs, q = _root(k * k - eps * ks2), _root(k * k - ks2), mu * (2 * k * k - ks2)
        pressure, shear = [k, gp, 2 * mu * k * gp, q], [gs, k, q, 2 * mu * k * gs]
        return [(lambda z: pressure, gp), (lambda z: shear, gs)]


_MIRROR = (1, -1, -1, 1)


def _root(squared: Any) -> Any:
    """Return the root of a wave that decays downwards or, undamped, runs downwards."""
    root = squared.sqrt()
    value = complex(root)
    return -root if value.real < 0 or (value.real == 0 and value.imag < 0) else root


def _along(kernel: Kernel, load: Load, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrate along the real axis; return the integral and its doubt."""
    column = 1 if load.direction == "normal" else 0
    order = [column, 1 - column]  # rows of the kernel that go with (along, across)
    total = np.zeros((2, r.size), dtype=complex)
    taken = np.zeros(2, dtype=complex)
    if kernel.z == 0:
        taken = kernel.static[:, column]
        total[order] = taken[order][:, None] * np.array(_static_pair(load, r))
    doubt = 1e-15 * np.abs(total)
    end = 3.0 * kernel.slowest or 0.1 / (float(r.max()) + load.reach)
    corners = np.concatenate([[0.0], end * 2.0 ** np.arange(-6.0, 1.0)])
    scale, spent = float(np.max(np.abs(total))), 0
    while True:
        span = float(r.max()) + load.reach
        spent += int(abs(corners[-1] - corners[0]) * span * 3)
        part, off, scale = _panels(kernel, load, r, corners, column, taken, scale, total)
        total, doubt = total + part, doubt + off
        at = float(corners[-1])
        last = np.abs(kernel(np.array([at], complex))[0, :, column] - taken)
        rest = last[:, None] * _tail(load, at, r)
        if np.max(rest) < _FINE * scale or spent > _MOST_POINTS:
            return total, doubt + rest
        corners = np.array([at, 2.0 * at])


def _tail(load: Load, k: float, r: np.ndarray) -> np.ndarray:
    """Bound what lies beyond k, over |kernel| there, for a kernel that falls as 1/k^2.

    By envelopes, and by parts where they oscillate.
    """
    wave = np.minimum(1.0, 1.0 / np.sqrt(np.maximum(k * r, 1e-300)))
    return _size(load, k) * wave * np.minimum(k, 4.0 / np.maximum(np.abs(r - load.reach), 1e-300))


def _size(load: Load, k: float) -> float:
    if isinstance(load, Point):
        return 1.0 / (2.0 * math.pi)
    return load.radius**2 * min(0.5, (k * load.radius) ** -1.5)


def _panels(
    kernel: Kernel,
    load: Load,
    r: np.ndarray,
    corners: np.ndarray,
    column: int,
    taken: np.ndarray,
    scale: float,
    known: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Integrate over the panels between `corners`; return (integral, doubt, scale).

    A panel on which the kernel is no polynomial yet is halved.

    Doubt: the last two Legendre coefficients of the kernel times the largest that the rest of the integrand can be.
    """
    pending = [(a, b, 0) for a, b in pairwise(corners)]
    total, doubt = np.zeros((2, r.size), dtype=complex), np.zeros((2, r.size))
    while pending:
        some = []
        for a, b, depth in pending:
            k = (a + b) / 2 + (b - a) / 2 * _NODES
            values = kernel(k)[:, :, column] - taken
            coefficients = _TO_LEGENDRE @ values
            part = _dense(load, r, a, b, coefficients)
            last = np.abs(coefficients[-2:]).sum(axis=0)
            wave = np.minimum(1.0, 1.0 / np.sqrt(np.maximum(abs(k[0]) * r, 1e-300)))
            off = 2.0 * last[:, None] * abs(b - a) * _size(load, abs(k[0])) * wave
            some.append((a, b, depth, part, off, last, np.abs(values).max(axis=0)))
        whole = known + total + np.sum([one[3] for one in some], axis=0)
        scale = max(scale, float(np.max(np.abs(whole))))
        pending = []
        for a, b, depth, part, off, last, most in some:
            if np.max(off) > 0.1 * _FINE * scale and np.any(last > 1e-14 * most) and depth < _DEEPEST:
                middle = (a + b) / 2
                pending += [(a, middle, depth + 1), (middle, b, depth + 1)]
            else:
                total, doubt = total + part, doubt + off
        if len(pending) > 3000:
            raise TooHard(f"{len(pending)} panels to halve")
    return total, doubt, scale


def _dense(load: Load, r: np.ndarray, a: float, b: float, coefficients: np.ndarray) -> np.ndarray:
    """Integrate the kernel's polynomial times transform and Bessel functions from a to b."""
    pieces = max(1, math.ceil(abs(b - a) * (float(r.max()) + load.reach) / 12.0))
    out = np.zeros((2, r.size), dtype=complex)
    step = max(1, 2_000_000 // (32 * r.size))
    for first in range(0, pieces, step):
        index = np.arange(first, min(first + step, pieces))
        t = ((2 * index + 1)[:, None] + _DENSE).ravel() / pieces - 1.0
        values = np.polynomial.legendre.legval(t, coefficients)
        k = (a + b) / 2 + (b - a) / 2 * t
        weight = (b - a) / 2 / pieces * np.tile(_DENSE_WEIGHTS, index.size)
        q, waves = _transform(load, k), [special.j1(k[:, None] * r), special.j0(k[:, None] * r)]
        out += np.stack([(values[c] * q * weight) @ waves[c] for c in range(2)])
    return out


def _transform(load: Load, k: np.ndarray) -> np.ndarray:
    """Integrate the load times J(kr) r dr."""
    if isinstance(load, Point):
        return np.full(k.shape, 1.0 / (2.0 * math.pi))
    a, x = load.radius, k * load.radius
    if load.direction == "normal":
        return a * special.j1(x) / k
    far = np.maximum(x, 8.0)
    struve = np.pi / 2 * (special.j1(far) * special.struve(0, far) - special.j0(far) * special.struve(1, far)) / far
    near = (x <= 8.0) | ~np.isfinite(struve)  # scipy's struve(0, x) has a gap at 25.765
    if near.any():
        nodes, weights = np.polynomial.legendre.leggauss(64)
        t = (nodes + 1) / 2
        struve[near] = special.j1(x[near, None] * t) @ (weights / 2 * t)
    return a * a * struve


def _static_pair(load: Load, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrate q(k) J(kr) dk with the load's own Bessel function and with the other, as hypergeometric functions."""
    if isinstance(load, Point):
        return 1.0 / (2 * np.pi * r), 1.0 / (2 * np.pi * r)
    a, s = load.radius, r / load.radius
    if load.direction == "normal":
        inside = special.hyp2f1(0.5, -0.5, 1.0, np.minimum(s, 1.0) ** 2)
        outside = special.hyp2f1(0.5, 0.5, 2.0, np.maximum(s, 1.0) ** -2.0) / (2.0 * np.maximum(s, 1.0))
        return a * np.where(s <= 1, inside, outside), a * np.where(s <= 1, s / 2, 0.5 / np.maximum(s, 1.0))
    return a * np.array([_radial(float(one)) for one in s]), np.where(s < 1, a * (1.0 - s), 0.0)


def _radial(s: float) -> float:
    """Integrate the radial disc of radius 1 over rings of radius x.

    Each ring gives 2 (K - E)(m) / (pi min(s, x)), m = (min / max)^2.
    """
    import mpmath as mp

    with mp.workdps(40):

        def ring(x: Any) -> Any:
            low, high = (x, s) if x < s else (s, x)
            m = (low / high) ** 2
            return mp.mpf(0) if m == 1 or m == 0 else 2 * (mp.ellipk(m) - mp.ellipe(m)) / (mp.pi * low) * x

        cuts = sorted({mp.mpf(0), mp.mpf(1), *([mp.mpf(s)] if 0 < s < 1 else [])})
        integral: Any = mp.quad(ring, cuts) if s > 0 else 0.0
        return float(integral)

"""k C(k) of a layered medium by the global matrix method in ball arithmetic (python-flint), of 128 bits or more.

Nothing here is shared with `unitcad.attenuation` but the description of the medium. The amplitudes of the waves of all
layers solve one linear system, so that neither growing exponentials nor P and S alike cost a digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from unitcad.attenuation.layered import (
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LayeredMedium,
    LossFactor,
    UniformDisc,
)
from unitcad.extras import missing_extra

BITS = 128
"""The least precision; it is doubled where the balls of the result are too wide, which hold whatever it is."""
_MOST_BITS = 5120
_ENOUGH = 2.0**-56  # radius of a ball over the largest of the results


class TooHard(Exception):
    """A medium for which the reference needs too long."""


class Kernel:
    """k C(k) of a medium at omega (rad/s), a value a row of the load, shape (n, rows).

    Rows: (u_r, u_z) under a pressure; (u_r, u_theta of horizontal shear, u_z) under a sideways load.
    """

    def __init__(self, medium: LayeredMedium, omega: float, load: UniformDisc) -> None:
        try:
            import flint
        except ImportError:
            raise missing_extra("test", "the reference needs python-flint") from None
        self.flint, self.omega, self.count, self.bits = flint, omega, 0, BITS
        self.sideways = load.direction == "tangential"
        self.least_loss, self.slowest = math.inf, 0.0
        layers = [layer for layer in medium.layers if layer.thickness > 0]
        self.medium = (*layers, medium.half_space)
        self._describe()
        self.sizes = [(abs(complex(mu)), abs(complex(ks2)) ** 0.5) for mu, _, ks2, _ in self.bodies]
        mass = sum(layer.density * layer.thickness for layer in layers)
        for body, (mu, _, ks2, _) in zip(self.medium, self.bodies, strict=True):
            if body.youngs_modulus == 0.0:
                continue
            slow = abs(complex(ks2)) ** 0.5
            if isinstance(body, Layer):  # and bending as a plate
                bend = (12 * mass * omega**2 / (body.youngs_modulus * body.thickness**3)) ** 0.25
                slow = max(slow, min(bend, 40 * slow))
            self.slowest = max(self.slowest, slow)
            self.least_loss = min(self.least_loss, complex(mu).imag / abs(complex(mu)))
        mu, eps, _, _ = self.bodies[0]
        self.static = self._static(complex(mu), float(eps)) if complex(mu) else np.zeros(3 if self.sideways else 2)

    def _describe(self) -> None:
        """Write the bodies as balls of the present precision."""
        self.flint.ctx.prec = self.bits
        self.bodies = [
            (*self._material(body), self.flint.arb(body.thickness) if isinstance(body, Layer) else None)
            for body in self.medium
        ]

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

    def _static(self, mu: complex, eps: float) -> np.ndarray:
        """Return the limit of k C(k) for large k: the top layer as a half-space (Boussinesq and Cerruti)."""
        along = 1.0 / (2.0 * mu * (1.0 - eps))
        across = -eps / (2.0 * mu * (1.0 - eps))
        if self.sideways:
            return np.array([along, 1.0 / mu, across])
        return np.array([across, along])

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Return the rows at wavenumbers k (1/m). Raises TooHard where no precision is enough."""
        self.count += k.size
        self.flint.ctx.prec = self.bits
        return np.array([self._rows(complex(one)) for one in k])

    def _rows(self, k: complex) -> np.ndarray:
        while True:
            try:
                found = self._one(k)
                if self.sideways:
                    found.insert(1, self._shear(k))
            except ZeroDivisionError:  # a pivot's ball holds zero
                found = []
            values = np.array([complex(ball) for ball in found])
            wide = max((abs(float(part.rad())) for ball in found for part in (ball.real, ball.imag)), default=math.inf)
            if wide <= _ENOUGH * np.max(np.abs(values), initial=0.0):
                return values
            if self.bits >= _MOST_BITS:
                raise TooHard(f"more than {_MOST_BITS} bits at k = {k:g} /m")
            self.bits *= 2
            self._describe()

    def _scales(self, k: complex) -> list[Any]:
        """Return over what the traction at each interface goes, so that no equation is large beside another."""
        most = [stiffness * max(abs(k), rate) for stiffness, rate in self.sizes]
        return [self.flint.arb(1.0 / max(pair)) for pair in zip([0.0, *most], [*most, 0.0], strict=True) if any(pair)]

    def _shear(self, k: complex) -> Any:
        """Return k times u_theta per traction, by a wave down (1, mu g) and one up (1, -mu g) a layer."""
        acb, mat = self.flint.acb, self.flint.acb_mat
        at, last, scales = acb(k), len(self.bodies) - 1, self._scales(k)
        free = complex(self.bodies[last][0]) == 0
        size = 2 * last + (0 if free else 1)
        rows, seen = [[acb(0)] * size for _ in range(size)], [acb(1), *[acb(0)] * (size - 1)]

        def place(interface: int, column: int, u: Any, t: Any) -> None:
            underside = free and interface == last
            if interface > 0 and not underside:
                rows[2 * interface - 1][column] = u
            rows[2 * interface - (1 if underside else 0)][column] = t * scales[interface]

        for i, (mu, _, ks2, h) in enumerate(self.bodies[: last if free else last + 1]):
            rate = _root(at * at - ks2)
            stiffness = mu * rate
            place(i, 2 * i, acb(1), stiffness)
            if h is None:
                continue
            fall = (-rate * h).exp()
            place(i + 1, 2 * i, -fall, -stiffness * fall)
            place(i, 2 * i + 1, fall, -stiffness * fall)
            place(i + 1, 2 * i + 1, acb(-1), stiffness)
            if i == 0:
                seen[1] = fall
        right = [[acb(scales[0])]] + [[acb(0)] for _ in range(size - 1)]
        return at * (mat([seen]) * mat(rows).solve(mat(right), algorithm="lu"))[0, 0]

    def _one(self, k: complex) -> list[Any]:
        """Return k times (u_r, u_z) at the surface per traction."""
        acb, mat = self.flint.acb, self.flint.acb_mat
        at, last, scales = acb(k), len(self.bodies) - 1, self._scales(k)
        free = complex(self.bodies[last][0]) == 0
        size = 4 * last + (0 if free else 2)
        zero = acb(0)
        rows = [[zero] * size for _ in range(size)]
        seen = [[zero] * size for _ in range(2)]

        def place(interface: int, column: int, r: Any, z: Any, t_r: Any, t_z: Any) -> None:
            """Enter tractions at the surface and at a free underside, all four components at an interface."""
            underside = free and interface == last
            first = 4 * interface - (4 if underside else 2)
            if interface > 0 and not underside:
                rows[first][column], rows[first + 1][column] = r, z
            scale = scales[interface]
            rows[first + 2][column], rows[first + 3][column] = t_r * scale, t_z * scale

        for i, (mu, eps, ks2, h) in enumerate(self.bodies[: last if free else last + 1]):
            waves = self._waves(mu, eps, ks2, at, self.flint.arb(1.0 / max(abs(k), self.sizes[i][1])))
            for column, (shape, rate) in enumerate(waves, 4 * i):
                start = shape(zero)
                place(i, column, *start)
                if i == 0:
                    seen[0][column], seen[1][column] = start[:2]
                if h is None:
                    continue
                fall = (-rate * h).exp()
                r, z, t_r, t_z = (value * fall for value in shape(acb(h)))
                place(i + 1, column, -r, -z, -t_r, -t_z)
                # The wave that goes up from the bottom is the mirror image.
                place(i, column + 2, r, -z, -t_r, t_z)
                if i == 0:
                    seen[0][column + 2], seen[1][column + 2] = r, -z
                r, z, t_r, t_z = start
                place(i + 1, column + 2, -r, z, t_r, -t_z)
        right = [[zero] for _ in range(size)]
        right[0 if self.sideways else 1][0] = acb(scales[0])
        solved = mat(seen) * mat(rows).solve(mat(right), algorithm="lu")
        return [at * solved[a, 0] for a in range(2)]

    def _waves(
        self, mu: Any, eps: Any, ks2: Any, k: Any, factor: Any
    ) -> list[tuple[Callable[[Any], tuple[Any, ...]], Any]]:
        """Return the two waves that go down: (u_r, u_z, t_r, t_z) at a depth less its exponential, and its rate.

        Each times a factor (m).
        """
        if self.omega == 0.0:
            turn = -(1 + eps) / (1 - eps)
            shear, even = 2 * mu * k, factor * k

            def linear(z: Any) -> tuple[Any, ...]:
                u, w = turn + k * z, k * z
                across = shear * (turn + 2 * k * z - 1) / 2
                normal = shear * ((1 - 2 * eps) / (1 - eps) - 1 + k * z)
                return u, w, across, normal

            return [(lambda z: (even, even, shear * even, shear * even), k), (linear, k)]
        gp, gs, q = _root(k * k - eps * ks2), _root(k * k - ks2), factor * mu * (2 * k * k - ks2)
        k = k * factor
        twice = 2 * mu * k
        pressure, shear = (k, gp * factor, twice * gp, q), (gs * factor, k, q, twice * gs)
        return [(lambda z: pressure, gp), (lambda z: shear, gs)]


def _root(squared: Any) -> Any:
    """Return the root of a wave that decays downwards or, undamped, runs downwards."""
    root = squared.sqrt()
    value = complex(root)
    return -root if value.real < 0 or (value.real == 0 and value.imag < 0) else root

"""Responses of extreme media beside an independent path of integration: the true error and what `error` says of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from unitcad.accuracy.hankel import DISC, OMEGA, RADII, Case, brute_force
from unitcad.attenuation.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.rheology import Damping, KelvinVoigt, LossFactor

TOLERANCES = (0.1, 1e-3, 1e-6, 1e-9, 1e-12)
SURVEYED = (1e-3, 1e-6, 1e-9)


@dataclass(frozen=True)
class Row:
    """A response's largest error over the radii, its estimate and the reference's own doubt, over the largest |u|."""

    case: str
    rtol: float
    error: float
    estimate: float
    doubt: float

    @property
    def over_estimate(self) -> float:
        """The true error over its estimate, as far as the reference can tell."""
        return max(self.error - self.doubt, 0.0) / max(self.estimate, 2e-13)

    @property
    def met(self) -> bool:
        """Whether the response says that it is within rtol."""
        return self.estimate <= self.rtol

    @property
    def judged(self) -> bool:
        """Whether the reference is good enough to tell."""
        return self.doubt <= 0.1 * max(self.estimate, 2e-12)


def rows(media: Iterable[Case], tolerances: Iterable[float] = TOLERANCES) -> Iterator[Row]:
    """Every case at every tolerance."""
    for case in media:
        bodies = (*case.medium.layers, case.medium.half_space)
        pairs = zip(case.medium.materials(case.omega), bodies, strict=True)
        shear = case.omega / min(math.sqrt(abs(material.shear) / part.density) for material, part in pairs)
        mass = sum(layer.thickness * layer.density for layer in case.medium.layers)
        # Layers that bend as plates have poles beyond every wave's.
        plates = [(12 * mass * case.omega**2 / (p.youngs_modulus * p.thickness**3)) ** 0.25 for p in case.medium.layers]
        poles = max(3 * shear, 2 * min(max(plates), 40 * shear), 2000.0)
        end = max(20 / case.medium.layers[0].thickness, 50 * poles, 1e6)
        panels = math.ceil(1500 * end / 1e6)
        reference = brute_force(case, end, poles, 50.0, panels)
        other = brute_force(case, 1.3 * end, 1.2 * poles, 30.0, panels)
        scale = float(np.max(np.abs(reference)))
        doubt = float(np.max(np.abs(other - reference))) / scale
        for rtol in tolerances:
            found = case.medium.response(DISC, case.omega, RADII, rtol=rtol)
            error = float(np.max(np.abs(found.u_z - reference))) / scale
            yield Row(case.name, rtol, error, found.error / scale, doubt)


def cases() -> list[Case]:
    """Stiff on soft and soft on stiff by 1e6, next to nu = 1/2, low frequency, a film, no damping at all."""

    def two(
        name: str, top: float, below: float, nu: float, thickness: float, damping: Damping, omega: float = OMEGA
    ) -> Case:
        layer = Layer(thickness, 1050.0, top, nu, damping)
        return Case(name, LayeredMedium([layer], HalfSpace(1050.0, below, nu, damping)), omega)

    loss = LossFactor(0.2)
    return [
        two("stiff on soft, 1e6", 1e9, 1e3, 0.45, 1e-3, loss),
        two("soft on stiff, 1e6", 1e4, 1e10, 0.45, 5e-3, loss),
        two("nu = 1/2 - 1e-9", 1e4, 1e5, 0.5 - 1e-9, 2e-3, KelvinVoigt(2.0)),
        two("nu = 1/2, no damping", 2e5, 2e4, 0.5, 2e-3, None),
        two("1 rad/s, no damping", 1e4, 1e5, 0.49, 2e-3, None, 1.0),
        two("6e3 rad/s", 1e5, 1e6, 0.49, 2e-3, loss, 6e3),
        two("film of 0.1 mm", 1e7, 1e4, 0.49, 1e-4, loss),
    ]


def survey(count: int, seed: int = 20) -> Iterator[Case]:
    """Random media: one to four layers of 3e-6 to 0.02 m, moduli of 1 kPa to 1 GPa, nu from 0 to 1/2, with and without
    damping, 1 to 6e3 rad/s. Thinner films are beyond the reference.
    """
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    for i in range(count):
        damped = rng.random() < 0.7
        layers = int(rng.integers(1, 5))
        parts = [
            (
                between(3e-6, 0.02),
                float(rng.uniform(900, 2000)),
                between(1e3, 1e9),
                float(rng.choice([0.0, 0.3, 0.45, 0.49, 0.4999999, 0.5])),
                LossFactor(between(0.01, 0.5)) if damped else None,
            )
            for _ in range(layers + 1)
        ]
        medium = LayeredMedium([Layer(*part) for part in parts[:-1]], HalfSpace(*parts[-1][1:]))
        yield Case(f"random {i}", medium, between(1.0, 6e3))

"""Responses of extreme media beside an independent path of integration: the true error and what `error` says of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from unitcad.accuracy.hankel import DISC, OMEGA, RADII, Case, brute_force
from unitcad.attenuation.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.rheology import Damping, KelvinVoigt, LossFactor

TOLERANCES = (1e-3, 1e-6, 1e-9)


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


def rows() -> Iterator[Row]:
    """Every case at every tolerance."""
    for case in cases():
        bodies = (*case.medium.layers, case.medium.half_space)
        pairs = zip(case.medium.materials(case.omega), bodies, strict=True)
        slowest = min(math.sqrt(abs(material.shear) / part.density) for material, part in pairs)
        poles = max(3 * case.omega / slowest, 200.0)
        reference = brute_force(case, end=1e6, poles=poles, height=min(50.0, poles / 4))
        other = brute_force(case, end=1.3e6, poles=1.2 * poles, height=min(30.0, poles / 6))
        scale = float(np.max(np.abs(reference)))
        doubt = float(np.max(np.abs(other - reference))) / scale
        for rtol in TOLERANCES:
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

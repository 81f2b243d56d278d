"""Rubber laws fitted to a tensile curve, and whether they are stable. SI; strain and stress are engineering values.

All are isotropic and incompressible: nominal stress P = dW/d(stretch) of a bar with free sides, Young's modulus at zero
strain E = 3 mu. Neo-Hooke: W = C10 (I1 - 3). Mooney: + C01 (I2 - 3). Yeoh: C10, C20, C30 in powers of (I1 - 3). Ogden,
one term: W = 2 mu / alpha^2 (sum of stretch^alpha - 3).

Stability is Hill's condition (Drucker's for these laws): the second derivative of W by the logarithmic strains is
positive definite, so that more stress goes with more strain in every direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Law = Literal["neo-Hooke", "Mooney", "Yeoh", "Ogden"]
MODES: Mapping[str, tuple[float, float]] = {"tension": (1.0, -0.5), "plane strain": (1.0, 0.0), "biaxial": (1.0, 1.0)}
"""Logarithmic strains along the first two axes, per strain of the first: a bar, a wide strip, a sheet."""
_STEPS = 400


@dataclass(frozen=True)
class HyperelasticFit:
    """A law with its constants (Pa; alpha is a number), fitted up to a strain.

    `youngs_modulus`: at zero strain, Pa. `residual`: rms of the misfit over the rms of the stress. `unstable`: for each
    mode the least strain at which Hill's condition fails.
    """

    law: Law
    constants: Mapping[str, float]
    up_to: float
    youngs_modulus: float
    residual: float
    unstable: Mapping[str, float]

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return the nominal stress (Pa) of a bar at engineering strains, any shape."""
        return nominal_stress(self.law, self.constants, strain)


def fit_law(law: Law, strain: np.ndarray, stress: np.ndarray, up_to: float, used: float) -> HyperelasticFit:
    """Fit a law by least squares to the points (n,) with a strain of 0 to `up_to`; stress in Pa.

    Stability is asked in tension up to `up_to` and in every mode up to `used`, the strain of the application.
    """
    kept = (strain >= 0.0) & (strain <= up_to)
    x, y = strain[kept], stress[kept]
    if law == "Ogden":
        constants = _fit_ogden(x, y)
    else:
        columns = _columns(law, x)
        values = np.linalg.lstsq(np.stack(list(columns.values()), axis=1), y, rcond=None)[0]
        constants = {name: float(value) for name, value in zip(columns, values, strict=True)}
    misfit = nominal_stress(law, constants, x) - y
    residual = float(np.sqrt(np.mean(misfit**2) / np.mean(y**2)))
    reach = {mode: max(up_to, used) if mode == "tension" else used for mode in MODES}
    return HyperelasticFit(
        law, constants, up_to, youngs_modulus(law, constants), residual, first_unstable(law, constants, reach)
    )


def least_points(law: Law) -> int:
    """Return how many points a fit needs: one more than constants."""
    return {"neo-Hooke": 2, "Mooney": 3, "Yeoh": 4, "Ogden": 3}[law]


def youngs_modulus(law: Law, constants: Mapping[str, float]) -> float:
    """Return E = 3 mu at zero strain, Pa."""
    if law == "Ogden":
        return 3.0 * constants["mu"]
    return 6.0 * (constants["c10"] + constants.get("c01", 0.0))


def nominal_stress(law: Law, constants: Mapping[str, float], strain: np.ndarray) -> np.ndarray:
    """Return the nominal stress (Pa) of a bar with free sides at engineering strains, any shape."""
    if law == "Ogden":
        mu, alpha, stretch = constants["mu"], constants["alpha"], 1.0 + np.asarray(strain, float)
        return 2.0 * mu / alpha * (stretch ** (alpha - 1.0) - stretch ** (-alpha / 2.0 - 1.0))
    columns = _columns(law, strain)
    return np.sum([constants[name] * column for name, column in columns.items()], axis=0)


def first_unstable(law: Law, constants: Mapping[str, float], reach: Mapping[str, float]) -> dict[str, float]:
    """Return, for each mode that fails Hill's condition up to its strain in `reach`, the least strain that fails."""
    failing = {}
    for mode, most in reach.items():
        strain = np.linspace(0.0, most, _STEPS + 1)
        along = np.log1p(strain)
        tangent = log_tangent(law, constants, along * MODES[mode][0], along * MODES[mode][1])
        least = np.linalg.eigvalsh(tangent)[:, 0]
        bad = np.flatnonzero(least <= 0.0)
        if bad.size:
            failing[mode] = float(strain[bad[0]])
    return failing


def log_tangent(law: Law, constants: Mapping[str, float], e1: np.ndarray, e2: np.ndarray) -> np.ndarray:
    """Return the second derivatives of W (Pa) by the logarithmic strains e1, e2 (n,), volume kept: (n, 2, 2)."""
    strains = np.stack([e1, e2, -e1 - e2])
    to_three = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]])  # d(e1, e2, e3) / d(e1, e2)

    def first(per_axis: np.ndarray) -> np.ndarray:
        return np.einsum("in,ia->na", per_axis, to_three)

    def second(per_axis: np.ndarray) -> np.ndarray:
        return np.einsum("in,ia,ib->nab", per_axis, to_three, to_three)

    if law == "Ogden":
        return second(2.0 * constants["mu"] * np.exp(constants["alpha"] * strains))
    squares = np.exp(2.0 * strains)
    over = squares.sum(axis=0) - 3.0
    slope = sum(k * constants.get(f"c{k}0", 0.0) * over ** (k - 1) for k in (1, 2, 3))
    bend = sum(k * (k - 1) * constants.get(f"c{k}0", 0.0) * over ** max(k - 2, 0) for k in (2, 3))
    gradient = first(2.0 * squares)
    tangent = np.multiply(slope, second(4.0 * squares).T).T
    tangent = tangent + np.multiply(bend, np.einsum("na,nb->nab", gradient, gradient).T).T
    return tangent + constants.get("c01", 0.0) * second(4.0 / squares)


def _columns(law: Law, strain: np.ndarray) -> dict[str, np.ndarray]:
    """Return the nominal stress per unit of each constant."""
    stretch = 1.0 + np.asarray(strain, float)
    common = 2.0 * (stretch - stretch**-2)
    if law == "Mooney":
        return {"c10": common, "c01": common / stretch}
    over = stretch**2 + 2.0 / stretch - 3.0
    return {f"c{k}0": k * common * over ** (k - 1) for k in range(1, 4 if law == "Yeoh" else 2)}


def _fit_ogden(strain: np.ndarray, stress: np.ndarray) -> dict[str, float]:
    """Fit mu and alpha: for each alpha the best mu is known, so one number is searched.

    alpha and -alpha are different laws; both signs are searched on a grid first, since the misfit has a hill at 0.
    """
    from scipy.optimize import minimize_scalar

    def best_mu(alpha: float) -> float:
        column = nominal_stress("Ogden", {"mu": 1.0, "alpha": alpha}, strain)
        return float(column @ stress / (column @ column))

    def misfit(alpha: float) -> float:
        return float(np.sum((nominal_stress("Ogden", {"mu": best_mu(alpha), "alpha": alpha}, strain) - stress) ** 2))

    grid = np.concatenate([np.linspace(-12.0, -0.25, 48), np.linspace(0.25, 12.0, 48)])
    at = float(grid[np.argmin([misfit(alpha) for alpha in grid])])
    found: Any = minimize_scalar(misfit, bounds=(at - 0.25, at + 0.25), method="bounded", options={"xatol": 1e-10})
    alpha = float(found.x)
    return {"mu": best_mu(alpha), "alpha": alpha}

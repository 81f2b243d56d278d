"""The start of a tensile curve: where the specimen is straight, and the force that was not tared, fitted with the law.

A pull with slack is flat first: the grips move and the specimen straightens. The force's zero is in that part, or
nowhere if the record begins later. So the model is sigma0 + sigma(u), u the strain from the origin and 0 below it, or
with a rounded corner. The law sigma is linear in three constants,

    E (l - l^-2)/3 + b [(1 - l^-3) - (l - l^-2)]/3 + c (l - l^-2) (l^2 + 2/l - 3)/3,   l = 1 + u,

neo-Hooke's, with the terms of Mooney (softer as it stretches) and of Yeoh (stiffer). They are solved exactly on a grid of
origins and of corners (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 413, 1973). The grid's weights
are the likelihood with the constants integrated out, so that the secant's error has that of the origin in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from unitcad.geometry.arrays import Floats

CORNERS = (0.0, 0.004, 0.012)
"""Strains over which the corner at the origin is rounded, of which each is as likely."""
LAW_ERROR = 0.02
"""Error of the secant by a law and a corner that are not the true ones: twice the median of synthetic pulls' worst."""
REACH = 2.0
"""Strain up to which points count, over the highest strain of use."""
LEAST_REACH, MOST_REACH = 0.25, 1.0
SHAPE = 1.0
"""Standard deviation of b/E and c/E that is expected before the data are seen."""
_ORIGINS = 100
_PASSES = 4
_MOST_POINTS = 400
_GRID = 41


@dataclass(frozen=True)
class Toe:
    """The fitted start of a curve.

    `origin`: the strain at which the specimen begins to stretch. `offset`: the stress there, Pa: an untared force.
    `constants`: E, b and c of the law, Pa. `secant`: its mean secant modulus over the strain of use, Pa, and `error`
    the half-width of its logarithm (95 %).
    """

    origin: float
    offset: float
    corner: float
    secant: float
    error: float
    constants: Floats = field(compare=False)

    @property
    def youngs_modulus(self) -> float:
        """The law's modulus at no strain, Pa."""
        return float(self.constants[0])

    def stress(self, strain: Floats) -> Floats:
        """Return the fitted nominal stress (Pa) at engineering strains, both as recorded."""
        return self.offset + self.constants @ _terms(_from_origin(strain, np.array([self.origin]), self.corner)[0])


def fit_toe(strain: Floats, stress: Floats, low: float, high: float) -> Toe | None:
    """Fit the start of a curve (n,) by least squares; the secant is over the strains `low` to `high` from the origin.

    The origin is not below no strain: a pretension of 1 %, recorded as none, makes the secant 2 % less.

    None with fewer than six points there, or if the interval (95 %) of the secant has zero in it.
    """
    begin = min(0.0, float(strain[0]))
    reach = min(max(REACH * high, LEAST_REACH), MOST_REACH)
    use = np.linspace(low, high, _GRID)
    secant = (_terms(use) / use).mean(axis=1)
    origins = np.linspace(begin, max(float(strain[-1]) - high, begin + 1e-6), _ORIGINS)
    origin, sigma, modulus, found = begin, 0.0, 0.0, None
    for _ in range(_PASSES):
        kept = strain <= origin + reach
        x, y = _thinned(strain[kept], stress[kept])
        grid = origins[origins < x[-1] - 0.5 * high]
        if len(x) < 6 or not len(grid):
            return None
        found = _Grid.solved(x, y, np.tile(grid, len(CORNERS)), np.repeat(CORNERS, len(grid)), sigma, modulus)
        origin, sigma, modulus = found.best, found.sigma, float(found.constants[found.at, 1])
        if modulus <= 0.0:
            return None
        width = max(6 * found.spread, 2 * float(grid[-1] - grid[0]) / len(grid), 1e-9)
        origins = np.linspace(max(begin, origin - width), origin + width, _ORIGINS)
    assert found is not None
    values = found.constants[:, 1:] @ secant
    value = float(found.weights @ values)
    if value <= 0.0:
        return None
    variance = np.einsum("i,mij,j->m", secant, found.covariance[:, 1:, 1:], secant)
    fitted = float(np.sqrt(found.weights @ (variance + (values - value) ** 2)))
    fitted *= stdtrit(found.freedom, 0.975)
    if fitted >= value:
        return None
    step = _step(stress) / np.sqrt(12) * float(np.mean(1 / use))
    error = np.hypot(fitted / value, 2 * step / value)
    constants = found.weights @ found.constants
    corner = float(found.weights @ found.corners)
    middle = float(found.weights @ found.origins)
    return Toe(middle, float(constants[0]), corner, value, float(np.hypot(error, LAW_ERROR)), constants[1:])


@dataclass(frozen=True)
class _Grid:
    """Least squares at every origin and corner (m,): constants (m, 4) with the offset first, covariance (m, 4, 4)."""

    origins: Floats
    corners: Floats
    constants: Floats
    covariance: Floats
    weights: Floats
    sigma: float
    freedom: float
    at: int

    @property
    def best(self) -> float:
        return float(self.origins[self.at])

    @property
    def spread(self) -> float:
        """The standard deviation of the origin."""
        return float(np.sqrt(self.weights @ (self.origins - self.weights @ self.origins) ** 2))

    @classmethod
    def solved(cls, x: Floats, y: Floats, origins: Floats, corners: Floats, sigma: float, modulus: float) -> _Grid:
        """Solve all; `sigma` (Pa) and `modulus` of a solution before set the weight of the expected shape."""
        u = np.stack([_from_origin(x, np.array([a]), c)[0] for a, c in zip(origins, corners, strict=True)])
        columns = np.concatenate([np.ones((len(u), 1, len(x))), np.moveaxis(_terms(u), 0, 1)], axis=1)
        gram = columns @ np.moveaxis(columns, 1, 2)
        prior = np.zeros(4)
        if modulus:
            prior[2:] = (sigma / (SHAPE * modulus)) ** 2
        gram = gram + np.diag(prior)
        scale = np.sqrt(np.maximum(np.einsum("mii->mi", gram), 1e-300))
        both = scale[:, :, None] * scale[:, None, :]
        normal = gram / both + 1e-13 * np.eye(4)
        inverse = np.linalg.inv(normal) / both
        constants = np.einsum("mij,mj->mi", inverse, columns @ y)
        left = y - np.einsum("mi,min->mn", constants, columns)
        squares = np.einsum("mn,mn->m", left, left) + constants**2 @ prior
        at = int(np.argmin(squares))
        count = len(x)
        energy = float(left[at] @ left[at])
        alike = float(np.clip(left[at, 1:] @ left[at, :-1] / max(energy, 1e-300), 0.0, 0.98))
        independent = max(count * (1 - alike) / (1 + alike), 6.0)
        sigma = float(np.sqrt(squares[at] / max(count - 6, 1)))
        determinant = np.linalg.slogdet(normal)[1] + 2 * np.log(scale).sum(axis=1)
        least = max(float(squares[at]), 1e-300)
        logs = -0.5 * independent * np.log(np.maximum(squares, 1e-300) / least) - 0.5 * determinant
        weights = np.exp(logs - logs.max())
        return cls(
            origins, corners, constants, inverse * sigma**2 * count / independent, weights / weights.sum(), sigma,
            max(independent - 6, 2.0), at,
        )  # fmt: skip


def _terms(u: Floats) -> Floats:
    """Return the three terms of the law, each of slope 1, 0 and 0 at no strain, (3, ...)."""
    stretch = 1.0 + u
    neo_hooke = (stretch - stretch**-2) / 3.0
    mooney = (1.0 - stretch**-3) / 3.0 - neo_hooke
    return np.stack([neo_hooke, mooney, neo_hooke * (stretch**2 + 2.0 / stretch - 3.0)])


def _from_origin(strain: Floats, origin: Floats, corner: float) -> Floats:
    """Return the strains from origins, (origins, n): 0 below, with a corner that is rounded over a strain."""
    apart = strain - origin[:, None]
    return corner * np.logaddexp(0.0, apart / corner) if corner > 0 else np.maximum(apart, 0.0)


def _thinned(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the means of neighbours, if there are more points than the fit needs."""
    if len(x) <= _MOST_POINTS:
        return x, y
    edges = np.linspace(0, len(x), _MOST_POINTS + 1).astype(int)
    counts = np.diff(edges)
    return np.add.reduceat(x, edges[:-1]) / counts, np.add.reduceat(y, edges[:-1]) / counts


def _step(stress: Floats) -> float:
    """Return the step of a force cell's readings as a stress, Pa; 0 if its values do not repeat."""
    values = np.unique(stress)
    return float(np.median(np.diff(values))) if 1 < len(values) < 0.5 * len(stress) else 0.0

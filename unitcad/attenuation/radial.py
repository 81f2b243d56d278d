"""The skin's motion around one unit as a table over the radius, exact enough to superpose on a map.

Chebyshev series on panels. The motion under a uniform traction has a logarithmic slope at the disc's edge, so panels
there become three times smaller at each step towards it. Elsewhere a panel is a part of the shortest shear wave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from unitcad.attenuation.curve import case
from unitcad.attenuation.inputs import EstimateInput
from unitcad.errors import Refusal

TERMS = 13
"""Terms of a panel's series."""
_RATIO, _FINEST = 3.0, 1e-5
"""Between neighbouring panels at the disc's edge, and the last one's width over the disc's radius."""
_TURN = 4.8
"""Phase of the shortest shear wave over a panel, rad: 13 terms leave 1e-8 of it."""
_MOST_PANELS = 160
"""Some seconds of the solver."""
_RTOL, WANTED = 2e-7, 1e-6
_PROBES = 40


@dataclass(frozen=True, eq=False)
class RadialTable:
    """u_r, u_theta and u_z (complex) around a unit, over |u| at its edge, in the convention of `curve.motion`.

    Attributes
    ----------
    ends : float array, shape (panels + 1,)
        Ends of the panels, m, from 0 on.
    terms : complex array, shape (3, panels, TERMS)
        Coefficients of the Chebyshev polynomials on each panel.
    error : float
        Largest difference from the solver at points between, and the solver's own bound, over the largest component.
    """

    ends: np.ndarray
    terms: np.ndarray
    error: float

    @property
    def reach(self) -> float:
        """The last radius of the table, m."""
        return float(self.ends[-1])

    def at(self, radii: np.ndarray) -> np.ndarray:
        """Return the components at radii (m, any shape) up to the table's reach, shape (3, *radii.shape)."""
        flat = np.asarray(radii, dtype=float).ravel()
        panel = np.clip(np.searchsorted(self.ends, flat, side="right") - 1, 0, len(self.ends) - 2)
        first, last = self.ends[panel], self.ends[panel + 1]
        x = (2.0 * flat - first - last) / (last - first)
        terms = self.terms[:, panel]
        one, two = np.zeros((2, 3, flat.size), dtype=complex)
        for k in range(TERMS - 1, 0, -1):  # Clenshaw
            one, two = terms[..., k] + 2.0 * x * one - two, one
        return (terms[..., 0] + x * one - two).reshape(3, *np.shape(radii))

    def size(self, radii: np.ndarray) -> np.ndarray:
        """Return |u| over that at the unit's edge, at radii (m)."""
        return np.linalg.norm(self.at(radii), axis=0)

    def last_above(self, share: float, factor: Callable[[np.ndarray], Any] = lambda r: 1.0) -> float:
        """Return the largest radius (m) at which |u| over that at the edge, times a factor, is at least a share.

        0 if it is so nowhere, infinity if it still is in the last tenth of the table: a later crest may be.
        """
        radii = np.concatenate([np.linspace(a, b, 9)[:-1] for a, b in pairwise(self.ends)] + [self.ends[-1:]])
        above = np.flatnonzero(self.size(radii) * factor(radii) >= share)
        if not above.size:
            return 0.0
        if radii[above[-1]] >= 0.9 * self.reach:
            return float("inf")
        low, high = radii[above[-1]], radii[above[-1] + 1]
        for _ in range(50):
            middle = np.array([(low + high) / 2.0])
            within = (self.size(middle) * factor(middle))[0] >= share
            low, high = (middle[0], high) if within else (low, middle[0])
        return float(low)


@lru_cache(maxsize=16)
def radial_table(variant: EstimateInput, reach: float) -> RadialTable:
    """Return the table of a unit's motion up to a radius of at least `reach` (m), by its own drive and frequency.

    Raises `Refusal` for values that no tissue has, and for waves too short for the reach.
    """
    medium, load, omega = case(variant, variant.drive, {})
    slowest = min(np.sqrt(layer.shear_modulus.middle / layer.density) for layer in variant.tissue)
    width = _TURN * slowest / omega
    ends = panel_ends(load.radius, reach, width)
    if len(ends) > _MOST_PANELS:
        nearest = float(f"{0.85 * variant.frequency.middle * _MOST_PANELS / len(ends):.2g}")
        raise Refusal(
            "estimate.frequency_hz", variant.frequency.middle, "its waves are too short for a map of this size", nearest
        )
    first, last = ends[:-1, None], ends[1:, None]
    angle = np.pi * (np.arange(TERMS) + 0.5) / TERMS
    radii = (first + last) / 2.0 + (last - first) / 2.0 * np.cos(angle)
    between = ends[-1] * ((np.arange(_PROBES) + 0.5) * 0.6180339887498949 % 1.0)
    wanted = np.concatenate([radii.ravel(), between, [variant.diameter / 2.0]])
    found = medium.response(load, omega, wanted, rtol=_RTOL)
    u = np.stack([np.broadcast_to(part, wanted.shape) for part in (found.u_r, found.u_theta, found.u_z)])
    edge = np.linalg.norm(u[:, -1])
    basis = np.cos(np.outer(np.arange(TERMS), angle)) * 2.0 / TERMS
    basis[0] /= 2.0
    terms = (u[:, : radii.size] / edge).reshape(3, *radii.shape) @ basis.T
    table = RadialTable(ends, terms, 0.0)
    off = np.max(np.abs(table.at(between) - u[:, radii.size : -1] / edge)) * edge
    return RadialTable(ends, terms, float((off + found.error) / found.largest))


def panel_ends(disc: float, reach: float, width: float) -> np.ndarray:
    """Return the ends of the panels from 0 to the reach or just beyond, at most `width` long."""
    steps = disc * _RATIO ** -np.arange(1.0, np.ceil(np.log(1.0 / _FINEST) / np.log(_RATIO)) + 1.0)
    corners = np.concatenate([[0.0], disc - steps, [disc], disc + steps[::-1]])
    far = [float(corners[-1])]
    while far[-1] < reach:
        far.append(far[-1] + min(width, (_RATIO - 1.0) * (far[-1] - disc)))
    corners = np.concatenate([corners[:-1], far])
    parts = [np.linspace(a, b, max(int(np.ceil((b - a) / width - 1e-9)), 1) + 1)[:-1] for a, b in pairwise(corners)]
    return np.concatenate([*parts, corners[-1:]])

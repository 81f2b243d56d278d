"""The response at any number of radii: solved one by one where they are few, else read off one radial curve.

The curve is a cubic spline through solved points. They lie a sixth of the distance to the load's edge apart, where
the slope is steep, up to half a millimetre, and a millimetre farther out. Waves in soft tissue are 4 mm long or longer
up to 300 Hz.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.attenuation.layered.response import Response

MOST_SOLVED = 400
"""Distinct radii that are solved one by one."""
_PART, _LEAST, _NEAR, _FAR, _NEAR_TO = 1 / 6, 2e-5, 0.5e-3, 1e-3, 0.03


class Medium(Protocol):
    """What has a response: `LayeredMedium`."""

    def response(self, load: UniformDisc, omega: float, r: np.ndarray, *, rtol: float) -> Response: ...


def components(medium: Medium, load: UniformDisc, omega: float, radii: np.ndarray, rtol: float) -> np.ndarray:
    """Return u_r, u_theta and u_z (m/Pa, complex) at `radii` (m, any shape), shape (3, *radii.shape).

    The curve adds at most 5e-4 of the largest motion at the radii. Radii within the load or close to its edge are
    always solved one by one. Raises as `LayeredMedium.response`.
    """
    wanted = np.asarray(radii, dtype=float)
    distinct, at = np.unique(np.round(wanted.ravel(), 9), return_inverse=True)
    beyond = distinct > load.radius + _LEAST / _PART
    if np.count_nonzero(beyond) <= MOST_SOLVED:
        found = _solved(medium, load, omega, distinct, rtol)
    else:
        from scipy.interpolate import CubicSpline

        single = distinct[~beyond]
        points = curve_points(load.radius, float(distinct[beyond][0]), float(distinct[-1]))
        solved = _solved(medium, load, omega, np.concatenate([single, points]), rtol)
        curve = CubicSpline(points, solved[:, single.size :], axis=1)
        found = np.concatenate([solved[:, : single.size], curve(distinct[beyond])], axis=1)
    return found[:, at.ravel()].reshape(3, *wanted.shape)


def curve_points(reach: float, first: float, last: float) -> np.ndarray:
    """Return the curve's points (m) from the first radius to the last or just beyond; `reach`: the load's radius."""
    points = [first]
    while points[-1] < last or len(points) < 4:
        away = points[-1] - reach
        points.append(points[-1] + min(away * _PART, _NEAR if away < _NEAR_TO else _FAR))
    return np.array(points)


def _solved(medium: Medium, load: UniformDisc, omega: float, r: np.ndarray, rtol: float) -> np.ndarray:
    found = medium.response(load, omega, r, rtol=rtol)
    return np.stack([np.broadcast_to(part, r.shape) for part in (found.u_r, found.u_theta, found.u_z)])

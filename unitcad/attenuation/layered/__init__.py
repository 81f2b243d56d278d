"""A layered half-space under a load: its displacement, with a bound on the error.

A normal load: u_z(r) = integral of C_zz(k) q(k) J0(kr) k dk, u_r(r) that of C_rz with J1. A sideways one, in the
direction theta = 0, with C_sh of horizontally polarised shear (Cerruti's problem on a homogeneous half-space):
u_r = cos(theta) (A - B), u_theta = -sin(theta) (A + B), u_z = -cos(theta) Z, where A is the integral of
(C_rr + C_sh) / 2 q(k) J0(kr) k dk, B that of (C_rr - C_sh) / 2 with J2, Z that of C_zr with J1.

The path is the real axis. It is where damping puts the path: each pole is on the side where it belongs. A path lifted
into the upper half plane would be smoother, but waves whose energy runs against their phase (backward waves of plates
and of layers on a stiff base) and the bending of a stiff layer on a soft one have their poles there. If a material has
no damping, poles may lie on the axis or too close to it to pass: there the path goes around each of them,
on the side on which a little loss would leave it. No loss is put into the medium for that, and nothing is extrapolated.

All layers count at every wavenumber: no bound of the waves from a lower layer is known that is both proved and cheaper
than the layer.

Many radii (`components`) are read off one radial curve. It is a cubic spline through solved points. They lie a sixth of
the distance to the load's edge apart, where the slope is steep, up to half a millimetre, and a millimetre farther out.
Waves in soft tissue are 4 mm long or longer up to 300 Hz.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unitcad.attenuation.layered.integral import Integrals, integrate, overflow
from unitcad.attenuation.layered.loads import Direction, UniformDisc
from unitcad.attenuation.layered.medium import (
    LEAST,
    MOST,
    Damping,
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LossFactor,
    Stack,
    complex_shear_modulus,
    compressibility,
    finite,
    out_of_range,
)
from unitcad.attenuation.layered.propagation import Array
from unitcad.attenuation.layered.quadrature import PHASE, Problem
from unitcad.errors import Refusal

__all__ = [
    "Damping",
    "Direction",
    "FractionalKelvinVoigt",
    "HalfSpace",
    "KelvinVoigt",
    "Layer",
    "LayeredMedium",
    "LossFactor",
    "Response",
    "UniformDisc",
    "complex_shear_modulus",
    "components",
    "compressibility",
]


_MOST_PANELS = 2_500  # up to the last pole: a few seconds
_MOST_ATTEMPTS = 3
_MOST_WAVENUMBERS = 8_000_000
"""Of one response: nothing is tried again that would take more of them, a quarter of a minute or so."""


@dataclass(frozen=True)
class Response:
    """The displacement of a medium under a load, with a bound of its error.

    Under a tangential load in the direction theta = 0, multiply u_r and u_z by cos(theta) and u_theta by sin(theta). A
    rotating force gives the same amplitudes at every theta. Under a normal load u_theta is 0.

    Attributes
    ----------
    u_r, u_theta, u_z : complex array
        Displacement, m per pascal, in the shape of r.
    error_r, error_theta, error_z : float array
        Bound of the error of each value, in the same unit and shape.
    wavenumbers : int
        Number of evaluated wavenumbers.
    rtol : float
        The wanted error over the largest |u|.
    error : float
        The largest bound.
    largest : float
        The largest |u| of a component.
    reached : bool
        Whether the largest bound is within rtol.
    shortfall : str
        The reached and the wanted error in words; empty if rtol is reached.

    Examples
    --------
    >>> from unitcad.attenuation import HalfSpace, LayeredMedium, LossFactor, UniformDisc
    >>> medium = LayeredMedium((), HalfSpace(1060.0, 20e3, 0.5, LossFactor(0.3)))
    >>> response = medium.response(UniformDisc(3.5e-3), omega=785.0, r=[0.01, 0.02])
    >>> response.u_z.shape, response.reached, response.shortfall
    ((2,), True, '')
    """

    u_r: Any
    u_theta: Any
    u_z: Any
    error_r: Any
    error_theta: Any
    error_z: Any
    wavenumbers: int
    rtol: float

    @property
    def error(self) -> float:
        """The largest of all bounds, which is compared with rtol times the largest |u|."""
        return float(max(np.max(self.error_r), np.max(self.error_theta), np.max(self.error_z)))

    @property
    def largest(self) -> float:
        """The largest |u| of a component."""
        return float(max(np.max(np.abs(u)) for u in (self.u_r, self.u_theta, self.u_z)))

    @property
    def reached(self) -> bool:
        """Whether the error is within rtol of the largest |u|."""
        return self.error <= self.rtol * self.largest

    @property
    def shortfall(self) -> str:
        """The reached and the wanted error in words; empty if rtol is reached."""
        if self.reached:
            return ""
        share = f"{self.error / self.largest:.2g} of the largest motion" if self.largest else "more than the motion"
        return f"the error may be {share}, {self.rtol:.2g} was wanted"


def _of_rows(load: UniformDisc, rows: Array, errors: np.ndarray, wavenumbers: int, rtol: float) -> Response:
    """Return the response of which these are the integrals, shape (rows, ...)."""
    if load.direction == "tangential":
        (a, b, c), (of_a, of_b, of_c) = rows, errors
        u, error = (a - b, -(a + b), -c), (of_a + of_b, of_a + of_b, of_c)
    else:
        zero = np.zeros(rows.shape[1:])
        u, error = (rows[0], zero + 0j, rows[1]), (errors[0], zero, errors[1])
    return Response(*(part[()] for part in u), *(part[()] for part in error), wavenumbers=wavenumbers, rtol=rtol)


def _radii(r: Any) -> Array:
    """Return radii as an array. Raises `Refusal` with the first that can't be."""
    if np.iscomplexobj(r):
        raise Refusal("r", str(r), "must be radii: real numbers")
    try:
        radii = np.asarray(r, dtype=float)
    except (TypeError, ValueError):
        raise Refusal("r", str(r), "must be radii: a number or an array of numbers") from None
    if radii.size == 0:
        raise Refusal("r", None, "needs a radius")
    good = ((radii >= LEAST) & (radii <= MOST)) | (radii == 0)
    if not good.all():
        wrong = float(radii[~good][0])
        if not (np.isfinite(wrong) and wrong >= 0):
            raise Refusal("r", wrong, "radii must be finite and not negative", 0.0)
        raise out_of_range("r", wrong)
    return radii


def _solve(bare: Problem, end: float, rtol: float) -> Integrals:
    """Return the integrals that a few attempts reach, and the wavenumbers of all of them.

    The first integrals may have been accepted relative to a largest |u| that the rest then reduced: they are repeated
    relative to the final one. If the panels do not suffice for rtol, a larger one may spend them better. The last
    attempt counts: of 2,250 random responses 19 took several, whose last bound was at most 1.05 times the best one.
    """
    size, wavenumbers = np.inf, 0
    for _ in range(_MOST_ATTEMPTS):
        found = integrate(bare, end, rtol, size)
        wavenumbers += found.wavenumbers
        before, size = size, float(np.abs(found.total).max()) or 1.0
        reached = float(found.error.max()) / size
        if reached <= rtol or found.cut_short or wavenumbers + found.wavenumbers > _MOST_WAVENUMBERS:
            break
        if found.exhausted:
            rtol = float(np.sqrt(rtol * min(reached, 0.1)))
        elif before <= 2.0 * size:
            break
    return replace(found, wavenumbers=wavenumbers)


class LayeredMedium(Stack):
    """Layers, top first, on a half-space.

    Parameters
    ----------
    layers : sequence of Layer
        The layers from the surface down; may be empty.
    half_space : HalfSpace
        The half-space under them.
    least_loss : float, default 0
        Least loss factor of all materials; the solver sets it for undamped media.

    Raises
    ------
    Refusal
        For a layer or a half-space of another type.

    Examples
    --------
    >>> from unitcad.attenuation import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
    >>> skin = Layer(thickness=1.5e-3, density=1100, youngs_modulus=130e3, poisson_ratio=0.49, damping=LossFactor(0.14))
    >>> medium = LayeredMedium([skin], HalfSpace(density=1050, youngs_modulus=12e3, poisson_ratio=0.495))
    >>> response = medium.response(UniformDisc(3.5e-3), omega=785.0, r=[7e-3, 20e-3], rtol=1e-6)
    >>> response.u_z.shape
    (2,)
    >>> bool(response.error < 1e-6 * abs(response.u_z).max())
    True
    """

    def response(self, load: UniformDisc, omega: float, r: Any, rtol: float = 1e-6) -> Response:
        """Return the displacement of the surface at some radii under a load.

        Parameters
        ----------
        load : UniformDisc
            A pressure, or a traction sideways, of one pascal on a disc.
        omega : float
            Angular frequency, rad/s.
        r : float or array
            Radii, m, in any shape.
        rtol : float, default 1e-6
            Wanted error over the largest |u| of all radii, 1e-12 to 0.1. If it can't be reached, the result says so:
            `reached` is false, and `shortfall` has the reason.

        Returns
        -------
        Response
            Complex displacement in the shape of r, with bounds of the error.

        Raises
        ------
        Refusal
            For an invalid value.
        UnitcadError
            If no finite answer was found.

        Examples
        --------
        >>> from unitcad.attenuation import HalfSpace, LayeredMedium, UniformDisc
        >>> medium = LayeredMedium([], HalfSpace(1000.0, 3e3, 0.5))
        >>> static = medium.response(UniformDisc(5e-3), omega=0.0, r=0.0)
        >>> bool(abs(static.u_z - 5e-3 / (2 * 1e3)) < 1e-18)  # a / (2 mu), Boussinesq
        True
        """
        if not isinstance(load, UniformDisc):
            raise Refusal("load", str(load), "must be a UniformDisc")
        radii, rtol = _radii(r), finite("rtol", rtol, above=True)
        if not 1e-12 <= rtol <= 0.1:
            raise Refusal("rtol", rtol, "must be from 1e-12 to 0.1", min(max(rtol, 1e-12), 0.1))
        # A layer of no thickness changes nothing, so its waves must not set the path.
        medium, flat = self.without_empty_layers(), radii.ravel()
        end = medium.last_pole(omega)
        span = float(flat.max()) + load.radius
        panels = end * span / PHASE
        if panels > _MOST_PANELS:  # before anything is allocated
            limit = f"its waves are too short for {span:g} m: {panels:.2g} panels, the most is {_MOST_PANELS}"
            raise Refusal("omega", omega, limit, float(f"{0.9 * omega * _MOST_PANELS / panels:.2g}"))
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # what is no number is refused below
            # Each component is made of at most two rows, and one of them is at least as large as each row.
            sideways = load.direction == "tangential"
            found = _solve(Problem(medium, omega, load, flat), end, rtol / 2.0 if sideways else rtol)
        if not (np.isfinite(found.total).all() and np.isfinite(found.error).all()):
            raise overflow(omega)
        total, error = (part.reshape(-1, *radii.shape) for part in (found.total, found.error))
        return _of_rows(load, total, error, found.wavenumbers, rtol)


MOST_SOLVED = 400
_PART, _LEAST, _NEAR, _FAR, _NEAR_TO = 1 / 6, 2e-5, 0.5e-3, 1e-3, 0.03


Told = Callable[[str], object]
"""Gets the shortfall of a response that does not reach its rtol."""


def unheard(shortfall: str) -> None:
    """Take no notice of a shortfall."""


def components(
    medium: LayeredMedium, load: UniformDisc, omega: float, radii: np.ndarray, rtol: float, short: Told = unheard
) -> np.ndarray:
    """Return u_r, u_theta and u_z (m/Pa, complex) at `radii` (m, any shape), shape (3, *radii.shape).

    The curve adds at most 5e-4 of the largest motion at the radii. Radii within the load or close to its edge are
    always solved one by one. `short` gets the shortfall of a response that misses rtol. Raises as
    `LayeredMedium.response`.
    """
    wanted = np.asarray(radii, dtype=float)
    distinct, at = np.unique(np.round(wanted.ravel(), 9), return_inverse=True)
    beyond = distinct > load.radius + _LEAST / _PART
    if np.count_nonzero(beyond) <= MOST_SOLVED:
        found = _solved(medium, load, omega, distinct, rtol, short)
    else:
        from scipy.interpolate import CubicSpline  # slow to load, and few need it

        single = distinct[~beyond]
        points = curve_points(load.radius, float(distinct[beyond][0]), float(distinct[-1]))
        solved = _solved(medium, load, omega, np.concatenate([single, points]), rtol, short)
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


def _solved(
    medium: LayeredMedium, load: UniformDisc, omega: float, r: np.ndarray, rtol: float, short: Told
) -> np.ndarray:
    found = medium.response(load, omega, r, rtol=rtol)
    if not found.reached:
        short(found.shortfall)
    return np.stack([np.broadcast_to(part, r.shape) for part in (found.u_r, found.u_theta, found.u_z)])

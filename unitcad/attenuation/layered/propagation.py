"""Propagation of a stack's state through one layer, upwards, at many wavenumbers.

A state is (u_r, u_z, t_r, t_z). A plane is a (4, 2, n) block of them, (U, T): all states u = U c, t = T c that the
stack below can carry. By reciprocity any two of them have u . t' = t . u', so the plane's own equation is
T^T u = U^T t.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.series import THIN, exponential


class Plane(NamedTuple):
    """States at an interface per parameter c, shape (4, 2, n).

    bottom: if asked, those at the layer's bottom per the same c; summed: whether some are as the series left them, not
    `charted`.
    """

    states: w.Array
    bottom: w.Array | None = None
    summed: bool = False

    @property
    def u(self) -> w.Array:
        return self.states[:2]

    @property
    def t(self) -> w.Array:
        return self.states[2:]


def underside(material: w.Material, k: w.Array) -> Plane:
    """Return the plane at the top of a half-space (or of nothing, if its modulus is 0)."""
    if material.shear == 0:
        free = np.zeros((4, 2, k.size), dtype=np.complex128)
        free[0, 0] = free[1, 1] = 1.0
        return Plane(free)
    return Plane(w.waves(material, k, *w.rates(material, k)).down)


def raised(material: w.Material, h: float, k: w.Array, below: Plane, with_bottom: bool = False) -> Plane:
    """Return the plane at a layer's top from the plane at its bottom, each wavenumber by the method that suits it."""
    below = Plane(below.states, below.states if with_bottom else None, below.summed)
    if h == 0.0:
        return below
    rates = w.rates(material, k)
    by_series = merging(material, h, k, rates)
    parts = [(_thick, np.flatnonzero(~by_series)), (_series, np.flatnonzero(by_series))]
    for method, part in parts:
        if part.size == k.size:
            return method(material, h, k, rates, below)
    states = np.empty_like(below.states)
    bottom = np.empty_like(states) if with_bottom else None
    for method, part in parts:
        here = below.states[..., part]
        plane = Plane(here, here if with_bottom else None, below.summed)
        top = method(material, h, k[part], (rates[0][part], rates[1][part]), plane)
        states[..., part] = top.states
        if bottom is not None:
            bottom[..., part] = top.bottom
    return Plane(states, bottom, summed=True)


def merging(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array]) -> np.ndarray:
    """Return at which wavenumbers the waves down and up are alike, so that reflection would lose digits.

    The layer is thin for both waves, or one of them hardly changes over it: next to its branch point, or k h small
    where k_s h is not.
    """
    thin = np.maximum(np.abs(k), abs(material.ks2) ** 0.5) * h < THIN
    return thin | (np.minimum(np.abs(rates[0]), np.abs(rates[1])) * h < THIN)


def _series(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array], below: Plane) -> Plane:
    """Propagate by the series, in pieces across which nothing grows by more than e.

    One piece leaves a plane as well conditioned as it was, or nearly so: it is charted before the next one.
    """
    pieces = max(1, int(np.ceil(max(float(np.max(rate.real)) for rate in rates) * h)))
    layer = exponential(material, k, h / pieces)
    for _ in range(pieces):
        if below.summed:
            below = charted(below)
        below = Plane(layer.raised(below.states), below.bottom, summed=True)
    return below


def _thick(material: w.Material, h: float, k: w.Array, rates: tuple[w.Array, w.Array], below: Plane) -> Plane:
    """Propagate by reflection.

    The amplitudes are a down at the top and R E a up at the bottom, with R from the plane's own equation.
    """
    waves = w.waves(material, k, *rates)
    terms = below.states[[2, 3, 0, 1], :, None] * waves.down[:, None]
    # The waves up are those down but for signs, so both sides have the same terms.
    of_r, of_z = terms[::2], terms[1::2]
    less, more = of_r - of_z, of_r + of_z
    system, given = less[0] + less[1], more[1] - more[0]
    e = w.decay(material, waves, h)
    reflected = w.product(w.adjugate(system), w.product(given, e)) / w.determinant(system)
    bottom = None
    if below.bottom is not None:
        bottom = w.product(waves.down, e) + w.UPWARDS * w.product(waves.down, reflected)
    return Plane(waves.down + w.UPWARDS * w.product(waves.down, w.product(e, reflected)), bottom)


def charted(raw: Plane) -> Plane:
    """Return the same plane with u or t the identity, whichever inverse is better conditioned."""
    det_u, det_t = w.determinant(raw.u), w.determinant(raw.t)
    square_u, square_t = _squares(raw)
    by_u = square_u * np.abs(det_t) <= square_t * np.abs(det_u)
    inverse = w.adjugate(np.where(by_u, raw.u, raw.t)) / np.where(by_u, det_u, det_t)
    ratio = w.product(np.where(by_u, raw.t, raw.u), inverse)
    states = np.empty_like(raw.states)
    one = np.eye(2)[..., None]
    states[:2], states[2:] = np.where(by_u, one, ratio), np.where(by_u, ratio, one)
    return Plane(states, None if raw.bottom is None else w.product(raw.bottom, inverse))


def parameter(plane: Plane, u: w.Array, t: w.Array, stiffness: w.Array) -> w.Array:
    """Return the c, shape (2, m, n), of a state (u, t) that lies on a plane and comes from a layer above it.

    stiffness: traction over displacement of that layer's waves (Pa/m), which is how their rounding compares. On
    something stiffer u is what is left of waves that cancel, on something softer t is: each would lose the contrast.
    """
    det_u, det_t = w.determinant(plane.u), w.determinant(plane.t)
    with np.errstate(divide="ignore", invalid="ignore"):  # of the one that is singular, which is not taken
        norm_u, norm_t = np.sqrt(_squares(plane))
        by_t = norm_t * np.abs(det_u) * stiffness < norm_u * np.abs(det_t)
    block, det = np.where(by_t, plane.t, plane.u), np.where(by_t, det_t, det_u)
    return w.product(w.adjugate(block), np.where(by_t, t, u)) / det


def _squares(plane: Plane) -> np.ndarray:
    """Return the squared Frobenius norms of U and of T, shape (2, n)."""
    return np.square(np.abs(plane.states)).reshape(2, 4, -1).sum(axis=1)

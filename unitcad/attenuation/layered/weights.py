"""Gauss's rule over panels, times all that a kernel meets there: the load's transform and the Bessel functions.

Nothing of it is the medium's: it is kept for the next medium, frequency or tolerance whose path has the same panels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bounds, bessels
from unitcad.attenuation.layered.kept import kept
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.path import wavenumbers

NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
COUNT = NODES.size
TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(NODES, COUNT - 1))
_DEGREES = np.arange(2 * COUNT, COUNT, -1)
_ODD_FACTORIALS = np.array([float(factorial2(2 * m - 1)) for m in _DEGREES])


class Pieces(NamedTuple):
    """How panels are cut where the waves turn faster over them than may be.

    Of each panel, shape (panels,): closeness, its wavenumber over half of what it covers; off_axis, whether it leaves
    the real axis; count, its pieces. Of each piece: of (pieces,), its panel; panels (pieces, 4), the piece itself.
    """

    closeness: np.ndarray
    off_axis: np.ndarray
    count: np.ndarray
    of: np.ndarray
    panels: w.Array


class Weights(NamedTuple):
    """What the kernel at each node is multiplied by, a row an order, shape (orders, panels, nodes, radii).

    sizes: their absolute values; covered (orders, panels, radii): the sums of these; swing (panels, degrees) and most
    (orders, panels, radii): a bound of the rule's error is the sum of the kernel's coefficients times `swing`, times
    `most`.
    """

    values: w.Array
    sizes: np.ndarray
    covered: np.ndarray
    swing: np.ndarray
    most: np.ndarray


def nodes(panels: w.Array) -> tuple[w.Array, w.Array]:
    """Return the wavenumbers (1/m) at which a panel's kernel is sampled and their slopes, shape (panels, nodes)."""
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    return wavenumbers(panels, (panels[:, 0] + half)[:, None] + half[:, None] * NODES)


def closeness(panels: w.Array) -> np.ndarray:
    """Return the wavenumber over half of what a panel covers of it, shape (panels,)."""
    ends = wavenumbers(panels, panels[:, :2])[0]
    return np.abs(ends).max(axis=1) / (np.abs(ends[:, 1] - ends[:, 0]) / 2.0)


def _span(load: Load, r: np.ndarray) -> float:
    return float(r.max()) + load.reach


@kept
def pieces(load: Load, r: np.ndarray, panels: w.Array, phase: float) -> Pieces:
    """Cut panels into equal pieces over which the waves at radii r (m), shape (n,), turn by no more than `phase`."""
    slope = wavenumbers(panels, panels[:, :2])[1]
    turn = np.abs(panels[:, 1] - panels[:, 0]) * np.abs(slope).max(axis=1) * _span(load, r)
    count = np.maximum(np.ceil(turn / phase), 1.0).astype(int)
    of = np.repeat(np.arange(len(panels)), count)
    cut = panels[of]
    place = np.arange(len(of)) - (np.cumsum(count) - count)[of]
    for side in (0, 1):
        share = (place + side) / count[of]
        cut[:, side] = panels[of, 0] * (1.0 - share) + panels[of, 1] * share
    return Pieces(closeness(panels), np.any(panels[:, :2].imag, axis=1), count, of, cut)


@kept
def weights(load: Load, orders: tuple[int, ...], r: np.ndarray, panels: w.Array) -> Weights:
    """Return the weights of panels that are all on the axis, or all off it.

    The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `load.weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within
    six halves: there their envelope takes the place of the weight. Off the axis both grow by e^{|Im k| span}.
    """
    span = _span(load, r)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    k = nodes(panels)[0]
    if not np.any(panels[:, :2].imag):
        k, half = k.real, half.real  # Bessel functions of real numbers are cheaper
    scale = load.transform(k) * (half[:, None] * _WEIGHTS)
    values = bessels(orders, k[..., None] * r) * scale[..., None]
    sizes = np.abs(values)
    ends, slope = wavenumbers(panels, panels[:, :2])
    half = np.abs(half)
    phi = half * np.abs(slope).max(axis=1) * span
    swing = phi[:, None] ** _DEGREES / _ODD_FACTORIALS
    swing = swing * (3.0 * half * np.exp(np.abs(ends.imag).max(axis=1) * span))[:, None]
    least, covers = ends.real.min(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2.0
    at = np.maximum(least, covers) / 2.0
    envelope = np.where(least > 6.0 * covers, 2.0 * load.envelope(at), np.inf)[:, None]
    most = np.minimum(envelope * bessel_bounds(orders, at[:, None] * r), load.weight)
    return Weights(values, sizes, sizes.sum(axis=-2), swing, most)

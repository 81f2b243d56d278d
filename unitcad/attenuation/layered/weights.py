"""Gauss's rule over panels, times all that a kernel meets there: the load's transform and the Bessel functions.

Nothing of it is the medium's: it is kept for the next medium, frequency or tolerance whose path has the same panels.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bounds, bessels
from unitcad.attenuation.layered.kept import kept
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.path import wavenumbers


class Rule(NamedTuple):
    """Gauss's rule of n nodes from -1 to 1.

    to_legendre (n, n): from values at the nodes to coefficients of degrees 0 to n - 1; degrees (n,): of the waves, the
    least that meets an error of the rule beside each coefficient; odd_factorials: (2m - 1)!! of these.
    """

    nodes: np.ndarray
    weights: np.ndarray
    to_legendre: np.ndarray
    degrees: np.ndarray
    odd_factorials: np.ndarray


@cache
def rule(count: int) -> Rule:
    """Return the rule of `count` nodes."""
    at, weighing = np.polynomial.legendre.leggauss(count)
    to_legendre = np.linalg.inv(np.polynomial.legendre.legvander(at, count - 1))
    degrees = np.arange(2 * count, count, -1)
    return Rule(at, weighing, to_legendre, degrees, np.array([float(factorial2(2 * m - 1)) for m in degrees]))


class Turns(NamedTuple):
    """How panels lie to the waves, shape (panels,).

    closeness: the wavenumber over half of what a panel covers of it; off_axis: whether it leaves the real axis; pieces:
    into how many it has to be cut, that the waves turn little enough over each; level: whether none leaves the axis;
    total: pieces of all.
    """

    closeness: np.ndarray
    off_axis: np.ndarray
    pieces: np.ndarray
    level: bool
    total: int


class Weights(NamedTuple):
    """What the kernel at each node is multiplied by, a row an order, shape (orders, panels, nodes, radii).

    values: of each panel's nodes, or of those of each piece; covered (orders, panels, radii): the integral of the
    absolute waves; swing (panels, degrees) and most (orders, panels, radii): a bound of the rule's error is the sum of
    the kernel's coefficients times `swing`, times `most`.
    """

    values: w.Array
    covered: np.ndarray
    swing: np.ndarray
    most: np.ndarray


def nodes(panels: w.Array, count: int) -> tuple[w.Array, w.Array]:
    """Return the wavenumbers (1/m) at which a panel's kernel is sampled and their slopes, shape (panels, count)."""
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    return wavenumbers(panels, (panels[:, 0] + half)[:, None] + half[:, None] * rule(count).nodes)


def closeness(panels: w.Array) -> np.ndarray:
    """Return the wavenumber over half of what a panel covers of it, shape (panels,)."""
    ends = wavenumbers(panels, panels[:, :2])[0]
    return np.abs(ends).max(axis=1) / (np.abs(ends[:, 1] - ends[:, 0]) / 2.0)


def _span(load: Load, r: np.ndarray) -> float:
    return float(r.max()) + load.reach


@kept
def turns(load: Load, r: np.ndarray, panels: w.Array, phase: float) -> Turns:
    """Return how panels lie to the waves at radii r (m), shape (n,), which may turn by `phase` over a piece."""
    slope = wavenumbers(panels, panels[:, :2])[1]
    turn = np.abs(panels[:, 1] - panels[:, 0]) * np.abs(slope).max(axis=1) * _span(load, r)
    pieces = np.maximum(np.ceil(turn / phase), 1.0).astype(int)
    off_axis = np.any(panels[:, :2].imag, axis=1)
    return Turns(closeness(panels), off_axis, pieces, not off_axis.any(), int(pieces.sum()))


@kept
def weights(
    load: Load,
    orders: tuple[int, ...],
    r: np.ndarray,
    panels: w.Array,
    pieces: np.ndarray,
    count: int,
    folded: bool,
) -> Weights:
    """Return the weights of panels of `count` nodes, all on the axis or all off it, each cut into so many `pieces`.

    At the nodes of a piece the kernel is what its panel's Legendre series says. folded: whether the weights are summed
    to those of the panel's nodes, which pays where they are kept.
    """
    if pieces.sum() == len(panels):
        return _of_pieces(load, orders, r, panels, count)
    first = np.cumsum(pieces) - pieces
    of = np.repeat(np.arange(len(panels)), pieces)
    place = np.arange(len(of)) - first[of]
    cut = panels[of]
    for side in (0, 1):
        share = (place + side) / pieces[of]
        cut[:, side] = panels[of, 0] * (1.0 - share) + panels[of, 1] * share
    found = _of_pieces(load, orders, r, cut, count)
    values = np.empty((len(orders), len(panels), count, r.size)) if folded else found.values
    swing = np.empty((len(panels), count))
    for number in np.unique(pieces):
        at, here = pieces == number, pieces[of] == number
        onto, restricted = spread(int(number), count)
        if folded:
            values[:, at] = onto @ found.values[:, here].reshape(len(orders), -1, number * count, r.size)
        by_piece = found.swing[here].reshape(-1, number, 1, count)
        swing[at] = (by_piece @ restricted).max(axis=1)[:, 0]
    covered, most = (np.add.reduceat(one, first, axis=1) for one in (found.covered, found.most))
    return Weights(values, covered, swing, most)


@lru_cache(maxsize=128)
def spread(number: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what leads from a panel of `count` nodes to its equal pieces.

    The matrix from the nodes' values (one more row) to those at the nodes of the pieces, and of each piece one that
    bounds the coefficients of the kernel there by those of the panel, shape (pieces, count, count).
    """
    middles = (2.0 * np.arange(number) + 1.0) / number - 1.0
    at = (middles[:, None] + rule(count).nodes / number).ravel()
    degrees = np.polynomial.legendre.legvander(at, count - 1)
    to_legendre = rule(count).to_legendre
    return (degrees @ to_legendre).T, np.abs(to_legendre @ degrees.reshape(number, count, count))


def _of_pieces(load: Load, orders: tuple[int, ...], r: np.ndarray, panels: w.Array, count: int) -> Weights:
    """Return the weights of panels over which the waves turn little.

    The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `load.weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within
    six halves: there their envelope takes the place of the weight. Off the axis both grow by e^{|Im k| span}.
    """
    span = _span(load, r)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    gauss = rule(count)
    k = nodes(panels, count)[0]
    if not np.any(panels[:, :2].imag):
        k, half = k.real, half.real  # Bessel functions of real numbers are cheaper
    scale = load.transform(k) * (half[:, None] * gauss.weights)
    values = bessels(orders, k[..., None] * r) * scale[..., None]
    ends, slope = wavenumbers(panels, panels[:, :2])
    half = np.abs(half)
    phi = half * np.abs(slope).max(axis=1) * span
    swing = phi[:, None] ** gauss.degrees / gauss.odd_factorials
    swing = swing * (3.0 * half * np.exp(np.abs(ends.imag).max(axis=1) * span))[:, None]
    least, covers = ends.real.min(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2.0
    at = np.maximum(least, covers) / 2.0
    envelope = np.where(least > 6.0 * covers, 2.0 * load.envelope(at), np.inf)[:, None]
    most = np.minimum(envelope * bessel_bounds(orders, at[:, None] * r), load.weight)
    return Weights(values, np.abs(values).sum(axis=-2), swing, most)

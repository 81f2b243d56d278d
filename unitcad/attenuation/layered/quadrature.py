"""Gauss and Legendre over the panels of a Hankel integral, with a bound of the error of each.

A panel's kernel is known at 16 nodes. Where the Bessel functions swing faster than they can be seen there, the panel is
cut into pieces, and the kernel's Legendre series is read off at the nodes of each: the kernel, which costs most, is
sampled as it varies, not as the waves do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bounds, bessels
from unitcad.attenuation.layered.detours import HIDDEN, LOST, Poles, poles
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.path import wavenumbers

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_COUNT = _NODES.size
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _COUNT - 1))
_DEGREES = np.arange(2 * _COUNT, _COUNT, -1)
_ODD_FACTORIALS = np.array([float(factorial2(2 * m - 1)) for m in _DEGREES])
ROUNDING = 1e-15
"""Of a wavenumber, as the kernel feels it next to a pole."""
_CANCELLED = 4e-15
"""Of what was taken out of the kernel: what rounding leaves of the last coefficients of the difference."""
_SINGLE = 1e-7
"""Uncertainty of a pole below which a panel has no other, or one that is next to nothing beside it."""
_CHUNK = 200_000  # integrand values held at once


class Seen(Protocol):
    """Loads that have one transform, on bodies that are alike, seen at radii r (m), shape (n,)."""

    @property
    def load(self) -> Load:
        """Return one of the loads: all have its transform."""
        ...

    @property
    def orders(self) -> tuple[int, ...]:
        """Return the orders of the Bessel functions that the rows of each body's kernel meet."""
        ...

    @property
    def r(self) -> np.ndarray: ...

    @property
    def taken_out(self) -> w.Array:
        """Return what each row of the kernel is less by, shape (rows,)."""
        ...


@dataclass(frozen=True)
class Evaluated:
    """Of each panel, row and radius: the integral, a bound of its error, its absolute size, that of the waves alone.

    gains: of each panel, by how much halving it lessens the largest part of its error; kernel (with dk/ds): what was
    integrated; closeness: the wavenumber over half of what a panel covers of it. Poles are looked for when asked: where
    no panel is bad, nobody does.
    """

    parts: np.ndarray
    errors: np.ndarray
    sizes: np.ndarray
    covered: np.ndarray
    gains: np.ndarray
    kernel: w.Array
    closeness: np.ndarray

    @cached_property
    def poles(self) -> Poles:
        """The pole of each panel."""
        return poles(self.kernel, _NODES, _TO_LEGENDRE, self.closeness)

    @cached_property
    def hidden(self) -> np.ndarray:
        """What a detour around each panel's pole may leave out, shape (panels, rows, radii)."""
        return HIDDEN * self.poles.rest.T[..., None] * self.covered

    @property
    def blurred(self) -> np.ndarray:
        """Where what a detour may leave out may be rounding's alone."""
        return self.poles.uncertainty <= np.maximum(_SINGLE, 10.0 * LOST * self.closeness)


def nodes(panels: w.Array) -> tuple[w.Array, w.Array]:
    """Return the wavenumbers (1/m) at which a panel's kernel is sampled and their slopes, shape (panels, nodes)."""
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    return wavenumbers(panels, (panels[:, 0] + half)[:, None] + half[:, None] * _NODES)


def panel_poles(panels: w.Array, kernel: w.Array) -> Poles:
    """Return the pole that each panel's kernel (with dk/ds), shape (rows, panels, nodes), would have."""
    return poles(kernel, _NODES, _TO_LEGENDRE, _closeness(wavenumbers(panels, panels[:, :2])[0]))


def _closeness(ends: w.Array) -> np.ndarray:
    """Return the wavenumber over half of what a panel covers of it."""
    return np.abs(ends).max(axis=1) / (np.abs(ends[:, 1] - ends[:, 0]) / 2.0)


def evaluate(seen: Seen, panels: w.Array, kernel: w.Array, phase: float) -> Evaluated:
    """Integrate over each panel, on the axis or off it, its kernel (with dk/ds) of shape (rows, panels, nodes).

    The rows are those of the first body, of the second one, and so on.

    phase: the most that the fastest Bessel product may turn over a piece of a panel.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. Next to a pole the wavenumber's own rounding, times the kernel's slope of at most itself over the panel, is
    all that is left of the last coefficients: halving doubles it. Where the kernel is little beside what it is less by,
    their difference's rounding is left, and stays.
    """
    rest = 2.0 * np.abs(kernel @ _TO_LEGENDRE[-2:].T).sum(axis=-1).T
    ends, slope = wavenumbers(panels, panels[:, :2])
    closeness = _closeness(ends)
    rounding = (ROUNDING * closeness * np.abs(kernel).max(axis=-1)).T
    turn = np.abs(panels[:, 1] - panels[:, 0]) * np.abs(slope).max(axis=1) * _span(seen)
    pieces = np.maximum(np.ceil(turn / phase), 1.0).astype(int)
    off_axis = np.any(panels[:, :2].imag, axis=1)
    if not np.any(off_axis):
        sums = _summed(seen, panels, kernel, pieces)
    else:
        shape = (len(panels), len(kernel), seen.r.size)
        sums = np.empty(shape, dtype=np.complex128), *np.empty((3, *shape))
        for which in (np.flatnonzero(~off_axis), np.flatnonzero(off_axis)):
            if which.size:
                summed = _summed(seen, panels[which], kernel[:, which], pieces[which])
                for whole, part in zip(sums, summed, strict=True):
                    whole[which] = part
    parts, sizes, covered, swing = sums
    errors = 2.0 * np.maximum(rest, rounding)[..., None] * covered + swing
    halved = 2.0 * (2.0 * rounding + _CANCELLED * np.abs(seen.taken_out))[..., None] * covered
    gains = np.maximum(errors.max(axis=(1, 2)) - halved.max(axis=(1, 2)), 0.0)
    return Evaluated(parts, errors, sizes, covered, gains, kernel, closeness)


def _span(seen: Seen) -> float:
    return float(seen.r.max()) + seen.load.reach


def _summed(seen: Seen, panels: w.Array, kernel: w.Array, pieces: np.ndarray) -> tuple[w.Array, ...]:
    """Return of each panel, all on the axis or all off it, the sums of what `_integrated` returns of its `pieces`."""
    ends = np.cumsum(pieces)
    cut, values = (panels, kernel) if ends[-1] == len(panels) else _cut(panels, kernel, pieces)
    step = max(1, _CHUNK // (_COUNT * seen.r.size * len(kernel)))
    first, sums = 0, list[tuple[w.Array, ...]]()
    while first < len(panels):
        low = ends[first] - pieces[first]
        last = max(int(np.searchsorted(ends, low + step, side="right")), first + 1)
        some = slice(low, ends[last - 1])
        found = _integrated(seen, cut[some], values[:, some])
        if some.stop - low > last - first:
            found = tuple(np.add.reduceat(one, (ends - pieces)[first:last] - low, axis=0) for one in found)
        sums.append(found)
        first = last
    return sums[0] if len(sums) == 1 else tuple(np.concatenate(part) for part in zip(*sums, strict=True))


def _cut(panels: w.Array, kernel: w.Array, pieces: np.ndarray) -> tuple[w.Array, w.Array]:
    """Cut each panel into equal pieces; return them, and the kernel at their nodes, shape (rows, pieces, nodes)."""
    of = np.repeat(np.arange(len(panels)), pieces)
    cut, values, count = panels[of], kernel[:, of], pieces[of]
    place = np.arange(len(of)) - (np.cumsum(pieces) - pieces)[of]
    for side in (0, 1):
        share = (place + side) / count
        cut[:, side] = panels[of, 0] * (1.0 - share) + panels[of, 1] * share
    for number in np.unique(pieces[pieces > 1]):
        re, im = np.moveaxis(_pair(kernel[:, pieces == number]) @ _spread(int(number)), -2, 0)  # as `products` does
        values[:, count == number] = (re + 1j * im).reshape(len(kernel), -1, _COUNT)
    return cut, values


@lru_cache(maxsize=64)
def _spread(count: int) -> np.ndarray:
    """Return the matrix from values at a panel's nodes to those at the nodes of its equal pieces."""
    middles = (2.0 * np.arange(count) + 1.0) / count - 1.0
    at = (middles[:, None] + _NODES / count).ravel()
    return (np.polynomial.legendre.legvander(at, _COUNT - 1) @ _TO_LEGENDRE).T


def _integrated(seen: Seen, panels: w.Array, kernel: w.Array) -> tuple[w.Array, np.ndarray, np.ndarray, np.ndarray]:
    """Return of each panel, row and radius the integral, its absolute size, that of the waves alone, the rule's error.

    The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within
    six halves: there their envelope takes the place of the weight. Off the axis both grow by e^{|Im k| span}.
    """
    load, r, span = seen.load, seen.r, _span(seen)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    k = nodes(panels)[0]
    if not np.any(panels[:, :2].imag):
        k, half = k.real, half.real  # Bessel functions of real numbers are cheaper
    scale = load.transform(k) * (half[:, None] * _WEIGHTS)
    waves = bessels(seen.orders, k[..., None] * r) * scale[..., None]
    by_body = kernel.reshape(-1, *waves.shape[:3])
    of_waves = np.abs(waves)
    sizes = (np.abs(by_body)[..., None, :] @ of_waves)[..., 0, :]
    covered = np.broadcast_to(of_waves.sum(axis=-2), sizes.shape)
    ends, slope = wavenumbers(panels, panels[:, :2])
    half = np.abs(half)
    phi = half * np.abs(slope).max(axis=1) * span
    powers = phi[:, None] ** _DEGREES / _ODD_FACTORIALS
    swing = (np.abs(by_body @ _TO_LEGENDRE.T) * powers).sum(axis=-1)
    swing *= 3.0 * half * np.exp(np.abs(ends.imag).max(axis=1) * span)
    least, covers = ends.real.min(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2.0
    at = np.maximum(least, covers) / 2.0
    envelope = np.where(least > 6.0 * covers, 2.0 * load.envelope(at), np.inf)[:, None]
    weight = np.minimum(envelope * bessel_bounds(seen.orders, at[:, None] * r), load.weight)
    quantities = products(by_body, waves), sizes, covered, swing[..., None] * weight
    parts, sizes, covered, oscillation = (
        one.reshape(len(kernel), len(panels), -1).swapaxes(0, 1) for one in quantities
    )
    return parts, sizes, covered, oscillation


def products(kernel: w.Array, waves: w.Array) -> w.Array:
    """Sum kernel (.., rows, panels, nodes) times waves (rows, panels, nodes, radii); (.., rows, panels, radii).

    By products of real matrices with two rows. A complex row by a matrix is a matrix by a vector to BLAS, which starts
    its threads for each of them from 256 radii on.
    """
    if np.iscomplexobj(waves):
        (re, im), (re_of_i, im_of_i) = (np.moveaxis(_pair(kernel) @ part, -2, 0) for part in (waves.real, waves.imag))
        re, im = re - im_of_i, im + re_of_i
    else:
        re, im = np.moveaxis(_pair(kernel) @ waves, -2, 0)
    return re + 1j * im


def _pair(values: w.Array) -> np.ndarray:
    """Return the real and the imaginary part, one more axis before the last."""
    pair = np.empty((*values.shape[:-1], 2, values.shape[-1]))
    pair[..., 0, :], pair[..., 1, :] = values.real, values.imag
    return pair

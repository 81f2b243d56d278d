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

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.detours import HIDDEN, LOST, Poles, poles
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.weights import COUNT, NODES, TO_LEGENDRE, closeness, turns, weights

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
        return poles(self.kernel, NODES, TO_LEGENDRE, self.closeness)

    @cached_property
    def hidden(self) -> np.ndarray:
        """What a detour around each panel's pole may leave out, shape (panels, rows, radii)."""
        return HIDDEN * self.poles.rest.T[..., None] * self.covered

    @property
    def blurred(self) -> np.ndarray:
        """Where what a detour may leave out may be rounding's alone."""
        return self.poles.uncertainty <= np.maximum(_SINGLE, 10.0 * LOST * self.closeness)


def panel_poles(panels: w.Array, kernel: w.Array) -> Poles:
    """Return the pole that each panel's kernel (with dk/ds), shape (rows, panels, nodes), would have."""
    return poles(kernel, NODES, TO_LEGENDRE, closeness(panels))


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
    rest = 2.0 * np.abs(kernel @ TO_LEGENDRE[-2:].T).sum(axis=-1).T
    close, turned, off_axis = turns(seen.load, seen.r, panels)
    rounding = (ROUNDING * close * np.abs(kernel).max(axis=-1)).T
    pieces = np.maximum(np.ceil(turned / phase), 1.0).astype(int)
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
    return Evaluated(parts, errors, sizes, covered, gains, kernel, close)


def _summed(seen: Seen, panels: w.Array, kernel: w.Array, pieces: np.ndarray) -> tuple[w.Array, ...]:
    """Return of each panel, all on the axis or all off it, the sums of what `_integrated` returns of its `pieces`."""
    ends = np.cumsum(pieces)
    cut, values = (panels, kernel) if ends[-1] == len(panels) else _cut(panels, kernel, pieces)
    step = max(1, _CHUNK // (COUNT * seen.r.size * len(kernel)))
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
        values[:, count == number] = (re + 1j * im).reshape(len(kernel), -1, COUNT)
    return cut, values


@lru_cache(maxsize=64)
def _spread(count: int) -> np.ndarray:
    """Return the matrix from values at a panel's nodes to those at the nodes of its equal pieces."""
    middles = (2.0 * np.arange(count) + 1.0) / count - 1.0
    at = (middles[:, None] + NODES / count).ravel()
    return (np.polynomial.legendre.legvander(at, COUNT - 1) @ TO_LEGENDRE).T


def _integrated(seen: Seen, panels: w.Array, kernel: w.Array) -> tuple[w.Array, np.ndarray, np.ndarray, np.ndarray]:
    """Return of each panel, row and radius the integral, its absolute size, that of the waves alone, the rule's error.

    The last by `weights.weights`.
    """
    met = weights(seen.load, seen.orders, seen.r, panels)
    by_body = kernel.reshape(-1, *met.values.shape[:3])
    sizes = (np.abs(by_body)[..., None, :] @ met.sizes)[..., 0, :]
    swing = (np.abs(by_body @ TO_LEGENDRE.T) * met.swing).sum(axis=-1)
    quantities = (
        products(by_body, met.values),
        sizes,
        np.broadcast_to(met.covered, sizes.shape),
        swing[..., None] * met.most,
    )
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

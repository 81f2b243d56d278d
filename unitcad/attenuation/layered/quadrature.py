"""Gauss and Legendre over the panels of a Hankel integral, with a bound of the error of each.

A panel's kernel is known at 16 nodes. Where the Bessel functions swing faster than they can be seen there, the panel is
cut into pieces, and the kernel's Legendre series is read off at the nodes of each: the kernel, which costs most, is
sampled as it varies, not as the waves do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.detours import HIDDEN, LOST, Poles, poles
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.weights import COUNT, NODES, TO_LEGENDRE, Pieces, Weights, closeness, pieces, weights

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


class Each(NamedTuple):
    """Of each panel, row and radius: the integral, its absolute size, that of the waves alone, the rule's error.

    Shape (panels, rows, radii).
    """

    parts: w.Array
    sizes: np.ndarray
    covered: np.ndarray
    swing: np.ndarray

    def errors(self, rest: np.ndarray) -> np.ndarray:
        """Return bounds of the errors; rest (rows, panels): what the kernel's series leaves out."""
        return rest.T[..., None] * self.covered + self.swing


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Integrals over panels, of all together and, when asked, of each.

    total, error, size (rows, radii): the integral over all panels, a bound of its error, its absolute size; kernel
    (with dk/ds): what was integrated; closeness: the wavenumber over half of what a panel covers of it; rest (rows,
    panels): of the kernel, a bound of what its Legendre series leaves out; rounding: what of it may be rounding's;
    known: what was taken out of each row. What is of each panel is worked out when asked: where no panel is bad,
    nobody does.
    """

    total: w.Array
    error: np.ndarray
    size: np.ndarray
    kernel: w.Array
    closeness: np.ndarray
    rest: np.ndarray
    rounding: np.ndarray
    known: np.ndarray
    by_panel: Callable[[], Each]

    @cached_property
    def each(self) -> Each:
        return self.by_panel()

    @cached_property
    def errors(self) -> np.ndarray:
        """A bound of the error of each panel's part."""
        return self.each.errors(self.rest)

    @cached_property
    def gains(self) -> np.ndarray:
        """By how much halving a panel lessens the largest part of its error, shape (panels,)."""
        halved = 2.0 * (2.0 * self.rounding.T + _CANCELLED * np.abs(self.known))[..., None] * self.each.covered
        return np.maximum(self.errors.max(axis=(1, 2)) - halved.max(axis=(1, 2)), 0.0)

    @cached_property
    def poles(self) -> Poles:
        """The pole of each panel."""
        return poles(self.kernel, NODES, TO_LEGENDRE, self.closeness)

    @cached_property
    def hidden(self) -> np.ndarray:
        """What a detour around each panel's pole may leave out, shape (panels, rows, radii)."""
        return HIDDEN * self.poles.rest.T[..., None] * self.each.covered

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
    cut = pieces(seen.load, seen.r, panels, phase)
    rounding = ROUNDING * cut.closeness * np.abs(kernel).max(axis=-1)
    series = np.abs(kernel @ TO_LEGENDRE.T)
    rest = 2.0 * np.maximum(2.0 * series[..., -2:].sum(axis=-1), rounding)
    whole = len(cut.of) == len(panels)
    values = kernel if whole else _at_pieces(cut, kernel)
    if np.any(cut.off_axis) or values.size * seen.r.size > _CHUNK:
        each = _in_chunks(seen, cut, values)
        total, sizes = each.parts.sum(axis=0), each.sizes.sum(axis=0)
        error = each.errors(rest).sum(axis=0)

        def by_panel() -> Each:
            return each
    else:
        met = weights(seen.load, seen.orders, seen.r, cut.panels)
        series = series if whole else np.abs(values @ TO_LEGENDRE.T)
        total, error, sizes = _together(met, values, series, rest if whole else rest[:, cut.of])

        def by_panel() -> Each:
            return _integrated(met, values, cut.count)

    return Evaluated(total, error, sizes, kernel, cut.closeness, rest, rounding, seen.taken_out, by_panel)


def _at_pieces(cut: Pieces, kernel: w.Array) -> w.Array:
    """Return the kernel at the nodes of the pieces, shape (rows, pieces, nodes)."""
    values, count = kernel[:, cut.of], cut.count[cut.of]
    for number in np.unique(cut.count[cut.count > 1]):
        re, im = np.moveaxis(_pair(kernel[:, cut.count == number]) @ _spread(int(number)), -2, 0)  # as `products` does
        values[:, count == number] = (re + 1j * im).reshape(len(kernel), -1, COUNT)
    return values


@lru_cache(maxsize=64)
def _spread(count: int) -> np.ndarray:
    """Return the matrix from values at a panel's nodes to those at the nodes of its equal pieces."""
    middles = (2.0 * np.arange(count) + 1.0) / count - 1.0
    at = (middles[:, None] + NODES / count).ravel()
    return (np.polynomial.legendre.legvander(at, COUNT - 1) @ TO_LEGENDRE).T


def _together(
    met: Weights, kernel: w.Array, series: np.ndarray, rest: np.ndarray
) -> tuple[w.Array, np.ndarray, np.ndarray]:
    """Return the integral over all pieces, a bound of its error and its absolute size, shape (rows, radii).

    series (rows, pieces, degrees): the kernel's coefficients, absolute; rest (rows, pieces): what they leave out.
    """
    orders, *_, radii = met.values.shape
    flat = kernel.reshape(-1, orders, kernel[0].size)
    total = products(flat, met.values.reshape(orders, -1, radii))
    size = np.abs(flat)[..., None, :] @ met.sizes.reshape(orders, -1, radii)
    by_body = series.reshape(-1, orders, *series.shape[1:])
    swing = (by_body * met.swing).sum(axis=-1)[..., None, :]
    error = swing @ met.most + rest.reshape(swing.shape) @ met.covered
    return total.reshape(-1, radii), error.reshape(-1, radii), size.reshape(-1, radii)


def _integrated(met: Weights, kernel: w.Array, count: np.ndarray) -> Each:
    """Return the integrals over each panel of `count` (panels,) pieces, all on the axis or all off it."""
    by_body = kernel.reshape(-1, *met.values.shape[:3])
    sizes = (np.abs(by_body)[..., None, :] @ met.sizes)[..., 0, :]
    quantities = (
        products(by_body, met.values),
        sizes,
        np.broadcast_to(met.covered, sizes.shape),
        (np.abs(by_body @ TO_LEGENDRE.T) * met.swing).sum(axis=-1)[..., None] * met.most,
    )
    found = Each(*(one.reshape(*kernel.shape[:2], -1).swapaxes(0, 1) for one in quantities))
    first = np.cumsum(count) - count
    return found if len(count) == kernel.shape[1] else Each(*(np.add.reduceat(one, first) for one in found))


def _in_chunks(seen: Seen, cut: Pieces, kernel: w.Array) -> Each:
    """Return the integrals over each panel, some of them at once that are all on the axis or all off it."""
    shape = (len(cut.count), len(kernel), seen.r.size)
    sums = Each(np.empty(shape, dtype=np.complex128), *np.empty((3, *shape)))
    step = max(1, _CHUNK // (COUNT * seen.r.size * len(kernel)))
    for which in (np.flatnonzero(~cut.off_axis), np.flatnonzero(cut.off_axis)):
        ends = np.cumsum(cut.count[which])
        for chunk in np.split(which, np.flatnonzero(np.diff(ends // step)) + 1):
            if chunk.size:
                at = np.isin(cut.of, chunk)
                met = weights(seen.load, seen.orders, seen.r, cut.panels[at])
                found = _integrated(met, kernel[:, at], cut.count[chunk])
                for whole, part in zip(sums, found, strict=True):
                    whole[chunk] = part
    return sums


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

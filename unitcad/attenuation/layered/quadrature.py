"""Gauss and Legendre over the panels of a Hankel integral, with a bound of the error of each.

A panel's kernel is known at a few nodes. Where the Bessel functions swing faster than they can be seen there, the panel
is cut into pieces, and the kernel's Legendre series is read off at the nodes of each: the kernel, which costs most, is
sampled as it varies, not as the waves do. What the waves of all pieces come to at a panel's node is its weight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.detours import HIDDEN, LOST, Poles, poles
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.path import NODES
from unitcad.attenuation.layered.weights import Turns, Weights, closeness, rule, spread, turns, weights

ROUNDING = 1e-15
"""Of a wavenumber, as the kernel feels it next to a pole."""
_CANCELLED = 4e-15
"""Of what was taken out of the kernel: what rounding leaves of the last coefficients of the difference."""
_SINGLE = 1e-7
"""Uncertainty of a pole below which a panel has no other, or one that is next to nothing beside it."""
_LESS = 0.75
"""Times their share of the phase: of fewer nodes, which see less of the waves."""
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
    """Of each panel, row and radius: the integral, that of the waves' absolute size, the rule's error.

    Shape (panels, rows, radii).
    """

    parts: w.Array
    covered: np.ndarray
    swing: np.ndarray

    def errors(self, rest: np.ndarray) -> np.ndarray:
        """Return bounds of the errors; rest (rows, panels): what the kernel's series leaves out."""
        return self.times(rest) + self.swing

    def times(self, kernel: np.ndarray) -> np.ndarray:
        """Return what a kernel of that size comes to on each panel; kernel (rows, panels)."""
        return kernel.T[..., None] * self.covered


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Integrals over panels, of all together and, when asked, of each.

    total, error, size (rows, radii): the integral over all panels, a bound of its error, what it would be if nothing
    cancelled; kernel (with dk/ds): what was integrated; closeness: the wavenumber over half of what a panel covers of
    it; peak, rest (rows, panels): the kernel's largest value, a bound of what its Legendre series leaves out; known:
    what was taken out of each row. What is of each panel is worked out when asked: where no panel is bad, nobody does.
    """

    total: w.Array
    error: np.ndarray
    size: np.ndarray
    kernel: w.Array
    closeness: np.ndarray
    peak: np.ndarray
    rest: np.ndarray
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
    def sizes(self) -> np.ndarray:
        """What each panel's part would be if nothing cancelled."""
        return self.each.times(self.peak)

    @cached_property
    def gains(self) -> np.ndarray:
        """By how much halving a panel lessens the largest part of its error, shape (panels,)."""
        halved = 2.0 * self.each.times(
            2.0 * _rounding(self.peak, self.closeness) + _CANCELLED * np.abs(self.known)[:, None]
        )
        return np.maximum(self.errors.max(axis=(1, 2)) - halved.max(axis=(1, 2)), 0.0)

    @cached_property
    def poles(self) -> Poles:
        """The pole of each panel."""
        return _poles(self.kernel, self.closeness)

    @cached_property
    def hidden(self) -> np.ndarray:
        """What a detour around each panel's pole may leave out, shape (panels, rows, radii)."""
        return HIDDEN * self.each.times(self.poles.rest)

    @property
    def blurred(self) -> np.ndarray:
        """Where what a detour may leave out may be rounding's alone."""
        return self.poles.uncertainty <= np.maximum(_SINGLE, 10.0 * LOST * self.closeness)


def panel_poles(panels: w.Array, kernel: w.Array) -> Poles:
    """Return the pole that each panel's kernel (with dk/ds), shape (rows, panels, nodes), would have."""
    return _poles(kernel, closeness(panels))


def _poles(kernel: w.Array, close: np.ndarray) -> Poles:
    gauss = rule(kernel.shape[-1])
    return poles(kernel, gauss.nodes, gauss.to_legendre, close)


def evaluate(seen: Seen, panels: w.Array, kernel: w.Array, phase: float) -> Evaluated:
    """Integrate over each panel, on the axis or off it, its kernel (with dk/ds) of shape (rows, panels, nodes).

    The rows are those of the first body, of the second one, and so on.

    phase: the most that the fastest Bessel product may turn over a piece of a panel of 16 nodes; where there are fewer,
    `_LESS` of their share of it.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. Next to a pole the wavenumber's own rounding, times the kernel's slope of at most itself over the panel, is
    all that is left of the last coefficients: halving doubles it. Where the kernel is little beside what it is less by,
    their difference's rounding is left, and stays.
    """
    count = kernel.shape[-1]
    lie = turns(seen.load, seen.r, panels, phase if count == NODES else phase * _LESS * count / NODES)
    peak = np.abs(kernel).max(axis=-1)
    series = np.abs(kernel @ rule(count).to_legendre.T)
    rest = 2.0 * np.maximum(2.0 * series[..., -2:].sum(axis=-1), _rounding(peak, lie.closeness))
    if not lie.level or len(kernel) * lie.total * count * seen.r.size > _CHUNK:
        each = _in_chunks(seen, panels, lie, kernel, series)
        total, error, size = (one.sum(axis=0) for one in (each.parts, each.errors(rest), each.times(peak)))

        def by_panel() -> Each:
            return each
    else:
        met = weights(seen.load, seen.orders, seen.r, panels, lie.pieces, count, True)
        total, error, size = _together(met, kernel, series, np.array([rest, peak]))

        def by_panel() -> Each:
            return _integrated(met, kernel, series, lie.pieces)

    return Evaluated(total, error, size, kernel, lie.closeness, peak, rest, seen.taken_out, by_panel)


def _rounding(peak: np.ndarray, close: np.ndarray) -> np.ndarray:
    """Return what of the kernel may be the rounding of its wavenumbers, shape (rows, panels)."""
    return ROUNDING * close * peak


def _together(
    met: Weights, kernel: w.Array, series: np.ndarray, rest_and_peak: np.ndarray
) -> tuple[w.Array, np.ndarray, np.ndarray]:
    """Return the integral over all panels, a bound of its error and its size if nothing cancelled, (rows, radii).

    series (rows, panels, degrees): the kernel's coefficients, absolute; rest_and_peak (2, rows, panels): what they
    leave out, and the kernel's largest value.
    """
    orders, *_, radii = met.values.shape
    total = products(kernel.reshape(-1, orders, kernel[0].size), met.values.reshape(orders, -1, radii))
    swing = (series.reshape(-1, orders, *series.shape[1:]) * met.swing).sum(axis=-1)
    left_out, size = rest_and_peak.reshape(2, *swing.shape)[..., None, :] @ met.covered
    error = swing[..., None, :] @ met.most + left_out
    return total.reshape(-1, radii), error.reshape(-1, radii), size.reshape(-1, radii)


def _integrated(met: Weights, kernel: w.Array, series: np.ndarray, pieces: np.ndarray) -> Each:
    """Return the integrals over each panel, all on the axis or all off it.

    series: coefficients, absolute; pieces (panels,): of each panel, if the weights are not of panels but of pieces.
    """
    coefficients = series.reshape(-1, len(met.values), *series.shape[1:])
    swing = (coefficients * met.swing).sum(axis=-1)[..., None] * met.most
    of_panels = met.values.shape[1] == len(pieces)
    values = kernel if of_panels else _at_pieces(kernel, pieces)
    parts = products(values.reshape(-1, *met.values.shape[:3]), met.values)
    if not of_panels:
        parts = np.add.reduceat(parts, np.cumsum(pieces) - pieces, axis=2)
    quantities = (parts, np.broadcast_to(met.covered, swing.shape), swing)
    return Each(*(one.reshape(*kernel.shape[:2], -1).swapaxes(0, 1) for one in quantities))


def _at_pieces(kernel: w.Array, pieces: np.ndarray) -> w.Array:
    """Return the kernel at the nodes of each panel's pieces, shape (rows, pieces, nodes)."""
    count = kernel.shape[-1]
    values, numbers = np.repeat(kernel, pieces, axis=1), np.repeat(pieces, pieces)
    for number in np.unique(pieces[pieces > 1]):
        onto, _ = spread(int(number), count)
        values[:, numbers == number] = products(kernel[:, pieces == number], onto).reshape(len(kernel), -1, count)
    return values


def _in_chunks(seen: Seen, panels: w.Array, lie: Turns, kernel: w.Array, series: np.ndarray) -> Each:
    """Return the integrals over each panel, some of them at once that are all on the axis or all off it."""
    count = kernel.shape[-1]
    shape = (len(panels), len(kernel), seen.r.size)
    sums = Each(np.empty(shape, dtype=np.complex128), *np.empty((2, *shape)))
    step = max(1, _CHUNK // (count * seen.r.size * len(kernel)))
    for which in (np.flatnonzero(~lie.off_axis), np.flatnonzero(lie.off_axis)):
        ends = np.cumsum(lie.pieces[which])
        for at in np.split(which, np.flatnonzero(np.diff(ends // step)) + 1):
            if at.size:
                pieces = lie.pieces[at]
                met = weights(seen.load, seen.orders, seen.r, panels[at], pieces, count, False)
                for whole, part in zip(sums, _integrated(met, kernel[:, at], series[:, at], pieces), strict=True):
                    whole[at] = part
    return sums


def products(kernel: w.Array, waves: w.Array) -> w.Array:
    """Sum kernel (.., rows, panels, nodes) times waves (rows, panels, nodes, radii); (.., rows, panels, radii).

    By products of real matrices with two columns. A matrix by a complex vector starts BLAS's threads for each of them
    from 256 radii on.
    """
    turned = waves.swapaxes(-1, -2)
    pair = np.ascontiguousarray(kernel)[..., None].view(np.float64)
    if np.iscomplexobj(waves):
        by_re, by_im = (np.ascontiguousarray(part) @ pair for part in (turned.real, turned.imag))
        return (by_re.view(np.complex128) + 1j * by_im.view(np.complex128))[..., 0]
    return (turned @ pair).view(np.complex128)[..., 0]

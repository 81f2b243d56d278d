"""Where a Hankel integral may stop: a bound of what lies beyond each wavenumber, measured on the kernel itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bounds
from unitcad.attenuation.layered.kept import kept
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.statics import static_kernels

_PER_DECADE = 8
_LOOSE = 1e-4
"""rtol from which on a tail stops early, so that half as many wavenumbers show what is far out."""
_FAR = 30.0
"""Over the first wavenumber, and over the thinnest layer's thickness: beyond both a kernel falls off as a power."""
_MARGIN = 1.5
_SOON = 10.0
"""Over the first wavenumber: where a tail may stop by the top layer's half-space, no other one is tried."""


@dataclass(frozen=True)
class Tail:
    """bounds[..., i]: the integrals of the kernel's rows from k[i] to infinity are at most that.

    In m per pascal or newton, shape (rows, radii, wavenumbers). references: the static half-space to be taken out of
    the rows of each body.
    """

    k: np.ndarray
    bounds: np.ndarray
    references: tuple[w.Material | None, ...]
    scale: float  # a first guess of the largest displacement

    @cached_property
    def _most(self) -> np.ndarray:
        return self.bounds.max(axis=(0, 1))

    def start(self, tolerance: float) -> float:
        """Return the least wavenumber (1/m) beyond which less than 0.4 of the tolerance is missing, or the last one."""
        good = self._most <= 0.4 * tolerance
        return float(self.k[np.argmax(good)] if good.any() else self.k[-1])

    def bound(self, stop: float) -> np.ndarray:
        """Return the bounds from a `stop` (1/m) on, not before the first of `k`; shape (rows, radii)."""
        return self.bounds[..., self.k.searchsorted(stop, side="right") - 1]


def grid(
    load: Load, r: np.ndarray, z: float, end: float, thinnest: float, affordable: float, rtol: float
) -> np.ndarray:
    """Return the wavenumbers (1/m), from beyond the last pole on, at which the kernel is sampled to bound its tail.

    thinnest: thickness of a layer (m); affordable: the last wavenumber to which a path may go. It is one of them where
    they reach beyond it.
    """
    lengths = [x for x in (load.reach, z, float(r.max())) if x > 0]
    first = max(1.4 * end, 1e-3 / max(lengths))
    last = max(1e5 * first, 1e5 / min(lengths))
    far = min(max(_FAR * first, _FAR / thinnest), 0.1 * last)
    near_decades, far_decades = np.log10([far / first, last / far])
    near = np.linspace(0.0, near_decades, int(_PER_DECADE * near_decades) + 2)
    per_decade = _PER_DECADE / 2 if rtol >= _LOOSE else _PER_DECADE
    beyond = near_decades + np.linspace(0.0, far_decades, int(np.ceil(per_decade * far_decades)) + 1)
    k = first * 10.0 ** np.concatenate([near, beyond[1:]])
    return np.union1d(k, affordable) if k[0] < affordable < k[-3] else k


def joined(tails: Sequence[Tail]) -> Tail:
    """Return the tail of several bodies, measured on one grid."""
    if len(tails) == 1:
        return tails[0]
    bounds = np.concatenate([tail.bounds for tail in tails])
    references = tuple(reference for tail in tails for reference in tail.references)
    return Tail(tails[0].k, bounds, references, max(tail.scale for tail in tails))


def measure_tail(
    k: np.ndarray,
    raw: w.Array,
    materials: tuple[w.Material, ...],
    loads: Sequence[Load],
    r: np.ndarray,
    static: np.ndarray | None,
    far: float,
    rtol: float,
    largest: float = np.inf,
) -> Tail:
    """Bound a body's tail by the kernel on its `grid` k; choose the static half-space that leaves the least.

    raw (rows, wavenumbers): the kernel, nothing taken out; static: the loads' integrals, shape (rows, radii), None
    below the surface; far: the last wavenumber (1/m) that can be afforded; largest: displacement, if known. Two bounds,
    the lower one counts: the envelope of the Bessel functions, and, where the kernel falls off, integration by parts
    against their oscillation.
    """
    within = max(1, int(k.searchsorted(far, side="right")))
    if static is None:
        bounds = _bounds(k, raw, loads, r)[..., :within]
        return Tail(k[:within], bounds, (None,), min(float(bounds[..., 0].max()), largest))
    # As on a half-space of the compliance at the wavenumber of the load's size: a film is not what the disc rests on.
    at = min(int(k.searchsorted(1.0 / max(loads[0].reach, float(r.min())))), k.size - 1)
    scale = min(float((np.abs(static).max(axis=1) * np.abs(raw[:, at])).max()), largest)
    directions = tuple(load.direction for load in loads)

    def less(material: w.Material) -> w.Array:
        return raw - static_kernels(material, directions)[:, None]

    def tail(material: w.Material) -> Tail:
        return Tail(k[:within], _bounds(k, less(material), loads, r)[..., :within], (material,), scale)

    top = tail(materials[0])
    if top.start(rtol * scale) <= _SOON * k[0]:
        return top
    choice = [material for material in dict.fromkeys(reversed(materials)) if material.shear != 0]
    if len(choice) == 1:
        return top
    few = np.array([r.min(), r[np.argmin(np.abs(r - loads[0].reach))], r.max()])
    bounds = _bounds(k, np.array([less(material) for material in choice]), loads, few)
    left = [_left(Tail(k[:within], bound[..., :within], (), scale), rtol) for bound in bounds]
    return tail(choice[left.index(min(left))])


def _left(tail: Tail, rtol: float) -> tuple[float, float, float]:
    """Return what it leaves where it stops, nothing below the tolerance being better, and how far that is.

    Among equals the one that leaves the least: the scale may have been guessed too large.
    """
    stop = tail.start(rtol * tail.scale)
    rest = float(tail.bound(stop).max())
    return max(rest, 0.4 * rtol * tail.scale), stop, rest


class _Waves(NamedTuple):
    """Bounds of the load's transform times the Bessel functions, shape (rows, radii, wavenumbers).

    weighted: the same times the width that each wavenumber stands for by the trapezoidal rule, and `before` that of
    the half before it; by_parts: times four over the distance from the edge where the waves oscillate, so that it
    bounds an integral, and `_NONE` elsewhere.
    """

    envelope: np.ndarray
    weighted: np.ndarray
    before: np.ndarray
    by_parts: np.ndarray


_NONE = 1e250
"""In place of infinity, which times 0 is no number."""


@kept
def _waves(load: Load, orders: tuple[int, ...], r: np.ndarray, k: np.ndarray) -> _Waves:
    phase = r[:, None] * k
    envelope = _MARGIN * load.envelope(k) * bessel_bounds(orders, phase)
    before = np.concatenate([[0.0], np.diff(k)]) / 2.0
    after = np.concatenate([np.diff(k), [0.0]]) / 2.0
    distance = np.maximum(np.abs(r - load.reach), 1e-12 * (r + load.reach) + 1e-300)
    oscillating = (phase > 3.0) & ((k * load.reach > 3.0) | (load.reach == 0.0))
    by_parts = np.where(oscillating, envelope * (4.0 / distance)[:, None], _NONE)
    return _Waves(envelope, envelope * (before + after), envelope * before, by_parts)


def _bounds(k: np.ndarray, kernels: w.Array, loads: Sequence[Load], r: np.ndarray) -> np.ndarray:
    """Return the bounds from each wavenumber on, shape (.., rows, radii, wavenumbers); kernels (.., rows, k)."""
    waves = _waves(loads[0], tuple(order for one in loads for order in one.orders), r, k)
    size = np.abs(kernels)
    variation = size.copy()
    variation[..., :-1] += _summed_from_right(np.abs(kernels[..., 1:] - kernels[..., :-1]))
    size = size[..., None, :]
    by_envelope = _summed_from_right(size * waves.weighted) - size * waves.before
    by_envelope += _beyond(k, size[..., -3::2] * waves.envelope[..., -3::2])
    return np.minimum(by_envelope, variation[..., None, :] * waves.by_parts)


def _summed_from_right(f: np.ndarray) -> np.ndarray:
    return f[..., ::-1].cumsum(axis=-1)[..., ::-1]


def _beyond(k: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Integrate what goes on as k^-1.5, or as fast as it fell from the last wavenumber but two to the last one."""
    least = np.maximum(ends, 1e-300)
    power = np.log(least[..., :1] / least[..., 1:]) / np.log(k[-1] / k[-3])
    return ends[..., 1:] * (k[-1] / np.maximum(power - 1.0, 1e-3))

"""Where a Hankel integral may stop: a bound of what lies beyond each wavenumber, measured on the kernel itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bound
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.statics import static_kernel

_PER_DECADE = 16
_MARGIN = 1.5


@dataclass(frozen=True)
class Tail:
    """bounds[i]: the integrals of the kernel's rows from k[i] to infinity are at most that (m per pascal or newton).

    Shape (wavenumbers, rows, radii).
    """

    k: np.ndarray
    bounds: np.ndarray
    reference: w.Material | None
    scale: float  # a first guess of the largest displacement

    def start(self, tolerance: float) -> float:
        """Return the least wavenumber (1/m) beyond which less than 0.4 of the tolerance is missing, or the last one."""
        good = np.nonzero(self.bounds.max(axis=(1, 2)) <= 0.4 * tolerance)[0]
        return float(self.k[good[0]] if good.size else self.k[-1])

    def bound(self, stop: float) -> np.ndarray:
        """Return the bounds at `stop`, one of `k`; shape (rows, radii)."""
        return self.bounds[min(np.searchsorted(self.k, stop), self.k.size - 1)]


def measure_tail(
    kernel: Callable[[w.Array], w.Array],
    materials: tuple[w.Material, ...],
    load: Load,
    r: np.ndarray,
    z: float,
    end: float,
    far: float,
    rtol: float,
    largest: float = np.inf,
) -> Tail:
    """Sample k C(k) beyond the last pole on a geometric grid; choose the static half-space that leaves the least.

    kernel(k): with nothing taken out; far: the last wavenumber (1/m) that can be afforded; largest: displacement, if
    known. Two bounds, the lower one counts: the envelope of the Bessel functions, and, where the kernel falls off,
    integration by parts against their oscillation.
    """
    lengths = [x for x in (load.reach, z, float(r.max())) if x > 0]
    first = max(1.4 * end, 1e-3 / max(lengths))
    last = max(1e5 * first, 1e5 / min(lengths))
    k = np.geomspace(first, last, int(_PER_DECADE * np.log10(last / first)) + 2)
    raw = kernel(k.astype(complex))
    within = max(1, int(np.searchsorted(k, far)))
    if z > 0:
        bounds = _bounds(k, raw, load, r)[:within]
        return Tail(k[:within], bounds, None, min(float(bounds[0].max()), largest))
    # As on a half-space of the compliance at the wavenumber of the load's size: a film is not what the disc rests on.
    at = min(int(np.searchsorted(k, 1.0 / max(load.reach, float(r.min())))), k.size - 1)
    scale = min(float(np.max(np.abs(load.static(r)).T * np.abs(raw[:, at]))), largest)
    tails = [
        Tail(
            k[:within],
            _bounds(k, raw - static_kernel(material, load.direction)[:, None], load, r)[:within],
            material,
            scale,
        )
        for material in dict.fromkeys(reversed(materials))
        if material.shear != 0
    ]

    def left(tail: Tail) -> tuple[float, float, float]:
        """Return what it leaves where it stops, nothing below the tolerance being better, and how far that is.

        Among equals the one that leaves the least: the scale may have been guessed too large.
        """
        stop = tail.start(rtol * scale)
        rest = float(tail.bound(stop).max())
        return max(rest, 0.4 * rtol * scale), stop, rest

    return min(tails, key=left)


def _bounds(k: np.ndarray, kernel: w.Array, load: Load, r: np.ndarray) -> np.ndarray:
    size = np.abs(kernel).T[:, :, None]  # axes: wavenumbers, rows, radii
    phase = k[:, None] * r
    waves = load.envelope(k)[:, None, None] * np.stack([bessel_bound(order, phase) for order in load.orders], axis=1)
    by_envelope = _from_right(k, size * waves)
    steps = np.abs(np.diff(kernel, axis=1)).T[:, :, None]
    variation = size + np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, len(load.orders), 1))])
    distance = np.maximum(np.abs(r - load.reach), 1e-12 * (r + load.reach) + 1e-300)
    by_parts = variation * waves * (4.0 / distance)
    oscillating = (phase > 3.0) & ((k * load.reach > 3.0) | (load.reach == 0.0))[:, None]
    return _MARGIN * np.minimum(by_envelope, np.where(oscillating[:, None], by_parts, np.inf))


def _from_right(k: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Integrate by trapezoids from each k (first axis) to the last; beyond it as k^-1.5 or as fast as f fell."""
    pieces = (f[1:] + f[:-1]) / 2.0 * np.diff(k)[:, None, None]
    last = np.maximum(f[-1], 1e-300)
    power = np.log(np.maximum(f[-8], 1e-300) / last) / np.log(k[-1] / k[-8])
    beyond = f[-1] * k[-1] / np.maximum(power - 1.0, 1e-3)
    return np.concatenate([np.cumsum(pieces[::-1], axis=0)[::-1], np.zeros((1, *f.shape[1:]))]) + beyond

"""Where a Hankel integral may stop: a bound of what lies beyond each wavenumber, measured on the kernel itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation import waves as w
from unitcad.attenuation.loads import Load

_PER_DECADE = 16
_MARGIN = 1.5


@dataclass(frozen=True)
class Tail:
    """bounds[i]: the integral from k[i] to infinity is at most that (m per pascal or newton), at any of the radii."""

    k: np.ndarray
    bounds: np.ndarray
    reference: w.Material | None
    scale: float  # a first guess of the largest displacement

    def start(self, scale: float, rtol: float) -> float:
        """The least wavenumber (1/m) beyond which less than 0.4 rtol scale is missing; the last one if none is."""
        good = np.nonzero(self.bounds <= 0.4 * rtol * scale)[0]
        return float(self.k[good[0]] if good.size else self.k[-1])

    def bound(self, stop: float) -> float:
        """The bound at `stop`, one of `k`."""
        return float(self.bounds[min(np.searchsorted(self.k, stop), self.k.size - 1)])


def measure_tail(
    kernel: Callable[[w.Array, int], w.Array],
    static_kernel: Callable[[w.Material, int], w.Array],
    materials: tuple[w.Material, ...],
    load: Load,
    r: np.ndarray,
    z: float,
    end: float,
    rtol: float,
) -> Tail:
    """Sample k C(k) beyond the last pole on a geometric grid; choose the static half-space that leaves the least.

    kernel(k, layers kept): with nothing taken out. Two bounds, the lower one counts: the envelope of the Bessel
    functions, and, where the kernel falls off, integration by parts against their oscillation.
    """
    lengths = [x for x in (load.reach, z, float(r.max())) if x > 0]
    first = max(1.4 * end, 1e-3 / max(lengths))
    last = max(1e5 * first, 1e5 / min(lengths))
    k = np.geomspace(first, last, int(_PER_DECADE * np.log10(last / first)) + 2)
    column = 1 if load.direction == "normal" else 0
    raw = kernel(k.astype(complex), len(materials) - 1)
    if z > 0:
        bounds = _bounds(k, raw, load, r)
        return Tail(k, bounds, None, float(bounds[0]))
    found = []
    for material in dict.fromkeys(reversed(materials)):
        if material.shear == 0:
            continue
        static = static_kernel(material, column)
        bounds = _bounds(k, raw - static[:, None], load, r)
        along = np.max(np.abs(load.static(r)[0])) * np.max(np.abs(static))
        found.append(Tail(k, bounds, material, float(along)))
    return min(found, key=lambda tail: (tail.start(tail.scale, rtol), tail.bounds[-1]))


def _bounds(k: np.ndarray, kernel: w.Array, load: Load, r: np.ndarray) -> np.ndarray:
    fall = np.max(np.abs(kernel), axis=0)
    size = fall * load.envelope(k)
    wave = _wave(k[:, None] * r)
    by_envelope = _from_right(k, size[:, None] * wave)
    steps = np.abs(np.diff(kernel, axis=1)).max(axis=0)
    variation = fall + np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])
    distance = np.maximum(np.abs(r - load.reach), 1e-12 * (r + load.reach) + 1e-300)
    by_parts = (variation * load.envelope(k))[:, None] * wave * (4.0 / distance)
    oscillating = (k[:, None] * r > 3.0) & ((k * load.reach > 3.0) | (load.reach == 0.0))[:, None]
    return _MARGIN * np.minimum(by_envelope, np.where(oscillating, by_parts, np.inf)).max(axis=1)


def _wave(x: np.ndarray) -> np.ndarray:
    """A bound of |J0| and |J1|."""
    with np.errstate(divide="ignore"):
        return np.minimum(1.0, 1.01 * np.sqrt(2.0 / (np.pi * x)))


def _from_right(k: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Trapezoids from each k to the last, and beyond it as k^-1.5 (or faster, as it was falling)."""
    pieces = (f[1:] + f[:-1]) / 2.0 * np.diff(k)[:, None]
    last = np.maximum(f[-1], 1e-300)
    power = np.log(np.maximum(f[-8], 1e-300) / last) / np.log(k[-1] / k[-8])
    beyond = f[-1] * k[-1] / np.maximum(power - 1.0, 1e-3)
    return np.concatenate([np.cumsum(pieces[::-1], axis=0)[::-1], np.zeros((1, f.shape[1]))]) + beyond

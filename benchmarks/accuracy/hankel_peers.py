"""Four other methods for a Hankel integral: adaptive quadrature, digital filters, FFTLog, midpoints uniform in k.

Each gives the integral of f(k) J0(kr) over k from 0 to infinity at radii r (m). f takes an array of wavenumbers (1/m).
It may overflow at wavenumbers where a method needs no value.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import fft, integrate, interpolate, special

from unitcad.extras import missing_extra

Integrand = Callable[[np.ndarray], np.ndarray]
END = 2e4
"""Where the adaptive quadrature and the uniform grid stop, 1/m."""
INTERVALS = 300
"""The most intervals of the adaptive quadrature on each leg of its path."""
POLES, HEIGHT = 1500.0, 20.0
"""The lifted path, 1/m: up to where it is off the real axis, and by how much."""
FILTERS = ("gupt_61_1997", "gupt_120_1997", "key_201_2012", "key_401_2009", "anderson_801_1982", "wer_2001_2018")
"""Filters of libdlf: of each length the best one on exp(-kz) and on the damped forearm."""
FFTLOG_K = (1e-8, 1e8)
"""The ends of FFTLog's grid, 1/m: so far out that its periodic images do not reach the radii."""
FFTLOG_BIAS = -0.25
"""FFTLog treats f k^0.25 as periodic in log k: at the low end f does not vanish, f k^0.25 does."""


def adaptive(f: Integrand, r: np.ndarray, tolerance: float, lifted: bool) -> tuple[np.ndarray, float]:
    """Integrate by scipy's quad_vec to an absolute `tolerance`; return (value, its estimate of the error).

    On the real axis, or on a path lifted off its poles.
    """
    corners = [1e-9, HEIGHT * (1 + 1j), POLES + HEIGHT * 1j, POLES, END] if lifted else [1e-9, POLES, END]
    legs = list(pairwise(corners))
    total, error = np.zeros(len(r), dtype=complex), 0.0
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for a, b in legs:

            def along(t: float, a: complex = a, b: complex = b) -> np.ndarray:
                k = a + (b - a) * t
                return f(np.array([k]))[0] * (b - a) * (special.jv(0, k * r) if lifted else special.j0(k * r))

            value, off = integrate.quad_vec(
                along, 0.0, 1.0, epsabs=tolerance / len(legs), epsrel=0, norm="max", limit=INTERVALS
            )
            total, error = total + value, error + float(off)
    return total, error


def filtered(f: Integrand, r: np.ndarray, name: str) -> np.ndarray:
    """Apply a digital filter of libdlf, f evaluated anew at each radius. Raises UnitcadError without libdlf."""
    try:
        import libdlf
    except ImportError as error:
        raise missing_extra("fem", "the digital filters need libdlf") from error
    base, j0, *_ = getattr(libdlf.hankel, name)()
    with np.errstate(all="ignore"):
        return (f(base[None] / r[:, None]) @ j0) / r


def logarithmic(
    f: Integrand, r: np.ndarray, n: int, ends: tuple[float, float] = FFTLOG_K, bias: float = FFTLOG_BIAS
) -> np.ndarray:
    """Apply FFTLog (scipy's fht) on n points between the ends (1/m), then a cubic spline in log r."""
    k = np.geomspace(*ends, n)
    step = math.log(k[1] / k[0])
    offset = fft.fhtoffset(step, mu=0.0, initial=-math.log(k[n // 2] * 5e-3), bias=bias)
    grid = math.exp(offset) / k[::-1]
    with np.errstate(all="ignore"):
        sampled: Any = f(k)
        # fht transforms a(k) r J(kr) dk into A(r).
        both = np.asarray(fft.fht(np.stack([sampled.real, sampled.imag]), step, 0.0, offset, bias)) / grid
    if not np.all(np.isfinite(both)):
        return np.full(r.shape, np.nan + 0j)
    re, im = interpolate.CubicSpline(np.log(grid), both, axis=1)(np.log(r))
    return re + 1j * im


def uniform(f: Integrand, r: np.ndarray, n: int) -> np.ndarray:
    """Sum n midpoints, evenly spaced in k up to `END`."""
    k = (np.arange(n) + 0.5) * END / n
    with np.errstate(all="ignore"):
        sampled = f(k) * (END / n)
    return np.array([np.sum(sampled * special.j0(k * one)) for one in r])

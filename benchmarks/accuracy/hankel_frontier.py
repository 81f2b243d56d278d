"""The displacement beside FFTLog at its best: for each error the fewest points of all its settings, and a rtol."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count, product

import numpy as np

from benchmarks.accuracy import hankel_peers as peers
from benchmarks.accuracy.result import Table
from unitcad.accuracy.measurements import Timing, interleaved

TARGETS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
TOLERANCES = (0.1, 0.03, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
AIM = 1.0
"""The most that the displacement should take of FFTLog's time."""
_POINTS = (32, 48, 64, 80, 96, 128, 160, 192, 256, 320, 384, 512, 640, 768, 1024, 1536, 2048, 3072, 4096)
_FIRST, _LAST = (1e-6, 1e-4, 1e-2, 0.1, 1.0, 3.0), (1e4, 3e4, 1e5, 1e6, 1e8)
_BIASES = (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25)

Solve = Callable[[], np.ndarray]


@dataclass(frozen=True)
class Best:
    """The quickest of a method's settings for an error: its name, its true error, its call.

    anew: the same call at radii that were not met before, where a method keeps what hangs on them.
    """

    setting: str
    error: float
    solve: Solve
    anew: Solve | None = None


def by_fftlog(f: peers.Integrand, known: np.ndarray, r: np.ndarray, exact: np.ndarray) -> list[Best]:
    """Return for each number of points the setting of FFTLog that is nearest to `exact`, fewest points first."""
    found = []
    for n in _POINTS:
        tried = []
        for first, last, bias in product(_FIRST, _LAST, _BIASES):
            solve = partial(_logarithmic, f, known, r, n, (first, last), bias)
            tried.append(Best(f"{n} points, {first:g} to {last:g} /m, bias {bias:g}", _error(solve(), exact), solve))
        found.append(min(tried, key=lambda one: one.error))
    return found


def by_response(solve: Callable[[float, np.ndarray], np.ndarray], r: np.ndarray, exact: np.ndarray) -> list[Best]:
    """Return the displacement at each rtol, loosest first; `solve` takes the rtol and the radii r (m)."""
    calls = count(1)

    def anew(rtol: float) -> np.ndarray:
        return solve(rtol, r * (1.0 + 1e-12 * next(calls)))

    return [
        Best(f"rtol {rtol:g}", _error(solve(rtol, r), exact), partial(solve, rtol, r), partial(anew, rtol))
        for rtol in TOLERANCES
    ]


def table(name: str, own: Sequence[Best], other: Sequence[Best], repeats: int) -> Table:
    """Tabulate both at each target: the first setting that reaches it, its time, and the ratio."""
    picks = {
        (of, target): best
        for of, settings in (("unitcad", own), ("FFTLog", other))
        for target in TARGETS
        if (best := _first(settings, target))
    }
    # Of this thread: those of BLAS, once large arrays have woken them, spin on through the next calls.
    calls = {key: best.solve for key, best in picks.items()}
    calls |= {("anew", target): best.anew for (_, target), best in picks.items() if best.anew}
    times = interleaved(calls, repeats, clock=time.thread_time)
    rows = []
    for target in TARGETS:
        mine, peer = (picks.get((of, target)) for of in ("unitcad", "FFTLog"))
        took: list[Timing | None] = [times.get((of, target)) for of in ("unitcad", "FFTLog", "anew")]
        ratio = took[0].median / took[1].median if took[0] and took[1] else None
        rows.append(
            (
                target,
                peer.setting if peer else None,
                str(took[1]) if took[1] else None,
                mine.setting if mine else None,
                str(took[0]) if took[0] else None,
                ratio,
                str(took[2]) if took[2] else None,
            )
        )
    return Table(
        f"{name}: against FFTLog tuned for each error",
        ("error", "FFTLog", "its time", "unitcad", "time", "over FFTLog's", "time at new radii"),
        tuple(rows),
        f"True errors. FFTLog has the fewest of {len(_POINTS)} numbers of points with which one of "
        f"{len(_FIRST) * len(_LAST) * len(_BIASES)} ranges and biases reaches the error. It knows the answer, and "
        f"returns only u_z, without a bound. The aim is at most {AIM:g} at every error.",
    )


def _first(settings: Iterable[Best], target: float) -> Best | None:
    return next((best for best in settings if best.error <= target), None)


def _logarithmic(
    f: peers.Integrand, known: np.ndarray, r: np.ndarray, n: int, ends: tuple[float, float], bias: float
) -> np.ndarray:
    return known + peers.logarithmic(f, r, n, ends, bias)


def _error(found: np.ndarray, exact: np.ndarray) -> float:
    off = float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))
    return off if np.isfinite(off) else np.inf

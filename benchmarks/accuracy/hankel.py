"""The Hankel integral: error against time at five tolerances, beside the other methods of `hankel_peers`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import special

from benchmarks.accuracy import hankel_cost, hankel_frontier
from benchmarks.accuracy import hankel_peers as peers
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table, fastest, shown, stars
from unitcad.accuracy.measurements import PROCESSOR, PROCESSOR_NOTE, Timing, interleaved
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import default_template, load

OMEGA = 2 * math.pi * 125.0
DISC = UniformDisc(3.5e-3)
RADII = np.array([0.5, 1, 2, 3, 4, 5, 7, 9, 12, 15, 20, 25, 30]) * 1e-3
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
_END = 3e5
"""Where the reference's path ends, 1/m: beyond it the remainder is nothing (checked by doubling the end)."""
_FINEST = {"undamped": 1e-9}
"""The finest rtol that a case is promised to reach."""
_MOST = 0.1
"""The largest error that is of any use: beyond it a method gets no star."""
_LEVELS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
"""Errors for which the page says what to pick."""


@dataclass(frozen=True)
class Case:
    """A medium under the motor's disc; `remainder(k)` is k C_zz(k) less the static one of the top layer."""

    name: str
    medium: LayeredMedium
    omega: float = OMEGA

    @property
    def static(self) -> complex:
        """(1 - nu) / mu of the top layer at the frequency."""
        material = self.medium.materials(self.omega)[0]
        return complex((1 - self.medium.layers[0].poisson_ratio) / material.shear)

    @property
    def known(self) -> np.ndarray:
        """The static part's displacement, in closed form (m/Pa)."""
        return self.static * DISC.static(RADII)[1]

    def remainder(self, k: np.ndarray) -> np.ndarray:
        """Return what is left to integrate, without Bessel functions, m/Pa m; k (1/m) real or complex."""
        k = np.asarray(k)
        return (k * self.medium.compliance(k, self.omega)[..., 1, 1] - self.static) * DISC.transform(k)


@dataclass(frozen=True)
class _Row:
    method: str
    setting: str
    error: float
    estimate: float | None
    time: Timing


TEXT = (
    "u_z of the four-layer forearm at 125 Hz under the motor's disc (radius 3.5 mm) at 13 radii from 0.5 to 30 mm. "
    "Two variants: without damping, and with nu = 0.4999999 and tan delta 0.01. The error is the largest over the "
    "radii, over the largest |u_z|. The reference is a brute-force path: another contour and many more nodes, stated "
    "in each table. It measures only the integration: the reference shares the compliance and the static part in "
    "closed form with unitcad. The stability suite compares these with 60 digits and with exact answers. All "
    "methods get the same remainder after the static half-space is taken out, so none of them has the disc's slow "
    "tail. unitcad's time includes u_r, its bound on the error, and the choice of path.\n\n"
    "The settings of the others. *quad_vec*: scipy's, one wavenumber a call. It takes the real axis and a path "
    "lifted to "
    f"{peers.HEIGHT:g}i /m up to {peers.POLES:g} /m, at most {peers.INTERVALS} intervals a leg, cut at {peers.END:g} "
    "/m (this loses 3e-9, whatever the tolerance). The lifted path is timed three times, the real axis once, since "
    "it takes most of a minute without damping. A quick run has only the lifted path, at one tolerance. *Digital "
    "filter*: libdlf's, the kernel evaluated anew for each radius (no lagged "
    "convolution, no spline: with many radii those would cost less and lose digits). *FFTLog*: scipy's fht from "
    f"{peers.FFTLOG_K[0]:g} to {peers.FFTLOG_K[1]:g} /m with a bias of {peers.FFTLOG_BIAS:g}, then a cubic spline in "
    "log r. Its points are spread over all decades, so it needs many to resolve a pole. *Uniform k*: midpoints, cut "
    "at "
    f"{peers.END:g} /m."
)


def cases() -> list[Case]:
    """Return the forearm, the same without damping, and the same next to incompressible with little damping."""
    forearm = tissue_medium(estimate_input(load(default_template())).tissue)
    bare = [Layer(la.thickness, la.density, la.youngs_modulus, la.poisson_ratio) for la in forearm.layers]
    stiff = [Layer(la.thickness, la.density, la.youngs_modulus, 0.4999999, LossFactor(0.01)) for la in forearm.layers]
    rock = HalfSpace(forearm.half_space.density, forearm.half_space.youngs_modulus, forearm.half_space.poisson_ratio)
    return [
        Case("damped", forearm),
        Case("undamped", LayeredMedium(bare, rock)),
        Case("nearly incompressible", LayeredMedium(stiff, forearm.half_space)),
    ]


def run(quick: bool, say: Say) -> Result:
    """Solve every case by every method, and measure what responses of either load cost."""
    tables, plots, promises = [], [], []
    closest: list[tuple[float, str]] = []
    ends: dict[str, list[tuple[str, float, float]]] = {}
    for case in cases():
        say(case.name)
        reference = brute_force(case)
        doubt = "" if quick else _doubt(case, reference)
        rows = _rows(case, reference, quick)
        counts = [case.medium.response(DISC, case.omega, RADII, rtol=rtol).wavenumbers for rtol in TOLERANCES]
        ends[case.name] = [(f"{row.method}, {row.setting}: {row.time}", row.time.median, row.error) for row in rows]
        marks = stars([(row.time.median, row.error) for row in rows], most=_MOST)
        tables.append(
            Table(
                case.name,
                ("method", "setting", "error", "its own estimate", "time", "frontier"),
                tuple(
                    (r.method, r.setting, r.error, r.estimate, str(r.time), mark)
                    for r, mark in zip(rows, marks, strict=True)
                ),
                f"The reference has {_NODES:,} nodes, unitcad {min(counts):,} to {max(counts):,}.{doubt}",
            )
        )
        if case.name == "damped" and not quick:  # elsewhere its points would have to resolve poles
            tables.append(beside_fftlog(case, reference))
        names = dict.fromkeys(row.method for row in rows)
        plots.append(
            Plot(
                f"{case.name}: error against time",
                "processor seconds for 13 radii",
                "error over the largest |u_z|",
                {n: tuple((r.time.median, max(r.error, 1e-17)) for r in rows if r.method == n) for n in names},
            )
        )
        own = [row for row in rows if row.method == "unitcad"]
        for row, rtol in zip(own, TOLERANCES, strict=True):
            # Without any damping the response is a limit: the finest tolerance is not reached; the estimate says so.
            if rtol >= _FINEST.get(case.name, 0.0):
                promises.append(Promise(f"{case.name}: error over rtol {rtol:g}", row.error / max(rtol, 2e-13), 1.0))
            # The reference itself is good to about 1e-13: below that an estimate can't be checked.
            ratio = row.error / max(row.estimate or 0.0, 2e-13)
            promises.append(Promise(f"{case.name}: error over its estimate at rtol {rtol:g}", ratio, 1.0))
            closest.append((ratio, f"{case.name} at rtol {rtol:g}: error {shown(row.error)}, {ratio:.2f} of its bound"))
    picks = tuple((level, *(fastest(points, level) for points in ends.values())) for level in _LEVELS)
    tables.append(Table("What to pick: the fastest method for an error", ("error", *ends), picks))
    loads = hankel_cost.every_load(cases()[0].medium, RADII[::4] if quick else RADII, quick, say)
    counts = [] if quick else hankel_cost.counted(cases()[0].medium, say)
    closest += [
        (cost.over_bound, f"disc, {cost.load}: error {cost.over_bound:.2f} of its bound") for cost in (*loads, *counts)
    ]
    return Result(
        suite="hankel",
        title="The Hankel integral: error against time",
        text=f"{TEXT}\n\n{PROCESSOR_NOTE}",
        tables=(tables[-1], *hankel_cost.tables(loads, counts), *tables[:-1]),
        plots=(*plots, *hankel_cost.plots(loads, counts)),
        promises=(*promises, *hankel_cost.promises([*loads, *counts])),
        measured=machine("numpy", "scipy", "libdlf", "python-flint"),
        summary=Summary(tuple(_picked(ends)), max(closest)[1], 0),
    )


def beside_fftlog(case: Case, reference: np.ndarray, repeats: int = 21) -> Table:
    """Tabulate a case at every error beside FFTLog, of which the best setting is taken."""
    own = hankel_frontier.by_response(lambda rtol, r: _by_unitcad(case, rtol, r)[0], RADII, reference)
    other = hankel_frontier.by_fftlog(case.remainder, case.known, RADII, reference)
    return hankel_frontier.table(case.name, own, other, repeats)


def _picked(ends: dict[str, list[tuple[str, float, float]]]) -> Iterator[tuple[str, str, str]]:
    """Yield the fastest method for three errors on the damped forearm, and for one on the others."""
    for name, points in ends.items():
        for error in (1e-2, 1e-6, 1e-10) if name == "damped" else (1e-6,):
            if best := fastest(points, error):
                yield f"displacement of the forearm, {name}, 13 radii", f"{error:g}", best


_PANELS = 1499
_NODES = 40 * (400 + _PANELS)  # of `brute_force`


def brute_force(
    case: Case, end: float = _END, poles: float = 6000.0, height: float = 50.0, panels: int = _PANELS
) -> np.ndarray:
    """Return u_z (m/Pa) at `RADII` by a contour that no other method here uses.

    A half-ellipse into the upper half-plane up to `poles` (1/m), then `panels` along the real axis to `end`, 40 nodes a
    panel.
    """
    nodes, weights = np.polynomial.legendre.leggauss(40)
    turns = np.linspace(0.0, 1.0, 401)
    middle = (turns[1:] + turns[:-1]) / 2
    t = (middle[:, None] + np.diff(turns)[:, None] / 2 * nodes).ravel()
    dt = (np.diff(turns)[:, None] / 2 * weights).ravel()
    path = poles * (1 - np.cos(np.pi * t)) / 2 + 1j * height * np.sin(np.pi * t)
    step = np.pi * (poles / 2 * np.sin(np.pi * t) + 1j * height * np.cos(np.pi * t)) * dt
    edges = np.linspace(poles, end, panels + 1)
    on = ((edges[1:] + edges[:-1])[:, None] / 2 + np.diff(edges)[:, None] / 2 * nodes).ravel()
    width = (np.diff(edges)[:, None] / 2 * weights).ravel()
    lifted = case.remainder(path) * step
    level = case.remainder(on) * width
    total = [np.sum(lifted * special.jv(0, path * r)) + np.sum(level * special.j0(on * r)) for r in RADII]
    return case.known + np.array(total)


def second_path(case: Case) -> np.ndarray:
    """Return `brute_force` on another path: the difference of the two is the reference's doubt."""
    return brute_force(case, end=6e5, poles=9000.0, height=25.0)


def _doubt(case: Case, reference: np.ndarray) -> str:
    """Say how far a second path is from the reference."""
    doubt = float(np.max(np.abs(second_path(case) - reference)) / np.max(np.abs(reference)))
    return f" The reference's doubt, what a second such path differs by, is {doubt:.1e}."


_LIFTED, _LEVEL = "quad_vec, lifted path", "quad_vec, real axis"
Solved = tuple[np.ndarray, float | None]
"""u_z (m/Pa) at `RADII`, and the method's own estimate of its error."""


def _rows(case: Case, reference: np.ndarray, quick: bool) -> list[_Row]:
    methods = _methods(case, quick)
    scale = np.max(np.abs(reference))
    times: dict[tuple[str, str], Timing] = {}
    slow = {_LIFTED: 1 if quick else 3, _LEVEL: 1}
    quicker = {key: call for key, call in methods.items() if key[0] not in slow}
    times |= interleaved(quicker, 1 if quick else 7, clock=PROCESSOR)
    for name, repeats in slow.items():
        mine = {key: call for key, call in methods.items() if key[0] == name}
        times |= interleaved(mine, repeats, warm=False, clock=PROCESSOR)
    rows = []
    for method, setting in methods:
        time = times[method, setting]
        value, estimate = time.value
        error = float(np.max(np.abs(value - reference)) / scale)
        relative = None if estimate is None else estimate / scale
        rows.append(_Row(method, setting, error, relative, time))
    return rows


def _methods(case: Case, quick: bool) -> dict[tuple[str, str], Callable[[], Solved]]:
    f, known = case.remainder, case.known
    methods: dict[tuple[str, str], Callable[[], Solved]] = {
        ("unitcad", f"rtol {rtol:g}"): partial(_by_unitcad, case, rtol) for rtol in TOLERANCES
    }
    for name in (_LIFTED,) if quick else (_LIFTED, _LEVEL):
        for rtol in (1e-3,) if quick else (1e-3, 1e-6, 1e-9):
            methods[name, f"tolerance {rtol:g}"] = partial(_adaptive, case, rtol, name == _LIFTED)
    for name in peers.FILTERS:
        methods["digital filter", name] = lambda name=name: (known + peers.filtered(f, RADII, name), None)
    for n in (256, 1024) if quick else (256, 1024, 4096, 16384):
        methods["FFTLog", f"{n} points"] = lambda n=n: (known + peers.logarithmic(f, RADII, n), None)
    for n in (300, 3000) if quick else (300, 3000, 30000, 300000):
        methods["uniform k", f"{n} points"] = lambda n=n: (known + peers.uniform(f, RADII, n), None)
    return methods


def _by_unitcad(case: Case, rtol: float, r: np.ndarray = RADII) -> Solved:
    response = case.medium.response(DISC, case.omega, r, rtol=rtol)
    return response.u_z, response.error


def _adaptive(case: Case, rtol: float, lifted: bool) -> Solved:
    scale = float(np.max(np.abs(case.known)))
    value, error = peers.adaptive(case.remainder, RADII, rtol * scale, lifted)
    return case.known + value, error

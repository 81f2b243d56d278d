"""The Hankel integral of a medium's compliance along a path of panels, with a bound on its error.

Composite Gauss-Legendre (`quadrature`); a panel whose last Legendre coefficients have not died is halved towards the
pole that they show, or goes around it. Each row of the load's kernel meets the Bessel function of its own order. The
static half-space of one of the layers, known in closed form, is taken out first. What is left beyond the end of the
path is bounded by the kernel itself, sampled there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered.loads import UniformDisc, bessel_bounds, static_kernel
from unitcad.attenuation.layered.propagation import Array, Material
from unitcad.attenuation.layered.quadrature import (
    MAX_PANELS,
    PHASE,
    Evaluated,
    Poles,
    Problem,
    around,
    closeness,
    cut_pieces,
    evaluate,
    from_origin,
    halve_towards,
    nodes,
    onwards,
    poles,
)
from unitcad.errors import UnitcadError

_PER_DECADE = 8
_LOOSE = 1e-4
"""rtol from which on a tail stops early, so that half as many wavenumbers show the far part."""
_FALLING = 30.0
"""Over the first wavenumber, and over the thinnest layer's thickness: beyond both a kernel falls off as a power."""
_MARGIN = 1.5
_SOON = 10.0
"""Over the first wavenumber: if a tail may stop there by the top layer's half-space, no other one is tried."""


@dataclass(frozen=True)
class Tail:
    """bounds[..., i]: the integrals of the kernel's rows from k[i] to infinity are at most that.

    In m per pascal, shape (rows, radii, wavenumbers). reference: the static half-space to be taken out.
    """

    k: np.ndarray
    bounds: np.ndarray
    reference: Material
    scale: float  # a first guess of the largest displacement

    def start(self, tolerance: float) -> float:
        """Return the least wavenumber (1/m) beyond which less than 0.4 of the tolerance is missing, or the last one."""
        good = self.bounds.max(axis=(0, 1)) <= 0.4 * tolerance
        return float(self.k[np.argmax(good)] if good.any() else self.k[-1])

    def bound(self, stop: float) -> np.ndarray:
        """Return the bounds from a `stop` (1/m) on, not before the first of `k`; shape (rows, radii)."""
        return self.bounds[..., self.k.searchsorted(stop, side="right") - 1]


def grid(load: UniformDisc, r: np.ndarray, end: float, thinnest: float, affordable: float, rtol: float) -> np.ndarray:
    """Return the wavenumbers (1/m), from beyond the last pole on, at which the kernel is sampled to bound its tail.

    thinnest: thickness of a layer (m); affordable: the last wavenumber to which a path may go. It is one of them where
    they reach beyond it.
    """
    lengths = [x for x in (load.radius, float(r.max())) if x > 0]
    first = max(1.4 * end, 1e-3 / max(lengths))
    last = max(1e5 * first, 1e5 / min(lengths))
    far = min(max(_FALLING * first, _FALLING / thinnest), 0.1 * last)
    near_decades, far_decades = np.log10([far / first, last / far])
    near = np.linspace(0.0, near_decades, int(_PER_DECADE * near_decades) + 2)
    per_decade = _PER_DECADE / 2 if rtol >= _LOOSE else _PER_DECADE
    beyond = near_decades + np.linspace(0.0, far_decades, int(np.ceil(per_decade * far_decades)) + 1)
    k = first * 10.0 ** np.concatenate([near, beyond[1:]])
    return np.union1d(k, affordable) if k[0] < affordable < k[-3] else k


def measure_tail(
    k: np.ndarray,
    raw: Array,
    materials: tuple[Material, ...],
    load: UniformDisc,
    r: np.ndarray,
    static: np.ndarray,
    far: float,
    rtol: float,
    largest: float = np.inf,
) -> Tail:
    """Bound the tail by the kernel on its `grid` k; choose the static half-space that leaves the least.

    raw (rows, wavenumbers): the kernel, nothing taken out; static: the load's integrals, shape (rows, radii); far: the
    last wavenumber (1/m) that can be afforded; largest: displacement, if known. Two bounds, the lower one counts: the
    envelope of the Bessel functions, and, where the kernel falls off, integration by parts against their oscillation.
    """
    within = max(1, int(k.searchsorted(far, side="right")))
    # As on a half-space of the compliance at the wavenumber of the load's size: the disc does not rest on a film alone.
    at = min(int(k.searchsorted(1.0 / max(load.radius, float(r.min())))), k.size - 1)
    scale = min(float((np.abs(static).max(axis=1) * np.abs(raw[:, at])).max()), largest)

    def tail(material: Material, radii: np.ndarray = r) -> Tail:
        less = raw - static_kernel(material, load.direction)[:, None]
        return Tail(k[:within], _bounds(k, less, load, radii)[..., :within], material, scale)

    top = tail(materials[0])
    if top.start(rtol * scale) <= _SOON * k[0]:
        return top
    few = np.array([r.min(), r[np.argmin(np.abs(r - load.radius))], r.max()])
    choice = [tail(material, few) for material in dict.fromkeys(reversed(materials)) if material.shear != 0]
    best = min(choice, key=lambda one: _left(one, rtol)).reference
    return top if best == materials[0] else tail(best)


def _left(tail: Tail, rtol: float) -> tuple[float, float, float]:
    """Return the rest at its end, of which nothing below the tolerance is better, and the end's wavenumber.

    Among equals the one that leaves the least: the scale may have been guessed too large.
    """
    stop = tail.start(rtol * tail.scale)
    rest = float(tail.bound(stop).max())
    return max(rest, 0.4 * rtol * tail.scale), stop, rest


_NONE = 1e250
"""In place of infinity, which times 0 is no number."""


def _bounds(k: np.ndarray, kernel: Array, load: UniformDisc, r: np.ndarray) -> np.ndarray:
    """Return the bounds from each wavenumber on, shape (rows, radii, wavenumbers), of a kernel (rows, wavenumbers).

    By the envelope of the waves, summed by the trapezoidal rule; and by parts, from where the waves oscillate, with
    four over the distance from the edge.
    """
    phase = r[:, None] * k
    envelope = _MARGIN * load.envelope(k) * bessel_bounds(load.orders, phase)
    before = np.concatenate([[0.0], np.diff(k)]) / 2.0
    after = np.concatenate([np.diff(k), [0.0]]) / 2.0
    distance = np.maximum(np.abs(r - load.radius), 1e-12 * (r + load.radius) + 1e-300)
    oscillating = (phase > 3.0) & (k * load.radius > 3.0)
    size = np.abs(kernel)
    variation = size.copy()
    variation[:, :-1] += _summed_from_right(np.abs(np.diff(kernel)))
    weighted = size[:, None] * envelope
    by_envelope = _summed_from_right(weighted * (before + after)) - weighted * before
    by_envelope += _beyond(k, weighted[..., -3::2])
    by_parts = np.where(oscillating, envelope * (4.0 / distance)[:, None], _NONE)
    return np.minimum(by_envelope, variation[:, None] * by_parts)


def _summed_from_right(f: np.ndarray) -> np.ndarray:
    return f[..., ::-1].cumsum(axis=-1)[..., ::-1]


def _beyond(k: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Integrate a tail that falls as k^-1.5, or as fast as from the last wavenumber but two to the last one."""
    least = np.maximum(ends, 1e-300)
    power = np.log(least[..., :1] / least[..., 1:]) / np.log(k[-1] / k[-3])
    return ends[..., 1:] * (k[-1] / np.maximum(power - 1.0, 1e-3))


_MAX_ROUNDS = 40
_PHASE_RTOL = 1e-8
"""From which on pieces are of `PHASE`: there the rule is off by some 1e-9 of the waves over a piece."""
_FIRST_PIECES = 32
_AWAY = 2.0
"""Of a panel's half: the distance of a pole that leaves few of the last coefficients."""
_CLEAR = 0.3
"""Of a pole's distance from its panel: how uncertain it may be where it says how far to halve."""
_MOST_TIMES = 9
_PANELS_SHARE = 0.3
"""Share of the tolerance for the error of all panels together. The tail may have 0.4."""
_DETOURS_SHARE = 0.25
"""Share of the tolerance for the error of all detours together, in addition to that of their panels.

Panels are only ever halved, so those of a tighter tolerance are pieces of those of a looser one. The tighter one takes
the looser one's detours too, unless their error exceeds this: its panels then have 0.3 / 0.25 of that at most.
"""
_WORTH = 0.2
"""Share of the error that another attempt must be able to gain.

A tighter rtol that is not reached then is at most 1.25 times worse than a looser one, but for rare media: one of 2,000
random ones was 2.5 times worse.
"""


@dataclass(frozen=True)
class Integrals:
    """A row an order of the load at each radius, shape (rows, n), and a bound of its error.

    cut_short: the error is dominated by round-off, or by the tail beyond the affordable wavenumbers; exhausted: there
    were panels left to be halved.
    """

    total: np.ndarray
    error: np.ndarray
    wavenumbers: int
    cut_short: bool
    exhausted: bool


def overflow(omega: float) -> UnitcadError:
    return UnitcadError(f"no finite answer at omega = {omega:g} rad/s: a number overflows on the way")


def integrate(bare: Problem, end: float, rtol: float, largest: float) -> Integrals:
    """Integrate to rtol times the largest |u| that is met on the way, or times `largest`, where that is less.

    |u|: of a row; end: the last pole (1/m).
    """
    load, r = bare.load, bare.r
    materials = bare.medium.materials(bare.omega)
    span = float(r.max()) + load.radius
    far = PHASE / span * MAX_PANELS * 5 / 6  # the others are there to be halved: a tail cut short says so
    thinnest = min((layer.thickness for layer in bare.medium.layers), default=np.inf)
    beyond = grid(load, r, end, thinnest, far, rtol)
    # The tail is not known yet: as far as it is from a disc on skin, and no farther than some panels go.
    aim = min(max(end, PHASE / span / 8.0) * rtol**-0.2, end + _FIRST_PIECES * PHASE / span)
    stop = float(max(aim, beyond[0]))
    pending = from_origin(end, stop, span, materials)
    static = load.static(r)
    tail = measure_tail(beyond, bare.kernel(beyond + 0j), materials, load, r, static, far, rtol, largest)
    least = float(tail.bounds[..., -1].max())

    def tolerance(size: float) -> float:
        return max(rtol * min(size, largest), 0.3 * least)  # no halving below the error of the tail

    problem = replace(bare, reference=tail.reference)
    phase = PHASE * min(1.0, (rtol / _PHASE_RTOL) ** (1 / 32))
    known = problem.taken_out[:, None] * static
    rounded = np.abs(problem.taken_out).max() * load.static_rounding(r)
    total, quadrature, size = np.zeros_like(known), np.zeros(known.shape), np.zeros(known.shape)
    skipped = np.zeros(known.shape)  # by the detours
    count, done, exhausted, gained = beyond.size, 0, False, 0.0
    put_off = _PutOff.none(len(pending), known.shape)
    for left in range(_MAX_ROUNDS, -1, -1):
        kernel = _sampled(problem, pending)
        found = evaluate(problem, pending, kernel, phase)
        if not np.isfinite(found.parts).all():
            raise overflow(bare.omega)
        count += kernel[0].size
        whole = np.abs(known + total + found.parts.sum(axis=0))
        off = quadrature + found.errors.sum(axis=0)
        wanted = tolerance(float(whole.max()) or 1.0)
        done += len(pending)
        limit = _PANELS_SHARE * wanted / done
        if left == 0 or off.max() <= _PANELS_SHARE * wanted:
            bad, good, due = np.zeros(len(pending), bool), np.ones(len(pending), bool), np.arange(0)
        else:
            bad, good, due, short = _cuts(found, put_off, limit, MAX_PANELS - done)
            exhausted = exhausted or short
        total = total + found.parts[good].sum(axis=0)
        quadrature += found.errors[good].sum(axis=0)
        size += found.sizes[good].sum(axis=0)
        gained += float(found.gains[good].sum())
        if np.all(good):
            further = tail.start(tolerance(float(np.abs(known + total).max())))
            # Panels that do not suffice for halving may still do for a tail that leaves more.
            spent = done > MAX_PANELS or (exhausted and tail.bound(stop).max() <= (quadrature + skipped).max())
            exhausted = exhausted or bool(further > stop and spent)
            if further <= stop or spent or left == 0:
                break
            pending = onwards(stop, further, span)
            put_off = _PutOff.none(len(pending), known.shape)
            stop = further
            continue
        sure = tolerance(float(np.max(whole - off - skipped)))  # next to a pole |u| is at first far too large
        left_out = _DETOURS_SHARE * sure - float(skipped.max())
        now, later, pieces = _detours(problem, pending, found, bad, limit, left_out, span)
        skipped += found.hidden[now].sum(axis=0)
        quadrature += put_off.hidden[due].sum(axis=0)
        turned = np.concatenate([pieces[now], put_off.pieces[due]]).reshape(-1, 4)
        halves = bad & ~now
        times = np.where(later, 1, _times(found))[halves]
        cut, origin = halve_towards(pending[halves], found.poles.at[halves], times)
        of = np.where(later, np.cumsum(later) - 1, -1)[halves][origin]
        pending = np.concatenate([cut, turned])
        put_off = _PutOff(np.append(of, np.full(len(turned), -1)), pieces[later], found.hidden[later])
    rest = tail.bound(stop)
    error = quadrature + skipped + rest + 4e-15 * size + rounded
    cut_short = gained + float(skipped.max() + rest.max()) - least < _WORTH * float(np.max(error))
    return Integrals(known + total, error, count, cut_short, exhausted)


def _times(found: Evaluated) -> np.ndarray:
    """Return how often each panel is to be halved towards its pole until that is not much nearer than `_AWAY`, (n,).

    Once if no single pole is seen, or if so many times would not suffice: a detour may serve, and panels too
    short for it keep more of its rounding. No tolerance is in it: those of a tighter
    rtol stay pieces of a looser one's.
    """
    at = found.poles.at
    away = np.maximum(np.abs(at - np.clip(at.real, -1.0, 1.0)), 1e-9)
    times = np.floor(np.log2(_AWAY / away))
    within = (found.poles.uncertainty < _CLEAR * away) & (times > 1) & (times <= _MOST_TIMES)
    return np.where(within, times, 1).astype(int)


def _cuts(
    found: Evaluated, put_off: _PutOff, limit: float, panels: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Choose the panels that gain more than `limit` by being cut, as far as `panels` in all suffice, the worst first.

    Return which are bad, which are good, which detours are due, and whether some bad ones are taken as good. A panel in
    whose place a detour is due is neither.
    """
    bad = found.gains > limit
    due = put_off.due(found, bad)
    dropped = np.isin(put_off.of, due)
    bad &= ~dropped
    room, short = max(panels // 4, 0), False  # quarters of them remain
    if np.count_nonzero(bad) > room:
        bad[np.argsort(np.where(bad, -found.gains, 0.0))[room:]], short = False, True
    return bad, ~(bad | dropped), due, short


class _PutOff(NamedTuple):
    """Detours that would leave out more than is wanted: their panels were cut instead.

    of (panels,): the detour in whose place a panel is, or -1; pieces (detours, 4, 4); hidden (detours, rows, radii).
    """

    of: np.ndarray
    pieces: Array
    hidden: np.ndarray

    @classmethod
    def none(cls, panels: int, shape: tuple[int, ...]) -> _PutOff:
        return cls(np.full(panels, -1), np.empty((0, 4, 4)), np.empty((0, *shape)))

    def due(self, found: Evaluated, bad: np.ndarray) -> np.ndarray:
        """Return those to take after all: the worst panel in their place is bad and would leave out no less.

        The rest of its last coefficients is rounding, which grows with each halving.
        """
        if not len(self.hidden):
            return np.arange(0)
        most = found.hidden.max(axis=(1, 2))
        worst = [np.argmax(np.where(self.of == i, found.gains, -1.0)) for i in range(len(self.hidden))]
        no_less = [bad[i] and most[i] >= hidden.max() for i, hidden in zip(worst, self.hidden, strict=True)]
        return np.flatnonzero(no_less)


def _detours(
    problem: Problem, panels: Array, found: Evaluated, bad: np.ndarray, enough: float, left: float, span: float
) -> tuple[np.ndarray, np.ndarray, Array]:
    """Return which of the `bad` panels go around a pole, which only if halving does not help, and the pieces of both.

    enough: error permitted to any detour; left: error permitted to the others together, the least ones first;
    pieces: shape (panels, 4, 4).
    """
    hidden = found.hidden.max(axis=(1, 2))
    now = hidden <= enough
    clear = bad & ((hidden <= max(enough, left)) | found.blurred) & (panels[:, :2].imag == 0).all(axis=1)

    def lossier(panel: Array, loss: float) -> Poles:
        lossy = replace(problem, medium=problem.medium.with_loss(loss))
        return poles(_sampled(lossy, panel[None]), closeness(panel[None]))

    at = np.flatnonzero(clear)
    of = Poles(found.poles.at[at], found.poles.uncertainty[at], found.poles.rest[:, at])
    turned, corners = around(panels[at], of, 1.0 / span, lossier)
    which = np.zeros_like(bad)
    which[at[turned]] = True
    pieces = np.zeros((len(panels), 4, 4), dtype=np.complex128)
    pieces[which] = cut_pieces(panels[which], corners).reshape(-1, 4, 4)
    beyond = np.flatnonzero(which & ~now)
    beyond = beyond[np.argsort(hidden[beyond])]
    now[beyond[np.cumsum(hidden[beyond]) <= left]] = True
    return which & now, which & ~now & found.blurred, pieces


def _sampled(problem: Problem, panels: Array) -> Array:
    """Return the kernel with dk/ds at each panel's nodes, shape (rows, panels, nodes)."""
    k, slope = nodes(panels)
    return problem.kernel(k.ravel()).reshape(-1, *k.shape) * slope

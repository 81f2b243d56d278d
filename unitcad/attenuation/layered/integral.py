"""The end of a Hankel integral: a bound of the tail beyond each wavenumber, measured on the kernel itself.

The Hankel integral of a medium's compliance along a path of panels, with a bound on its error.

Composite Gauss-Legendre (`quadrature`); a panel whose last Legendre coefficients have not died is halved towards the
pole that they show, or goes around it. Each row of the load's kernel meets the Bessel function of its own order. At the
surface the static half-space of one of the layers, known in closed form, is taken out first. The bound of the tail and
the first panels are sampled in one call: most of a call's time does not depend on the number of wavenumbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered.loads import Load, bessel_bounds, kept, static_kernels
from unitcad.attenuation.layered.medium import Stack
from unitcad.attenuation.layered.propagation import Array, Material
from unitcad.attenuation.layered.quadrature import (
    MAX_PANELS,
    NODES,
    PHASE,
    Evaluated,
    Poles,
    around,
    evaluate,
    first_nodes,
    from_origin,
    halved_towards,
    nodes,
    onwards,
    panel_poles,
    pieced,
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

    In m per pascal or newton, shape (rows, radii, wavenumbers). references: the static half-space to be taken out of
    the rows of each body.
    """

    k: np.ndarray
    bounds: np.ndarray
    references: tuple[Material | None, ...]
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
    far = min(max(_FALLING * first, _FALLING / thinnest), 0.1 * last)
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
    raw: Array,
    materials: tuple[Material, ...],
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
    # As on a half-space of the compliance at the wavenumber of the load's size: the disc does not rest on a film alone.
    at = min(int(k.searchsorted(1.0 / max(loads[0].reach, float(r.min())))), k.size - 1)
    scale = min(float((np.abs(static).max(axis=1) * np.abs(raw[:, at])).max()), largest)
    directions = tuple(load.direction for load in loads)

    def less(material: Material) -> Array:
        return raw - static_kernels(material, directions)[:, None]

    def tail(material: Material) -> Tail:
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
    """Return the rest at its end, of which nothing below the tolerance is better, and the end's wavenumber.

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


def _bounds(k: np.ndarray, kernels: Array, loads: Sequence[Load], r: np.ndarray) -> np.ndarray:
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
    """Integrate a tail that falls as k^-1.5, or as fast as from the last wavenumber but two to the last one."""
    least = np.maximum(ends, 1e-300)
    power = np.log(least[..., :1] / least[..., 1:]) / np.log(k[-1] / k[-3])
    return ends[..., 1:] * (k[-1] / np.maximum(power - 1.0, 1e-3))


_MAX_ROUNDS = 40
_MOST_SAMPLES = 8_192  # kernel values worked out at once
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
random ones was 2.5 times worse (`random_media.trial("extreme contrast", 90143)`).
"""


@dataclass(frozen=True)
class Body:
    """A medium at omega (rad/s), and the static half-space that was taken out, None below the surface."""

    medium: Stack
    omega: float
    reference: Material | None = None


@dataclass(frozen=True)
class Problem:
    """Bodies under loads that differ in their directions only, seen at radii r (m), shape (n,), and depth z (m).

    One path for all: bodies are alike, and poles on the axis are one body's. Rows: of each body those of each load.
    """

    bodies: tuple[Body, ...]
    loads: tuple[Load, ...]
    r: np.ndarray
    z: float

    @property
    def load(self) -> Load:
        return self.loads[0]

    @property
    def orders(self) -> tuple[int, ...]:
        return tuple(order for load in self.loads for order in load.orders)

    def kernel(self, k: Array) -> Array:
        """Return k C(k), less the static one, a row an order of each load; the loads' transform is not in it."""
        chunks = [k[first : first + _MOST_SAMPLES] for first in range(0, k.size, _MOST_SAMPLES)]
        rows = [np.concatenate([self._compliance(body, some) for body in self.bodies]) for some in chunks]
        kernel = k * np.concatenate(rows, axis=1)
        return self.less_static(kernel) if self.bodies[0].reference else kernel

    def less_static(self, kernel: Array) -> Array:
        """Return a kernel of which nothing was taken out, shape (rows, n), less the static one."""
        return kernel - self.taken_out[:, None]

    def _compliance(self, body: Body, k: Array) -> Array:
        ways = [1 if load.direction == "normal" else 0 for load in self.loads]
        columns = sorted(set(ways))
        u = body.medium.transfer(columns, k, body.omega, self.z)
        rows = []
        for load, way in zip(self.loads, ways, strict=True):
            u_r, u_z = u[:, columns.index(way)]
            if load.direction == "tangential":
                u_theta = body.medium.shear_transfer(k, body.omega, self.z)
                rows += [(u_r + u_theta) / 2.0, (u_r - u_theta) / 2.0, u_z]
            else:
                rows += [u_r, u_z]
        return np.array(rows)

    @cached_property
    def taken_out(self) -> Array:
        """The static kernel that was taken out, shape (rows,)."""
        directions = tuple(load.direction for load in self.loads)
        if not self.bodies[0].reference:
            return np.zeros(len(self.orders) * len(self.bodies))
        return np.concatenate([static_kernels(body.reference, directions) for body in self.bodies if body.reference])

    def static_part(self, static: np.ndarray, rounding: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the part taken out, shape (rows, n), and a bound of its rounding, for both of a body's loads."""
        kernel = self.taken_out.reshape(len(self.bodies), -1, 1)
        rounded = np.abs(kernel).max(axis=1, keepdims=True) * rounding
        return (kernel * static).reshape(-1, self.r.size), rounded.reshape(-1, self.r.size)


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

    |u|: of a row.
    """
    load, r, z = bare.load, bare.r, bare.z
    each = tuple(body.medium.materials(body.omega) for body in bare.bodies)
    span = float(r.max()) + load.reach + 2.0 * z
    far = PHASE / span * MAX_PANELS * 5 / 6  # the others are there to be halved: a tail cut short says so
    thinnest = min((layer.thickness for body in bare.bodies for layer in body.medium.layers), default=np.inf)
    opening = _opening(bare.loads, r, z, end, rtol, span, each, thinnest, far)
    beyond, pending, slope, stop = opening.beyond, opening.panels, opening.slope, float(opening.stop[0])
    raw = bare.kernel(opening.k)
    by_body = raw[:, : beyond.size].reshape(len(each), -1, beyond.size)
    tail = joined(
        [
            measure_tail(beyond, rows, some, bare.loads, r, opening.static if z == 0.0 else None, far, rtol, largest)
            for rows, some in zip(by_body, each, strict=True)
        ]
    )
    least = float(tail.bounds[..., -1].max())

    def tolerance(size: float) -> float:
        return max(rtol * min(size, largest), 0.3 * least)  # no halving below the error of the tail

    referred = zip(bare.bodies, tail.references, strict=True)
    bodies = tuple(Body(body.medium, body.omega, reference) for body, reference in referred)
    problem = Problem(bodies, bare.loads, r, z)
    kernel = problem.less_static(raw[:, beyond.size :]).reshape(-1, *slope.shape) * slope
    phase = PHASE * min(1.0, (rtol / _PHASE_RTOL) ** (1 / 32))
    known, rounded = problem.static_part(opening.static, opening.rounding)
    total, quadrature, size = np.zeros_like(known), np.zeros(known.shape), np.zeros(known.shape)
    skipped = np.zeros(known.shape)  # by the detours
    count, done, exhausted, gained = beyond.size, 0, False, 0.0
    settled: list[Evaluated] = []
    put_off = _PutOff.none(len(pending), known.shape)
    for left in range(_MAX_ROUNDS, -1, -1):
        found = evaluate(problem, pending, kernel, phase)
        if not np.isfinite(found.total).all():
            raise overflow(bare.bodies[0].omega)
        count += slope.size
        whole, off = np.abs(known + total + found.total), quadrature + found.error
        wanted = tolerance(float(whole.max()) or 1.0)
        done += len(pending)
        limit = _PANELS_SHARE * wanted / done
        good_enough = left == 0 or off.max() <= _PANELS_SHARE * wanted
        cuts = None if good_enough else _cuts(found, put_off, limit, MAX_PANELS - done)
        exhausted = exhausted or (cuts is not None and cuts.short)
        if cuts is None or np.all(cuts.good):
            total = total + found.total
            quadrature += found.error
            size += found.size
            settled.append(found)
            further = tail.start(tolerance(float(np.abs(known + total).max())))
            # Panels that do not suffice for halving may still do for a tail that leaves more.
            spent = done > MAX_PANELS or (exhausted and tail.bound(stop).max() <= (quadrature + skipped).max())
            exhausted = exhausted or bool(further > stop and spent)
            if further <= stop or spent or left == 0:
                break
            pending = onwards(stop, further, span)
            put_off = _PutOff.none(len(pending), known.shape)
            stop = further
        else:
            bad, good, due = cuts.bad, cuts.good, cuts.due
            total = total + found.each.parts[good].sum(0)
            quadrature += found.errors[good].sum(0)
            size += found.sizes[good].sum(0)
            gained += float(found.gains[good].sum())
            sure = tolerance(float(np.max(whole - off - skipped)))  # next to a pole |u| is at first far too large
            left_out = _DETOURS_SHARE * sure - float(skipped.max())
            now, later, pieces = _detours(problem, pending, found, bad, limit, left_out, span)
            skipped += found.hidden[now].sum(0)
            quadrature += put_off.hidden[due].sum(0)
            turned = np.concatenate([pieces[now], put_off.pieces[due]]).reshape(-1, 4)
            halves = bad & ~now
            times = np.where(later, 1, _times(found))[halves]
            cut, origin = halved_towards(pending[halves], found.poles.at[halves], times)
            of = np.where(later, np.cumsum(later) - 1, -1)[halves][origin]
            pending = np.concatenate([cut, turned])
            put_off = _PutOff(np.append(of, np.full(len(turned), -1)), pieces[later], found.hidden[later])
        k, slope = nodes(pending, NODES)
        kernel = problem.kernel(k.ravel()).reshape(-1, *k.shape) * slope
    rest = tail.bound(stop)
    error = quadrature + skipped + rest + 4e-15 * size + rounded
    total = known + total
    cut_short = False
    if not error.max() <= rtol * np.abs(total).max():  # never read if it is reached
        gained += sum(float(found.gains.sum()) for found in settled)
        cut_short = gained + float(skipped.max() + rest.max()) - least < _WORTH * float(np.max(error))
    return Integrals(total, error, count, cut_short, exhausted)


class _Opening(NamedTuple):
    """Start of a path: the samples of its tail, its first panels, and their end.

    beyond (n,), the wavenumbers (1/m) of the tail's samples; panels; k, these wavenumbers and those of the panels'
    nodes; slope (panels, nodes); stop, of shape (1,); static, rounding (rows, radii), the loads' static integrals and
    bounds of their rounding over a body's kernel, 0 below the surface.
    """

    beyond: np.ndarray
    panels: Array
    k: Array
    slope: Array
    stop: np.ndarray
    static: np.ndarray
    rounding: np.ndarray


@kept
def _opening(
    loads: tuple[Load, ...],
    r: np.ndarray,
    z: float,
    end: float,
    rtol: float,
    span: float,
    bodies: tuple[tuple[Material, ...], ...],
    thinnest: float,
    far: float,
) -> _Opening:
    beyond = grid(loads[0], r, z, end, thinnest, far, rtol)
    stop = _first_stop(beyond, end, rtol, PHASE / span)
    panels = from_origin(end, stop, span, tuple(material for body in bodies for material in body))
    k, slope = nodes(panels, max(first_nodes(rtol, end, span, body[:-1], body[-1]) for body in bodies))
    if z > 0.0:
        static = rounding = np.zeros((sum(len(load.orders) for load in loads), r.size))
    else:
        static = np.concatenate([load.static(r) for load in loads])
        rounding = np.concatenate([load.static_rounding(r) for load in loads])
    return _Opening(beyond, panels, np.concatenate([beyond, k.ravel()]), slope, np.array([stop]), static, rounding)


def _first_stop(beyond: np.ndarray, end: float, rtol: float, longest: float) -> float:
    """Return how far (1/m), not before the first of `beyond`, the path goes at first: the tail is not known yet.

    As far as it is from a disc on skin, and no farther than some panels of the `longest` go.
    """
    aim = min(max(end, longest / 8.0) * rtol**-0.2, end + _FIRST_PIECES * longest)
    return float(max(aim, beyond[0]))


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


def _worst(errors: np.ndarray, bad: np.ndarray, room: int) -> np.ndarray:
    """Return the `room` worst ones of the `bad` panels."""
    if np.count_nonzero(bad) <= room:
        return bad
    worst = np.zeros_like(bad)
    worst[np.argsort(np.where(bad, -errors, 0.0))[: max(room, 0)]] = True
    return worst


class _Cuts(NamedTuple):
    """Which panels are bad, which are good, and which detours are due; short: whether some bad ones are taken as good.

    A panel in whose place a detour is due is neither.
    """

    bad: np.ndarray
    good: np.ndarray
    due: np.ndarray
    short: bool


def _cuts(found: Evaluated, put_off: _PutOff, limit: float, panels: int) -> _Cuts:
    """Choose the panels that gain more than `limit` by being cut, as far as `panels` in all suffice."""
    bad = found.gains > limit
    due = put_off.due(found, bad)
    dropped = np.isin(put_off.of, due) if due.size else np.zeros_like(bad)
    bad &= ~dropped
    room = panels // 4  # quarters of them remain
    some = _worst(found.gains, bad, room)
    return _Cuts(some, ~(some | dropped), due, bool(np.count_nonzero(bad) > room))


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
        bodies = (replace(body, medium=body.medium.with_loss(loss)) for body in problem.bodies)
        lossy = replace(problem, bodies=tuple(bodies))
        return panel_poles(panel[None], _sampled(lossy, panel[None]))

    at = np.flatnonzero(clear)
    of = Poles(found.poles.at[at], found.poles.uncertainty[at], found.poles.rest[:, at])
    turned, corners = around(panels[at], of, 1.0 / span if span > 0 else np.inf, lossier)
    which = np.zeros_like(bad)
    which[at[turned]] = True
    pieces = np.zeros((len(panels), 4, 4), dtype=np.complex128)
    pieces[which] = pieced(panels[which], corners).reshape(-1, 4, 4)
    beyond = np.flatnonzero(which & ~now)
    beyond = beyond[np.argsort(hidden[beyond])]
    now[beyond[np.cumsum(hidden[beyond]) <= left]] = True
    return which & now, which & ~now & found.blurred, pieces


def _sampled(problem: Problem, panels: Array) -> Array:
    """Return the kernel with dk/ds at each panel's nodes, shape (rows, panels, nodes)."""
    k, slope = nodes(panels, NODES)
    return problem.kernel(k.ravel()).reshape(-1, *k.shape) * slope

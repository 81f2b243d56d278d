"""The Hankel integral of a medium's compliance along a path of panels, with a bound on its error.

Composite Gauss-Legendre on panels in proportion to the oscillation; a panel whose last Legendre coefficients have not
died is halved, or goes around the pole that is next to it. Each row of the load's kernel meets the Bessel function of
its own order. At the surface the static half-space of one of the layers, known in closed form, is taken out first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bound, bessels
from unitcad.attenuation.layered.detours import HIDDEN, LOST, Poles, around, poles
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.path import MAX_PANELS, PHASE, from_origin, halved, onwards, pieced, wavenumbers
from unitcad.attenuation.layered.stack import Stack
from unitcad.attenuation.layered.statics import static_kernel
from unitcad.attenuation.layered.tail import measure_tail
from unitcad.errors import UnitcadError

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _NODES.size - 1))
_ODD_FACTORIALS = np.array([float(factorial2(2 * (2 * _NODES.size - j) - 1)) for j in range(_NODES.size)])
ROUNDING = 1e-15
"""Of a wavenumber, as the kernel feels it next to a pole."""
_MAX_ROUNDS = 40
_SINGLE = 1e-7
"""Uncertainty of a pole below which a panel has no other, or one that is next to nothing beside it."""
_CHUNK = 200_000  # integrand values held at once
_PANELS_SHARE = 0.3
"""Of the tolerance: what the panels may be off by together. The tail may leave 0.4."""
_DETOURS_SHARE = 0.25
"""Of the tolerance: what detours may leave out together beyond the share of their panels.

Panels are only ever halved, so those of a tighter tolerance are pieces of those of a looser one. The tighter one takes
the looser one's detours too, unless they leave out more than this: its panels then leave 0.3 / 0.25 of that at most.
"""


@dataclass(frozen=True)
class Problem:
    """A medium under a load at omega (rad/s), seen at radii r (m), shape (n,), and depth z (m)."""

    medium: Stack
    load: Load
    omega: float
    r: np.ndarray
    z: float
    reference: w.Material | None = None  # of the static half-space that was taken out; None below the surface

    def kernel(self, k: w.Array) -> w.Array:
        """Return k C(k), less the static one, a row an order of the load; the load's transform is not in it."""
        out = k * self._compliance(k)
        return out - static_kernel(self.reference, self.load.direction)[:, None] if self.reference else out

    def _compliance(self, k: w.Array) -> w.Array:
        traction = np.zeros((2, k.size), dtype=np.complex128)
        traction[1 if self.load.direction == "normal" else 0] = 1.0
        u_r, u_z = self.medium.transfer(traction, k, self.omega, self.z)
        if self.load.direction != "tangential":
            return np.array([u_r, u_z])
        u_theta = self.medium.shear_transfer(k, self.omega, self.z)
        return np.array([(u_r + u_theta) / 2.0, (u_r - u_theta) / 2.0, u_z])

    def static_part(self) -> tuple[np.ndarray, np.ndarray]:
        """Return what was taken out, shape (rows, n), and a bound of its rounding."""
        if self.reference is None:
            shape = (len(self.load.orders), self.r.size)
            return np.zeros(shape, dtype=np.complex128), np.zeros(shape)
        return self.load.static_part(static_kernel(self.reference, self.load.direction), self.r)


@dataclass(frozen=True)
class Integrals:
    """A row an order of the load at each radius, shape (rows, n), and a bound of its error.

    cut_short: most of it is rounding's, or the tail's beyond what can be afforded; exhausted: there were panels left to
    be halved.
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
    materials = bare.medium.materials(bare.omega)
    r_max = float(r.max())
    span = r_max + load.reach + 2.0 * z
    far = PHASE / span * MAX_PANELS * 5 / 6  # the others are there to be halved: a tail cut short says so
    tail = measure_tail(bare.kernel, materials, load, r, z, end, far, rtol, largest)
    least = float(tail.bounds[-1].max())

    def tolerance(size: float) -> float:
        return max(rtol * min(size, largest), 0.3 * least)  # what the tail leaves anyway is worth no halving

    problem = replace(bare, reference=tail.reference)
    known, rounded = problem.static_part()
    total, quadrature, size = np.zeros_like(known), np.zeros(known.shape), np.zeros(known.shape)
    skipped = np.zeros(known.shape)  # by the detours
    count, done, exhausted, gained = 0, 0, False, 0.0
    stop = tail.start(tolerance(tail.scale))
    pending = from_origin(end, stop, span, materials)
    put_off = _PutOff.none(len(pending), known.shape)
    for _ in range(_MAX_ROUNDS):
        found = _evaluate(problem, pending)
        if not np.all(np.isfinite(found.parts)):
            raise overflow(bare.omega)
        count += pending.shape[0] * _NODES.size
        whole, off = np.abs(known + total + found.parts.sum(0)), quadrature + found.errors.sum(0)
        wanted = tolerance(float(np.max(whole)) or 1.0)
        done += pending.shape[0]
        limit = _PANELS_SHARE * wanted / max(done, 1)
        bad = found.gains > limit
        if np.max(off) <= _PANELS_SHARE * wanted:
            bad[:] = False
        due = put_off.due(found, bad)
        dropped = np.isin(put_off.of, due)
        bad &= ~dropped
        room = (MAX_PANELS - done) // 4  # quarters of them are what is left
        exhausted |= np.count_nonzero(bad) > room
        bad = _worst(found.gains, bad, room)
        good = ~(bad | dropped)
        total = total + found.parts[good].sum(0)
        quadrature += found.errors[good].sum(0)
        gained += float(found.gains[good].sum())
        size += found.sizes[good].sum(0)
        if not np.all(good):
            sure = tolerance(float(np.max(whole - off - skipped)))  # beside a pole |u| is at first far too large
            left = _DETOURS_SHARE * sure - float(skipped.max())
            now, later, pieces = _detours(problem, pending, found, bad, limit, left, span)
            skipped += found.hidden[now].sum(0)
            quadrature += put_off.hidden[due].sum(0)
            turned = np.concatenate([pieces[now], put_off.pieces[due]]).reshape(-1, 4)
            halves = bad & ~now
            of = np.repeat(np.where(later, np.cumsum(later) - 1, -1)[halves], 2)
            pending = np.concatenate([halved(pending[halves]), turned])
            put_off = _PutOff(np.append(of, np.full(len(turned), -1)), pieces[later], found.hidden[later])
            continue
        further = tail.start(tolerance(float(np.max(np.abs(known + total)))))
        # Panels that do not suffice for halving may still do for a tail that leaves more.
        spent = done > MAX_PANELS or (exhausted and tail.bound(stop).max() <= (quadrature + skipped).max())
        exhausted |= further > stop and spent
        if further <= stop or spent:
            break
        pending = onwards(stop, further, span)
        put_off = _PutOff.none(len(pending), known.shape)
        stop = further
    else:
        found = _evaluate(problem, pending)
        gained += float(found.gains.sum())
        total, quadrature, size = (
            total + found.parts.sum(0),
            quadrature + found.errors.sum(0),
            size + found.sizes.sum(0),
        )
    rest = tail.bound(stop)
    error = quadrature + skipped + rest + 4e-15 * size + rounded
    most = 0.5 * float(np.max(error))
    cut_short = least > most or gained + float(skipped.max() + rest.max()) - least < most
    return Integrals(known + total, error, count, cut_short, exhausted)


def _worst(errors: np.ndarray, bad: np.ndarray, room: int) -> np.ndarray:
    """Return the `room` worst ones of the `bad` panels."""
    if np.count_nonzero(bad) <= room:
        return bad
    worst = np.zeros_like(bad)
    worst[np.argsort(np.where(bad, -errors, 0.0))[: max(room, 0)]] = True
    return worst


class _Evaluated(NamedTuple):
    """Of each panel, row and radius: the integral, a bound of its error, its absolute size.

    gains: of each panel, the largest part of its error that halving it would lessen; poles: the one of each panel;
    hidden (panels, rows, radii): what a detour around it may leave out; blurred: where that may be rounding's alone.
    """

    parts: np.ndarray
    errors: np.ndarray
    sizes: np.ndarray
    gains: np.ndarray
    poles: Poles
    hidden: np.ndarray
    blurred: np.ndarray


class _PutOff(NamedTuple):
    """Detours that would leave out more than is wanted: their panels were cut instead.

    of (panels,): the detour in whose place a panel is, or -1; pieces (detours, 4, 4); hidden (detours, rows, radii).
    """

    of: np.ndarray
    pieces: w.Array
    hidden: np.ndarray

    @classmethod
    def none(cls, panels: int, shape: tuple[int, ...]) -> _PutOff:
        return cls(np.full(panels, -1), np.empty((0, 4, 4)), np.empty((0, *shape)))

    def due(self, found: _Evaluated, bad: np.ndarray) -> np.ndarray:
        """Return those to take after all: the worst panel in their place is bad and would leave out no less.

        What is left of its last coefficients is rounding, which grows with each halving.
        """
        most = found.hidden.max(axis=(1, 2))
        worst = [np.argmax(np.where(self.of == i, found.gains, -1.0)) for i in range(len(self.hidden))]
        no_less = [bad[i] and most[i] >= hidden.max() for i, hidden in zip(worst, self.hidden, strict=True)]
        return np.flatnonzero(no_less)


def _detours(
    problem: Problem, panels: w.Array, found: _Evaluated, bad: np.ndarray, enough: float, left: float, span: float
) -> tuple[np.ndarray, np.ndarray, w.Array]:
    """Return which of the `bad` panels go around a pole, which only if halving does not help, and the pieces of both.

    enough: what a detour may leave out in any case; left: what those may that leave out more, the least ones first;
    pieces: shape (panels, 4, 4).
    """
    hidden = found.hidden.max(axis=(1, 2))
    now = hidden <= enough
    clear = bad & ((hidden <= max(enough, left)) | found.blurred) & (panels[:, :2].imag == 0).all(axis=1)

    def lossier(panel: w.Array, loss: float) -> Poles:
        return _poles(replace(problem, medium=problem.medium.with_loss(loss)), panel[None])

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


def _poles(problem: Problem, panels: w.Array) -> Poles:
    k, slope, _ = _nodes(panels)
    kernel = problem.kernel(k.ravel()).reshape(-1, *k.shape) * slope
    return poles(kernel, _NODES, _TO_LEGENDRE, _closeness(panels))


def _nodes(panels: w.Array) -> tuple[w.Array, w.Array, w.Array]:
    """Return wavenumbers and their slopes, shape (panels, nodes), and half of each panel in s."""
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    return *wavenumbers(panels, panels[:, :2].mean(1)[:, None] + half[:, None] * _NODES), half


def _closeness(panels: w.Array) -> np.ndarray:
    """Return the wavenumber over half of what a panel covers of it."""
    ends, _ = wavenumbers(panels, panels[:, :2])
    return np.abs(ends).max(axis=1) / (np.abs(ends[:, 1] - ends[:, 0]) / 2.0)


def _evaluate(problem: Problem, panels: w.Array) -> _Evaluated:
    """Integrate over each panel, on the axis or off it."""
    orders = problem.load.orders
    step = max(1, _CHUNK // (_NODES.size * problem.r.size * len(orders)))
    on_axis = (panels[:, :2].imag == 0).all(axis=1)
    chunks = [
        which[first : first + step]
        for which in (np.flatnonzero(on_axis), np.flatnonzero(~on_axis))
        for first in range(0, which.size, step)
    ]
    shape = (len(panels), len(orders), problem.r.size)
    out = _Evaluated(
        np.empty(shape, dtype=np.complex128),
        np.empty(shape),
        np.empty(shape),
        np.empty(len(panels)),
        Poles(np.empty(len(panels), dtype=np.complex128), np.empty(len(panels)), np.empty((len(orders), len(panels)))),
        np.empty(shape),
        np.empty(len(panels), dtype=bool),
    )
    for part in chunks:
        nodes, slope, half = _nodes(panels[part])
        k = nodes.ravel()
        real = k.real if on_axis[part[0]] else k  # Bessel functions of real numbers are cheaper
        waves = bessels(orders, real[:, None] * problem.r) * problem.load.transform(real)[:, None]
        waves = waves.reshape(len(orders), half.size, _NODES.size, -1) * half[:, None, None]
        kernel = problem.kernel(k).reshape(len(orders), half.size, _NODES.size) * slope
        out.parts[part] = products(kernel * _WEIGHTS, waves)
        closeness = _closeness(panels[part])
        found = poles(kernel, _NODES, _TO_LEGENDRE, closeness)
        for whole, values in zip(out.poles, found, strict=True):
            whole[..., part] = values
        out.blurred[part] = found.uncertainty <= np.maximum(_SINGLE, 10.0 * LOST * closeness)
        sizes, errors, gains, covered = _sizes_and_errors(problem, panels[part], kernel, np.abs(waves))
        out.sizes[part], out.errors[part], out.gains[part] = sizes, errors, gains
        out.hidden[part] = HIDDEN * found.rest.T[..., None] * covered
    return out


def products(kernel: w.Array, waves: w.Array) -> w.Array:
    """Sum kernel (rows, panels, nodes) times waves (rows, panels, nodes, radii) over the nodes; (panels, rows, radii).

    By products of real matrices with two rows. A complex row by a matrix is a matrix by a vector to BLAS, which starts
    its threads for each of them from 256 radii on.
    """
    if np.iscomplexobj(waves):
        (re, im), (re_of_i, im_of_i) = (np.moveaxis(_pair(kernel) @ part, 2, 0) for part in (waves.real, waves.imag))
        re, im = re - im_of_i, im + re_of_i
    else:
        re, im = np.moveaxis(_pair(kernel) @ waves, 2, 0)
    return (re + 1j * im).swapaxes(0, 1)


def _pair(values: w.Array) -> np.ndarray:
    """Return the real and the imaginary part, one more axis before the last."""
    return np.stack([values.real, values.imag], axis=2)


def _sizes_and_errors(
    problem: Problem, panels: w.Array, kernel: w.Array, waves: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return, per panel, row and radius, the absolute size of the integral and a bound of its error.

    Per panel: the largest part of the error that halving would lessen. And that of the waves alone.

    kernel (rows, panels, nodes): with dk/ds; waves (rows, panels, nodes, radii): the rest of the integrand, absolute.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within
    six halves: there their envelope takes the place of the weight. Off the axis both grow by e^{|Im k| span}.

    Next to a pole the wavenumber's own rounding, times the kernel's slope of at most itself over the panel, is all that
    is left of the last coefficients: halving does not lessen that.
    """
    n, span = _NODES.size, float(problem.r.max()) + problem.load.reach
    coefficients = np.abs(kernel @ _TO_LEGENDRE.T)
    rest = 2.0 * coefficients[..., -2:].sum(axis=-1)
    ends, slope = wavenumbers(panels, panels[:, :2])
    half = np.abs(panels[:, 1] - panels[:, 0]) / 2.0
    phi = half * np.abs(slope).max(axis=1) * span
    swing = np.zeros_like(rest)
    for j in range(n):  # Horner
        swing = (swing + coefficients[..., j] / _ODD_FACTORIALS[j]) * phi
    swing *= 3.0 * half * phi**n * np.exp(np.abs(ends.imag).max(axis=1) * span)
    least, covers = ends.real.min(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2.0
    far = (least > 6.0 * covers)[:, None]
    at = np.maximum(least, covers)[:, None] / 2.0
    phase = at * problem.r
    wave = 2.0 * problem.load.envelope(at)[:, None] * np.stack([bessel_bound(n, phase) for n in problem.load.orders], 1)
    weight = np.where(far[:, None], wave, problem.load.weight)
    size = np.abs(kernel) * _WEIGHTS
    covered_size = np.stack([size, np.broadcast_to(_WEIGHTS, size.shape)], axis=2) @ waves
    sizes, covered = np.moveaxis(covered_size, (2, 0), (0, 2))
    rounding = ROUNDING * _closeness(panels) * np.abs(kernel).max(axis=-1)
    oscillation = swing.T[..., None] * weight
    gains = 2.0 * np.maximum(rest - rounding, 0.0).T[..., None] * covered + oscillation
    errors = 2.0 * np.maximum(rest, rounding).T[..., None] * covered + oscillation
    return sizes, errors, gains.max(axis=(1, 2)), covered

"""The Hankel integral of a medium's compliance along the real axis, with a bound on its error.

Composite Gauss-Legendre on panels in proportion to the oscillation; a panel whose last Legendre coefficients have not
died is halved. Each row of the load's kernel meets the Bessel function of its own order. At the surface the static
half-space of one of the layers, known in closed form, is taken out first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel_bound, bessels
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.stack import Stack
from unitcad.attenuation.layered.statics import static_kernel
from unitcad.attenuation.layered.tail import measure_tail
from unitcad.errors import UnitcadError

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _NODES.size - 1))
_ODD_FACTORIALS = np.array([float(factorial2(2 * (2 * _NODES.size - j) - 1)) for j in range(_NODES.size)])
PHASE = 8.0 * np.pi
"""Of the fastest Bessel product over one panel."""
ROUNDING = 1e-15
"""Of a wavenumber, as the kernel feels it next to a pole."""
_LEAST_PANELS = 6  # up to the last pole
_MAX_PANELS = 40_000
_MAX_ROUNDS = 40
_CHUNK = 200_000  # integrand values held at once


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
    far = PHASE / span * _MAX_PANELS * 5 / 6  # the others are there to be halved: a tail cut short says so
    tail = measure_tail(bare.kernel, materials, load, r, z, end, far, rtol, largest)
    least = float(tail.bounds[-1].max())
    rtol = max(rtol, 0.3 * least / (tail.scale or 1.0))  # what the tail leaves anyway is worth no halving
    problem = replace(bare, reference=tail.reference)
    known, rounded = problem.static_part()
    total, quadrature, size = np.zeros_like(known), np.zeros(known.shape), np.zeros(known.shape)
    count, done, exhausted, gained = 0, 0, False, 0.0
    stop = tail.start(tail.scale, rtol)
    pending = _graded(_panels(end, stop, span), materials)
    for _ in range(_MAX_ROUNDS):
        parts, errors, absolute, gains = _evaluate(problem, pending)
        if not np.all(np.isfinite(parts)):
            raise overflow(bare.omega)
        count += pending.shape[0] * _NODES.size
        scale = min(float(np.max(np.abs(known + total + parts.sum(0)))) or 1.0, largest)
        done += pending.shape[0]
        limit = 0.3 * rtol * scale / max(done, 1)
        bad = gains > limit
        if np.max(quadrature + errors.sum(0)) <= 0.4 * rtol * scale:
            bad[:] = False
        room = (_MAX_PANELS - done) // 4  # quarters of them are what is left
        exhausted |= np.count_nonzero(bad) > room
        bad = _worst(gains, bad, room)
        total = total + parts[~bad].sum(0)
        quadrature += errors[~bad].sum(0)
        gained += float(gains[~bad].sum())
        size += absolute[~bad].sum(0)
        if np.any(bad):
            far_off = bad & (gains > 1e3 * limit)
            pending = np.concatenate([_cut(pending[bad & ~far_off], 2), _cut(pending[far_off], 4)])
            continue
        wanted = tail.start(min(float(np.max(np.abs(known + total))), largest), rtol)
        exhausted |= wanted > stop and done > _MAX_PANELS
        if wanted <= stop or exhausted:
            break
        pending = _panels(0.0, wanted, span, start=stop)
        stop = wanted
    else:
        parts, errors, absolute, gains = _evaluate(problem, pending)
        gained += float(gains.sum())
        total, quadrature, size = total + parts.sum(0), quadrature + errors.sum(0), size + absolute.sum(0)
    rest = tail.bound(stop)
    error = quadrature + rest + 4e-15 * size + rounded
    most = 0.5 * float(np.max(error))
    cut_short = least > most or gained + float(rest.max()) - least < most
    return Integrals(known + total, error, count, cut_short, exhausted)


def _graded(panels: np.ndarray, materials: tuple[w.Material, ...]) -> np.ndarray:
    """Halve the panel at k = 0 towards 0 until it is shorter than the least wavenumber of a material.

    A stiff half-space's branch points and pole lie there, too small a feature for a long panel's last coefficients.
    """
    least = min(abs(m.ks2) ** 0.5 * (m.eps**0.5 or 1.0) for m in materials if m.shear != 0)
    first = panels[0, 1]
    if panels[0, 0] != 0 or least == 0.0 or least >= first:
        return panels
    halvings = min(int(np.ceil(np.log2(first / least))) + 1, _MAX_ROUNDS)
    cuts = panels[0, 1] * np.concatenate([[0.0], 2.0 ** -np.arange(halvings, -1, -1)])
    return np.concatenate([np.stack([cuts[:-1], cuts[1:]], axis=1), panels[1:]])


def _panels(end: float, stop: float, span: float, start: float = 0.0) -> np.ndarray:
    """Return panels (n, 2) from `start` to `stop`, of one length up to `end`; span: phase per unit wavenumber (m)."""
    longest = PHASE / span if span > 0 else np.inf
    line = [start]
    if start < end:
        line = list(np.linspace(start, end, max(_LEAST_PANELS, int(np.ceil((end - start) / longest))) + 1))
    elif start == 0.0:
        line += [min(stop, longest) / 8.0]
    while line[-1] < stop and len(line) < _MAX_PANELS:
        growth = line[-1]
        if growth > longest:
            count = int(min(np.ceil((stop - line[-1]) / longest), _MAX_PANELS))
            line += list(line[-1] + longest * np.arange(1, count + 1))
        else:
            line.append(line[-1] + growth)
    if len(line) > 1 and line[-1] > max(stop, end):
        line[-1] = max(stop, end)  # the tail's bound counts from there, and so do panels added later
    return np.stack([line[:-1], line[1:]], axis=1)


def _cut(panels: np.ndarray, pieces: int) -> np.ndarray:
    """Cut each panel in `pieces` equal ones."""
    edges = panels[:, :1] + (panels[:, 1:] - panels[:, :1]) * (np.arange(pieces + 1) / pieces)
    return np.stack([edges[:, :-1].ravel(), edges[:, 1:].ravel()], axis=1)


def _worst(errors: np.ndarray, bad: np.ndarray, room: int) -> np.ndarray:
    """Return the `room` worst ones of the `bad` panels."""
    if np.count_nonzero(bad) <= room:
        return bad
    worst = np.zeros_like(bad)
    worst[np.argsort(np.where(bad, -errors, 0.0))[: max(room, 0)]] = True
    return worst


def _evaluate(problem: Problem, panels: w.Array) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return, per panel, row and radius, the integral, a bound of its error and its absolute size.

    And, per panel, the largest part of that error that halving it would lessen.
    """
    orders = problem.load.orders
    step = max(1, _CHUNK // (_NODES.size * problem.r.size * len(orders)))
    shape = (len(panels), len(orders), problem.r.size)
    parts, errors, sizes = np.empty(shape, dtype=np.complex128), np.empty(shape), np.empty(shape)
    gains = np.empty(len(panels))
    for first in range(0, len(panels), step):
        part = slice(first, first + step)
        half = (panels[part, 1] - panels[part, 0]) / 2.0
        k = (panels[part].mean(1)[:, None] + half[:, None] * _NODES).ravel()
        phase = k[:, None] * problem.r
        waves = bessels(orders, phase) * problem.load.transform(k)[:, None]
        waves = waves.reshape(len(orders), half.size, _NODES.size, -1) * half[:, None, None]
        kernel = problem.kernel(k.astype(np.complex128)).reshape(len(orders), half.size, _NODES.size)
        parts[part] = ((kernel * _WEIGHTS)[:, :, None] @ waves)[:, :, 0].swapaxes(0, 1)
        sizes[part], errors[part], gains[part] = _sizes_and_errors(problem, panels[part], kernel, np.abs(waves))
    return parts, errors, sizes, gains


def _sizes_and_errors(
    problem: Problem, panels: w.Array, kernel: w.Array, waves: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, per panel, row and radius, the absolute size of the integral and a bound of its error.

    Per panel: the largest part of the error that halving would lessen.

    kernel (rows, panels, nodes), waves (rows, panels, nodes, radii): the rest of the integrand, absolute.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within
    six halves: there their envelope takes the place of the weight.

    Next to a pole the wavenumber's own rounding, times the kernel's slope of at most itself over the panel, is all that
    is left of the last coefficients: halving does not lessen that.
    """
    n, span = _NODES.size, float(problem.r.max()) + problem.load.reach
    coefficients = np.abs(kernel @ _TO_LEGENDRE.T)
    rest = 2.0 * coefficients[..., -2:].sum(axis=-1)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    phi = half * span
    swing = np.zeros_like(rest)
    for j in range(n):  # Horner
        swing = (swing + coefficients[..., j] / _ODD_FACTORIALS[j]) * phi
    swing *= 3.0 * half * phi**n
    least = panels[:, 0]
    far = (least > 6.0 * half)[:, None]
    at = np.maximum(least, half)[:, None] / 2.0
    phase = at * problem.r
    wave = 2.0 * problem.load.envelope(at)[:, None] * np.stack([bessel_bound(n, phase) for n in problem.load.orders], 1)
    weight = np.where(far[:, None], wave, problem.load.weight)
    size = np.abs(kernel) * _WEIGHTS
    covered_size = np.stack([size, np.broadcast_to(_WEIGHTS, size.shape)], axis=2) @ waves
    sizes, covered = np.moveaxis(covered_size, (2, 0), (0, 2))
    rounding = ROUNDING * (panels[:, 1] / half) * np.abs(kernel).max(axis=-1)
    oscillation = swing.T[..., None] * weight
    gains = 2.0 * np.maximum(rest - rounding, 0.0).T[..., None] * covered + oscillation
    return sizes, 2.0 * np.maximum(rest, rounding).T[..., None] * covered + oscillation, gains.max(axis=(1, 2))

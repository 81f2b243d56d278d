"""From wavenumbers to radii: the Hankel integral of a layered medium's compliance, with a bound on its error.

u_z(r) = integral of C_z(k) q(k) J0(kr) k dk, u_r(r) the same with J1, along the real axis. At the surface the static
half-space of one of the layers, known in closed form, is taken out first. Composite Gauss-Legendre on panels in
proportion to the oscillation; a panel whose last Legendre coefficients have not died is halved.

The axis is where damping puts the path: each pole is on the side where it belongs. A path lifted into the upper half
plane would be smoother, but waves whose energy runs against their phase (backward waves of plates and of layers on
a stiff base) and the bending of a stiff layer on a soft one have their poles there. Where nothing is damped, poles lie
on the axis, and the displacement is the limit of a loss that goes to 0.

All layers count at every wavenumber: no bound is known of what a lower layer sends back that is both proved and
cheaper than the layer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import factorial2

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.bessel import bessel, envelope
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.rheology import finite
from unitcad.attenuation.layered.stack import Stack
from unitcad.attenuation.layered.tail import measure_tail
from unitcad.errors import Refusal, UnitcadError

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, _NODES.size - 1))
_ODD_FACTORIALS = np.array([float(factorial2(2 * (2 * _NODES.size - j) - 1)) for j in range(_NODES.size)])
_PHASE = 8.0 * np.pi  # of the fastest Bessel product over one panel
_LEAST_PANELS = 6  # up to the last pole
_MAX_PANELS = 40_000
_MOST_PANELS = 2_500  # up to the last pole: a few seconds
_MAX_ROUNDS = 40
_MOST_ATTEMPTS = 3
_ROUNDING = 1e-15  # of a wavenumber, as the kernel feels it next to a pole
_CHUNK = 200_000  # integrand values held at once


@dataclass(frozen=True)
class Response:
    """Displacement (m per pascal or per newton, complex) with the shape of r, and how far off each value may be.

    error_r, error_z: bound of the error of u_r and of u_z at each radius, same unit and shape; wavenumbers: how many
    were evaluated.
    """

    u_r: Any
    u_z: Any
    error_r: Any
    error_z: Any
    wavenumbers: int

    @property
    def error(self) -> float:
        """The largest of all bounds: what rtol times the largest |u| is compared with."""
        return float(max(np.max(self.error_r), np.max(self.error_z)))


@dataclass(frozen=True)
class _Problem:
    medium: Stack
    load: Load
    omega: float
    r: np.ndarray
    z: float
    reference: w.Material | None  # of the static half-space that was taken out; None below the surface

    @property
    def column(self) -> int:
        return 1 if self.load.direction == "normal" else 0

    def kernel(self, k: w.Array) -> w.Array:
        """Return k C(k), less the static one, of (u_r, u_z), shape (2, n); the load's transform is not in it."""
        traction = np.zeros((2, k.size), dtype=np.complex128)
        traction[self.column] = 1.0
        out = k * self.medium.transfer(traction, k, self.omega, self.z)
        return out - static_kernel(self.reference, self.column)[:, None] if self.reference else out


def static_kernel(material: w.Material, column: int) -> w.Array:
    """Return k C(k) of a static half-space: (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across; nu by eps."""
    nu = (1.0 - 2.0 * material.eps) / (2.0 * (1.0 - material.eps))
    along, across = (1.0 - nu) / material.shear, -(1.0 - 2.0 * nu) / (2.0 * material.shear)
    return np.array([across, along] if column == 1 else [along, across])


def respond(medium: Stack, load: Load, omega: float, r: Any, z: float = 0.0, rtol: float = 1e-6) -> Response:
    """Return the displacement of `medium` under `load` at radii r (m), any shape, depth z (m) and omega (rad/s).

    rtol: wanted error over the largest |u| of all radii, 1e-12 to 0.1. Raises `Refusal` for values that can't be, and
    for r = 0 under a surface point load, `UnitcadError` where no finite answer was found. If rtol can't be reached the
    errors say so.
    """
    radii = np.asarray(r, dtype=float)
    if radii.size == 0 or not np.all(np.isfinite(radii)) or np.any(radii < 0):
        raise Refusal("r", "array", "radii must be finite and not negative, and there must be one")
    z, rtol = finite("z", z), finite("rtol", rtol, above=True)
    if not 1e-12 <= rtol <= 0.1:
        raise Refusal("rtol", rtol, "must be from 1e-12 to 0.1", min(max(rtol, 1e-12), 0.1))
    if load.reach == 0.0 and z == 0.0 and np.any(radii == 0.0):
        raise Refusal("r", 0.0, "under a point load the surface goes to infinity: give r > 0, z > 0 or a disc")
    # A layer of no thickness changes nothing, so its waves must not set the path.
    medium = medium.without_empty_layers()
    materials = medium.materials(omega)
    flat = radii.ravel()
    end = _last_pole(medium, materials, omega)
    _check_size(end, float(flat.max()) + load.reach + 2.0 * z, omega)
    lossless = omega > 0 and all(material.shear.imag == 0 for material in materials)
    solve = _solve_lossless if lossless else _solve
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # what is no number is refused below
        found = solve(_Problem(medium, load, omega, flat, z, None), end, rtol)
    u, error = found.total.reshape(2, *radii.shape), found.error.reshape(2, *radii.shape)
    if not (np.all(np.isfinite(u)) and np.all(np.isfinite(error))):
        raise _overflow(omega)
    return Response(u[0][()], u[1][()], error[0][()], error[1][()], found.wavenumbers)


_LIMIT = np.array([6.0, -15.0, 20.0, -15.0, 6.0, -1.0])
"""Weights that give a polynomial's value at 0 from those at 1 to 6, and, less by one degree, from those at 1 to 5."""
_LOWER = np.array([5.0, -10.0, 10.0, -5.0, 1.0, 0.0])


def _solve_lossless(bare: _Problem, end: float, rtol: float) -> _Found:
    """Take the limit of a loss that goes to 0: a polynomial through six small losses.

    What one of a degree less would give differs by the error. Waves decay little over the distance at these losses;
    next to a frequency at which a wave is cut off the displacement changes sooner, and smaller ones are tried. Where
    rounding next to the poles outweighs the polynomial's error, which it about does at the least of the first ones,
    larger ones are tried.
    """
    phase = max(1.0, end * (float(bare.r.max()) + bare.load.reach))
    by_rounding = (80.0 * _ROUNDING * phase / 2.0) ** (1.0 / 6.0)
    loss = min(0.02, 2.0 * max((0.3 * rtol) ** 0.2, by_rounding) / phase)
    best, count, before = None, 0, None
    for _ in range(_MOST_ATTEMPTS):
        wanted = max(0.008 * rtol, 2.0 * _ROUNDING / loss)
        found = [
            _solve(replace(bare, medium=bare.medium.with_loss(i * loss)), end, wanted)
            for i in range(1, _LIMIT.size + 1)
        ]
        values, errors = np.array([one.total for one in found]), np.array([one.error for one in found])
        total = np.tensordot(_LIMIT, values, 1)
        integrals, limit = np.tensordot(abs(_LIMIT), errors, 1), np.abs(total - np.tensordot(_LOWER, values, 1))
        count += sum(one.wavenumbers for one in found)
        if best is None or np.max(integrals + limit) < np.max(best.error):
            best = replace(found[0], total=total, error=integrals + limit)
        if np.max(best.error) <= rtol * np.max(np.abs(best.total)):
            break
        rounded = np.max(integrals) > np.max(limit)
        if before not in (None, rounded):
            break
        before, loss = rounded, loss * (3.0 if rounded else 1.0 / 30.0)
    assert best is not None
    return replace(best, wavenumbers=count)


def _solve(bare: _Problem, end: float, rtol: float) -> _Found:
    """Integrate in a few attempts and return the best.

    What was integrated first may have been accepted beside a largest |u| that the rest then took away: again, beside
    the one that came out. Where the panels do not suffice for rtol, a larger one may spend them better.
    """
    best, size, count = None, np.inf, 0
    for _ in range(_MOST_ATTEMPTS):
        found = _integrate(bare, end, rtol, size)
        count += found.wavenumbers
        if best is None or np.max(found.error) < np.max(best.error):
            best = found
        before, size = size, float(np.max(np.abs(best.total))) or 1.0
        reached = float(np.max(best.error)) / size
        if reached <= rtol or found.cut_short:
            break
        if found.exhausted:
            rtol = float(np.sqrt(rtol * min(reached, 0.1)))
        elif before <= 2.0 * size:
            break
    assert best is not None
    return replace(best, wavenumbers=count)


def _overflow(omega: float) -> UnitcadError:
    return UnitcadError(f"no finite answer at omega = {omega:g} rad/s: a number overflows on the way")


def _check_size(end: float, span: float, omega: float) -> None:
    """Refuse, before anything is allocated, an omega whose waves are too short for the distance `span` (m)."""
    panels = end * span / _PHASE
    if panels > _MOST_PANELS:
        limit = f"its waves are too short for {span:g} m: {panels:.2g} panels, the most is {_MOST_PANELS}"
        raise Refusal("omega", omega, limit, float(f"{0.9 * omega * _MOST_PANELS / panels:.2g}"))


def _static_part(problem: _Problem) -> np.ndarray:
    if problem.reference is None:
        return np.zeros((2, problem.r.size), dtype=np.complex128)
    along, across = problem.load.static(problem.r)
    pair = np.array([across, along] if problem.column == 1 else [along, across])
    return static_kernel(problem.reference, problem.column)[:, None] * pair


def _last_pole(medium: Stack, materials: tuple[w.Material, ...], omega: float) -> float:
    """Return a wavenumber (1/m) above all poles and branch points: slow surface waves, bending of layers as plates.

    The softest layer bends with what it lies on, not as a plate.
    """
    shear = max(abs(m.ks2) ** 0.5 for m in materials)
    softest = min(abs(m.shear) for m in materials)
    mass = sum(layer.thickness * layer.density for layer in medium.layers)
    bending = [
        (6.0 * mass * omega**2 / ((1.0 + layer.poisson_ratio) * abs(material.shear) * layer.thickness**3)) ** 0.25
        for layer, material in zip(medium.layers, materials, strict=False)
        if abs(material.shear) > softest
    ]
    floor = min(max(bending, default=0.0), 20.0 * shear)
    return 1.5 * max(1.5 * shear, floor)


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


@dataclass(frozen=True)
class _Found:
    """(u_r, u_z) at each radius, shape (2, n), and a bound of its error.

    cut_short: most of it is the tail's beyond what can be afforded; exhausted: there were panels left to be halved.
    """

    total: np.ndarray
    error: np.ndarray
    wavenumbers: int
    cut_short: bool
    exhausted: bool


def _panels(end: float, stop: float, span: float, start: float = 0.0) -> np.ndarray:
    """Return panels (n, 2) from `start` to `stop`, of one length up to `end`; span: phase per unit wavenumber (m)."""
    longest = _PHASE / span if span > 0 else np.inf
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
    """Cut each panel into that many equal pieces."""
    edges = panels[:, :1] + (panels[:, 1:] - panels[:, :1]) * (np.arange(pieces + 1) / pieces)
    return np.stack([edges[:, :-1].ravel(), edges[:, 1:].ravel()], axis=1)


def _worst(errors: np.ndarray, bad: np.ndarray, room: int) -> np.ndarray:
    """Mark the `room` worst of the `bad` panels."""
    if np.count_nonzero(bad) <= room:
        return bad
    found = np.zeros_like(bad)
    found[np.argsort(np.where(bad, -errors, 0.0))[: max(room, 0)]] = True
    return found


def _integrate(bare: _Problem, end: float, rtol: float, largest: float) -> _Found:
    """Integrate to rtol times the largest |u| that is met, or times `largest`, where that is less."""
    load, r, z = bare.load, bare.r, bare.z
    materials = bare.medium.materials(bare.omega)
    r_max = float(r.max())
    span = r_max + load.reach + 2.0 * z
    far = _PHASE / span * _MAX_PANELS * 5 / 6  # the others are there to be halved: a tail cut short says so
    tail = measure_tail(bare.kernel, static_kernel, materials, load, r, z, end, far, rtol, largest)
    least = float(tail.bounds[-1].max())
    rtol = max(rtol, 0.3 * least / (tail.scale or 1.0))  # what the tail leaves anyway is worth no halving
    problem = replace(bare, reference=tail.reference)
    known = _static_part(problem)
    total, quadrature, size = np.zeros_like(known), np.zeros(known.shape), np.zeros(known.shape)
    count, done, exhausted = 0, 0, False
    stop = tail.start(tail.scale, rtol)
    pending = _graded(_panels(end, stop, span), materials)
    for _ in range(_MAX_ROUNDS):
        parts, errors, absolute, gains = _evaluate(problem, pending)
        if not np.all(np.isfinite(parts)):
            raise _overflow(bare.omega)
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
        parts, errors, absolute, _ = _evaluate(problem, pending)
        total, quadrature, size = total + parts.sum(0), quadrature + errors.sum(0), size + absolute.sum(0)
    rest = tail.bound(stop)
    error = quadrature + rest + 4e-15 * size + 4e-16 * np.abs(known)
    return _Found(known + total, error, count, least > 0.5 * float(np.max(error)), exhausted)


def _evaluate(problem: _Problem, panels: w.Array) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return each panel's integral, its error bound and its absolute size, of (u_r, u_z) at each radius.

    And, per panel, the largest part of that error that halving it would lessen.
    """
    step = max(1, _CHUNK // (_NODES.size * problem.r.size * 2))
    shape = (len(panels), 2, problem.r.size)
    parts, errors, sizes = np.empty(shape, dtype=np.complex128), np.empty(shape), np.empty(shape)
    gains = np.empty(len(panels))
    for first in range(0, len(panels), step):
        part = slice(first, first + step)
        half = (panels[part, 1] - panels[part, 0]) / 2.0
        k = (panels[part].mean(1)[:, None] + half[:, None] * _NODES).ravel()
        phase = k[:, None] * problem.r
        waves = np.stack([bessel(1, phase), bessel(0, phase)]) * problem.load.transform(k)[:, None]
        waves = waves.reshape(2, half.size, _NODES.size, -1) * half[:, None, None]
        kernel = problem.kernel(k.astype(np.complex128)).reshape(2, half.size, _NODES.size)
        parts[part] = ((kernel * _WEIGHTS)[:, :, None] @ waves)[:, :, 0].swapaxes(0, 1)
        sizes[part], errors[part], gains[part] = _sizes_and_errors(problem, panels[part], kernel, np.abs(waves))
    return parts, errors, sizes, gains


def _sizes_and_errors(
    problem: _Problem, panels: w.Array, kernel: w.Array, waves: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, per panel, component and radius, the absolute size of the integral and a bound of its error.

    Per panel: the largest part of the error that halving would lessen.

    kernel (2, panels, nodes), waves (2, panels, nodes, radii): the rest of the integrand, absolute.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j meets an error of
    the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times what hardly changes within six halves: there
    their envelope takes the place of the weight.

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
    wave = 2.0 * problem.load.envelope(at) * envelope(at * problem.r)
    weight = np.where(far, wave, problem.load.weight)
    size = np.abs(kernel) * _WEIGHTS
    found = np.stack([size, np.broadcast_to(_WEIGHTS, size.shape)], axis=2) @ waves
    sizes, covered = np.moveaxis(found, (2, 0), (0, 2))
    rounding = _ROUNDING * (panels[:, 1] / half) * np.abs(kernel).max(axis=-1)
    oscillation = swing.T[..., None] * weight[:, None]
    gains = 2.0 * np.maximum(rest - rounding, 0.0).T[..., None] * covered + oscillation
    return sizes, 2.0 * np.maximum(rest, rounding).T[..., None] * covered + oscillation, gains.max(axis=(1, 2))

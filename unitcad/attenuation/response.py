"""From wavenumbers to radii: the Hankel integral of a layered medium's compliance, with a bound on its error.

u_z(r) = integral of C_z(k) q(k) J0(kr) k dk, u_r(r) the same with J1, over a path lifted off the real axis while k is
below every wave's wavenumber (the poles lie below it for e^{+i omega t}), then along the axis. At the surface the
static half-space of one of the layers, known in closed form, is taken out first. Composite Gauss-Legendre on panels in
proportion to the oscillation; a panel whose last Legendre coefficients have not died is halved. Layers that a wave
does not reach within the tolerance are left out, per wavenumber and, where that holds for all, altogether.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from unitcad.attenuation import waves as w
from unitcad.attenuation.bessel import bessel
from unitcad.attenuation.loads import Load
from unitcad.attenuation.medium import LayeredMedium
from unitcad.attenuation.rheology import finite
from unitcad.attenuation.tail import Tail, measure_tail
from unitcad.errors import Refusal

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_LAST = np.array([(2 * j + 1) / 2.0 * _WEIGHTS * np.polynomial.legendre.Legendre.basis(j)(_NODES) for j in (14, 15)])
_PHASE = 4.0 * np.pi  # of the fastest Bessel product over one panel
_MAX_PANELS = 60_000
_MOST_PANELS = 5_000  # up to the last pole: a few seconds
_MAX_ROUNDS = 40
_WORTH_ASKING = 1e-3  # from this rtol on it costs more to find layers that may be left out than to keep them
_CHUNK = 200_000  # integrand values held at once


@dataclass(frozen=True)
class Response:
    """Displacement (m per pascal or per newton, complex) with the shape of r; what it cost and what it left out.

    error: estimate of the largest error of u_r and u_z over r, same unit, meant as a bound; wavenumbers: how many were
    evaluated; layers_left_out: indices (top 0; the half-space is the last) that nothing within rtol depends on.
    """

    u_r: Any
    u_z: Any
    error: float
    wavenumbers: int
    layers_left_out: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Problem:
    medium: LayeredMedium
    load: Load
    omega: float
    r: np.ndarray
    z: float
    reference: w.Material | None  # of the static half-space that was taken out; None below the surface

    @property
    def column(self) -> int:
        return 1 if self.load.direction == "normal" else 0

    def kernel(self, k: w.Array, keep: int) -> w.Array:
        """k C(k), less the static one, of (u_r, u_z), shape (2, n); the load's transform is not in it."""
        traction = np.zeros((2, k.size), dtype=np.complex128)
        traction[self.column] = 1.0
        out = k * self.medium.transfer(traction, k, self.omega, self.z, keep)
        return out - static_kernel(self.reference, self.column)[:, None] if self.reference else out


def static_kernel(material: w.Material, column: int) -> w.Array:
    """k C(k) of a static half-space: (1 - nu) / mu along the load, -(1 - 2 nu) / (2 mu) across; nu by eps."""
    nu = (1.0 - 2.0 * material.eps) / (2.0 * (1.0 - material.eps))
    along, across = (1.0 - nu) / material.shear, -(1.0 - 2.0 * nu) / (2.0 * material.shear)
    return np.array([across, along] if column == 1 else [along, across])


def respond(medium: LayeredMedium, load: Load, omega: float, r: Any, z: float = 0.0, rtol: float = 1e-6) -> Response:
    """Displacement of `medium` under `load` at radii r (m), any shape, and one depth z (m), at omega (rad/s).

    rtol: wanted error over the largest |u| of all radii, 1e-12 to 0.1. Raises `Refusal` for values that can't be, and
    for r = 0 under a surface point load. If rtol can't be reached `error` says so.
    """
    radii = np.asarray(r, dtype=float)
    if radii.size == 0 or not np.all(np.isfinite(radii)) or np.any(radii < 0):
        raise Refusal("r", "array", "radii must be finite and not negative, and there must be one")
    z, rtol = finite("z", z), finite("rtol", rtol, above=True)
    if not 1e-12 <= rtol <= 0.1:
        raise Refusal("rtol", rtol, "must be from 1e-12 to 0.1", min(max(rtol, 1e-12), 0.1))
    if load.reach == 0.0 and z == 0.0 and np.any(radii == 0.0):
        raise Refusal("r", 0.0, "under a point load the surface goes to infinity: give r > 0, z > 0 or a disc")
    materials = medium.materials(omega)
    flat = radii.ravel()
    end = _last_pole(medium, materials, omega)
    _check_size(end, float(flat.max()) + load.reach + 2.0 * z, omega)
    problem = _Problem(medium, load, omega, flat, z, None)
    tail = measure_tail(problem.kernel, static_kernel, materials, load, flat, z, end, rtol)
    problem = _Problem(medium, load, omega, flat, z, tail.reference)
    known = _static_part(problem)
    found = _integrate(problem, materials, tail, known, end, rtol)
    u = (known + found.total).reshape(2, *radii.shape)
    return Response(u[0][()], u[1][()], found.error, found.wavenumbers, found.left_out)


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


def _last_pole(medium: LayeredMedium, materials: tuple[w.Material, ...], omega: float) -> float:
    """A wavenumber above every pole and branch point (1/m): slow surface waves, and bending of the layers as plates."""
    shear = max(abs(m.ks2) ** 0.5 for m in materials)
    mass = sum(layer.thickness * layer.density for layer in medium.layers)
    bending = [
        (12.0 * mass * omega**2 / (layer.youngs_modulus * layer.thickness**3)) ** 0.25
        for layer in medium.layers
        if layer.thickness > 0
    ]
    floor = min(max(bending, default=0.0), 20.0 * shear) if medium.layers else 0.0
    return 1.5 * max(1.5 * shear, floor)


def _graded(panels: np.ndarray, materials: tuple[w.Material, ...]) -> np.ndarray:
    """`panels` with the one at k = 0 halved towards 0 until it is shorter than the least wavenumber of a material.

    A stiff half-space's branch points and pole lie there, too small a feature for a long panel's last coefficients.
    """
    least = min(abs(m.ks2) ** 0.5 * (m.eps**0.5 or 1.0) for m in materials if m.shear != 0)
    first = abs(panels[0, 1] - panels[0, 0])
    if panels[0, 0] != 0 or least == 0.0 or least >= first:
        return panels
    halvings = min(int(np.ceil(np.log2(first / least))) + 1, _MAX_ROUNDS)
    cuts = panels[0, 1] * np.concatenate([[0.0], 2.0 ** -np.arange(halvings, -1, -1)])
    return np.concatenate([np.stack([cuts[:-1], cuts[1:]], axis=1), panels[1:]])


@dataclass(frozen=True)
class _Found:
    total: np.ndarray
    error: float
    wavenumbers: int
    left_out: tuple[int, ...]


def _path(end: float, r_max: float, thickness: float) -> list[complex]:
    """Corners of the lifted path from 0 to `end`; its height keeps the Bessel functions below e^2.

    Layers have complex modes as well, with poles above the axis at heights of about 1 / `thickness` of them all (m):
    the path stays well below.
    """
    if end == 0.0:
        return [0j]
    height = min(2.0 / r_max if r_max > 0 else np.inf, end / 4.0, 0.1 / thickness if thickness > 0 else np.inf)
    return [0j, height * (1 + 1j), end + 1j * height, end + height + 0j]


def _panels(corners: list[complex], stop: float, span: float) -> np.ndarray:
    """Panels (n, 2) along the corners and on along the real axis to `stop`; span: phase per unit wavenumber (m)."""
    longest = _PHASE / span if span > 0 else np.inf
    edges: list[np.ndarray] = []
    for a, b in pairwise(corners):
        count = max(2, int(np.ceil(abs(b - a) / longest)))
        edges.append(a + (b - a) * np.linspace(0.0, 1.0, count + 1))
    at = corners[-1].real
    line = [at]
    if at == 0.0:
        line += [min(stop, longest) / 8.0]
    while line[-1] < stop and len(line) < _MAX_PANELS:
        growth = line[-1]
        if growth > longest:
            count = int(min(np.ceil((stop - line[-1]) / longest), _MAX_PANELS))
            line += list(line[-1] + longest * np.arange(1, count + 1))
        else:
            line.append(line[-1] + growth)
    if len(line) > 1 and line[-1] > stop:
        line[-1] = stop  # the tail's bound counts from there, and so do panels added later
    edges.append(np.array(line, dtype=complex))
    return np.concatenate([np.stack([e[:-1], e[1:]], axis=1) for e in edges])


def _affordable(tail: Tail, span: float) -> float:
    """The last wavenumber of the tail's that five in six of all panels reach; the others are there to be halved.

    To go further would leave nothing to refine the first panels with: a tail cut short costs far less, and says so.
    """
    far = _PHASE / span * _MAX_PANELS * 5 / 6
    return float(tail.k[max(np.searchsorted(tail.k, far) - 1, 0)])


def _worst(errors: np.ndarray, bad: np.ndarray, room: int) -> np.ndarray:
    """Of the `bad` panels the `room` worst ones."""
    if np.count_nonzero(bad) <= room:
        return bad
    found = np.zeros_like(bad)
    found[np.argsort(np.where(bad, -errors, 0.0))[: max(room, 0)]] = True
    return found


def _integrate(
    problem: _Problem,
    materials: tuple[w.Material, ...],
    tail: Tail,
    known: np.ndarray,
    end: float,
    rtol: float,
) -> _Found:
    r_max = float(problem.r.max())
    corners = _path(end, r_max, sum(layer.thickness for layer in problem.medium.layers))
    span = r_max + problem.load.reach + 2.0 * problem.z
    full = len(problem.medium.layers)
    keep, skipped = _reached(problem, corners, materials, rtol)
    total = np.zeros_like(known)
    quadrature = size = dropped = 0.0
    count = 0
    most = _affordable(tail, span)
    stop = min(tail.start(max(float(np.max(np.abs(known))), tail.scale), rtol), most)
    pending = _graded(_panels(corners, stop, span), materials)
    done = 0
    used = 0
    for _ in range(_MAX_ROUNDS):
        parts, errors, absolute, lost, kept = _evaluate(problem, pending, keep, materials, rtol)
        count += pending.shape[0] * _NODES.size
        used = max(used, kept)
        scale = float(np.max(np.abs(known + total + parts.sum(0)))) or 1.0
        done += pending.shape[0]
        bad = errors > 0.3 * rtol * scale / max(done, 1)
        if quadrature + errors.sum() <= 0.4 * rtol * scale:
            bad[:] = False
        bad = _worst(errors, bad, (_MAX_PANELS - done) // 4)  # halves of at most half of what is left
        total = total + parts[~bad].sum(0)
        quadrature += float(errors[~bad].sum())
        size += float(absolute[~bad].sum())
        dropped += float(lost[~bad].sum())
        if np.any(bad):
            middle = pending[bad].mean(1)
            pending = np.concatenate(
                [
                    np.stack([pending[bad, 0], middle], axis=1),
                    np.stack([middle, pending[bad, 1]], axis=1),
                ]
            )
            continue
        wanted = min(tail.start(float(np.max(np.abs(known + total))), rtol), most)
        if wanted <= stop or done > _MAX_PANELS:
            break
        pending = _panels([complex(stop)], wanted, span)
        stop = wanted
    else:
        quadrature += float(errors.sum())
        dropped += float(lost.sum())
        total = total + parts.sum(0)
    rounding = 4e-15 * size + 4e-16 * float(np.max(np.abs(known)))
    error = quadrature + tail.bound(stop) + skipped + dropped + rounding
    return _Found(total, error, count, tuple(range(used + 1, full + 1)))


def _evaluate(
    problem: _Problem, panels: w.Array, keep: int, materials: tuple[w.Material, ...], rtol: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, int]:
    """Per panel: its integral (panels, 2, radii), a bound of its error, its absolute size, a bound of what the layers
    left out would add; and the layers used.
    """
    step = max(1, _CHUNK // (_NODES.size * problem.r.size * 2))
    lifted = np.any(panels.imag != 0, axis=1)
    parts = np.empty((len(panels), 2, problem.r.size), dtype=np.complex128)
    errors, sizes, lost, used = np.empty(len(panels)), np.empty(len(panels)), np.zeros(len(panels)), 0
    static = np.abs(static_kernel(problem.reference, problem.column))[:, None] if problem.reference else 0.0
    for group in (np.nonzero(lifted)[0], np.nonzero(~lifted)[0]):
        for first in range(0, group.size, step):
            part = group[first : first + step]
            half = (panels[part, 1] - panels[part, 0]) / 2.0
            k = (panels[part].mean(1)[:, None] + half[:, None] * _NODES).ravel()
            kernel, missing, reached = _layered_kernel(problem, k, keep, materials, rtol)
            used = max(used, reached)
            if not lifted[part[0]]:  # real Bessel functions cost a tenth of complex ones
                k = k.real
            transform = problem.load.transform(k)
            phase = k[:, None] * problem.r
            waves = np.stack([bessel(1, phase), bessel(0, phase)])
            values = waves * (kernel * transform)[:, :, None]
            values = values.reshape(2, part.size, _NODES.size, -1) * half[:, None, None]
            parts[part] = np.einsum("n,cpnr->pcr", _WEIGHTS, values)
            errors[part], sizes[part] = _panel_errors(values)
            if np.any(missing):
                share = missing * (np.abs(kernel) + static) * np.abs(transform)
                share = (np.abs(waves) * share[:, :, None]).reshape(2, part.size, _NODES.size, -1)
                lost[part] = np.abs(half) * np.einsum("n,cpnr->cpr", _WEIGHTS, share).max(axis=(0, 2))
    return parts, errors, sizes, lost, used


def _panel_errors(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Per panel a bound of the error, from how far its last Legendre coefficients have died, and its absolute size.

    Gauss-Legendre with n nodes is exact to degree 2n - 1: its error is what the coefficients from degree 2n on give,
    each at most twice over. Twice the last two that were seen, n - 2 and n - 1, is more than that as soon as the
    coefficients halve within n degrees or so. (To count on the rate at which they seem to fall was too bold:
    a pole of small residue next to the panel shows in the last ones only.)
    """
    last = np.abs(np.einsum("jn,cpnr->jcpr", _LAST, values)).sum(axis=0)
    magnitude = np.abs(values)
    return 2.0 * last.max(axis=(0, 2)), np.einsum("n,cpnr->cpr", _WEIGHTS, magnitude).max(axis=(0, 2))


def _layered_kernel(
    problem: _Problem, k: w.Array, keep: int, materials: tuple[w.Material, ...], rtol: float
) -> tuple[w.Array, np.ndarray, int]:
    """The kernel with, at each wavenumber, only the layers from which something comes back within rtol / 1000.

    Beside it, per wavenumber, a bound of what the others would change k C by, as a share of it; and the layers used.
    """
    layers = problem.medium.layers[:keep]
    depth = np.zeros(k.size)
    needed = np.zeros(k.size, dtype=int)
    missing = np.zeros(k.size)
    top = 0.0
    for i, layer in enumerate(layers):
        gp, gs = w.rates(materials[i], k)
        below = max(0.0, top + layer.thickness - max(problem.z, top))
        depth += np.minimum(gp.real, gs.real) * below
        back = _coming_back(depth)
        seen = (back > rtol / 1e3) | (problem.z >= top + layer.thickness)
        needed[seen], missing[seen] = i + 1, 0.0
        missing = np.where(~seen & (missing == 0.0), back, missing)
        top += layer.thickness
    out = np.empty((2, k.size), dtype=np.complex128)
    for one in np.unique(needed):
        part = needed == one
        out[:, part] = problem.kernel(k[part], int(one))
    return out, missing, int(needed.max(initial=0))


def _coming_back(depth: np.ndarray) -> np.ndarray:
    """What an interface `depth` decay lengths down changes the compliance by, as a share of it: at most that.

    Twice what a rigid base does to an incompressible layer at rest, (2 + 2 x + x^2) e^-x with x = 2 depth.
    """
    x = 2.0 * depth
    return 2.0 * (2.0 + 2.0 * x + x * x) * np.exp(-x)


def _reached(
    problem: _Problem, corners: list[complex], materials: tuple[w.Material, ...], rtol: float
) -> tuple[int, float]:
    """How many layers (from the top) matter within rtol on the lifted path, and a bound of what the others add."""
    full = len(problem.medium.layers)
    bottom = np.cumsum([layer.thickness for layer in problem.medium.layers])
    if full == 0 or len(corners) == 1 or rtol >= _WORTH_ASKING:
        return full, 0.0
    panels = _panels(corners, 0.0, 0.0)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    k = (panels.mean(1)[:, None] + half[:, None] * _NODES).ravel()
    weight = np.abs(half[:, None] * _WEIGHTS).ravel() * np.abs(problem.load.transform(k))
    span = np.exp(np.abs(k.imag) * float(problem.r.max()))
    whole = problem.kernel(k, full)
    scale = np.max(np.abs((whole * weight).sum(1)))
    keep, bound = full, 0.0
    while keep > 0 and bottom[keep - 1] > problem.z:
        change = float(np.max((np.abs(problem.kernel(k, keep - 1) - whole) * weight * span).sum(1)))
        if change > 0.02 * rtol * scale:
            break
        keep, bound = keep - 1, 2.0 * change
    return keep, bound

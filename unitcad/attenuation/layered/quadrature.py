"""The path of a Hankel integral in panels, its detours around poles, and the rule over the panels.

A panel is a row (a, b, base, turn), complex. It runs from s = a to b, straight in s. The wavenumber is s itself, or,
next to a branch point on the axis, base + turn s^2, in which the kernel has no root any more.

If nothing is damped, or only a layer that a wave hardly reaches, poles are on the axis or closer to it than any panel.
Between two wavenumbers with one such pole the path leaves the axis, over two legs on the pole's other side.

A pole is where the kernel times (t - t_pole) is a polynomial of the panel's t, from -1 to 1, though the kernel is not:
the last Legendre coefficients of the two agree up to that factor. The side on which it belongs is that of its imaginary
part, or, where that is lost in rounding, that to which a little more loss moves it.

A panel's kernel is known at a few nodes. Where the Bessel functions swing faster than they can be seen there, the panel
is cut into pieces, and the kernel's Legendre series is read off at the nodes of each: the kernel, which costs most, is
sampled as it varies, not as the waves do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered.loads import UniformDisc, bessel_bounds, bessels, static_kernel
from unitcad.attenuation.layered.medium import Stack
from unitcad.attenuation.layered.propagation import Array, Material
from unitcad.lean_scipy import special

PHASE = 8.0 * np.pi
"""Of the fastest Bessel product over one panel."""
MAX_PANELS = 40_000
MOST_PIECES = 16
"""Of a panel beyond all poles, each with waves of that phase."""
_LEAST_PANELS = 12  # up to the last pole: with fewer, most are cut later, which takes longer
_BEYOND = 1.2
"""Of the shortest wave's wavenumber: beyond it there is mostly room for poles, not a pole.

Panels there are as long as a third of the path to the last pole: of 200 random media none takes another round of cuts
for it at rtol 1e-3, and two at 1e-6.
"""
_MAX_HALVINGS = 40
_CLOSE = 4
"""Halvings between the first panel and those beyond the least wavenumber's pole, each a panel."""


def wavenumbers(panels: Array, s: Array) -> tuple[Array, Array]:
    """Return the wavenumbers (1/m) at s, a row a panel, and their slopes over s."""
    base, turn = panels[:, 2, None], panels[:, 3, None]
    if not np.any(turn):
        return s, np.ones_like(s)
    return np.where(turn == 0, s, base + turn * s * s), np.where(turn == 0, 1.0, 2.0 * turn * s)


def from_origin(end: float, stop: float, span: float, materials: tuple[Material, ...]) -> Array:
    """Return the panels from 0 to `stop`, beyond `end` and the first panel; span: phase per unit wavenumber (m).

    They are of one length up to `end`, but longer beyond the waves of all materials. The one at k = 0 is halved towards
    0 until it is shorter than the least wavenumber of a material: a stiff half-space's branch points and pole lie
    there, too small a feature for a long panel's last coefficients. Beyond them two of these halves are one panel. No
    tolerance is in it: panels of a tighter one are to be pieces of those of a looser one.
    """
    longest = PHASE / span
    line = np.linspace(0.0, end, max(_LEAST_PANELS, int(np.ceil(end / longest))) + 1)
    # Beyond there a panel is as long as a third of the line, or as the most pieces.
    first = int(np.searchsorted(line, _BEYOND * max(abs(m.ks2) ** 0.5 for m in materials)))
    kept = np.arange(len(line) - 1, first, -min((len(line) - 1) // 3, MOST_PIECES))
    line = np.concatenate([line[: first + 1], line[kept[::-1]]])
    line = _continued(line if end > 0 else np.array([0.0, longest / 8.0]), stop, longest)
    shortest = min(abs(m.ks2) ** 0.5 * (m.eps**0.5 or 1.0) for m in materials if m.shear != 0)
    if 0.0 < shortest < line[1]:
        halvings = min(int(np.ceil(np.log2(line[1] / shortest))) + 1, _MAX_HALVINGS)
        close = np.arange(halvings, max(halvings - _CLOSE, 0), -1)
        times = np.concatenate([close, np.arange(close[-1] - 2, 0, -2), [0]])
        line = np.concatenate([[0.0], line[1] * 0.5**times, line[2:]])
    # On the axis are the branch points of a half-space without damping.
    on_axis = {k.real for k in materials[-1].branch_points if k.real > 0 and k.imag == 0}
    return _turned(line, sorted(on_axis), 1.0 / span)


def onwards(start: float, stop: float, span: float) -> Array:
    """Return the panels beyond all poles, from `start` to `stop`."""
    return _plain(_continued(np.array([start]), stop, PHASE / span))


def _continued(line: np.ndarray, stop: float, longest: float) -> np.ndarray:
    """Continue the corners to `stop`, each panel as long as its distance from 0, if that is no more than it may be.

    There the kernel varies as slowly as that: only the waves swing faster.
    """
    corners = list(line)
    while corners[-1] < stop and len(corners) < MAX_PANELS:
        corners.append(min(stop, corners[-1] + min(corners[-1], MOST_PIECES * longest)))
    return np.array(corners)


def _plain(line: np.ndarray) -> Array:
    panels = np.zeros((len(line) - 1, 4), dtype=np.complex128)
    panels[:, 0], panels[:, 1] = line[:-1], line[1:]
    return panels


def _turned(line: np.ndarray, branch_points: list[float], longest: float) -> Array:
    """Return the panels between the corners, those on both sides of each branch point in the square root there."""
    inside = [k for k in branch_points if k < line[-1]]
    if not inside:
        return _plain(line)
    others = [k for k in line if all(abs(k - one) > 1e-6 * one for one in inside)]
    line = np.unique([*others, *inside])
    panels = []
    for k in inside:
        i = int(np.searchsorted(line, k))
        # Half of the way between two corners is each one's: the next may be a branch point too.
        low, high = max(k - longest, (line[i - 1] + k) / 2.0), min(k + longest, (k + line[i + 1]) / 2.0)
        panels += [[(k - low) ** 0.5, 0.0, k, -1.0], [0.0, (high - k) ** 0.5, k, 1.0]]
        line = np.concatenate([line[:i], [low, k, high], line[i + 1 :]])
    plain = _plain(line)
    at = np.isin(plain[:, 0].real, inside) | np.isin(plain[:, 1].real, inside)
    return np.concatenate([plain[~at], np.array(panels, dtype=np.complex128).reshape(-1, 4)])


def halve_towards(panels: Array, at: Array, times: np.ndarray) -> tuple[Array, np.ndarray]:
    """Cut each panel in two equal ones, and of these the one next to `at` again, so many times in all.

    at: in the panel's t, from -1 to 1, or beyond. Return the pieces, and which panel each is from.
    """
    of = np.arange(len(panels))
    pieces, origin = [panels[:0]], [of[:0]]
    while len(panels):
        right = (at.real > 0).astype(int)
        both = cut_pieces(panels, np.stack([panels[:, 0], panels[:, :2].mean(axis=1), panels[:, 1]], axis=1))
        near, other = (both[2 * np.arange(len(panels)) + side] for side in (right, 1 - right))
        again = times > 1
        pieces += [other, near[~again]]
        origin += [of, of[~again]]
        panels, of, times = near[again], of[again], times[again] - 1
        at = 2.0 * at[again] - np.where(right[again], 1.0, -1.0)
    return np.concatenate(pieces), np.concatenate(origin)


def cut_pieces(panels: Array, corners: Array) -> Array:
    """Return the pieces of each panel between its corners, shape (panels, pieces + 1)."""
    pieces = corners.shape[1] - 1
    ends = np.stack([corners[:, :-1].ravel(), corners[:, 1:].ravel()], axis=1)
    return np.concatenate([ends, np.repeat(panels[:, 2:], pieces, axis=0)], axis=1)


NODES = 16
"""Of a panel: Gauss's rule."""
_AT, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)
_DEGREES = np.arange(2 * NODES, NODES, -1)
"""Of the waves: for each coefficient of the kernel the least degree that meets an error of the rule."""
_ODD_FACTORIALS = np.array([float(special.factorial2(2 * m - 1)) for m in _DEGREES])


@cache  # not at import: the inverse makes OpenBLAS take its buffers
def _to_legendre() -> Array:
    """Return the matrix from values at the nodes to coefficients of degrees 0 to 15."""
    return np.linalg.inv(np.polynomial.legendre.legvander(_AT, NODES - 1))


def nodes(panels: Array) -> tuple[Array, Array]:
    """Return the wavenumbers (1/m) at which a panel's kernel is sampled and their slopes, shape (panels, nodes).

    Next to a branch point the kernel may be one over a root that the slope cancels. So no wavenumber is rounded to the
    branch point, and the slope is that at the rounded wavenumber.
    """
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    k, slope = wavenumbers(panels, (panels[:, 0] + half)[:, None] + half[:, None] * _AT)
    base, turn = panels[:, 2, None], panels[:, 3, None]
    if np.any(turn):
        k = np.where(k == base, base * (1.0 + turn * np.finfo(float).eps), k)
        slope = np.where(turn == 0, slope, 2.0 * turn * np.sqrt(turn * (k - base)))
    return k, slope


def closeness(panels: Array) -> np.ndarray:
    """Return the wavenumber over half of a panel's span of it, shape (panels,)."""
    ends = wavenumbers(panels, panels[:, :2])[0]
    return np.abs(ends).max(axis=1) / (np.abs(ends[:, 1] - ends[:, 0]) / 2.0)


_LAST = 4  # coefficients in which a pole is looked for
_NEXT = 0.05  # imaginary part of t up to which a pole is next to the axis
_INNER = 0.9  # real part of t up to which a pole is inside the panel
_HEIGHT = 0.35  # of the legs' corner, over the distance from pole to foot
HIDDEN = 500.0
"""The most that another pole under the legs adds to a panel's integral, over the last coefficients and the waves.

Under legs of height 0.35 its part in the last coefficients is at least its residue over 1.36^16 = 142; it adds 2 pi
residues, and the waves over the panel weigh 2.
"""
_SURE = 10.0  # times its uncertainty that an imaginary part must be to count
_PROBE = 1e-3  # of the panel's half over its wavenumber: the loss that shows where a pole belongs
LOST = 4e-15
"""Of a wavenumber: its rounding in the kernel's pole."""


class Poles(NamedTuple):
    """The pole of each panel in its t, shape (n,), its uncertainty, and the rest of the last coefficients.

    rest (rows, n): of the kernel times (t - t_pole).
    """

    at: Array
    uncertainty: np.ndarray
    rest: np.ndarray


def poles(kernel: Array, close: np.ndarray) -> Poles:
    """Return the pole that each panel's kernel (with dk/ds), (rows, panels, nodes), would have; close: `closeness`."""
    last = _to_legendre()[-_LAST:].T
    plain, turned = kernel @ last, (kernel * _AT) @ last
    size = np.sum(np.abs(plain) ** 2, axis=(0, 2))
    safe = np.where(size > 0, size, 1.0)
    at = np.sum(np.conj(plain) * turned, axis=(0, 2)) / safe
    left = np.abs(turned - at[:, None] * plain)
    uncertainty = np.sqrt(np.sum(left**2, axis=(0, 2)) / safe) + LOST * close
    return Poles(np.where(size > 0, at, np.inf), uncertainty, left.sum(axis=-1))


def around(
    panels: Array, found: Poles, longest: float, lossier: Callable[[Array, float], Poles]
) -> tuple[np.ndarray, Array]:
    """Return which panels, all on the axis, have a detour, and the five corners of each, shape (m, 5).

    longest: distance from the pole to the legs' feet at most (1/m); lossier(panel, loss) finds the pole of a medium
    with at least that loss factor in every layer.
    """
    at = found.at
    inside = (np.abs(at.real) < _INNER) & (np.abs(at.imag) < _NEXT) & (found.uncertainty < _NEXT)
    which, corners = np.zeros(len(panels), dtype=bool), []
    for i in np.flatnonzero(inside):
        a, b = panels[i, :2].real
        half, (ends, slope) = (b - a) / 2.0, wavenumbers(panels[i : i + 1], panels[i : i + 1, :2])
        height = at[i].imag
        if abs(height) <= _SURE * found.uncertainty[i]:
            moved = lossier(panels[i], _PROBE * float(np.abs(ends[0, 1] - ends[0, 0]) / np.abs(ends).max()))
            height = moved.at[0].imag - at[i].imag
            if not abs(height) > _SURE * max(moved.uncertainty[0], found.uncertainty[i]):
                continue
        x = (a + b) / 2.0 + half * at[i].real
        foot = min(_INNER * abs(half) * (1.0 - abs(at[i].real)), longest / float(np.abs(slope).max()))
        ahead = np.copysign(foot, half)
        corners.append([a, x - ahead, x - 1j * np.sign(height) * _HEIGHT * ahead, x + ahead, b])
        which[i] = True
    return which, np.array(corners, dtype=np.complex128).reshape(-1, 5)


ROUNDING = 1e-15
"""Of a wavenumber, as the kernel feels it next to a pole."""
_CANCELLED = 4e-15
"""Of the part taken out of the kernel: rounding in the last coefficients of the difference."""
_SINGLE = 1e-7
"""Uncertainty of a pole below which a panel has no other, or only a negligible one."""
_CHUNK = 200_000  # integrand values held at once
_MOST_SAMPLES = 8_192  # kernel values worked out at once


@dataclass(frozen=True)
class Problem:
    """A medium at omega (rad/s) under a load, seen at radii r (m), shape (n,).

    reference: the static half-space that is taken out.
    """

    medium: Stack
    omega: float
    load: UniformDisc
    r: np.ndarray
    reference: Material | None = None

    def kernel(self, k: Array) -> Array:
        """Return k C(k), less the static one, a row an order of the load; the load's transform is not in it."""
        chunks = [self._compliance(k[first : first + _MOST_SAMPLES]) for first in range(0, k.size, _MOST_SAMPLES)]
        return k * np.concatenate(chunks, axis=1) - self.taken_out[:, None]

    def _compliance(self, k: Array) -> Array:
        if self.load.direction == "normal":
            return self.medium.columns([1], k, self.omega)[:, 0]
        u_r, u_z = self.medium.columns([0], k, self.omega)[:, 0]
        u_theta = self.medium.shear_column(k, self.omega)
        return np.array([(u_r + u_theta) / 2.0, (u_r - u_theta) / 2.0, u_z])

    @cached_property
    def taken_out(self) -> Array:
        """The static kernel that is taken out, shape (rows,)."""
        rows = len(self.load.orders)
        return static_kernel(self.reference, self.load.direction) if self.reference else np.zeros(rows)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Integrals over panels.

    parts, covered, swing (panels, rows, radii): the integral over each, that of the waves' absolute size, the rule's
    error; kernel (with dk/ds): the integrand; closeness: the wavenumber over half of the panel's span of it; peak, rest
    (rows, panels): the kernel's largest value, a bound of the error of its Legendre series; known: the constant taken
    out of each row.
    """

    parts: Array
    covered: np.ndarray
    swing: np.ndarray
    kernel: Array
    closeness: np.ndarray
    peak: np.ndarray
    rest: np.ndarray
    known: np.ndarray

    def _times(self, kernel: np.ndarray) -> np.ndarray:
        """Return the integral of a kernel of that size over each panel; kernel (rows, panels)."""
        return kernel.T[..., None] * self.covered

    @cached_property
    def errors(self) -> np.ndarray:
        """A bound of the error of each panel's part."""
        return self._times(self.rest) + self.swing

    @property
    def sizes(self) -> np.ndarray:
        """Size of each panel's part if nothing cancelled."""
        return self._times(self.peak)

    @cached_property
    def gains(self) -> np.ndarray:
        """By how much halving a panel lessens the largest part of its error, shape (panels,)."""
        left = 2.0 * _rounding(self.peak, self.closeness) + _CANCELLED * np.abs(self.known)[:, None]
        halved = 2.0 * self._times(left)
        return np.maximum(self.errors.max(axis=(1, 2)) - halved.max(axis=(1, 2)), 0.0)

    @cached_property
    def poles(self) -> Poles:
        """The pole of each panel."""
        return poles(self.kernel, self.closeness)

    @cached_property
    def hidden(self) -> np.ndarray:
        """Error of a detour around each panel's pole, shape (panels, rows, radii)."""
        return HIDDEN * self._times(self.poles.rest)

    @property
    def blurred(self) -> np.ndarray:
        """Whether the error of a detour may be only rounding."""
        return self.poles.uncertainty <= np.maximum(_SINGLE, 10.0 * LOST * self.closeness)


def evaluate(problem: Problem, panels: Array, kernel: Array, phase: float) -> Evaluated:
    """Integrate over each panel, on the axis or off it, its kernel (with dk/ds) of shape (rows, panels, nodes).

    phase: the most that the fastest Bessel product may turn over a piece of a panel.

    The kernel is its Legendre series to degree n - 1 and a rest. The rest is at most twice the last two coefficients
    that were seen, as soon as they halve within n degrees or so (to count on the rate at which they seem to fall was
    too bold: a pole of small residue next to the panel shows in the last ones only); it enters the integral and the
    rule. Next to a pole the wavenumber's own rounding, times the kernel's slope of at most itself over the panel, is
    all that is left of the last coefficients: halving doubles it. If the kernel is small relative to the constant taken
    out, their difference's rounding is left, and stays.
    """
    close = closeness(panels)
    peak = np.abs(kernel).max(axis=-1)
    series = np.abs(kernel @ _to_legendre().T)
    rest = 2.0 * np.maximum(2.0 * series[..., -2:].sum(axis=-1), _rounding(peak, close))
    slope = wavenumbers(panels, panels[:, :2])[1]
    turn = np.abs(panels[:, 1] - panels[:, 0]) * np.abs(slope).max(axis=1) * _span(problem)
    pieces = np.maximum(np.ceil(turn / phase), 1.0).astype(int)
    off_axis = np.any(panels[:, :2].imag, axis=1)
    shape = (len(panels), len(kernel), problem.r.size)
    parts, covered, swing = np.empty(shape, dtype=np.complex128), np.empty(shape), np.empty(shape)
    step = max(1, _CHUNK // (NODES * problem.r.size * len(kernel)))
    for which in (np.flatnonzero(~off_axis), np.flatnonzero(off_axis)):
        ends = np.cumsum(pieces[which])
        for at in np.split(which, np.flatnonzero(np.diff(ends // step)) + 1):
            if at.size:
                found = _integrated(problem, panels[at], pieces[at], kernel[:, at], series[:, at])
                parts[at], covered[at], swing[at] = found
    return Evaluated(parts, covered, swing, kernel, close, peak, rest, problem.taken_out)


def _rounding(peak: np.ndarray, close: np.ndarray) -> np.ndarray:
    """Return the part of the kernel that may be the rounding of its wavenumbers, shape (rows, panels)."""
    return ROUNDING * close * peak


def _span(problem: Problem) -> float:
    return float(problem.r.max()) + problem.load.radius


def _integrated(
    problem: Problem, panels: Array, pieces: np.ndarray, kernel: Array, series: np.ndarray
) -> tuple[Array, np.ndarray, np.ndarray]:
    """Return the integrals over panels, all on the axis or all off it, each cut into so many `pieces`.

    At a piece's nodes the kernel has the value of its panel's Legendre series; `series`: its coefficients, absolute.
    With them that of the waves' absolute size and a bound of the rule's error, each of shape (panels, rows, radii).
    """
    first = np.cumsum(pieces) - pieces
    of = np.repeat(np.arange(len(panels)), pieces)
    share = ((np.arange(len(of)) - first[of])[:, None] + [0.0, 1.0]) / pieces[of, None]
    cut = panels[of]
    cut[:, :2] = panels[of, :1] * (1.0 - share) + panels[of, 1:2] * share
    kernel, series, number = kernel[:, of], series[:, of], pieces[of]
    for count in np.unique(pieces[pieces > 1]):
        here = np.flatnonzero(number == count)
        onto, restricted = _spread(int(count))
        values, sizes = products(kernel[:, here[::count]], onto), series[:, here[::count]] @ restricted
        kernel[:, here], series[:, here] = (one.reshape(len(kernel), -1, NODES) for one in (values, sizes))
    values, swing, most = _waves(problem, cut)
    found = (
        products(kernel, values),
        np.abs(values).sum(axis=-2),
        (series * swing).sum(axis=-1)[..., None] * most,
    )
    parts, covered, error = (np.add.reduceat(one, first, axis=1).swapaxes(0, 1) for one in found)
    return parts, covered, error


@lru_cache(maxsize=128)
def _spread(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices from a panel to its `number` equal pieces, shape (nodes, pieces * nodes).

    From the values at its nodes to those at theirs, and from the sizes of its coefficients to bounds of theirs.
    """
    middles = (2.0 * np.arange(number) + 1.0) / number - 1.0
    degrees = np.polynomial.legendre.legvander((middles[:, None] + _AT / number).ravel(), NODES - 1)
    bounds = np.abs(_to_legendre() @ degrees.reshape(number, NODES, NODES))
    return (degrees @ _to_legendre()).T, bounds.reshape(-1, NODES).T


def _waves(problem: Problem, panels: Array) -> tuple[Array, np.ndarray, np.ndarray]:
    """Return the weights of panels over which the waves turn little, shape (rows, panels, nodes, radii).

    With them `swing` (panels, degrees) and `most` (rows, panels, radii): a bound of the rule's error is the sum of the
    kernel's coefficients times `swing`, times `most`.

    The waves are a mean of e^{ikx}, |x| up to `span`, of total weight `load.weight`: their coefficient of degree m is
    at most weight phi^m / (2m - 1)!!, phi = span |half a panel|, and that of the kernel of degree j
    meets an error of the rule from m = 2n - j on. Far from k = 0 they are e^{+-ikx} times a factor that hardly changes
    within six halves: there their envelope replaces the weight. Off the axis both grow by e^{|Im k| span}.
    """
    load, r, span = problem.load, problem.r, _span(problem)
    half = (panels[:, 1] - panels[:, 0]) / 2.0
    k = nodes(panels)[0]
    if not np.any(panels[:, :2].imag):
        k, half = k.real, half.real  # Bessel functions of real numbers are cheaper
    values = bessels(load.orders, k[..., None] * r) * (load.transform(k) * (half[:, None] * _WEIGHTS))[..., None]
    ends, slope = wavenumbers(panels, panels[:, :2])
    half = np.abs(half)
    phi = half * np.abs(slope).max(axis=1) * span
    swing = phi[:, None] ** _DEGREES / _ODD_FACTORIALS
    swing = swing * (3.0 * half * np.exp(np.abs(ends.imag).max(axis=1) * span))[:, None]
    least, covers = ends.real.min(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2.0
    at = np.maximum(least, covers) / 2.0
    envelope = np.where(least > 6.0 * covers, 2.0 * load.envelope(at), np.inf)[:, None]
    return values, swing, np.minimum(envelope * bessel_bounds(load.orders, at[:, None] * r), load.weight)


def products(kernel: Array, waves: Array) -> Array:
    """Sum kernel (rows, panels, nodes) times waves (rows, panels, nodes, radii) over the nodes.

    By products of real matrices with two columns. A matrix by a complex vector starts BLAS's threads for each of them
    from 256 radii on.
    """
    turned = waves.swapaxes(-1, -2)
    pair = np.ascontiguousarray(kernel)[..., None].view(np.float64)
    if np.iscomplexobj(waves):
        by_re, by_im = (np.ascontiguousarray(part) @ pair for part in (turned.real, turned.imag))
        return (by_re.view(np.complex128) + 1j * by_im.view(np.complex128))[..., 0]
    return (turned @ pair).view(np.complex128)[..., 0]

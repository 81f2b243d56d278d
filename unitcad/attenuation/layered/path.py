"""The path of a Hankel integral in panels: rows of (a, b, base, turn), complex.

A panel runs from s = a to b, straight in s. The wavenumber is s itself, or, next to a branch point on the axis,
base + turn s^2, in which the kernel has no root any more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unitcad.attenuation.layered import waves as w

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
NODES = 16
"""Of a panel, but for the first ones of a damped medium."""
_FEWER = ((0.05, 8), (5e-3, 10))
"""From which rtol on so many do for those."""
_DAMPED = 0.1
"""Loss factor from which on a layer's poles are seen from afar."""
_STIFF = 100.0
"""Over the stiffest layer: a half-space whose poles lie next to 0, where panels are short."""
_ALIKE = 12.0
"""The last pole over the least wavenumber of a layer: up to that, no panel is longer than what is to be seen on it."""
_NEAR = 4.0 * PHASE
"""Up to the last pole: farther out, waves turn so much over a panel that few nodes save no time."""
_CLOSE = 4
"""Halvings between the first panel and those beyond the least wavenumber's pole, each a panel."""


def wavenumbers(panels: w.Array, s: w.Array) -> tuple[w.Array, w.Array]:
    """Return the wavenumbers (1/m) at s, a row a panel, and their slopes over s."""
    base, turn = panels[:, 2, None], panels[:, 3, None]
    if not np.any(turn):
        return s, np.ones_like(s)
    return np.where(turn == 0, s, base + turn * s * s), np.where(turn == 0, 1.0, 2.0 * turn * s)


def first_nodes(rtol: float, end: float, span: float, layers: Sequence[w.Material], half_space: w.Material) -> int:
    """Return how many nodes each panel has at first; end, span: the last pole (1/m), phase per unit wavenumber (m).

    Where all layers are damped, and their waves not too different, the kernel is smooth over each panel, and few nodes
    show it to a loose rtol.
    """
    stiffest = max((abs(m.shear) for m in layers), default=np.inf)
    bodies = layers if abs(half_space.shear) > _STIFF * stiffest else (*layers, half_space)
    damped = all(m.shear.imag >= _DAMPED * m.shear.real for m in bodies)
    if not damped or end * span > _NEAR or end > _ALIKE * min(abs(m.ks2) ** 0.5 for m in bodies):
        return NODES
    return next((count for least, count in _FEWER if rtol >= least), NODES)


def from_origin(end: float, stop: float, span: float, materials: tuple[w.Material, ...]) -> w.Array:
    """Return the panels from 0 to `stop`, beyond `end` and the first panel; span: phase per unit wavenumber (m).

    They are of one length up to `end`, but longer beyond the waves of all materials. The one at k = 0 is halved towards
    0 until it is shorter than the least wavenumber of a material: a stiff half-space's branch points and pole lie
    there, too small a feature for a long panel's last coefficients. Beyond them two of these halves are one panel. No
    tolerance is in it: panels of a tighter one are to be pieces of those of a looser one.
    """
    longest = PHASE / span
    line = np.linspace(0.0, end, max(_LEAST_PANELS, int(np.ceil(end / longest))) + 1)
    line = _thinned(line, _BEYOND * max(abs(m.ks2) ** 0.5 for m in materials))
    line = _continued(line if end > 0 else np.array([0.0, longest / 8.0]), stop, longest)
    shortest = min(abs(m.ks2) ** 0.5 * (m.eps**0.5 or 1.0) for m in materials if m.shear != 0)
    if 0.0 < shortest < line[1]:
        halvings = min(int(np.ceil(np.log2(line[1] / shortest))) + 1, _MAX_HALVINGS)
        close = np.arange(halvings, max(halvings - _CLOSE, 0), -1)
        times = np.concatenate([close, np.arange(close[-1] - 2, 0, -2), [0]])
        line = np.concatenate([[0.0], line[1] * 0.5**times, line[2:]])
    return _turned(line, _branch_points(materials[-1]), 1.0 / span)


def onwards(start: float, stop: float, span: float) -> w.Array:
    """Return the panels beyond all poles, from `start` to `stop`."""
    return _plain(_continued(np.array([start]), stop, PHASE / span))


def _thinned(line: np.ndarray, start: float) -> np.ndarray:
    """Leave out corners from `start` on, so that panels are as long as a third of the line, or the most pieces."""
    first = int(np.searchsorted(line, start))
    kept = np.arange(len(line) - 1, first, -min((len(line) - 1) // 3, MOST_PIECES))
    return np.concatenate([line[: first + 1], line[kept[::-1]]])


def _continued(line: np.ndarray, stop: float, longest: float) -> np.ndarray:
    """Continue the corners to `stop`, each panel as long as its distance from 0, if that is no more than it may be.

    There the kernel varies as slowly as that: what swings faster are the waves alone.
    """
    corners = list(line)
    while corners[-1] < stop and len(corners) < MAX_PANELS:
        corners.append(min(stop, corners[-1] + min(corners[-1], MOST_PIECES * longest)))
    return np.array(corners)


def _branch_points(half_space: w.Material) -> list[float]:
    """Return the branch points on the axis: those of a half-space without damping."""
    if half_space.shear == 0 or half_space.ks2.imag != 0 or half_space.ks2 == 0:
        return []
    ks = half_space.ks2.real**0.5
    return sorted({k for k in (half_space.eps**0.5 * ks, ks) if k > 0})


def _plain(line: np.ndarray) -> w.Array:
    panels = np.zeros((len(line) - 1, 4), dtype=np.complex128)
    panels[:, 0], panels[:, 1] = line[:-1], line[1:]
    return panels


def _turned(line: np.ndarray, branch_points: list[float], longest: float) -> w.Array:
    """Return the panels between the corners, those on both sides of each branch point in the square root there."""
    inside = [k for k in branch_points if k < line[-1]]
    if not inside:
        return _plain(line)
    others = [k for k in line if all(abs(k - one) > 1e-6 * one for one in inside)]
    line = np.unique([*others, *inside])
    panels = []
    for k in inside:
        i = int(np.searchsorted(line, k))
        # Half of what lies between two corners is each one's: the next may be a branch point too.
        low, high = max(k - longest, (line[i - 1] + k) / 2.0), min(k + longest, (k + line[i + 1]) / 2.0)
        panels += [[(k - low) ** 0.5, 0.0, k, -1.0], [0.0, (high - k) ** 0.5, k, 1.0]]
        line = np.concatenate([line[:i], [low, k, high], line[i + 1 :]])
    plain = _plain(line)
    at = np.isin(plain[:, 0].real, inside) | np.isin(plain[:, 1].real, inside)
    return np.concatenate([plain[~at], np.array(panels, dtype=np.complex128).reshape(-1, 4)])


def halved_towards(panels: w.Array, at: w.Array, times: np.ndarray) -> tuple[w.Array, np.ndarray]:
    """Cut each panel in two equal ones, and of these the one next to `at` again, so many times in all.

    at: in the panel's t, from -1 to 1, or beyond. Return the pieces, and which panel each is from.
    """
    of = np.arange(len(panels))
    pieces, origin = [panels[:0]], [of[:0]]
    while len(panels):
        right = (at.real > 0).astype(int)
        both = pieced(panels, np.stack([panels[:, 0], panels[:, :2].mean(axis=1), panels[:, 1]], axis=1))
        near, other = (both[2 * np.arange(len(panels)) + side] for side in (right, 1 - right))
        again = times > 1
        pieces += [other, near[~again]]
        origin += [of, of[~again]]
        panels, of, times = near[again], of[again], times[again] - 1
        at = 2.0 * at[again] - np.where(right[again], 1.0, -1.0)
    return np.concatenate(pieces), np.concatenate(origin)


def pieced(panels: w.Array, corners: w.Array) -> w.Array:
    """Return the pieces of each panel between its corners, shape (panels, pieces + 1)."""
    pieces = corners.shape[1] - 1
    ends = np.stack([corners[:, :-1].ravel(), corners[:, 1:].ravel()], axis=1)
    return np.concatenate([ends, np.repeat(panels[:, 2:], pieces, axis=0)], axis=1)

"""Detours of the path around single poles that lie on the real axis or next to it.

Where nothing is damped, or only a body that a wave hardly reaches, poles lie on the axis or closer to it than any
panel. Between two wavenumbers with one such pole the path leaves the axis, over two legs on the pole's other side.

A pole is where the kernel times (t - t_pole) is a polynomial of the panel's t, from -1 to 1, though the kernel is not:
the last Legendre coefficients of the two agree up to that factor. The side on which it belongs is that of its imaginary
part, or, where that is lost in rounding, that to which a little more loss moves it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from unitcad.attenuation.layered import waves as w
from unitcad.attenuation.layered.path import wavenumbers

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
    """The pole of each panel in its t, shape (n,), how far off it may be, and what of the last coefficients is left.

    rest (rows, n): of the kernel times (t - t_pole).
    """

    at: w.Array
    uncertainty: np.ndarray
    rest: np.ndarray


def poles(kernel: w.Array, nodes: np.ndarray, to_legendre: np.ndarray, k: np.ndarray) -> Poles:
    """Return the pole that each panel's kernel, shape (rows, panels, nodes), would have; k: wavenumber over half."""
    last = to_legendre[-_LAST:].T
    plain, turned = kernel @ last, (kernel * nodes) @ last
    size = np.sum(np.abs(plain) ** 2, axis=(0, 2))
    safe = np.where(size > 0, size, 1.0)
    at = np.sum(np.conj(plain) * turned, axis=(0, 2)) / safe
    left = np.abs(turned - at[:, None] * plain)
    uncertainty = np.sqrt(np.sum(left**2, axis=(0, 2)) / safe) + LOST * k
    return Poles(np.where(size > 0, at, np.inf), uncertainty, left.sum(axis=-1))


def around(
    panels: w.Array, found: Poles, longest: float, lossier: Callable[[w.Array, float], Poles]
) -> tuple[np.ndarray, w.Array]:
    """Return which panels, all on the axis, have a detour, and the five corners of each, shape (m, 5).

    longest: distance from the pole to the legs' feet at most (1/m); lossier(panel, loss) finds the pole of a medium
    with at least that loss factor in every body.
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

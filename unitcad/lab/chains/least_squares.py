"""Least squares on a few columns over many samples, by normal equations in pieces too small for a library's threads.

Threads that wait for each other cost more than the sums themselves on a loaded machine.
"""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Floats

HARMONICS = 3
PIECE = 256
"""Samples whose products are summed at a time."""
RESOLVED = 1.5
"""Periods of the difference that a record must hold for two lines to be told apart."""


def solve(columns: Floats, x: Floats, weight: Floats) -> Floats:
    """Return the coefficients of `columns` (k, n) that leave the least weighted squares of x (n)."""
    return solve_with_covariance(columns, x, weight)[0]


def solve_with_covariance(columns: Floats, x: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Return the coefficients (k) as `solve` does, and their covariance (k, k) for white noise of unit variance."""
    gram, right = np.zeros((len(columns), len(columns))), np.zeros(len(columns))
    for start in range(0, len(x), PIECE):
        piece = columns[:, start : start + PIECE]
        weighted = piece * weight[start : start + PIECE]
        gram += weighted @ piece.T
        right += weighted @ x[start : start + PIECE]
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    inverse = np.linalg.pinv(gram / scale / scale[:, None], rcond=1e-11, hermitian=True)
    return inverse @ (right / scale) / scale, inverse / scale / scale[:, None]


def line_columns(phase: Floats, frequency: float, rate: float) -> Floats:
    """Return cosine and sine (k, n) of a phase and of its harmonics below half the rate."""
    count = max(min(HARMONICS, int(0.5 * rate / max(frequency, 1e-9))), 1)
    turn: Floats = np.exp(1j * phase)
    turns: list[Floats] = [turn]
    for _ in range(count - 1):
        turns.append(turns[-1] * turn)
    return np.concatenate([[np.real(one), np.imag(one)] for one in turns])


def mains_orders(
    mains_hz: float, rate: float, lines: tuple[float, ...], length_s: float, spread_hz: float = 0.0
) -> list[int]:
    """Return the multiples of the mains' frequency that a record can tell from the lines and their harmonics.

    A line whose frequency moves by `spread_hz` needs as much more distance.
    """
    highest = int(min(0.45 * rate, 8 * mains_hz) / mains_hz)
    taken = [line * k for line in lines for k in range(1, HARMONICS + 1)]
    away = RESOLVED / length_s + spread_hz / 2
    return [m for m in range(1, highest + 1) if all(abs(m * mains_hz - one) > away for one in taken)]


def mains_columns(time: Floats, mains_hz: float, orders: list[int]) -> Floats:
    """Return cosine and sine (2 orders, n) of multiples of the mains' frequency."""
    if not orders:
        return np.empty((0, len(time)))
    turn = np.exp(2j * np.pi * mains_hz * time)
    columns, power = [], np.ones(len(time), complex)
    for order in range(1, max(orders) + 1):
        power = power * turn
        if order in orders:
            columns += [np.real(power), np.imag(power)]
    return np.array(columns)


def trend_columns(time: Floats) -> Floats:
    """Return a constant and a slope (2, n)."""
    return np.array([np.ones(len(time)), (time - time.mean()) / max(np.ptp(time), 1e-300)])

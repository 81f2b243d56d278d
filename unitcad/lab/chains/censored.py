"""Least squares' likelihood where some samples are only known to lie beyond a limit (Tobin 1958).

In the coefficients over the deviation and the inverse of the deviation the likelihood has one maximum (Olsen 1978).
"""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats

STEPS = 60
CLOSE = 1e-10
"""Newton's decrement at which the maximum is reached."""


def solve_censored(columns: Floats, x: Floats, use: Bools, side: Floats, limit: Floats) -> tuple[Floats, Floats]:
    """Return the coefficients (k) of `columns` (k, n), and their covariance (k, k) for noise of unit variance.

    Of the samples x (n) in `use`, those whose `side` is 1 lie above their `limit`, -1 below it; 0 are known.
    """
    known, beyond = use & (side == 0), use & (side != 0)
    a, y = columns[:, known], x[known]
    b = columns[:, beyond] * side[beyond]
    c = limit[beyond] * side[beyond]
    start = np.linalg.lstsq(columns[:, use].T, np.where(side == 0, x, limit)[use], rcond=None)[0]
    left = np.where(side == 0, x, limit)[use] - start @ columns[:, use]
    inverse = 1 / max(float(np.std(left)), 1e-12 * float(np.ptp(y)))
    at = np.append(start * inverse, inverse)
    # Rows that multiply (coefficients / deviation, 1 / deviation): the residual, and how far the line is beyond.
    rows, ahead = np.concatenate([-a, [y]]), np.concatenate([b, [-c]])
    gram, most = rows @ rows.T, 1e9 / float(np.ptp(y))
    value, slope, bend = _likelihood(at, rows, ahead, gram)
    for _ in range(STEPS):
        step = np.linalg.lstsq(bend, slope, rcond=1e-13)[0]
        decrement, size = float(slope @ step), 1.0
        while at[-1] + size * step[-1] <= 0:
            size /= 2
        fresh = _likelihood(at + size * step, rows, ahead, gram)
        while fresh[0] < value and size > 1e-6:
            size /= 2
            fresh = _likelihood(at + size * step, rows, ahead, gram)
        if fresh[0] < value:
            break
        at = at + size * step
        value, slope, bend = fresh
        if decrement < CLOSE or at[-1] > most:
            break
    found = at[:-1] / at[-1]
    # The coefficients are a quotient; times the inverse deviation gives the covariance for unit variance.
    to_coefficients = np.concatenate([np.eye(len(found)), -found[:, None]], axis=1)
    covariance = to_coefficients @ np.linalg.pinv(bend, hermitian=True) @ to_coefficients.T
    return found, covariance


def _likelihood(at: Floats, rows: Floats, ahead: Floats, gram: Floats) -> tuple[float, Floats, Floats]:
    """Return the logarithm of the likelihood, its gradient and its negative second derivative."""
    from scipy.special import log_ndtr

    residual, far = at @ rows, at @ ahead
    logs = log_ndtr(far)
    mills = np.exp(-0.5 * far**2 - 0.5 * np.log(2 * np.pi) - logs)
    value = rows.shape[1] * np.log(at[-1]) - 0.5 * float(residual @ residual) + float(logs.sum())
    slope = -rows @ residual + ahead @ mills
    slope[-1] += rows.shape[1] / at[-1]
    bend = gram + (ahead * (mills * (mills + far))) @ ahead.T
    bend[-1, -1] += rows.shape[1] / at[-1] ** 2
    return value, slope, bend

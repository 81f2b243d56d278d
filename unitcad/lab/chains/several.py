"""Several lines at once: each of constant frequency, refined together, where one line of varying phase leaves much."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from unitcad.geometry.arrays import Bools, Floats
from unitcad.lab.chains import least_squares, uncertainty
from unitcad.lab.chains.demodulation import spectrum
from unitcad.lab.chains.line_fit import Line, LineFit

BESIDE_HZ = 15.0
"""To either side of the strongest line, where others are looked for."""
LEAST = 0.05
"""Part of the strongest line's amplitude from which another one counts."""
MOST = 6
GAIN = 0.5
"""Part of the one line's squares that several must leave at most, to be taken in its place."""
STEPS = 12
SAME_PLACE, SAME_SIZE, SAME_PHASE = 0.4, 0.25, 0.4
"""How far lines to either side may be from a modulation's: periods of a record, logarithm of a ratio, rad."""


def several_lines(
    x: Floats, residual: Floats, time: Floats, use: Bools, fit: LineFit, rate: float, mains_hz: float
) -> LineFit | None:
    """Return the fit of several lines to samples x without mains, of which one line leaves `residual`.

    None where one line explains them as well. The amplitude is then the strongest line's.
    """
    if not fit.snr > 0:
        return None
    x = np.where(use, x, 0.0)
    first, last = np.flatnonzero(use)[[0, -1]]
    part, at, weight = x[first : last + 1], time[first : last + 1], use[first : last + 1].astype(float)
    length = at[-1] - at[0]
    noise = fit.amplitude / fit.snr if np.isfinite(fit.snr) else 0.0
    least = max(LEAST * fit.amplitude, 8 * noise * np.sqrt(2 / max(weight.sum(), 1)))
    alone = noise**2
    frequency, size = spectrum(residual[first : last + 1] * weight, rate)
    if not np.any(size[np.abs(frequency - fit.frequency_hz) < BESIDE_HZ] > least):
        return None
    found: list[float] = []
    best = None
    for _ in range(MOST):
        frequency, size = spectrum((part if best is None else best.left) * weight, rate)
        beside = np.abs(frequency - fit.frequency_hz) < BESIDE_HZ
        peak = int(np.argmax(np.where(beside, size, 0.0)))
        if size[peak] < least or any(abs(frequency[peak] - one) < 0.5 / length for one in found):
            break
        found = [*found, float(frequency[peak])]
        best = _refined(part, at, weight, found)
        found = list(best.frequencies)
    if best is None or len(found) < 2:
        return None
    frequencies, values = best.frequencies, best.values
    left = _without_others(best.left, at, weight, frequencies, rate, mains_hz)
    squares = float(np.mean(left[weight > 0] ** 2))
    deviation = float(np.sqrt(squares))
    order = np.argsort(-np.abs(values))
    strong = [i for i in order if abs(values[i]) > LEAST * abs(values[order[0]])]
    if squares > GAIN * alone or len(strong) < 2:
        return None
    if (swing := _modulation(frequencies[strong], values[strong], length)) > 0:
        ratio = fit.amplitude / deviation if deviation > 0 else float("inf")
        return replace(fit, scatter=max(fit.scatter, swing), snr=ratio)
    lines = tuple(_line(float(frequencies[i]), complex(values[i]), left, weight, at, rate) for i in strong)
    main = lines[0]
    return replace(
        fit, amplitude=main.amplitude, u=float(np.hypot(main.u, fit.u_mains)), value=complex(values[order[0]]),
        frequency_hz=main.frequency_hz, drift=0.0, snr=main.amplitude / deviation if deviation > 0 else float("inf"),
        lines=lines,
    )  # fmt: skip


@dataclass(frozen=True)
class _Lines:
    """Lines fitted together: frequencies in Hz, complex amplitudes at the samples' middle, what they leave."""

    frequencies: Floats
    values: NDArray[np.complex128]
    left: Floats


def _modulation(frequencies: Floats, values: NDArray[np.complex128], length_s: float) -> float:
    """Return the standard deviation of an amplitude whose modulation the lines are, over its mean; 0 where they aren't.

    `frequencies` and `values` have the strongest line first. The others are then pairs of equal strength as far below
    it as above, in phase with each other about its phase: of lines that have nothing to do with each other few are.
    """
    rest = list(range(1, len(values)))
    power = 0.0
    while rest:
        i = rest.pop(0)
        mirrored = 2 * frequencies[0] - frequencies[i]
        j = min(rest, key=lambda k: abs(frequencies[k] - mirrored), default=None)
        if j is None or abs(frequencies[j] - mirrored) > SAME_PLACE / length_s:
            return 0.0
        one, other = values[i], values[j]
        turn = np.angle(one * other / values[0] ** 2)
        if abs(np.log(abs(one / other))) > SAME_SIZE or abs(turn) > SAME_PHASE:
            return 0.0
        rest.remove(j)
        power += (abs(one) + abs(other)) ** 2 / 2
    return float(np.sqrt(power) / abs(values[0]))


def _without_others(
    left: Floats, time: Floats, weight: Floats, frequencies: Floats, rate: float, mains_hz: float
) -> Floats:
    """Return what lines leave without their harmonics, the sums of some of them and the mains, which are no noise."""
    highest = least_squares.HARMONICS
    sums = [sum(some) for count in range(2, highest + 1) for some in combinations_with_replacement(frequencies, count)]
    length = float(time[-1] - time[0])
    orders = least_squares.mains_orders(mains_hz, rate, tuple(map(float, frequencies)), length)
    kept = [order * mains_hz for order in orders]
    for one in sums:
        if one < 0.5 * rate and all(abs(one - other) > 0.5 / length for other in kept):
            kept.append(float(one))
    turns = [np.exp(2j * np.pi * one * (time - time.mean())) for one in kept]
    base = np.concatenate([*([turn.real, turn.imag] for turn in turns), least_squares.trend_columns(time)])
    return left - least_squares.solve(base, left, weight) @ base


def _refined(x: Floats, time: Floats, weight: Floats, frequencies: list[float]) -> _Lines:
    """Return the lines after Gauss-Newton steps over all their frequencies at once."""
    omega = 2 * np.pi * np.array(frequencies)
    middle = time.mean()
    length = max(time[-1] - time[0], 1e-9)
    count = len(omega)
    for step in range(STEPS + 1):
        turns = np.exp(1j * omega[:, None] * (time - middle))
        lines = np.empty((2 * count, len(time)))
        lines[::2], lines[1::2] = turns.real, turns.imag
        base = np.concatenate([lines, least_squares.trend_columns(time)])
        found = least_squares.solve(base, x, weight)
        residual = x - found @ base
        if step == STEPS:
            break
        # d/d omega of a cos + b sin is t (-a sin + b cos)
        slopes = (time - middle) * (
            found[1 : 2 * count : 2, None] * turns.real - found[: 2 * count : 2, None] * turns.imag
        )
        change = least_squares.solve(np.concatenate([base, slopes]), x, weight)[-count:]
        change = np.clip(change, -np.pi / length, np.pi / length)
        omega = omega + change
        if np.all(np.abs(change) * length < 1e-6):
            break
    return _Lines(omega / (2 * np.pi), found[: 2 * count : 2] - 1j * found[1 : 2 * count : 2], residual)


def _line(frequency: float, value: complex, left: Floats, weight: Floats, time: Floats, rate: float) -> Line:
    """Return a line with its uncertainty, by the noise beside it and the scatter of its blocks."""
    turned = left * weight * np.exp(-2j * np.pi * frequency * (time - time.mean()))
    noise = uncertainty.noise(turned, weight > 0, rate)
    parts = uncertainty.blocks(value, turned, weight > 0, rate)
    towards = np.real(parts * np.conj(value)) / abs(value)
    wander, _ = uncertainty.of_mean(towards, noise**2 * len(towards))
    return Line(float(frequency), float(abs(value)), float(np.hypot(noise, wander)))

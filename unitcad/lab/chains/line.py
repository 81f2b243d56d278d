"""The chain `line`: a line of slowly varying phase, fitted with its harmonics, the mains, an offset and a slope.

1. Coarse frequency by a spectrum. 2. Demodulate, cut the spin-up, smooth the phase. 3. Least squares on three
harmonics, the lines of the mains that the record resolves, offset and slope, again without the samples that lie far
off. Mains and outliers are then taken away and 2 and 3 repeated once. 4. The amplitude's uncertainty is that of the
noise's density at the line over the record's length, of the scatter of blocks, and of mains that can't be told apart.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from unitcad.geometry.arrays import Bools, Floats
from unitcad.lab.chains import demodulation, hidden_mains, least_squares, uncertainty
from unitcad.lab.chains.censored import solve_censored
from unitcad.lab.chains.chain import Chain, ChainTable
from unitcad.lab.chains.clipping import LOWEST, NEAR, clip_mask
from unitcad.lab.chains.demodulation import Phase
from unitcad.lab.chains.line_fit import LineFit
from unitcad.lab.chains.running_part import MOST_RUNNING, running_part
from unitcad.lab.chains.several import several_lines

BAND_HZ = (60.0, 250.0)
FAR = 4.5
"""Robust standard deviations of the residual beyond which a sample is left out, which noise exceeds here and there."""
FALSE_ALARM = 1e-3
"""Part of the records of normal noise alone in which a sample may be called a drop-out, at most."""
LEAST_FOLLOWED = 1.0
"""Signal to noise from which short spectra tell the line's frequency to a hertz."""
ROUNDS = 6
LEAST_SAMPLES = 16


@dataclass(frozen=True)
class Mains:
    """The mains' frequency in Hz, and by multiple the amplitude that a motor-off record has, in the signal's unit."""

    frequency_hz: float = 50.0
    blank: tuple[tuple[int, float], ...] = ()

    def amplitude(self, order: int) -> float | None:
        """Return a multiple's amplitude in the motor-off record; None without such a record."""
        return dict(self.blank).get(order, 0.0) if self.blank else None


@dataclass(frozen=True)
class _Solution:
    """One least-squares solution of a record."""

    value: complex
    residual: Floats
    mains: Floats
    mains_beyond: Floats
    """The mains of the fit, continued over the whole record."""
    line: Floats
    good: Bools
    widening: float
    """How much wider the line's amplitude is than if all columns were orthogonal and no sample left out."""
    beyond_noise: bool
    """Whether a sample that was left out lies further off than noise does."""


def chain(table: ChainTable) -> Chain:
    """Return the chain, whose amplitude is that of the fit that every record has."""
    return Chain("line", lambda x, rate, fit: fit.amplitude, each_line=True)


def fit_line(
    x: Floats,
    rate: float,
    band: tuple[float, float] = BAND_HZ,
    mains: Mains | None = None,
    full_scale: float | None = None,
    phase: Phase | None = None,
    span: tuple[float, float] | None = None,
) -> LineFit | None:
    """Return the line of samples x (n) at `rate` in Hz; None where the band holds no line.

    With `phase` and `span`, which are another channel's, the line has that channel's phase and its own amplitude. Where
    the line is there for less than about two thirds of the samples, it is fitted to the longest stretch that has it.
    """
    mains = mains or Mains()
    good = np.isfinite(x)
    if span is not None:
        short = span[1] - span[0] <= MOST_RUNNING * len(x) / rate
        part = (int(span[0] * rate), int(np.ceil(span[1] * rate)) + 1) if short else None
    elif good.sum() < LEAST_SAMPLES:
        return None
    else:
        part = running_part(x - np.median(x[good]), good, rate, band, mains.frequency_hz)
    if part is None:
        return _fit_line(x, rate, band, mains, full_scale, phase, span)
    start = part[0] / rate
    within = None if span is None else (span[0] - start, span[1] - start)
    fit = _fit_line(x[slice(*part)], rate, band, mains, full_scale, phase and phase.later(start), within)
    if fit is None or fit.phase is None:
        return fit
    return replace(fit, start_s=fit.start_s + start, end_s=fit.end_s + start, phase=phase or fit.phase.later(-start))


def _fit_line(
    x: Floats,
    rate: float,
    band: tuple[float, float],
    mains: Mains,
    full_scale: float | None,
    phase: Phase | None,
    span: tuple[float, float] | None,
) -> LineFit | None:
    """Return the line of samples that hold it for most of their length; see `fit_line`."""
    good = np.isfinite(x)
    x = np.where(good, x, 0.0)
    if good.sum() < LEAST_SAMPLES or not np.ptp(x[good]) > 0:
        return None
    middle = float(np.median(x[good]))
    x = np.where(good, x - middle, 0.0)
    cut, _, part = clip_mask(x, good, None if full_scale is None else (full_scale - middle, full_scale + middle))
    if part < LOWEST:  # nothing is left that says how high the line went
        cut = np.zeros(len(x), bool)
    deviation = 1.4826 * np.median(np.abs(x[good]))
    known = good & ~cut
    if deviation > 0 and part >= LOWEST:
        known &= np.abs(x) < 6 * deviation
    time = np.arange(len(x)) / rate
    removed = 0.0
    found: tuple[_Solution, Phase, tuple[float, float]] | None = None
    for attempt in range(2):
        if phase is not None and span is not None:
            frequency = _frequency(phase, span)[0]
            solution = _solve(x, time, rate, known, good & ~cut, cut, span, phase, frequency, mains)
            found = (solution, phase, span) if solution else None
        else:
            frequency = demodulation.coarse_frequency(np.where(known, x, 0.0), rate, band, mains.frequency_hz)
            found = _twice(x, time, rate, known, good & ~cut, cut, frequency, mains) if frequency > 0 else None
        if found is None:
            return None
        hidden = None if attempt else _hidden(found[0], time, rate, found[2], found[1], mains, phase is None)
        if hidden is None:
            break
        x, removed = x - hidden[0], hidden[1]
    assert found is not None
    solution, phase, span = found
    fit = _summary(solution, time, rate, phase, span, mains, removed)
    masked = float(np.mean(~solution.good[good & ~cut]))
    fit = replace(
        fit,
        masked=masked,
        dropped=masked if solution.beyond_noise else 0.0,
        missing=float(np.mean(~good)),
        clipped=part,
    )
    inside = (time >= span[0]) & (time <= span[1])
    if fit.snr > LEAST_FOLLOWED:
        clean = np.where(solution.good, x - solution.mains_beyond, solution.line)
        beyond = demodulation.frequencies_beyond(clean, rate, span, fit.frequency_hz)
        fit = replace(fit, drift=_drift_while_running(fit, beyond))
    use = inside & solution.good
    return several_lines(x - solution.mains, solution.residual, time, use, fit, rate, mains.frequency_hz) or fit


def _drift_while_running(fit: LineFit, beyond: list[float]) -> float:
    """Return the range of the frequency over its mean, with what it is where the line runs on beyond its span."""
    assert fit.phase is not None
    if not beyond:
        return fit.drift
    within = _frequencies(fit.phase, (fit.start_s, fit.end_s))
    return float(np.ptp([*within, *beyond])) / fit.frequency_hz


def _hidden(
    solution: _Solution, time: Floats, rate: float, span: tuple[float, float], phase: Phase, mains: Mains, free: bool
) -> tuple[Floats, float] | None:
    """Return the mains that the record alone can't tell from the line, and what they leave in its amplitude's u.

    None where there are none, or nothing is known of them. `free`: the phase was fitted to the line.
    """
    order = _hidden_order(phase, span, rate, mains)
    amplitude = mains.amplitude(order) if order else None
    if not amplitude:
        return None
    inside = (time >= span[0]) & (time <= span[1])
    here, good = time[inside], solution.good[inside]
    angle = phase.at(here)
    residual = solution.residual[inside] * np.exp(-1j * angle)
    deviation = uncertainty.noise(residual, good, rate) * np.sqrt(good.sum())
    line, weight = uncertainty.blocks_of(solution.value, residual, good, rate, hidden_mains.BLOCK_S)
    middle = uncertainty.blocks_of(0.0, here, np.ones(len(here), bool), rate, hidden_mains.BLOCK_S)[0] / 2
    kept = weight > 0
    turned = np.interp(middle, here, angle)
    hertz = order * mains.frequency_hz
    noise = deviation / np.sqrt(weight[kept])
    found = hidden_mains.hidden_mains(line[kept], middle[kept], turned[kept], noise, hertz, amplitude, free)
    wave = 2 * np.pi * hertz * time
    return found.cosine * np.cos(wave) + found.sine * np.sin(wave), found.u


def _hidden_order(phase: Phase, span: tuple[float, float], rate: float, mains: Mains) -> int:
    """Return the multiple of the mains' frequency that a record can't tell from its line; 0 where there is none."""
    frequency, spread = _frequency(phase, span)
    order = round(frequency / mains.frequency_hz)
    told = least_squares.mains_orders(mains.frequency_hz, rate, (frequency,), span[1] - span[0], spread)
    return 0 if order in told else order


def _twice(
    x: Floats,
    time: Floats,
    rate: float,
    known: Bools,
    allowed: Bools,
    cut: Bools,
    frequency: float,
    mains: Mains,
) -> tuple[_Solution, Phase, tuple[float, float]] | None:
    """Demodulate and fit; then again without the mains and the drop-outs of the first fit."""
    clean, use, found = x, known, None
    for _ in range(2):
        at, line = demodulation.envelope(clean, use, rate, frequency)
        if len(at) < 4:
            return None
        span = demodulation.steady_span(at, line, len(x) / rate)
        inside = (at >= span[0]) & (at <= span[1])
        phase = _best_phase(clean, time, rate, use, span, demodulation.phases(at[inside], line[inside], frequency))
        if phase is None:
            return found
        frequency = _frequency(phase, span)[0]
        solution = _solve(x, time, rate, known, allowed, cut, span, phase, frequency, mains)
        if solution is None:
            return found
        found = solution, phase, span
        left_out = (time >= span[0]) & (time <= span[1]) & ~solution.good
        clean, use = np.where(left_out, solution.line, x - solution.mains), use | left_out
    return found


def _best_phase(
    x: Floats, time: Floats, rate: float, use: Bools, span: tuple[float, float], candidates: Iterable[Phase]
) -> Phase | None:
    """Return the phase that explains the samples best for its number of parameters (Schwarz's criterion), if any."""
    inside = slice(int(np.searchsorted(time, span[0])), int(np.searchsorted(time, span[1], side="right")))
    here, part, weight = time[inside], x[inside], use[inside].astype(float)
    scores = []
    for candidate in candidates:
        line = least_squares.line_columns(candidate.at(here), 0.5 * rate, rate)
        columns = np.concatenate([line, least_squares.trend_columns(here)])
        left = part - least_squares.solve(columns, part, weight) @ columns
        squares = float(np.sum(weight * left**2)) / max(weight.sum(), 1)
        score = weight.sum() * np.log(max(squares, 1e-300)) + candidate.parameters * np.log(max(weight.sum(), 2))
        scores.append((score, len(scores), candidate))
    return min(scores)[-1] if scores else None


def _frequency(phase: Phase, span: tuple[float, float]) -> tuple[float, float]:
    """Return the mean of a phase's frequency over a span, and the range of its half-second means, in Hz."""
    steps = _frequencies(phase, span)
    return float(steps.mean()), float(np.ptp(steps))


def _frequencies(phase: Phase, span: tuple[float, float]) -> Floats:
    """Return the half-second means of a phase's frequency over a span, in Hz."""
    edges = np.linspace(*span, max(round((span[1] - span[0]) / 0.5), 2) + 1)
    return np.diff(phase.at(edges)) / np.diff(edges) / (2 * np.pi)


def _solve(
    x: Floats,
    time: Floats,
    rate: float,
    known: Bools,
    allowed: Bools,
    cut: Bools,
    span: tuple[float, float],
    phase: Phase,
    frequency: float,
    mains: Mains,
) -> _Solution | None:
    """Fit a line of given phase over a span, without the samples whose residual is far off; None without samples.

    Of samples that are `cut` the fit knows that the line lies beyond them. To leave them out, and those near them by
    their own noise, would bias it; and where the rate is a small multiple of the frequency, too few phases are left.
    """
    first, last = np.searchsorted(time, span[0]), np.searchsorted(time, span[1], side="right")
    inside = slice(int(first), int(last))
    here, part = time[inside], x[inside]
    spread = _frequency(phase, span)[1]
    orders = least_squares.mains_orders(mains.frequency_hz, rate, (frequency,), span[1] - span[0], spread)
    columns = np.concatenate(
        [
            least_squares.line_columns(phase.at(here), frequency, rate),
            least_squares.mains_columns(here, mains.frequency_hz, orders),
            least_squares.trend_columns(here),
        ]
    )
    use, beyond = known[inside].copy(), cut[inside].copy()
    if use.sum() < LEAST_SAMPLES:
        return None
    side = np.where(beyond, np.sign(part), 0.0)
    ends = [(1 - NEAR) * float(np.max(sign * x[cut], initial=0.0)) for sign in (1, -1)]
    for _ in range(ROUNDS):
        if beyond.any():
            plateau = np.where(side > 0, ends[0], -ends[1])
            found, covariance = solve_censored(columns, part, use | beyond, side, plateau)
        else:
            found, covariance = least_squares.solve_with_covariance(columns, part, use.astype(float))
        residual = part - found @ columns
        limit = FAR * 1.4826 * np.median(np.abs(residual[use]))
        beyond &= residual * side < limit  # a drop-out may touch the plateau too
        far = (np.abs(residual) > limit) & ~beyond if limit > 0 else np.zeros(len(part), bool)
        far[1:] |= far[:-1].copy()
        far[:-1] |= far[1:].copy()
        fresh = allowed[inside] & ~far
        if fresh.sum() < 0.3 * len(part) or np.array_equal(fresh, use):
            break
        use = fresh
    deviation = 1.4826 * float(np.median(np.abs(residual[use])))
    left_out = np.abs(residual[allowed[inside] & ~beyond])
    beyond_noise = bool(deviation > 0 and np.any(left_out > most_of_noise(len(left_out)) * deviation))
    removed, line = np.zeros(len(x)), np.zeros(len(x))
    lines = len(columns) - 2 - 2 * len(orders)
    removed[inside] = found[lines:-2] @ columns[lines:-2]
    beyond_span = removed if span == (0.0, len(x) / rate) else np.zeros(len(x))
    if orders and beyond_span is not removed:
        beyond_span = found[lines:-2] @ least_squares.mains_columns(time, mains.frequency_hz, orders)
    line[inside] = found[:lines] @ columns[:lines] + found[-2:] @ columns[-2:]
    kept = known.copy()
    kept[inside] = use
    left = np.zeros(len(x))
    left[inside] = np.where(use, residual, 0.0)
    towards = found[:2] / max(float(np.hypot(*found[:2])), 1e-300)
    widening = np.sqrt(max(float(towards @ covariance[:2, :2] @ towards) * use.sum() / 2, 1.0))
    return _Solution(
        complex(found[0], -found[1]), left, removed, beyond_span, line, kept, float(widening), beyond_noise
    )


def most_of_noise(count: int) -> float:
    """Return how far, in robust standard deviations, the largest of `count` samples of normal noise lies at most.

    One record in 1 / FALSE_ALARM exceeds it at most, with the deviation estimated from the same samples: three standard
    errors of a median of absolute values, 1.17 over the root of the count, are added.
    """
    from scipy.stats import norm

    return float(norm.isf(FALSE_ALARM / 4 / count)) * (1 + 3 * 1.17 / np.sqrt(count))


def _summary(
    solution: _Solution, time: Floats, rate: float, phase: Phase, span: tuple[float, float], mains: Mains, share: float
) -> LineFit:
    """Return a solution's figures with their uncertainty; `share` is the part by mains that can't be told apart."""
    inside = (time >= span[0]) & (time <= span[1])
    good = solution.good[inside]
    turn = np.exp(-1j * phase.at(time[inside]))
    residual = solution.residual[inside] * turn
    noise = solution.widening * uncertainty.noise(residual, good, rate)
    blocks = uncertainty.blocks(solution.value, residual, good, rate)
    amplitude = abs(solution.value)
    towards = np.real(blocks * np.conj(solution.value)) / max(amplitude, 1e-300)
    wander, scatter = uncertainty.of_mean(towards, noise**2 * len(towards))
    frequency, spread = _frequency(phase, span)
    order = _hidden_order(phase, span, rate, mains)
    deviation = float(np.sqrt(np.mean(solution.residual[inside][good] ** 2)))
    return LineFit(
        amplitude=amplitude,
        u=float(np.sqrt(noise**2 + wander**2 + share**2)),
        u_noise=float(noise),
        u_mains=share,
        value=solution.value,
        frequency_hz=frequency,
        drift=spread / frequency,
        snr=amplitude / deviation if deviation > 0 else float("inf"),
        scatter=scatter / amplitude if amplitude > 0 else float("inf"),
        start_s=span[0],
        end_s=span[1],
        mains_hz=order * mains.frequency_hz,
        phase=phase,
        blocks=tuple(complex(b) for b in blocks),
    )

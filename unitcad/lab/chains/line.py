"""The chain `line`: a line of slowly varying phase, fitted with its harmonics, the mains, an offset and a slope.

1. Coarse frequency by a spectrum. 2. Demodulate, cut the spin-up, smooth the phase. 3. Least squares on three
harmonics, the lines of the mains that the record resolves, offset and slope, again without outliers. Mains and outliers
are then removed and 2 and 3 repeated once. 4. The amplitude's uncertainty is that of the noise's density at the line
over the record's length, of the scatter of blocks, and of mains that can't be separated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.signal import oaconvolve
from scipy.stats import t as student

from unitcad.geometry.arrays import Bools, Floats
from unitcad.lab.chains import Chain, ChainTable, Line, LineFit, Mains, Phase

BAND_HZ = (60.0, 250.0)
NO_MAINS = Mains()
HARMONICS = 3
FAR = 4.5
"""Robust standard deviations of the residual beyond which a sample is excluded; noise exceeds it now and then."""
DROP_OUT = 6.2
"""Robust standard deviations beyond which a sample is a drop-out: at most one record of noise in a thousand has one."""
ROUNDS = 6
LEAST_SAMPLES = 16
RESOLVED = 1.5
"""Periods of the difference that a record needs to separate two lines."""


def chain(table: ChainTable) -> Chain:
    """Return the chain, whose amplitude is that of the fit that every record has."""
    return Chain("line", lambda x, rate, fit: fit.amplitude)


def fit_line(
    x: Floats,
    rate: float,
    band: tuple[float, float] = BAND_HZ,
    mains: Mains = NO_MAINS,
    full_scale: float | None = None,
    phase: Phase | None = None,
    span: tuple[float, float] | None = None,
) -> LineFit | None:
    """Return the line of samples x (n) at `rate` in Hz; None if the band has no line.

    With `phase` and `span`, which are another channel's, the line has that channel's phase and its own amplitude. If
    the line is there for less than about two thirds of the samples, the fit takes the longest stretch that has it.
    """
    good = np.isfinite(x)
    if span is not None:
        short = span[1] - span[0] <= MOST_RUNNING * len(x) / rate
        part = (int(span[0] * rate), int(np.ceil(span[1] * rate)) + 1) if short else None
    elif good.sum() < LEAST_SAMPLES:
        return None
    else:
        part = running_part(x - np.median(x[good]), good, rate, band, mains.frequency_hz)
    if part is None:
        return _fit_running(x, rate, band, mains, full_scale, phase, span)
    start = part[0] / rate
    within = None if span is None else (span[0] - start, span[1] - start)
    fit = _fit_running(x[slice(*part)], rate, band, mains, full_scale, phase and phase.later(start), within)
    if fit is None or fit.phase is None:
        return fit
    return replace(fit, start_s=fit.start_s + start, end_s=fit.end_s + start, phase=phase or fit.phase.later(-start))


@dataclass(frozen=True)
class _Solution:
    """One least-squares solution of a record."""

    phase: Phase
    span: tuple[float, float]
    frequency: float
    value: complex
    residual: Floats
    mains: Floats
    line: Floats
    good: Bools
    widening: float
    """How much wider the line's amplitude is than if all columns were orthogonal and no sample excluded."""
    beyond_noise: bool
    """Whether an excluded sample exceeds noise."""


def _fit_running(
    x: Floats,
    rate: float,
    band: tuple[float, float],
    mains: Mains,
    full_scale: float | None,
    phase: Phase | None,
    span: tuple[float, float] | None,
) -> LineFit | None:
    """Return the line of samples that have it for most of their length; see `fit_line`."""
    good = np.isfinite(x)
    x = np.where(good, x, 0.0)
    if good.sum() < LEAST_SAMPLES or not np.ptp(x[good]) > 0:
        return None
    middle = float(np.median(x[good]))
    x = np.where(good, x - middle, 0.0)
    clipped = clip_level(x, good, None if full_scale is None else (full_scale - middle, full_scale + middle))
    deviation = 1.4826 * np.median(np.abs(x[good]))
    known = good & (np.abs(x) < 6 * deviation) if deviation > 0 else good
    time = np.arange(len(x)) / rate

    def solved(phase: Phase, span: tuple[float, float]) -> _Solution | None:
        """Fit a line of given phase over a span, without the samples of a far residual; None if too few are left."""
        inside = _within(time, span)
        here, part = time[inside], x[inside]
        frequencies = _frequencies(phase, span)
        frequency = float(frequencies.mean())
        orders = mains_orders(mains.frequency_hz, rate, (frequency,), span[1] - span[0], float(np.ptp(frequencies)))
        line = line_columns(phase.at(here), frequency, rate)
        columns = np.concatenate([line, mains_columns(here, mains.frequency_hz, orders), trend_columns(here)])
        use = known[inside].copy()
        if use.sum() < LEAST_SAMPLES:
            return None
        for _ in range(ROUNDS):
            found, covariance = solve(columns, part, use)
            residual = part - found @ columns
            limit = FAR * 1.4826 * np.median(np.abs(residual[use]))
            far = np.abs(residual) > limit if limit > 0 else np.zeros(len(part), bool)
            far[1:] |= far[:-1].copy()
            far[:-1] |= far[1:].copy()
            fresh = good[inside] & ~far
            if fresh.sum() < 0.3 * len(part) or np.array_equal(fresh, use):
                break
            use = fresh
        deviation = 1.4826 * float(np.median(np.abs(residual[use])))
        left_out = np.abs(residual[good[inside]])
        hum, shape, left, kept = np.zeros(len(x)), np.zeros(len(x)), np.zeros(len(x)), known.copy()
        count = len(line)
        hum[inside] = found[count:-2] @ columns[count:-2]
        shape[inside] = found[:count] @ line + found[-2:] @ columns[-2:]
        kept[inside] = use
        left[inside] = np.where(use, residual, 0.0)
        towards = found[:2] / max(float(np.hypot(*found[:2])), 1e-300)
        widening = np.sqrt(max(float(towards @ covariance[:2, :2] @ towards) * use.sum() / 2, 1.0))
        far_off = deviation > 0 and np.any(left_out > DROP_OUT * deviation)
        value = complex(found[0], -found[1])
        return _Solution(phase, span, frequency, value, left, hum, shape, kept, float(widening), bool(far_off))

    if phase is not None and span is not None:
        found = solved(phase, span)
    else:  # demodulate and fit; then again without the mains and the drop-outs of the first fit
        found, clean, use = None, x, known
        frequency = coarse_frequency(np.where(known, x, 0.0), rate, band, mains.frequency_hz)
        for _ in range(2 if frequency > 0 else 0):
            at, line = envelope(clean, use, rate, frequency)
            if len(at) < 4:
                return None
            span = steady_span(at, line, len(x) / rate)
            inside = (at >= span[0]) & (at <= span[1])
            best = _best_phase(clean, time, rate, use, span, phases(at[inside], line[inside], frequency))
            fresh = best and solved(best, span)
            if fresh is None:
                break
            found, frequency = fresh, fresh.frequency
            left_out = (time >= span[0]) & (time <= span[1]) & ~found.good
            clean, use = np.where(left_out, found.line, x - found.mains), use | left_out
    if found is None:
        return None
    fit = _summary(found, time, rate, mains)
    masked, dropped = float(np.mean(~found.good[good])), found.beyond_noise
    fit = replace(
        fit, masked=masked, dropped=masked if dropped else 0.0, missing=float(np.mean(~good)), clipped=clipped
    )
    use = (time >= found.span[0]) & (time <= found.span[1]) & found.good
    return _with_lines(x - found.mains, found.residual, time, use, fit, rate)


def _summary(found: _Solution, time: Floats, rate: float, mains: Mains) -> LineFit:
    """Return a solution's figures with their uncertainty.

    Mains that the record can't tell from the line have any phase: their part in u is that of a motor-off record.
    """
    span = found.span
    inside = (time >= span[0]) & (time <= span[1])
    good = found.good[inside]
    residual = found.residual[inside] * np.exp(-1j * found.phase.at(time[inside]))
    noise = found.widening * noise_beside(residual, good, rate)
    blocks = block_means(found.value, residual, good, rate)
    amplitude = abs(found.value)
    towards = np.real(blocks * np.conj(found.value)) / max(amplitude, 1e-300)
    wander, scatter = of_mean(towards, noise**2 * len(towards))
    frequency, spread = found.frequency, float(np.ptp(_frequencies(found.phase, span)))
    order = round(frequency / mains.frequency_hz)
    if order in mains_orders(mains.frequency_hz, rate, (frequency,), span[1] - span[0], spread):
        order = 0
    share = (mains.amplitude(order) or 0.0) / np.sqrt(2) if order else 0.0
    deviation = float(np.sqrt(np.mean(found.residual[inside][good] ** 2)))
    return LineFit(
        amplitude=amplitude,
        u=float(np.sqrt(noise**2 + wander**2 + share**2)),
        u_noise=float(noise),
        u_mains=float(share),
        value=found.value,
        frequency_hz=frequency,
        drift=spread / frequency,
        snr=amplitude / deviation if deviation > 0 else float("inf"),
        scatter=scatter / amplitude if amplitude > 0 else float("inf"),
        start_s=span[0],
        end_s=span[1],
        mains_hz=order * mains.frequency_hz,
        phase=found.phase,
    )


def _best_phase(
    x: Floats, time: Floats, rate: float, use: Bools, span: tuple[float, float], candidates: Iterator[Phase]
) -> Phase | None:
    """Return the phase that explains the samples best for its number of parameters (Schwarz's criterion), if any."""
    inside = _within(time, span)
    here, part, weight = time[inside], x[inside], use[inside]
    best, least = None, np.inf
    for candidate in candidates:
        columns = np.concatenate([line_columns(candidate.at(here), 0.5 * rate, rate), trend_columns(here)])
        left = part - solve(columns, part, weight)[0] @ columns
        squares = float(np.sum(weight * left**2)) / max(weight.sum(), 1)
        score = weight.sum() * np.log(max(squares, 1e-300)) + candidate.parameters * np.log(max(weight.sum(), 2))
        if score < least:
            best, least = candidate, score
    return best


def _within(time: Floats, span: tuple[float, float]) -> slice:
    """Return the samples with a time in a span, ends included."""
    return slice(int(np.searchsorted(time, span[0])), int(np.searchsorted(time, span[1], side="right")))


def _frequencies(phase: Phase, span: tuple[float, float]) -> Floats:
    """Return the half-second means of a phase's frequency over a span, in Hz."""
    edges = np.linspace(*span, max(round((span[1] - span[0]) / 0.5), 2) + 1)
    return np.diff(phase.at(edges)) / np.diff(edges) / (2 * np.pi)


# Least squares.


def solve(columns: Floats, x: Floats, weight: Floats | Bools) -> tuple[Floats, Floats]:
    """Return the coefficients of `columns` (k, n) that leave the least weighted squares of x (n), and their covariance.

    The covariance (k, k) is that of white noise of unit variance.
    """
    weighted = columns * weight
    gram = weighted @ columns.T
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    inverse = np.linalg.pinv(gram / scale / scale[:, None], rcond=1e-11, hermitian=True) / scale / scale[:, None]
    return inverse @ (weighted @ x), inverse


def _waves(turns: Floats) -> Floats:
    """Return cosine and sine (2 k, n) of complex turns (k, n)."""
    return np.stack([np.real(turns), np.imag(turns)], 1).reshape(2 * len(turns), turns.shape[1])


def line_columns(phase: Floats, frequency: float, rate: float) -> Floats:
    """Return cosine and sine (k, n) of a phase and of its harmonics below half the rate."""
    count = max(min(HARMONICS, int(0.5 * rate / max(frequency, 1e-9))), 1)
    return _waves(np.exp(1j * np.arange(1, count + 1)[:, None] * phase))


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
    return _waves(np.exp(2j * np.pi * mains_hz * np.array(orders, float)[:, None] * time))


def trend_columns(time: Floats) -> Floats:
    """Return a constant and a slope (2, n)."""
    return np.array([np.ones(len(time)), (time - time.mean()) / max(np.ptp(time), 1e-300)])


# Samples that are cut off at a level, by a converter or by the range that was set.

NEAR = 0.02
"""Part of the peak below it in which samples are counted."""
CROWD = 0.13
"""Part of the samples within NEAR of a peak beyond which it is a plateau: twice that of a sine."""
LEAST_VALUES = 8
"""Different values below which a channel shows its converter's steps and no motion that a limit could cut off."""


def clip_level(x: Floats, good: Bools, full_scale: tuple[float, float] | None = None) -> float:
    """Return the level at which samples about zero are cut off, over their true amplitude; infinite without a plateau.

    The true amplitude is that of a sine which is cut off as often; the level is 0 if that is half of the time or more.
    One plateau is enough, and the lower of two counts. `full_scale` is the height of the positive and the negative
    limit, if they are known.
    """
    part = float("inf")
    low, high = np.quantile(x[good], [0.05, 0.95])
    fine = len(np.unique(x[good])) >= LEAST_VALUES
    for sign, limit in zip((1.0, -1.0), full_scale or (None, None), strict=True):
        signed = sign * x
        peak = float(signed[good].max())
        below = NEAR * peak
        if 4 * peak <= high - low:  # cut off near the middle: the median is on the plateau, the band one of the range
            if high <= low:
                continue
            below = NEAR * (high - low) / 2
        elif peak <= 0:
            continue
        near = good & (signed >= peak - below)
        at_limit = limit is not None and peak >= 0.999 * limit
        if at_limit or (fine and (near.sum() > CROWD * good.sum() or (peak > 0 and _repeats(signed[good], peak)))):
            part = min(part, max(float(np.cos(np.pi * near.sum() / good.sum())) / (1 - NEAR), 0.0))
    return part


def _repeats(x: Floats, peak: float) -> bool:
    """Tell whether the largest value comes more often than the resolution of the samples explains for a sine."""
    at_peak = np.count_nonzero(x == peak)
    if at_peak < max(8, 0.01 * len(x)):
        return False
    steps = np.diff(np.unique(x[x > 0.5 * peak]))
    step = float(np.median(steps)) if len(steps) else peak
    return at_peak > len(x) * (0.01 + 2 * np.arccos(max(1 - step / peak, -1.0)) / np.pi)


# From samples to a line's slowly varying phase.

WINDOW_S = 0.25
"""Length of the Hann window that smooths a demodulated signal; it passes about 4 Hz to either side."""
STEADY = 0.9
"""Part of the median envelope that a line reaches before its record is used, and keeps to its end."""
NO_LINE = 1e-6
"""Part of a line's largest envelope below which its phase says nothing."""
KNOTS_S = (0.5, 0.25)
"""Distances of the knots of the phase's splines that are tried."""


def coarse_frequency(x: Floats, rate: float, band: tuple[float, float], mains_hz: float) -> float:
    """Return the frequency of the strongest line in a band, in Hz, by the peak of a spectrum with a Hann window.

    A multiple of the mains' frequency is chosen only if it is more than three times as strong as any other line.
    """
    frequency, size = spectrum(x, rate)
    inside = (frequency >= band[0]) & (frequency <= min(band[1], 0.45 * rate))
    if not inside.any() or not np.any(size[inside] > 0):
        return 0.0
    width = 1.5 * rate / len(x)
    off = inside & (np.abs(frequency - mains_hz * np.round(frequency / mains_hz)) > width)
    peak = int(np.argmax(np.where(inside, size, 0.0)))
    if off.any() and (other := int(np.argmax(np.where(off, size, 0.0)))) != peak and size[other] > size[peak] / 3:
        peak = other
    place = float(peak)  # and between the bins, by a parabola through the logarithms
    if 0 < peak < len(size) - 1 and min(size[peak - 1 : peak + 2]) > 0:
        low, top, high = np.log(size[peak - 1 : peak + 2])
        bend = low - 2 * top + high
        place += 0.5 * (low - high) / bend if bend < 0 else 0.0
    return place * rate / _length(len(x))


def spectrum(x: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return frequencies in Hz and amplitudes in the signal's unit, by a Hann window, padded to twice the length."""
    window = np.hanning(len(x))
    size = np.abs(np.fft.rfft((x - x.mean()) * window, _length(len(x)))) * 2 / max(window.sum(), 1e-300)
    return np.fft.rfftfreq(_length(len(x)), 1 / rate), size


def _length(count: int) -> int:
    return 2 ** (int(count - 1).bit_length() + 1)


def envelope(x: Floats, good: Bools, rate: float, frequency: float) -> tuple[Floats, Floats]:
    """Return times in s and the line's complex amplitude there; samples that are not `good` count for nothing."""

    count = min(max(int(WINDOW_S * rate), 8), len(x) // 2)
    window = np.hanning(count + 2)[1:-1]
    time = np.arange(len(x)) / rate
    turned = np.where(good, x, 0.0) * np.exp(-2j * np.pi * frequency * time)
    weight = oaconvolve(good.astype(float), window, mode="same")
    step = max(count // 8, 1)
    full = weight[::step] > 0.5 * window.sum()
    if full.sum() < 4:
        return np.empty(0), np.empty(0, complex)
    centre = oaconvolve(good * time, window, mode="same")[::step][full] / weight[::step][full]
    return centre, 2 * oaconvolve(turned, window, mode="same")[::step][full] / weight[::step][full]


def steady_span(time: Floats, line: Floats, length_s: float) -> tuple[float, float]:
    """Return the span in s in which the line has spun up: ends below STEADY of its median are cut."""
    size = np.abs(line)
    enough = np.flatnonzero(size >= STEADY * np.median(size))
    first, last = int(enough[0]), int(enough[-1])
    start = float(time[first] + WINDOW_S / 2) if first else 0.0
    end = float(time[last] - WINDOW_S / 2) if last < len(time) - 1 else length_s
    return (start, end) if end - start > 0.25 * length_s else (0.0, length_s)


def phases(time: Floats, line: Floats, frequency: float) -> Iterator[Phase]:
    """Yield the line's phase, of rising flexibility: constant frequency, linear, cubic, splines.

    Nothing if fewer than three points have a line. A spline has a point between any two of its knots.
    """

    there = np.abs(line) > NO_LINE * np.abs(line).max(initial=0.0)
    time, line = time[there], line[there]
    if len(time) < 3:
        return
    angle = np.unwrap(np.angle(line))
    weight = np.abs(line) / np.abs(line).max()
    middle, half = (time[0] + time[-1]) / 2, max((time[-1] - time[0]) / 2, 1e-9)
    omega = 2 * np.pi * frequency
    for degree in (1, 2, 4):
        if degree + 1 < len(time):
            fitted = np.polynomial.Polynomial.fit(time, angle, degree, w=weight, domain=[middle - half, middle + half])
            yield Phase(lambda t, fitted=fitted: omega * t + fitted(t), degree + 1)
    for distance in KNOTS_S:
        pieces = round((time[-1] - time[0]) / distance)
        if pieces < 2 or pieces + 4 > len(time) / 2:
            continue
        ends = np.linspace(time[0], time[-1], pieces + 1)
        if np.histogram(time, ends)[0].min() == 0:  # a gap: the spline is unknown there
            continue
        inner = ends[1:-1]
        knots = np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4])
        spline = make_lsq_spline(time, angle, knots, 3, w=weight)

        def straight_beyond(t: Floats, spline: Callable[..., Floats] = spline) -> Floats:
            inside = np.clip(t, time[0], time[-1])
            return omega * t + spline(inside) + (t - inside) * np.where(t != inside, spline(inside, 1), 0.0)

        yield Phase(straight_beyond, pieces + 3)


# The part of a record in which a motor runs, for records with more silence than half, whose medians are of the silence.

MOST_RUNNING = 0.65
"""Fraction of a record up to which only the running part is fitted: beyond, medians of all samples are of the line."""
ON = 0.5
"""Part of the envelope's largest value from which the motor runs."""
SILENT = 0.2
"""Part of it below which the envelope stays in the silence, once it has had FALL_S to fall; a beat falls slowly."""
QUIET = 0.4
"""The same for the rest of the silence without mains: a line that has only changed its frequency is louder."""
LOWEST_HZ = 20.0
FALL_S = 0.75 * WINDOW_S
"""How long the envelope of a line that ends takes to fall, with a margin."""
LEAST_SILENT = 0.2
"""Part of a record that is silent at least."""
LOUDEST, BEYOND_LOUDEST = 0.92, 1.5
"""Quantile of the samples' size, and how many times it a sample counts at most: drop-outs are no motion."""


def running_part(
    x: Floats, good: Bools, rate: float, band: tuple[float, float], mains_hz: float
) -> tuple[int, int] | None:
    """Return the first sample of the longest stretch in which the line of a record runs, and the one after its last.

    `x` has no offset; samples that are not `good` count for nothing. None if the line runs for most of the record,
    or the rest is not silent.
    """
    most = BEYOND_LOUDEST * float(np.quantile(np.abs(x[good]), LOUDEST))
    x = np.clip(np.where(good, x, 0.0), -most, most)
    frequency = coarse_frequency(x, rate, band, mains_hz)
    if not frequency > 0:
        return None
    time, line = envelope(x, good, rate, frequency)
    if len(time) < 4:
        return None
    size = np.abs(line)
    on = size >= ON * size.max()
    if on.mean() > MOST_RUNNING:
        return None
    near = np.zeros(len(on), bool)
    for first, last in _runs(on):
        near |= (time >= time[first] - FALL_S) & (time <= time[last] + FALL_S)
    if (~near).mean() < LEAST_SILENT or size[~near].max() > SILENT * size.max():
        return None
    first, last = max(_runs(~near), key=lambda run: run[1] - run[0])
    silence = x[int(time[first] * rate) : int(time[last] * rate) + 1]
    if _loudest(silence, rate, band, mains_hz) > QUIET * size.max():
        return None
    first, last = max(_runs(on), key=lambda run: run[1] - run[0])
    start = 0 if first == 0 else int(time[first] * rate)
    return start, len(x) if last == len(on) - 1 else int(time[last] * rate) + 1


def _runs(on: Bools) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def _loudest(x: Floats, rate: float, band: tuple[float, float], mains_hz: float) -> float:
    """Return the amplitude of a line with all power of samples in a band, or of the strongest line outside, if more.

    The mains and frequencies below LOWEST_HZ are excluded.
    """
    if len(x) < 16:
        return 0.0
    window = np.hanning(len(x) + 2)[1:-1]
    turned = np.abs(np.fft.rfft((x - x.mean()) * window))
    hertz = np.fft.rfftfreq(len(x), 1 / rate)
    own = np.abs(hertz - mains_hz * np.round(hertz / mains_hz)) > 2 * rate / len(x)
    inside = own & (hertz >= band[0]) & (hertz <= band[1])
    whole = 2 * float(np.sqrt(np.sum(turned[inside] ** 2) / (len(x) * np.sum(window**2))))
    strongest = 2 * float(turned[own & (hertz > LOWEST_HZ)].max(initial=0.0)) / window.sum()
    return max(whole, strongest)


# The standard uncertainty of a line's amplitude, from the residual of its fit.

NOISE_HZ = 15.0
"""Distance from the line, to either side, at which the noise's density is taken."""
BLOCK_S = 0.2
LEAST_BLOCKS = 6


def noise_beside(residual: Floats, good: Bools, rate: float) -> float:
    """Return the standard deviation of the amplitude from the noise next to the line.

    `residual` (n) is the residual of the fit, turned back by the line's phase and 0 for excluded samples. The noise
    N of the sum over n samples has the mean square of the sums at neighbouring frequencies; the amplitude is 2/n times
    its real part.
    """
    count, used = len(residual), int(good.sum())
    power = np.abs(np.fft.fft(residual)) ** 2
    away = np.abs(np.fft.fftfreq(count, 1 / rate))
    least = 2 * rate / count
    beside = (away > least) & (away < max(NOISE_HZ, 12 * least))
    if not beside.any():
        beside = away > 0
    values = power[beside]
    density = float(np.median(values)) / np.log(2) if len(values) >= 20 else float(values.mean())
    density = max(density, min(float(values.mean()), 1.5 * density))
    return float(np.sqrt(2 * density / used) / np.sqrt(used))


def of_mean(values: Floats, noise_variance: float) -> tuple[float, float]:
    """Return the standard uncertainty of the mean of successive values beyond their noise, and their own deviation.

    The correlation of neighbours makes fewer of them independent; its estimate is too small in short series by about
    (1 + 3 r)/n (Kendall 1954). Few values make the deviation uncertain: it is widened as Student's t is.
    """

    count = len(values)
    left = values - values.mean()
    total = float(left @ left)
    variance = total / (count - 1)
    slow = variance - noise_variance
    if slow <= 0 or total <= 0:
        return 0.0, float(np.sqrt(variance))
    found = float(left[1:] @ left[:-1]) / total
    correlation = min(max(found + (1 + 3 * max(found, 0.0)) / count, 0.0), 0.9)
    independent = max(count * (1 - correlation) / (1 + correlation), 2.0)
    widened = float(student.ppf(0.97725, max(independent - 1, 1.5))) / 2
    return float(np.sqrt(slow / independent) * widened), float(np.sqrt(variance))


def block_means(value: complex, residual: Floats, good: Bools, rate: float) -> Floats:
    """Return the line's complex amplitude in equal blocks: the whole record's and the mean of the residual there."""
    count = max(round(len(residual) / rate / BLOCK_S), LEAST_BLOCKS)
    edges = np.linspace(0, len(residual), count + 1).astype(int)[:-1]
    return value + 2 * np.add.reduceat(residual, edges) / np.maximum(np.add.reduceat(good.astype(float), edges), 1)


# Other lines next to the strongest: another motor that runs.

BESIDE_HZ = 15.0
"""Distance from the strongest line, to either side, within which others are searched."""
LEAST_LINE = 0.05
"""Part of the strongest line's amplitude from which another one counts."""
OVER_NOISE = 8
"""Standard deviations of noise from which a peak of the spectrum counts as a line."""
MOST_LINES = 6
MOST_LEFT = 0.5
"""Largest fraction of the residual power of a single line, beyond noise, that several steady lines may leave."""
STEPS = 12
SAME_PLACE, SAME_SIZE, SAME_PHASE = 0.4, 0.25, 0.4
"""How far lines to either side may be from a modulation's: periods of a record, logarithm of a ratio, rad."""


def _with_lines(x: Floats, residual: Floats, time: Floats, use: Bools, fit: LineFit, rate: float) -> LineFit:
    """Return the fit with the steady lines of samples x without mains, if a single line explains them less well.

    `residual` is the rest that the single line leaves. Lines at equal distances to either side may be one line of
    varying amplitude, whose standard deviation over the mean is then the fit's scatter.
    """
    if not fit.snr > 0:
        return fit
    first, last = np.flatnonzero(use)[[0, -1]]
    inside = slice(first, last + 1)
    weight, time = use[inside].astype(float), time[inside]
    x, length = x[inside] * weight, time[-1] - time[0]
    noise = fit.amplitude / fit.snr if np.isfinite(fit.snr) else 0.0
    least = max(LEAST_LINE * fit.amplitude, OVER_NOISE * noise * np.sqrt(2 / max(weight.sum(), 1)))
    frequency, single = spectrum(residual[inside] * weight, rate)
    beside = np.abs(frequency - fit.frequency_hz) < BESIDE_HZ
    if not np.any(single[beside] > least):
        return fit
    hertz, values, left = np.empty(0), np.empty(0, complex), x
    for _ in range(MOST_LINES):
        size = np.where(beside, spectrum(left * weight, rate)[1], 0.0)
        peak = int(np.argmax(size))
        if size[peak] < least or np.any(np.abs(frequency[peak] - hertz) < 0.5 / length):
            break
        hertz, values, left = _refined(x, time, weight, np.append(hertz, frequency[peak]))
    powers = [sizes[beside] ** 2 for sizes in (single, spectrum(left * weight, rate)[1])]
    floor = len(powers[1]) * float(np.median(powers[1])) / np.log(2)  # white noise, whose power is exponential
    order = np.argsort(-np.abs(values))
    strong = order[np.abs(values[order]) > LEAST_LINE * np.abs(values).max(initial=0.0)]
    if len(strong) < 2 or powers[1].sum() - floor > MOST_LEFT * (powers[0].sum() - floor):
        return fit
    hertz, values = hertz[strong], values[strong]
    if (swing := _modulation(hertz, values, length)) > 0:
        deviation = float(np.sqrt(np.mean(left[weight > 0] ** 2)))
        snr = fit.amplitude / deviation if deviation > 0 else float("inf")
        return replace(fit, scatter=max(fit.scatter, swing), snr=snr)
    lines = (Line(float(f), float(abs(value))) for f, value in zip(hertz, values, strict=True))
    return replace(fit, lines=tuple(lines))


def _modulation(hertz: Floats, values: Floats, length_s: float) -> float:
    """Return the standard deviation of an amplitude whose modulation the lines are, over its mean; 0 if they aren't.

    `hertz` and `values` have the strongest line first. The others are then pairs of equal strength as far below it as
    above, in phase with each other about its phase: of lines that have nothing to do with each other few are.
    """
    rest = list(range(1, len(values)))
    power = 0.0
    while rest:
        i = rest.pop(0)
        off = [abs(hertz[k] + hertz[i] - 2 * hertz[0]) for k in rest]
        if not rest or min(off) > SAME_PLACE / length_s:
            return 0.0
        one, other = values[i], values[rest.pop(int(np.argmin(off)))]
        if abs(np.log(abs(one / other))) > SAME_SIZE or abs(np.angle(one * other / values[0] ** 2)) > SAME_PHASE:
            return 0.0
        power += (abs(one) + abs(other)) ** 2 / 2
    return float(np.sqrt(power) / abs(values[0]))


def _refined(x: Floats, time: Floats, weight: Floats, hertz: Floats) -> tuple[Floats, Floats, Floats]:
    """Return frequencies (k), complex amplitudes at the middle and the residual, after Gauss-Newton steps over all."""
    omega, time = 2 * np.pi * hertz, time - time.mean()
    length = max(np.ptp(time), 1e-9)
    for step in range(STEPS + 1):
        turns = np.exp(1j * omega[:, None] * time)
        base = np.concatenate([_waves(turns), trend_columns(time)])
        found = solve(base, x, weight)[0]
        values = found[: 2 * len(omega) : 2] - 1j * found[1 : 2 * len(omega) : 2]
        left = x - found @ base
        if step == STEPS:
            break
        # d/d omega of a cos + b sin is t (-a sin + b cos)
        slopes = time * np.real(1j * values[:, None] * turns)
        change = solve(np.concatenate([base, slopes]), x, weight)[0][-len(omega) :]
        change = np.clip(change, -np.pi / length, np.pi / length)
        omega = omega + change
        if np.all(np.abs(change) * length < 1e-6):
            break
    return omega / (2 * np.pi), values, left

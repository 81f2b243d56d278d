"""The chain `line`: a line of slowly varying phase, fitted with its harmonics, the mains, an offset and a slope.

1. Coarse frequency by a spectrum. 2. Demodulate, cut the spin-up, smooth the phase. 3. Least squares on three
harmonics, the lines of the mains that the record resolves, offset and slope, again without outliers. Mains and outliers
are then removed and 2 and 3 repeated once. 4. The amplitude's uncertainty is that of the noise's density at the line
over the record's length, and of the scatter of blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.signal import oaconvolve
from scipy.stats import t as student

from unitcad.geometry.arrays import Bools, Floats

Phase = Callable[[Floats], Floats]
"""A line's phase in rad over time in s."""

BAND_HZ = (60.0, 250.0)
HARMONICS = 3
FAR = 4.5
"""Robust standard deviations of the residual beyond which a sample is excluded; noise exceeds it now and then."""
DROP_OUT = 6.2
"""Robust standard deviations beyond which a sample is a drop-out: at most one record of noise in a thousand has one."""
ROUNDS = 6
LEAST_SAMPLES = 16
RESOLVED = 1.5
"""Periods of the difference that a record needs to separate two lines."""


@dataclass(frozen=True)
class LineFit:
    """A record's line: amplitude (peak) with its standard uncertainty, in the signal's unit.

    `u_noise` is the part of `u` from the noise next to the line. `value` is the complex amplitude against `phase`.
    `drift` is the range of the frequency over its mean, `snr` the amplitude over the standard deviation of the residual
    without the second line, `scatter` the standard deviation of the amplitude of blocks over their mean. `masked` is
    the fraction of samples excluded by their residual, `dropped` the same if one of them exceeds noise, otherwise 0;
    `missing` the fraction without numbers.
    """

    amplitude: float
    u: float
    u_noise: float
    value: complex
    frequency_hz: float
    drift: float
    snr: float
    scatter: float
    start_s: float
    end_s: float
    masked: float
    dropped: float
    missing: float
    mains_hz: float
    """The multiple of the mains' frequency that the record can't tell from the line; 0 if there is none."""
    second_hz: float
    """The frequency of another line; 0 if there is none."""
    second: float
    """Its amplitude over this one's."""
    phase: Phase = field(compare=False, repr=False)


def fit_line(
    x: Floats,
    rate: float,
    band: tuple[float, float] = BAND_HZ,
    mains_hz: float = 50.0,
    motor: LineFit | None = None,
    whole_band: tuple[float, float] | None = None,
) -> LineFit | None:
    """Return the line of samples x (n) at `rate` in Hz; None if the band has no line.

    A second line is looked for in `whole_band`, by default the band. With `motor`, the fit of another channel of the
    record, the line has that channel's phase and its own amplitude.
    """
    good = np.isfinite(x)
    if good.sum() < LEAST_SAMPLES or not np.ptp(x[good]) > 0:
        return None
    time = np.arange(len(x)) / rate
    middle = float(np.median(x[good]))
    x = np.where(good, x - middle, 0.0)
    deviation = 1.4826 * np.median(np.abs(x[good]))
    known = good & (np.abs(x) < 6 * deviation) if deviation > 0 else good

    def solved(phase: Phase, span: tuple[float, float]) -> tuple[LineFit, Floats, Bools] | None:
        """Fit a line of given phase over a span, without the samples of a far residual; None if too few are left.

        Return with it the samples without mains, outliers replaced by the fit, and which of them may be used.
        """
        inside = _within(time, span)
        here, part, length = time[inside], x[inside], span[1] - span[0]
        edges = np.linspace(*span, max(round(length / 0.5), 2) + 1)
        frequencies = np.diff(phase(edges)) / np.diff(edges) / (2 * np.pi)
        frequency, spread = float(frequencies.mean()), float(np.ptp(frequencies))
        orders = mains_orders(mains_hz, rate, (frequency,), length, spread)
        line = line_columns(phase(here), frequency, rate)
        mains = _waves(np.exp(2j * np.pi * mains_hz * np.array(orders, float)[:, None] * here))
        columns = np.concatenate([line, mains, trend_columns(here)])
        use = known[inside]
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
        usual = 1.4826 * float(np.median(np.abs(residual[use])))
        beyond_noise = usual > 0 and np.any(np.abs(residual[good[inside]]) > DROP_OUT * usual)
        clean, usable, kept, count = x.copy(), known.copy(), known.copy(), len(line)
        shape = found[:count] @ line + found[-2:] @ columns[-2:]
        clean[inside] = np.where(use, part - found[count:-2] @ columns[count:-2], shape)
        usable[inside] |= ~use
        kept[inside] = use
        masked = float(np.mean(~kept[good]))

        value = complex(found[0], -found[1])
        amplitude = max(abs(value), 1e-300)
        towards = found[:2] / amplitude
        widening = np.sqrt(max(float(towards @ covariance[:2, :2] @ towards) * use.sum() / 2, 1.0))
        turned = np.where(use, residual, 0.0) * np.exp(-1j * phase(here))
        noise = float(widening * noise_beside(turned, use, rate))
        blocks = np.real(block_means(value, turned, use, rate) * np.conj(value)) / amplitude
        wander, scatter = of_mean(blocks, noise**2 * len(blocks))
        deviation = float(np.sqrt(np.mean(residual[use] ** 2)))
        least = max(LEAST_LINE * amplitude, OVER_NOISE * deviation * np.sqrt(2 / use.sum()))
        beside, size = line_beside(turned, rate, least)
        if not beside and not size:
            beside, size = line_apart(turned, rate, LEAST_LINE * amplitude, frequency, whole_band or band, mains_hz)
        second, modulation = (size, 0.0) if beside else (0.0, size)
        noise_only = float(np.sqrt(max(deviation**2 - second**2 / 2, 1e-12 * deviation**2)))
        order = round(frequency / mains_hz)
        order = 0 if order in orders else order
        fit = LineFit(
            amplitude=abs(value),
            u=float(np.hypot(noise, wander)),
            u_noise=noise,
            value=value,
            frequency_hz=frequency,
            drift=spread / frequency,
            snr=abs(value) / noise_only if deviation > 0 else float("inf"),
            scatter=max(scatter, np.sqrt(2) * modulation) / abs(value) if value else float("inf"),
            start_s=span[0],
            end_s=span[1],
            masked=masked,
            dropped=masked if beyond_noise else 0.0,
            missing=float(np.mean(~good)),
            mains_hz=order * mains_hz,
            second_hz=frequency + beside if beside else 0.0,
            second=second / amplitude,
            phase=phase,
        )
        return fit, clean, usable

    if motor is not None:
        found = solved(motor.phase, (motor.start_s, motor.end_s))
        return found and found[0]
    # Demodulate and fit; then again without the mains and the drop-outs of the first fit.
    fit, clean, usable = None, x, known
    frequency = coarse_frequency(np.where(known, x, 0.0), rate, band, mains_hz)
    for _ in range(2 if frequency > 0 else 0):
        at, line = envelope(clean, usable, time, rate, frequency)
        if len(at) < 4:
            return None
        span = steady_span(at, line, (0.0, len(x) / rate))
        steady = (at >= span[0]) & (at <= span[1])
        phase = _best_phase(clean, time, rate, usable, span, phases(at[steady], line[steady], frequency))
        found = solved(phase, span) if phase else None
        if found is None:
            break
        fit, clean, usable = found
        frequency = fit.frequency_hz
    return fit


def _best_phase(
    x: Floats,
    time: Floats,
    rate: float,
    use: Bools,
    span: tuple[float, float],
    candidates: Iterator[tuple[Phase, int]],
) -> Phase | None:
    """Return the phase that explains the samples best for its number of parameters (Schwarz's criterion), if any."""
    inside = _within(time, span)
    here, part, weight = time[inside], x[inside], use[inside]
    best, least = None, np.inf
    for candidate, parameters in candidates:
        columns = np.concatenate([line_columns(candidate(here), 0.5 * rate, rate), trend_columns(here)])
        left = part - solve(columns, part, weight)[0] @ columns
        squares = float(np.sum(weight * left**2)) / max(weight.sum(), 1)
        score = weight.sum() * np.log(max(squares, 1e-300)) + parameters * np.log(max(weight.sum(), 2))
        if score < least:
            best, least = candidate, score
    return best


def _within(time: Floats, span: tuple[float, float]) -> slice:
    """Return the samples with a time in a span, ends included."""
    return slice(int(np.searchsorted(time, span[0])), int(np.searchsorted(time, span[1], side="right")))


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


def clip_level(x: Floats) -> float:
    """Return the level at which samples are cut off, over their true amplitude; infinite without a plateau.

    The true amplitude is that of a sine which is cut off as often; the level is 0 if that is half of the time or more.
    One plateau is enough, and the lower of two counts.
    """
    part, x = float("inf"), x[np.isfinite(x)]
    if len(x) < LEAST_SAMPLES or len(np.unique(x)) < LEAST_VALUES:
        return part
    x = x - np.median(x)
    low, high = np.quantile(x, [0.05, 0.95])
    for signed in (x, -x):
        peak = float(signed.max())
        below = NEAR * peak
        if 4 * peak <= high - low:  # cut off near the middle: the median is on the plateau, the band one of the range
            if high <= low:
                continue
            below = NEAR * (high - low) / 2
        elif peak <= 0:
            continue
        near = np.count_nonzero(signed >= peak - below)
        if near > CROWD * len(x) or (peak > 0 and _repeats(signed, peak)):
            part = min(part, max(float(np.cos(np.pi * near / len(x))) / (1 - NEAR), 0.0))
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
    tops = np.zeros(len(size), bool)  # the skirt of a line outside the band is none in it
    tops[1:-1] = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])
    inside = inside & tops if np.any(inside & tops) else inside
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


def envelope(x: Floats, good: Bools, time: Floats, rate: float, frequency: float) -> tuple[Floats, Floats]:
    """Return times in s and the line's complex amplitude there; samples that are not `good` count for nothing."""
    count = min(max(int(WINDOW_S * rate), 8), len(x) // 2)
    window = np.hanning(count + 2)[1:-1]
    turned = np.where(good, x, 0.0) * np.exp(-2j * np.pi * frequency * time)
    weight = oaconvolve(good.astype(float), window, mode="same")
    step = max(count // 8, 1)
    full = weight[::step] > 0.5 * window.sum()
    if full.sum() < 4:
        return np.empty(0), np.empty(0, complex)
    centre = oaconvolve(good * time, window, mode="same")[::step][full] / weight[::step][full]
    return centre, 2 * oaconvolve(turned, window, mode="same")[::step][full] / weight[::step][full]


def steady_span(time: Floats, line: Floats, whole: tuple[float, float]) -> tuple[float, float]:
    """Return the span in s in which the line has spun up: ends of the whole below STEADY of its median are cut."""
    size = np.abs(line)
    enough = np.flatnonzero(size >= STEADY * np.median(size))
    first, last = int(enough[0]), int(enough[-1])
    start = float(time[first] + WINDOW_S / 2) if first else whole[0]
    end = float(time[last] - WINDOW_S / 2) if last < len(time) - 1 else whole[1]
    return (start, end) if end - start > 0.25 * (whole[1] - whole[0]) else whole


def phases(time: Floats, line: Floats, frequency: float) -> Iterator[tuple[Phase, int]]:
    """Yield the line's phase and its number of parameters: constant frequency, linear, cubic, splines.

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
            yield (lambda t, fitted=fitted: omega * t + fitted(t)), degree + 1
    for distance in KNOTS_S:
        pieces = round((time[-1] - time[0]) / distance)
        if pieces < 2 or pieces + 4 > len(time) / 2:
            continue
        ends = np.linspace(time[0], time[-1], pieces + 1)
        if np.histogram(time, ends)[0].min() == 0:  # a gap: the spline is unknown there
            continue
        knots = np.concatenate([[time[0]] * 3, ends, [time[-1]] * 3])
        spline = make_lsq_spline(time, angle, knots, 3, w=weight)

        def straight_beyond(t: Floats, spline: Callable[..., Floats] = spline) -> Floats:
            inside = np.clip(t, time[0], time[-1])
            return omega * t + spline(inside) + (t - inside) * np.where(t != inside, spline(inside, 1), 0.0)

        yield straight_beyond, pieces + 3


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


# A second line: another motor that runs.

BESIDE_HZ = 15.0
"""Distance from the strongest line, to either side, within which a second one may be taken for the first."""
LEAST_LINE = 0.05
"""Part of the strongest line's amplitude from which another one counts."""
OVER_NOISE = 8
"""Standard deviations of noise from which a peak of the spectrum counts as a line."""
OVER_MEDIAN = 6.0
"""Medians of the spectrum's size around it from which a peak is a line: of 1,000 bins of noise the largest has 3.2."""
MOST_MIRRORED = 0.25
"""Part of a second line's size that the spectrum has as far on the other side of the first; of a modulation all."""
OWN_MULTIPLES = (0.5, 2.0, 3.0, 4.0, 5.0)
"""Lines of the same motor: harmonics, and a rattle at every second turn."""


def line_beside(residual: Floats, rate: float, least: float) -> tuple[float, float]:
    """Return the distance of a second line from the first in Hz and its size; 0 and the size of a modulation, or 0.

    `residual` is that of the fit, turned back by the line's phase; `least` the least size that counts. A second line is
    on one side of the first, a modulation of the amplitude on both. A beat slower than about 2 Hz looks like a
    modulation: the line's phase follows it.
    """
    distance, size = _turned_spectrum(residual, rate)
    peak = int(np.argmax(np.where(np.abs(distance) < BESIDE_HZ, size, 0.0)))
    if size[peak] < least:
        return 0.0, 0.0
    return (float(distance[peak]) if size[-peak] < MOST_MIRRORED * size[peak] else 0.0), float(size[peak])


def line_apart(
    residual: Floats, rate: float, least: float, hertz: float, band: tuple[float, float], mains_hz: float
) -> tuple[float, float]:
    """Return what `line_beside` does, of a second line in a band that is farther away from the first one at `hertz`.

    A multiple of the mains' frequency, and a harmonic of the first line, is no second one.
    """
    distance, size = _turned_spectrum(residual, rate)
    at, near = distance + hertz, max(1.0, 2.5 * rate / len(residual))
    counts = (np.abs(distance) >= BESIDE_HZ) & (at >= band[0]) & (at <= min(band[1], 0.45 * rate))
    counts &= ~near_multiple(at, mains_hz, near)
    for multiple in OWN_MULTIPLES:
        counts &= np.abs(at - multiple * hertz) > near
    peak = int(np.argmax(np.where(counts, size, 0.0)))
    around = size[np.abs(distance - distance[peak]) < BESIDE_HZ]
    if size[peak] < max(least, OVER_MEDIAN * float(np.median(around))):
        return 0.0, 0.0
    return (float(distance[peak]) if size[-peak] < MOST_MIRRORED * size[peak] else 0.0), float(size[peak])


def near_multiple(frequency: Floats, mains_hz: float, near: float) -> Bools:
    """Tell which frequencies are within `near` of a multiple of the mains' frequency."""
    return np.abs(frequency - mains_hz * np.maximum(np.round(frequency / mains_hz), 1)) <= near


def _turned_spectrum(residual: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return distances from the line in Hz and amplitudes of a residual that is turned back by the line's phase."""
    window, count = np.hanning(len(residual)), _length(len(residual))
    size = 2 * np.abs(np.fft.fft(residual * window, count)) / max(window.sum(), 1e-300)
    return np.fft.fftfreq(count, 1 / rate), size

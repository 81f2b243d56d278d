"""From samples to a line's slowly varying phase: coarse frequency, demodulation, steady span, smooth phases."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats

WINDOW_S = 0.25
"""Length of the Hann window that smooths a demodulated signal; it passes about 4 Hz to either side."""
STEADY = 0.9
"""Part of the median envelope that a line reaches before its record is used, and keeps to its end."""
RUNNING = 0.85
"""Part of its size in the steady span that a line has in a short spectrum as long as the motor runs."""
FOLLOWED_HZ = 12.0
"""How far a line's frequency may lie from that of the window beside it, to be followed."""
SPIN_UP_HZ_PER_S = 8.0
"""How fast a frequency changes that is a spin-up's, where the steady span has less than a third of it."""
NO_LINE = 1e-6
"""Part of a line's largest envelope below which its phase says nothing."""
KNOTS_S = (0.5, 0.25)
"""Distances of the knots of the phase's splines that are tried."""


@dataclass(frozen=True)
class Phase:
    """A line's phase in rad over time in s, and by how many parameters it was fitted."""

    at: Callable[[Floats], Floats]
    parameters: int

    def later(self, by_s: float) -> Phase:
        """Return the phase of the same line over a time that begins later by so many seconds."""
        return Phase(lambda t: self.at(t + by_s), self.parameters)


def coarse_frequency(x: Floats, rate: float, band: tuple[float, float], mains_hz: float) -> float:
    """Return the frequency of the strongest line in a band, in Hz, by the peak of a spectrum with a Hann window.

    A multiple of the mains' frequency is taken where it is more than three times as strong as any other line.
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
    return _interpolated(size, peak) * rate / _length(len(x))


def spectrum(x: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return frequencies in Hz and amplitudes in the signal's unit, by a Hann window, padded to twice the length."""
    window = np.hanning(len(x))
    size = np.abs(np.fft.rfft((x - x.mean()) * window, _length(len(x)))) * 2 / window.sum()
    return np.fft.rfftfreq(_length(len(x)), 1 / rate), size


def _length(count: int) -> int:
    return 2 ** (int(count - 1).bit_length() + 1)


def _interpolated(size: Floats, peak: int) -> float:
    """Return the place of a peak between the bins, by a parabola through the logarithms."""
    if not 0 < peak < len(size) - 1 or min(size[peak - 1 : peak + 2]) <= 0:
        return float(peak)
    low, top, high = np.log(size[peak - 1 : peak + 2])
    bend = low - 2 * top + high
    return peak + (0.5 * (low - high) / bend if bend < 0 else 0.0)


def envelope(x: Floats, good: Bools, rate: float, frequency: float) -> tuple[Floats, Floats]:
    """Return times in s and the line's complex amplitude there; samples that are not `good` count for nothing."""
    from scipy.signal import oaconvolve

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
    """Return the span in s in which the line has spun up: the ends where it is below STEADY of its median are cut."""
    size = np.abs(line)
    enough = np.flatnonzero(size >= STEADY * np.median(size))
    first, last = int(enough[0]), int(enough[-1])
    start = float(time[first] + WINDOW_S / 2) if first else 0.0
    end = float(time[last] - WINDOW_S / 2) if last < len(time) - 1 else length_s
    return (start, end) if end - start > 0.25 * length_s else (0.0, length_s)


def frequencies_beyond(x: Floats, rate: float, span: tuple[float, float], frequency: float) -> list[float]:
    """Return the line's frequency in short windows before and after its steady span, as far as it runs on there.

    A line that leaves the demodulator's band is cut off as if it had stopped: here it is followed from window to
    window. A spin-up is not: it changes its frequency fast, and then levels off.
    """
    count = int(WINDOW_S * rate)
    step = max(count // 4, 1)
    starts = np.arange(0, len(x) - count + 1, step)
    middles = (starts + count / 2) / rate
    inside = np.flatnonzero((middles >= span[0]) & (middles <= span[1]))
    if len(inside) in (0, len(starts)) or count < 16:
        return []
    window = np.hanning(count + 2)[1:-1]
    points = 4 * _length(count)
    hertz = np.fft.rfftfreq(points, 1 / rate)

    def peak(i: int, near: float) -> tuple[float, float]:
        size = np.abs(np.fft.rfft(x[starts[i] : starts[i] + count] * window, points))
        at = int(np.argmax(np.where(np.abs(hertz - near) < FOLLOWED_HZ, size, 0.0)))
        return float(hertz[at]), float(size[at])

    sample = inside[np.unique(np.linspace(0, len(inside) - 1, 20).astype(int))]
    peaks = np.array([peak(int(i), frequency) for i in sample])
    least = RUNNING * float(np.median(peaks[:, 1]))
    own = abs(peaks[-1, 0] - peaks[0, 0]) / max(int(inside[-1] - inside[0]), 1)
    fastest = max(3 * own, SPIN_UP_HZ_PER_S * step / rate)
    out: list[float] = []
    for there, most in (
        (range(int(inside[0]) - 1, -1, -1), fastest),
        (range(int(inside[-1]) + 1, len(starts)), np.inf),
    ):
        near = float(peaks[0 if most < np.inf else -1, 0])
        low = 0
        for i in there:
            hertz_here, size = peak(i, near)
            low = low + 1 if size < least else 0
            if low > count // step + 1:  # more windows than one jump of the frequency reaches
                break
            if not low:
                if abs(hertz_here - near) <= most:
                    out.append(hertz_here)
                near = hertz_here
    return out


def phases(time: Floats, line: Floats, frequency: float) -> Iterator[Phase]:
    """Yield the line's phase, of rising flexibility: constant frequency, linear, cubic, splines.

    None at all where fewer than three points have a line. A spline has a point between any two of its knots.
    """
    from scipy.interpolate import make_lsq_spline

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
        if np.histogram(time, ends)[0].min() == 0:  # a gap: what the spline does there is not known
            continue
        inner = ends[1:-1]
        knots = np.concatenate([[time[0]] * 4, inner, [time[-1]] * 4])
        spline = make_lsq_spline(time, angle, knots, 3, w=weight)
        yield Phase(lambda t, spline=spline, time=time: omega * t + _straight_beyond(spline, t, time), pieces + 3)


def _straight_beyond(spline: Callable[..., Floats], at: Floats, time: Floats) -> Floats:
    """Return a spline's values, continued by its tangents beyond its ends."""
    inside = np.clip(at, time[0], time[-1])
    beyond = at - inside
    value = spline(inside)
    for end in (time[0], time[-1]):
        out = (beyond != 0) & (inside == end)
        value[out] += beyond[out] * float(spline(end, 1))
    return value

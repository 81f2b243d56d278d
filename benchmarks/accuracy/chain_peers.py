"""Chains that others use, beside this program's two: a spectrum's peak, a flat-top window, a lock-in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter, sosfilt

from unitcad.geometry.arrays import Floats
from unitcad.lab import bandpass
from unitcad.lab.line import coarse_frequency, fit_line

BAND_HZ = (60.0, 250.0)


def fft_peak(x: Floats, rate: float) -> float:
    """Return the largest amplitude of the plain spectrum in the band."""
    frequency = np.fft.rfftfreq(len(x), 1 / rate)
    size = 2 * np.abs(np.fft.rfft(x)) / len(x)
    return float(size[(frequency > BAND_HZ[0]) & (frequency < BAND_HZ[1])].max())


def flat_top(x: Floats, rate: float) -> float:
    """Return the largest amplitude of the spectrum with a flat-top window, which forgives a line between two bins."""
    from scipy.signal.windows import flattop

    window = flattop(len(x), sym=False)
    frequency = np.fft.rfftfreq(len(x), 1 / rate)
    size = 2 * np.abs(np.fft.rfft(x * window)) / window.sum()
    return float(size[(frequency > BAND_HZ[0]) & (frequency < BAND_HZ[1])].max())


def lock_in(x: Floats, rate: float) -> float:
    """Return the product with a carrier at the spectrum's peak, of fixed frequency, averaged over the inner 80 %."""
    frequency = coarse_frequency(x, rate, BAND_HZ, 50.0)
    inner = slice(len(x) // 10, len(x) - len(x) // 10)
    window = np.hanning(len(x[inner]))
    turned = x[inner] * np.exp(-2j * np.pi * frequency * np.arange(len(x))[inner] / rate)
    return float(2 * abs(np.sum(turned * window)) / window.sum())


def peak_bandpass(x: Floats, rate: float) -> float:
    """Return half the peak-to-peak of the chain `bandpass`, over the whole record."""
    return float(np.ptp(bandpass.filtered(bandpass.resampled(x, rate))) / 2)


def trimmed_peak_bandpass(x: Floats, rate: float) -> float:
    """Return half the peak-to-peak of the chain `bandpass`, without the ends."""
    return float(np.ptp(bandpass.filtered(bandpass.resampled(x, rate))[_INNER]) / 2)


def causal_bandpass(x: Floats, rate: float) -> float:
    """Return the RMS of the chain `bandpass` whose filters run only forwards."""
    band, comb = bandpass.filters()
    return float(np.sqrt(2) * np.std(np.asarray(lfilter(*comb, sosfilt(band, bandpass.resampled(x, rate))))[_INNER]))


_INNER = slice(round(bandpass.TRIM_S * bandpass.RATE_HZ), -round(bandpass.TRIM_S * bandpass.RATE_HZ))


def line(x: Floats, rate: float) -> float:
    """Return the amplitude by the chain `line`; 0 without a line."""
    fit = fit_line(x, rate)
    return fit.amplitude if fit else 0.0


CHAINS: dict[str, Callable[[Floats, float], float]] = {
    "bandpass, zero-phase, half peak-to-peak, whole record": peak_bandpass,
    "same, ends trimmed": trimmed_peak_bandpass,
    "bandpass, zero-phase, RMS, trimmed": bandpass.amplitude,
    "bandpass, causal, RMS, trimmed": causal_bandpass,
    "FFT peak, rectangular window": fft_peak,
    "FFT, flat-top window": flat_top,
    "lock-in, fixed frequency": lock_in,
    "line": line,
}

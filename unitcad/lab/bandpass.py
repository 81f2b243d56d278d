"""The chain `bandpass`: the article's band-pass and comb at 2 kHz, with assumed values for the missing ones.

It says: sampled at 2 kHz, Butterworth 40 to 200 Hz, 50 Hz comb, three repeats, divided by the motor's amplitude. It
does not say the filter's order, the comb's Q, whether the filters run only forwards, or peak or RMS.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.signal import butter, filtfilt, freqz, iircomb, resample_poly, sosfiltfilt, sosfreqz

from unitcad.geometry.arrays import Floats
from unitcad.lab.line import LineFit

RATE_HZ = 2000.0
LOW_HZ, HIGH_HZ, COMB_HZ = 40.0, 200.0, 50.0
ORDER, Q, TRIM_S = 4, 30.0, 0.25
ASSUMED = f"order {ORDER}, Q {Q:g}, filters forwards and backwards, RMS, {TRIM_S:g} s cut from both ends"
"""Values that the article does not state."""
MOST_MASKED = 2e-4
"""Part of the samples that may be missing or drop-outs in a record that the chain takes: it has no robust step."""
LEAST_S = 0.1
"""Shortest record between the ends that are cut, in s."""


def filters() -> tuple[Any, tuple[Any, Any]]:
    """Return the band-pass as second-order sections, and numerator and denominator of the comb."""
    band = butter(ORDER, (LOW_HZ, HIGH_HZ), "bandpass", fs=RATE_HZ, output="sos")
    return band, iircomb(COMB_HZ, Q, fs=RATE_HZ)


def gain(frequency_hz: float) -> float:
    """Return the filters' gain of an amplitude at a frequency in Hz."""
    band, comb = filters()
    at: Any = np.array([frequency_hz])
    return float(np.abs(sosfreqz(band, at, fs=RATE_HZ)[1] * freqz(*comb, at, fs=RATE_HZ)[1]).item() ** 2)


def resampled(x: Floats, rate: float) -> Floats:
    """Return samples x (n) at `rate` in Hz at 2 kHz, by a polyphase filter, without their mean."""
    x = np.where(np.isfinite(x), x, 0.0)
    if abs(rate / RATE_HZ - 1) >= 1e-6:
        ratio = Fraction(RATE_HZ / rate).limit_denominator(2000)
        x = np.asarray(resample_poly(x, ratio.numerator, ratio.denominator, window=("kaiser", 9.0)))
    return x - x.mean()


def filtered(x: Floats) -> Floats:
    """Return samples at 2 kHz after the filters, which run forwards and backwards."""
    band, comb = filters()
    pad = min(3 * len(comb[0]), len(x) - 1)
    return np.asarray(filtfilt(*comb, sosfiltfilt(band, x, padlen=pad), padlen=pad))


def amplitude(x: Floats, rate: float) -> float:
    """Return the amplitude (peak) of samples x (n) at `rate` in Hz, in their unit, that `unfit` does not refuse."""
    trim = round(TRIM_S * RATE_HZ)
    return float(np.sqrt(2) * np.std(filtered(resampled(x, rate))[trim:-trim]))


def unfit(fits: Sequence[LineFit], length_s: float) -> str:
    """Return why the chain gives no amplitude of channels with these lines, `length_s` long; empty if it does."""
    missing, dropped = max(fit.missing for fit in fits), max(fit.dropped for fit in fits)
    if missing > MOST_MASKED:
        return f"{missing:.2%} of the samples are missing, which it does not leave out"
    if dropped > MOST_MASKED:
        return f"{dropped:.2%} of the samples are drop-outs, which it does not leave out"
    if length_s < 2 * TRIM_S + LEAST_S:
        return f"{length_s:.2g} s are less than {LEAST_S:g} s after {TRIM_S:g} s are cut from both ends"
    return ""

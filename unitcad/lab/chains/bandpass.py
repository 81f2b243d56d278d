"""The chain `bandpass`: the article's band-pass and comb at 2 kHz; other parameters are assumed, and named.

It says: sampled at 2 kHz, Butterworth 40 to 200 Hz, 50 Hz comb, three repeats, divided by the motor's amplitude. It
does not say the filter's order, the comb's Q, whether the filters run only forwards, or peak or RMS.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from scipy.signal import butter, filtfilt, freqz, iircomb, lfilter, resample_poly, sosfilt, sosfiltfilt, sosfreqz

from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.lab.chains import Chain, ChainTable, LineFit

RATE_HZ = 2000.0
LOW_HZ, HIGH_HZ, COMB_HZ = 40.0, 200.0, 50.0
ASSUMED = ("order", "q", "zero_phase", "measure", "trim_s")
"""Parameters of the chain that the paper does not state."""
MOST_MASKED = 2e-4
"""Part of the samples that may be missing or drop-outs in a record that the chain takes: it has no robust step."""


def gain(table: ChainTable, frequency_hz: float) -> float:
    """Return the filters' gain of an amplitude at a frequency in Hz."""

    band, comb = _filters(table)
    at: Any = np.array([frequency_hz])
    size = np.abs(sosfreqz(band, at, fs=RATE_HZ)[1] * freqz(*comb, at, fs=RATE_HZ)[1]).item()
    return size**2 if table.zero_phase else size


def amplitude(table: ChainTable, x: Floats, rate: float) -> float:
    """Return the amplitude (peak) of samples x (n) at `rate` in Hz, in their unit.

    Samples of another rate than 2 kHz go through a polyphase filter. Raises Refusal for a record shorter than the
    trimmed part, or without a sample.
    """

    x = np.where(np.isfinite(x), x, 0.0)
    if abs(rate / RATE_HZ - 1) >= 1e-6:
        ratio = Fraction(RATE_HZ / rate).limit_denominator(2000)
        x = np.asarray(resample_poly(x, ratio.numerator, ratio.denominator, window=("kaiser", 9.0)))
    trim = round(table.trim_s * RATE_HZ)
    if len(x) < 2 * trim + 200:
        limit = f"leaves less than 0.1 s of a record of {len(x) / RATE_HZ:.2g} s"
        raise Refusal("chain.trim_s", table.trim_s, limit)
    band, comb = _filters(table)
    x = x - x.mean()
    if table.zero_phase:
        pad = min(3 * len(comb[0]), len(x) - 1)
        x = np.asarray(filtfilt(*comb, sosfiltfilt(band, x, padlen=pad), padlen=pad))
    else:
        x = np.asarray(lfilter(*comb, sosfilt(band, x)))
    x = x[trim : len(x) - trim]
    return float(np.sqrt(2) * np.std(x)) if table.measure == "rms" else float(np.ptp(x) / 2)


def chain(table: ChainTable) -> Chain:
    """Return the chain with a campaign's parameters."""
    return Chain(
        "bandpass",
        lambda x, rate, fit: amplitude(table, x, rate),
        unfit=_unfit,
        gain=lambda hertz: gain(table, hertz),
        assumed={name: getattr(table, name) for name in ASSUMED},
    )


def _unfit(fits: list[LineFit]) -> str:
    """Return why the filters, which have no robust step, give no amplitude; empty if they do."""
    missing, dropped = max(fit.missing for fit in fits), max(fit.dropped for fit in fits)
    if missing > MOST_MASKED:
        return f"{missing:.2%} of the samples are missing, which it does not leave out"
    if dropped > MOST_MASKED:
        return f"{dropped:.2%} of the samples are drop-outs, which it does not leave out"
    return ""


def _filters(table: ChainTable) -> tuple[Any, tuple[Any, Any]]:

    band = butter(table.order, (LOW_HZ, HIGH_HZ), "bandpass", fs=RATE_HZ, output="sos")
    return band, iircomb(COMB_HZ, table.q, fs=RATE_HZ)

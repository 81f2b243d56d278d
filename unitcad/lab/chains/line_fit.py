"""What a chain gives of one record."""

from __future__ import annotations

from dataclasses import dataclass, field

from unitcad.lab.chains.demodulation import Phase


@dataclass(frozen=True)
class Line:
    """One line: frequency in Hz, amplitude (peak) and its standard uncertainty in the signal's unit."""

    frequency_hz: float
    amplitude: float
    u: float


@dataclass(frozen=True)
class LineFit:
    """A record's line: amplitude (peak) with its standard uncertainty, in the signal's unit.

    `u_noise` is the part of `u` that the noise beside the line gives, `u_mains` the part that every repeat shares.
    `value` is the complex amplitude against `phase`. `drift` is the range of the frequency over its mean, `snr` the
    amplitude over the residual's standard deviation, `scatter` the standard deviation of the amplitude of blocks over
    their mean. `masked` is the part of the samples left out by their residual, `dropped` the same where one of them
    lies further off than noise does, else 0; `missing` the part that are no numbers. `clipped` is the level at which
    the signal is cut off over its true amplitude (infinite where it isn't). `lines` are all lines where several were
    fitted together, the strongest first.
    """

    amplitude: float
    u: float
    u_noise: float
    u_mains: float
    value: complex
    frequency_hz: float
    drift: float
    snr: float
    scatter: float
    start_s: float
    end_s: float
    masked: float = 0.0
    dropped: float = 0.0
    missing: float = 0.0
    clipped: float = float("inf")
    mains_hz: float = 0.0
    """The multiple of the mains' frequency that the record can't tell from the line; 0 where there is none."""
    lines: tuple[Line, ...] = ()
    phase: Phase | None = field(default=None, compare=False, repr=False)
    blocks: tuple[complex, ...] = field(default=(), repr=False)
    """The line's complex amplitude in equal blocks of the span."""

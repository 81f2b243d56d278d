"""One record measured: its line fitted and judged, as displacement by each chain of the campaign."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.errors import Refusal
from unitcad.files import sha256
from unitcad.geometry.arrays import Floats
from unitcad.json_text import rounded
from unitcad.lab import bandpass
from unitcad.lab.campaign import Campaign, ChainTable, RecordingTable, SensorTable
from unitcad.lab.line import (
    BESIDE_HZ,
    OVER_MEDIAN,
    OWN_MULTIPLES,
    LineFit,
    clip_level,
    fit_line,
    near_multiple,
    spectrum,
)
from unitcad.lab.readers import TIME_NAMES, Channel, Layout, Recording, open_recording
from unitcad.lab.units import UNITS, is_signal_unit, plain, ratio, seconds, to_si
from unitcad.meshcheck.rules.registry import Rule

RULES = {
    rule.code: rule
    for rule in map(
        Rule,
        (
            """L101 error: clipped
            The samples stay at a level that the motion exceeds, so no amplitude is given. Example: An
            accelerometer of 2 g at 3 g. Fix: Set a larger range or a lower gain, and record again.""",
            """L102 error: sampled too slowly
            Fewer than four samples a period: the sensor's filter and aliases change the amplitude.
            Example: 400 Hz for a motor of 125 Hz. Fix: Sample at 1 kHz or faster.""",
            """L103 error: uneven time axis
            A time is off an even grid by more than 0.3 of a step, or goes back: samples are missing, the clock varies,
            or the file has two records. No line is fitted. Example: A logger over USB that loses a packet. Fix: Record
            with a hardware clock; write each record to a file of its own.""",
            """L104 error: several lines
            The record has a second line. It is an error if either may be the motor's: within 15 Hz, or half as strong
            in the band that is searched. Otherwise it is a warning. Example: Two motors of an array at once.
            Fix: Run one motor at a time; if it is a multiple of the mains, set chain.mains_hz.""",
            """L105 warning: line on the mains
            The record can't tell the line from a multiple of the mains' frequency. Example: A motor at
            100.2 Hz over 2 s. Fix: Record longer, or change the drive's voltage until the line is off the
            multiple.""",
            """L106 warning: line in the comb's null
            A chain's filters pass less than 0.9 of the line. Example: A motor at 100 Hz and the paper's
            comb at 50 Hz. Fix: Use the chain line, or another drive voltage.""",
            """L107 warning: unsteady
            The amplitude or the frequency varies by more than 5 % in the steady part, or less than half
            of the record is steady. If the amplitude varies by more than 25 %, it is an error. Example: A battery that
            runs down; two motors that beat. Fix: Use a regulated supply and let the motor warm up, run one motor at a
            time, or cut the record.""",
            """L108 warning: fewer than 20 periods
            The steady part is too short to know the noise next to the line. Example: 0.1 s at
            125 Hz. Fix: Record 2 s.""",
            """L109 warning: repeats disagree
            The repeats' logarithms scatter by more than 0.15. Beyond a factor of ten between repeats it is an error:
            no level is given. Example: A unit that was not taped down again as before; a file in another unit.
            Fix: Repeat, five times or more; compare the units of the files.""",
            """L110 error: drop-outs
            More than a tenth of the samples were excluded: more than a robust fit bears. Example: A
            vibrometer on bare skin, a motor that runs for less than half of the record. Fix: Put retroreflective
            tape on the point, or cut the record to the part in which the motor runs.""",
            """L111 error: no line
            The band has no line above five times its uncertainty. Example: The motor did not run.
            Fix: Repeat, or set chain.band_hz to the motor's frequency.""",
            """L112 error: too few repeats
            Fewer than three usable records are left: no level is given. Example: One of three is
            clipped. Fix: Repeat.""",
            """L114 warning: not fit for a chain
            The chain gives no amplitude of a record with drop-outs, missing samples or too few samples.
            Example: The chain bandpass and a spike. Fix: Use the chain line.""",
            """L116 error: motor and unit at different frequencies
            No line of the unit is near the motor's frequency: no level is given.
            Example: The reference of another motor. Fix: Record the motor at the same voltage.""",
            """L117 error: stronger line outside the band
            A line below or above chain.band_hz is stronger than any in it. Example: A motor at 45 Hz, whose
            harmonic is in a band from 60 Hz; an LRA at 260 Hz. Fix: Widen chain.band_hz beyond that line.""",
            """L118 warning: low signal to noise
            The amplitude is less than ten times the standard deviation of the residual. Example: A point far from
            the unit. Fix: Record longer, average more, or a sensor of a smaller range.""",
            """L119 warning: missing samples
            Samples are no numbers: empty, or NaN. They are skipped; beyond a tenth of them it is an error. Example: A
            logger that writes NaN while the laser has lost the surface. Fix: Put
            retroreflective tape on the point.""",
        ),
    )
}


@dataclass(frozen=True)
class LabFinding:
    """One finding: code, severity, its record or level, and the measured figure."""

    code: str
    severity: str
    where: str
    message: str

    def as_dict(self) -> dict[str, str]:
        """Return JSON-ready data, with title and fix."""
        return {**asdict(self), "title": RULES[self.code].title, "fix": RULES[self.code].fix}


def finding(code: str, where: str, message: str, severity: str | None = None) -> LabFinding:
    """Return a finding with the severity of its rule, or the one that is given."""
    return LabFinding(code, severity or RULES[code].severity, where, message)


LONGEST_S = 60.0
"""Seconds of a record that is measured: the line of a longer one has too many parameters to be fitted at once."""
IRREGULAR = 0.3
"""Largest distance of a time from an even grid, in steps."""
SAME_RATE = 1e-3
"""Part by which the campaign's rate may differ from the file's own."""
HIGHEST_RATE = 5_000.0
"""Hz; records of more than twice this rate are averaged down to it."""


@dataclass(frozen=True)
class Unit:
    """The unit in which a channel's numbers were read, and whether the file states it."""

    name: str
    stated: bool

    def __str__(self) -> str:
        return self.name if self.stated else f"{self.name} (not stated)"


@dataclass(frozen=True)
class Signal:
    """A record's samples (n, channels) at `rate` in Hz: means of `averaged` neighbours of the file's at `raw_rate`.

    `count` and `missing`: samples of the file, and of each channel those that are no numbers. `uneven`: why the times
    are no even grid, "" if they are, or if they do not determine the rate. `units`: of each channel, as read.
    """

    samples: Floats
    raw_rate: float
    averaged: int
    count: int
    missing: tuple[int, ...]
    uneven: str
    units: tuple[Unit, ...]

    @property
    def rate(self) -> float:
        """The rate of the samples, Hz."""
        return self.raw_rate / self.averaged

    def gain(self, frequency_hz: float) -> float:
        """Return the gain that the averaging has at a frequency."""
        angle = np.pi * frequency_hz / self.raw_rate
        return float(np.sin(self.averaged * angle) / (self.averaged * np.sin(angle))) if self.averaged > 1 else 1.0


def open_signal(path: Path, table: RecordingTable, sensors: tuple[SensorTable, ...], shown: str) -> Signal:
    """Return the signal of a record: the channel, and the motor's if the campaign declares one.

    Raises Refusal, naming the key to add, for a value that neither the file nor the campaign states.
    """
    recording = open_recording(path, Layout(table.delimiter or "", table.decimal or "", table.skip_lines or 0))
    channels = recording.channels
    time = recording.time if table.time_column is None else recording.index(table.time_column, "recording.time_column")
    wanted = {"channel": table.channel, "motor_channel": table.motor_channel}
    columns = []
    for key, name in list(wanted.items())[: len(sensors)]:
        if name is not None:
            column = recording.index(name, f"recording.{key}")
        else:
            others = [i for i in range(len(channels)) if i != time]
            if len(others) != 1:
                listed = recording.numbered(others)
                limit = f"is needed, a name or a number: {shown} has {len(others)} channels: {listed}"
                likely = [i for i in others if channels[i].name.strip().lower() not in TIME_NAMES]
                raise Refusal(f"recording.{key}", None, limit, likely[0] + 1 if likely else None)
            column = others[0]
        columns.append(column)
    rate, stamps = _rate(recording, table, time, columns[0], shown)
    keys = ("sensor", "motor_sensor" if sensors[1:] and sensors[1] is not sensors[0] else "sensor")
    factors = [
        _factor(sensor, channels[column], key, f"{shown}, {channels[column].name}")
        for column, sensor, key in zip(columns, sensors, keys, strict=False)
    ]
    units = tuple(
        Unit(plain(channel.unit), True) if channel.unit and not channel.doubt else Unit(assumed_unit(sensor), False)
        for channel, sensor in zip((channels[column] for column in columns), sensors, strict=False)
    )
    samples = recording.columns(columns)
    count, missing = len(samples), tuple(int(n) for n in np.count_nonzero(~np.isfinite(samples), axis=0))
    uneven = "" if stamps is None else _uneven(stamps, rate)
    if (length := count / rate) > LONGEST_S:
        raise Refusal(shown, None, f"lasts {length:.4g} s; cut the record to {LONGEST_S:g} s or less")
    samples = samples * factors
    averaged = max(min(int(rate / HIGHEST_RATE), count), 1)
    if averaged > 1:
        samples = samples[: count // averaged * averaged].reshape(-1, averaged, samples.shape[1]).mean(axis=1)
    return Signal(samples, rate, averaged, count, missing, uneven, units)


def _uneven(stamps: Floats, rate: float) -> str:
    """Return why times are no even grid, "" if they are."""
    if not np.isfinite(stamps).all():
        return f"{np.count_nonzero(~np.isfinite(stamps))} times are no numbers"
    steps = np.diff(stamps)
    if (steps < 0).any():
        at = int(np.argmax(steps < 0))
        return (
            f"the time goes back from {stamps[at]:.6g} to {stamps[at + 1]:.6g} s behind sample {at + 1}: two records?"
        )
    off = float(np.abs((stamps - stamps[0]) * rate - np.arange(len(stamps))).max())
    return f"a time is {off:.2g} steps off an even grid" if off > IRREGULAR else ""


def assumed_unit(sensor: SensorTable) -> str:
    """Return the unit of numbers of which the file states none."""
    return plain(sensor.per or ("V" if sensor.scale != 1.0 else sensor.unit))


def _factor(sensor: SensorTable, channel: Channel, key: str, shown: str) -> float:
    """Return the factor from numbers of a channel to the sensor's unit; `key` is the sensor's in the campaign.

    Raises Refusal for a unit that is not clear or doesn't fit the sensor's, and for a scale that may be per one unit or
    another.
    """
    own, per, assumed = plain(channel.unit), plain(sensor.per or ""), assumed_unit(sensor)
    if channel.doubt and not per and channel.likely != assumed:
        limit = f"is needed, the unit of the numbers: {shown}: {channel.doubt}"
        raise Refusal(f"{key}.per", None, limit, channel.likely or None)
    if channel.doubt or not own or own == per:
        return sensor.scale
    if per:
        if (factor := ratio(own, per)) is None:
            raise Refusal(f"{key}.per", sensor.per, f"but {shown}, says {own}", own)
        return sensor.scale * factor
    if own in UNITS[sensor.quantity]:
        if sensor.scale != 1.0:
            limit = f"{shown}, says {own}, which needs no scale; for a gain, set {key}.per = {own!r}"
            raise Refusal(f"{key}.scale", sensor.scale, limit, 1.0)
        return ratio(own, plain(sensor.unit)) or 1.0
    if not is_signal_unit(own):
        limit = f"is needed, the unit of the numbers: {shown}, says {channel.unit!r}, which is no unit of a signal that"
        why = f"{limit} unitcad knows; if {key}.scale is for that unit, name it"
        raise Refusal(f"{key}.per", None, why, channel.unit)
    if sensor.scale == 1.0:
        limit = f"but {shown}, says {own}: declare {key}.scale and {key}.per, or another quantity"
        raise Refusal(f"{key}.unit", sensor.unit, limit)
    if ratio(own, "V") not in (None, 1.0):
        limit = f"is needed: {shown}, says {own}; is the scale per {own} or per V?"
        raise Refusal(f"{key}.per", None, limit, "V")
    return sensor.scale


def _rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, Floats | None]:
    """Return the rate in Hz, and the times in s if they determine it or go back.

    Raises Refusal if the file says another rate than the campaign does.
    """
    try:
        own, stamps = _own_rate(recording, table, time, column, shown)
    except Refusal:
        if table.rate_hz is None:
            raise
        return table.rate_hz, None  # the file says none that could be compared
    if table.rate_hz is None:
        return own, stamps
    if abs(table.rate_hz / own - 1) > SAME_RATE:
        says = "its header" if time is None else f"its column {recording.channels[time].name!r}"
        limit = f"differs from {shown}, which has {own:.6g} Hz by {says}"
        raise Refusal("recording.rate_hz", table.rate_hz, limit, float(f"{own:.9g}"))
    return table.rate_hz, stamps if stamps is not None and (np.diff(stamps) < 0).any() else None


def _own_rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, Floats | None]:
    """Return the rate in Hz that the file states, and its times in s."""
    if time is None:
        step = recording.channels[column].step_s
        if step is None:
            raise Refusal("recording.rate_hz", None, f"is needed, or time_column: {shown} does not say its rate")
        return 1 / step, None
    unit = table.time_unit or recording.channels[time].unit
    if not unit:
        raise Refusal("recording.time_unit", None, f"is needed: {shown} does not say the unit of its time")
    stamps = recording.columns([time])[:, 0] * seconds(unit, "recording.time_unit")
    steps = np.diff(stamps)
    back = bool((steps < 0).any())
    if len(stamps) < 2 or not np.nanmedian(steps) > 0:
        raise Refusal("recording.time_column", recording.channels[time].name, f"does not rise in {shown}")
    step = float(np.nanmedian(steps)) if back else (stamps[-1] - stamps[0]) / (len(stamps) - 1)
    return 1 / step, stamps


LEAST_GAIN = 0.9
HIGHEST_HZ = 500.0
"""The end of a record's spectrum, in Hz."""
MOST_SCATTER, NO_SCATTER, MOST_DRIFT = 0.05, 0.25, 0.05
LEAST_PERIODS, NO_PERIODS = 20, 5
MOST_MASKED = 0.1
LEAST_STEADY = 0.5
TREMOR_HZ = 20
"""Part of a record that its steady part is at least: a motor that spins up and runs leaves more of 2 s."""
LEAST_SNR = 10.0
AS_STRONG = 0.5
"""Part of a line's amplitude from which a second one far from it may be the motor's as well."""
LEAST_OVER_U = 5
"""The strongest of the 400 bins of noise in a band of 190 Hz over 2 s is above 4 in a record of ten, above 5 in few of
a thousand.
"""
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
_OF_THE_RATE = ("L102", "L108")
"""Findings of the rate and the span, which unit and motor share."""


@dataclass(frozen=True)
class RecordResult:
    """A record's figures; amplitudes (peak) and standard uncertainties in um.

    `usable`: it counts for levels. `by_chain` has each chain's amplitude over which a level is taken, or its ratio to
    the motor's own channel, without the chains that the record is not fit for; `bandpass_gain` the gain of the filters
    at the line, None without that chain; `picture` the samples and the spectrum, in the sensor's unit. `units`: of the
    file's numbers, by channel.
    """

    file: str
    sha256: str
    role: str
    rate_hz: float
    samples: int
    unit: str
    units: tuple[Unit, ...]
    picture: tuple[Floats, Floats, Floats, Floats]
    findings: tuple[LabFinding, ...]
    usable: bool = False
    amplitude_um: float = 0.0
    u_um: float = 0.0
    frequency_hz: float = 0.0
    drift: float = 0.0
    snr: float = 0.0
    steady_s: float = 0.0
    masked: float = 0.0
    by_chain: dict[str, float] = field(default_factory=dict)
    bandpass_gain: float | None = None

    @property
    def length_s(self) -> float:
        """The record's length in s."""
        return self.samples / self.rate_hz

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data, six significant digits; a record that counts for nothing has no uncertainty."""
        data = {key: value for key, value in vars(self).items() if isinstance(value, float | int | str)}
        data |= {} if self.usable else {"u_um": None}
        data |= {} if self.frequency_hz else {"amplitude_um": None}
        data |= {
            "length_s": self.length_s,
            "units_in_file": list(map(str, self.units)),
            "by_chain": self.by_chain,
            "findings": [one.as_dict() for one in self.findings],
        }
        return rounded(data, 6)


def measure_record(
    path: Path,
    role: str,
    campaign: Campaign,
    sensors: tuple[SensorTable, ...],
    band: tuple[float, float],
    shown: str,
) -> RecordResult:
    """Return a record's figures by every chain of the campaign; `sensors` are the unit's, then the motor's.

    `band` is the band in which its line is searched, in Hz. Raises Refusal for a record that can't be read.
    """
    signal = open_signal(path, campaign.recording, sensors, shown)
    names = (shown, f"{shown}, motor")[: len(sensors)]
    samples, rate = signal.samples, signal.rate
    picture = (np.arange(len(samples)) / rate, samples[:, 0], *_spectrum(samples[:, 0], rate))
    findings: list[LabFinding] = []
    if signal.uneven:
        findings.append(finding("L103", shown, signal.uneven))
    for channel, gaps, where in zip(samples.T, signal.missing, names, strict=True):
        if (level := clip_level(channel)) < np.inf:
            findings.append(finding("L101", where, f"at about {level:.2f} of the amplitude"))
        if gaps:
            message = f"{gaps} of {signal.count} samples ({gaps / signal.count:.2g} of them) are no numbers"
            severity = "error" if gaps > MOST_MASKED * signal.count else "warning"
            findings.append(finding("L119", where, message, severity))
    unit = sensors[0].unit
    none = RecordResult(shown, sha256(path), role, signal.raw_rate, signal.count, unit, signal.units, picture, ())
    if any(one.code in ("L101", "L103") for one in findings):
        return replace(none, findings=tuple(findings))
    fits = _fits(samples, rate, band, campaign.chain)
    for each, channel, where in zip(fits, samples.T, names, strict=True):
        elsewhere = _elsewhere(_spectrum(channel, rate), each, band, campaign.chain, where)
        if elsewhere or each is None:
            message = f"nothing between {band[0]:.4g} and {band[1]:.4g} Hz"
            return replace(none, findings=(*findings, elsewhere or finding("L111", where, message)))
    lines = [each for each in fits if each]
    fit = lines[0]
    for i, (each, where) in enumerate(zip(lines, names, strict=True)):
        searched = band if i == len(lines) - 1 else (0.0, 0.0)  # the unit's channel has the phase of the motor's line
        for one in _of_line(each, rate, signal.raw_rate, where, searched):
            if each is fit or one.code not in _OF_THE_RATE:
                findings.append(one)
    steady, length = fit.end_s - fit.start_s, len(samples) / rate
    if steady < LEAST_STEADY * length and not any(one.severity == "error" for one in findings):
        message = f"steady for {steady:.2f} s of {length:.2f} s; only that part was used"
        findings.append(finding("L107", shown, message))
    hertz = fit.frequency_hz
    scales = [displacement(sensor, hertz) / signal.gain(hertz) for sensor in sensors]
    amplitudes, gain = {"line": [each.amplitude for each in lines]}, None
    if "bandpass" in campaign.chain.use:
        part = samples[int(fit.start_s * rate) : int(np.ceil(fit.end_s * rate)) + 1]
        gain = bandpass.gain(hertz)
        if gain < LEAST_GAIN:
            message = f"the filters of the chain bandpass pass {gain:.3f} of {hertz:.2f} Hz"
            findings.append(finding("L106", shown, message))
        if reason := bandpass.unfit(lines, len(part) / rate):
            findings.append(finding("L114", shown, f"bandpass: {reason}"))
        elif gain >= LEAST_GAIN:
            amplitudes["bandpass"] = [bandpass.amplitude(x, rate) for x in part.T]
    by_chain = {}
    for name in campaign.chain.use:
        if name in amplitudes:
            value, *below = [scale * size for scale, size in zip(scales, amplitudes[name], strict=True)]
            by_chain[name] = value / below[0] if below else value
    return replace(
        none,
        findings=tuple(findings),
        usable=not any(one.severity == "error" for one in findings),
        amplitude_um=fit.amplitude * scales[0],
        u_um=fit.u * scales[0],
        frequency_hz=hertz,
        drift=fit.drift,
        snr=fit.snr,
        steady_s=steady,
        masked=fit.masked,
        by_chain=by_chain,
        bandpass_gain=gain,
    )


def displacement(sensor: SensorTable, frequency_hz: float) -> float:
    """Return um of displacement per unit of the sensor at a frequency: a line over omega once or twice."""
    si = to_si(sensor.unit, sensor.quantity, "sensor.unit")
    return 1e6 * si / (2 * np.pi * frequency_hz) ** _ORDER[sensor.quantity]


def _spectrum(x: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return frequencies in Hz up to HIGHEST_HZ and amplitudes of a channel, with zeros for missing samples."""
    frequency, size = spectrum(np.where(np.isfinite(x), x, 0.0), rate)
    low = frequency <= min(HIGHEST_HZ, rate / 2)
    return frequency[low], size[low]


def _fits(samples: Floats, rate: float, band: tuple[float, float], chain: ChainTable) -> list[LineFit | None]:
    """Return the line of each channel, None without one. The other channel has the phase of the motor's line."""
    fits: list[LineFit | None] = []
    for i in reversed(range(samples.shape[1])):
        fit = fit_line(samples[:, i], rate, band, chain.mains_hz, fits[0] if fits else None, chain.band_hz)
        fits.insert(0, fit if fit and fit.amplitude > 0 else None)
    return fits


def _elsewhere(
    spectrum: tuple[Floats, Floats], fit: LineFit | None, band: tuple[float, float], chain: ChainTable, where: str
) -> LabFinding | None:
    """Return the finding that the strongest line of a channel is not in the band in which it was searched, if so.

    A fit within the campaign's band counts if it is a line; a harmonic of it is no other line.
    """
    frequency, size = spectrum
    if len(frequency) < 3:
        return None
    own_hz = fit.frequency_hz if fit and _is_line(fit) else 0.0
    near = max(1.0, 3 * float(frequency[1]))
    counts = (frequency > TREMOR_HZ) & ~near_multiple(frequency, chain.mains_hz, near)
    for multiple in (1.0, *OWN_MULTIPLES[1:]) if own_hz else ():
        counts &= np.abs(frequency - multiple * own_hz) > near
    low, high = chain.band_hz if own_hz else band
    counts &= (frequency < low - near) | (frequency > high + near)
    at = int(np.argmax(np.where(counts, size, 0.0)))
    own = size[np.abs(frequency - own_hz) <= near].max(initial=0.0) if own_hz else 0.0
    around = size[np.abs(frequency - frequency[at]) < BESIDE_HZ]
    if not counts[at] or size[at] <= own or size[at] < OVER_MEDIAN * float(np.median(around)):
        return None
    hertz = float(frequency[at])
    if chain.band_hz[0] <= hertz <= chain.band_hz[1]:
        message = (
            f"the strongest line is at about {hertz:.0f} Hz; the motor's is from {band[0]:.0f} to {band[1]:.0f} Hz"
        )
        return finding("L116", where, message)
    end = "below" if hertz < chain.band_hz[0] else "above"
    message = f"the strongest line is at about {hertz:.0f} Hz, {end} chain.band_hz, {chain.band_hz[0]:g} to"
    return finding("L117", where, f"{message} {chain.band_hz[1]:g} Hz")


def _is_line(fit: LineFit) -> bool:
    """Tell whether a fit is a line: its amplitude is above five times its uncertainty."""
    return fit.amplitude >= LEAST_OVER_U * (fit.u if fit.snr < 1 else fit.u_noise)


def _of_line(fit: LineFit, rate: float, raw_rate: float, where: str, searched: tuple[float, float]) -> list[LabFinding]:
    """Return the findings about a single line, `searched` in a band, in the order of their codes."""
    out = []

    def say(code: str, message: str, severity: str | None = None) -> None:
        out.append(finding(code, where, message, severity))

    hertz = fit.frequency_hz
    if fit.masked > MOST_MASKED:
        say("L110", f"{fit.masked:.0%} of the samples were excluded")
    if not _is_line(fit):  # nothing else can be said of a line that is not there
        own = fit.u if fit.snr < 1 else fit.u_noise
        say("L111", f"the strongest has {fit.amplitude / own:.1f} times its uncertainty")
        return out
    if fit.second_hz:
        either = fit.second >= AS_STRONG and searched[0] <= fit.second_hz <= searched[1]
        message = f"a second line is at about {fit.second_hz:.1f} Hz, {fit.second:.2g} of the one at {hertz:.1f} Hz"
        mains = next((one for one in (50, 60) if near_multiple(np.array([fit.second_hz]), one, 0.5)[0]), None)
        hint = f", or set chain.mains_hz = {mains}" if mains else ""
        severity = "error" if either or abs(fit.second_hz - hertz) < BESIDE_HZ else "warning"
        say("L104", f"{message}; run one motor at a time{hint}", severity)
    if raw_rate < 4 * hertz:
        say("L102", f"{raw_rate:g} Hz for a line at {hertz:.1f} Hz")
    if fit.mains_hz:
        say("L105", f"{hertz:.2f} Hz next to {fit.mains_hz:g} Hz: the part of the mains is not known")
    periods = (fit.end_s - fit.start_s) * hertz
    if periods < LEAST_PERIODS:
        severity = "error" if periods < NO_PERIODS else "warning"
        say("L108", f"{periods:.0f} periods in the steady part", severity)
    noise = np.sqrt(2 / max(0.2 * rate, 1)) / fit.snr
    scatter = float(np.sqrt(max(fit.scatter**2 - noise**2, 0.0)))
    if scatter > MOST_SCATTER or fit.drift > MOST_DRIFT:
        severity = "error" if scatter > NO_SCATTER else "warning"
        say("L107", f"amplitude varies by {scatter:.1%}, frequency by {fit.drift:.1%}", severity)
    if fit.snr < LEAST_SNR and scatter <= MOST_SCATTER and not fit.second_hz:  # a modulation is no noise
        say("L118", f"the amplitude is {fit.snr:.1f} times the noise's standard deviation")
    return sorted(out, key=lambda one: one.code)

"""One record measured: its sections fitted and judged, its line as displacement by each chain of the campaign."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.attenuation.edge.estimates import rounded
from unitcad.check.rules.rule import Rule
from unitcad.errors import Refusal
from unitcad.files import sha256
from unitcad.geometry.arrays import Floats
from unitcad.lab.campaign import Campaign, RecordingTable, SensorTable, own_keys, recording_of
from unitcad.lab.chains import chains_of
from unitcad.lab.chains.chain import Chain, Line, LineFit, Mains
from unitcad.lab.chains.line import LOWEST, clip_mask, fit_line, spectrum
from unitcad.lab.readers import TIME_NAMES, Layout, Recording, open_recording
from unitcad.lab.units import UNITS, plain, seconds, to_si

RULES = {
    rule.code: rule
    for rule in map(
        Rule,
        (
            """L101 error: clipped
            The samples stay at a level that the motion exceeds. Down to 0.7 of the amplitude the rest
            is fitted; below, no amplitude is given. Example: An accelerometer of 2 g at 3 g. Fix: Widen
            the sensor's range.""",
            """L102 error: sampled too slowly
            Fewer than four samples a period: the sensor's filter and aliases change the amplitude.
            Example: 400 Hz for a motor of 125 Hz. Fix: Sample at 1 kHz or faster.""",
            """L103 error: uneven time axis
            A time lies off an even grid by more than 0.3 of a step: samples are missing or the clock
            varies. Example: A logger over USB that loses a packet. Fix: Record with a hardware clock.""",
            """L104 warning: several lines
            The band holds another number of lines than the unit's key lines says, which is 1 if left
            out. They were fitted together; the strongest one's amplitude is given. Example: Two motors
            of an array. Fix: Set lines = 2 in the unit's table, run one motor, or say which line is
            meant by chain.band_hz.""",
            """L105 warning: line on the mains
            The record can't tell the line from a multiple of the mains' frequency. Example: A motor at
            100.2 Hz over 2 s. Fix: Change the drive's voltage, record longer, or add a motor-off record
            as [blank].""",
            """L106 warning: line in the comb's null
            A chain's filters pass less than 0.9 of the line. Example: A motor at 100 Hz and the paper's
            comb at 50 Hz. Fix: Use the chain line, or another drive voltage.""",
            """L107 warning: unsteady
            The amplitude varies by more than 5 %, slowly or up and down, or the frequency by more than
            5 %, beyond the spin-up; or less than half of the record is steady. Example: A battery that
            runs down. Fix: Use a regulated supply and let the motor warm up.""",
            """L108 warning: fewer than 20 periods
            The steady part is too short for the noise beside the line to be known. Example: 0.1 s at
            125 Hz. Fix: Record 2 s.""",
            """L109 warning: repeats disagree
            The repeats' logarithms scatter by more than 0.15. Example: A unit that was not taped down
            again as before. Fix: Repeat, five times or more.""",
            """L110 error: drop-outs
            More than a tenth of the samples were left out: more than a robust fit bears. Example: A
            vibrometer on bare skin. Fix: Put retroreflective tape on the point.""",
            """L111 error: no line
            The band holds no line above five times its uncertainty. Example: The motor did not run.
            Fix: Repeat.""",
            """L112 error: too few repeats
            Fewer than three usable records are left: no level is given. Example: One of three is
            clipped. Fix: Repeat.""",
            """L113 warning: no line in a part
            A section of a long record has no line where others have one; the amplitude is that of the
            others. Example: The motor stopped. Fix: Cut the record where the motor stopped, or
            repeat.""",
            """L114 warning: not fit for a chain
            The chain gives no amplitude of this record: of drop-outs, clipped samples, several lines,
            or one that is too short. Example: The chain paper and a spike. Fix: Use the chain line.""",
            """L115 warning: chains disagree
            The intervals of two chains do not overlap. Example: Hum that one chain does not remove.
            Fix: Look at the spectra of the records.""",
            """L116 error: motor and unit at different frequencies
            No line of the unit lies within a tenth of the motor's frequency: no level is given.
            Example: The reference of another motor. Fix: Record the motor at the same voltage.""",
            """L117 error: stronger line outside the band
            A line outside chain.band_hz is stronger than the one in it, which may be its harmonic.
            Example: A motor at 45 Hz and a band from 60 Hz. Fix: Widen chain.band_hz.""",
            """L118 warning: low signal to noise
            The amplitude is less than ten times the standard deviation of what the fit leaves; where
            twice its uncertainty exceeds it, it is an error. Example: A point far from the unit. Fix:
            Record longer, average more, or a sensor of a smaller range.""",
            """L119 warning: missing samples
            Samples are no numbers: empty, or NaN. They are left out; beyond a tenth of them it is an
            error. Example: A logger that writes NaN where the laser lost the surface. Fix: Put
            retroreflective tape on the point.""",
        ),
    )
}


@dataclass(frozen=True)
class LabFinding:
    """One finding: code, severity, the record or level it is about, and what was measured."""

    code: str
    severity: str
    where: str
    message: str

    def as_dict(self) -> dict[str, str]:
        """Return JSON-ready data, with what to do."""
        return {**asdict(self), "title": RULES[self.code].title, "fix": RULES[self.code].fix}


def found(code: str, where: str, message: str, severity: str | None = None) -> LabFinding:
    """Return a finding with the severity of its rule, or the one that is given."""
    return LabFinding(code, severity or RULES[code].severity, where, message)


SECTION = 2**18
"""Samples that are fitted at a time: a longer record is fitted in sections."""
IRREGULAR = 0.3
"""Steps by which a time may lie off an even grid."""
SAME_RATE = 1e-3
"""Part by which the campaign's rate may differ from the file's own."""
HIGHEST_RATE = 5_000.0
"""Hz; records of more than twice this rate are averaged down to it."""


@dataclass(frozen=True)
class Signal:
    """A record's samples (n, channels) at `rate` in Hz: means of `averaged` neighbours of the file's at `raw_rate`.

    `count` and `missing`: samples of the file, and of each channel those that are no numbers; `off_grid`: by how many
    steps a time lies off an even grid.
    """

    samples: Floats
    raw_rate: float
    averaged: int
    count: int
    missing: tuple[int, ...]
    off_grid: float

    @property
    def rate(self) -> float:
        """The rate of the samples, Hz."""
        return self.raw_rate / self.averaged

    def gain(self, frequency_hz: float) -> float:
        """Return the gain that the averaging has at a frequency."""
        angle = np.pi * frequency_hz / self.raw_rate
        return float(np.sin(self.averaged * angle) / (self.averaged * np.sin(angle))) if self.averaged > 1 else 1.0

    def sections(self) -> Iterator[Floats]:
        """Yield the samples in sections; the last one has a quarter more at most."""
        start = 0
        while len(self.samples) - start >= SECTION + SECTION // 4:
            yield self.samples[start : start + SECTION]
            start += SECTION
        yield self.samples[start:]


def open_signal(path: Path, table: RecordingTable, sensors: tuple[SensorTable, ...], shown: str) -> Signal:
    """Return the signal of a record: the channel, and the motor's where the campaign declares one.

    Raises Refusal, naming the key to add, for what neither the file nor the campaign says.
    """
    recording = open_recording(path, Layout(table.delimiter, table.decimal, table.skip_lines))
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
    for column, sensor in zip(columns, sensors, strict=True):
        own = plain(channels[column].unit)
        if sensor.scale == 1.0 and own and own != plain(sensor.unit):
            limit = f"but {shown} says {own} for {channels[column].name}; declare sensor.scale, or the unit"
            raise Refusal("sensor.unit", sensor.unit, limit, own if own in UNITS[sensor.quantity] else None)
    samples = recording.columns(columns)
    count, missing = len(samples), tuple(int(n) for n in np.count_nonzero(~np.isfinite(samples), axis=0))
    off_grid = 0.0
    if stamps is not None:
        off = np.abs((stamps - stamps[0]) * rate - np.arange(count))
        off_grid = float(off.max()) if np.isfinite(off).all() else np.inf
    samples = samples * [sensor.scale for sensor in sensors]
    averaged = max(int(rate / HIGHEST_RATE), 1)
    if averaged > 1:
        samples = samples[: count // averaged * averaged].reshape(-1, averaged, samples.shape[1]).mean(axis=1)
    return Signal(samples, rate, averaged, count, missing, off_grid)


def _rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, Floats | None]:
    """Return the rate in Hz, and the times in s where they tell it.

    Raises Refusal where the file says another rate than the campaign does.
    """
    if table.rate_hz is None:
        return _own_rate(recording, table, time, column, shown)
    try:
        own, _ = _own_rate(recording, table, time, column, shown)
    except Refusal:  # it says none that could be compared
        return table.rate_hz, None
    if abs(table.rate_hz / own - 1) > SAME_RATE:
        says = "its header" if time is None else f"its column {recording.channels[time].name!r}"
        limit = f"differs from {shown}, which has {own:.6g} Hz by {says}"
        raise Refusal("recording.rate_hz", table.rate_hz, limit, float(f"{own:.9g}"))
    return table.rate_hz, None


def _own_rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, Floats | None]:
    """Return what the file says of its rate in Hz, and its times in s."""
    if time is None:
        step = recording.channels[column].step_s
        if step is None:
            raise Refusal("recording.rate_hz", None, f"is needed, or time_column: {shown} does not say its rate")
        return 1 / step, None
    unit = table.time_unit or recording.channels[time].unit
    if not unit:
        raise Refusal("recording.time_unit", None, f"is needed: {shown} does not say the unit of its time")
    stamps = recording.columns([time])[:, 0] * seconds(unit, "recording.time_unit")
    if len(stamps) < 2 or not stamps[-1] > stamps[0]:
        raise Refusal("recording.time_column", recording.channels[time].name, f"does not rise in {shown}")
    return float((len(stamps) - 1) / (stamps[-1] - stamps[0])), stamps


LEAST_GAIN = 0.9
HIGHEST_HZ = 500.0
"""Where a record's spectrum ends, in Hz."""
SAME_LINE_HZ = 0.5
MOST_SCATTER = MOST_DRIFT = 0.05
LEAST_PERIODS, NO_PERIODS = 20, 5
MOST_MASKED = 0.1
LEAST_STEADY = 0.5
"""Part of a record that its steady part is at least: a motor that spins up and runs leaves more of 2 s."""
LEAST_SNR = 10.0
LEAST_OVER_U = 5
"""The strongest of the 400 bins of noise in a band of 190 Hz over 2 s is above 4 in a record of ten, above 5 in few of
a thousand.
"""
TREMOR_HZ = 20
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
_OF_THE_RATE = ("L102", "L108")
"""Findings of the rate and the span, which unit and motor share."""


@dataclass(frozen=True)
class RecordResult:
    """A record's figures; amplitudes (peak) and standard uncertainties in um. `ratio` is to the motor's own channel.

    `usable`: it counts for levels. `by_chain` has each chain's amplitude over which a level is taken, without the
    chains that the record is not fit for; `by_line` the same of each line in the band by the chain `line`, with its
    frequency; `gains` what a chain's filters pass of the line; `picture` the samples and the spectrum of its first
    section, in the sensor's unit.
    """

    file: str
    sha256: str
    role: str
    rate_hz: float
    samples: int
    unit: str
    picture: tuple[Floats, Floats, Floats, Floats]
    findings: tuple[LabFinding, ...]
    usable: bool = False
    amplitude_um: float = 0.0
    u_um: float = 0.0
    shared: float = 0.0
    frequency_hz: float = 0.0
    drift: float = 0.0
    snr: float = 0.0
    steady_s: float = 0.0
    masked: float = 0.0
    lines: tuple[Line, ...] = ()
    ratio: float | None = None
    lag_deg: float | None = None
    by_chain: dict[str, float] = field(default_factory=dict)
    by_line: tuple[tuple[float, float], ...] = ()
    gains: dict[str, float] = field(default_factory=dict)

    @property
    def length_s(self) -> float:
        """The record's length in s."""
        return self.samples / self.rate_hz

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data, six significant digits; a record that counts for nothing has no uncertainty."""
        size = "amplitude_um" if self.ratio is None else "ratio"
        data = {key: value for key, value in vars(self).items() if isinstance(value, float | int | str)}
        data |= {} if self.usable else {"u_um": None, "shared": None}
        lines = [{"frequency_hz": one.frequency_hz, "amplitude_um": one.amplitude, "u_um": one.u} for one in self.lines]
        data |= {
            "length_s": self.length_s,
            "by_chain": self.by_chain,
            "by_line": [{"frequency_hz": hertz, size: value} for hertz, value in self.by_line],
            "gains": self.gains,
            "lines": lines if self.usable else [one | {"u_um": None} for one in lines],
            "findings": [one.as_dict() for one in self.findings],
        }
        return rounded(data, 6)


def measure_record(
    path: Path,
    role: str,
    campaign: Campaign,
    sensors: tuple[SensorTable, ...],
    mains: tuple[Mains, ...],
    band: tuple[float, float],
    shown: str,
    lines: int = 1,
) -> RecordResult:
    """Return a record's figures by every chain of the campaign; `mains` and `sensors` are the unit's, then the motor's.

    `band` is where its line is looked for, in Hz; `lines` how many it is expected to have.
    Raises Refusal for what can't be read.
    """
    with own_keys(campaign.recording, shown):
        signal = open_signal(path, recording_of(campaign.recording, shown), sensors, shown)
    chains, whole_band, mains_hz = chains_of(campaign.chain), campaign.chain.band_hz, campaign.chain.mains_hz
    names = (shown, f"{shown}, motor")
    sections: list[_Section] = []
    silent: list[tuple[float, int]] = []
    clipped = np.full(len(sensors), np.inf)
    outside: float | None = None
    picture: tuple[Floats, ...] = ()
    at_s = 0.0
    for samples in signal.sections():
        one = _fit_section(samples, signal.rate, band, mains, sensors, chains)
        frequency, size = spectrum(np.where(np.isfinite(samples[:, 0]), samples[:, 0], 0.0), signal.rate)
        low = frequency <= min(HIGHEST_HZ, signal.rate / 2)
        frequency, size = frequency[low], size[low]
        picture = picture or (np.arange(len(samples)) / signal.rate, samples[:, 0].copy(), frequency, size)
        if isinstance(one, int):
            silent.append((at_s, one))
            parts = [_clipped(channel) for channel in samples.T]
        else:
            sections.append(one)
            parts = [fit.clipped for fit in one.fits]
            outside = outside or _outside(frequency, size, whole_band, mains_hz, one.fits[0].frequency_hz)
        clipped = np.minimum(clipped, parts)
        at_s += len(samples) / signal.rate
    hertz = _outside(*picture[2:], band, mains_hz)
    hint = f"; the strongest line outside that is at about {hertz:.0f} Hz" if hertz else ""
    findings: list[LabFinding] = []
    if signal.off_grid > IRREGULAR:
        findings.append(found("L103", shown, f"a time lies {signal.off_grid:.2g} steps off an even grid"))
    for part, gaps, where in zip(clipped, signal.missing, names, strict=False):
        if part < np.inf:
            severity = "error" if part < LOWEST else "warning"
            findings.append(found("L101", where, f"at about {part:.2f} of the amplitude", severity))
        if gaps:
            message = f"{gaps} of {signal.count} samples ({gaps / signal.count:.2g} of them) are no numbers"
            severity = "error" if gaps > MOST_MASKED * signal.count else "warning"
            findings.append(found("L119", where, message, severity))
    result = RecordResult(shown, sha256(path), role, signal.raw_rate, signal.count, sensors[0].unit, picture, ())
    if not sections:
        message = f"nothing between {band[0]:.4g} and {band[1]:.4g} Hz{hint}"
        return replace(result, findings=(*findings, found("L111", names[silent[0][1]], message)))
    counts = [one.count for one in sections]
    fit, *motors = (_together(fits, counts) for fits in zip(*(one.fits for one in sections), strict=True))
    motor = motors[0] if motors else None
    for each, where, known in zip((fit, *motors), names, mains, strict=False):
        for one in _of_line(each, signal.rate, signal.raw_rate, where, known, lines):
            if (one.code, where) == ("L111", shown):
                one = replace(one, message=one.message + hint)
            if each is fit or one.code not in _OF_THE_RATE:
                findings.append(one)
    steady, length = sum(one.fits[0].end_s - one.fits[0].start_s for one in sections), sum(counts) / signal.rate
    if steady < LEAST_STEADY * length and not any(one.severity == "error" for one in findings):
        message = f"steady for {steady:.2f} s of {length:.2f} s; only that part was used"
        findings.append(found("L107", shown, message))
    if silent:
        count = len(sections) + len(silent)
        message = f"{len(silent)} of {count} sections, the first from {silent[0][0]:.0f} s of {at_s:.0f} s"
        findings.append(found("L113", shown, message))
    if outside is not None:
        findings.append(found("L117", shown, f"a stronger line lies at about {outside:.0f} Hz, outside chain.band_hz"))
    hertz = fit.frequency_hz
    factor = displacement(sensors[0], hertz) / signal.gain(hertz)
    whole, ratio, lag = fit.amplitude * factor, None, None
    if motor is not None:  # displacement over the motor's, and its phase, behind the motor's where negative
        turn = [displacement(sensor, hertz) / 1j ** _ORDER[sensor.quantity] for sensor in sensors]
        values = [one.fits[0].value / one.fits[1].value for one in sections]
        value = complex(np.mean(values)) * turn[0] / turn[1]
        whole = ratio = abs(value)
        lag = float(np.degrees(np.angle(value)))

    def over_motor(hertz: float) -> float:
        return displacement(sensors[0], hertz) / displacement(sensors[1], hertz)

    by_chain, gains, unfit = {}, {}, []
    for chain in chains:
        values = [one.amplitudes[chain.name] for one in sections]
        reason = chain.unfit([each for one in sections for each in one.fits])
        reason = reason or next((one for one in values if isinstance(one, str)), "")
        if chain.gain:
            gains[chain.name] = chain.gain(hertz)
        if (gain := gains.get(chain.name, 1.0)) < LEAST_GAIN:
            message = f"the filters of the chain {chain.name} pass {gain:.3f} of {hertz:.2f} Hz"
            findings.append(found("L106", shown, message))
        if reason:
            unfit.append(found("L114", shown, f"{chain.name}: {reason}"))
        elif gain >= LEAST_GAIN:
            mean = float(np.average(np.array(values, float), weights=counts))
            by_chain[chain.name] = mean * (factor if motor is None else over_motor(hertz))
    if "line" in by_chain:
        by_chain["line"] = whole
    findings += unfit
    # The lines of the section that has most of them, each over the motor's line of the same frequency.
    by_line = [(hertz, whole)]
    most = max(sections, key=lambda one: len(one.fits[0].lines)).fits
    if any(each.lines for each in most):
        by_line = []
        for line in _lines(most[0]):
            size = line.amplitude * factor
            if motor is not None:
                near = min(_lines(most[1]), key=lambda one: abs(one.frequency_hz - line.frequency_hz))
                if abs(near.frequency_hz - line.frequency_hz) > SAME_LINE_HZ:
                    continue
                size = line.amplitude / near.amplitude * over_motor(line.frequency_hz)
            if whole_band[0] <= line.frequency_hz <= whole_band[1]:
                by_line.append((line.frequency_hz, size))
    return replace(
        result,
        findings=tuple(findings),
        usable=not any(one.severity == "error" for one in findings),
        amplitude_um=fit.amplitude * factor,
        u_um=fit.u * factor,
        shared=float(np.hypot(fit.u_mains / fit.amplitude, motor.u_mains / motor.amplitude if motor else 0.0)),
        frequency_hz=hertz,
        drift=fit.drift,
        snr=fit.snr,
        steady_s=steady,
        masked=fit.masked,
        lines=tuple(Line(one.frequency_hz, one.amplitude * factor, one.u * factor) for one in fit.lines),
        ratio=ratio,
        lag_deg=lag,
        by_chain=by_chain,
        by_line=tuple(by_line),
        gains=gains,
    )


def displacement(sensor: SensorTable, frequency_hz: float) -> float:
    """Return um of displacement per unit of the sensor at a frequency: a line over (j omega) once or twice."""
    si = to_si(sensor.unit, sensor.quantity, "sensor.unit")
    return 1e6 * si / (2 * np.pi * frequency_hz) ** _ORDER[sensor.quantity]


@dataclass(frozen=True)
class _Section:
    """A section of `count` samples: the fit of the unit's channel and of the motor's, if there is one.

    `amplitudes` has by chain the amplitude in the sensor's unit, over the motor's in its own if there is one; or the
    reason why the chain can't take the section.
    """

    fits: tuple[LineFit, ...]
    amplitudes: dict[str, float | str]
    count: int


def _fit_section(
    samples: Floats,
    rate: float,
    band: tuple[float, float],
    mains: tuple[Mains, ...],
    sensors: tuple[SensorTable, ...],
    chains: tuple[Chain, ...],
) -> _Section | int:
    """Fit one section: the motor's channel first, if there is one, whose phase the other channel then has.

    Returns the number of the channel that has no line, if one has none: 0 the unit's, 1 the motor's.
    """
    fits: list[LineFit] = []
    for i in reversed(range(samples.shape[1])):
        shared = (fits[0].phase, (fits[0].start_s, fits[0].end_s)) if fits else (None, None)
        fit = fit_line(samples[:, i], rate, band, mains[i], sensors[i].full_scale, *shared)
        if fit is None or not fit.amplitude > 0:
            return i
        fits.insert(0, fit)
    amplitudes: dict[str, float | str] = {}
    for chain in chains:
        try:
            values = [chain.amplitude(samples[:, i], rate, fit) for i, fit in enumerate(fits)]
            amplitudes[chain.name] = values[0] / values[1] if len(values) > 1 else values[0]
        except Refusal as refusal:
            amplitudes[chain.name] = refusal.limit
    return _Section(tuple(fits), amplitudes, len(samples))


def _lines(fit: LineFit) -> tuple[Line, ...]:
    return fit.lines or (Line(fit.frequency_hz, fit.amplitude, fit.u),)


def _together(fits: tuple[LineFit, ...], counts: list[int]) -> LineFit:
    """Return one fit for all sections of `counts` samples: mean amplitude and frequency, the worst of what warns."""
    if len(fits) == 1:
        return fits[0]
    weights = np.array(counts) / sum(counts)
    amplitudes, hertz = ([getattr(fit, key) for fit in fits] for key in ("amplitude", "frequency_hz"))
    amplitude, frequency = float(weights @ amplitudes), float(weights @ hertz)
    u, u_noise = (float(np.linalg.norm(weights * [getattr(fit, key) for fit in fits])) for key in ("u", "u_noise"))
    worst = {key: max(getattr(fit, key) for fit in fits) for key in ("u_mains", "drift", "scatter", "mains_hz")}
    means = {key: float(weights @ [getattr(fit, key) for fit in fits]) for key in ("masked", "dropped", "missing")}
    worst["drift"] = max(float(np.ptp(hertz)) / frequency, worst["drift"])
    worst["scatter"] = max(float(np.std(amplitudes)) / amplitude, worst["scatter"])
    return replace(
        fits[0],
        amplitude=amplitude,
        u=float(np.hypot(u, worst["u_mains"])),
        u_noise=u_noise,
        frequency_hz=frequency,
        snr=float(np.median([fit.snr for fit in fits])),
        end_s=fits[0].start_s + sum(fit.end_s - fit.start_s for fit in fits),
        clipped=min(fit.clipped for fit in fits),
        lines=max((fit.lines for fit in fits), key=len),
        phase=None,
        blocks=(),
        **worst,
        **means,
    )


def _of_line(fit: LineFit, rate: float, raw_rate: float, where: str, mains: Mains, lines: int) -> list[LabFinding]:
    """Return what is wrong with a line, in the order of the codes, beside clipping; `lines` are expected.

    Of a channel that is clipped beyond repair nothing is said that follows from it: its fit leaves much, and changes.
    """
    out = []

    def say(code: str, message: str, severity: str | None = None) -> None:
        out.append(found(code, where, message, severity))

    hertz = fit.frequency_hz
    cut_off = fit.clipped < LOWEST
    if fit.masked > MOST_MASKED and not cut_off:
        say("L110", f"{fit.masked:.0%} of the samples were left out")
    own = float(np.sqrt(max(fit.u**2 - fit.u_mains**2, 0.0))) if fit.snr < 1 else fit.u_noise
    if fit.amplitude < LEAST_OVER_U * own and not cut_off:  # nothing else can be said of a line that is not there
        say("L111", f"the strongest has {fit.amplitude / own:.1f} times its uncertainty")
        return out
    if raw_rate < 4 * hertz:
        say("L102", f"{raw_rate:g} Hz for a line at {hertz:.1f} Hz")
    if fit.mains_hz:
        known = "its part is in the uncertainty" if mains.blank else "without a [blank] its part is not known"
        say("L105", f"{hertz:.2f} Hz beside {fit.mains_hz:g} Hz: {known}")
    periods = (fit.end_s - fit.start_s) * hertz
    if periods < LEAST_PERIODS:
        severity = "error" if periods < NO_PERIODS else "warning"
        say("L108", f"{periods:.0f} periods in the steady part", severity)
    if not cut_off:
        there = _lines(fit)
        if len(there) != lines:
            listed = ", ".join(f"{one.frequency_hz:.2f} Hz ({one.amplitude / fit.amplitude:.2f})" for one in there)
            expected = f", {lines} expected" if lines > 1 else ""
            say("L104", f"{len(there)} line{'s' if len(there) > 1 else ''}{expected}: {listed}")
        noise = np.sqrt(2 / max(0.2 * rate, 1)) / fit.snr
        scatter = float(np.sqrt(max(fit.scatter**2 - noise**2, 0.0)))
        if not fit.lines and (scatter > MOST_SCATTER or fit.drift > MOST_DRIFT):
            say("L107", f"amplitude varies by {scatter:.1%}, frequency by {fit.drift:.1%}")
        if 2 * fit.u > fit.amplitude:
            say("L118", f"twice the uncertainty is {2 * fit.u / fit.amplitude:.1f} times the amplitude", "error")
        elif fit.snr < LEAST_SNR:
            say("L118", f"the amplitude is {fit.snr:.1f} times the noise's standard deviation")
    return sorted(out, key=lambda one: one.code)


def _outside(
    frequency: Floats, size: Floats, band: tuple[float, float], mains_hz: float, own_hz: float | None = None
) -> float | None:
    """Return the frequency of the strongest line outside a band; None if all is noise there.

    `frequency` and `size` are a spectrum. The mains are no line. With `own_hz`, the line in the band, neither are its
    harmonics, and a weaker one than it is none either.
    """
    near = max(1.0, 3 * float(frequency[1] - frequency[0])) if len(frequency) > 1 else 1.0
    outside = (frequency > TREMOR_HZ) & ((frequency < band[0] - near) | (frequency > band[1] + near))
    outside &= np.abs(frequency - mains_hz * np.round(frequency / mains_hz)) > near
    least = 0.0
    if own_hz is not None:
        own = np.abs(frequency - own_hz) <= near
        harmonic = np.abs(frequency - own_hz * np.round(frequency / own_hz)) <= near
        outside &= (frequency < 1.5 * own_hz) | ~harmonic
        least = size[own].max(initial=0.0) if own.any() else np.inf
    if not outside.any():
        return None
    at = int(np.argmax(np.where(outside, size, 0.0)))
    return float(frequency[at]) if size[at] > max(8 * float(np.median(size[outside])), least) else None


def _clipped(samples: Floats) -> float:
    good = np.isfinite(samples)
    if good.sum() < 16 or not np.ptp(samples[good]) > 0:
        return float("inf")
    return clip_mask(np.where(good, samples - np.median(samples[good]), 0.0), good)[1]

"""Samples in the sensor's unit with their rate: what a recording tells, and what the campaign declares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.lab.campaign import RecordingTable, SensorTable
from unitcad.lab.quantities import UNITS, plain, seconds
from unitcad.lab.readers.formats import open_recording
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.recording import TIME_NAMES, Recording

SECTION = 2**18
"""Samples that are fitted at a time: a longer record is fitted in sections."""
IRREGULAR = 0.3
"""Steps by which a time may lie off an even grid."""
SAME_RATE = 1e-3
"""Part by which the campaign's rate may differ from the file's own."""
HIGHEST_RATE = 5_000.0
"""Hz; records of more than twice this rate are averaged down to it."""


@dataclass
class Signal:
    """A record's samples: `sections()` yields them (n, channels), `rate` is their rate in Hz, `raw_rate` the file's.

    After the sections have been read `off_grid` is by how many steps a time lay off an even grid, `count` how many
    samples the file had, and `missing` how many of each channel's were no numbers.
    """

    path: Path
    recording: Recording
    columns: tuple[int, ...]
    scales: tuple[float, ...]
    raw_rate: float
    time: int | None = None
    time_scale: float = 1.0
    off_grid: float = field(default=0.0, init=False)
    count: int = field(default=0, init=False)
    missing: list[int] = field(default_factory=list, init=False)

    @property
    def averaged(self) -> int:
        """How many neighbouring samples are averaged."""
        return max(int(self.raw_rate / HIGHEST_RATE), 1)

    @property
    def rate(self) -> float:
        """The rate of the sections' samples, Hz."""
        return self.raw_rate / self.averaged

    def gain(self, frequency_hz: float) -> float:
        """Return the gain that the averaging has at a frequency."""
        angle = np.pi * frequency_hz / self.raw_rate
        return float(np.sin(self.averaged * angle) / (self.averaged * np.sin(angle))) if self.averaged > 1 else 1.0

    def sections(self) -> Iterator[Floats]:
        """Yield the samples in sections; the last one has a quarter more at most. Raises Unreadable."""
        held: list[Floats] = []
        size, limit = 0, SECTION + SECTION // 4
        for block in self._averaged_blocks():
            held.append(block)
            size += len(block)
            while size >= limit:
                whole = np.concatenate(held)
                yield whole[:SECTION]
                held = [whole[SECTION:].copy()]
                size = len(held[0])
        if size:
            yield np.concatenate(held)

    def _averaged_blocks(self) -> Iterator[Floats]:
        every, rest = self.averaged, np.empty((0, len(self.columns)))
        for block in self._blocks():
            if every == 1:
                yield block
                continue
            whole = np.concatenate([rest, block])
            count = len(whole) // every * every
            rest = whole[count:]
            yield whole[:count].reshape(-1, every, whole.shape[1]).mean(axis=1)

    def _blocks(self) -> Iterator[Floats]:
        indices = self.columns if self.time is None else (*self.columns, self.time)
        first = None
        for block in self.recording.read(indices):
            if self.time is not None:
                stamps = block[:, -1] * self.time_scale * self.raw_rate
                first = float(stamps[0]) if first is None else first
                off = np.abs(stamps - first - self.count - np.arange(len(stamps)))
                self.off_grid = max(self.off_grid, float(off.max()) if np.isfinite(off).all() else np.inf)
                block = block[:, :-1]
            self.count += len(block)
            gaps = np.count_nonzero(~np.isfinite(block), axis=0)
            self.missing = [int(n) for n in gaps + (np.array(self.missing) if self.missing else 0)]
            yield block * np.array(self.scales)


def open_signal(path: Path, table: RecordingTable, sensors: tuple[SensorTable, ...], shown: str) -> Signal:
    """Return the signal of a record: the channel, and the motor's where the campaign declares one.

    Raises Refusal, naming the key to add, for what neither the file nor the campaign says.
    """
    recording = open_recording(path, Layout(table.delimiter, table.decimal, table.skip_lines))
    time = recording.time if table.time_column is None else recording.index(table.time_column, "recording.time_column")
    wanted = [table.channel, table.motor_channel][: len(sensors)]
    columns = []
    for key, name in zip(("channel", "motor_channel"), wanted, strict=False):
        if name is not None:
            columns.append(recording.index(name, f"recording.{key}"))
            continue
        others = [i for i in range(len(recording.channels)) if i != time]
        if len(others) != 1:
            limit = f"is needed, a name or a number: {shown} has {len(others)} channels: {recording.numbered(others)}"
            likely = [i for i in others if recording.channels[i].name.strip().lower() not in TIME_NAMES]
            raise Refusal(f"recording.{key}", None, limit, likely[0] + 1 if likely else None)
        columns.append(others[0])
    rate, scale = _rate(recording, table, time, columns[0], shown)
    if table.rate_hz is not None:
        time = None
    for column, sensor in zip(columns, sensors, strict=True):
        _expect_unit(recording, column, sensor, shown)
    scales = tuple(sensor.scale for sensor in sensors)
    return Signal(path, recording, tuple(columns), scales, rate, time, scale)


def _rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, float]:
    """Return the rate in Hz, and the factor from the time column's unit to s.

    Raises Refusal where the file says another rate than the campaign does.
    """
    if table.rate_hz is None:
        return _own_rate(recording, table, time, column, shown)
    try:
        own, _ = _own_rate(recording, table, time, column, shown)
    except Refusal:  # it says none that could be compared
        return table.rate_hz, 1.0
    if abs(table.rate_hz / own - 1) > SAME_RATE:
        says = "its header" if time is None else f"its column {recording.channels[time].name!r}"
        limit = f"differs from {shown}, which has {own:.6g} Hz by {says}"
        raise Refusal("recording.rate_hz", table.rate_hz, limit, float(f"{own:.9g}"))
    return table.rate_hz, 1.0


def _own_rate(
    recording: Recording, table: RecordingTable, time: int | None, column: int, shown: str
) -> tuple[float, float]:
    """Return what the file says of its rate in Hz, and the factor from the time column's unit to s."""
    step = recording.channels[column].step_s
    if time is None:
        if step is None:
            raise Refusal("recording.rate_hz", None, f"is needed, or time_column: {shown} does not say its rate")
        return 1 / step, 1.0
    unit = table.time_unit or recording.channels[time].unit
    if not unit:
        raise Refusal("recording.time_unit", None, f"is needed: {shown} does not say the unit of its time")
    scale = seconds(unit, "recording.time_unit")
    first = last = None
    count = 0
    for block in recording.read((time,)):
        first = float(block[0, 0]) if first is None else first
        last = float(block[-1, 0])
        count += len(block)
    if first is None or last is None or count < 2 or not last > first:
        raise Refusal("recording.time_column", recording.channels[time].name, f"does not rise in {shown}")
    return (count - 1) / ((last - first) * scale), scale


def _expect_unit(recording: Recording, column: int, sensor: SensorTable, shown: str) -> None:
    """Refuse a channel whose own unit is another one than the sensor's, where no scale explains it."""
    own = plain(recording.channels[column].unit)
    units = UNITS[sensor.quantity]
    if sensor.scale == 1.0 and own and own != plain(sensor.unit):
        limit = f"but {shown} says {own} for {recording.channels[column].name}; declare sensor.scale, or the unit"
        raise Refusal("sensor.unit", sensor.unit, limit, own if own in units else None)

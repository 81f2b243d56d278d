"""What motor-off records tell: the mains' amplitudes, of the unit's sensor and of the motor's."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from unitcad.lab.campaign import Campaign, RecordingTable, SensorTable
from unitcad.lab.chains import least_squares
from unitcad.lab.chains.line import Mains
from unitcad.lab.readers.formats import open_recording
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.signals import open_signal
from unitcad.lab.unit_files import file_of


def mains_of_blanks(campaign: Campaign, folder: Path) -> tuple[Mains, Mains]:
    """Return the mains of the unit's sensor and of the motor's, by multiple the largest amplitude of all records.

    The motor's are of the motor's channel where blank.records have it, of blank.motor_records where its sensor records
    alone, and the unit's where both have one sensor. Raises Refusal for a record that can't be read.
    """
    hertz = campaign.chain.mains_hz
    if campaign.blank is None:
        return Mains(hertz), Mains(hertz)
    table = campaign.recording
    paths = [file_of(folder, name, f"blank.records.{i}") for i, name in enumerate(campaign.blank.records)]
    unit = Mains(hertz, _mains(paths, table, campaign.sensor, hertz))
    motor = campaign.motor_sensor or campaign.sensor
    if table.motor_channel is not None:
        there = [path for path in paths if _has(path, table, table.motor_channel)]
        alone = msgspec.structs.replace(table, channel=table.motor_channel, motor_channel=None)
        return unit, Mains(hertz, _mains(there, alone, motor, hertz))
    if motor == campaign.sensor:
        return unit, unit
    names = campaign.blank.motor_records
    paths = [file_of(folder, name, f"blank.motor_records.{i}") for i, name in enumerate(names)]
    return unit, Mains(hertz, _mains(paths, table, motor, hertz))


def _has(path: Path, table: RecordingTable, channel: int | str) -> bool:
    """Tell whether a motor-off record has the motor's channel; one of the unit's sensor alone need not."""
    channels = open_recording(path, Layout(table.delimiter, table.decimal, table.skip_lines)).channels
    return channel <= len(channels) if isinstance(channel, int) else channel in [one.name for one in channels]


def _mains(
    paths: list[Path], table: RecordingTable, sensor: SensorTable, hertz: float
) -> tuple[tuple[int, float], ...]:
    """Return the mains' amplitudes by multiple, in the sensor's unit."""
    largest: dict[int, float] = {}
    for path in paths:
        signal = open_signal(path, table, (sensor,), path.name)
        samples = next(signal.sections())[:, 0]
        good = np.isfinite(samples)
        time = np.arange(len(samples)) / signal.rate
        orders = least_squares.mains_orders(hertz, signal.rate, (), float(time[-1]))
        columns = np.concatenate([least_squares.mains_columns(time, hertz, orders), least_squares.trend_columns(time)])
        values = least_squares.solve(columns, np.where(good, samples, 0.0), good.astype(float))
        for i, order in enumerate(orders):
            largest[order] = max(largest.get(order, 0.0), float(np.hypot(*values[2 * i : 2 * i + 2])))
    return tuple(sorted(largest.items()))

"""What motor-off records tell: the mains' amplitudes, of the unit's sensor and of the motor's."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec
import numpy as np

from unitcad.lab.campaign import Campaign, RecordingTable, SensorTable
from unitcad.lab.chains import least_squares
from unitcad.lab.chains.line import Mains
from unitcad.lab.own_recordings import own_keys, recording_of
from unitcad.lab.readers.formats import open_recording
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.signals import open_signal


def mains_of_blanks(campaign: Campaign, folder: Path) -> tuple[Mains, Mains]:
    """Return the mains of the unit's sensor and of the motor's, by multiple the largest amplitude of all records.

    The motor's are of the motor's channel where blank.records have it, of blank.motor_records where its sensor records
    alone, and the unit's where both have one sensor. The files are there (`campaign_files.check_files`). Raises Refusal
    for a record that can't be read.
    """
    hertz = campaign.chain.mains_hz
    if campaign.blank is None:
        return Mains(hertz), Mains(hertz)
    table = campaign.recording
    names = campaign.blank.records
    unit = Mains(hertz, _mains(folder, names, table, campaign.sensor, hertz))
    motor = campaign.motor_sensor or campaign.sensor
    if table.motor_channel is not None:
        there = [name for name in names if _has(folder / name, recording_of(table, name))]
        return unit, Mains(hertz, _mains(folder, there, table, motor, hertz, of_motor=True))
    if motor == campaign.sensor:
        return unit, unit
    return unit, Mains(hertz, _mains(folder, campaign.blank.motor_records, table, motor, hertz))


def _has(path: Path, table: RecordingTable) -> bool:
    """Tell whether a motor-off record has the motor's channel; one of the unit's sensor alone need not."""
    channel = table.motor_channel
    channels = open_recording(path, Layout(table.delimiter, table.decimal, table.skip_lines)).channels
    return channel <= len(channels) if isinstance(channel, int) else channel in [one.name for one in channels]


def _mains(
    folder: Path,
    names: Iterable[str],
    table: RecordingTable,
    sensor: SensorTable,
    hertz: float,
    of_motor: bool = False,
) -> tuple[tuple[int, float], ...]:
    """Return the mains' amplitudes by multiple, in the sensor's unit; `of_motor`: of the motor's channel."""
    largest: dict[int, float] = {}
    for name in names:
        own = recording_of(table, name)
        if of_motor:
            own = msgspec.structs.replace(own, channel=own.motor_channel, motor_channel=None)
        with own_keys(table, name):
            signal = open_signal(folder / name, own, (sensor,), name)
        samples = next(signal.sections())[:, 0]
        good = np.isfinite(samples)
        time = np.arange(len(samples)) / signal.rate
        orders = least_squares.mains_orders(hertz, signal.rate, (), float(time[-1]))
        columns = np.concatenate([least_squares.mains_columns(time, hertz, orders), least_squares.trend_columns(time)])
        values = least_squares.solve(columns, np.where(good, samples, 0.0), good.astype(float))
        for i, order in enumerate(orders):
            largest[order] = max(largest.get(order, 0.0), float(np.hypot(*values[2 * i : 2 * i + 2])))
    return tuple(sorted(largest.items()))

"""Units between columns, files and records: each is converted, or refused with both named."""

import numpy as np
import pytest

from unitcad.errors import Refusal
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import measure

TIME = np.arange(1000) / 1000
LEVEL = 0.4


def measured(folder, sensor, columns, paired=True):
    """Measure three records; `columns` has for each channel its unit in the file, and the size of a unit in it."""
    for i in range(3):
        table, names = [TIME], ["Time (s)"]
        for name, (unit, size) in columns.items():
            amplitude = size * (1.0 if name.startswith("m") else LEVEL)
            table.append(amplitude * np.cos(2 * np.pi * 125.3 * TIME + i))
            names.append(f"{name} ({unit})" if unit else name)
        for k, name in enumerate(columns, 1):
            rows = zip(*table, strict=True) if paired else zip(TIME, table[k], strict=True)
            head = names if paired else ["Time (s)", names[k]]
            text = "\n".join([",".join(head), *(",".join(f"{value:.9g}" for value in row) for row in rows)])
            (folder / f"{'r' if paired else name}{i}.csv").write_text(text + "\n")
    files = {key: [f"{key}{i}.csv" for i in range(3)] for key in "rem"}
    keys = f"edge = {files['r']}" if paired else f"reference = {files['m']}\nedge = {files['e']}"
    channels = '[recording]\nchannel = "e"\nmotor_channel = "m"\n' if paired else ""
    (folder / "c.toml").write_text(f'name = "t"\n{sensor}{channels}[[unit]]\nname = "u"\n{keys}\n')
    return measure(read_campaign(folder / "c.toml"), folder)


def sensor(quantity, unit, more="", table="sensor"):
    return f'[{table}]\nquantity = "{quantity}"\nunit = "{unit}"\n{more}'


VELOCITY, VOLTS = sensor("velocity", "mm/s"), sensor("velocity", "mm/s", 'scale = 50.0\nper = "V"\n')
MOTION = [
    (VELOCITY, ("mm/s", 1.0), ("um/s", 1000.0)),
    (VELOCITY, ("m/s", 0.001), ("mm/s", 1.0)),
    (sensor("acceleration", "m/s2"), ("g", 1 / 9.80665), ("m/s^2", 1.0)),
    (sensor("displacement", "um"), ("mm", 0.001), ("µm", 1.0)),
    (VOLTS, ("V", 1.0), ("mV", 1000.0)),
    (VOLTS, ("uV", 1e6), ("Volt", 1.0)),
    (VOLTS, ("", 1.0), ("mV", 1000.0)),
    (sensor("velocity", "mm/s", 'scale = 3.0\nper = "mm/s"\n'), ("um/s", 1000.0), ("mm/s", 1.0)),
]


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(("table", "motor", "edge"), MOTION)
def test_units_that_a_file_states_are_converted(tmp_path, table, motor, edge, paired):
    result = measured(tmp_path, table, {"m": motor, "e": edge}, paired)
    assert result.levels[0].level.value == pytest.approx(LEVEL, rel=1e-4)


def test_a_unit_in_one_file_and_none_in_another_is_refused(tmp_path):
    """The motor's records are in V, the edge's in an unknown unit."""
    with pytest.raises(Refusal, match=r"is needed: e0.csv gives no unit, m0.csv gives V; nearest accepted: 'V'"):
        measured(tmp_path, sensor("velocity", "mm/s", "scale = 50.0\n"), {"m": ("V", 1.0), "e": ("", 1.0)}, False)


def test_a_scale_is_per_its_own_unit(tmp_path):
    """50 mm/s per mV at 125.3 Hz, in the motor's sensor too."""
    table = sensor("velocity", "mm/s", 'scale = 50.0\nper = "mV"\n')
    result = measured(tmp_path, table, {"m": ("mV", 1.0), "e": ("V", 1e-3)}, paired=False)
    (motor,) = {round(one.amplitude_um, 1) for one in result.records["u"] if one.role == "reference"}
    assert motor == pytest.approx(50e3 / (2 * np.pi * 125.3), rel=1e-3)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(
    ("table", "motor", "edge", "field", "words"),
    [
        (sensor("velocity", "mm/s", "scale = 50.0\n"), "V", "mV", "sensor.per", ("mV", "V")),
        (sensor("velocity", "mm/s", "scale = 50.0\n"), "V", "", "sensor.per", ("V", "no unit")),
        (sensor("velocity", "mm/s", "scale = 50.0\n"), "V", "FS", "sensor.per", ("V", "FS")),
        (sensor("velocity", "mm/s", "scale = 50.0\n"), "mA", "V", "sensor.per", ("mA", "V")),
        (sensor("velocity", "mm/s", "scale = 2.0\n"), "mm/s", "um/s", "sensor.scale", ("needs no scale",)),
        (VELOCITY, "um/s", "", "sensor.per", ("um/s", "no unit")),
        (VELOCITY, "um", "mm/s", "sensor.unit", ("um",)),
        (VELOCITY, "V", "V", "sensor.unit", ("V", "sensor.scale")),
        (VOLTS, "mm/s", "V", "sensor.per", ("mm/s", "'V'")),
    ],
)
def test_units_that_nobody_can_convert_are_refused(tmp_path, table, motor, edge, field, words, paired):
    with pytest.raises(Refusal) as refused:
        measured(tmp_path, table, {"m": (motor, 1.0), "e": (edge, 1.0)}, paired)
    assert refused.value.field == field
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_two_sensors_may_have_two_units(tmp_path):
    tables = sensor("velocity", "mm/s", "scale = 50.0\n") + sensor("displacement", "um", table="motor_sensor")
    size = 1e3 / (2 * np.pi * 125.3)  # um of 1 mm/s
    result = measured(tmp_path, tables, {"m": ("nm", 1e3 * size), "e": ("V", 1 / 50)}, paired=False)
    assert result.levels[0].level.value == pytest.approx(LEVEL, rel=1e-4)

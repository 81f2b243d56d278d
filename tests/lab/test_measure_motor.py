"""The motor's side of a level: its channel is judged by the same rules as the unit's."""

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.lab import measure_command
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import measure

RATE = 2000
TIME = np.arange(4000) / RATE
HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'


def paired(folder, motor, sensor=""):
    for i in range(3):
        unit = (60 + i) * np.cos(2 * np.pi * 121.3 * TIME) + np.random.default_rng(i).standard_normal(len(TIME))
        wavfile.write(folder / f"{i}.wav", RATE, (np.column_stack([unit, motor]) / 500).astype("<f4"))
    (folder / "c.toml").write_text(
        HEAD + sensor + "[recording]\nchannel = 1\nmotor_channel = 2\n"
        '[[unit]]\nname = "a"\nedge = ["0.wav", "1.wav", "2.wav"]\n'
    )
    return measure(read_campaign(folder / "c.toml"), folder)


MOTOR = 300 * np.cos(2 * np.pi * 121.3 * TIME)
RNG = np.random.default_rng(9)


@pytest.mark.parametrize(
    ("code", "motor", "sensor"),
    [
        ("L101", np.clip(MOTOR, -150, 150), ""),
        ("L110", MOTOR + np.where(RNG.random(4000) < 0.2, RNG.choice([-900.0, 900.0], 4000), 0.0), ""),
        ("L111", RNG.standard_normal(4000), ""),
        ("L111", np.zeros(4000), ""),
    ],
)
def test_a_bad_motor_channel_gives_no_level(tmp_path, code, motor, sensor):
    result = paired(tmp_path, motor, sensor)
    assert result.levels == ()
    found = [one for one in result.findings if one.where == "0.wav, motor"]
    assert (code, "error") in {(one.code, one.severity) for one in found}, result.findings


def test_the_motors_range_is_its_sensors(tmp_path):
    sensor = '[motor_sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\nfull_scale = 300.0\n'
    result = paired(tmp_path, MOTOR, sensor)
    found = {(one.code, one.where) for one in result.findings}
    assert found == {*(("L101", f"{i}.wav, motor") for i in range(3)), ("L112", "a, edge")}


def apart(folder, edge, motor):
    for i in range(3):
        for name, x in (("m", motor), ("e", edge)):
            noise = np.random.default_rng([i, ord(name)]).standard_normal(len(x))
            x_i = x * (1 + 0.005 * i) + noise
            wavfile.write(folder / f"{name}{i}.wav", RATE, (x_i / 500).astype("<f4"))
    (folder / "c.toml").write_text(
        HEAD + '[chain]\nuse = ["line", "bandpass"]\n[[unit]]\nname = "a"\n'
        'reference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'
    )
    return measure(read_campaign(folder / "c.toml"), folder)


def test_two_motors_at_once_give_no_level(tmp_path):
    """Each record names both lines, the strongest first, and shows no amplitude."""
    one, two = (np.cos(2 * np.pi * hz * TIME) for hz in (118.0, 126.0))
    result = apart(tmp_path, 60 * one + 90 * two, 300 * one + 150 * two)
    assert result.levels == ()
    said = {one.where: one.message for one in result.findings if one.code == "L104"}
    assert said["m0.wav"] == "118.00 Hz, 126.00 Hz, of 1.00, 0.50 of the strongest; run one motor at a time"
    assert said["e0.wav"] == "126.00 Hz, 118.00 Hz, of 1.00, 0.67 of the strongest; run one motor at a time"
    data = measure_command.as_data(result)["records"]
    assert [record["amplitude_um"] for record in data] == [None] * 6
    assert [round(line["frequency_hz"]) for line in data[0]["lines"]] == [118, 126]
    shown = [text for text in measure_command.lines(result) if ".wav" in text]
    assert all(text.endswith("not used, L104 several lines") for text in shown)
    assert "<td>no</td>" in measure_command.page(result, {})


def test_a_motor_below_the_band_is_not_measured_by_its_harmonic(tmp_path):
    x = np.cos(2 * np.pi * 44.0 * TIME) + 0.3 * np.cos(2 * np.pi * 88.0 * TIME + 1.0)
    result = apart(tmp_path, 90 * x, 300 * x)
    assert result.levels == ()
    outside = [one for one in result.findings if one.code == "L117"]
    assert len(outside) == 6
    assert "about 44 Hz" in outside[0].message

"""The motor's side of a level: its channel is judged by the same rules as the unit's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import Measured, measure

RATE = 2000
TIME = np.arange(4000) / RATE
HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'


def paired(folder: Path, motor: np.ndarray, sensor: str = "") -> Measured:
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
def test_a_bad_motor_channel_gives_no_level(tmp_path: Path, code: str, motor: np.ndarray, sensor: str) -> None:
    result = paired(tmp_path, motor, sensor)
    assert result.levels == ()
    found = [one for one in result.findings if one.where == "0.wav, motor"]
    assert (code, "error") in {(one.code, one.severity) for one in found}, result.findings


def test_the_motors_range_is_its_sensors(tmp_path: Path) -> None:
    sensor = '[motor_sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\nfull_scale = 300.0\n'
    result = paired(tmp_path, MOTOR, sensor)
    assert {(one.code, one.where) for one in result.findings} == {("L101", f"{i}.wav, motor") for i in range(3)}

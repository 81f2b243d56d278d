"""`[[recording.override]]`: values of `[recording]` that some records of a campaign have for themselves."""

import numpy as np
import pytest
from scipy.io import savemat, wavfile

from unitcad.errors import Refusal
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import measure

HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\n'
UNIT = '[[unit]]\nname = "a"\nreference = ["m1.mat", "m2.mat", "m3.mat"]\nedge = ["e1.csv", "e2.csv", "e3.csv"]\n'


def wave(size, rate, seed):
    time = np.arange(int(2 * rate)) / rate
    return time, size * np.sin(2 * np.pi * 123.0 * time) + np.random.default_rng(seed).standard_normal(len(time))


@pytest.fixture
def folder(tmp_path):
    """Motor records of one logger, MATLAB at 5 kHz; the edge's of another, text with times, at 2 kHz."""
    for i in (1, 2, 3):
        savemat(tmp_path / f"m{i}.mat", {"disp": wave(200, 5000, i)[1][:, None], "temperature": np.zeros((10000, 1))})
        time, x = wave(50, 2000, 10 + i)
        rows = [f"{1000 * t:.2f},{v:.4f},0" for t, v in zip(time, x, strict=True)]
        (tmp_path / f"e{i}.csv").write_text("\n".join(["clock,laser (um),spare", *rows]))
    return tmp_path


def campaign(folder, recording):
    (folder / "c.toml").write_text(HEAD + recording + UNIT)
    return measure(read_campaign(folder / "c.toml"), folder)


BASE = '[recording]\ntime_column = "clock"\ntime_unit = "ms"\nchannel = "laser"\n'
OWN = '[[recording.override]]\nrecords = ["m*.mat"]\nrate_hz = 5000\nchannel = "disp"\n'


def test_records_of_two_loggers_are_one_campaign(folder):
    result = campaign(folder, BASE + OWN)
    assert result.levels[0].level.value == pytest.approx(0.25, rel=0.005)
    assert result.levels[0].frequency_hz == pytest.approx(123.0, abs=0.01)
    rates = {record.file: record.rate_hz for record in result.records["a"]}
    assert rates["m1.mat"] == pytest.approx(5000)
    assert rates["e1.csv"] == pytest.approx(2000)


def test_a_motor_off_record_may_have_its_own(folder):
    time = np.arange(8000) / 4000
    hum = np.column_stack([0 * time, 3 * np.cos(2 * np.pi * 50 * time)]).astype("<f4")
    wavfile.write(folder / "off.wav", 4000, hum)
    own = '[[recording.override]]\nrecords = ["off.wav"]\nchannel = 2\nrate_hz = 4000\n'
    result = campaign(folder, BASE + OWN + own + '[blank]\nrecords = ["off.wav"]\n')
    assert dict(result.mains)[1] == pytest.approx(3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("own", "field", "nearest"),
    [
        ('records = ["m?.mta"]\nrate_hz = 5000\n', "recording.override.0.records.0", "m3.mat"),
        ('records = ["m1.mat"]\n', "recording.override.0", None),
        ("records = []\nrate_hz = 5000\n", "recording.override.0.records", None),
        ('records = ["m*.mat"]\nmotor_channel = 2\n', "recording.override.0.motor_channel", None),
        (
            OWN[23:] + '[[recording.override]]\nrecords = ["m2.mat"]\nchannel = 2\n',
            "recording.override.1.records.0",
            None,
        ),
        ('records = ["m*.mat"]\nrate_hz = 5000\nchannel = "dsp"\n', "recording.override.0.channel", "disp"),
    ],
)  # fmt: skip
def test_what_can_not_be_meant_is_refused(folder, own, field, nearest):
    with pytest.raises(Refusal) as refusal:
        campaign(folder, f"{BASE}[[recording.override]]\n{own}")
    assert (refusal.value.field, refusal.value.nearest) == (field, nearest)

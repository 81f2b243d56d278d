"""What of a record is steady, missing, dropped or looked for elsewhere, and how it is said."""

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.errors import Refusal
from unitcad.lab import measure_command
from unitcad.lab.campaign import Campaign, RecordingTable, SensorTable, UnitTable, read_campaign
from unitcad.lab.chains import ChainTable
from unitcad.lab.chains.line import FALSE_ALARM, Mains, most_of_noise
from unitcad.lab.measuring import measure
from unitcad.lab.readers import expect_ending
from unitcad.lab.record import measure_record

RATE = 2000
TIME = np.arange(2 * RATE) / RATE
SENSOR = SensorTable(quantity="displacement", unit="um")
BAND = (60.0, 250.0)


def noise(size, seed=1):
    return size * np.random.default_rng(seed).standard_normal(len(TIME))


def line(size, hertz, seed=1):
    return size * np.cos(2 * np.pi * hertz * TIME + seed) + noise(0.02 * size, seed)


def record(folder, x, band=BAND):
    wavfile.write(folder / "a.wav", RATE, x.astype("<f4"))
    campaign = Campaign(
        name="t", sensor=SENSOR, unit=(UnitTable(name="a"),), chain=ChainTable(use=("line", "bandpass"))
    )
    return measure_record(folder / "a.wav", "edge", campaign, (SENSOR,), (Mains(),), band, "a.wav")


def said(result):
    return {one.code: one.message for one in result.findings}


@pytest.mark.parametrize(("first", "last"), [(115.0, 139.0), (120.0, 136.0), (139.0, 115.0)])
@pytest.mark.parametrize("order", [0, 1])
def test_a_sweep_is_unsteady(tmp_path, first, last, order):
    """A velocity's amplitude rises with the frequency, too."""
    hertz = first + (last - first) * TIME / 2
    size = 100 * (hertz / first) ** order
    result = record(tmp_path, size * np.cos(2 * np.pi * np.cumsum(hertz) / RATE) + noise(2.0))
    assert "L107" in said(result)


def test_a_record_that_is_steady_for_less_than_half_says_so(tmp_path):
    hertz = 115 + 12 * TIME
    result = record(tmp_path, 100 * np.cos(2 * np.pi * np.cumsum(hertz) / RATE) + noise(2.0))
    said_of_length = [one.message for one in result.findings if "steady for" in one.message]
    assert said_of_length == [f"steady for {result.steady_s:.2f} s of 2.00 s; only that part was used"]
    assert result.steady_s < 1
    assert result.as_dict()["length_s"] == 2.0


@pytest.mark.parametrize("constant", [0.03, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_spin_up_is_cut_and_nothing_is_wrong(tmp_path, constant, order):
    """A motor's speed approaches its own exponentially; the amplitude with its power, by the quantity."""
    hertz = 125 * (1 - np.exp(-TIME / constant))
    phase = 2 * np.pi * 125 * (TIME + constant * np.exp(-TIME / constant))
    result = record(tmp_path, 100 * (hertz / 125) ** order * np.cos(phase) + noise(2.0))
    assert "L107" not in said(result)
    assert 1.0 < result.steady_s < 1.9
    assert result.amplitude_um == pytest.approx(100.0, rel=0.01)


def test_noise_alone_is_called_a_drop_out_in_one_record_of_a_thousand_at_most():
    rng = np.random.default_rng(5)
    for count in (200, 4000):
        alarms = 0
        for _ in range(20):
            x = np.abs(rng.standard_normal((500, count)))
            alarms += int(np.sum(x.max(axis=1) > most_of_noise(count) * 1.4826 * np.median(x, axis=1)))
        assert alarms <= FALSE_ALARM * 10_000


@pytest.mark.parametrize(("part", "severity"), [(0.005, "warning"), (0.02, "warning"), (0.6, "error")])
def test_missing_samples_are_counted_and_named(tmp_path, part, severity):
    x = line(100, 127.3)
    x[np.random.default_rng(1).permutation(len(x))[: round(part * len(x))]] = np.nan
    result = record(tmp_path, x)
    (gaps,) = [one for one in result.findings if one.code == "L119"]
    assert gaps.severity == severity
    assert gaps.message.startswith(f"{round(part * len(x))} of 4000 samples")
    assert result.usable == (severity == "warning")
    if severity == "warning":
        assert "missing" in said(result)["L114"]
        assert result.amplitude_um == pytest.approx(100.0, abs=3 * result.u_um)


def test_a_line_outside_the_search_is_named(tmp_path):
    near = (0.8 * 127.3, 1.2 * 127.3)
    message = said(record(tmp_path, line(100, 160.0), near))["L111"]
    assert message.endswith("the strongest line outside that is at about 160 Hz")
    assert "strongest line outside" not in said(record(tmp_path, noise(1.0), near))["L111"]


HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\n[chain]\nuse = ["line", "bandpass"]\n'
UNIT = '[[unit]]\nname = "a"\nreference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'


def measured(folder, records, text=HEAD + UNIT):
    for name, x in records.items():
        wavfile.write(folder / f"{name}.wav", RATE, x.astype("<f4"))
    (folder / "c.toml").write_text(text)
    return measure(read_campaign(folder / "c.toml"), folder)


def test_the_length_that_was_used_is_shown(tmp_path):
    records = {f"m{i}": line(300, 127.3, i) for i in range(3)} | {f"e{i}": line(100, 127.3, 9 + i) for i in range(3)}
    records["e1"] = np.where(TIME > 0.6, records["e1"], 0.0)
    result = measured(tmp_path, records)
    (shown,) = [text for text in measure_command.lines(result) if "e1.wav" in text]
    used = result.records["a"][4].steady_s
    assert 1.0 < used < 1.4
    assert f"127.30 Hz over {used:.3g} s of 2 s" in shown
    measure_command.write(result, tmp_path / "out")
    assert f"<td>{used:.3g} of 2</td>" in (tmp_path / "out/measure.html").read_text()


def test_a_file_without_a_reader_is_named(tmp_path):
    with pytest.raises(Refusal) as refused:
        expect_ending(tmp_path / "scan 3.svd", "unit.0.edge.1")
    assert refused.value.value == "scan 3.svd"


def test_hdf5_tells_its_time_and_a_channel_goes_without_its_group(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values, unit in (("G/t", TIME, "s"), ("G/x", line(100, 127.3), "um"), ("H/y", TIME, "um")):
            file[name] = values
            file[name].attrs["units"] = unit
    table = RecordingTable(channel="x")
    campaign = Campaign(name="t", sensor=SENSOR, recording=table, unit=(UnitTable(name="a"),))
    result = measure_record(tmp_path / "a.h5", "edge", campaign, (SENSOR,), (Mains(),), BAND, "a.h5")
    assert (result.rate_hz, result.findings) == (pytest.approx(2000.0), ())
    assert result.amplitude_um == pytest.approx(100.0, rel=0.01)

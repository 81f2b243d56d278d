"""What a record is refused or doubted for, and how it is shown."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.errors import Refusal
from unitcad.lab import measure_command
from unitcad.lab.campaign import Campaign, SensorTable, UnitTable, read_campaign
from unitcad.lab.chains import CHAINS
from unitcad.lab.chains.line import Mains
from unitcad.lab.measuring import measure
from unitcad.lab.record import measure_record

RATE = 2000
TIME = np.arange(2 * RATE) / RATE
SENSOR = SensorTable(quantity="displacement", unit="um", scale=500.0)
HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'


def record(folder, x):
    wavfile.write(folder / "a.wav", RATE, (x / 500).astype("<f4"))
    campaign = Campaign(name="t", sensor=SENSOR, unit=(UnitTable(name="a"),))
    return measure_record(folder / "a.wav", "edge", campaign, (SENSOR,), (Mains(),), (60.0, 250.0), "a.wav")


def noise(size=1.0, seed=1):
    return size * np.random.default_rng(seed).standard_normal(len(TIME))


@pytest.mark.parametrize("rail", [1, -1])
@pytest.mark.parametrize("at", [60.0, 30.0, 5.0, 0.0, -30.0, -80.0])
def test_a_clip_at_one_rail_is_clipping_and_nothing_else(tmp_path, rail, at):
    """Down to a rail beyond the line's middle: more than half of the samples then lie on the plateau."""
    x = 7.0 + rail * np.minimum(100 * np.cos(2 * np.pi * 121.3 * TIME) + noise(), at)
    result = record(tmp_path, x)
    assert [(one.code, one.severity) for one in result.findings] == [("L101", "error")]
    assert not result.usable


@pytest.mark.parametrize("hz", [0.6, 1.0, 2.5, 5.0, 9.0])
def test_a_slow_modulation_is_unsteady_and_one_line(tmp_path, hz):
    """Two equal lines to either side of one are one amplitude that goes up and down."""
    swing = 1 + 0.3 * np.cos(2 * np.pi * hz * TIME + 0.4)
    result = record(tmp_path, 100 * swing * np.cos(2 * np.pi * 121.3 * TIME) + noise())
    assert {one.code for one in result.findings} == {"L107"}
    assert "amplitude varies by 2" in result.findings[0].message  # 0.3 over the root of 2
    assert result.lines == ()
    assert result.amplitude_um == pytest.approx(100.0, abs=max(3 * result.u_um, 1.0))


@pytest.mark.parametrize(
    ("ratio", "found"), [(12.0, set()), (7.0, {("L118", "warning")}), (1.0, {("L118", "warning")})]
)
def test_a_low_signal_to_noise_is_said(tmp_path, ratio, found):
    result = record(tmp_path, 10 * np.cos(2 * np.pi * 121.3 * TIME) + noise(10 / ratio))
    assert {(one.code, one.severity) for one in result.findings} == found
    assert result.usable


def test_an_amplitude_below_twice_its_uncertainty_is_an_error(tmp_path):
    """A line under mains as large as itself: the noise is small, and yet nothing is known."""
    wavfile.write(tmp_path / "a.wav", RATE, (10 * np.cos(2 * np.pi * 100.0 * TIME) / 500 + noise(1e-4)).astype("<f4"))
    campaign = Campaign(name="t", sensor=SENSOR, unit=(UnitTable(name="a"),))
    mains = Mains(blank=((2, 9.0),))
    result = measure_record(tmp_path / "a.wav", "edge", campaign, (SENSOR,), (mains,), (60.0, 250.0), "a.wav")
    assert ("L118", "error") in {(one.code, one.severity) for one in result.findings}
    assert "L111" not in {one.code for one in result.findings}
    assert not result.usable


def test_a_stronger_line_outside_the_band_is_found(tmp_path):
    x = 50 * np.cos(2 * np.pi * 121.3 * TIME) + 200 * np.cos(2 * np.pi * 47.0 * TIME)
    assert "L117" in {one.code for one in record(tmp_path, x).findings}


def test_a_record_of_more_than_a_minute_is_refused(tmp_path):
    wavfile.write(tmp_path / "a.wav", 1000, np.zeros(61_000, "<f4"))
    campaign = Campaign(name="t", sensor=SENSOR, unit=(UnitTable(name="a"),))
    with pytest.raises(Refusal, match=r"a\.wav: lasts 61 s; cut the record to 60 s or less"):
        measure_record(tmp_path / "a.wav", "edge", campaign, (SENSOR,), (Mains(),), (60.0, 250.0), "a.wav")


def test_more_than_one_motor_at_a_time_is_refused(tmp_path):
    with pytest.raises(Refusal, match="run one motor at a time") as refused:
        campaign_of(tmp_path, RECORDS, UNIT + "lines = 9\n")
    assert (refused.value.field, refused.value.nearest) == ("unit.0.lines", 1)


def campaign_of(folder, records, text):
    for name, x in records.items():
        wavfile.write(folder / f"{name}.wav", RATE, (np.atleast_2d(x).T / 500).astype("<f4"))
    (folder / "c.toml").write_text(HEAD + text)
    return measure(read_campaign(folder / "c.toml"), folder)


def line(size, seed, hz=121.3):
    return size * np.cos(2 * np.pi * hz * TIME) + noise(seed=seed)


UNIT = '[[unit]]\nname = "a"\nreference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'
RECORDS = {f"{key}{i}": line(size + i, i, 121.3) for key, size in (("m", 300), ("e", 90)) for i in range(3)}


def test_a_record_that_is_not_used_is_shown_without_uncertainty(tmp_path):
    clipped = {**RECORDS, "e1": np.clip(RECORDS["e1"], -30, 30)}
    result = campaign_of(tmp_path, clipped, UNIT)
    lines = {text.split(", ")[2].split(": ")[0]: text for text in measure_command.lines(result)}
    assert "not used" in lines["e1.wav"]
    assert "+-" not in lines["e1.wav"]
    assert "+-" in lines["e0.wav"]
    data = {one["file"]: one for one in measure_command.as_data(result)["records"]}
    assert (data["e1.wav"]["usable"], data["e1.wav"]["u_um"]) == (False, None)
    assert data["e0.wav"]["u_um"] > 0
    measure_command.write(result, tmp_path / "out")
    page = (tmp_path / "out" / "measure.html").read_text()
    row = page[page.index("<td>e1.wav") :][: page[page.index("<td>e1.wav") :].index("</tr>")]
    assert row.startswith("<td>e1.wav</td><td>no</td>")
    assert row.split("<td>")[4] == "</td>"


def test_a_run_leaves_its_own_files_alone(tmp_path):
    """More records first, then fewer; files of other names stay."""
    point = "[[unit.point]]\ndistance_mm = 5.0\nrecords = " + '["e0.wav", "e1.wav", "e2.wav"]\n'.replace("e", "p", 1)
    more = {**RECORDS, **{f"p{i}": line(40 + i, 7 + i) for i in range(3)}}
    out = tmp_path / "out"
    measure_command.write(campaign_of(tmp_path, more, UNIT + point.replace('"e', '"p')), out)
    (out / "notes.txt").write_text("mine")
    (out / "record-01-time.svg.bak").write_text("mine")
    measure_command.write(campaign_of(tmp_path, RECORDS, UNIT), out)
    found = {path.name for path in out.iterdir()}
    kinds = ("time", "periods", "spectrum")
    charts = {f"record-{i:02d}-{kind}.svg" for i in range(1, 7) for kind in kinds} | {"decay-01.svg"}
    own = {"measured.toml", "measure.json", "measure.html", *charts}
    assert found == own | {"notes.txt", "record-01-time.svg.bak"}


def test_an_interrupted_run_leaves_no_measured_toml(tmp_path, monkeypatch):
    """The levels never stand beside another run's charts."""
    out = tmp_path / "out"
    measure_command.write(campaign_of(tmp_path, RECORDS, UNIT), out)
    whole = Path.replace

    def full(self, target):
        if target.name == "measure.html":
            raise OSError("disk full")
        return whole(self, target)

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="disk full"):
        measure_command.write(campaign_of(tmp_path, RECORDS, UNIT), out)
    assert not (out / "measured.toml").exists()
    assert not [path for path in out.iterdir() if path.name.startswith(".tmp")]


def test_the_motors_sensor_has_a_blank_of_its_own(tmp_path):
    """A motor beside 100 Hz: its mains are in its uncertainty once a motor-off record of its sensor tells them."""
    off = {"off": 0.5 * np.cos(2 * np.pi * 100 * TIME) + noise(0.01), "quiet": noise(0.01, 2)}
    records = {**{name: line(300 if name < "f" else 90, i, 100.02) for i, name in enumerate(RECORDS)}, **off}
    records |= {f"m{i}": line(300, 20 + i, 100.02) for i in range(3)}
    sensor = '[motor_sensor]\nquantity = "displacement"\nunit = "um"\nscale = 1000.0\n'
    blank = '[blank]\nrecords = ["quiet.wav"]\n'
    result = campaign_of(tmp_path, records, sensor + blank + 'motor_records = ["off.wav"]\n' + UNIT)
    assert dict(result.motor_mains)[2] == pytest.approx(1.0, rel=0.01)  # in the motor's sensor's scale
    assert dict(result.mains)[2] < 0.01
    assert set(result.specs) == {"quiet.wav", "off.wav"}
    motor = [one for one in result.records["a"] if one.role == "reference"]
    assert all(one.shared * one.amplitude_um == pytest.approx(1.0 / np.sqrt(2), rel=0.05) for one in motor)
    assert "its part is in the uncertainty" in motor[0].findings[0].message


def test_a_chain_is_one_module_and_one_entry(tmp_path, monkeypatch):
    """A chain that reads the standard deviation: its name, gain, levels and refusals come with the entry."""
    (tmp_path / "rms_chain.py").write_text(
        "import numpy as np\n"
        "from unitcad.lab.chains import Chain\n"
        "def chain(table):\n"
        "    broken = 'it is out of order' if table.q == 7 else ''\n"
        "    rms = lambda x, rate, fit: float(np.sqrt(2) * np.std(x))\n"
        "    return Chain('rms', rms, unfit=lambda fits: broken, gain=lambda hertz: 0.95)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(Refusal, match="rms") as refused:
        campaign_of(tmp_path, RECORDS, '[chain]\nuse = ["line", "rms"]\n' + UNIT)
    assert refused.value.field == "chain.use.1"
    monkeypatch.setitem(CHAINS, "rms", "rms_chain:chain")
    result = campaign_of(tmp_path, RECORDS, '[chain]\nuse = ["line", "rms"]\n' + UNIT)
    levels = {one.chain: one.level.value for one in result.levels}
    assert levels["rms"] == pytest.approx(levels["line"], rel=1e-3)
    assert result.records["a"][0].gains == {"rms": 0.95}
    result = campaign_of(tmp_path, RECORDS, '[chain]\nuse = ["line", "rms"]\nq = 7.0\n' + UNIT)
    assert [one.chain for one in result.levels] == ["line"]
    assert {one.message for one in result.findings} == {"rms: it is out of order"}

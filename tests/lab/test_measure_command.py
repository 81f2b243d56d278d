"""`unitcad measure`: levels of a synthetic campaign with known truth, its files, findings and refusals."""

import hashlib
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from typer.testing import CliRunner

from benchmarks.accuracy.synthetic_records import Scenario, synthetic
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import measure
from unitcad.lab.record import RULES

RATE = 2000
SCENARIO = Scenario("lab", snr=60.0, drift=0.004, mains=(0.01, 0.004, 0.004), harmonics=(0.1, 0.05), spin_up_s=0.05)
FULL = 500.0
HEAD = '[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\nfull_scale = 500.0\n'


def write(path, *channels, rate=RATE):
    wavfile.write(path, rate, np.column_stack(channels).astype("<f4") / np.float32(FULL))


def campaign(folder, text, head=HEAD):
    (folder / "c.toml").write_text(f'name = "test"\n{head}{text}')
    return measure(read_campaign(folder / "c.toml"), folder)


def repeats(folder, stem, amplitude, hz, scenario=SCENARIO, seed=0):
    for i in range(3):
        rng = np.random.default_rng([seed, i, round(amplitude)])
        write(folder / f"{stem}{i}.wav", synthetic(scenario, rng, amplitude * (1 + 0.02 * (i - 1)), hz).x)
    return json.dumps([f"{stem}{i}.wav" for i in range(3)])


@pytest.fixture
def folder(tmp_path):
    motor, edge, far = (repeats(tmp_path, *one) for one in (("m", 300, 122), ("e", 120, 122.5), ("s", 30, 121.6)))
    time = np.arange(4000) / RATE
    write(tmp_path / "off.wav", 3 * np.cos(2 * np.pi * 50 * time) + 1.2 * np.cos(2 * np.pi * 100 * time))
    (tmp_path / "c.toml").write_text(
        f'name = "test"\n{HEAD}[blank]\nrecords = ["off.wav"]\n[chain]\nuse = ["line", "bandpass"]\n'
        f'[[unit]]\nname = "a"\nspec = "encapsulating"\nreference = {motor}\nedge = {edge}\n'
        f"[[unit.point]]\ndistance_mm = 10.0\nrecords = {far}\n"
    )
    return tmp_path


def test_a_campaign_has_the_levels_of_its_truth(folder):
    result = measure(read_campaign(folder / "c.toml"), folder)
    assert result.findings == ()
    truth = {0.0: 120 / 300, 10.0: 30 / 300}
    for one in result.levels:
        assert one.level.value == pytest.approx(truth[one.distance_mm], rel=0.005 if one.chain == "line" else 0.02)
        assert one.level.low < truth[one.distance_mm] < one.level.high
    assert len(result.levels) == 4
    for record in result.records["a"]:
        assert record.u_um < 0.02 * record.amplitude_um
        assert record.gains["bandpass"] == pytest.approx(1.0, abs=0.01)
    assert dict(result.mains)[1] == pytest.approx(3.0, rel=1e-3)


def test_the_files_of_a_campaign(folder, monkeypatch):
    monkeypatch.chdir(folder)
    done = CliRunner().invoke(app, ["measure", "c.toml", "-o", "one"])
    assert done.exit_code == 0, done.output
    assert done.output.splitlines()[-1] == "one"
    CliRunner().invoke(app, ["measure", "c.toml", "-o", "two"])
    files = {file.name: file.read_bytes() for file in Path("one").iterdir()}
    assert files == {file.name: file.read_bytes() for file in Path("two").iterdir()}
    measured = tomllib.loads(files["measured.toml"].decode())
    assert {level["status"] for level in measured["level"]} == {"measured"}
    assert measured["assumed"] == {"order": 4, "q": 30.0, "zero_phase": True, "measure": "rms", "trim_s": 0.25}
    assert len({record["sha256"] for record in measured["record"]}) == 9
    hashes = {one["file"]: one["sha256"] for one in measured["source"]}
    assert hashes == {name: hashlib.sha256(Path(name).read_bytes()).hexdigest() for name in ("c.toml", "off.wav")}
    assert {"measure.json", "measure.html", "record-01-time.svg", "record-01-spectrum.svg", "decay-01.svg"} <= set(
        files
    )
    page = files["measure.html"].decode()
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")
    assert "<script" not in page
    again = json.loads(CliRunner().invoke(app, ["measure", "c.toml", "--json"]).stdout)
    assert again["levels"] == measured["level"]


def test_velocity_over_j_omega_is_displacement(tmp_path):
    """The same motion as velocity in mm/s, as displacement in um, and as acceleration in m/s2, by construction."""
    rng = np.random.default_rng(1)
    time, hz = np.arange(4000) / RATE, 123.0
    omega = 2 * math.pi * hz
    rows = {"d": ([], "um", "displacement", 1.0), "v": ([], "mm/s", "velocity", omega * 1e-3)}
    rows["a"] = ([], "m/s2", "acceleration", omega**2 * 1e-6)
    amplitudes = {}
    for key, (names, unit, quantity, factor) in rows.items():
        for i in range(6):
            size = (300.0 if i < 3 else 120.0) * (1 + 0.01 * i)
            x = size * factor * (np.cos(omega * time + i) + 0.01 * rng.standard_normal(4000))
            names.append(f"{key}{i}.csv")
            text = "\n".join(f"{t:.4f},{v:.6e}" for t, v in zip(time, x, strict=True))
            (tmp_path / names[-1]).write_text(f"time (s),u ({unit})\n{text}\n")
        head = f'[sensor]\nquantity = "{quantity}"\nunit = "{unit}"\n'
        text = f'[[unit]]\nname = "a"\nreference = {json.dumps(names[:3])}\nedge = {json.dumps(names[3:])}\n'
        result = campaign(tmp_path, text, head)
        assert result.findings == ()
        amplitudes[key] = [record.amplitude_um for record in result.records["a"]]
    assert amplitudes["v"] == pytest.approx(amplitudes["d"], rel=1e-3)
    assert amplitudes["a"] == pytest.approx(amplitudes["d"], rel=1e-3)
    assert amplitudes["d"][0] == pytest.approx(300.0, rel=1e-3)


def test_a_motor_channel_gives_the_ratio(tmp_path):
    for i in range(3):
        motor = synthetic(Scenario("m", snr=100.0, wander=0.04, drift=0.01), np.random.default_rng(i), 250.0, 118.0)
        noise = np.random.default_rng(50 + i).standard_normal(len(motor.x))
        write(tmp_path / f"r{i}.wav", 0.35 * (1 + 0.01 * (i - 1)) * motor.x + noise, motor.x)
    text = '[recording]\nchannel = 1\nmotor_channel = 2\n[[unit]]\nname = "a"\nedge = ["r0.wav", "r1.wav", "r2.wav"]\n'
    result = campaign(tmp_path, text)
    assert result.levels[0].level.value == pytest.approx(0.35, rel=2e-3)
    assert result.records["a"][1].ratio == pytest.approx(0.35, rel=1e-3)
    assert result.records["a"][1].lag_deg == pytest.approx(0.0, abs=0.2)


def _faulty(fault):
    rng = np.random.default_rng(5)
    time = np.arange(6400) / 3200
    if fault == "L101":  # an accelerometer's line at 62.7 Hz that leaves its range: synthesised
        return np.clip(400 * np.cos(2 * np.pi * 62.7 * time), -200, 200), 3200, 62.7
    if fault == "L102":
        return 100 * np.cos(2 * np.pi * 110 * np.arange(800) / 400), 400, 110
    if fault == "L104":
        x = np.cos(2 * np.pi * 121 * time) + 0.6 * np.cos(2 * np.pi * 124 * time)
        return 100 * x + rng.standard_normal(len(time)), 3200, 121
    if fault in ("L105", "L106"):
        return synthetic(Scenario("m", mains=(0, 0.02, 0)), rng, 100, 100.2).x, 2000, 100.2
    if fault == "L107":
        return 100 * (1 - 0.2 * time) * np.cos(2 * np.pi * 120 * time), 3200, 120
    if fault == "L108":
        return 100 * np.cos(2 * np.pi * 120 * np.arange(300) / 2000) + rng.standard_normal(300), 2000, 120
    if fault == "L110":
        x = 100 * np.cos(2 * np.pi * 120 * time)
        x += np.where(rng.random(len(x)) < 0.15, rng.choice([-400.0, 400.0], len(x)), rng.standard_normal(len(x)))
        return x, 3200, 120
    return 0.001 * rng.standard_normal(4000), 2000, 0.0


@pytest.mark.parametrize("code", ["L101", "L102", "L104", "L105", "L106", "L107", "L108", "L110", "L111"])
def test_a_faulty_record_is_a_finding(code, tmp_path, monkeypatch):
    x, rate, _ = _faulty(code)
    head = HEAD.replace("full_scale = 500.0\n", "")
    for i in range(3):
        write(tmp_path / f"e{i}.wav", x + 1e-4 * i, rate=rate)
    motor = repeats(tmp_path, "m", 300, 122)
    chain = '[chain]\nuse = ["line", "bandpass"]\n' if code == "L106" else ""
    edges = '["e0.wav", "e1.wav", "e2.wav"]'
    if code in ("L101", "L102", "L105", "L106", "L111"):
        for i in range(3):
            write(tmp_path / f"n{i}.wav", x + 1e-4 * (i + 3), rate=rate)
        motor = edges.replace("e", "n")
    (tmp_path / "c.toml").write_text(
        f'name = "t"\n{head}{chain}[[unit]]\nname = "a"\nreference = {motor}\nedge = {edges}\n'
    )
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["measure", "c.toml", "-o", "out"])
    assert done.exit_code == 1, done.output
    findings = json.loads(Path("out/measure.json").read_text())["findings"]
    assert code in {one["code"] for one in findings}, findings
    levels = tomllib.loads(Path("out/measured.toml").read_text())["level"]
    assert (levels == []) == (RULES[code].severity == "error")


def test_an_uneven_time_axis_and_disagreeing_repeats(tmp_path):
    time = np.arange(4000) / RATE
    for i in range(7):
        x = (300.0 + 0.1 * i if i < 3 or i == 6 else 100.0 * 1.4**i) * np.cos(2 * np.pi * 120 * time)
        stamps = np.where(time > 1, time + 0.0032, time) if i == 0 else time
        rows = "\n".join(f"{t:.5f}\t{v:.5f}" for t, v in zip(stamps, x, strict=True))
        (tmp_path / f"{i}.txt").write_text(f"t (s)\tu (um)\n{rows}\n")
    head = '[sensor]\nquantity = "displacement"\nunit = "um"\n'
    text = '[[unit]]\nname = "a"\nreference = ["0.txt", "1.txt", "2.txt"]\nedge = ["3.txt", "4.txt", "5.txt"]\n'
    codes = {(one.code, one.where) for one in campaign(tmp_path, text, head).findings}
    assert ("L103", "0.txt") in codes
    assert ("L112", "a, edge") in codes
    text = text.replace('"0.txt", ', '"6.txt", ')
    codes = {one.code for one in campaign(tmp_path, text, head).findings}
    assert codes == {"L109"}


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ('[[unit]]\nname = "a"\nedge = ["x.csv"]\n', "unit.0.reference"),
        ('[[unit]]\nname = "a"\nreference = ["x.csv"]\n', "unit.0.edge"),
        ('[[unit]]\nname = "a"\nreference = ["y.csv"]\nedge = ["x.csv"]\n', "unit.0.reference.0"),
        ('[[unit]]\nname = "a"\nreference = ["w.csv"]\nedge = ["x.csv"]\nspecs = "e"\n', "unit.0.specs"),
        ('[[unit]]\nname = "a"\nreference = ["w.csv"]\nedge = ["x.csv"]\n', "recording.rate_hz"),
        ('[recording]\nrate_hz = 2000.0\n[[unit]]\nname = "a"\nreference = ["t.csv"]\nedge = ["x.csv"]\n',
         "recording.channel"),
        ('[recording]\ntime_column = 1\n[[unit]]\nname = "a"\nreference = ["n.csv"]\nedge = ["x.csv"]\n',
         "recording.time_unit"),
        ('[recording]\nrate_hz = 2000.0\n[[unit]]\nname = "a"\nreference = ["v.csv"]\nedge = ["x.csv"]\n',
         "sensor.unit"),
        ('[chain]\nband_hz = [200.0, 100.0]\n[[unit]]\nname = "a"\nreference = ["w.csv"]\nedge = ["x.csv"]\n',
         "chain.band_hz"),
    ],
)  # fmt: skip
def test_what_is_not_known_is_asked_for(text, field, tmp_path):
    (tmp_path / "w.csv").write_text("u\n" + "1.5\n0.5\n" * 50)
    (tmp_path / "x.csv").write_text("u\n" + "0.5\n1.5\n" * 50)
    (tmp_path / "t.csv").write_text("u,v\n" + "0.5,2.5\n1.5,1.5\n" * 50)
    (tmp_path / "n.csv").write_text("n,v\n" + "\n".join(f"{i}.5,{i % 7}.5" for i in range(99)) + "\n")
    (tmp_path / "v.csv").write_text("u (V)\n" + "0.5\n1.5\n" * 50)
    with pytest.raises(Refusal) as refused:
        campaign(tmp_path, text, '[sensor]\nquantity = "displacement"\nunit = "um"\n')
    assert refused.value.field == field


def test_the_shipped_campaign_has_the_levels_put_in():
    """What docs/how-to/measure.md shows: computed recordings, which say so."""
    path = Path(__file__).parents[2] / "templates" / "lab" / "campaign.toml"
    asked = read_campaign(path)
    assert "synthetic" in asked.note
    result = measure(asked, path.parent)
    assert result.findings == ()
    assert [one.distance_mm for one in result.levels] == [0, 0, 10, 10, 20, 20]
    for one, truth in zip(result.levels, (0.42, 0.42, 0.15, 0.15, 0.06, 0.06), strict=True):
        assert one.level.low < truth < one.level.high
    assert result.levels[0].level.value == pytest.approx(0.418, abs=5e-4)

"""`unitcad measure`: levels of synthetic campaigns with known truth, their files, findings and refusals."""

import json
import math
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.signal import lfilter
from scipy.stats import ttest_ind, ttest_rel
from signals import RATE, TIME, noise, repeats, wave, write

from benchmarks.accuracy.synthetic_records import Scenario, synthetic
from tests.in_process import unitcad
from tests.refusals import refuses
from unitcad.files import sha256
from unitcad.lab import measure_command, measuring
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import level, measure
from unitcad.lab.record import RULES

NAME = 'name = "t"\n'
UM = '[sensor]\nquantity = "displacement"\nunit = "um"\n'
HEAD = f"{UM}scale = 500.0\n"
BOTH = '[chain]\nuse = ["line", "bandpass"]\n'
UNIT = '[[unit]]\nname = "a"\nreference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'
PAIRED = '[recording]\nchannel = 1\nmotor_channel = 2\n[[unit]]\nname = "a"\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'


def campaign(folder, text, head=HEAD):
    (folder / "c.toml").write_text(NAME + head + text)
    return measure(read_campaign(folder / "c.toml"), folder)


@pytest.fixture
def folder(tmp_path):
    """A campaign with a motor, an edge and a point, each with mains, harmonics, drift and spin-up."""
    settings = {"snr": 60.0, "drift": 0.004, "mains": (0.01, 0.004, 0.004), "harmonics": (0.1, 0.05)}
    scenario = Scenario("lab", spin_up_s=0.05, **settings)
    for name, size, hertz in (("m", 300, 122), ("e", 120, 122.5), ("s", 30, 121.6)):
        for i in range(3):
            rng = np.random.default_rng([0, i, size])
            write(tmp_path / f"{name}{i}.wav", synthetic(scenario, rng, size * (1 + 0.02 * (i - 1)), hertz).x)
    point = '[[unit.point]]\ndistance_mm = 10.0\nrecords = ["s0.wav", "s1.wav", "s2.wav"]\n'
    text = f"{BOTH}{UNIT}{point}"
    (tmp_path / "c.toml").write_text(NAME + HEAD + text)
    return tmp_path


def test_a_motor_below_the_band_is_not_measured_by_its_harmonic(tmp_path):
    repeats(tmp_path, e=wave(90, 44.0) + wave(27, 88.0, 1), m=wave(300, 44.0) + wave(90, 88.0, 1))
    result = campaign(tmp_path, UNIT)
    assert result.levels == ()
    outside = [one.message for one in result.findings if one.code == "L117"]
    assert len(outside) == 6
    assert outside[0] == "the strongest line is at about 44 Hz, below chain.band_hz, 60 to 250 Hz"
    assert {one.code for one in result.findings} == {"L117", "L112"}


@pytest.mark.parametrize("slow", [0.0, 20.0])
def test_a_motor_above_the_band_is_named_and_not_the_sensors_slow_noise(slow, tmp_path):
    """An LRA of 260 Hz, in noise that falls with the frequency."""
    red = lfilter([0.2 * slow], [1, -0.98], np.random.default_rng(3).standard_normal(len(TIME)))
    repeats(tmp_path, e=wave(20, 260.0) + red, m=wave(60, 260.0) + red)
    result = campaign(tmp_path, UNIT)
    said = {one.message for one in result.findings if one.code == "L117"}
    assert said == {"the strongest line is at about 260 Hz, above chain.band_hz, 60 to 250 Hz"}
    assert {one.code for one in result.findings} == {"L117", "L112"}
    assert campaign(tmp_path, f"[chain]\nband_hz = [200.0, 300.0]\n{UNIT}").levels[0].level.value == pytest.approx(
        1 / 3, rel=0.01
    )


def test_a_unit_at_another_frequency_than_its_motor_is_told_both(tmp_path):
    repeats(tmp_path, e=wave(90, 170.0), m=wave(300, 130.0))
    result = campaign(tmp_path, UNIT)
    said = {one.message for one in result.findings if one.code == "L116"}
    assert said == {"the strongest line is at about 170 Hz; the motor's is from 104 to 156 Hz"}
    assert result.levels == ()


@pytest.mark.parametrize("size", [0.1, 0.7, 3.0])
@pytest.mark.parametrize("away", [-35.0, 35.0, 80.0])
def test_a_second_motor_is_named_and_is_no_noise(away, size, tmp_path):
    """The level stays right: the motor's own record says which line is its."""
    repeats(tmp_path, e=wave(100, 137.0) + wave(100 * size, 137.0 + away, 1.0), m=wave(300, 137.0))
    result = campaign(tmp_path, UNIT)
    assert {(one.code, one.severity) for one in result.findings} == {("L104", "warning")}
    (hertz,) = {float(one.message.split()[6]) for one in result.findings}
    assert hertz == pytest.approx(137.0 + away, abs=0.5)
    assert result.findings[0].message.endswith("of the one at 137.0 Hz; run one motor at a time")
    leak = size / (math.pi * abs(away) * 2)  # of the second line into the first, over 2 s
    assert result.levels[0].level.value == pytest.approx(1 / 3, rel=0.003 + leak)


def test_a_hum_of_other_mains_is_told_as_that(tmp_path):
    repeats(tmp_path, e=wave(100, 137.0) + wave(30, 180.0, 1.0), m=wave(300, 137.0))
    assert "or set chain.mains_hz = 60" in campaign(tmp_path, UNIT).findings[0].message
    assert campaign(tmp_path, f"[chain]\nmains_hz = 60\n{UNIT}").findings == ()


@pytest.mark.parametrize("settings", ["", "rate_hz = 1000.0\n"])
def test_a_time_that_begins_again_is_said_and_no_line_is_sought(settings, tmp_path):
    """Two records in one file. Their mean step is not the file's, and a line would be at another frequency."""
    for i in range(6):
        part = (300 if i < 3 else 100) * np.cos(2 * np.pi * 137 * TIME[:1000] * 2 + i)
        rows = [f"{t / 1000:.4f},{v:.5f}" for v in (part, part[:700]) for t, v in enumerate(v)]
        (tmp_path / f"{i}.csv").write_text("\n".join(["t (s),u (um)", *rows]) + "\n")
    unit = '[[unit]]\nname = "a"\nreference = ["0.csv", "1.csv", "2.csv"]\nedge = ["3.csv", "4.csv", "5.csv"]\n'
    result = campaign(tmp_path, f"[recording]\ntime_column = 1\nchannel = 2\n{settings}{unit}", UM)
    assert {one.code for one in result.findings} == {"L103", "L112"}
    assert result.findings[0].message == "the time goes back from 0.999 to 0 s behind sample 1000: two records?"
    assert result.records["a"][0].rate_hz == pytest.approx(1000.0)


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
        assert record.bandpass_gain == pytest.approx(1.0, abs=0.01)


def test_the_files_of_a_campaign(folder, monkeypatch):
    monkeypatch.chdir(folder)
    for out in ("two", "one"):
        done = unitcad("measure", "c.toml", "-o", out)
        assert (done.returncode, done.stdout.splitlines()[-1]) == (0, out)
    files = {file.name: file.read_bytes() for file in Path("one").iterdir()}
    assert files == {file.name: file.read_bytes() for file in Path("two").iterdir()}
    measured = tomllib.loads(files["measured.toml"].decode())
    assert {level["status"] for level in measured["level"]} == {"measured"}
    assert [one["sha256"] for one in measured["record"]] == [sha256(Path(one["file"])) for one in measured["record"]]
    assert set(files) == {"measured.toml", "measure.json", "measure.html"}
    assert "assumed: order 4, Q 30, filters forwards and backwards, RMS, 0.25 s" in done.stdout
    page = files["measure.html"].decode().replace("http://www.w3.org/2000/svg", "")
    assert not [part for part in ("http://", "<script") if part in page]
    again = json.loads(unitcad("measure", "c.toml", "--json").stdout)
    assert again["levels"] == measured["level"]


def test_a_motor_channel_gives_the_ratio(tmp_path):
    """Both channels wander together: their ratio is far better known than either amplitude's mean."""
    for i in range(3):
        motor = synthetic(Scenario("m", snr=100.0, wander=0.04, drift=0.01), np.random.default_rng(i), 250.0, 118.0).x
        write(tmp_path / f"e{i}.wav", 0.35 * (1 + 0.01 * (i - 1)) * np.roll(motor, 1) + noise(seed=50 + i), motor)
    result = campaign(tmp_path, PAIRED)
    assert result.levels[0].level.value == pytest.approx(0.35, rel=2e-3)
    assert result.records["a"][1].by_chain["line"] == pytest.approx(0.35, rel=1e-3)


def test_a_levels_interval_is_welchs():
    """scipy's Welch test of the same logarithms."""
    edge, motor = [41.0, 44.0, 40.5, 43.1], [101.0, 98.0, 105.0]
    found = level(edge, motor)
    welch = ttest_ind(np.log(edge), np.log(motor), equal_var=False).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((math.exp(welch.low), math.exp(welch.high)), rel=1e-9)
    assert found.repeats == (4, 3)
    pairs = level([a / b for a, b in zip(edge, motor, strict=False)])
    paired = ttest_rel(np.log(edge[:3]), np.log(motor)).confidence_interval(0.95)
    assert (pairs.low, pairs.high) == pytest.approx((math.exp(paired.low), math.exp(paired.high)), rel=1e-9)


# Findings.


@pytest.mark.parametrize(
    ("code", "x", "rate"),
    [
        ("L102", 100 * np.cos(2 * np.pi * 110 * np.arange(800) / 400), 400),
        ("L106", wave(100, 101.0) + noise(), RATE),
        ("L111", noise(0.001), RATE),
    ],
)
def test_a_faulty_record_is_a_finding(code, x, rate, tmp_path):
    for i in range(6):
        write(tmp_path / f"{'me'[i % 2]}{i // 2}.wav", x + 1e-4 * i, rate=rate)
    (tmp_path / "c.toml").write_text(NAME + HEAD + BOTH + UNIT)
    done = unitcad("measure", "c.toml", "--json", cwd=tmp_path)
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert code in {one["code"] for one in found["findings"]}, found
    assert (found["levels"] == []) == (RULES[code].severity == "error")


def test_an_uneven_time_axis_and_disagreeing_repeats(tmp_path):
    time = TIME[:1000]
    for i in range(7):
        x = (300.0 + 0.1 * i if i < 3 or i == 6 else 100.0 * 1.4**i) * np.cos(2 * np.pi * 120 * time)
        stamps = np.where(time > 0.3, time + 0.0032, time) if i == 0 else time
        rows = "\n".join(f"{t:.5f}\t{v:.5f}" for t, v in zip(stamps, x, strict=True))
        (tmp_path / f"{i}.txt").write_text(f"t (s)\tu (um)\n{rows}\n")
    text = '[[unit]]\nname = "a"\nreference = ["0.txt", "1.txt", "2.txt"]\nedge = ["3.txt", "4.txt", "5.txt"]\n'
    assert {("L103", "0.txt"), ("L112", "a, edge")} <= {
        (f.code, f.where) for f in campaign(tmp_path, text, UM).findings
    }
    assert {one.code for one in campaign(tmp_path, text.replace('"0.txt"', '"6.txt"'), UM).findings} == {"L109"}


MOTOR, RNG = wave(300), np.random.default_rng(9)


@pytest.mark.parametrize(
    ("code", "motor"),
    [
        ("L101", np.clip(MOTOR, -150, 150)),
        ("L110", MOTOR + np.where(RNG.random(4000) < 0.2, RNG.choice([-900.0, 900.0], 4000), 0.0)),
        ("L111", noise()),
        ("L111", 0 * TIME),
    ],
)
def test_a_bad_motor_channel_gives_no_level(tmp_path, code, motor):
    for i in range(3):
        write(tmp_path / f"e{i}.wav", wave(60 + i) + noise(seed=i), motor)
    result = campaign(tmp_path, PAIRED)
    assert result.levels == ()
    found = {(one.code, one.severity) for one in result.findings if one.where == "e0.wav, motor"}
    assert (code, "error") in found, result.findings


def test_two_motors_at_once_give_no_level(tmp_path):
    repeats(tmp_path, e=wave(60, 118.0) + wave(90, 126.0), m=wave(300, 118.0) + wave(150, 126.0))
    result = campaign(tmp_path, BOTH + UNIT)
    assert result.levels == ()
    said = {one.where: one.message for one in result.findings if one.code == "L104"}
    assert said["m0.wav"] == "a second line is at about 126.1 Hz, 0.5 of the one at 118.0 Hz; run one motor at a time"
    assert "about 117.9 Hz" in said["e0.wav"]


def test_a_record_that_is_not_used_is_shown_without_uncertainty(tmp_path):
    repeats(tmp_path, m=wave(300), e=wave(90))
    write(tmp_path / "e1.wav", np.clip(wave(90), -30, 30))
    write(tmp_path / "e2.wav", np.where(TIME > 0.6, wave(90), 0.0) + noise())
    result = campaign(tmp_path, UNIT)
    data = {one["file"]: one for one in measure_command.as_data(result)["records"]}
    assert (data["e1.wav"]["usable"], data["e1.wav"]["u_um"]) == (False, None)
    page = measure_command.page(result)
    assert "<td>e1.wav</td><td>no</td><td></td>" in page
    used = f"{result.records['a'][5].steady_s:.3g}"
    assert 1.0 < float(used) < 1.4
    assert f"<td>{used} of 2</td>" in page


def test_a_silent_record_has_a_page(tmp_path):
    """A sensor that was off: zeros, which have no spectrum."""
    repeats(tmp_path, m=wave(300), e=wave(90))
    write(tmp_path / "e1.wav", 0 * TIME)
    result = campaign(tmp_path, BOTH + UNIT)
    assert ("L111", "e1.wav") in {(one.code, one.where) for one in result.findings}
    assert "e1.wav: spectrum" in measure_command.page(result)


# Refusals.


@pytest.mark.parametrize(
    ("head", "keys", "field"),
    [
        ("", 'edge = ["x.csv"]', "unit.0.reference"),
        ("", 'reference = ["x.csv"]', "unit.0.edge"),
        ("", 'reference = ["w.csv"]\nedge = ["x.csv"]\nspecs = "e"', "unit.0.specs"),
        ("", 'reference = ["w.csv"]\nedge = ["x.csv"]', "recording.rate_hz"),
        ("[recording]\nrate_hz = 2000.0", 'reference = ["t.csv"]\nedge = ["x.csv"]', "recording.channel"),
        ("[recording]\ntime_column = 1", 'reference = ["t.csv"]\nedge = ["x.csv"]', "recording.time_unit"),
        ("[recording]\nrate_hz = 2000.0", 'reference = ["v.csv"]\nedge = ["x.csv"]', "sensor.unit"),
        ('[chain]\nuse = ["line", "rms"]', 'reference = ["w.csv"]\nedge = ["x.csv"]', "chain.use.1"),
        ("[chain]\nq = 30.0", 'reference = ["w.csv"]\nedge = ["x.csv"]', "chain.q"),
        ("[chain]\nband_hz = [200.0, 100.0]", 'reference = ["w.csv"]\nedge = ["x.csv"]', "chain.band_hz"),
    ],
)
def test_what_is_not_known_is_asked_for(head, keys, field, tmp_path):
    for name, text in {"w": "u\n1.5", "x": "u\n0.5", "t": "u,v\n0.5,2.5", "v": "u (V)\n0.5"}.items():
        (tmp_path / f"{name}.csv").write_text(text + ("\n2.5,3.5" if name == "t" else "\n2.5") * 50)
    with refuses(field):
        campaign(tmp_path, f'{head}\n[[unit]]\nname = "a"\n{keys}\n', UM)


@pytest.mark.parametrize(
    ("old", "new", "field", "nearest"),
    [
        ('"e1.wav"', '"./e0.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"copy.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"gone.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"x.svd"', "unit.0.edge.1", None),
        ('"e1.wav"', '"x.odd"', "unit.0.edge.1", None),
        ("[[unit]]", '[chain]\nuse = ["line", "line"]\n[[unit]]', "chain.use", ["line"]),
        ("[[unit]]", '[motor_sensor]\nquantity = "velocity"\nunit = "um"\n[[unit]]', "motor_sensor.unit", None),
    ],
)
def test_what_a_campaign_names_is_checked_first(tmp_path, monkeypatch, old, new, field, nearest):
    repeats(tmp_path, m=wave(300), e=wave(90))
    shutil.copy(tmp_path / "e0.wav", tmp_path / "copy.wav")
    for name in ("x.svd", "x.odd"):
        (tmp_path / name).write_bytes(b"x")
    monkeypatch.setattr(measuring, "measure_record", lambda *_: pytest.fail("a record was measured"))
    with refuses(field) as refused:
        campaign(tmp_path, UNIT.replace(old, new))
    if nearest is not None:
        assert refused.value.nearest == nearest


@pytest.mark.parametrize("ending", ["wav", "csv"])
def test_a_rate_that_the_file_contradicts_is_refused(tmp_path, ending):
    repeats(tmp_path, m=wave(300), e=wave(90))
    for file in tmp_path.glob("*.wav"):
        rows = "\n".join(f"{i / 2000:.4f},{value:.6f}" for i, value in enumerate(wavfile.read(file)[1][:1000]))
        file.with_suffix(".csv").write_text(f"time (s),u\n{rows}\n")
    text = f"[recording]\nchannel = {1 if ending == 'wav' else 2}\nrate_hz = 2001.0\n{UNIT.replace('wav', ending)}"
    assert campaign(tmp_path, text).levels
    with refuses("recording.rate_hz") as refused:
        campaign(tmp_path, text.replace("2001", "2010"))
    assert refused.value.nearest == pytest.approx(2000.0, rel=1e-6)


# Units between columns, files and records.

LEVEL = 0.4


def measured(folder, sensor, motor, edge, paired=True):
    """Measure three records; `motor` and `edge` have a channel's unit in the file, and the size of a unit in it."""
    time = TIME[:1000]
    for i in range(3):
        columns = {}
        for name, (unit, size), part in (("m", motor, 1.0), ("e", edge, LEVEL)):
            columns[f"{name} ({unit})" if unit else name] = size * part * np.cos(2 * np.pi * 125.3 * time + i)
        files = {"r": columns} if paired else {key[0]: {key: x} for key, x in columns.items()}
        for stem, own in files.items():
            rows = (",".join(f"{value:.9g}" for value in row) for row in zip(time, *own.values(), strict=True))
            (folder / f"{stem}{i}.csv").write_text("\n".join([",".join(["Time (s)", *own]), *rows]) + "\n")
    names = {key: [f"{key}{i}.csv" for i in range(3)] for key in "rem"}
    keys = f"edge = {names['r']}" if paired else f"reference = {names['m']}\nedge = {names['e']}"
    channels = '[recording]\nchannel = "e"\nmotor_channel = "m"\n' if paired else ""
    return campaign(folder, f'{channels}[[unit]]\nname = "u"\n{keys}\n', sensor)


def sensor(quantity, unit, more="", table="sensor"):
    return f'[{table}]\nquantity = "{quantity}"\nunit = "{unit}"\n{more}'


VELOCITY, VOLTS = sensor("velocity", "mm/s"), sensor("velocity", "mm/s", 'scale = 50.0\nper = "V"\n')
OMEGA = 2 * np.pi * 125.3
TWO_SENSORS = sensor("velocity", "mm/s", "scale = 50.0\n") + sensor("displacement", "um", table="motor_sensor")
MOTION = [
    (TWO_SENSORS, ("nm", 1e6 / OMEGA), ("V", 1 / 50)),
    (VELOCITY, ("mm/s", 1.0), ("um/s", 1000.0)),
    (sensor("acceleration", "m/s2"), ("g", 1 / 9.80665), ("m/s^2", 1.0)),
    (sensor("displacement", "um"), ("mm", 0.001), ("µm", 1.0)),
    (VOLTS, ("V", 1.0), ("mV", 1000.0)),
    (VOLTS, ("uV", 1e6), ("Volt", 1.0)),
    (VOLTS, ("", 1.0), ("mV", 1000.0)),
    (sensor("velocity", "mm/s", 'scale = 3.0\nper = "mm/s"\n'), ("um/s", 1000.0), ("mm/s", 1.0)),
]


@pytest.mark.parametrize(("paired", "table", "motor", "edge"), [(i % 2, *one) for i, one in enumerate(MOTION)])
def test_units_that_a_file_states_are_converted(tmp_path, table, motor, edge, paired):
    result = measured(tmp_path, table, motor, edge, paired)
    assert result.levels[0].level.value == pytest.approx(LEVEL, rel=1e-4)


@pytest.mark.parametrize(
    ("table", "motor", "um"),
    [
        (sensor("displacement", "um"), ("um", 300.0), 300.0),
        (sensor("acceleration", "g"), ("g", 1.0), 9.80665e6 / OMEGA**2),
        (sensor("velocity", "mm/s", 'scale = 50.0\nper = "mV"\n'), ("mV", 1.0), 50e3 / OMEGA),
    ],
)
def test_a_motion_is_a_displacement_over_j_omega(tmp_path, table, motor, um):
    result = measured(tmp_path, table, motor, motor, paired=False)
    assert result.records["u"][0].amplitude_um == pytest.approx(um, rel=1e-3)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(
    ("table", "motor", "edge", "field", "words"),
    [
        (sensor("velocity", "mm/s", "scale = 50.0\n"), "V", "mV", "sensor.per", ("mV", "V")),
        (sensor("velocity", "mm/s", "scale = 2.0\n"), "mm/s", "um/s", "sensor.scale", ("needs no scale",)),
        (VELOCITY, "um", "mm/s", "sensor.unit", ("um",)),
        (VELOCITY, "V", "V", "sensor.unit", ("V", "sensor.scale")),
        (VOLTS, "mm/s", "V", "sensor.per", ("mm/s", "'V'")),
    ],
)
def test_units_that_nobody_can_convert_are_refused(tmp_path, table, motor, edge, field, words, paired):
    with refuses(field, *words):
        measured(tmp_path, table, (motor, 1.0), (edge, 1.0), paired)

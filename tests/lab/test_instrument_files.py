"""One recording in the layouts of instruments: names, units, time and numbers are the same in each."""

import numpy as np
import pytest
from recordings import COUNT, RATE, columns

from unitcad.lab.campaign import RecordingTable, SensorTable
from unitcad.lab.material import column_of
from unitcad.lab.material import columns as columns_of_test
from unitcad.lab.readers import AS_FOUND, Layout, open_recording
from unitcad.lab.record import open_signal

TIME, MOTOR, EDGE = np.arange(COUNT) / RATE, columns()[:, 0] / 100, columns()[:, 1] / 100


def rows(*table, delimiter=",", decimal=".", form="{:.6f}"):
    lines = (delimiter.join(form.format(value) for value in row) for row in zip(*table, strict=True))
    return [line.replace(".", decimal) if decimal != "." else line for line in lines]


def lvm():
    top = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne"]
    keys = [
        "Channels\t2\t\t",
        f"Samples\t{COUNT}\t{COUNT}\t",
        "Y_Unit_Label\tVolts\tVolts\t",
        "X_Dimension\tTime\tTime\t",
    ]
    keys += ["X0\t0.0000000000000000E+0\t0.0\t", "Delta_X\t0.000500\t0.000500\t", "***End_of_Header***\t\t\t"]
    return [
        *top,
        "***End_of_Header***\t",
        "\t",
        *keys,
        "X_Value\tmotor\tedge\tComment",
        *rows(TIME, MOTOR, EDGE, delimiter="\t"),
    ]


def lvm_without_x():
    lines = [line.replace("X_Columns\tOne", "X_Columns\tNo") for line in lvm()]
    return [line if not line[0].isdigit() else "\t" + line.partition("\t")[2] for line in lines]


def tektronix():
    said = [["Record Length", f"{COUNT}"], ["Sample Interval", "5e-4"], ["Trigger Point", "0"], ["", ""], ["", ""]]
    said += [["Source", "CH1"], ["Vertical Units", "V"], ["Vertical Scale", "1.0"], ["Horizontal Units", "s"]]
    said += [["", ""]] * (COUNT - len(said))
    return [
        f"{a},{b},,{t},{v}," for (a, b), (t, v) in zip(said, (r.split(",") for r in rows(TIME, MOTOR)), strict=True)
    ]


def clock(date=""):
    stamps = [f"{date}09:59:{59 + t:09.6f}" if t < 1 else "" for t in TIME]
    return ["time,motor (V)", *(f"{stamp},{v:.6f}" for stamp, v in zip(stamps, MOTOR, strict=True))]


LAYOUTS = {
    "empty first line": ["", "Time,motor", "(ms),(V)", "", *rows(1e3 * TIME, MOTOR)],
    "labview": lvm(),
    "labview without x": lvm_without_x(),
    "tektronix": tektronix(),
    "second": ["Source,motor", "Second,Volt", *rows(TIME, MOTOR)],
    "second alone": ["Second,Volt", *rows(TIME, MOTOR)],
    "words": ["Time (s),State,motor (V)", *(f"{t:.6f},OK,{v:.6f}" for t, v in zip(TIME, MOTOR, strict=True))],
    "comments": [
        "Time (s);motor (V);Remark",
        *(f"{t:.6f};{v:.6f};{'start' if t < 0.01 else ''}" for t, v in zip(TIME, MOTOR, strict=True)),
    ],
    "clock": clock(),
    "date and clock": clock("2024-05-01 "),
    "index": [
        "X,motor,Start,Increment,", "Sequence,Volt,0.0,5.0e-04,", *(f"{i},{v:.6f}," for i, v in enumerate(MOTOR))
    ],
    "several summaries": [
        "Results,,", ",Maximum (V),Mean (V)", "1,2.5,0.3", "", "Time (s),motor (V)", *rows(TIME, MOTOR)
    ],
}  # fmt: skip


def read(path, lines, encoding="utf-8", layout=AS_FOUND):
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode(encoding))
    return open_recording(path, layout)


@pytest.mark.parametrize("name", LAYOUTS)
def test_an_instruments_layout_is_read(name, tmp_path):
    layout = Layout(skip_lines=3 if name == "several summaries" else 0)
    recording = read(tmp_path / "a.lvm", LAYOUTS[name], layout=layout)
    at = next(i for i, one in enumerate(recording.channels) if i != recording.time)
    assert recording.channels[at].unit in ("V", "Volt", "Volts")
    assert recording.channels[at].name in ("motor", "CH1", "Volt")
    np.testing.assert_allclose(recording.columns([at])[:, 0], MOTOR, atol=1e-6)
    sensor = SensorTable(quantity="velocity", unit="mm/s", scale=1.5)
    signal = open_signal(
        tmp_path / "a.lvm", RecordingTable(channel=at + 1, skip_lines=layout.skip_lines), (sensor,), "a"
    )
    assert (signal.rate, signal.off_grid < 0.01) == (pytest.approx(RATE), True)


@pytest.mark.parametrize("sign", ["", "∞", "-∞", "-FFFFFFF", "nan", "-------"])
@pytest.mark.parametrize("last", [True, False])
def test_a_value_that_is_missing_or_over_range_is_no_number(sign, last, tmp_path):
    lines = ["Time (ms),motor (V),edge (V)", *rows(1e3 * TIME, MOTOR, EDGE)]
    for i in (1, 7, 8, COUNT):
        time, motor, edge = lines[i].split(",")
        lines[i] = ",".join([time, motor, sign] if last else [time, sign, edge])
    recording = read(tmp_path / "a.csv", lines)
    gaps = np.zeros((COUNT, 2), bool)
    gaps[[0, 6, 7, COUNT - 1], int(last)] = True
    expected = np.where(gaps, np.nan, np.column_stack([MOTOR, EDGE]))
    np.testing.assert_allclose(recording.columns([1, 2]), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("encoding", "names"),
    [
        ("gbk", ["时间 (s)", "位移 (mm)", "力 (N)"]),
        ("utf-16", ["Zeit (s)", "Weg (mm)", "Kraft (N)"]),
        ("latin-1", ["Prüfzeit (s)", "Standardweg (mm)", "Standardkraft (N)"]),
        ("cp1252", ["time (s)", "Stroke (µm)", "Load (N)"]),
        ("utf-8", ["Time (s)", "Displacement (mm)", "Force (N)"]),
    ],
)
def test_columns_of_other_languages_are_known(encoding, names, tmp_path):
    recording = read(tmp_path / "a.csv", [",".join(names), *rows(TIME, MOTOR, EDGE)], encoding)
    wanted = {q: column_of(recording, q, {}) for q in ("time", "travel", "force")}
    data, lost = columns_of_test(recording, {q: one for q, one in wanted.items() if one})
    assert lost == 0
    np.testing.assert_allclose(data["travel"], MOTOR * (1e-6 if "µ" in names[1] else 1e-3), atol=1e-9)
    np.testing.assert_allclose(data["force"], EDGE, atol=1e-6)


def test_lost_samples_leave_their_places_empty(tmp_path):
    kept = np.delete(np.arange(COUNT), [5, 6, 100, 250])
    read(tmp_path / "a.csv", ["Time (s),motor (V)", *rows(TIME[kept], MOTOR[kept])])
    sensor = SensorTable(quantity="velocity", unit="mm/s", scale=2.0)
    signal = open_signal(tmp_path / "a.csv", RecordingTable(), (sensor,), "a.csv")
    assert (signal.count, signal.missing, signal.off_grid) == (COUNT, (4,), 0.0)
    assert signal.rate == pytest.approx(RATE, rel=1e-9)
    expected = np.where(np.isin(np.arange(COUNT), kept), 2 * MOTOR, np.nan)
    np.testing.assert_allclose(signal.samples[:, 0], expected, atol=1e-5)


@pytest.mark.parametrize("unit", ["um", b"um", ["um"], np.array([b"um"]), np.array("um", dtype="S2")])
def test_hdf5_units_are_text_or_an_array_of_it(unit, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = MOTOR
        file["x"].attrs["units"] = unit
    assert [one.unit for one in open_recording(tmp_path / "a.h5").channels] == ["um"]

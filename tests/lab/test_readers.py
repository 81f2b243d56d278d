"""Readers of recordings: every format and layout gives the same columns, nothing is guessed, no damage passes."""

import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from recordings import CENTRES, COUNT, FORMATS, RATE, hangs, mutated, write_tdms
from recordings import columns as recorded

from unitcad.errors import Refusal, UnitcadError
from unitcad.lab import material, readers
from unitcad.lab.campaign import RecordingTable, SensorTable
from unitcad.lab.readers import AS_FOUND, Layout, Unreadable, open_recording, text
from unitcad.lab.record import open_signal
from unitcad.workers import Pool

DATA = Path(__file__).parent / "data"


def numbers(recording, *indices):
    return recording.columns(indices or tuple(range(len(recording.channels))))


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_columns(name, tmp_path):
    FORMATS[name](tmp_path / name)
    recording = open_recording(tmp_path / name)
    ends = [channel.name.rpartition("/")[2] for channel in recording.channels]
    shift = 1 if name.endswith((".csv", ".txt")) else 0
    order = [ends.index(centre) for centre in CENTRES] if not name.endswith(".wav") else [0, 1, 2]
    found = numbers(recording, *order)
    factor = 2**15 / 50 if name == "int.wav" else 1.0
    assert_allclose(found * factor, recorded(), atol=0.05 if name == "int.wav" else 1e-6)
    assert len(ends) == shift + 3
    if name.endswith((".uff", ".unv", ".tdms", ".wav")):
        assert recording.channels[0].step_s == pytest.approx(1 / RATE, rel=1e-12)
    if shift:
        assert recording.time == 0
        assert recording.channels[0].step_s is None
    if not name.endswith((".mat", ".wav")):
        assert {channel.unit for channel in recording.channels[shift:]} == {"um"}


@pytest.mark.parametrize(
    ("name", "count", "channel", "unit", "step_s", "first", "last"),
    [
        ("pyuff/Sample_UFF58b_bin.uff", 79292, "Pressure", "Pa", 1.52588e-5, -0.0147552602, -0.00431469),
        ("pyuff/binary8byte.uff", 250, "acc (g)", "g", 0.01, 0.0, np.sin(2 * np.pi * 5 * 0.01 * 249)),
        ("pyuff/time-history-not-all-columns-filled.uff", 13, "1x", "m/s²", 5e-5, -3.81956, -5.84096),
        ("nptdms/raw1.tdms", 2000, "Layer Data/First  Channel", "Volts", 2e-5, -0.184026612, 0.00091556),
        ("nptdms/raw_timestamps.tdms", 128, "Untitled/Untitled", "", 1e-3, 0.0, np.sin(2 * np.pi * 127 / 128)),
        ("rigolwfm/DS1074Z-A.csv", 1200, "CH1", "Volt", 2e-5, 0.0, None),
        ("rigolwfm/DS1052E.csv", 8192, "Voltage", "V", None, 1.72, -0.04),
        ("soft-robotics-materials-database/Ecoflex 00-10.csv", 751, "True Strain", "", None, 0.04361, None),
    ],
)  # fmt: skip
def test_files_by_others_are_read(name, count, channel, unit, step_s, first, last):
    recording = open_recording(DATA / name)
    at = [one.name for one in recording.channels].index(channel)
    found = numbers(recording, at)
    assert (len(found), recording.channels[at].unit) == (count, unit)
    assert recording.channels[at].step_s == (None if step_s is None else pytest.approx(step_s, rel=1e-12))
    assert found[0, 0] == pytest.approx(first, rel=1e-5)
    if last is not None:
        assert found[-1, 0] == pytest.approx(last, rel=2e-4)


def test_an_oscilloscopes_index_is_not_time():
    """Rigol's column X counts samples; its step is in the header. The other family writes time with its unit."""
    index = open_recording(DATA / "rigolwfm" / "DS1074Z-A.csv")
    assert index.time is None
    assert [one.name for one in index.channels] == ["CH1", "CH2", "CH3"]
    assert open_recording(DATA / "rigolwfm" / "DS1052E.csv").time == 0


def test_a_name_of_two_channels_is_none():
    with pytest.raises(Refusal, match="several channels of this name"):
        open_recording(DATA / "rigolwfm" / "DS1052E.csv").index("Voltage", "channel")


@pytest.mark.parametrize(("ending", "way"), [(".svd", "export UFF"), (".pvd", "export UFF"), (".xlsx", "as CSV")])
def test_a_format_of_another_program_is_refused_with_a_way(ending, way, tmp_path):
    (tmp_path / f"scan{ending}").write_bytes(b"x")
    with pytest.raises(Unreadable, match=way):
        open_recording(tmp_path / f"scan{ending}")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("1,5\n2,5\n3,5\n", "delimiter"),  # two columns of whole numbers, or one with a decimal comma
        ("a,b\n.1,2\n.3,4\n5\n.6,7\n", ""),
        ("a,b\n.1,2\n3,4\n5,6,7\n6,7\n", ""),
        ("a,b\n.1,2\n3,x\n.6,7\n8,9\n", "skip_lines"),
        ("a,b\n0.1,2\n3,4\nmean,3\n", ""),
        ("words alone\nand more\n", ""),
        ("", ""),
    ],
)
def test_what_would_be_a_guess_is_refused(text, field, tmp_path):
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(Unreadable) as raised:
        numbers(open_recording(file))
    assert raised.value.field == (field or str(file))


def test_a_declared_layout_settles_what_is_ambiguous(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("1,5\n2,5\n3,5\n")
    assert numbers(open_recording(file, Layout(decimal=","))).tolist() == [[1.5], [2.5], [3.5]]
    assert numbers(open_recording(file, Layout(decimal="."))).tolist() == [[1, 5], [2, 5], [3, 5]]
    file.write_text("4\n1.5\n2.5\n")
    assert numbers(open_recording(file, Layout(skip_lines=1))).tolist() == [[1.5], [2.5]]


def test_words_may_follow_the_numbers_and_a_gap_is_not_a_number(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("# t [ms]\tu [um]\r\n0\t1e-3\r\n0.5\tnan\r\n1\t2\r\n\r\nEnd of data\r\n")
    recording = open_recording(file)
    assert [(one.name, one.unit) for one in recording.channels] == [("t", "ms"), ("u", "um")]
    assert recording.time == 0
    assert_array_equal(numbers(recording), [[0, 1e-3], [0.5, np.nan], [1, 2]])


def test_a_long_text_is_read_whole(tmp_path):
    file = tmp_path / "long.csv"
    count = 12_000
    lines = "\n".join(f"{i},{i * 2}.{'0' * 80}" for i in range(count))
    assert len(lines) > text.HEAD
    file.write_text(f"n,twice\n{lines}\n")
    assert_array_equal(open_recording(file).columns((1,))[:, 0], 2.0 * np.arange(count))
    with open(file, "a") as more:
        more.write("7\n8,9.0\n")
    with pytest.raises(Unreadable, match=f"line {count + 2} "):
        open_recording(file).columns((0,))


def test_hdf5_tells_its_time_and_a_channel_goes_without_its_group(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, unit in (("G/t", "s"), ("G/x", "um"), ("H/y", "um")):
            file[name] = np.arange(9.0)
            file[name].attrs["units"] = unit
    recording = open_recording(tmp_path / "a.h5")
    assert (recording.time, recording.index("x", "channel")) == (0, 1)


def test_a_library_that_never_returns_is_a_refusal(tmp_path, monkeypatch):
    """HDF5 loops for ever over the attributes of some damaged files: its process is ended."""
    FORMATS["plain.h5"](tmp_path / "plain.h5")
    monkeypatch.setattr(readers, "LONGEST_S", 0.5)
    monkeypatch.setattr(readers, "_read_in", hangs)
    with pytest.raises(Unreadable, match=r"was not read in 0\.5 s"):
        open_recording(tmp_path / "plain.h5")


def test_numbers_of_no_standard_layout_are_refused(tmp_path):
    """One damaged byte of a type makes 64 bits something else, which HDF5 converts to zeros without a word."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["edge"] = np.arange(300.0).astype(">f4")
    block = open_recording(tmp_path / "a.h5").columns((0,))
    assert_array_equal(block[:, 0], np.arange(300.0))
    with h5py.File(tmp_path / "b.h5", "w") as file:
        odd = h5py.h5t.IEEE_F64LE.copy()
        odd.set_fields(63, 52, 11, 0, 51)
        space = h5py.h5s.create_simple((300,))
        data = h5py.h5d.create(file.id, b"edge", odd, space)
        data.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(300.0))
    with pytest.raises(Unreadable, match="no standard layout"):
        open_recording(tmp_path / "b.h5")


def test_a_reader_is_one_file(tmp_path, monkeypatch):
    (tmp_path / "array_file.py").write_text(
        "import numpy as np\n"
        "from unitcad.lab.readers import Channel\n"
        'ENDINGS = (".npy",)\n'
        "def read(path, layout):\n"
        "    data = np.load(path)\n"
        '    return [Channel(column, str(i), "um", 0.001) for i, column in enumerate(data.T)]\n'
    )
    np.save(tmp_path / "a.npy", recorded())
    with pytest.raises(Unreadable, match="no reader"):
        open_recording(tmp_path / "a.npy")
    monkeypatch.setattr(readers, "__path__", [*readers.__path__, str(tmp_path)])
    monkeypatch.setattr(readers, "_by_ending", readers._by_ending.__wrapped__)
    monkeypatch.delitem(sys.modules, "unitcad.lab.readers.array_file", raising=False)
    block = open_recording(tmp_path / "a.npy").columns((2, 0))
    assert_array_equal(block, recorded()[:, [2, 0]])
    (tmp_path / "b.npy").write_bytes(b"\x93NUMPY")
    with pytest.raises(Unreadable, match="is damaged"):
        open_recording(tmp_path / "b.npy")


TIME, MOTOR, EDGE = np.arange(COUNT) / RATE, recorded()[:, 0] / 100, recorded()[:, 1] / 100


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
    "clock": clock(),
    "date and clock": clock("2024-05-01 "),
    "second alone": ["Second,Volt", *rows(TIME, MOTOR)],
    "words": ["Time (s),State,motor (V)", *(f"{t:.6f},OK,{v:.6f}" for t, v in zip(TIME, MOTOR, strict=True))],
    "comments": [
        "Time (s);motor (V);Remark",
        *(f"{t:.6f};{v:.6f};{'start' if t < 0.01 else ''}" for t, v in zip(TIME, MOTOR, strict=True)),
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
    assert (signal.rate, signal.uneven) == (pytest.approx(RATE), "")


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
    data, lost = material.read_columns(recording, {}, ("time",), ("travel",), ("force",))
    assert lost == 0
    np.testing.assert_allclose(data["travel"], MOTOR * (1e-6 if "µ" in names[1] else 1e-3), atol=1e-9)
    np.testing.assert_allclose(data["force"], EDGE, atol=1e-6)


def test_a_universal_file_that_is_cut_off_is_refused_with_its_whole_first_channels(tmp_path):
    """pyuff reads the data sets before the cut and says nothing."""
    name = next(name for name in FORMATS if name.endswith(".uff"))
    FORMATS[name](tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(0.9 * len(content))])
    with pytest.raises(UnitcadError, match="is cut off"):
        open_recording(tmp_path / name)


LONGEST = 90.0
"""Seconds that a damaged file of some kilobytes may take."""


def shifted(path):
    """Read a file; say which column holds values that are another column's, if one does."""
    recording = open_recording(path)
    names = {channel.name.rpartition("/")[2]: i for i, channel in enumerate(recording.channels)}
    if path.suffix == ".wav":
        names = {name: i for i, name in enumerate(CENTRES) if i < len(recording.channels)}
    factor = 2**15 / 50 if path.name == "int.wav" else 1.0
    for name, centre in CENTRES.items():
        if name not in names:
            continue
        found = recording.columns((names[name],))[:, 0] * factor
        away = np.abs(found - centre) > 51
        if away.sum() > 12:
            return f"{name}: {away.sum()} of {len(found)} values are not its own, such as {found[away][:3]}"
    return None


@pytest.mark.parametrize("many", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", FORMATS)
def test_a_damaged_recording_is_refused_or_right(name, many, tmp_path):
    FORMATS[name](tmp_path / name)
    content = (tmp_path / name).read_bytes()
    own_process = name in ("v73.mat", "plain.h5")
    refused, wrong = 0, []
    for i in range(2000 if many else 6 if own_process else 60):
        (tmp_path / name).write_bytes(mutated(content, np.random.default_rng([1, i])))
        began = time.perf_counter()
        try:
            fault = shifted(tmp_path / name)
        except UnitcadError:
            refused, fault = refused + 1, None
        if fault:
            wrong.append(f"{i}: {fault}")
        if time.perf_counter() - began > LONGEST:
            wrong.append(f"{i}: took {time.perf_counter() - began:.0f} s")
    assert wrong == []
    assert refused > 1


@pytest.mark.parametrize(
    ("layout", "limit"),
    [
        ({"shape": (10**10,), "chunks": (1000,)}, "states 80000000000 bytes and stores 8000 at most"),
        ({"shape": (10**7,), "chunks": (1000,), "compression": "gzip"}, "states 80000000 bytes and stores"),
        ({"shape": (10**10,)}, "states 80000000000 bytes and stores 0 at most"),
    ],
)
def test_hdf5_that_states_more_than_it_stores(layout, limit, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        made = file.create_dataset("x", dtype="f8", fillvalue=1.0, **layout)
        if "chunks" in layout:
            made[:1000] = np.arange(1000.0)
    with pytest.raises(Unreadable, match=limit):
        open_recording(tmp_path / "a.h5")


def test_a_library_that_takes_all_memory_is_ended(tmp_path, monkeypatch):
    write_tdms(tmp_path / "a.tdms")
    with Pool(memory=1 << 30) as pool:  # the worker imports this file, with SciPy
        monkeypatch.setattr(readers, "_worker", lambda: pool)
        monkeypatch.setattr(readers, "_read_in", _fill)
        with pytest.raises(Unreadable, match="takes more than 3 GiB to read"):
            open_recording(tmp_path / "a.tdms")


def _fill(*asked):
    np.ones(2**28)

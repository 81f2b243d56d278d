"""Readers of recordings: every format gives the same columns, files by others are read, nothing is guessed."""

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from recordings import CENTRES, FORMATS, RATE, columns, hangs

from unitcad.errors import Refusal
from unitcad.lab import readers
from unitcad.lab.readers import Layout, Unreadable, open_recording

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
    assert_allclose(found * factor, columns(), atol=0.05 if name == "int.wav" else 1e-6)
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
        ("rigolwfm/DS1052E.csv", 8192, "Voltage", "V", None, 1.72, -0.04),
        ("rigolwfm/DS1074Z-A.csv", 1200, "CH1", "Volt", 2e-5, 0.0, None),
        ("soft-robotics-materials-database/Ecoflex 00-10.csv", 751, "True Strain", "", None, 0.04361, None),
        ("soft-robotics-materials-database/Ecoflex 00-30.csv", 705, "True Strain", "", None, 0.06574, None),
        ("soft-robotics-materials-database/Ecoflex 00-50.csv", 721, "True Strain", "", None, 0.04364, None),
        ("soft-robotics-materials-database/Dragon Skin 10 MEDIUM.csv", 457, "True Strain", "", None, 0.0436133, None),
        ("soft-robotics-materials-database/Dragon Skin 30.csv", 311, "True Strain", "", None, 0.0436333333, None),
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
    """Rigol's column X counts samples; its step stands in the header. The other family writes time with its unit."""
    index = open_recording(DATA / "rigolwfm" / "DS1074Z-A.csv")
    assert index.time is None
    assert [one.name for one in index.channels] == ["CH1", "CH2", "CH3"]
    assert open_recording(DATA / "rigolwfm" / "DS1052E.csv").time == 0
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
    with pytest.raises(Unreadable) as refused:
        numbers(open_recording(file))
    assert refused.value.field == (field or str(file))


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
    count = 100_000
    lines = "\n".join(f"{i},{i * 2}.0" for i in range(count))
    file.write_text(f"n,twice\n{lines}\n")
    assert_array_equal(open_recording(file).columns((1,))[:, 0], 2.0 * np.arange(count))
    with open(file, "a") as more:
        more.write("7\n8,9.0\n")
    with pytest.raises(Unreadable, match=f"line {count + 2} "):
        open_recording(file).columns((0,))


def test_a_library_that_never_returns_is_a_refusal(tmp_path, monkeypatch):
    """HDF5 loops for ever over the attributes of some damaged files: its process is ended."""
    FORMATS["plain.h5"](tmp_path / "plain.h5")
    monkeypatch.setattr(readers, "LONGEST_S", 0.5)
    monkeypatch.setattr(readers, "_read_in", hangs)
    with pytest.raises(Unreadable, match=r"was not read in 0\.5 s"):
        open_recording(tmp_path / "plain.h5")


def test_numbers_of_no_standard_layout_are_refused(tmp_path):
    """One damaged byte of a type makes 64 bits something else, which HDF5 converts to zeros without a word."""
    import h5py

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
    np.save(tmp_path / "a.npy", columns())
    with pytest.raises(Unreadable, match="no reader"):
        open_recording(tmp_path / "a.npy")
    monkeypatch.setattr(readers, "__path__", [*readers.__path__, str(tmp_path)])
    monkeypatch.setattr(readers, "_by_ending", readers._by_ending.__wrapped__)
    monkeypatch.delitem(sys.modules, "unitcad.lab.readers.array_file", raising=False)
    block = open_recording(tmp_path / "a.npy").columns((2, 0))
    assert_array_equal(block, columns()[:, [2, 0]])
    (tmp_path / "b.npy").write_bytes(b"\x93NUMPY")
    with pytest.raises(Unreadable, match="is damaged"):
        open_recording(tmp_path / "b.npy")

"""Small files that state much: the size is refused before anything of it is read."""

import struct
import zlib

import numpy as np
import pytest
from recordings import write_tdms

from unitcad.lab.readers import Unreadable, open_recording


def refused(path):
    with pytest.raises(Unreadable) as raised:
        open_recording(path)
    return raised.value.limit


def test_hdf5_that_states_more_than_it_stores(tmp_path):
    h5py = pytest.importorskip("h5py")
    cases = {
        "fill": ({"shape": (10**10,), "chunks": (1000,)}, "states 10000000000 numbers"),
        "few": ({"shape": (10**6,), "chunks": (1000,)}, "states 8000000 bytes and stores 8000 at most"),
        "packed": ({"shape": (10**7,), "chunks": (1000,), "compression": "gzip"}, "states 80000000 bytes and stores"),
        "wide": (
            {"shape": (2,), "chunks": (2**28,), "maxshape": (None,), "compression": "gzip"},
            "a chunk of x states",
        ),
        "contiguous": ({"shape": (10**10,)}, "has no samples stored"),
    }
    for name, (layout, limit) in cases.items():
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            made = file.create_dataset("x", dtype="f8", fillvalue=1.0, **layout)
            if name == "wide":  # one stored chunk of zeros that was never whole in memory
                made.id.write_direct_chunk((0,), zlib.compress(b"\0" * 2**20))
            elif name != "contiguous":
                made[:1000] = np.arange(1000.0)
        assert limit in refused(tmp_path / f"{name}.h5"), name


def test_hdf5_of_many_data_sets_that_fit_each(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for i in range(5):
            made = file.create_dataset(f"x{i}", (2**24,), "u1", chunks=(2**24,), compression="gzip")
            made.id.write_direct_chunk((0,), zlib.compress(b"\0" * 2**24))
    assert "the file states 83886080 numbers" in refused(tmp_path / "a.h5")


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matrix(kind, shape, *parts, name=b""):
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack("<ii", *shape)) + element(1, name)
    return element(14, head + b"".join(parts))


def test_a_mat_struct_of_long_fields(tmp_path):
    """Bytes of zeros, of which MATLAB makes doubles: 200 kB compressed stand for 1.6 GB."""
    count = 2**27
    body = matrix(6, (count, 1), element(2, b"\0" * count))
    fields = element(5, struct.pack("<i", 8)) + element(1, b"x\0\0\0\0\0\0\0")
    whole = matrix(2, (1, 1), fields, body, name=b"s")
    (tmp_path / "a.mat").write_bytes(b"MATLAB 5.0".ljust(124) + b"\x00\x01IM" + element(15, zlib.compress(whole))[:-1])
    assert (tmp_path / "a.mat").stat().st_size < 300_000
    assert "states more than 134217728 bytes" in refused(tmp_path / "a.mat")


def test_tdms_that_states_more_samples_than_bytes(tmp_path):
    pytest.importorskip("nptdms")
    write_tdms(tmp_path / "a.tdms")
    content = (tmp_path / "a.tdms").read_bytes()
    assert content.count(struct.pack("<Q", 300)) == 3
    (tmp_path / "a.tdms").write_bytes(content.replace(struct.pack("<Q", 300), struct.pack("<Q", 3 * 10**9)))
    assert "has fewer samples than it states" in refused(tmp_path / "a.tdms")


def test_a_library_that_takes_all_memory_is_ended(tmp_path, monkeypatch):
    from unitcad.lab import readers
    from unitcad.workers import Pool

    write_tdms(tmp_path / "a.tdms")
    with Pool(memory=400 << 20) as pool:
        monkeypatch.setattr(readers, "_worker", lambda: pool)
        monkeypatch.setattr(readers, "_read_in", _fill)
        assert "takes more than 3 GiB to read" in refused(tmp_path / "a.tdms")


def _fill(*asked):
    np.ones(2**28)

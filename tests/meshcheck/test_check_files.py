"""What a path may be: sizes are looked at before anything is read, and only regular files are opened."""

import os
import socket
import sys
import time
from pathlib import Path

import pytest
from shapes import box, stl

from unitcad.meshcheck import Limits, Options, check_file


def test_a_sparse_file_beyond_the_limit_is_refused_at_once(tmp_path):
    with (tmp_path / "a.stl").open("wb") as file:
        file.truncate(20_000_000_000)
    begin = time.perf_counter()
    (found,) = check_file(tmp_path / "a.stl").findings
    assert time.perf_counter() - begin < 1
    assert (found.code, found.message) == ("F011", "20000000000 bytes, more than the limit of 4000000000")


def test_the_limit_itself_is_allowed(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()))
    assert check_file(tmp_path / "a.stl", Options(limits=Limits(max_bytes=684))).verdict == "pass"
    assert check_file(tmp_path / "a.stl", Options(limits=Limits(max_bytes=683))).has("F011")


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX kinds of files")
def test_what_is_no_regular_file_is_named_and_never_opened(tmp_path):
    os.mkfifo(tmp_path / "a.stl")
    (tmp_path / "b.stl").mkdir()
    with socket.socket(socket.AF_UNIX) as made:
        here = Path.cwd()
        os.chdir(tmp_path)  # a socket's path may have 108 bytes only
        try:
            made.bind("c.stl")
        finally:
            os.chdir(here)
        said = [
            check_file(path).findings
            for path in (tmp_path / "a.stl", tmp_path / "b.stl", tmp_path / "c.stl", "/dev/null")
        ]
    assert [[(found.code, found.message) for found in found] for found in said] == [
        [("F012", f"cannot be read: is {kind}, not a regular file")]
        for kind in ("a pipe", "a folder", "a socket", "a device")
    ]
    assert check_file(tmp_path / "no.stl").findings[0].message == "no such file"
    assert check_file("a\0.stl").findings[0].code == "F012"

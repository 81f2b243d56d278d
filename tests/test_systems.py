"""What differs between Linux, macOS and Windows, tried here by standing in for the other system's calls."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path, PureWindowsPath

import filelock
import pytest

from unitcad import files
from unitcad.pipeline import plan as versions


class OneReader(filelock.FileLock):
    """A lock as Windows has it: while it is held nobody reads, writes or removes its file."""

    def acquire(self, *args, **kwargs):
        got = super().acquire(*args, **kwargs)
        os.unlink(self.lock_file)
        os.mkdir(self.lock_file)  # what is opened or unlinked by this name now fails
        return got

    def release(self, *args, **kwargs):
        held = self.is_locked
        super().release(*args, **kwargs)
        if held:
            os.rmdir(self.lock_file)


def test_nobody_reads_or_removes_a_file_that_is_locked(tmp_path, monkeypatch):
    monkeypatch.setattr(filelock, "FileLock", OneReader)
    with files.scratch(tmp_path, "mine") as folder:
        assert (folder / files.MARK).read_text().splitlines()[-1] == "mine"
    assert list(tmp_path.iterdir()) == []
    left = tmp_path / f"{files.TEMPORARY}0123456789abcdef"
    left.mkdir()
    (left / files.MARK).write_text(f"{files.FORMAT}\n0123456789abcdef\nmine\n")
    assert list(files.leftovers(tmp_path)) == [(left, "mine")]
    files.write(tmp_path / "whole", b"content")
    assert (tmp_path / "whole").read_bytes() == b"content"


def test_the_cache_lives_with_locks_that_nobody_removes(tmp_path, monkeypatch):
    from unitcad.cache import DiskStore, collect
    from unitcad.cache import disk as module

    monkeypatch.setattr(module, "FileLock", OneReader)
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", lambda: b"content")
    assert store.file("ab1", lambda: pytest.fail("there")) == sha
    store.close()
    assert collect(tmp_path / "c", 0).entries == 1


def test_a_path_on_another_drive_is_shown_whole(monkeypatch):
    assert files.path_seen_from("a/../b/c.stl") == "b/c.stl"
    assert files.path_seen_from("/x/b/c.stl", "/x/d") == "../b/c.stl"

    def other_drive(path, start="."):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(os.path, "relpath", other_drive)
    assert files.path_seen_from("/x/b/c.stl") == "/x/b/c.stl"


def test_names_of_devices_are_known():
    assert all(map(files.names_device, ["con", "CON", "Nul.toml", "com1", "lpt9.tar.gz", "aux "]))
    assert not any(map(files.names_device, ["cone", "com", "com10", "my-con", "null", "lpt"]))


def test_the_version_of_the_code_is_the_same_on_every_system(tmp_path, monkeypatch):
    """The same files by another separator, in the order in which another system sorts them."""
    for name in ("a/b.py", "a.py", "B.py", "a-b/c.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    monkeypatch.setattr(versions, "files", lambda package: tmp_path)
    here = versions.code_version.__wrapped__()

    class Windows(PureWindowsPath):
        def rglob(self, pattern):
            return sorted(Windows(path) for path in tmp_path.rglob(pattern) if path.is_file())

        def read_bytes(self):
            return Path(self.as_posix()).read_bytes()

    monkeypatch.setattr(versions, "Path", Windows)
    assert versions.code_version.__wrapped__() == here


def test_what_is_written_has_the_same_line_ends_everywhere(tmp_path, monkeypatch):
    """A result's texts are written as bytes: a system whose lines end otherwise changes none of them."""
    monkeypatch.setattr(os, "linesep", "\r\n")
    monkeypatch.chdir(tmp_path)
    from unitcad.pipeline.write import build
    from unitcad.validation import load

    folder = build(load("embedded", ["output.formats=['stl']"]), tmp_path / "out", check=False).folder
    texts = [file for file in folder.rglob("*") if file.suffix in (".toml", ".json", ".md", ".csv", ".svg")]
    assert len(texts) >= 6
    assert [file.name for file in texts if b"\r" in file.read_bytes()] == []


@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of Windows takes any character")
@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        ("ascii", ["estimate"]),
        ("ascii", ["estimate", "--json"]),
        ("latin-1", ["build", "--formats", "stl"]),
        ("utf-8", ["estimate"]),
    ],
)
def test_a_name_that_the_terminal_lacks_is_shown_by_its_code(encoding, words, tmp_path):
    import json
    import subprocess

    done = subprocess.run(
        [sys.executable, "-m", "unitcad", words[0], "embedded", *words[1:], "--set", 'name="Größe Ω"'],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": encoding, "XDG_CACHE_HOME": str(tmp_path / "cache")},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    if "--json" in words:
        assert json.loads(done.stdout.decode(encoding))["variant"]["name"] == "Größe Ω"
    else:  # click writes UTF-8 to a stream that claims to be ASCII
        shown = done.stdout + done.stderr
        assert any(name in shown for name in ("Größe Ω".encode(encoding, "backslashreplace"), "Größe Ω".encode()))


ROOT = Path(__file__).parent.parent


def test_the_job_files_fit_their_schema_and_name_what_there_is():
    jobs = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.github-workflows", *map(str, jobs)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    named = re.findall(r"tests/[\w/.]+|constraints.txt", "".join(job.read_text() for job in jobs))
    assert len(named) > 4
    assert [name for name in named if not (ROOT / name).exists()] == []


FIXED = {
    "distributed": "2026.1.1",  # CVE-2026-23528; 2026.1.0 was published broken
    "filelock": "4.2.1",  # CVE-2026-112906
    "pillow": "13.0.0",  # CVE-2026-59197 to 59200 in 12.3, more in 13
    "pytest": "9.0.3",  # CVE-2025-71176
    "starlette": "1.3.1",  # CVE-2026-48710, 48817, 54283
    "uv": "0.11.15",  # GHSA-4gg8-gxpx-9rph
}
"""The first versions without advisories that were known when the bounds were set; advisories.yml looks up new ones."""


def test_no_version_with_a_known_advisory_is_within_the_bounds():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = [line for lines in project["optional-dependencies"].values() for line in lines]
    bounds = dict(re.findall(r"([\w-]+)>=([\d.]+)", "\n".join([*project["dependencies"], *extras])))
    pinned = dict(re.findall(r"(?m)^([\w-]+)==([\d.]+)$", (ROOT / "constraints.txt").read_text("utf-8")))
    for given in (bounds, pinned):
        found = {name: given[name] for name in FIXED}
        assert {name: one for name, one in found.items() if _numbers(one) < _numbers(FIXED[name])} == {}


def _numbers(version):
    return tuple(map(int, version.split(".") + ["0"] * (3 - version.count(".") - 1)))

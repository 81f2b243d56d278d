"""What an earlier run finished is held to what was made: sizes always, hashes with --verify; contents are synced."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from batching import bytes_of, ring_sweep, rows, unitcad

from unitcad.cache import digest
from unitcad.sweeps import BatchOptions, Summary, load_sweep, run
from unitcad.sweeps.batch_records import JournalEntry
from unitcad.sweeps.executors import SerialExecutor
from unitcad.sweeps.journal import Journal


def _emptied(file: Path) -> None:
    """As a crash of the machine leaves it: nothing in it. A new file, since results are links to the cache."""
    file.unlink()
    file.write_bytes(b"")


def _cut(file: Path) -> None:
    content = file.read_bytes()
    file.unlink()
    file.write_bytes(content[: len(content) // 2])


def _longer(file: Path) -> None:
    content = file.read_bytes()
    file.unlink()
    file.write_bytes(content + b"\0")


def _linked(file: Path) -> None:
    aside = Path(os.environ["UNITCAD_CACHE"]).parent / "aside"
    file.rename(aside)
    file.symlink_to(aside)


def _flipped(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.unlink()
    file.write_bytes(content)


def _flipped_through(file: Path) -> None:
    """In the cache too, of which the result is a link."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.chmod(0o644)
    file.write_bytes(content)


LARGER = {"emptied": _emptied, "cut": _cut, "longer": _longer, "linked": _linked, "gone": Path.unlink}
FILES = ["manifest.json", "spec.toml", "unit/layer1.stl", "section.svg"]


def _run(sweep: Path, out: Path, **more: object) -> Summary:
    return run(load_sweep(sweep), out, BatchOptions(("unit",), **more), SerialExecutor(), workers=1)


@pytest.fixture
def made(tmp_path: Path) -> tuple[Path, Path]:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0]), tmp_path / "out"
    assert _run(sweep, out).ok == 2
    return sweep, out


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("damage", LARGER)
def test_a_finished_variant_whose_files_are_not_whole_is_made_again(
    damage: str, file: str, made: tuple[Path, Path]
) -> None:
    sweep, out = made
    before = bytes_of(out)
    LARGER[damage](out / rows(out)[0]["folder"] / file)
    summary = _run(sweep, out)
    assert (summary.ok, summary.resumed) == (2, 1)
    assert bytes_of(out) == before
    assert not (out / rows(out)[0]["folder"] / file).is_symlink()
    assert _run(sweep, out).resumed == 2


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("damage", [_flipped, _flipped_through])
def test_hashes_are_held_with_verify(damage: Callable[[Path], None], file: str, made: tuple[Path, Path]) -> None:
    sweep, out = made
    before = bytes_of(out)
    damage(out / rows(out)[0]["folder"] / file)
    assert _run(sweep, out, verify=True).resumed == 1
    assert bytes_of(out) == before
    assert _run(sweep, out, verify=True).resumed == 2


def test_verify_on_the_command_line(tmp_path: Path) -> None:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0]), tmp_path / "out"
    words = ("batch", sweep, "-o", out, "-j", 1, "--only", "unit", "--json", "--verify")
    assert unitcad(*words).returncode == 0
    before = bytes_of(out)
    _flipped(out / rows(out)[1]["folder"] / "unit" / "layer1.stl")
    assert json.loads(unitcad(*words).stdout)["taken_up"] == 1
    assert bytes_of(out) == before


def test_a_lost_journal_loses_nothing(made: tuple[Path, Path]) -> None:
    sweep, out = made
    before = bytes_of(out)
    folders = {folder.name: folder.stat().st_ino for folder in out.glob("ring-*")}
    (out / "journal.jsonl").unlink()
    assert _run(sweep, out).ok == 2
    assert bytes_of(out) == before
    assert {folder.name: folder.stat().st_ino for folder in out.glob("ring-*")} == folders


def test_the_manifest_lists_every_file(made: tuple[Path, Path]) -> None:
    _, out = made
    folder = out / rows(out)[0]["folder"]
    listed = json.loads((folder / "manifest.json").read_text())["files"]
    there = {
        str(file.relative_to(folder)): {"bytes": file.stat().st_size, "sha256": digest(file.read_bytes())}
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name not in ("manifest.json", "timings.json")
    }
    assert listed == there


def test_contents_are_on_the_disk_before_the_journal_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), tmp_path / "out"
    synced: set[int] = set()
    noted = []
    sync, add = os.fsync, Journal.add

    def recorded(handle: int) -> None:
        sync(handle)
        synced.add(os.fstat(handle).st_ino)

    def checked(self: Journal, entry: JournalEntry) -> None:
        folder = self.out / entry.folder
        for path in ("manifest.json", *json.loads((folder / "manifest.json").read_text())["files"]):
            assert (folder / path).stat().st_ino in synced, path
        noted.append(entry.index)
        add(self, entry)

    monkeypatch.setattr(os, "fsync", recorded)
    monkeypatch.setattr(Journal, "add", checked)
    assert _run(sweep, out).ok == 4
    assert sorted(noted) == [0, 1, 2, 3]


@pytest.mark.parametrize("what", ["", "tmp", "locks", "content", "files", "data", "unitcad-cache"])
def test_a_cache_that_is_cleared_away_during_a_batch_fails_nothing(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, own_cache: Path
) -> None:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0, 4.0], materials=2), tmp_path / "out"
    add = Journal.add

    def clearing(self: Journal, entry: dict) -> None:
        add(self, entry)
        path = own_cache / what
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)

    monkeypatch.setattr(Journal, "add", clearing)
    summary = _run(sweep, out)
    assert (summary.ok, summary.failed, summary.stopped) == (6, 0, "")
    done = unitcad("batch", sweep, "-o", tmp_path / "whole", "-j", 0, "--only", "unit", "--cache", tmp_path / "other")
    assert done.returncode == 0, done.stderr
    assert bytes_of(out) == bytes_of(tmp_path / "whole")

"""What an earlier run finished is held to what was made: sizes always, hashes with --verify; contents are synced."""

import json
import os

import pytest
from batching import bytes_of, made, ring_sweep, rows, unitcad
from msgspec.structs import replace

from unitcad.cache import digest
from unitcad.errors import UnitcadError
from unitcad.sweeps import journal as journal_module
from unitcad.sweeps.journal import BatchHead, Journal, JournalEntry


def _flipped(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.unlink()
    file.write_bytes(content)


@pytest.fixture
def two(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0]), tmp_path / "rings"
    assert made(sweep, out).ok == 2
    return sweep, out


@pytest.mark.parametrize("verify", [False, True])
def test_a_finished_variant_whose_file_changed_is_made_again(verify, two):
    """By its size always, by its hash with verify; test_damaged_batches.py has every other damage."""
    sweep, out = two
    before = bytes_of(out)
    file = out / rows(out)[0]["folder"] / "unit" / "layer1.stl"
    if verify:
        _flipped(file)
    else:
        file.unlink()
        file.write_bytes(b"")
    words = ("batch", sweep, "-o", out.parent, "-j", 0, "--json", *["--verify"] * verify)
    for kept in (1, 2):
        assert json.loads(unitcad(*words).stdout)["taken_up"] == kept
        assert bytes_of(out) == before


def test_a_lost_journal_loses_nothing(two):
    sweep, out = two
    before = bytes_of(out)
    folders = {folder.name: folder.stat().st_ino for folder in out.glob("ring-*")}
    (out / "journal.jsonl").unlink()
    assert made(sweep, out).ok == 2
    assert bytes_of(out) == before
    assert {folder.name: folder.stat().st_ino for folder in out.glob("ring-*")} == folders


def test_the_manifest_lists_every_file(two):
    _, out = two
    folder = out / rows(out)[0]["folder"]
    listed = json.loads((folder / "manifest.json").read_text())["files"]
    there = {
        str(file.relative_to(folder)): {"bytes": file.stat().st_size, "sha256": digest(file.read_bytes())}
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name not in ("manifest.json", "timings.json")
    }
    assert listed == there


def test_contents_are_on_the_disk_before_the_journal_says_so(tmp_path, monkeypatch):
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), tmp_path / "rings"
    synced = set()
    noted = []
    sync, add = os.fsync, Journal.add

    def recorded(handle):
        sync(handle)
        synced.add(os.fstat(handle).st_ino)

    def checked(self, entry):
        folder = self.out / entry.folder
        for path in ("manifest.json", *json.loads((folder / "manifest.json").read_text())["files"]):
            assert (folder / path).stat().st_ino in synced, path
        noted.append(entry.index)
        add(self, entry)

    monkeypatch.setattr(os, "fsync", recorded)
    monkeypatch.setattr(Journal, "add", checked)
    assert made(sweep, out).ok == 4
    assert sorted(noted) == [0, 1, 2, 3]


HEAD = BatchHead(batch="b", name="n")


def _entry(index, reason="r"):
    return JournalEntry(index=index, status="failed", reason=reason)


def test_the_last_line_of_a_variant_counts_and_the_order_is_the_sweep_s(tmp_path):
    journal = Journal(tmp_path / "o", HEAD)
    for index in (3, 0, 5, 3):
        journal.add(_entry(index, reason=f"{index} {len(list(journal.entries()))}"))
    assert [(entry.index, entry.reason) for entry in journal.entries()] == [(0, "0 1"), (3, "3 3"), (5, "5 2")]
    journal.close()
    again = Journal(tmp_path / "o", HEAD)
    assert [entry.reason for entry in again.entries()] == ["0 1", "3 3", "5 2"]
    assert again.entry(1) is None
    assert again.entry(99) is None
    again.close()


def test_other_code_starts_anew_and_another_batch_is_refused(tmp_path, monkeypatch):
    journal = Journal(tmp_path / "o", HEAD)
    journal.add(_entry(0))
    journal.close()
    with pytest.raises(UnitcadError, match="another batch"):
        Journal(tmp_path / "o", replace(HEAD, batch="c"))
    monkeypatch.setattr(journal_module, "code_version", lambda: "2")
    newer = Journal(tmp_path / "o", HEAD)
    assert list(newer.entries()) == []
    newer.close()
    (tmp_path / "o" / "journal.jsonl").write_text("nonsense\n")
    with pytest.raises(UnitcadError, match="no journal"):
        Journal(tmp_path / "o", HEAD)


def test_other_options_are_another_batch(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0]), tmp_path / "rings"
    assert unitcad("batch", sweep, "-o", out.parent, "-j", 0).returncode == 0
    for words in (["--no-check"], ["--formats", "3mf"], ["--only", "unit,moulds"]):
        done = unitcad("batch", sweep, "-o", out.parent, "-j", 0, *words)
        assert done.returncode == 2
        assert "has another batch" in done.stderr
    assert unitcad("batch", sweep, "-o", out.parent, "-j", 0, "--keep-going", "--timeout", 9).returncode == 2

"""The journal: torn lines, other versions, what is resumed and what is made again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from batching import bytes_of, calls, ring_sweep, rows, unitcad
from msgspec.structs import replace

from unitcad.errors import UnitcadError
from unitcad.sweeps.batch_records import BatchHead, JournalEntry
from unitcad.sweeps.journal import Journal

HEAD = BatchHead(batch="b", name="n")


def _entry(index: int, reason: str = "r") -> JournalEntry:
    return JournalEntry(index=index, status="failed", reason=reason)


def test_the_last_line_of_a_variant_counts_and_the_order_is_the_sweep_s(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "o", HEAD, "1")
    for index in (3, 0, 5, 3):
        journal.add(_entry(index, reason=f"{index} {len(list(journal.entries()))}"))
    assert [(entry.index, entry.reason) for entry in journal.entries()] == [(0, "0 1"), (3, "3 3"), (5, "5 2")]
    journal.close()
    again = Journal(tmp_path / "o", HEAD, "1")
    assert [entry.reason for entry in again.entries()] == ["0 1", "3 3", "5 2"]
    assert again.entry(1) is None
    assert again.entry(99) is None
    again.close()


def test_a_torn_line_is_cut_off(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "o", HEAD, "1")
    journal.add(_entry(0))
    journal.add(_entry(1))
    journal.close()
    file = tmp_path / "o" / "journal.jsonl"
    file.write_bytes(file.read_bytes()[:-9])
    again = Journal(tmp_path / "o", HEAD, "1")
    assert [entry.index for entry in again.entries()] == [0]
    again.add(_entry(2))
    again.close()
    third = Journal(tmp_path / "o", HEAD, "1")
    assert [entry.index for entry in third.entries()] == [0, 2]
    third.close()


def test_other_code_starts_anew_and_another_batch_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "o", HEAD, "1")
    journal.add(_entry(0))
    journal.close()
    with pytest.raises(UnitcadError, match="another batch"):
        Journal(tmp_path / "o", replace(HEAD, batch="c"), "1")
    newer = Journal(tmp_path / "o", HEAD, "2")
    assert list(newer.entries()) == []
    newer.close()
    (tmp_path / "o" / "journal.jsonl").write_text("nonsense\n")
    with pytest.raises(UnitcadError, match="no journal"):
        Journal(tmp_path / "o", HEAD, "1")


def test_a_variant_whose_folder_is_gone_is_made_again(tmp_path: Path) -> None:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0]), tmp_path / "o"
    assert unitcad("batch", sweep, "-o", out, "-j", 0).returncode == 0
    before = bytes_of(out)
    shutil.rmtree(out / rows(out)[1]["folder"])
    done = unitcad("batch", sweep, "-o", out, "-j", 0, "--json")
    assert json.loads(done.stdout)["taken_up"] == 1
    assert bytes_of(out) == before
    assert len(calls(tmp_path / "s")) == 2  # it came out of the cache


def test_other_options_are_another_batch(tmp_path: Path) -> None:
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0]), tmp_path / "o"
    assert unitcad("batch", sweep, "-o", out, "-j", 0).returncode == 0
    for words in (["--no-check"], ["--formats", "3mf"], ["--only", "unit,moulds"]):
        done = unitcad("batch", sweep, "-o", out, "-j", 0, *words)
        assert done.returncode == 2
        assert "has another batch" in done.stderr
    assert unitcad("batch", sweep, "-o", out, "-j", 0, "--keep-going", "--timeout", 9).returncode == 2

"""Entries of the cache, which a store keeps decoded while they are as they were."""

from __future__ import annotations

from pathlib import Path

import pytest
from batching import data_of

from unitcad.cache import DiskStore
from unitcad.cache import disk as disk_module


@pytest.mark.parametrize("by", ["another process", "damage"])
def test_an_entry_that_changed_is_read_again(by: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = DiskStore(tmp_path / "c")
    data_of(store, "ab1", lambda: {"x": 1})
    for _ in range(2):  # its time of use is noted at the first
        data_of(store, "ab1", lambda: pytest.fail("made twice"))
    monkeypatch.setattr(disk_module, "read", lambda path: pytest.fail("read twice"))
    assert data_of(store, "ab1", lambda: pytest.fail("made twice")) == {"x": 1}
    monkeypatch.undo()
    if by == "damage":
        entry = tmp_path / "c" / "data" / "ab" / "ab1"
        entry.write_bytes(entry.read_bytes()[:-1] + b" ")
    else:
        data_of(DiskStore(tmp_path / "c"), "ab1", lambda: {"x": 2}, intact=lambda data: data["x"] == 2)
    assert data_of(store, "ab1", lambda: {"x": 3}) == {"x": 3 if by == "damage" else 2}

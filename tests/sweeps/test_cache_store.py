"""The cache: once each, by many at once; damage found and mended; links, copies where links fail; collecting."""

import errno
import multiprocessing
import os
import shutil
import time
from pathlib import Path

import pytest

from unitcad.cache import DiskStore, MemoryStore, MissingContent, collect, default_root, usage
from unitcad.cache import disk as disk_module
from unitcad.errors import UnitcadError


class Made:
    """A maker that counts."""

    def __init__(self, content=b"content"):
        self.content, self.count = content, 0

    def __call__(self):
        self.count += 1
        return self.content


@pytest.mark.parametrize("kind", ["memory", "disk"])
def test_each_key_is_made_once(kind, tmp_path):
    store = MemoryStore() if kind == "memory" else DiskStore(tmp_path / "c")
    make = Made()
    first, second = store.file("ab1", make), store.file("ab1", make)
    assert first == second
    assert make.count == 1
    assert store.content(first) == b"content"
    assert store.data("ab2", lambda: {"x": [1.5, None]}) == {"x": [1.5, None]}
    assert store.data("ab2", lambda: pytest.fail("made twice")) == {"x": [1.5, None]}
    assert store.data("ab2", lambda: {"y": 1}, intact=lambda data: "y" in data) == {"y": 1}
    assert dict(store.counts) == {"file built": 1, "file reused": 1, "data built": 2, "data reused": 1}
    with pytest.raises(MissingContent):
        store.content("0" * 64)


def test_results_are_links_that_can_not_be_written_through(tmp_path):
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())
    store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").stat().st_ino == (tmp_path / "c" / "content" / sha[:2] / sha).stat().st_ino
    assert (tmp_path / "a").stat().st_mode & 0o222 == 0


@pytest.mark.parametrize("number", [errno.EXDEV, errno.EPERM, errno.EMLINK, errno.EOPNOTSUPP])
def test_copies_where_links_fail(number, tmp_path, monkeypatch):
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())

    def refused(source, target):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(disk_module.os, "link", refused)
        store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"content"
    assert (tmp_path / "a").stat().st_nlink == 1


def test_no_room_in_the_cache_is_no_error(tmp_path, monkeypatch):
    store = DiskStore(tmp_path / "c")

    def full(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        sha = store.file("ab1", Made())
        assert store.data("ab2", lambda: 5) == 5
    assert store.content(sha) == b"content"
    store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"content"
    assert not list((tmp_path / "c" / "tmp").iterdir())


def test_many_processes_make_each_key_once(tmp_path):
    root, context = tmp_path / "c", multiprocessing.get_context("spawn")
    with context.Pool(3) as pool:
        found = pool.starmap(_make_all, [(root, tmp_path / "log")] * 8)
    assert len({tuple(shas) for shas in found}) == 1
    made = (tmp_path / "log").read_text().split()
    assert sorted(made) == sorted(set(made))
    assert not list((root / "locks").iterdir())
    assert not list((root / "tmp").iterdir())


def _make_all(root, log):
    store = DiskStore(root)

    def make(i):
        with open(log, "a") as file:
            file.write(f"{i}\n")
        time.sleep(0.01)
        return f"content {i}".encode() * 1000

    return [store.file(f"{i:02d}key", lambda i=i: make(i)) for i in range(20)]


def test_collecting_removes_what_was_used_longest_ago(tmp_path):
    root = tmp_path / "c"
    store = DiskStore(root)
    for i in range(10):
        store.file(f"k{i}", Made(bytes([i]) * 1000))
        os.utime(root / "files" / f"k{i}" / f"k{i}", (i, i))
    store.file("k0", lambda: pytest.fail("there"))  # used again: the newest now
    store.close()
    entry = (root / "files" / "k1" / "k1").stat().st_size
    gone = collect(root, 4 * (1000 + entry))
    assert (gone.entries, gone.contents) == (6, 6)
    left = sorted(path.name for path in (root / "files").rglob("k*") if path.is_file())
    assert left == ["k0", "k7", "k8", "k9"]
    assert collect(root, 0).entries == 4
    assert usage(root).bytes == 0


def test_collecting_spares_what_somebody_is_using(tmp_path):
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())
    assert collect(tmp_path / "c", 0).entries == 0
    assert store.has(sha)
    store.close()
    assert collect(tmp_path / "c", 0).entries == 1


def test_locks_that_dead_processes_left_are_no_users(tmp_path):
    root = tmp_path / "c"
    store = DiskStore(root)
    store.file("ab1", Made())
    store.close()
    for name in ("open-0123", "ab1"):
        (root / "locks" / name).touch()
    (root / "tmp" / "half").touch()
    assert collect(root, 0).entries == 1
    assert not (root / "tmp" / "half").exists()
    assert not list((root / "locks").iterdir())


def test_the_cache_of_a_person_without_a_home_is_refused(monkeypatch):
    for name in ("HOME", "UNITCAD_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    with pytest.raises(UnitcadError, match="UNITCAD_CACHE"):
        default_root()


def test_on_windows_no_content_is_read_only(tmp_path, monkeypatch):
    store = DiskStore(tmp_path / "c")
    for system, mode in (("win32", 0o200), ("linux", 0)):
        with monkeypatch.context() as faked:
            faked.setattr("unitcad.cache.disk.sys.platform", system)
            sha = store.keep(system.encode())
        assert (tmp_path / "c" / "content" / sha[:2] / sha).stat().st_mode & 0o222 & 0o200 == mode


def test_a_folder_of_others_is_refused(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("keep")
    (tmp_path / "file").write_text("keep")
    for root in ("mine", "file"):
        with pytest.raises(UnitcadError, match="--cache"):
            DiskStore(tmp_path / root)
    with pytest.raises(UnitcadError, match="no cache"):
        collect(tmp_path / "mine", 0)
    assert (tmp_path / "mine" / "letter.txt").read_text() == "keep"


def _replaced(path, kind, outside):
    """Put something else in a file's place."""
    content = path.read_bytes()
    path.unlink()
    match kind:
        case "gone":
            pass
        case "cut":
            path.write_bytes(content[:-4])
        case "emptied":
            path.write_bytes(b"")
        case "other text":
            path.write_bytes(b"n0nsens" if content == b"content" else b"nonsense\n{}")
        case "link to the same":
            outside.write_bytes(content)
            path.symlink_to(outside)
        case "link to another":
            outside.write_bytes(b"secret")
            path.symlink_to(outside)
        case "link to nothing":
            path.symlink_to(outside / "nowhere")
        case "folder":
            path.mkdir()
        case "full folder":
            path.mkdir()
            (path / "file").write_bytes(content)
        case "pipe":
            os.mkfifo(path)


@pytest.mark.parametrize(
    "kind",
    [
        "gone", "cut", "emptied", "other text", "link to the same", "link to another", "link to nothing", "folder",
        "full folder", "pipe",
    ],
)  # fmt: skip
@pytest.mark.parametrize("what", ["content", "entry"])
@pytest.mark.parametrize("anew", [False, True], ids=["", "anew"])
def test_damage_is_found_and_mended(kind, what, anew, tmp_path):
    root, make = tmp_path / "c", Made()
    store = DiskStore(root)
    sha = store.file("ab1", make)
    path = root / "content" / sha[:2] / sha if what == "content" else root / "files" / "ab" / "ab1"
    _replaced(path, kind, tmp_path / "outside")
    if anew:
        store = DiskStore(root)
    assert store.file("ab1", make) == sha
    assert make.count == 2
    if kind in ("cut", "emptied", "other text"):
        assert store.counts["damaged"] == 1
    store.place(sha, tmp_path / "result")
    assert not (tmp_path / "result").is_symlink()
    assert (tmp_path / "result").read_bytes() == store.content(sha) == b"content"
    assert path.is_file()
    assert not path.is_symlink()
    assert usage(root).entries == 1
    assert DiskStore(root).file("ab1", lambda: pytest.fail("not mended")) == sha
    store.close()
    _replaced(path, kind, tmp_path / "outside2")
    collect(root, 0)
    assert store.file("ab1", make) == sha


@pytest.mark.parametrize("kind", ["data", "file"])
def test_an_entry_under_another_key_does_not_count(kind, tmp_path):
    """Moved by hand or by a damaged file system: whole in itself, and the verdict on another part."""
    store = DiskStore(tmp_path / "c")
    if kind == "data":
        store.data("ab1", lambda: {"status": "ok"})
        store.data("ab2", lambda: {"status": "broken"})
    else:
        store.file("ab1", Made(b"one"))
        store.file("ab2", Made(b"two"))
    folder = tmp_path / "c" / ("data" if kind == "data" else "files") / "ab"
    (folder / "ab2").write_bytes((folder / "ab1").read_bytes())
    again = DiskStore(tmp_path / "c")
    if kind == "data":
        assert again.data("ab2", lambda: {"status": "broken"}) == {"status": "broken"}
    else:
        assert again.content(again.file("ab2", Made(b"two"))) == b"two"
    assert dict(again.counts) == {f"{kind} built": 1, "damaged": 1}


@pytest.mark.parametrize("what", ["", "tmp", "locks", "content", "files", "data", "unitcad-cache"])
def test_what_is_cleared_away_under_a_store_comes_back(what, tmp_path):
    root, make = tmp_path / "c", Made()
    store = DiskStore(root)
    sha = store.file("ab1", make)
    for _ in range(2):
        shutil.rmtree(root / what) if (root / what).is_dir() else (root / what).unlink(missing_ok=True)
        assert store.file("ab1", make) == sha
        assert store.file("ab3", Made(b"more"))
        store.place(sha, tmp_path / f"result{len(list(tmp_path.iterdir()))}")
    store.close()
    assert make.count == (3 if what in ("", "content", "files") else 1)
    assert DiskStore(root).file("ab1", lambda: pytest.fail("is not kept")) == sha
    assert collect(root, 0).contents == 2


@pytest.mark.parametrize("by", ["another process", "damage"])
def test_an_entry_that_changed_is_read_again(by, tmp_path):
    store = DiskStore(tmp_path / "c")
    store.data("ab1", lambda: {"x": 1})
    assert store.data("ab1", lambda: pytest.fail("made twice")) == {"x": 1}
    if by == "damage":
        entry = tmp_path / "c" / "data" / "ab" / "ab1"
        entry.write_bytes(entry.read_bytes()[:-1] + b" ")
    else:
        DiskStore(tmp_path / "c").data("ab1", lambda: {"x": 2}, intact=lambda data: data["x"] == 2)
    assert store.data("ab1", lambda: {"x": 3}) == {"x": 3 if by == "damage" else 2}

"""The cache: once each, by many at once; damage found and mended; links, copies where links fail; collecting."""

from __future__ import annotations

import errno
import importlib
import json
import multiprocessing
import os
import shutil
import time
from pathlib import Path

import platformdirs
import pytest
from batching import data_of

from unitcad.cache import DiskStore, MemoryStore, MissingContent, collect, default_root, usage
from unitcad.cache import disk as disk_module
from unitcad.errors import UnitcadError


class Made:
    """A maker that counts."""

    def __init__(self, content: bytes = b"content") -> None:
        self.content, self.count = content, 0

    def __call__(self) -> bytes:
        self.count += 1
        return self.content


@pytest.mark.parametrize("kind", ["memory", "disk"])
def test_each_key_is_made_once(kind: str, tmp_path: Path) -> None:
    store = MemoryStore() if kind == "memory" else DiskStore(tmp_path / "c")
    make = Made()
    first, second = store.file("ab1", make), store.file("ab1", make)
    assert first == second
    assert make.count == 1
    assert store.content(first) == b"content"
    assert data_of(store, "ab2", lambda: {"x": [1.5, None]}) == {"x": [1.5, None]}
    assert data_of(store, "ab2", lambda: pytest.fail("made twice")) == {"x": [1.5, None]}
    assert data_of(store, "ab2", lambda: {"y": 1}, intact=lambda data: "y" in data) == {"y": 1}
    assert dict(store.counts) == {"file built": 1, "file reused": 1, "data built": 2, "data reused": 1}
    with pytest.raises(MissingContent):
        store.content("0" * 64)


def test_equal_contents_are_stored_once_and_another_process_finds_them(tmp_path: Path) -> None:
    store = DiskStore(tmp_path / "c")
    assert store.file("a1", Made()) == store.file("a2", Made())
    assert usage(tmp_path / "c").contents == 1
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_reused, (tmp_path / "c", "a1"))


def _reused(root: Path, key: str) -> bool:
    store = DiskStore(root)
    store.file(key, Made())
    return store.counts["file reused"] == 1


@pytest.mark.parametrize("damage", ["flipped", "cut", "emptied", "gone", "entry", "entry text"])
def test_damage_is_found_and_mended(damage: str, tmp_path: Path) -> None:
    sha = DiskStore(tmp_path / "c").file("ab1", Made())
    content, entry = tmp_path / "c" / "content" / sha[:2] / sha, tmp_path / "c" / "files" / "ab" / "ab1"
    content.chmod(0o644)
    match damage:
        case "flipped":
            content.write_bytes(b"contend")
        case "cut":
            content.write_bytes(b"cont")
        case "emptied":
            content.write_bytes(b"")
        case "gone":
            content.unlink()
        case "entry":
            entry.write_bytes(entry.read_bytes()[:-4])
        case "entry text":
            entry.write_bytes(b"nonsense\n{}")
    store, make = DiskStore(tmp_path / "c"), Made()
    assert store.file("ab1", make) == sha
    assert make.count == 1
    assert content.read_bytes() == b"content"
    assert store.counts["damaged"] == (0 if damage == "gone" else 1)
    assert DiskStore(tmp_path / "c").file("ab1", lambda: pytest.fail("not mended")) == sha


def test_damage_under_a_running_process_is_found_too(tmp_path: Path) -> None:
    store, make = DiskStore(tmp_path / "c"), Made()
    sha = store.file("ab1", make)
    content = tmp_path / "c" / "content" / sha[:2] / sha
    content.chmod(0o644)
    content.write_bytes(b"c0ntent")
    store.file("ab1", make)
    assert make.count == 2
    assert store.content(sha) == b"content"


def test_results_are_links_that_can_not_be_written_through(tmp_path: Path) -> None:
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())
    store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").stat().st_ino == (tmp_path / "c" / "content" / sha[:2] / sha).stat().st_ino
    assert (tmp_path / "a").stat().st_mode & 0o222 == 0


@pytest.mark.parametrize("number", [errno.EXDEV, errno.EPERM, errno.EMLINK, errno.EOPNOTSUPP])
def test_copies_where_links_fail(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())
    content = tmp_path / "c" / "content" / sha[:2] / sha
    before = content.stat().st_ino

    def refused(source: Path, target: Path) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(disk_module.os, "link", refused)
        store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"content"
    assert (tmp_path / "a").stat().st_nlink == 1
    # A file with as many links as there may be makes way for a fresh one, to which links succeed again.
    assert (content.stat().st_ino != before) == (number == errno.EMLINK)
    store.place(sha, tmp_path / "b")
    assert (tmp_path / "b").stat().st_ino == content.stat().st_ino


def test_no_room_in_the_cache_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = DiskStore(tmp_path / "c")

    def full(self: Path, data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        sha = store.file("ab1", Made())
        assert data_of(store, "ab2", lambda: 5) == 5
    assert store.content(sha) == b"content"
    store.place(sha, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"content"
    assert not list((tmp_path / "c" / "tmp").iterdir())


def test_many_processes_make_each_key_once(tmp_path: Path) -> None:
    root, context = tmp_path / "c", multiprocessing.get_context("spawn")
    with context.Pool(4) as pool:
        found = pool.starmap(_make_all, [(root, tmp_path / "log")] * 8)
    assert len({tuple(shas) for shas in found}) == 1
    made = (tmp_path / "log").read_text().split()
    assert sorted(made) == sorted(set(made))
    assert not list((root / "locks").iterdir())
    assert not list((root / "tmp").iterdir())


def _make_all(root: Path, log: Path) -> list[str]:
    store = DiskStore(root)

    def make(i: int) -> bytes:
        with open(log, "a") as file:
            file.write(f"{i}\n")
        time.sleep(0.01)
        return f"content {i}".encode() * 1000

    return [store.file(f"{i:02d}key", lambda i=i: make(i)) for i in range(20)]


def test_a_lock_of_a_killed_process_is_no_obstacle(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    child = context.Process(target=_never_ends, args=(tmp_path / "c", tmp_path / "in"))
    child.start()
    while not (tmp_path / "in").exists():
        time.sleep(0.01)
    child.kill()
    child.join()
    assert data_of(DiskStore(tmp_path / "c"), "ab1", lambda: 7) == 7


def _never_ends(root: Path, mark: Path) -> None:
    def make() -> None:
        mark.touch()
        time.sleep(600)

    data_of(DiskStore(root), "ab1", make)


def test_collecting_removes_what_was_used_longest_ago(tmp_path: Path) -> None:
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


def test_collecting_spares_what_somebody_is_using(tmp_path: Path) -> None:
    store = DiskStore(tmp_path / "c")
    sha = store.file("ab1", Made())
    assert collect(tmp_path / "c", 0).entries == 0
    assert store.has(sha)
    store.close()
    assert collect(tmp_path / "c", 0).entries == 1


def test_locks_that_dead_processes_left_are_no_users(tmp_path: Path) -> None:
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


@pytest.mark.parametrize(
    ("system", "folder"),
    [("unix", ".cache/unitcad"), ("macos", "Library/Caches/unitcad"), ("windows", "Local/unitcad/Cache")],
)
def test_the_cache_lies_where_each_system_keeps_caches(system, folder, tmp_path: Path, monkeypatch) -> None:
    module = importlib.import_module(f"platformdirs.{system}")
    kind = {"unix": "Unix", "macos": "MacOS", "windows": "Windows"}[system]
    monkeypatch.setattr(platformdirs, "PlatformDirs", getattr(module, kind))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("UNITCAD_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    if system == "windows":
        monkeypatch.setattr(module, "get_win_folder", lambda name: str(tmp_path / "Local"))
    assert default_root() == tmp_path / folder


def test_the_cache_of_a_person_without_a_home_is_refused(monkeypatch) -> None:
    for name in ("HOME", "UNITCAD_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    with pytest.raises(UnitcadError, match="UNITCAD_CACHE"):
        default_root()


def test_on_windows_no_content_is_read_only(tmp_path: Path, monkeypatch) -> None:
    store = DiskStore(tmp_path / "c")
    for system, mode in (("win32", 0o200), ("linux", 0)):
        with monkeypatch.context() as faked:
            faked.setattr("unitcad.cache.disk.sys.platform", system)
            sha = store.keep(system.encode())
        assert (tmp_path / "c" / "content" / sha[:2] / sha).stat().st_mode & 0o222 & 0o200 == mode


def test_a_folder_of_others_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("keep")
    (tmp_path / "file").write_text("keep")
    for root in ("mine", "file"):
        with pytest.raises(UnitcadError, match="--cache"):
            DiskStore(tmp_path / root)
    with pytest.raises(UnitcadError, match="no cache"):
        collect(tmp_path / "mine", 0)
    assert (tmp_path / "mine" / "letter.txt").read_text() == "keep"


def test_a_bundle_spares_the_work_but_not_the_content(tmp_path: Path) -> None:
    first = MemoryStore()
    sha = first.file("ab1", Made())
    data_of(first, "ab2", lambda: {"files": [sha]})
    bundle = first.bundle()
    assert json.dumps(vars(bundle))
    second = MemoryStore(bundle)
    assert second.file("ab1", lambda: pytest.fail("known")) == sha
    assert (
        data_of(second, "ab2", lambda: pytest.fail("known"), intact=lambda d: all(map(second.has, d["files"])))
        is not None
    )
    assert second.contents == {}


FAR = 4_000_000_000  # seconds: in the year 2096


def test_what_has_a_time_that_is_yet_to_come_is_collected(tmp_path: Path) -> None:
    root = tmp_path / "c"
    store = DiskStore(root)
    for i in range(4):
        store.file(f"k{i}", Made(bytes([i]) * 1000))
    for path in (root / "files" / "k1" / "k1", *(root / "content").rglob("*")):
        os.utime(path, (FAR, FAR), follow_symlinks=False)
    # In use by somebody too: a time to come does not say that it was used just now.
    entry = (root / "files" / "k1" / "k1").stat().st_size
    assert collect(root, 3 * (1000 + entry)).entries == 1
    assert not (root / "files" / "k1" / "k1").exists()
    store.close()
    assert collect(root, 0).entries == 3
    assert usage(root).bytes == 0


KINDS = ["link to the same", "link to another", "link to nothing", "folder", "full folder", "pipe"]


def _replaced(path: Path, kind: str, outside: Path) -> None:
    """Put something else in a file's place."""
    content = path.read_bytes()
    path.unlink()
    match kind:
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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("what", ["content", "entry"])
@pytest.mark.parametrize("running", [True, False], ids=["running", "anew"])
def test_what_is_not_a_regular_file_is_made_again(kind: str, what: str, running: bool, tmp_path: Path) -> None:
    root, make = tmp_path / "c", Made()
    store = DiskStore(root)
    sha = store.file("ab1", make)
    path = root / "content" / sha[:2] / sha if what == "content" else root / "files" / "ab" / "ab1"
    _replaced(path, kind, tmp_path / "outside")
    if not running:
        store = DiskStore(root)
    assert store.file("ab1", make) == sha
    assert make.count == 2
    store.place(sha, tmp_path / "result")
    assert not (tmp_path / "result").is_symlink()
    assert (tmp_path / "result").read_bytes() == b"content"
    assert path.is_file()
    assert not path.is_symlink()
    assert usage(root).entries == 1
    store.close()
    _replaced(path, kind, tmp_path / "outside2")
    collect(root, 0)
    assert store.file("ab1", make) == sha


@pytest.mark.parametrize("kind", ["data", "file"])
def test_an_entry_under_another_key_does_not_count(kind: str, tmp_path: Path) -> None:
    """Moved by hand or by a damaged file system: whole in itself, and the verdict on another part."""
    store = DiskStore(tmp_path / "c")
    if kind == "data":
        data_of(store, "ab1", lambda: {"status": "ok"})
        data_of(store, "ab2", lambda: {"status": "broken"})
    else:
        store.file("ab1", Made(b"one"))
        store.file("ab2", Made(b"two"))
    folder = tmp_path / "c" / ("data" if kind == "data" else "files") / "ab"
    (folder / "ab2").write_bytes((folder / "ab1").read_bytes())
    again = DiskStore(tmp_path / "c")
    if kind == "data":
        assert data_of(again, "ab2", lambda: {"status": "broken"}) == {"status": "broken"}
    else:
        assert again.content(again.file("ab2", Made(b"two"))) == b"two"
    assert dict(again.counts) == {f"{kind} built": 1, "damaged": 1}


@pytest.mark.parametrize("what", ["", "tmp", "locks", "content", "files", "data", "unitcad-cache"])
def test_what_is_cleared_away_under_a_store_comes_back(what: str, tmp_path: Path) -> None:
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

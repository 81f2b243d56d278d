"""The store in a folder, shared by any number of processes and threads."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import sys
import threading
import time
import uuid
import weakref
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import platformdirs
from filelock import FileLock

from unitcad.cache.store import MissingContent, T, digest
from unitcad.documents import parse_json
from unitcad.errors import UnitcadError
from unitcad.files import regular, write_new

MARK = "unitcad-cache"
GATE = "unitcad-cache.lock"
"""The lock of a store that opens, and of the one process that collects."""
FOLDERS = ("data", "files", "content", "locks", "tmp")
_POLL_S = 0.01
_CLAIMS, _CLAIM_S = 40, 0.05
"""How often a cache that is being deleted is tried, and the pause between, s."""


class DiskStore:
    """A store in a folder.

    Entries are written under a temporary name and renamed. Each process verifies the checksum of an entry whenever it
    reads it, that of content on first use, and watches the content's size and time of change afterwards; whatever does
    not match is removed and made again. An entry that can't be written (no space, read-only) is no error: the content
    is held in memory for this process instead.
    """

    def __init__(self, root: Path) -> None:
        self.root = Path(root)
        self.counts: Counter[str] = Counter()
        self._verified: dict[str, tuple[int, int, int]] = {}
        self._touched: dict[Path, float] = {}
        self._held: dict[str, bytes] = {}
        _claim(self.root)
        # Held while the store lives: see `collect`.
        taken = lock(self.root / "locks" / f"open-{uuid.uuid4().hex}")
        with contextlib.suppress(OSError), lock(self.root / GATE):
            taken.acquire()
        self._release = weakref.finalize(self, release, taken)

    def close(self) -> None:
        """Release the folder: others may then collect everything."""
        self._release()

    def __reduce__(self) -> tuple[type[DiskStore], tuple[Path]]:
        return DiskStore, (self.root,)

    def data(self, key: str, make: Callable[[], T], *, intact: Callable[[T], bool] = lambda data: True) -> T:
        return self._entry("data", key, make, intact)

    def file(self, key: str, make: Callable[[], bytes]) -> str:
        def kept() -> dict[str, Any]:
            content = make()
            return {"sha256": self.keep(content), "size": len(content)}

        return self._entry("file", key, kept, lambda data: self.has(data["sha256"]))["sha256"]

    def has(self, sha256: str) -> bool:
        if sha256 in self._held:
            return True
        try:
            path = self._content_path(sha256)
            now = _signature(path)
            if self._verified.get(sha256) == now:
                return True
            if digest(read(path)) == sha256:
                self._verified[sha256] = now
                return True
        except OSError:
            return False
        except UnitcadError:  # a link, a pipe or a folder
            pass
        self._verified.pop(sha256, None)
        remove(self._content_path(sha256))
        self.counts["damaged"] += 1
        return False

    def keep(self, content: bytes) -> str:
        """Keep content; returns its SHA-256 (hex)."""
        sha256 = digest(content)
        if not self.has(sha256):
            path = self._content_path(sha256)
            try:
                self._write(path, content, shared=True)
                self._verified[sha256] = _signature(path)
            except OSError:
                self._held[sha256] = content
        return sha256

    def size(self, sha256: str) -> int:
        if sha256 in self._held:
            return len(self._held[sha256])
        # Verified contents are not checked again here: `place` checks it, and content has one size.
        if sha256 not in self._verified and not self.has(sha256):
            raise self._missing(sha256)
        return self._verified[sha256][1]

    def content(self, sha256: str) -> bytes:
        if not self.has(sha256):
            raise self._missing(sha256)
        if sha256 in self._held:
            return self._held[sha256]
        try:
            return read(self._content_path(sha256))
        except (OSError, UnitcadError):
            raise self._missing(sha256) from None

    def place(self, sha256: str, target: str | os.PathLike[str]) -> None:
        """Make a hard link at `target`; a copy if links fail (other disk, no right, no support)."""
        if not self.has(sha256):
            raise self._missing(sha256)
        if sha256 in self._held:
            write_new(target, self._held[sha256], sync=True)
            return
        try:
            os.link(self._content_path(sha256), target)
            return
        except FileNotFoundError:
            if not Path(target).parent.is_dir():
                raise
            raise self._missing(sha256) from None
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EEXIST):
                raise
        write_new(target, self.content(sha256), sync=True)

    def _entry(self, kind: str, key: str, make: Callable[[], T], intact: Callable[[T], bool]) -> T:
        path = self._path(kind, key)
        found = self._read(kind, key, intact)
        if found is None:
            with held(self.root / "locks" / key):
                found = self._read(kind, key, intact)  # another process may have made it in the meantime
                if found is None:
                    payload = json.dumps(make(), ensure_ascii=False, allow_nan=False).encode()
                    with contextlib.suppress(OSError):
                        self._write(path, _checksum(kind, key, payload) + b"\n" + payload)
                    self.counts[f"{kind} built"] += 1
                    return parse_json(payload, str(path))  # as the next reader gets it
        self.counts[f"{kind} reused"] += 1
        self._touch(path)
        return found

    def _read(self, kind: str, key: str, intact: Callable[[Any], bool]) -> Any:
        """Return an entry's data, or None; an entry that is damaged or was written for another key is removed."""
        path = self._path(kind, key)
        try:
            checksum, _, payload = read(path).partition(b"\n")
        except OSError:
            return None
        except UnitcadError:
            checksum = payload = b""
        if _checksum(kind, key, payload) == checksum:
            data = parse_json(payload, str(path))
            return data if intact(data) else None
        remove(path)
        self.counts["damaged"] += 1
        return None

    def _touch(self, path: Path) -> None:
        """Note that an entry is in use, at most once a minute."""
        now = time.time()
        if now - self._touched.get(path, 0.0) > 60:
            self._touched[path] = now
            with contextlib.suppress(OSError):
                os.utime(path)

    def _write(self, path: Path, content: bytes, shared: bool = False) -> None:
        """Write a file whole; shared files are read-only, and on the disk when this ends. Raises OSError."""
        try:
            self._put(path, content, shared)
        except (FileNotFoundError, NotADirectoryError):  # the cache was removed meanwhile
            with contextlib.suppress(UnitcadError):
                _claim(self.root)
            self._put(path, content, shared)

    def _put(self, path: Path, content: bytes, shared: bool) -> None:
        fresh = self.root / "tmp" / f"{path.name[:20]}-{os.getpid()}-{threading.get_ident()}"
        try:
            remove(fresh)
            with open(fresh, "xb") as file:
                file.write(content)
                if shared:
                    file.flush()
                    os.fsync(file.fileno())
            if shared and sys.platform != "win32":  # Windows neither replaces nor removes a read-only file
                fresh.chmod(fresh.stat().st_mode & 0o444)
            path.parent.mkdir(exist_ok=True)
            fresh.replace(path)
        except OSError:
            remove(fresh)
            raise

    def _missing(self, sha256: str) -> MissingContent:
        return MissingContent(f"content {sha256[:12]} is not in {self.root}")

    def _path(self, kind: str, key: str) -> Path:
        return self.root / ("data" if kind == "data" else "files") / key[:2] / key

    def _content_path(self, sha256: str) -> Path:
        return self.root / "content" / sha256[:2] / sha256


def default_root() -> Path:
    """Return UNITCAD_CACHE, or unitcad in the user's cache folder, on this system.

    Raises UnitcadError if there is no home.
    """
    chosen = os.environ.get("UNITCAD_CACHE")
    if chosen:
        return Path(chosen)
    try:
        return platformdirs.user_cache_path("unitcad", appauthor=False)
    except RuntimeError:
        raise UnitcadError("there is no home folder; choose the cache's with --cache or UNITCAD_CACHE") from None


def read(path: Path) -> bytes:
    """Return the content of a regular file of the cache. Raises OSError; UnitcadError for a link, a pipe, a folder."""
    with open(path, "rb", opener=regular(links=False)) as file:
        return file.read()


def remove(path: Path) -> None:
    """Remove a file, a link or a whole folder at the place of a cache file; nothing if that fails."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        if not path.is_symlink() and path.is_dir():
            shutil.rmtree(path, ignore_errors=True)


def _checksum(kind: str, key: str, payload: bytes) -> bytes:
    """Return an entry's checksum, bound to its key: another key's entry does not match."""
    return digest(f"{kind} {key}\n".encode() + payload).encode()


def _signature(path: Path) -> tuple[int, int, int]:
    stat = os.lstat(path)
    return stat.st_ino, stat.st_size, stat.st_mtime_ns


def _claim(root: Path) -> None:
    """Make a folder a cache, or refuse one with other contents.

    A cache that another process is deleting has lost its mark and some of its folders: it is waited for.
    """
    for left in reversed(range(_CLAIMS)):
        if _claimed(root, last=not left):
            return
        time.sleep(_CLAIM_S)


def _claimed(root: Path, last: bool) -> bool:
    """Make a folder a cache; False for one that may be half deleted, which is refused at the `last` try."""
    try:
        root.mkdir(parents=True, exist_ok=True)
        if not (root / MARK).exists():
            # A process that claims the folder at the same time writes the mark first.
            others = {path.name for path in root.iterdir()} - {MARK, GATE}
            if others not in (set(), set(FOLDERS)) and not (root / MARK).exists():
                if others <= set(FOLDERS) and not last:
                    return False
                raise UnitcadError(f"{root}: is not a cache of unitcad, and not empty; choose another with --cache")
            (root / MARK).write_text("unitcad keeps shared results here; it may be deleted at any time\n", "utf-8")
        for name in FOLDERS:
            (root / name).mkdir(exist_ok=True)
        return True
    except (FileExistsError, NotADirectoryError):
        raise UnitcadError(f"{root}: is a file, not a folder; choose another with --cache") from None
    except OSError as error:
        if isinstance(error, FileNotFoundError) and not last:
            return False
        raise UnitcadError(f"{root}: can't be used as a cache: {error.strerror}") from None


def lock(path: Path) -> FileLock:
    """Return a lock on a file, not acquired yet; the system releases it when its process dies."""
    return FileLock(path, thread_local=False, poll_interval=_POLL_S)


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Lock for one thread of one process at a time; a process that dies releases it, and no file stays.

    If there can be no lock (read-only, no space, no folder) the block runs without: work may then be done twice.
    """
    taken = lock(path)
    if path.parent.is_dir():  # else the lock would make it, and a removed cache would look like another program's
        with contextlib.suppress(OSError):
            taken.acquire()
    try:
        yield
    finally:
        release(taken)


def is_free(path: Path) -> bool:
    """Tell whether the lock on a file is free; the file, left by a process that died, is then removed."""
    taken = lock(path)
    try:
        taken.acquire(blocking=False)
    except OSError:
        return False
    release(taken)
    return True


def release(taken: FileLock) -> None:
    """Release a lock and remove its file: whoever waits on it makes a new one."""
    if taken.is_locked:
        with contextlib.suppress(OSError):  # Windows: an open file stays until the lock removes it
            os.unlink(taken.lock_file)
        taken.release()


DEFAULT_LIMIT_MB = 4096
GRACE_S = 600.0
"""While another process has the cache open, entries used within this time are not collected."""


@dataclass(frozen=True)
class Usage:
    """The size of a cache; `bytes` of contents and entries together."""

    entries: int
    contents: int
    bytes: int


def usage(root: Path) -> Usage:
    """Return the usage of the cache at `root`. Raises UnitcadError if there is none."""
    _expect(root)
    entries, contents = _scan(root, "data") + _scan(root, "files"), _scan(root, "content")
    return Usage(len(entries), len(contents), sum(size for _, size, _ in entries + contents))


def collect(root: Path, limit_bytes: int) -> Usage:
    """Remove the entries used longest ago until at most `limit_bytes` are left; return the removed usage.

    While another process has the cache open, entries used within GRACE_S stay. Raises UnitcadError if there is no
    cache.
    """
    _expect(root)
    with contextlib.ExitStack() as held:
        alone = _alone(root, held)
        if alone:
            for left in (root / "tmp").glob("*"):
                remove(left)
        return _collect(root, limit_bytes, None if alone else time.time() - GRACE_S)


def _alone(root: Path, held: contextlib.ExitStack) -> bool:
    """Tell whether no other process has the cache open; none can then open it until `held` ends.

    Locks that processes left behind when they died are removed.
    """
    gate = lock(root / GATE)
    try:
        gate.acquire(blocking=False)
    except OSError:
        return False
    alone = all([is_free(path) for path in (root / "locks").glob("*")])
    if alone:
        held.callback(gate.release)
    else:
        gate.release()
    return alone


def _collect(root: Path, limit: int, newest: float | None) -> Usage:
    contents = {path.name: (path, size, used) for path, size, used in _scan(root, "content")}
    entries = sorted(_scan(root, "data") + _scan(root, "files"), key=lambda entry: (entry[2], entry[0]))
    held: dict[Path, list[str]] = {path: _contents_of(path) for path, _, _ in entries}
    holders = Counter(sha for shas in held.values() for sha in shas)
    total = sum(size for _, size, _ in entries) + sum(size for _, size, _ in contents.values())
    gone_entries = gone_contents = gone = 0

    def drop(sha: str) -> int:
        path, size, used = contents.get(sha, (None, 0, 0.0))
        if path is None or (newest is not None and used > newest):
            return 0
        remove(path)
        return size

    for sha in [sha for sha in contents if sha not in holders]:
        size = drop(sha)
        gone_contents, gone = gone_contents + bool(size), gone + size
    for path, size, used in entries:
        if total - gone <= limit or (newest is not None and used > newest):
            break
        remove(path)
        gone_entries, gone = gone_entries + 1, gone + size
        for sha in held[path]:
            holders[sha] -= 1
            if not holders[sha]:
                size = drop(sha)
                gone_contents, gone = gone_contents + bool(size), gone + size
    return Usage(gone_entries, gone_contents, gone)


def _contents_of(entry: Path) -> list[str]:
    """Return the contents that an entry of a file refers to; an entry of data refers to none."""
    if entry.parent.parent.name != "files":
        return []
    try:
        return [parse_json(read(entry).partition(b"\n")[2], str(entry))["sha256"]]
    except (OSError, UnitcadError, ValueError, KeyError, TypeError):
        return []


def _scan(root: Path, kind: str) -> list[tuple[Path, int, float]]:
    """List files of a kind: path, size, time of last use; one whose time is yet to come counts as the oldest."""
    entries, latest = [], time.time() + GRACE_S
    for folder, _, names in os.walk(root / kind):
        for name in names:
            path = Path(folder) / name
            with contextlib.suppress(OSError):
                stat = path.lstat()
                entries.append((path, stat.st_size, stat.st_mtime if stat.st_mtime <= latest else 0.0))
    return entries


def _expect(root: Path) -> None:
    if not (root / MARK).is_file():
        raise UnitcadError(f"{root}: there is no cache of unitcad here")

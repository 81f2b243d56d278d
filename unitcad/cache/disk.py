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
from pathlib import Path
from typing import Any

import platformdirs
from filelock import FileLock

from unitcad.cache.store import Intact, Make, MissingContent, digest
from unitcad.errors import UnitcadError

MARK = "unitcad-cache"
GATE = "unitcad-cache.lock"
"""Held while a store comes in, and while one process collects alone."""
_POLL_S = 0.01


class DiskStore:
    """A store in a folder, shared by any number of processes and threads.

    Entries are written under a temporary name and renamed. Each process verifies a content's checksum on first use and
    watches its size and time of change afterwards; whatever does not match is removed and made again. An entry that
    can't be written (no space, read-only) is no error: the content is held in memory for this process instead.
    """

    def __init__(self, root: Path) -> None:
        self.root = Path(root)
        self.counts: Counter[str] = Counter()
        self._verified: dict[str, tuple[int, int, int]] = {}
        self._touched: dict[Path, float] = {}
        self._held: dict[str, bytes] = {}
        _claim(self.root)
        # Held while the store lives: see `collect`.
        held = lock(self.root / "locks" / f"open-{uuid.uuid4().hex}")
        with contextlib.suppress(OSError), lock(self.root / GATE):
            held.acquire()
        self._let_go = weakref.finalize(self, let_go, held)

    def close(self) -> None:
        """Let go of the folder: others may collect everything."""
        self._let_go()

    def __reduce__(self) -> tuple[type[DiskStore], tuple[Path]]:
        return DiskStore, (self.root,)

    def data(self, key: str, make: Make, intact: Intact = lambda data: True) -> Any:
        return self._entry("data", key, make, intact)

    def file(self, key: str, make: Callable[[], bytes]) -> str:
        def stored() -> dict[str, Any]:
            content = make()
            return {"sha256": self.keep(content), "size": len(content)}

        return self._entry("file", key, stored, lambda entry: self.has(entry["sha256"]))["sha256"]

    def has(self, sha256: str) -> bool:
        if sha256 in self._held:
            return True
        path = self._content_path(sha256)
        try:
            now = _signature(path)
            if self._verified.get(sha256) == now:
                return True
            if digest(path.read_bytes()) == sha256:
                self._verified[sha256] = now
                return True
        except OSError:
            return False
        self._verified.pop(sha256, None)
        path.unlink(missing_ok=True)
        self.counts["damaged"] += 1
        return False

    def keep(self, content: bytes) -> str:
        """Keep content; returns its SHA-256 (hex)."""
        sha256 = digest(content)
        if not self.has(sha256):
            path = self._content_path(sha256)
            try:
                self._write(path, content, read_only=True)
                self._verified[sha256] = _signature(path)
            except OSError:
                self._held[sha256] = content
        return sha256

    def content(self, sha256: str) -> bytes:
        if not self.has(sha256):
            raise MissingContent(f"content {sha256[:12]} is not in {self.root}")
        if sha256 in self._held:
            return self._held[sha256]
        return self._content_path(sha256).read_bytes()

    def place(self, sha256: str, target: Path) -> None:
        """A hard link at `target`; a copy where links fail (other disk, no right, no support)."""
        if not self.has(sha256):
            raise MissingContent(f"content {sha256[:12]} is not in {self.root}")
        if sha256 in self._held:
            target.write_bytes(self._held[sha256])
            return
        source = self._content_path(sha256)
        try:
            os.link(source, target)
            return
        except FileNotFoundError:
            if not target.parent.is_dir():
                raise
            raise MissingContent(f"content {sha256[:12]} is not in {self.root}") from None
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EEXIST):
                raise
            full = error.errno == errno.EMLINK
        shutil.copyfile(source, target)
        if full:
            # As many links as the file system allows: a fresh file takes the entry's place and the next ones.
            with contextlib.suppress(OSError):
                self._write(source, target.read_bytes(), read_only=True)
                self._verified[sha256] = _signature(source)

    def peek(self, key: str) -> Any:
        """The data under `key`, or None."""
        return self._read(self._path("data", key), lambda data: True)

    def forget(self, key: str) -> None:
        """Remove the entry of a key."""
        for kind in ("data", "file"):
            self._path(kind, key).unlink(missing_ok=True)

    def _entry(self, kind: str, key: str, make: Make, intact: Intact) -> Any:
        path = self._path(kind, key)
        found = self._read(path, intact)
        if found is None:
            with self._lock(key):
                found = self._read(path, intact)  # somebody may have made it while we waited
                if found is None:
                    made = make()
                    payload = json.dumps(made, ensure_ascii=False, allow_nan=False).encode()
                    with contextlib.suppress(OSError):
                        self._write(path, digest(payload).encode() + b"\n" + payload)
                    self.counts[f"{kind} built"] += 1
                    return json.loads(payload)
        self.counts[f"{kind} reused"] += 1
        self._touch(path)
        return found

    def _read(self, path: Path, intact: Intact) -> Any:
        """An entry's data, or None; what is damaged is removed."""
        try:
            checksum, _, payload = path.read_bytes().partition(b"\n")
        except OSError:
            return None
        if digest(payload).encode() == checksum:
            data = json.loads(payload)
            return data if intact(data) else None
        path.unlink(missing_ok=True)
        self.counts["damaged"] += 1
        return None

    def _touch(self, path: Path) -> None:
        """Note that an entry is in use, at most once a minute."""
        now = time.time()
        if now - self._touched.get(path, 0.0) > 60:
            self._touched[path] = now
            with contextlib.suppress(OSError):
                os.utime(path)

    def _write(self, path: Path, content: bytes, read_only: bool = False) -> None:
        fresh = self.root / "tmp" / f"{path.name[:20]}-{os.getpid()}-{threading.get_ident()}"
        try:
            fresh.write_bytes(content)
            if read_only and sys.platform != "win32":  # Windows neither replaces nor removes a read-only file
                fresh.chmod(fresh.stat().st_mode & 0o444)
            path.parent.mkdir(exist_ok=True)
            fresh.replace(path)
        except OSError:
            fresh.unlink(missing_ok=True)
            raise

    @contextlib.contextmanager
    def _lock(self, key: str) -> Iterator[None]:
        """Held by one thread of one process at a time; a process that dies lets go of it."""
        held = lock(self.root / "locks" / key)
        try:
            held.acquire()
        except OSError:  # read-only, or no space: better twice than not at all
            yield
            return
        try:
            yield
        finally:
            let_go(held)

    def _path(self, kind: str, key: str) -> Path:
        return self.root / ("data" if kind == "data" else "files") / key[:2] / key

    def _content_path(self, sha256: str) -> Path:
        return self.root / "content" / sha256[:2] / sha256


def default_root() -> Path:
    """UNITCAD_CACHE, or unitcad in the person's cache folder, where the system keeps such folders.

    Raises UnitcadError where there is no home.
    """
    chosen = os.environ.get("UNITCAD_CACHE")
    if chosen:
        return Path(chosen)
    try:
        return platformdirs.user_cache_path("unitcad", appauthor=False)
    except RuntimeError:
        raise UnitcadError("there is no home folder; choose the cache's with --cache or UNITCAD_CACHE") from None


def _signature(path: Path) -> tuple[int, int, int]:
    stat = path.stat()
    return stat.st_ino, stat.st_size, stat.st_mtime_ns


def _claim(root: Path) -> None:
    """Make the folder ours, or refuse one that holds something else."""
    try:
        root.mkdir(parents=True, exist_ok=True)
        if not (root / MARK).exists():
            # Whoever claims the folder at the same time as we do writes the mark first.
            if any(path.name != MARK for path in root.iterdir()) and not (root / MARK).exists():
                raise UnitcadError(f"{root}: is not a cache of unitcad, and not empty; choose another with --cache")
            (root / MARK).write_text("unitcad keeps shared results here; it may be deleted at any time\n", "utf-8")
        for name in ("data", "files", "content", "locks", "tmp"):
            (root / name).mkdir(exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise UnitcadError(f"{root}: is a file, not a folder; choose another with --cache") from None
    except OSError as error:
        raise UnitcadError(f"{root}: can't be used as a cache: {error.strerror}") from None


def lock(path: Path) -> FileLock:
    """A lock on a file, not taken yet; the system lets go of it when its process dies."""
    return FileLock(path, thread_local=False, poll_interval=_POLL_S)


def let_go(held: FileLock) -> None:
    """Release a lock and remove its file: whoever waits on it makes a new one."""
    if held.is_locked:
        with contextlib.suppress(OSError):  # Windows: an open file stays until the lock itself removes it
            os.unlink(held.lock_file)
        held.release()

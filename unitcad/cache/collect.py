"""Usage of a cache on disk, and removal of the entries used longest ago."""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from unitcad.cache.disk import GATE, MARK, free, lock, read, remove
from unitcad.errors import UnitcadError

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
    alone = all([free(path) for path in (root / "locks").glob("*")])
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
        return [json.loads(read(entry).partition(b"\n")[2])["sha256"]]
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

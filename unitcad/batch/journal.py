"""The batch's own record of what is done: one line a variant, appended as it ends, so that a kill loses nothing.

<out>/batch.lock      held while a batch runs: a second one in the same folder is refused
<out>/journal.jsonl   a head that says which batch this is, then a line a finished variant; the last one counts
"""

from __future__ import annotations

import json
import os
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from unitcad.errors import UnitcadError

JOURNAL, LOCK = "journal.jsonl", "batch.lock"
NOT_THERE = -1


class Journal:
    """The journal of one output folder, open and locked. `done(index)` says whether a variant was ended well before.

    Raises UnitcadError for a folder that isn't ours, that holds another batch, or in which a batch is running.
    """

    def __init__(self, out: Path, head: dict[str, Any]) -> None:
        self.out = out
        self._lock = _lock(out)
        self._lines = array("q")
        self.counts: dict[str, int] = {}
        path = out / JOURNAL
        try:
            fresh = not path.exists() or not _fits(path, head)
        except BaseException:
            self._lock.release()
            raise
        self._file = open(path, "ab+" if not fresh else "wb+")  # noqa: SIM115
        if fresh:
            self._append(head)
        else:
            self._scan()

    def done(self, index: int) -> bool:
        """Whether a variant is finished, with or without a broken law, and its folder is there."""
        entry = self.entry(index)
        if entry is None or entry["status"] not in ("ok", "broken"):
            return False
        return (self.out / entry["folder"] / "manifest.json").is_file() if entry.get("folder") else True

    def add(self, entry: dict[str, Any]) -> None:
        """Write one variant's end. Raises OSError."""
        self._note(entry["index"], self._append(entry))

    def entry(self, index: int) -> dict[str, Any] | None:
        """What was written last of a variant; a variant equal to an earlier one gets that one's entry."""
        if index >= len(self._lines) or self._lines[index] == NOT_THERE:
            return None
        self._file.seek(self._lines[index])
        found = json.loads(self._file.readline())
        if "same_as" in found:
            other = self.entry(found["same_as"])
            return None if other is None else {**other, "index": index, "values": found["values"]}
        return found

    def entries(self) -> Iterator[dict[str, Any]]:
        """Every variant's entry in the sweep's order, read one by one."""
        return (entry for index in range(len(self._lines)) if (entry := self.entry(index)) is not None)

    def close(self) -> None:
        """Let go of the folder."""
        self._file.close()
        self._lock.release()

    def _append(self, entry: dict[str, Any]) -> int:
        start = self._file.seek(0, os.SEEK_END)
        self._file.write(json.dumps(entry, ensure_ascii=False, allow_nan=False).encode() + b"\n")
        self._file.flush()
        return start

    def _note(self, index: int, offset: int) -> None:
        while len(self._lines) <= index:
            self._lines.append(NOT_THERE)
        self._lines[index] = offset

    def _scan(self) -> None:
        """Find every line; a last one that a kill tore is cut off."""
        self._file.seek(0)
        offset = len(self._file.readline())
        while line := self._file.readline():
            try:
                self._note(json.loads(line)["index"], offset)
            except (ValueError, KeyError):
                self._file.truncate(offset)
                break
            offset += len(line)


def _lock(out: Path) -> FileLock:
    lock = FileLock(out / LOCK, blocking=False, thread_local=False)
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not (out / JOURNAL).exists() and any(path.name != LOCK for path in out.iterdir()):
            raise UnitcadError(f"{out}: holds something that is no batch's result; choose another folder with -o")
        lock.acquire()
    except (FileExistsError, NotADirectoryError):
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o") from None
    except Timeout:
        raise UnitcadError(
            f"{out}: another batch is running in this folder; wait for it or choose another with -o"
        ) from None
    except OSError as error:
        raise UnitcadError(f"{out}: can't be written: {error.strerror}") from None
    return lock


def _fits(path: Path, head: dict[str, Any]) -> bool:
    """Whether a journal is this batch's; False where it is, but of another version of the code.

    Raises UnitcadError where the folder holds another batch.
    """
    with open(path, "rb") as file:
        line = file.readline()
    if not line.strip():
        return False
    try:
        there = json.loads(line)
        batch, name = there["batch"], there["name"]
    except (ValueError, KeyError, TypeError):
        raise UnitcadError(f"{path}: is no journal of a batch; choose another folder with -o") from None
    if batch != head["batch"]:
        raise UnitcadError(
            f"{path.parent}: holds another batch ({name}, or the same with other values or options); "
            "choose another folder with -o, or delete it"
        )
    return there == head

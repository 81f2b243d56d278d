"""The record of finished variants: one line a variant, appended as it ends, so that a kill loses nothing.

<out>/batch.lock                locked while a batch runs: a second one in the same folder is refused
<out>/journal.jsonl             a head that says which batch this is, then a line a finished variant; the last one counts
<out>/batch-3-of-16.lock        the same of a shard; shards of one batch run at the same time
<out>/journal-3-of-16.jsonl
<out>/merge.lock                locked while a shard merges the journals

Each line ends with a checksum over itself and over the batch's identity. unitcad skips damaged lines and those of
another batch, and checks their variants again.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from filelock import FileLock, Timeout
from msgspec import Struct, ValidationError, convert, field, structs, to_builtins

from unitcad import files
from unitcad.documents import parse_json, read_json
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.pipeline.plan import code_version
from unitcad.sweeps.shard import Shard

Values = dict[str, Any]
"""Values of one variant by dotted path of the spec, or by column of the table."""


class BatchHead(Struct, frozen=True, kw_only=True):
    """Identity of a batch, at the head of its journal and of its table; `batch` is a hash over all that decides it."""

    batch: str
    name: str
    mode: str = "product"
    bases: list[str] = []
    outputs: list[str] = []
    versions: dict[str, str] = {}


class JournalEntry(Struct, frozen=True, omit_defaults=True):
    """Result of one variant; `same_as` is the index of an earlier, equal variant, whose result it shares.

    `values` are those that were swept, `row` those that came out; `manifest` is the SHA-256 of its manifest.json. No
    line has the last two: the time that it took, s, and whether the cache had all its parts.
    """

    index: int
    status: str = ""
    reason: str = ""
    folder: str = ""
    values: Values = {}
    row: Values = {}
    manifest: str = ""
    same_as: int | None = None
    seconds: float = 0.0
    reused: bool = False


class Failure(Struct, frozen=True):
    """A variant that was refused, failed or broke a rule, and why."""

    index: int
    status: str
    reason: str
    folder: str = ""


class Summary(Struct):
    """Outcome of a batch: variants by outcome, geometries, seconds; `stopped` is the reason of an early end.

    `resumed` counts variants that an earlier run finished, and those that equal another one.
    """

    variants: int
    done: int = 0
    resumed: int = field(default=0, name="taken_up")
    reused: int = 0
    ok: int = 0
    failed: int = 0
    geometries: int = 0
    retried: int = 0
    seconds: float = 0.0
    stopped: str = ""
    failures: list[Failure] = []
    warnings: list[str] = []


JOURNAL, LOCK, MERGE, TABLE = "journal.jsonl", "batch.lock", "merge.lock", "batch.json"
_OF_SHARD = "-*-of-*"


class Journal:
    """The journal of one output folder or of a shard in it, open and locked; `damaged` counts the skipped lines.

    It begins with the lines of every journal in the folder. A shard that ends opens it to `merge`: the shard's own lock
    then keeps a batch out. Raises UnitcadError for a folder that isn't ours, that has another batch, or in which a batch
    is running.
    """

    def __init__(self, out: Path, head: BatchHead, shard: Shard | None = None, *, merge: bool = False) -> None:
        self.out, self.path = out, out / of_shard(JOURNAL, shard)
        self.head = {**to_builtins(head), "code": code_version()}
        self._seed = zlib.crc32(_text(self.head))
        self._starts: dict[int, int] = {}  # of each variant's last line
        self.damaged = 0
        self._lock = _lock(out, head, shard, merge)
        try:
            self._file = self._open(self.path)
            if not shard and not merge:
                self._absorb()
        except BaseException:
            self._lock.release()
            raise

    def add(self, entry: JournalEntry) -> None:
        """Write the result of one variant. Raises OSError."""
        start = self._file.seek(0, os.SEEK_END)
        self._file.write(_pack(to_builtins(structs.replace(entry, seconds=0.0, reused=False)), self._seed))
        self._file.flush()
        self._starts[entry.index] = start

    def entry(self, index: int) -> JournalEntry | None:
        """Return the last entry of a variant; a variant equal to another one gets that one's entry."""
        own = self._own(index)
        if own is None or own.same_as is None:
            return own
        other = self._own(own.same_as)
        if other is None or other.same_as is not None:
            return None
        return structs.replace(other, index=index, values=own.values)

    def entries(self) -> Iterator[JournalEntry]:
        """Yield every variant's entry in the sweep's order, read one by one."""
        return (entry for index in sorted(self._starts) if (entry := self.entry(index)) is not None)

    def close(self) -> None:
        """Let go of the folder."""
        self._file.close()
        self._lock.release()

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _own(self, index: int) -> JournalEntry | None:
        """Return the last line of a variant as it was written; None if there is none."""
        if index not in self._starts:
            return None
        self._file.seek(self._starts[index])
        return _entry(self._file.readline(), self._seed)

    def _open(self, path: Path) -> IO[bytes]:
        """Write the journal's file anew with the whole lines of this batch in all journals, and open it."""
        whole, shards = path.with_name(JOURNAL), _of_shards(path)
        earlier = [whole, *(shard for shard in shards if shard != path), *([path] if path != whole else [])]
        with files.writing(path, sync=True) as file:
            file.write(_pack(self.head, 0))
            for journal in earlier:  # the last line of a variant counts
                for line in self._earlier(journal) if os.path.lexists(journal) else ():
                    entry = _entry(line, self._seed)
                    if entry is not None:
                        self._starts[entry.index] = file.tell()
                        file.write(line)
                    elif journal == path:  # another shard may be at its last line
                        self.damaged += 1
        return open(path, "ab+")

    def _absorb(self) -> None:
        """Remove the journals of shards, whose lines this one has."""
        for shard in _of_shards(self.out / JOURNAL):
            shard.unlink(missing_ok=True)

    def _earlier(self, path: Path) -> Iterator[bytes]:
        """Yield the lines below the head of a journal of this batch; none of those of other code.

        Raises UnitcadError if the folder has another batch.
        """
        if path.is_symlink() or not path.is_file():
            raise UnitcadError(f"{path}: is not a file; choose another folder with -o")
        whole = _pack(self.head, 0)
        with open(path, "rb") as file:
            first = file.readline()
            there = _unpack(first, 0)
            if there is None:
                if not any(_entry(line, self._seed) for line in _lines(file)):
                    if first.strip(b"\0 \n") and not whole.startswith(first):
                        raise UnitcadError(
                            f"{path}: is no journal of a batch, or damaged in whole; choose another folder with -o, or "
                            "delete the journal to have finished variants checked again"
                        )
                    return
                self.damaged += 1
                file.seek(len(first))
            elif there["batch"] != self.head["batch"]:
                raise _another(path.parent, there["name"])
            elif there != self.head:
                return
            yield from _lines(file)


def _lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the rest of a file by lines; a last one without its line end gets one."""
    for line in file:
        yield line if line.endswith(b"\n") else line + b"\n"


def _text(data: dict[str, Any]) -> bytes:
    return json.dumps(data, ensure_ascii=False, allow_nan=False).encode()


def _pack(data: dict[str, Any], seed: int) -> bytes:
    """Return a line: JSON whose last key is the checksum of the keys before it."""
    text = _text(data)[:-1]
    return text + b', "crc": "%08x"}\n' % zlib.crc32(text, seed)


def _unpack(line: bytes, seed: int) -> dict[str, Any] | None:
    """Return the data of a line; None if it is damaged or of another batch."""
    text, _, _ = line.rpartition(b', "crc": "')
    if line != text + b', "crc": "%08x"}\n' % zlib.crc32(text, seed):
        return None
    return parse_json(text + b"}", "the journal")


def _entry(line: bytes, seed: int) -> JournalEntry | None:
    """Return the entry in a line; None if it is damaged, or something else."""
    data = _unpack(line, seed)
    try:
        return None if data is None else convert(data, JournalEntry)
    except ValidationError:
        return None


def _another(out: Path, name: str) -> UnitcadError:
    return UnitcadError(
        f"{out}: has another batch ({name}, or the same with other values or options); "
        "choose another folder with -o, or delete it"
    )


def of_shard(name: str, shard: Shard | None) -> str:
    """Return the name of a file of the whole batch or of a shard: "journal-3-of-16.jsonl"."""
    stem, dot, ending = name.partition(".")
    return f"{stem}-{shard}{dot}{ending}" if shard else name


def _of_shards(path: Path) -> list[Path]:
    """Return the files of all shards next to `path`, by their names."""
    stem, dot, ending = (JOURNAL if path.name.endswith(".jsonl") else LOCK).partition(".")
    return sorted(path.parent.glob(f"{stem}{_OF_SHARD}{dot}{ending}"))


def _lock(out: Path, head: BatchHead, shard: Shard | None, merge: bool) -> FileLock:
    lock = FileLock(out / (MERGE if merge else of_shard(LOCK, shard)), blocking=merge, thread_local=False)
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not (out / JOURNAL).exists() and not _of_shards(out / JOURNAL):
            _check_free(out, head)
        lock.acquire()
        # A batch and a shard each take their own lock first, so that at least one of them sees the other.
        running = [] if merge else [out / LOCK] if shard else _of_shards(out / LOCK)
        for other in running:
            with FileLock(other, blocking=False, thread_local=False):
                pass
    except (FileExistsError, NotADirectoryError):
        raise files.in_the_way(out) from None
    except Timeout:
        lock.release()
        raise UnitcadError(
            f"{out}: another batch is running in this folder; wait for it or choose another with -o"
        ) from None
    except OSError as error:
        raise WrongArgument("out", os.fspath(out), f"can't be written: {error.strerror}") from None
    return lock


def _check_free(out: Path, head: BatchHead) -> None:
    """Refuse a folder that is not empty and has no journal, unless its table names this batch."""
    locks = {LOCK, MERGE, *(path.name for path in _of_shards(out / LOCK))}
    if all(path.name in locks for path in out.iterdir()):
        return
    if not any((out / lock).exists() for lock in locks):
        raise UnitcadError(f"{out}: has files that are no batch's result; choose another folder with -o")
    try:
        there = read_json(out / TABLE, largest=files.LARGEST_TABLE, links=False)
        name, same = there["name"], there["batch"] == head.batch
    except (UnitcadError, KeyError, TypeError):
        return  # it was interrupted before there was a table
    if not same:
        raise _another(out, name)

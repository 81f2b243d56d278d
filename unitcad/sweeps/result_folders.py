"""The options of a batch, the destination that they ask for, and folders made from a store."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

from msgspec import MsgspecError
from msgspec.json import decode

from unitcad import files
from unitcad.cache import DEFAULT_LIMIT_MB, DiskStore, MissingContent, SharedStore, absolute
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.pipeline.write import STORE, placing, whole
from unitcad.spec.raw import OUTPUTS
from unitcad.sweeps.destination import Destination, Folders, InStore, is_made, note_store, store_noted
from unitcad.sweeps.journal import JOURNAL, JournalEntry, RecordPlace
from unitcad.sweeps.record_packs import export, read_record


@dataclass(frozen=True)
class BatchOptions:
    """Options of a run.

    `timeout` in seconds a variant; `limit` variants at most; `cache_mb` kept at the end; `verify` compares the hashes
    of finished variants, not only their sizes. `store` is the address (a folder, s3://bucket/path)
    of a store that workers write to; with `folders` each variant also has its folder, with None if there are few.
    `tables` are names of results.TABLES, None chooses by the number of variants.

    Raises WrongArgument for an address that is no store's.
    """

    only: Sequence[str] = OUTPUTS
    check: bool = True
    keep_going: bool = False
    timeout: float | None = None
    limit: int | None = None
    cache: Path | None = None
    cache_mb: float = DEFAULT_LIMIT_MB
    verify: bool = False
    store: str | None = None
    folders: bool | None = None
    tables: Sequence[str] | None = None

    def __post_init__(self) -> None:
        if self.store is not None:
            absolute(self.store)


FOLDERS_BELOW = 1000
"""Variants below which each has a folder, unless asked otherwise."""


def destination_of(out: Path, options: BatchOptions, variants: int, cache: DiskStore, remote: bool) -> Destination:
    """Return the destination of a batch in `out`. Raises UnitcadError for a store that can't be used.

    A batch without folders, or by `remote` workers, reuses the store that an earlier run noted, unless another one is
    given; its own store is in `out`.
    """
    folders, address = folders_wanted(options, variants), options.store
    if address is None and folders and not remote:
        return Folders(out, cache, options.verify, lru_cache(partial(_earlier_store, out)))
    if address is None:
        address = store_noted(out)
    store = SharedStore(absolute(address or str(out / STORE)))
    destination = InStore(store, options.verify, None if address or remote else cache, apart=remote)
    if address is not None:
        note_store(out, store.address)
    return destination


def _earlier_store(out: Path) -> SharedStore | None:
    """Return the store of a batch's earlier run; None if there is none, or it can't be reached."""
    with contextlib.suppress(UnitcadError):
        return _store_of(out)
    return None


def folders_wanted(options: BatchOptions, variants: int) -> bool:
    """Tell whether each variant of a batch has a folder: if asked for, or below FOLDERS_BELOW variants."""
    if options.folders is not None:
        return options.folders
    return variants < FOLDERS_BELOW


def make_folders(out: Path, entries: Iterable[JournalEntry], store: SharedStore, cache: DiskStore) -> None:
    """Make the missing and incomplete folders in `out` of variants in a store.

    Raises UnitcadError for lost contents, and OSError.
    """
    done: set[str] = set()
    with files.scratch(out) as scratch:
        for entry in entries:
            if entry.record is None or not is_made(entry) or entry.folder in done:
                continue
            done.add(entry.folder)
            if whole(out / entry.folder) is not None:
                continue
            try:
                export(store, entry.record, out / entry.folder, cache, partial(placing, scratch=scratch))
            except MissingContent as error:
                raise _lost(entry, error) from None


def _lost(entry: JournalEntry, error: MissingContent) -> UnitcadError:
    """Return the error for a variant whose record or content a store has lost."""
    return UnitcadError(f"variant {entry.index}: {error}; the same batch with --verify makes missing contents again")


def export_variants(
    batch: Path, hashes: Sequence[str], out: Path, cache: DiskStore, address: str | None = None
) -> Iterator[Path]:
    """Make the folders of some variants of a batch below `out`, by their hashes or how those begin; yield each.

    All are looked up before the first one is made. The store is that of the batch; default: the one at `address`.
    Raises WrongArgument for a hash that no variant has, or several; UnitcadError for a batch without a store, and for
    lost contents; OSError.
    """
    wanted = [_find_record(batch, each) for each in hashes]
    store = _store_of(batch, address)
    for entry, place in wanted:
        try:
            export(store, place, out / entry.folder, cache)
        except MissingContent as error:
            raise _lost(entry, error) from None
        except (FileExistsError, NotADirectoryError):
            raise files.in_the_way(out) from None
        yield out / entry.folder


def stored_spec(batch: Path, folder: str) -> str:
    """Return the spec of a variant of a batch that has no folder for it, as text, from the batch's store.

    Raises UnitcadError if no variant has a folder of that name, and for lost contents; OSError.
    """
    if not (batch / JOURNAL).is_file():
        raise WrongArgument("folder", folder, f"{batch} is not the folder of a batch")
    entry, place = _find_record(batch, folder.rpartition("-")[2])
    if entry.folder != folder:
        raise WrongArgument("folder", folder, "no variant of the batch has it", entry.folder)
    return read_record(_store_of(batch), place)[0].own["spec.toml"].decode()


def _find_record(batch: Path, wanted: str) -> tuple[JournalEntry, RecordPlace]:
    """Return a variant's line of the journal, and the place of its record in the store."""
    entry = _entry_of(batch, wanted)
    if entry.record is None:
        raise UnitcadError(f"{batch / entry.folder}: this variant is not in a store, its folder is its result")
    return entry, entry.record


def _store_of(batch: Path, address: str | None = None) -> SharedStore:
    """Return the store that a batch names, else the one at `address`, else its own."""
    store = SharedStore(absolute(address or store_noted(batch) or str(batch / STORE)))
    store.expect()
    return store


def _entry_of(batch: Path, wanted: str) -> JournalEntry:
    digits = wanted.rpartition("-")[2].lower()  # the whole name of a folder will do
    if not re.fullmatch(r"[0-9a-f]{4,12}", digits):
        raise WrongArgument("hash", wanted, "needs 4 to 12 of the digits 0-9 and a-f at the end of a variant's folder")
    begins, found = re.compile(rb'"folder": "[^"]*-' + digits.encode()), {}
    try:
        with open(batch / JOURNAL, "rb") as journal:
            for line in journal:
                if begins.search(line):
                    with contextlib.suppress(MsgspecError):
                        entry = decode(line, type=JournalEntry)
                        found[entry.folder] = entry
    except OSError as error:
        why = (error.strerror or "unreadable").lower()
        raise UnitcadError(f"{batch}: no batch here ({JOURNAL}: {why}); --batch names the folder of a batch") from None
    if not found:
        raise WrongArgument("hash", wanted, f"no variant in {batch} has a hash that begins so")
    if len(found) > 1:
        several = sorted(found)
        raise WrongArgument(
            "hash", wanted, f"{len(found)} variants begin so, {several[0]} and {several[1]}", several[0][-12:]
        )
    return next(iter(found.values()))

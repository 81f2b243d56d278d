"""One batch put together of its shards."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from unitcad.batch.batch_options import BatchOptions
from unitcad.batch.batch_records import Summary
from unitcad.batch.journal import Journal
from unitcad.batch.result_folders import folders_wanted, make_folders, note_store
from unitcad.batch.results import columns_of, write_results
from unitcad.batch.run import count_entry
from unitcad.batch.shards import ShardRecord, read_shards, shard_folders
from unitcad.batch.unread_keys import swept_estimate
from unitcad.batch.unread_keys import warnings as unread_warnings
from unitcad.cache import DiskStore, SharedStore, default_root
from unitcad.errors import UnitcadError


def merge(out: Path, folders: Sequence[Path], options: BatchOptions) -> Summary:
    """Put the shards in `folders` together as one batch in `out`: its journal, its tables and, if wanted, its folders.

    The result is that of the same sweep without shards. Of `options` those of folders, tables and cache count. Raises
    UnitcadError where shards are missing, not finished, or of different batches; nothing is then written.
    """
    start = time.perf_counter()
    shards = read_shards(folders)
    first = shards[0][1]
    _expect_finished(shards)
    summary = Summary(first.variants)
    journal = Journal(out, first.head, first.code, beside={"store", *(f.name for f in shard_folders(out))})
    try:
        for folder, record in shards:
            with _opened(folder, record) as part:
                for index in record.indices:
                    entry = part.own(index)
                    if entry is not None and journal.own(index) != entry:
                        journal.add(entry)
        for entry in journal.entries():
            count_entry(summary, entry.status, lambda entry=entry: entry)
        stores = {record.store for _, record in shards}
        if len(stores) == 1:
            note_store(out, *stores)
        if folders_wanted(options, first.variants):
            cache = DiskStore(options.cache or default_root())
            try:
                for _, record in shards:
                    entries = filter(None, map(journal.entry, record.indices))
                    maker = f"the sweep with --shard {record.number}/{record.of} and"
                    make_folders(out, entries, SharedStore(record.store), cache, maker)
            finally:
                cache.close()
        found = swept_estimate(first.sweep, first.variants) if "estimate" in first.head.outputs else None
        summary.warnings += unread_warnings(found)
        write_results(
            out, columns_of(first.sweep, journal), journal.entries, first.head, found, options.tables, first.variants
        )
    finally:
        journal.close()
    summary.seconds = round(time.perf_counter() - start, 3)
    return summary


def _opened(folder: Path, record: ShardRecord) -> Journal:
    return Journal(folder, record.shard_head, record.code, first=record.indices.start)


def _expect_finished(shards: Sequence[tuple[Path, ShardRecord]]) -> None:
    """Raise UnitcadError for a shard in which a variant is missing, or in which a batch is running."""
    for folder, record in shards:
        with _opened(folder, record) as part:
            missing = [index for index in record.indices if part.own(index) is None]
        if missing:
            raise UnitcadError(
                f"{folder}: {len(missing)} of {len(record.indices)} variants are not made yet, the first is variant "
                f"{missing[0]}; the shard's own command resumes it"
            )

"""One batch put together of its shards."""

from __future__ import annotations

import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from unitcad.cache import DiskStore, MissingContent, SharedStore, default_root
from unitcad.errors import UnitcadError
from unitcad.pipeline.write import ADDRESS, STORE
from unitcad.sweeps.batch_options import BatchOptions
from unitcad.sweeps.batch_records import JournalEntry, Summary
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.insensitive_keys import warnings as insensitive_warnings
from unitcad.sweeps.journal import Journal
from unitcad.sweeps.result_folders import folders_wanted, lost, make_folders
from unitcad.sweeps.results import columns_of, write_results
from unitcad.sweeps.run import count_entry
from unitcad.sweeps.shards import ShardRecord, read_shards, shard_folders
from unitcad.sweeps.store_address import found_at, note_store
from unitcad.text import some


def merge(out: Path, folders: Sequence[Path], options: BatchOptions) -> Summary:
    """Put the shards in `folders` together as one batch in `out`: its journal, its tables and, if wanted, its folders.

    The result is that of the same sweep without shards. Of `options` those of folders, tables and cache count. Raises
    UnitcadError if shards are missing, unfinished, or of different batches, or if their store has lost content; `out`
    is then unchanged.
    """
    start = time.perf_counter()
    shards = read_shards(folders)
    first = shards[0][1]
    addresses = {folder: found_at(folder, record.store) for folder, record in shards}
    opened = {address: SharedStore(address) for address in set(addresses.values())}
    stores = {folder: opened[address] for folder, address in addresses.items()}
    wanted = folders_wanted(options, first.variants)
    if len(opened) > 1 and not wanted:
        raise UnitcadError(
            f"the shards have their results in {len(opened)} stores, {some(sorted(opened))}, and a batch has one; "
            "merge with --folders"
        )
    _expect_finished(shards, stores)
    summary = Summary(first.variants)
    noted_before = (out / ADDRESS).exists()
    journal = Journal(out, first.head, first.code, beside={STORE, *(f.name for f in shard_folders(out))})
    fresh: list[Path] = []
    try:
        for folder, record in shards:
            with _open(folder, record) as part:
                for index in record.indices:
                    entry = part.own(index)
                    if entry is not None and journal.own(index) != entry:
                        journal.add(entry)
        for entry in journal.entries():
            count_entry(summary, entry.status, lambda entry=entry: entry)
        if len(opened) == 1:
            note_store(out, *opened)
        if wanted:
            cache = DiskStore(options.cache or default_root())
            try:
                for folder, record in shards:
                    entries = filter(None, map(journal.entry, record.indices))
                    make_folders(out, entries, stores[folder], cache, _maker(record), fresh.append)
            finally:
                cache.close()
        found = swept_estimate(first.sweep, first.variants) if "estimate" in first.head.outputs else None
        summary.warnings += insensitive_warnings(found)
        write_results(
            out, columns_of(first.sweep, journal), journal.entries, first.head, found, options.tables, first.variants
        )
    except UnitcadError:
        for made in fresh:
            shutil.rmtree(made, ignore_errors=True)
        if not noted_before:
            (out / ADDRESS).unlink(missing_ok=True)
        journal.abandon()
        raise
    finally:
        journal.close()
    summary.seconds = round(time.perf_counter() - start, 3)
    return summary


def _open(folder: Path, record: ShardRecord) -> Journal:
    return Journal(folder, record.shard_head, record.code, first=record.indices.start)


def _maker(*records: ShardRecord) -> str:
    numbers = [f"{record.number}/{record.of}" for record in records]
    each = "each of " if len(numbers) > 1 else ""
    return f"the sweep with {each}--shard {some(numbers)} and"


def _expect_finished(shards: Sequence[tuple[Path, ShardRecord]], stores: Mapping[Path, SharedStore]) -> None:
    """Raise UnitcadError for a shard in which a variant is missing or a batch is running, or whose records are gone."""
    packs: dict[str, dict[str, int]] = {}
    gone: dict[int, tuple[JournalEntry, MissingContent]] = {}  # by shard: its first variant that is lost
    for folder, record in shards:
        store = stores[folder]
        missing = list[int]()
        needed: dict[str, tuple[JournalEntry, int]] = {}  # of each pack: its first variant, and the end of its last one
        with _open(folder, record) as part:
            for index in record.indices:
                entry = part.own(index)
                if entry is None:
                    missing.append(index)
                elif place := entry.record:
                    first, end = needed.get(place.pack, (entry, 0))
                    needed[place.pack] = first, max(end, place.end)
        if missing:
            raise UnitcadError(
                f"{folder}: {len(missing)} of {len(record.indices)} variants are not made yet, the first is "
                f"variant {missing[0]}; the shard's own command resumes it"
            )
        if store.address not in packs:
            store.expect()
            packs[store.address] = store.sizes("packs")
        for pack, (first, end) in needed.items():
            if packs[store.address].get(pack, 0) < end:
                why = MissingContent(f"pack {pack[:12]} is not in {store.address}, or cut there")
                gone.setdefault(record.number, (first, why))
    if gone:
        raise lost(*next(iter(gone.values())), _maker(*(record for _, record in shards if record.number in gone)))

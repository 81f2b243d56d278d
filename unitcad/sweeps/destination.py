"""Destinations of a batch's results, as its parent sees them: folders on this disk, or a store of the workers."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

from unitcad import files
from unitcad.cache import DiskStore, MissingContent, SharedStore, absolute, digest
from unitcad.errors import UnitcadError
from unitcad.pipeline.write import ADDRESS, whole
from unitcad.sweeps import task as tasks
from unitcad.sweeps.journal import JournalEntry
from unitcad.sweeps.record_packs import export, intact
from unitcad.sweeps.task import Task, VariantOutcome


class Destination(Protocol):
    """The place of a batch's results."""

    def stands(self, entry: JournalEntry) -> bool:
        """Check whether a variant's result is still in the place that the journal states."""
        ...

    def damaged(self, entry: JournalEntry) -> str:
        """Return the SHA-256 of the manifest of an outdated result, if it is to be replaced here."""
        ...

    def task(self, task: Task) -> Task:
        """Return a task with the destination of its results."""
        ...

    def take(self, outcome: VariantOutcome) -> VariantOutcome:
        """Return an outcome whose files are in place. Raises OSError."""
        ...


class Folders:
    """Folders on this disk, which the workers share; `verify` compares hashes, not only sizes.

    `kept` gives the store in which an earlier run without folders left records, if any: folders are made of these.
    """

    def __init__(self, out: Path, store: DiskStore, verify: bool, kept: Callable[[], SharedStore | None]) -> None:
        self.out, self.store, self.verify, self.kept = out, store, verify, kept

    def stands(self, entry: JournalEntry) -> bool:
        folder = self.out / entry.folder
        if not is_made(entry) or (whole(folder, hashes=self.verify) is None and not self._restored(entry, folder)):
            return False
        return not self.verify or digest((folder / "manifest.json").read_bytes()) == entry.manifest

    def _restored(self, entry: JournalEntry, folder: Path) -> bool:
        """Make a folder that is not whole of its record in the store, if there is one; return whether it is whole."""
        if entry.record is None or whole(folder) is not None or not (kept := self.kept()):
            return False
        with contextlib.suppress(MissingContent, UnitcadError, OSError):  # then it is made anew
            export(kept, entry.record, folder, self.store)
        return whole(folder, hashes=self.verify) is not None

    def damaged(self, entry: JournalEntry) -> str:
        return entry.manifest

    def task(self, task: Task) -> Task:
        return replace(task, out=self.out.absolute(), cache=self.store.root.absolute())

    def take(self, outcome: VariantOutcome) -> VariantOutcome:
        return outcome


class InStore:
    """A store that workers write to; only rows pass through the parent.

    With `cache`, a folder on the disk of workers and parent, work is shared by it, else by the store. Workers that run
    `apart`, on machines of their own, may have another disk in place of the parent's folder: their results are looked
    for there.
    """

    def __init__(self, store: SharedStore, verify: bool, cache: DiskStore | None, *, apart: bool = False) -> None:
        self.store, self.verify, self.cache = store, verify, cache
        self.folder = apart and store.in_folder
        self._seen: str = ""
        store.claim()

    @cached_property
    def packs(self) -> dict[str, int]:
        """Return the packs that were there when the batch began, with their bytes."""
        return self.store.sizes("packs")

    def stands(self, entry: JournalEntry) -> bool:
        place = entry.record
        if place is None or not is_made(entry) or self.packs.get(place.pack, 0) < place.end:
            return False
        return not self.verify or intact(self.store, place, entry.manifest)

    def damaged(self, entry: JournalEntry) -> str:
        return entry.manifest if entry.record else ""

    def task(self, task: Task) -> Task:
        cache = self.cache.root.absolute() if self.cache else None
        return replace(task, store=self.store.address, cache=cache)

    def take(self, outcome: VariantOutcome) -> VariantOutcome:
        place = outcome.record
        if self.folder and place is not None and place.pack != self._seen:
            if (self.store.size(place.pack, "packs") or 0) < place.end:
                raise UnitcadError(
                    f"--store {self.store.address}: the workers' results are not in this folder: they have a disk of "
                    "their own; name a store that they and this machine reach, such as s3://bucket/path"
                )
            self._seen = place.pack
        return outcome


def is_made(entry: JournalEntry) -> bool:
    """Check whether a variant was made, with or without a broken mould check."""
    return entry.status in (tasks.OK, tasks.BROKEN)


def note_store(out: Path, address: str) -> None:
    """Note the store's address in a batch's folder. Raises OSError."""
    files.write(out / ADDRESS, json.dumps({"store": address}).encode() + b"\n")


def store_noted(out: Path) -> str | None:
    """Return the address of the store that a batch's folder notes, None if it notes none. Raises UnitcadError."""
    if not (out / ADDRESS).is_file():
        return None
    return absolute(str(files.read_json(out / ADDRESS)["store"]))

"""The work of one task: some variants that share a geometry, one after the other. Runs if an executor puts it."""

from __future__ import annotations

import contextlib
import errno
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path

from msgspec import structs

from unitcad import files
from unitcad.cache import DiskStore, default_root, digest
from unitcad.documents import read_json
from unitcad.errors import Refusal, UnitcadError
from unitcad.pipeline import write as folders
from unitcad.pipeline.make import make
from unitcad.pipeline.manifest import UNCHECKED, Manifest, failed_codes, row
from unitcad.pipeline.plan import code_version
from unitcad.pipeline.subject import Subject
from unitcad.pipeline.subjects import subject_of_text
from unitcad.spec import custom_code
from unitcad.sweeps.journal import JournalEntry
from unitcad.sweeps.object_store import ObjectStore, object_store
from unitcad.workers import limit

OK, BROKEN, REFUSED, FAILED, NO_SPACE = "ok", "broken", "refused", "failed", "no space"
"""broken: made, but a mould check or a mesh check failed. refused: the spec is invalid. failed: not made."""


@dataclass(frozen=True)
class Job:
    """One variant: its number in the sweep and its spec, or array, as JSON (a tenth of the object's size).

    `damaged` is the SHA-256 of the manifest that an earlier run made, if its folder has not stayed whole.
    """

    index: int
    spec: str
    damaged: str = ""


@dataclass(frozen=True)
class Task:
    """Variants of one geometry, made into folders in `out`; without `cache` by the cache of the worker's user.

    An `out` of an object store is its address. `allowed` is the code that the caller may run, and so may the worker.
    """

    jobs: tuple[Job, ...]
    geometry: str
    only: tuple[str, ...]
    check: bool
    timeout: float | None
    out: Path | str
    cache: Path | None
    code: str = field(default_factory=code_version)
    allowed: frozenset[str] = field(default_factory=custom_code.allowed)


def work(task: Task) -> list[JournalEntry]:
    """Make a task's variants; when they return, all is on the disk. An error of one of them is in its outcome."""
    if task.code != code_version():
        raise UnitcadError(f"this worker runs unitcad {code_version()}, the batch {task.code}; install the same one")
    custom_code.allow(task.allowed)
    if isinstance(task.out, str):
        return _work_apart(task, object_store(task.out))
    return _work(task, task.out)


def _work(task: Task, out: Path) -> list[JournalEntry]:
    """Make a task's variants into folders in `out`."""
    try:
        with files.scratch(out) as scratch:
            done = [_timed(job, task, out, scratch) for job in task.jobs]
    except OSError as error:
        return [failure(job.index, error) for job in task.jobs]
    folders.sync(out / outcome.folder for outcome in done if outcome.folder)
    return done


def _work_apart(task: Task, store: ObjectStore) -> list[JournalEntry]:
    """Make a task's variants on this worker's own disk, and put them into the store."""
    with tempfile.TemporaryDirectory(prefix="unitcad-") as out:
        done = _work(task, Path(out))
        for i, outcome in enumerate(done):
            if outcome.folder:
                try:
                    store.put_folder(Path(out, outcome.folder))
                except UnitcadError as error:
                    done[i] = failure(outcome.index, error)
    return done


def _timed(job: Job, task: Task, out: Path, scratch: Path) -> JournalEntry:
    """Make a variant within the task's time; an error is its outcome."""
    start = time.perf_counter()
    try:
        with limit(task.timeout):
            outcome = _make(job, task, out, scratch)
    except Exception as error:
        outcome = failure(job.index, error)
    return structs.replace(outcome, seconds=time.perf_counter() - start)


def failure(index: int, error: BaseException) -> JournalEntry:
    """Return the outcome of a variant that raised an error."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return JournalEntry(index, NO_SPACE, f"no space left ({error.filename or error.strerror})")
    if isinstance(error, Refusal):
        return JournalEntry(index, REFUSED, str(error))
    text = str(error) if isinstance(error, UnitcadError) else f"{type(error).__name__}: {error}"
    return JournalEntry(index, FAILED, " ".join(text.split()))


def _make(job: Job, task: Task, out: Path, scratch: Path) -> JournalEntry:
    """Make a variant into its folder in `out`."""
    spec = subject_of_text(job.spec)
    folder = out / spec.folder_name
    manifest = _finished_manifest(folder, spec, task, job.damaged)
    if manifest is not None:
        sha256, reused = _manifest_sha256(folder), True
    else:
        store = _store(task.cache or default_root())
        before = Counter(store.counts)
        built = folders.write(folder, partial(make, spec, task.only, task.check), store, scratch=scratch)
        manifest, sha256, counts = built.manifest, built.sha256, store.counts - before
        built_any, reused_any = (counts[f"file {what}"] + counts[f"data {what}"] for what in ("built", "reused"))
        reused = bool(reused_any and not built_any)
    codes = failed_codes(manifest)
    status, reason = (BROKEN, f"broken: {', '.join(codes)}") if codes else (OK, "")
    values = row(spec.unit, manifest)
    return JournalEntry(job.index, status, reason, folder.name, row=values, manifest=sha256, reused=reused)


def _manifest_sha256(folder: Path) -> str:
    return digest(files.read(folder / "manifest.json", links=False))


def _finished_manifest(folder: Path, spec: Subject, task: Task, damaged: str) -> Manifest | None:
    """Return the manifest of a result that an interrupted run completed, if it is the requested one.

    Raises UnitcadError for a folder with something else.
    """
    if not folder.exists():
        return None
    if damaged:
        with contextlib.suppress(UnitcadError):
            if _manifest_sha256(folder) == damaged:
                return None
        folders.earlier_formats(folder, spec, ours=True)
        return None
    formats = folders.earlier_formats(folder, spec)
    manifest = folders.whole(folder, hashes=True)  # the journal lacks it: it may not have reached the disk
    if manifest is None:
        return None
    try:
        same = (
            read_json(folder / "timings.json", links=False).get("code") == task.code
            and set(manifest["outputs"]) == set(spec.outputs(task.only))
            and set(formats) == set(spec.formats)
            and task.check != any(left["reason"] == UNCHECKED for left in manifest["skipped"])
        )
    except (UnitcadError, KeyError, TypeError, AttributeError):
        return None
    return manifest if same else None


@cache
def _store(root: Path) -> DiskStore:
    """Return the process's store of a cache: contents that it has verified stay verified."""
    return DiskStore(root)

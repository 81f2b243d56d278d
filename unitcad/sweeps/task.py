"""The work of one task: some variants that share a geometry, one after the other. Runs if an executor puts it."""

from __future__ import annotations

import contextlib
import errno
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

from unitcad import files
from unitcad.cache import Bundle, DiskStore, MemoryStore, MissingContent, SharedStore, digest
from unitcad.errors import Refusal, UnitcadError
from unitcad.pipeline import write as folders
from unitcad.pipeline.make import Product, Progress, Subject
from unitcad.pipeline.manifest import UNCHECKED, Manifest, failed_codes, row
from unitcad.pipeline.plan import code_version
from unitcad.pipeline.subjects import subject_of_text
from unitcad.pipeline.write import TRIES
from unitcad.spec import custom_code
from unitcad.sweeps import record_packs
from unitcad.sweeps.journal import RecordPlace, Values
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
    """Variants of one geometry, and how to make them.

    With `store` (an address) results go there; work is then shared by `cache` if there is one, else by the store.
    Without, they go to folders in `out`, with a `cache`.
    `allowed` is the code that the caller may run, and so may the worker.
    """

    jobs: tuple[Job, ...]
    geometry: str
    only: tuple[str, ...]
    check: bool
    timeout: float | None = None
    out: Path = Path()
    cache: Path | None = None
    store: str | None = None
    code: str = field(default_factory=code_version)
    allowed: frozenset[str] = field(default_factory=custom_code.allowed)


@dataclass(frozen=True)
class VariantOutcome:
    """Outcome of one variant; `manifest` is the SHA-256 of its manifest.json.

    `record` is the place of the files in a store. `product` and `bundle` do not leave the worker.
    """

    index: int
    status: str
    folder: str = ""
    row: Values = field(default_factory=dict)
    reason: str = ""
    seconds: float = 0.0
    built: int = 0
    reused: int = 0
    manifest: str = ""
    record: RecordPlace | None = None
    product: Product | None = None
    bundle: Bundle | None = None


def work(task: Task) -> list[VariantOutcome]:
    """Make a task's variants. An error of one of them is in its outcome."""
    if task.code != code_version():
        raise UnitcadError(f"this worker runs unitcad {code_version()}, the batch {task.code}; install the same one")
    custom_code.allow(task.allowed)
    if task.store:
        return _into_store(task, record_packs.store_at(task.store))
    return _into_folders(task)


def _each(
    jobs: Sequence[Job], task: Task, make: Callable[[Job, Bundle | None], VariantOutcome], known: Bundle | None = None
) -> list[VariantOutcome]:
    """Make each variant; an error is its outcome. `make` gets the known files of the geometry."""
    done = []
    for job in jobs:
        start = time.perf_counter()
        try:
            with limit(task.timeout):
                outcome = make(job, known)
        except Exception as error:
            outcome = failure(job.index, error)
        done.append(replace(outcome, seconds=time.perf_counter() - start))
        known = outcome.bundle or known
    return done


def _into_store(task: Task, store: SharedStore) -> list[VariantOutcome]:
    """Make a task's variants, put new contents into the store, and return rows: when they return, all is there."""
    anew = any(job.damaged for job in task.jobs)
    try:
        known = None if anew or task.cache else record_packs.known_bundle(store, task.geometry)
    except Exception as error:
        return [failure(job.index, error) for job in task.jobs]
    done = _each(task.jobs, task, lambda job, known: _deliver(job, task, known, store, anew), known)
    try:
        places = record_packs.pack(store, [outcome.product for outcome in done if outcome.product])
    except Exception as error:
        return [failure(outcome.index, error) if outcome.product else outcome for outcome in done]
    left = iter(places)
    return [
        replace(outcome, product=None, bundle=None, record=next(left)) if outcome.product else outcome
        for outcome in done
    ]


def _deliver(job: Job, task: Task, known: Bundle | None, store: SharedStore, anew: bool) -> VariantOutcome:
    """Make a variant in memory, and put the contents that it shares into the store; its own files are still here."""
    spec = subject_of_text(job.spec)
    maker = _store(task.cache) if task.cache else MemoryStore(known)
    for left in reversed(range(TRIES)):
        if not left:
            maker = MemoryStore(known)  # others clear the cache all the time
        before = Counter(maker.counts)
        try:
            product = spec.make(task.only, task.check, maker, Progress())
            shared = sorted(set(product.shared.values()))
            store.keep_all([maker.content(sha) for sha in shared if anew or not store.noted(sha)], anew=anew)
            break
        except MissingContent:  # the cache is cleared meanwhile
            continue
    outcome = _of_product(job, spec, product, maker.counts - before)
    bundle = maker.bundle() if isinstance(maker, MemoryStore) and outcome.built else None
    if bundle:
        record_packs.offer_bundle(store, task.geometry, bundle, anew=anew)
    return replace(outcome, product=product, bundle=bundle)


def failure(index: int, error: BaseException) -> VariantOutcome:
    """Return the outcome of a variant that raised an error."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return VariantOutcome(index, NO_SPACE, reason=f"no space left ({error.filename or error.strerror})")
    if isinstance(error, Refusal):
        return VariantOutcome(index, REFUSED, reason=str(error))
    text = str(error) if isinstance(error, UnitcadError) else f"{type(error).__name__}: {error}"
    return VariantOutcome(index, FAILED, reason=" ".join(text.split()))


def _into_folders(task: Task) -> list[VariantOutcome]:
    """Make a task's variants into their folders, with the cache on this disk; when they return, all is on the disk."""
    try:
        with files.scratch(task.out) as scratch:
            done = _each(task.jobs, task, lambda job, known: _locally(job, task, scratch))
    except OSError as error:
        return [failure(job.index, error) for job in task.jobs]
    folders.sync(task.out / outcome.folder for outcome in done if outcome.folder)
    return done


def _locally(job: Job, task: Task, scratch: Path) -> VariantOutcome:
    """Make a variant into its folder in `task.out`."""
    assert task.cache is not None
    spec = subject_of_text(job.spec)
    folder = task.out / spec.folder_name
    manifest = _finished_manifest(folder, spec, task, job.damaged)
    if manifest is not None:
        return _outcome(job, spec, folder.name, manifest, _manifest_sha256(folder), Counter({"file reused": 1}))
    store = _store(task.cache)
    before = Counter(store.counts)
    built = folders.write(folder, partial(spec.make, task.only, task.check), store, scratch=scratch)
    return _outcome(job, spec, folder.name, built.manifest, built.sha256, store.counts - before)


def _outcome(
    job: Job, spec: Subject, folder: str, manifest: Manifest, sha256: str, counts: Counter[str]
) -> VariantOutcome:
    """Return the outcome of a variant that is there; `sha256` is that of its manifest.json."""
    codes = failed_codes(manifest)
    return VariantOutcome(
        job.index,
        BROKEN if codes else OK,
        folder,
        row(spec.unit, manifest),
        f"broken: {', '.join(codes)}" if codes else "",
        manifest=sha256,
        built=counts["file built"] + counts["data built"],
        reused=counts["file reused"] + counts["data reused"],
    )


def _of_product(job: Job, spec: Subject, product: Product, counts: Counter[str]) -> VariantOutcome:
    """Return the outcome of a variant that was made in memory."""
    sha256 = digest(product.own["manifest.json"])
    return _outcome(job, spec, spec.folder_name, product.manifest, sha256, counts)


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
            if digest(files.read(folder / "manifest.json", links=False)) == damaged:
                return None
        folders.earlier_formats(folder, spec, ours=True)
        return None
    formats = folders.earlier_formats(folder, spec)
    manifest = folders.whole(folder, hashes=True)  # the journal lacks it: it may not have reached the disk
    if manifest is None:
        return None
    try:
        same = (
            files.read_json(folder / "timings.json", links=False).get("code") == task.code
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

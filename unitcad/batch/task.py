"""The work of one task: some variants that share a geometry, one after the other. Runs where an executor puts it."""

from __future__ import annotations

import contextlib
import errno
import faulthandler
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

from unitcad import files
from unitcad.batch.batch_records import Values
from unitcad.batch.row import row
from unitcad.cache import Bundle, DiskStore, MemoryStore, digest
from unitcad.errors import Refusal, UnitcadError
from unitcad.pipeline import folder as folders
from unitcad.pipeline.build import build_into
from unitcad.pipeline.json_text import json_bytes
from unitcad.pipeline.manifest_records import Manifest, failed_codes
from unitcad.pipeline.product import Product
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.subjects import Made, of_text, outputs_of, product_of, subject_of, unit_of
from unitcad.pipeline.versions import code_version
from unitcad.spec import custom_code

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

    With `out` and `cache` (folders that the worker reaches) results go there. Without, they are in the outcomes, and
    `known` is what the caller has of this geometry. `allowed` is the code that the caller may run, and so
    may the worker.
    """

    jobs: tuple[Job, ...]
    geometry: str
    only: tuple[str, ...]
    check: bool
    timeout: float | None = None
    out: Path | None = None
    cache: Path | None = None
    known: Bundle | None = None
    code: str = field(default_factory=code_version)
    allowed: frozenset[str] = field(default_factory=custom_code.allowed)


@dataclass(frozen=True)
class VariantOutcome:
    """Outcome of one variant; `manifest` is the SHA-256 of its manifest.json.

    `product`, `contents` and `bundle` are set only where the caller places the files.
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
    product: Product | None = None
    contents: dict[str, bytes] = field(default_factory=dict)
    bundle: Bundle | None = None


def work(task: Task) -> list[VariantOutcome]:
    """Make a task's variants. An error of one of them is in its outcome."""
    if task.code != code_version():
        raise UnitcadError(f"this worker runs unitcad {code_version()}, the batch {task.code}; install the same one")
    custom_code.allow(task.allowed)
    outcomes = []
    known = task.known
    for job in task.jobs:
        start = time.perf_counter()
        try:
            with _watch(task.timeout):
                outcome = _locally(job, task) if task.out else _remotely(job, task, known)
        except Exception as error:
            outcome = failure(job.index, error)
        outcomes.append(replace(outcome, seconds=time.perf_counter() - start))
        known = outcome.bundle or known
    if task.out:
        # Before the journal notes them: what is noted is on the disk.
        folders.sync(task.out / outcome.folder for outcome in outcomes if outcome.folder)
    return outcomes


def failure(index: int, error: BaseException) -> VariantOutcome:
    """Return the outcome of a variant that raised an error."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return VariantOutcome(index, NO_SPACE, reason=f"no space left ({error.filename or error.strerror})")
    if isinstance(error, Refusal):
        return VariantOutcome(index, REFUSED, reason=str(error))
    text = str(error) if isinstance(error, UnitcadError) else f"{type(error).__name__}: {error}"
    return VariantOutcome(index, FAILED, reason=" ".join(text.split()))


def _locally(job: Job, task: Task) -> VariantOutcome:
    """Make a variant into its folder, with the cache on this disk."""
    assert task.out is not None
    assert task.cache is not None
    spec = of_text(job.spec)
    folder = task.out / subject_of(spec).folder_name
    manifest = _finished(folder, spec, task, job.damaged)
    if manifest is not None:
        return _outcome(job, spec, folder.name, manifest, Counter({"file reused": 1}))
    store = _store(task.cache)
    before = Counter(store.counts)
    built = build_into(folder, partial(product_of, spec, task.only, task.check), store, Stages())
    return _outcome(job, spec, folder.name, built.manifest, store.counts - before)


def _remotely(job: Job, task: Task, known: Bundle | None) -> VariantOutcome:
    """Make a variant in memory and return it: contents that the caller has are only named."""
    spec = of_text(job.spec)
    store = MemoryStore(known)
    product = product_of(spec, task.only, task.check, store, Stages())
    outcome = _outcome(job, spec, subject_of(spec).folder_name, product.manifest, store.counts)
    needed = set(product.shared.values()) & set(store.contents)
    return replace(
        outcome,
        product=product,
        contents={sha: store.contents[sha] for sha in sorted(needed)},
        bundle=store.bundle() if outcome.built else None,
    )


def _outcome(job: Job, spec: Made, folder: str, manifest: Manifest, counts: Counter[str]) -> VariantOutcome:
    codes = failed_codes(manifest)
    return VariantOutcome(
        job.index,
        BROKEN if codes else OK,
        folder,
        row(spec, manifest),
        f"broken: {', '.join(codes)}" if codes else "",
        manifest=digest(json_bytes(manifest)),
        built=counts["file built"] + counts["data built"],
        reused=counts["file reused"] + counts["data reused"],
    )


def _finished(folder: Path, spec: Made, task: Task, damaged: str) -> Manifest | None:
    """Return the manifest of a result that an interrupted run completed, if it is what is wanted now.

    Raises UnitcadError for a folder that holds something else.
    """
    if not folder.exists():
        return None
    if damaged:
        with contextlib.suppress(UnitcadError):
            if digest(files.read(folder / "manifest.json", links=False)) == damaged:
                return None
        folders.earlier_formats(folder, subject_of(spec), ours=True)
        return None
    formats = folders.earlier_formats(folder, subject_of(spec))
    manifest = folders.whole(folder, hashes=True)  # the journal lacks it: it may not have reached the disk
    if manifest is None:
        return None
    try:
        same = (
            files.read_json(folder / "timings.json", links=False).get("code") == task.code
            and set(manifest["outputs"]) == set(outputs_of(spec, task.only))
            and set(formats) == set(unit_of(spec).output.formats)
            and task.check != any(left["why"] == folders.UNCHECKED for left in manifest["left_out"])
        )
    except (UnitcadError, KeyError, TypeError, AttributeError):
        return None
    return manifest if same else None


@cache
def _store(root: Path) -> DiskStore:
    """Return the process's store of a cache: contents that it has verified stay verified."""
    return DiskStore(root)


@contextlib.contextmanager
def _watch(timeout: float | None) -> Iterator[None]:
    """End this process if the block takes longer: by a C thread, which runs even while a kernel holds the GIL."""
    if timeout is None:
        yield
        return
    faulthandler.dump_traceback_later(timeout, exit=True, file=sys.__stderr__ or sys.stderr)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()

"""Running a sweep: variants in groups of one geometry, given to an executor, recorded one by one, resumed later.

The first task of a geometry makes its files; the others of that geometry wait for it and then cost a few milliseconds
each. So no geometry is made twice, and at most WINDOW variants are held in memory, however many there are.
"""

from __future__ import annotations

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, wait
from dataclasses import dataclass, field
from pathlib import Path

from unitcad import __version__
from unitcad.batch import task as tasks
from unitcad.batch.batch_records import BatchHead, Failure, JournalEntry, Summary
from unitcad.batch.journal import JOURNAL, Journal
from unitcad.batch.remote import Receiver
from unitcad.batch.results import columns_of, write_results, write_timings
from unitcad.batch.sweep import MOST, Sweep
from unitcad.batch.task import Job, Task, VariantOutcome
from unitcad.batch.unread_keys import swept_estimate
from unitcad.batch.unread_keys import warnings as unread_warnings
from unitcad.cache import DEFAULT_LIMIT_MB, DiskStore, collect, default_root, digest
from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.pipeline.artifacts import OUTPUTS
from unitcad.pipeline.folder import clear_leftovers, whole
from unitcad.pipeline.product import checked_outputs
from unitcad.pipeline.subjects import key_of, subject_of, to_text
from unitcad.pipeline.versions import kernel_versions

WINDOW = 2048
"""Variants held in memory: enough to group those that share a geometry."""
FIRST, NEXT = 4, 16
"""Variants in the task that makes a geometry, and in those after it."""
COLLECT_EVERY = 500
"""Geometries made between two checks of the cache's size."""


@dataclass(frozen=True)
class BatchOptions:
    """Options of a run.

    `timeout` in seconds a variant; `limit` variants at most; `cache_mb` kept at the end; `verify` compares the hashes
    of finished variants, not only their sizes.
    """

    only: Sequence[str] = OUTPUTS
    check: bool = True
    keep_going: bool = False
    timeout: float | None = None
    limit: int | None = None
    cache: Path | None = None
    cache_mb: float = DEFAULT_LIMIT_MB
    verify: bool = False


Watch = Callable[[Summary, VariantOutcome | None], None]
MOST_FAILURES = 20


def run(
    sweep: Sweep,
    out: Path,
    options: BatchOptions,
    executor: Executor,
    *,
    workers: int,
    remote: bool = False,
    watch: Watch = lambda summary, outcome: None,
) -> Summary:
    """Make every variant of `sweep` in `out`, with `variants.csv`, `batch.json`, `timings.json`.

    `executor`, of that many `workers`, is the caller's to shut down. With `remote` its workers don't share this disk:
    results come back as messages. What an earlier run in `out` finished is not made again. Raises UnitcadError where
    nothing can be run; whatever happens to a variant is in the summary.
    """
    head = batch_head(sweep, checked_outputs(options.only), options)
    summary = Summary(counted(sweep, options.limit))
    store = DiskStore(options.cache or default_root())
    journal = Journal(out, head)
    receiver = Receiver(out, store) if remote else None
    batch = _Batch(sweep, out, options, executor, 2 * workers, watch, journal, store, receiver, summary)
    if journal.damaged:
        summary.warnings.append(
            f"{out / JOURNAL}: damaged in {journal.damaged} lines; their variants were checked again"
        )
    start = time.perf_counter()
    try:
        clear_leftovers(out)
        batch.all()
        found = swept_estimate(sweep, summary.variants) if "estimate" in head.outputs else None
        summary.warnings += unread_warnings(found)
        write_results(out, columns_of(sweep, journal), journal.entries, head, found)
        summary.seconds = round(time.perf_counter() - start, 3)
        write_timings(out, summary, workers)
        watch(summary, None)
    except OSError as error:
        raise _no_room(tasks.failure(0, error), out, summary) from error
    except KeyboardInterrupt:
        for future in batch.running:
            future.cancel()
        raise
    finally:
        journal.close()
        store.close()
    return summary


def trim(options: BatchOptions) -> None:
    """Reduce the cache to its limit. A cache that was deleted meanwhile is no error."""
    with contextlib.suppress(UnitcadError, OSError):
        collect(options.cache or default_root(), int(options.cache_mb * 1e6))


def batch_head(sweep: Sweep, only: tuple[str, ...], options: BatchOptions) -> BatchHead:
    """Return the batch's identity, for its journal and its tables."""
    return BatchHead(
        batch=digest(repr((sweep.hash, only, options.check)).encode())[:16],
        name=sweep.name,
        mode=sweep.mode,
        bases=[base for base, _ in sweep.bases],
        outputs=list(only),
        versions={"unitcad": __version__, **kernel_versions(("step",))},
    )


def counted(sweep: Sweep, limit: int | None) -> int:
    """Count the variants to make. Raises Refusal for more than MOST without a limit, and for a limit below one."""
    if limit is not None and limit < 1:
        raise WrongArgument("limit", limit, "needs a number of variants from 1 on", 1)
    if limit is None and sweep.count > MOST:
        raise Refusal(
            "sweep", sweep.count, f"variants are more than {MOST:,}: ask for the first ones with --limit", MOST
        )
    return min(sweep.count, limit or sweep.count)


@dataclass
class _GeometryJobs:
    """Waiting variants of one geometry."""

    jobs: deque[Job] = field(default_factory=deque)
    making: bool = False


class _Batch:
    """One run of one sweep; at most `room` tasks are submitted at a time."""

    def __init__(
        self, sweep: Sweep, out: Path, options: BatchOptions, executor: Executor, room: int,
        watch: Watch, journal: Journal, store: DiskStore, receiver: Receiver | None, summary: Summary,
    ) -> None:  # fmt: skip
        self.sweep, self.out, self.options, self.executor, self.room = sweep, out, options, executor, room
        self.watch, self.journal, self.store, self.receiver, self.summary = watch, journal, store, receiver, summary
        self.only = checked_outputs(options.only)
        self.coming = self._to_make()
        self.groups: dict[str, _GeometryJobs] = {}
        self.waiting = 0
        self.again: deque[tuple[str, Job]] = deque()
        self.tried: set[int] = set()
        self.made: set[int] = set()
        self.seen: dict[int, int] = {}
        self.running: dict[Future[list[VariantOutcome]], Task] = {}

    def all(self) -> None:
        while not self.summary.stopped:
            self._fill()
            self._submit()
            if not self.running:
                break
            self._collect()
        while self.running:  # tasks that were begun are finished and kept
            self._collect()

    def _to_make(self) -> Iterator[tuple[int, JournalEntry | None]]:
        """Yield the variants that are not finished, with what the journal has of them.

        What failed before comes last: a batch that stops at a failure has made all others by then.
        """
        failed: list[int] = []
        for index in range(self.summary.variants):
            entry = self.journal.entry(index)
            if entry is not None and self._stands(entry):
                self._finished(VariantOutcome(index, entry.status), fresh=False)
            elif entry is not None and entry.status == tasks.FAILED:
                failed.append(index)
            else:
                yield index, entry
        for index in failed:
            yield index, self.journal.entry(index)

    def _fill(self) -> None:
        """Bring variants into the window; note at once those that are refused, or equal to another one."""
        while self.waiting < WINDOW and not self.summary.stopped:
            index, entry = next(self.coming, (None, None))
            if index is None:
                return
            try:
                spec = self.sweep.spec(index)
            except UnitcadError as error:
                self._finished(VariantOutcome(index, tasks.REFUSED, reason=self.sweep.faults(index, error)))
                continue
            first = self.seen.setdefault(int(subject_of(spec).folder_name[-12:], 16), index)
            if first != index:
                self.journal.add(JournalEntry(index=index, same_as=first, values=self.sweep.values(index)[1]))
                self._finished(VariantOutcome(index, tasks.OK), fresh=False)
                continue
            key = key_of(spec, self.only, self.options.check)
            self.groups.setdefault(key, _GeometryJobs()).jobs.append(
                Job(index, to_text(spec), entry.manifest if entry else "")
            )
            self.waiting += 1

    def _stands(self, entry: JournalEntry) -> bool:
        """Check whether a variant is finished, with or without a broken mould check, and its folder is whole."""
        if entry.status not in (tasks.OK, tasks.BROKEN):
            return False
        folder, hashes = self.out / entry.folder, self.options.verify
        if whole(folder, hashes=hashes) is None:
            return False
        return not hashes or digest((folder / "manifest.json").read_bytes()) == entry.manifest

    def _submit(self) -> None:
        """Submit tasks: one for every worker, and one ahead."""
        while len(self.running) < self.room and not self.summary.stopped:
            chosen = self._next()
            if chosen is None:
                return
            key, jobs = chosen
            task = Task(
                tuple(jobs),
                key,
                self.only,
                self.options.check,
                self.options.timeout,
                None if self.receiver else self.out.absolute(),
                None if self.receiver else self.store.root.absolute(),
                self.receiver.known(key) if self.receiver else None,
            )
            self.running[self.executor.submit(tasks.work, task)] = task

    def _next(self) -> tuple[str, list[Job]] | None:
        """Choose a variant to try again alone; else a geometry not yet made; else more of one that is."""
        if self.again:
            key, job = self.again.popleft()
            return key, [job]
        new = next((k for k, g in self.groups.items() if g.jobs and not g.making and _short(k) not in self.made), None)
        key = new or next((k for k, g in self.groups.items() if g.jobs and not g.making), None)
        if key is None:
            return None
        group = self.groups[key]
        group.making = new is not None
        jobs = [group.jobs.popleft() for _ in range(min(len(group.jobs), FIRST if new else NEXT))]
        self.waiting -= len(jobs)
        return key, jobs

    def _collect(self) -> None:
        for future in wait(list(self.running), return_when="FIRST_COMPLETED").done:
            task = self.running.pop(future)
            group = self.groups.get(task.geometry)
            try:
                outcomes = future.result()
            except UnitcadError:
                raise
            except (Exception, CancelledError) as error:
                self._lost(task, error)
            else:
                if _short(task.geometry) not in self.made and any(o.status == tasks.OK for o in outcomes):
                    self._made(task.geometry)
                for outcome, job in zip(outcomes, task.jobs, strict=True):
                    self._outcome(outcome, task.geometry, job)
            if group:
                group.making = False
                if not group.jobs:
                    del self.groups[task.geometry]

    def _made(self, key: str) -> None:
        self.made.add(_short(key))
        self.summary.geometries = len(self.made)
        if len(self.made) % COLLECT_EVERY == 0:
            trim(self.options)

    def _lost(self, task: Task, error: BaseException) -> None:
        """Handle a task whose worker ended: each of its variants is tried alone, to see which one ended it."""
        if isinstance(error, CancelledError):
            raise UnitcadError(f"lost the scheduler after {self.summary.done} variants; the same command resumes")
        job, *others = task.jobs
        if others:
            self.again.extend((task.geometry, job) for job in task.jobs)
            return
        reason = str(error) or type(error).__name__
        if reason == "timed out" and self.options.timeout:
            reason = f"timed out after {self.options.timeout:g} s"
        self._outcome(VariantOutcome(job.index, tasks.FAILED, reason=reason), task.geometry, job)

    def _outcome(self, outcome: VariantOutcome, key: str, job: Job) -> None:
        if outcome.status == tasks.NO_SPACE:
            self.summary.stopped = self.summary.stopped or outcome.reason
            return
        if outcome.status == tasks.FAILED and outcome.index not in self.tried:
            self.tried.add(outcome.index)
            self.summary.retried += 1
            self.again.append((key, job))
            return
        self.tried.discard(outcome.index)
        if self.receiver and outcome.product:
            outcome = self.receiver.place(outcome, key)
        self._finished(outcome)

    def _finished(self, outcome: VariantOutcome, fresh: bool = True) -> None:
        summary = self.summary
        if fresh:
            self.journal.add(
                JournalEntry(
                    index=outcome.index,
                    status=outcome.status,
                    reason=outcome.reason,
                    folder=outcome.folder,
                    values=self.sweep.values(outcome.index)[1],
                    row=outcome.row,
                    manifest=outcome.manifest,
                )
            )
        summary.done += 1
        summary.resumed += not fresh
        summary.reused += bool(fresh and outcome.reused and not outcome.built)
        if outcome.status == tasks.OK:
            summary.ok += 1
        else:
            summary.failed += 1
            if len(summary.failures) < MOST_FAILURES:
                entry = self.journal.entry(outcome.index)
                if entry is not None:
                    summary.failures.append(Failure(entry.index, entry.status, entry.reason, entry.folder))
            # A refusal concerns one variant only; a failure may happen to each.
            if fresh and outcome.status != tasks.REFUSED and not self.options.keep_going:
                summary.stopped = summary.stopped or f"variant {outcome.index}: {outcome.reason}"
        self.watch(summary, outcome)


def _short(key: str) -> int:
    """Shorten a key to 8 bytes."""
    return int(key[:16], 16)


def _no_room(outcome: VariantOutcome, out: Path, summary: Summary) -> UnitcadError:
    error = UnitcadError(f"{out}: {outcome.reason}; {summary.done} variants are done, the same command resumes")
    error.exit_code = 1
    return error

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
from dataclasses import dataclass
from pathlib import Path

from msgspec import structs

from unitcad import __version__
from unitcad.cache import DEFAULT_LIMIT_MB, DiskStore, collect, default_root, digest
from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.pipeline.plan import check_outputs, kernel_versions
from unitcad.pipeline.write import clear_leftovers, whole
from unitcad.report.read_results import CSV
from unitcad.spec.raw import OUTPUTS
from unitcad.sweeps import task as tasks
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.insensitive_keys import warnings as insensitive_warnings
from unitcad.sweeps.journal import JOURNAL, TABLE, BatchHead, Failure, Journal, JournalEntry, Summary, of_shard
from unitcad.sweeps.object_store import object_store
from unitcad.sweeps.results import columns_of, write_results, write_timings
from unitcad.sweeps.shard import Shard
from unitcad.sweeps.sweep import MOST, Sweep
from unitcad.sweeps.task import Job, Task
from unitcad.workers import WorkerEnded

WINDOW = 2048
"""Variants held in memory: enough to group those that share a geometry."""
STEP = 64
"""Variants read between two looks at the tasks."""
FIRST, NEXT = 4, 48
"""Variants in the task that makes a geometry, and in those after it: variants of one task share estimates."""
COLLECT_EVERY = 500
"""Geometries made between two checks of the cache's size."""

Watch = Callable[[Summary, JournalEntry | None], None]
MOST_FAILURES = 20


@dataclass(frozen=True)
class BatchOptions:
    """Options of a run.

    `timeout` in seconds a variant; `limit` variants at most; `cache_mb` kept at the end; `verify` compares the hashes
    of finished variants, not only their sizes; `shard` is the part to make, None for all; `store` is the address of an
    object store for the variants, which otherwise are folders next to the tables.
    """

    only: Sequence[str] = OUTPUTS
    check: bool = True
    keep_going: bool = False
    timeout: float | None = None
    limit: int | None = None
    cache: Path | None = None
    cache_mb: float = DEFAULT_LIMIT_MB
    verify: bool = False
    shard: Shard | None = None
    store: str | None = None


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

    `executor`, of that many `workers`, is the caller's to shut down. With `remote` its workers may be on other
    machines; these share the disk of `out`, unless the options name a store. Their cache is their own, unless the options
    name one. Variants that an
    earlier run in `out` finished are not made again. Raises UnitcadError if nothing can be run; the summary has the
    outcome of each variant.
    """
    head = batch_head(sweep, check_outputs(options.only), options)
    indices = indices_of(sweep, options)
    summary = Summary(len(indices))
    store = object_store(options.store) if options.store else None
    cache = DiskStore(options.cache or default_root())
    shared = None if remote and options.cache is None else cache.root.absolute()
    if store:
        store.fetch(out, "journal*.jsonl")
    journal = Journal(out, head, options.shard)
    batch = _Batch(sweep, options, executor, 2 * workers, watch, journal, shared, summary, indices)
    if journal.damaged:
        summary.warnings.append(
            f"{out / JOURNAL}: damaged in {journal.damaged} lines; their variants were checked again"
        )
    start = time.perf_counter()
    try:
        clear_leftovers(out)
        if store:
            store.put_files([journal.path])  # refuses before the work
        batch.all()
        clear_leftovers(out)  # of workers that ended in the middle of their task
        finish(sweep, journal, head, options, summary, start, workers)
        if store:
            store.put_files([journal.path, out / CSV, out / TABLE])
        watch(summary, None)
    except OSError as error:
        reason = tasks.failure(0, error).reason
        ended = UnitcadError(f"{out}: {reason}; {summary.done} variants are done, the same command resumes")
        ended.exit_code = 1
        raise ended from error
    except KeyboardInterrupt:
        for future in batch.running:
            future.cancel()
        raise
    finally:
        journal.close()
        cache.close()
    return summary


def finish(
    sweep: Sweep, own: Journal, head: BatchHead, options: BatchOptions, summary: Summary, start: float, workers: int
) -> None:
    """Write the tables of a batch from its journal, and its times since `start`. Raises OSError.

    Those of a shard have the finished variants of all shards.
    """
    found = swept_estimate(sweep, count_variants(sweep, options.limit)) if "estimate" in head.outputs else None
    summary.warnings += insensitive_warnings(found)
    with Journal(own.out, head, merge=True) if options.shard else contextlib.nullcontext(own) as journal:
        write_results(journal.out, columns_of(sweep, journal), journal.entries, head, found)
    summary.seconds = round(time.perf_counter() - start, 3)
    write_timings(own.out / of_shard("timings.json", options.shard), summary, workers)


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
        bases=list(sweep.bases),
        outputs=list(only),
        versions={"unitcad": __version__, **kernel_versions(("step",))},
    )


def count_variants(sweep: Sweep, limit: int | None) -> int:
    """Count the variants to make. Raises Refusal for more than MOST without a limit, and for a limit below one."""
    if limit is not None and limit < 1:
        raise WrongArgument("limit", limit, "needs a number of variants from 1 on", 1)
    if limit is None and sweep.count > MOST:
        raise Refusal(
            "sweep", sweep.count, f"variants are more than {MOST:,}: ask for the first ones with --limit", MOST
        )
    return min(sweep.count, limit or sweep.count)


def indices_of(sweep: Sweep, options: BatchOptions) -> range:
    """Return the indices of the variants to make. Raises Refusal as `count_variants`."""
    count = count_variants(sweep, options.limit)
    return options.shard.indices(count) if options.shard else range(count)


class _Batch:
    """One run of one sweep; at most `room` tasks are submitted at a time.

    `groups` are the waiting variants by geometry; those of one that is in `making` wait for its first task.
    """

    def __init__(
        self, sweep: Sweep, options: BatchOptions, executor: Executor, room: int,
        watch: Watch, journal: Journal, cache: Path | None, summary: Summary, indices: range,
    ) -> None:  # fmt: skip
        self.sweep, self.options, self.executor, self.room = sweep, options, executor, room
        self.watch, self.journal, self.cache, self.summary = watch, journal, cache, summary
        self.indices = indices
        self.only = check_outputs(options.only)
        self.coming = self._to_make()
        self.groups: dict[str, deque[Job]] = {}
        self.making: set[str] = set()
        self.waiting = 0
        self.again: deque[tuple[str, Job]] = deque()
        self.tried: set[int] = set()
        self.made: set[int] = set()
        self.seen: dict[int, int] = {}
        self.running: dict[Future[list[JournalEntry]], Task] = {}

    def all(self) -> None:
        while not self.summary.stopped:
            more = self._fill()
            self._submit()
            if not self.running and not more:
                break
            self._collect(at_once=more)
        while self.running:  # tasks that were begun are finished and kept
            self._collect()

    def _to_make(self) -> Iterator[tuple[int, JournalEntry | None]]:
        """Yield the unfinished variants, with their entries of the journal.

        Variants that failed before come last: a batch that stops at a failure has made all others by then.
        """
        failed: list[int] = []
        for index in self.indices:
            entry = self.journal.entry(index)
            if entry is not None and self._stands(entry):
                self._finished(JournalEntry(index, entry.status), fresh=False)
            elif entry is not None and entry.status == tasks.FAILED:
                failed.append(index)
            else:
                yield index, entry
        for index in failed:
            yield index, self.journal.entry(index)

    def _stands(self, entry: JournalEntry) -> bool:
        """Check whether the folder of a variant that was made is still there and whole."""
        folder, verify = self.journal.out / entry.folder, self.options.verify
        if entry.status not in (tasks.OK, tasks.BROKEN):
            return False
        if self.options.store:
            return object_store(self.options.store).has(entry.folder, manifest=entry.manifest, verify=verify)
        if whole(folder, hashes=verify) is None:
            return False
        return not verify or digest((folder / "manifest.json").read_bytes()) == entry.manifest

    def _fill(self) -> bool:
        """Bring up to STEP variants into the window; return whether more may follow.

        Those that are refused or equal to another one are noted at once.
        """
        for _ in range(STEP):
            if self.waiting >= WINDOW or self.summary.stopped:
                return False
            index, entry = next(self.coming, (None, None))
            if index is None:
                return False
            try:
                wanted = self.sweep.subject(index)
            except UnitcadError as error:
                self._finished(JournalEntry(index, tasks.REFUSED, self.sweep.faults(index, error)))
                continue
            first = self.seen.setdefault(int(wanted.folder_name[-12:], 16), index)
            if first != index:
                self.journal.add(JournalEntry(index, same_as=first, values=self.sweep.values(index)[1]))
                self._finished(JournalEntry(index, tasks.OK), fresh=False, before=entry is not None)
                continue
            key = wanted.key(self.only, self.options.check)
            job = Job(index, wanted.text, entry.manifest if entry else "")
            self.groups.setdefault(key, deque()).append(job)
            self.waiting += 1
        return self.waiting < WINDOW

    def _submit(self) -> None:
        """Submit tasks: one for every worker, and one ahead."""
        while len(self.running) < self.room and not self.summary.stopped:
            chosen = self._next()
            if chosen is None:
                return
            key, jobs = chosen
            options = self.options
            out = options.store or self.journal.out.absolute()
            task = Task(tuple(jobs), key, self.only, options.check, options.timeout, out, self.cache)
            self.running[self.executor.submit(tasks.work, task)] = task

    def _next(self) -> tuple[str, list[Job]] | None:
        """Choose the next task: a variant to repeat, a geometry to make, or more variants of a made one."""
        if self.again:
            key, job = self.again.popleft()
            return key, [job]
        ready = [key for key, jobs in self.groups.items() if jobs and key not in self.making]
        new = next((key for key in ready if _short(key) not in self.made), None)
        key = new or next(iter(ready), None)
        if key is None:
            return None
        if new:
            self.making.add(new)
        waiting = self.groups[key]
        jobs = [waiting.popleft() for _ in range(min(len(waiting), FIRST if new else NEXT))]
        self.waiting -= len(jobs)
        return key, jobs

    def _collect(self, at_once: bool = False) -> None:
        """Collect finished tasks; wait for the first, or with `at_once` for none."""
        for future in wait(list(self.running), 0 if at_once else None, return_when="FIRST_COMPLETED").done:
            task = self.running.pop(future)
            try:
                outcomes = future.result()
            except WorkerEnded as error:
                self._lost(task, error)
            except UnitcadError:  # with NoWorker: if no worker can start, none of the others can be made either
                raise
            except (Exception, CancelledError) as error:
                self._lost(task, error)
            else:
                if _short(task.geometry) not in self.made and any(o.status == tasks.OK for o in outcomes):
                    self.made.add(_short(task.geometry))
                    self.summary.geometries = len(self.made)
                    if len(self.made) % COLLECT_EVERY == 0:
                        trim(self.options)
                for outcome, job in zip(outcomes, task.jobs, strict=True):
                    self._outcome(outcome, task.geometry, job)
            self.making.discard(task.geometry)
            if not self.groups.get(task.geometry, True):
                del self.groups[task.geometry]

    def _lost(self, task: Task, error: BaseException) -> None:
        """Handle a task whose worker ended: each of its variants is tried by itself, to find the one that ended it."""
        if isinstance(error, CancelledError):
            raise UnitcadError(f"lost the scheduler after {self.summary.done} variants; the same command resumes")
        job, *others = task.jobs
        if others:
            self.again.extend((task.geometry, job) for job in task.jobs)
            return
        reason = str(error) or type(error).__name__
        if reason == "timed out" and self.options.timeout:
            reason = f"timed out after {self.options.timeout:g} s"
        self._outcome(JournalEntry(job.index, tasks.FAILED, reason), task.geometry, job)

    def _outcome(self, outcome: JournalEntry, key: str, job: Job) -> None:
        if outcome.status == tasks.NO_SPACE:
            self.summary.stopped = self.summary.stopped or outcome.reason
            return
        if outcome.status == tasks.FAILED and outcome.index not in self.tried:
            self.tried.add(outcome.index)
            self.summary.retried += 1
            self.again.append((key, job))
            return
        self.tried.discard(outcome.index)
        if outcome.folder and not self.options.store and not (self.journal.out / outcome.folder).is_dir():
            raise UnitcadError(
                f"{self.journal.out}: the workers' results are not in this folder: they have a disk of their own; "
                "choose with -o a folder on a disk that they and this machine share, or s3://bucket/prefix"
            )
        self._finished(outcome)

    def _finished(self, outcome: JournalEntry, fresh: bool = True, before: bool = True) -> None:
        """Count a variant that has ended, and note it if it is `fresh`; others are from `before`, or another's twin."""
        summary = self.summary
        if fresh:
            self.journal.add(structs.replace(outcome, values=self.sweep.values(outcome.index)[1]))
        summary.resumed += before and not fresh
        summary.reused += fresh and outcome.reused
        count_entry(summary, outcome.status, lambda: self.journal.entry(outcome.index))
        # A refusal concerns one variant only; a failure may happen to each.
        stops = outcome.status not in (tasks.OK, tasks.REFUSED) and not self.options.keep_going
        if fresh and stops:
            summary.stopped = summary.stopped or f"variant {outcome.index}: {outcome.reason}"
        self.watch(summary, outcome)


def count_entry(summary: Summary, status: str, entry: Callable[[], JournalEntry | None]) -> None:
    """Count a variant that has ended; the first ones that are not ok are named by their `entry`."""
    summary.done += 1
    if status == tasks.OK:
        summary.ok += 1
        return
    summary.failed += 1
    if len(summary.failures) < MOST_FAILURES and (found := entry()) is not None:
        summary.failures.append(Failure(found.index, found.status, found.reason, found.folder))


def _short(key: str) -> int:
    """Shorten a key to 8 bytes."""
    return int(key[:16], 16)

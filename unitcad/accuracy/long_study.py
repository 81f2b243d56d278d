"""Long studies: jobs in worker processes, results in the order of the jobs, a journal from which a study resumes."""

from __future__ import annotations

import faulthandler
import hashlib
import json
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

from unitcad.errors import UnitcadError
from unitcad.pipeline.plan import code_version
from unitcad.sweeps.executors import Workers
from unitcad.workers import WorkerEnded

J = TypeVar("J")
T = TypeVar("T")

_AHEAD = 16  # jobs handed to each worker, so that none waits for a slow one
_WAITING = 20  # times its processor time that a job may take by the clock


def in_order(
    call: Callable[[J], T], jobs: Sequence[J], patience: float, late: Callable[[J], T], serial: int = 0
) -> Iterator[T]:
    """Yield call(job) of every job, in order, from worker processes; up to `serial` jobs run in this one.

    A worker that dies, or takes more than `patience` seconds of processor time, gives late(job), and the others go on.
    """
    if len(jobs) <= serial:
        yield from map(call, jobs)
        return
    waiting = deque(jobs)
    running: deque[tuple[J, Future[T]]] = deque()
    with Workers().executor() as (executor, workers):
        while waiting or running:
            while waiting and len(running) < _AHEAD * workers:
                job = waiting.popleft()
                running.append((job, executor.submit(_within, patience, call, job)))
            job, answer = running.popleft()
            try:
                yield answer.result()
            except WorkerEnded:
                yield late(job)


def _within(patience: float, call: Callable[[J], T], job: J) -> T:
    """Return call(job), in a worker; the system ends this process after `patience` seconds of its processor time.

    A loaded machine changes nothing of that. What waits, and takes no processor time, ends by the clock, later.
    """
    counted = hasattr(signal, "setitimer")  # not on Windows: there the clock has to do
    faulthandler.dump_traceback_later(patience * (_WAITING if counted else 1), exit=True)
    if counted:
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, patience)
    try:
        return call(job)
    finally:
        if counted:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()


def journalled(jobs: Sequence[J], compute: Callable[[Sequence[J]], Iterator[Any]], journal: Path) -> Iterator[Any]:
    """Yield what `compute` yields for the jobs, all JSON-ready, each a line of `journal` as soon as it is there.

    What this code wrote into the journal before is read from there. Raises UnitcadError for a file that is no journal.
    """
    names = [hashlib.sha256(f"{code_version()} {json.dumps(job)}".encode()).hexdigest()[:16] for job in jobs]
    known: dict[str, Any] = {}
    if journal.exists():
        # A last line without its end was cut off by the interruption.
        whole, end, cut = journal.read_bytes().rpartition(b"\n")
        for line in whole.splitlines():
            try:
                name, data = json.loads(line)
            except (ValueError, TypeError):
                raise UnitcadError(f"{journal}: is not a journal of this study; move it away") from None
            known[name] = data
        if cut:
            os.truncate(journal, len(whole + end))
    journal.parent.mkdir(parents=True, exist_ok=True)
    fresh = compute([job for job, name in zip(jobs, names, strict=True) if name not in known])
    with journal.open("ab") as file:
        for name in names:
            if name not in known:
                known[name] = next(fresh)
                file.write(json.dumps([name, known[name]]).encode() + b"\n")
                file.flush()
            yield known[name]

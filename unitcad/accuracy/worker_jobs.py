"""Jobs in worker processes, results in the order of the jobs."""

from __future__ import annotations

import faulthandler
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from typing import TypeVar

from unitcad.workers import Pool, WorkerEnded, cores

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
    with Pool(cores(), load=("unitcad.pipeline.write",)) as pool:
        while waiting or running:
            while waiting and len(running) < _AHEAD * cores():
                job = waiting.popleft()
                running.append((job, pool.submit(_within, patience, call, job)))
            job, answer = running.popleft()
            try:
                yield answer.result()
            except WorkerEnded:
                yield late(job)


def _within(patience: float, call: Callable[[J], T], job: J) -> T:
    """Return call(job), in a worker; the system ends this process after `patience` seconds of its processor time.

    A loaded machine changes nothing of that. A call that waits, without processor time, ends later by the clock.
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

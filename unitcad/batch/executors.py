"""Where variants are made, as `concurrent.futures.Executor`: in this process, in worker processes, on a Dask cluster.

ProcessPoolExecutor fails all running tasks when one worker dies. Here only the dead worker's task fails, and the worker
is replaced. docs/scale.md compares this pool with Pebble's. Workers are started by `python -c`: a fork after a kernel
has run threads hangs, and the caller's main module needs no guard.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from importlib.resources import files
from typing import IO, Any

from unitcad.batch.cluster import FROM_DASK, Certificates, check_certificates, dask_executor
from unitcad.children import cores
from unitcad.errors import WrongArgument

_START = "import sys; sys.path[:] = {path!r}; from unitcad.batch.worker import serve; serve({preload!r})"
WARM = ("unitcad.pipeline.build", "unitcad.mould_checks", "unitcad.check", "unitcad.kernels.mesh")
"""Modules that a worker imports before its first task."""


class WorkerDied(Exception):
    """The end of a worker process in the middle of a task."""


class SerialExecutor(Executor):
    """An executor that runs each task at once, in the caller's thread, which a crash or a hang ends: for debugging."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class ProcessExecutor(Executor):
    """A pool of `workers` processes that are kept; one that dies fails its task with WorkerDied and is replaced.

    Tasks and results are pickled; functions go by name, as with `multiprocessing`.
    """

    def __init__(self, workers: int) -> None:
        self._tasks: queue.SimpleQueue[tuple[Future[Any], Any] | None] = queue.SimpleQueue()
        self._children: dict[int, subprocess.Popen[bytes]] = {}
        self._closing = False
        self._threads = [threading.Thread(target=self._serve, args=(i,), daemon=True) for i in range(workers)]
        for thread in self._threads:
            thread.start()

    @property
    def pids(self) -> list[int]:
        """Process ids of the workers that run now."""
        return [child.pid for child in list(self._children.values()) if child.poll() is None]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self._closing:
            raise RuntimeError("the executor is shut down")
        future: Future[Any] = Future()
        self._tasks.put((future, (fn, args, kwargs)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._closing = True
        while cancel_futures and not self._tasks.empty():
            with contextlib.suppress(queue.Empty):
                item = self._tasks.get_nowait()
                if item:
                    item[0].cancel()
        for _ in self._threads:
            self._tasks.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def kill(self) -> None:
        """End every worker now. Their tasks are lost; a result is put in place whole, so none is left half written."""
        self._closing = True
        for child in list(self._children.values()):
            with contextlib.suppress(OSError):
                child.kill()
        self.shutdown(wait=True, cancel_futures=True)

    def _serve(self, slot: int) -> None:
        """Give one worker its tasks, one by one; start another one where it ends."""
        child, log = self._start(slot)
        while (item := self._tasks.get()) is not None:
            future, task = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                message = pickle.dumps(task)
            except Exception as error:
                future.set_exception(error)
                continue
            if child.poll() is not None and not self._closing:
                log.close()
                child, log = self._start(slot)
            try:
                tasks, answers = _pipes(child)
                pickle.dump(message, tasks)
                tasks.flush()
                ok, result = pickle.loads(pickle.load(answers))
            except (OSError, EOFError, pickle.UnpicklingError):
                future.set_exception(WorkerDied(_cause_of_end(child, log)))
                continue
            if ok:
                future.set_result(result)
            else:
                future.set_exception(result)
        _end(child, log)

    def _start(self, slot: int) -> tuple[subprocess.Popen[bytes], IO[bytes]]:
        log = tempfile.TemporaryFile()  # noqa: SIM115  (closed when the worker has ended)
        path = [*filter(None, sys.path), str(files("unitcad").joinpath(os.pardir))]  # not the working directory
        code = _START.format(path=path, preload=WARM)
        child = subprocess.Popen(
            [sys.executable, "-P", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log
        )
        if before := self._children.pop(slot, None):
            _close(before)
        self._children[slot] = child
        return child, log


@dataclass(frozen=True)
class Workers:
    """Executor of the tasks: on the Dask cluster of `scheduler`, else in `jobs` processes.

    None is a process for each core, 0 this process.
    """

    jobs: int | None = None
    scheduler: str | None = None
    certificates: Certificates = FROM_DASK

    @contextlib.contextmanager
    def executor(self, timeout: float | None = None) -> Iterator[tuple[Executor, int]]:
        """Yield an executor and how many tasks it runs at once; the end of the block ends what was started for it.

        Raises Refusal or UnitcadError for an invalid combination, or a scheduler that does not answer.
        """
        check_certificates(self.certificates, self.scheduler)
        if self.scheduler is not None:
            if self.jobs is not None:
                raise WrongArgument("jobs", self.jobs, "the scheduler knows its workers; leave it out with --scheduler")
            cluster, threads = dask_executor(self.scheduler, self.certificates)
            try:
                yield cluster, threads
            finally:
                cluster.shutdown(wait=False)  # which takes back what is still with the scheduler
        elif self.jobs == 0:
            if timeout is not None:
                raise WrongArgument("timeout", timeout, "only a worker process can be ended in time; with -j from 1 on")
            yield SerialExecutor(), 1
        else:
            processes = ProcessExecutor(self.jobs or cores())
            try:
                yield processes, self.jobs or cores()
            finally:
                processes.kill()


def _cause_of_end(child: subprocess.Popen[bytes], log: IO[bytes]) -> str:
    """Return how a worker ended, in words that are the same in every run."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        child.wait(10)
    code = child.returncode
    log.seek(max(0, log.seek(0, os.SEEK_END) - 20_000))
    if b"Timeout (" in log.read():
        return "timed out"
    if code is not None and code < 0:
        return f"the worker died ({signal.Signals(-code).name})"
    return f"the worker ended (exit code {code})"


def _pipes(child: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes]]:
    assert child.stdin
    assert child.stdout
    return child.stdin, child.stdout


def _end(child: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    with contextlib.suppress(OSError):
        _pipes(child)[0].close()  # the worker reads the end and goes
    try:
        child.wait(10)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()
    _close(child)
    log.close()


def _close(child: subprocess.Popen[bytes]) -> None:
    for pipe in _pipes(child):
        with contextlib.suppress(OSError):
            pipe.close()

"""Executors of variants, as `concurrent.futures.Executor`: in this process, in workers, on a Dask cluster."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any

from unitcad.errors import WrongArgument
from unitcad.sweeps.cluster import FROM_DASK, Certificates, check_certificates, dask_executor
from unitcad.workers import Pool, cores

WARM = ("unitcad.pipeline.write", "unitcad.checks", "unitcad.meshcheck", "unitcad.kernels.mesh")
"""Modules that a worker imports before its first task."""


class SerialExecutor(Executor):
    """An executor that runs each task at once, in the caller's thread, which a crash or a hang ends: for debugging."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


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
        """Yield an executor and its number of tasks at once; the end of the block ends its processes.

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
                cluster.shutdown(wait=False)  # which cancels the tasks that the scheduler still has
        elif self.jobs == 0:
            if timeout is not None:
                raise WrongArgument("timeout", timeout, "only a worker process can be ended in time; with -j from 1 on")
            yield SerialExecutor(), 1
        else:
            with Pool(self.jobs or cores(), load=WARM) as pool:
                yield pool, self.jobs or cores()

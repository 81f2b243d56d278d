"""Executors of variants, as `concurrent.futures.Executor`: in this process, in workers, on a Dask cluster."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

from unitcad.errors import UnitcadError, WrongArgument
from unitcad.extras import missing_extra
from unitcad.workers import Pool, cores

DASK_SECONDS = 6.0
"""Seconds that a scheduler may take to answer: with imports and start-up the command ends within ten."""


def dask_executor(address: str) -> tuple[Executor, int]:
    """Connect to a Dask cluster; return its executor, and how many tasks it runs at once.

    Dask's configuration names the certificates. Raises UnitcadError without the extra, for certificates that can't be
    used, or if no scheduler answers in time.
    """
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
        from distributed.comm.core import connect
        from distributed.comm.registry import get_backend
        from distributed.security import Security
    except ImportError:
        raise missing_extra("dask", "--scheduler needs Dask") from None

    try:
        scheme, place = parse_address(address)
        get_backend(scheme)
        parse_host_port(place)
    except (ValueError, TypeError) as error:
        raise UnitcadError(f"--scheduler {address}: not a scheduler's address ({error})") from None

    try:
        security = Security()
        arguments = security.get_connection_args("client")
    except (OSError, ssl.SSLError, ValueError, TypeError) as error:
        raise UnitcadError(f"--scheduler {address}: the certificates can't be used: {error}") from None
    if scheme in ("tls", "wss") and arguments.get("ssl_context") is None:
        raise UnitcadError(f"--scheduler {address}: needs certificates in Dask's configuration (distributed.comm.tls)")

    async def ask() -> Any:
        comm = await connect(address, timeout=DASK_SECONDS, **arguments)
        await comm.write({"op": "identity", "reply": True})
        answer = await comm.read()
        await comm.close()
        return answer

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    # Ask first: a client that reaches no scheduler takes long to give up.
    start = time.monotonic()
    try:
        # In a thread of its own, since a notebook has an event loop running in this one.
        with ThreadPoolExecutor(1) as thread:
            answer = thread.submit(lambda: asyncio.run(asyncio.wait_for(ask(), DASK_SECONDS))).result()
    except (OSError, TimeoutError) as error:
        waited = time.monotonic() - start > DASK_SECONDS - 1
        why = f" ({error})" if str(error) else ""
        raise UnitcadError(
            f"--scheduler {address}: no answer{f' within {DASK_SECONDS:g} s' if waited else ''}{why}"
        ) from None
    except Exception:  # bytes that are not Dask's end in anything: a length read from them in a MemoryError
        answer = None
    if not isinstance(answer, dict) or answer.get("type") != "Scheduler":
        raise UnitcadError(f"--scheduler {address}: the server at this address is not a Dask scheduler")
    client = Client(address, timeout=DASK_SECONDS, set_as_default=False, security=security)
    cores: Any = client.ncores()
    threads = sum(cores.values())
    if not threads:
        client.close()
        raise UnitcadError(f"--scheduler {address}: it has no workers")
    return client.get_executor(pure=False), threads


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


@contextlib.contextmanager
def open_executor(
    jobs: int | None, scheduler: str | None, timeout: float | None = None
) -> Iterator[tuple[Executor, int]]:
    """Yield an executor and its number of tasks at once; the end of the block ends its processes.

    On the Dask cluster of `scheduler`, otherwise in `jobs` processes: None is one for each core, 0 this process. Raises
    Refusal or UnitcadError for an invalid combination, or a scheduler that does not answer.
    """
    if scheduler is not None:
        if jobs is not None:
            raise WrongArgument("jobs", jobs, "the scheduler knows its workers; leave it out with --scheduler")
        cluster, threads = dask_executor(scheduler)
        try:
            yield cluster, threads
        finally:
            cluster.shutdown(wait=False)  # which cancels the tasks that the scheduler still has
    elif jobs == 0:
        if timeout is not None:
            raise WrongArgument("timeout", timeout, "only a worker process can be ended in time; with -j from 1 on")
        yield SerialExecutor(), 1
    else:
        with Pool(jobs or cores(), load=WARM) as pool:
            yield pool, jobs or cores()

"""Programs that end when this process ends, however it ends.

A program is started by a keeper: a small process that holds one end of a pipe. The system closes the other end when
this process ends, by SIGKILL too; the keeper then ends the program and its process group. No signal handler is needed.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import IO, TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from concurrent.futures import Future

STAGES = "UNITCAD_STAGES"
"""Environment variable: the text with which a command begins a line on standard error for each stage of its work."""
GRACE_S = 2.0
"""Seconds from the request that a program end until it is killed."""


def run(
    command: Sequence[str], *, content: bytes = b"", timeout: float | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a program to its end, `content` on its standard input.

    Raises FileNotFoundError where there is no such program, subprocess.TimeoutExpired after `timeout` seconds; the
    program is ended then.
    """
    with started(command, content=content, env=env) as keeper:
        output, errors = keeper.communicate(timeout=timeout)
    return subprocess.CompletedProcess(command, keeper.returncode, output, errors)


@contextlib.contextmanager
def started(
    command: Sequence[str], *, content: bytes = b"", env: Mapping[str, str] | None = None, stderr: int = subprocess.PIPE
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program while the block lasts; yields the keeper, whose outputs and exit code are the program's.

    Raises FileNotFoundError where there is no such program.
    """
    program = shutil.which(command[0])
    if program is None:
        raise FileNotFoundError(command[0])
    reading, lifeline = os.pipe()
    try:
        # Its own session: a signal from a terminal reaches this process alone.
        keeper = subprocess.Popen(
            [sys.executable, "-I", "-S", __file__, program, *command[1:]],
            stdin=reading, stdout=subprocess.PIPE, stderr=stderr, env=env, start_new_session=True,
        )  # fmt: skip
    except BaseException:
        os.close(lifeline)
        raise
    finally:
        os.close(reading)
    with keeper:
        try:
            with contextlib.suppress(BrokenPipeError), open(lifeline, "wb", closefd=False, buffering=0) as pipe:
                _write(pipe, len(content).to_bytes(8, "little") + content)
            yield keeper
        finally:
            os.close(lifeline)
            try:
                keeper.wait(2 * GRACE_S)
            except subprocess.TimeoutExpired:
                keeper.kill()


@contextlib.contextmanager
def safe_path() -> Iterator[None]:
    """Keep Python processes that are started in this block from importing anything from the folder they start in.

    For `multiprocessing`, which makes its own commands; commands made here have -P.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


def end_with_parent() -> None:
    """Have the kernel kill this process when its parent ends, even inside a call that never returns; on Linux only."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            import ctypes

            ctypes.CDLL(None, use_errno=True).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def message_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Return this process's standard input and output, for messages alone: what a kernel prints goes to the errors."""
    messages, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return messages, answers


class Lost(Exception):
    """A process that ended before it answered."""


class Answering:
    """A Python process that answers requests in the order of asking, and ends with the block. See `answer_requests`."""

    def __init__(self, module: str, *arguments: str) -> None:
        from concurrent.futures import ThreadPoolExecutor

        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # a signal from a terminal reaches the caller alone
        )
        self._thread = ThreadPoolExecutor(1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._child.kill()  # it holds nothing that must be written
        self._thread.shutdown(cancel_futures=True)
        with contextlib.suppress(BrokenPipeError):
            self._child.__exit__(None, None, None)

    def answer(self, request: object) -> Future[Any]:
        """Return the answer to come, which may be cancelled until the request is sent.

        Its result raises Lost where the process ended first.
        """
        return self._thread.submit(self._answered, pickle.dumps(request))

    def _answered(self, request: bytes) -> Any:
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            self._child.stdin.write(request)
            self._child.stdin.flush()
            return pickle.load(self._child.stdout)
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:
            raise Lost from error


def cores() -> int:
    """Return how many processes can run side by side."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def answer_requests(begin: Callable[[], Callable[[Any], object]]) -> None:
    """Answer what `Answering.answer` sends to this process until no more comes, by the function that `begin` loads."""
    end_with_parent()
    requests, answers = message_pipes()
    answer = begin()
    while True:
        try:
            request = pickle.load(requests)
        except EOFError:
            return
        pickle.dump(answer(request), answers)
        answers.flush()


def _write(pipe, content: bytes) -> None:
    left = memoryview(content)
    while left:
        left = left[pipe.write(left) :]


def _keep(command: list[str]) -> int:
    """Run a program, as its keeper, until it ends or the pipe does; return its exit code, as a shell counts it."""
    lifeline = sys.stdin.buffer
    # The whole content first: then the program can't delay the reading of the pipe's end.
    size = int.from_bytes(lifeline.read(8), "little")
    content = lifeline.read(size)
    if len(content) < size:
        return 1
    child = subprocess.Popen(
        command, stdin=subprocess.PIPE, preexec_fn=end_with_parent if sys.platform == "linux" else None
    )
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it is for the group's other members
    threading.Thread(target=_end_with_pipe, args=(child,), daemon=True).start()
    with contextlib.suppress(OSError):
        child.communicate(content)
    return child.returncode if child.returncode >= 0 else 128 - child.returncode


def _end_with_pipe(child: subprocess.Popen[bytes]) -> None:
    os.read(0, 1)
    alone = sys.platform != "win32" and os.getpgrp() == os.getpid()
    os.killpg(os.getpid(), signal.SIGTERM) if alone else child.terminate()
    with contextlib.suppress(subprocess.TimeoutExpired):
        child.wait(GRACE_S)
        return
    os.killpg(os.getpid(), signal.SIGKILL) if alone else child.kill()


if __name__ == "__main__":
    os._exit(_keep(sys.argv[1:]))

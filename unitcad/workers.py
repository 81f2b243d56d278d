"""Work in other processes: Python functions in a pool of workers, and other programs.

A worker answers one call after the other and keeps what it has loaded. If it dies, takes too long or cannot start, only
its own call fails, and another worker takes its place. Workers, and programs that they start, end with this process,
however it ends. Workers are fresh interpreters: a fork after a kernel has run threads hangs, and `multiprocessing`
would import the caller's main module.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import importlib
import os
import pickle
import pkgutil
import queue
import shutil
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, Future
from functools import partial
from typing import IO, Any

from unitcad.errors import UnitcadError

START_S = 60.0
"""Seconds that a worker may take to start and to load its modules."""
LONGEST_LINE = 4000
"""Characters of a program's line that are passed on."""
_CODE = "import sys; sys.path[:] = {path!r}; from unitcad.workers import _serve; _serve()"
_POSIX = sys.platform != "win32"


class WorkerEnded(UnitcadError):
    """The end of a worker before its answer: it crashed, took too long, or was stopped."""

    exit_code = 1


class TimedOut(WorkerEnded):
    """The end of a worker that took longer than its call may."""


class NoWorker(UnitcadError, RuntimeError):
    """A worker that cannot start: the machine lacks memory, descriptors or processes, or a module fails to load."""

    exit_code = 1


def cores() -> int:
    """Return how many processes can run at the same time."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Call(Future[Any]):
    """The result of a call, which `cancel` takes back until a worker begins it."""

    def __init__(self, request: bytes, seconds: float | None, heard: Callable[[Any], object]) -> None:
        super().__init__()
        self.request, self.seconds, self.heard = request, seconds, heard
        self.worker: _Worker | None = None

    def result_or(self, here: Callable[[], Any], *, wait: bool = False) -> Any:
        """Return the result; call `here` instead if it is lost or, without `wait`, if no worker has begun it."""
        if not wait and self.cancel():
            return here()
        try:
            return self.result()
        except (WorkerEnded, NoWorker, CancelledError):
            return here()

    def stop(self, grace_s: float = 0.0) -> None:
        """Take the call back, or end its worker. With `grace_s`, programs get SIGINT and that time to end."""
        if not self.cancel() and self.worker:
            self.worker.end("was stopped", grace_s, self)


class Pool(Executor):
    """`size` workers, which start now. The end of the block ends them at once.

    memory: bytes of address space of each worker (Linux only). load: modules that each worker imports first.
    """

    def __init__(
        self,
        size: int = 1,
        *,
        memory: int | None = None,
        load: Sequence[str] = (),
    ) -> None:
        self._setup = pickle.dumps((_set_up, (memory, tuple(load)), {}))
        self._lock = threading.RLock()  # a callback of a cancelled call may submit another one
        self._waiting: deque[Call] = deque()
        self._idle: list[queue.SimpleQueue[Call | None]] = []  # the one used last is used next: its memory is warm
        self._workers: set[_Worker] = set()
        self._closed = False
        self._lost = 0  # threads that ended, since their workers can't start; the last thread stays, and raises
        self._size = size
        self._threads: list[threading.Thread] = []
        for _ in range(size):
            thread = threading.Thread(target=self._keep_worker, daemon=True)
            try:
                thread.start()
            except RuntimeError as error:  # no memory for a thread
                if not self._threads:
                    raise NoWorker(f"a worker process cannot start: {error}") from None
                with self._lock:
                    self._lost += size - len(self._threads)
                break
            self._threads.append(thread)

    def submit(
        self,
        fn: Callable[..., Any] | str,
        /,
        *args: Any,
        seconds: float | None = None,
        heard: Callable[[Any], object] = lambda value: None,
        **kwargs: Any,
    ) -> Call:
        """Call a function, which a worker imports by its name; "module:name" if this process need not load it.

        The result raises what the function raises, WorkerEnded also after `seconds`, and NoWorker. `heard` takes each
        value that the function passes to `tell`, in a thread of this pool.
        """
        call = Call(pickle.dumps((fn, args, kwargs)), seconds, heard)
        with self._lock:
            if self._closed:
                raise NoWorker("the workers were stopped")
            self._idle.pop().put(call) if self._idle else self._waiting.append(call)
        return call

    @property
    def pids(self) -> list[int]:
        """The process ids of the workers."""
        return [worker.process.pid for worker in list(self._workers)]

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = True) -> None:
        """End all workers. Their calls raise WorkerEnded, calls that wait are cancelled."""
        with self._lock:
            self._closed = True
            for call in self._waiting:
                call.cancel()
            for inbox in self._idle:
                inbox.put(None)
            for worker in self._workers:
                worker.end("was stopped")
        for thread in self._threads if wait else ():
            thread.join()

    def __exit__(self, *raised: object) -> None:
        self.shutdown()

    def _keep_worker(self) -> None:
        """Hand calls to a worker, and start another one when it ends. A worker ends with the thread that started it."""
        inbox: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        worker: _Worker | None = None
        answered: Callable[[], object] = int  # does nothing
        while True:
            failure, surplus, call = None, False, None
            if worker is None or worker.ended:
                worker, failure = self._replace(worker)
            with self._lock:
                if failure and self._lost < self._size - 1:  # the other workers do without this one
                    self._lost, surplus = self._lost + 1, True
                elif not self._closed:
                    call = self._waiting.popleft() if self._waiting else None
                    if call is None:
                        self._idle.append(inbox)
            answered()  # only now: a caller that calls again gets this worker again
            answered = int
            if surplus or (call is None and (self._closed or (call := inbox.get()) is None)):
                break
            if worker is None or worker.ended:  # it ended while it was idle
                worker, failure = self._replace(worker)
            call.worker = worker
            if worker:
                worker.call = call
            if not call.set_running_or_notify_cancel():
                continue
            try:
                if worker is None:
                    raise failure or NoWorker("the workers were stopped")
                answered = partial(call.set_result, worker.answer(call))
            except BaseException as error:
                call.set_exception(error)
        if worker:
            worker.end("was stopped")
            worker.cause()

    def _replace(self, before: _Worker | None) -> tuple[_Worker | None, NoWorker | None]:
        """Start a worker, at the second try if it was killed meanwhile."""
        if before:
            before.cause()
        why = "the workers were stopped"
        for _ in range(0 if self._closed else 2):
            worker = None
            try:
                worker = _Worker()
                with self._lock:
                    self._workers = {one for one in self._workers if not one.ended} | {worker}
                    if self._closed:
                        worker.end("was stopped")
                worker.answer(Call(self._setup, START_S, print))
                return worker, None
            except Exception as error:
                if worker:
                    worker.cause()
                why = str(error).strip().partition("\n")[0] or type(error).__name__
        return None, NoWorker(f"a worker process cannot start: {why}")


class _Worker:
    """A worker process, as its pool sees it."""

    def __init__(self) -> None:
        root = os.path.dirname(os.path.dirname(__file__))
        code = _CODE.format(path=[*filter(None, sys.path), root])  # not the working directory
        quiet = None if os.environ.get("UNITCAD_TRACEBACK") else subprocess.DEVNULL
        # Its own session: a signal from a terminal reaches only the caller.
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=quiet, start_new_session=True,
        )  # fmt: skip
        self.call: Call | None = None
        """The call that it answers, or will answer next."""
        self._lock = threading.RLock()
        self._why = ""
        self._gone = False

    @property
    def ended(self) -> bool:
        return bool(self._why) or self.process.poll() is not None

    def answer(self, call: Call) -> Any:
        """Return the result of a call. Raises what its function raises, or WorkerEnded."""
        self.call = call
        timer = _timer(call.seconds or 0, self.end, f"timed out after {call.seconds or 0:g} s", 0.0, call)
        whole = False
        try:
            if call.seconds is not None:
                timer.start()
            assert self.process.stdin
            _send(self.process.stdin, call.request)
            while (message := self._message())[0] == "told":
                call.heard(message[1])
            whole = True
        except (OSError, EOFError, pickle.UnpicklingError):
            raise self.cause() from None
        finally:
            timer.cancel()
            with self._lock:
                self.call = None
                if not whole:  # the rest of its answer would be taken for that of the next call
                    self.end("was stopped")
        returned, value = message
        if returned == "raised":
            if isinstance(value, MemoryError):
                self.end("is out of memory")  # memory of its objects is not free for the next call
            raise value
        return value

    def end(self, why: str, grace_s: float = 0.0, call: Call | None = None) -> None:
        """End the worker and all that it started. With `call`, only if it still answers that one."""
        with self._lock:
            if self._gone or (call and self.call is not call):
                return
            self._why = self._why or why
            if grace_s and _POSIX:
                _timer(grace_s, self.end, why).start()
            with contextlib.suppress(OSError):
                if _POSIX:  # the group outlives its first process
                    os.killpg(self.process.pid, signal.SIGINT if grace_s else signal.SIGKILL)
                else:
                    self.process.kill()

    def cause(self) -> WorkerEnded:
        """Wait for the end; return its cause, in words that are the same in every run."""
        why = self._why
        self.end(why or "ended")
        code = self.process.wait()
        self._gone = True  # another process may get its number from now on
        for pipe in (self.process.stdin, self.process.stdout):
            with contextlib.suppress(OSError):
                pipe.close()  # type: ignore[union-attr]
        if why.startswith("timed out"):
            return TimedOut(why)
        by = f"died ({signal.Signals(-code).name})" if code < 0 else f"ended (exit code {code})"
        return WorkerEnded(f"the worker {why or by}")

    def _message(self) -> tuple[str, Any]:
        assert self.process.stdout
        head = _exactly(self.process.stdout, 8)
        if head == b"Timeout ":  # by `limit`
            self._why = "timed out"
            raise EOFError
        return pickle.loads(_exactly(self.process.stdout, int.from_bytes(head, "little")))


def _timer(seconds: float, function: Callable[..., object], *args: object) -> threading.Timer:
    timer = threading.Timer(seconds, function, args)
    timer.daemon = True
    return timer


def limit_memory(size: int | None) -> int | None:
    """Limit this process's address space to `size` bytes, -1 for none (not on Windows); return the limit before."""
    if size is None or not _POSIX:
        return None
    import resource

    before, most = resource.getrlimit(resource.RLIMIT_AS)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (size if most < 0 else min(size, most), most))
    return before


def run(
    command: Sequence[str], *, content: bytes = b"", seconds: float | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a program to its end, `content` on its standard input.

    Raises FileNotFoundError if there is no such program, WorkerEnded after `seconds`.
    """
    with Pool() as pool:
        return pool.submit(run_here, tuple(command), content, dict(env) if env else None, seconds=seconds).result()


# In a worker:

_answers: IO[bytes] | None = None
_sending = threading.Lock()
_programs: list[subprocess.Popen[bytes]] = []


def tell(value: object) -> None:
    """Pass a value on to `heard` of the call that this worker answers; without one, drop it."""
    if _answers:
        with _sending:
            _send(_answers, pickle.dumps(("told", value)))


@contextlib.contextmanager
def limit(seconds: float | None) -> Iterator[None]:
    """End this worker if the block takes longer: by a C thread, which runs even while a kernel has the GIL."""
    if seconds is not None:
        faulthandler.dump_traceback_later(seconds, exit=True, file=_answers or sys.__stderr__ or sys.stderr)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def run_here(
    command: Sequence[str], content: bytes = b"", env: Mapping[str, str] | None = None, lines: bool = False
) -> subprocess.CompletedProcess[bytes]:
    """Run a program within a worker, so that it ends with the worker. With `lines`, `tell` (stream, line) at once."""
    if shutil.which(command[0]) is None:
        raise FileNotFoundError(command[0])
    _die_with_parent(None)  # the end of the pipe ends the whole group instead
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env,
        preexec_fn=_die_with_parent if sys.platform == "linux" else None,
    ) as program:  # fmt: skip
        _programs[:] = [program]
        if not lines:
            output = program.communicate(content)
            return subprocess.CompletedProcess(command, program.returncode, *output)
        streams = (("out", program.stdout), ("err", program.stderr))
        threads = [threading.Thread(target=_tell_lines, args=pair, daemon=True) for pair in streams]
        for thread in threads:
            thread.start()
        program.stdin.close()  # type: ignore[union-attr]
        for thread in threads:
            thread.join()
    return subprocess.CompletedProcess(command, program.returncode)


def _tell_lines(name: str, stream: IO[bytes]) -> None:
    begun = b""
    while piece := os.read(stream.fileno(), 1 << 16):
        *whole, begun = (begun + piece).split(b"\n")
        begun = begun[: 4 * LONGEST_LINE]
        for line in whole:
            tell((name, line.decode("utf-8", "replace").rstrip()[:LONGEST_LINE]))
    if begun:
        tell((name, begun.decode("utf-8", "replace").rstrip()[:LONGEST_LINE]))


def _serve() -> None:
    """Answer requests from standard input until it ends."""
    global _answers
    _die_with_parent()
    # Not SIG_IGN, which programs that are started here would inherit.
    signal.signal(signal.SIGINT, lambda number, frame: None)
    # Input and output of a kernel are kept off the messages.
    requests, _answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    coming: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, coming), daemon=True).start()
    while True:
        try:
            function, args, kwargs = pickle.loads(coming.get())
            function = pkgutil.resolve_name(function) if isinstance(function, str) else function
            answer = "returned", function(*args, **kwargs)
        except (Exception, SystemExit) as error:
            answer = "raised", error
        try:
            message = pickle.dumps(answer)
            if answer[0] == "raised":
                pickle.loads(message)  # an exception may pickle and not come back
        except Exception:
            message = pickle.dumps(("raised", RuntimeError(f"{type(answer[1]).__name__}: {answer[1]}")))
        with _sending:
            _send(_answers, message)


def _set_up(memory: int | None, load: tuple[str, ...]) -> None:
    limit_memory(memory)
    gc.set_threshold(200_000)  # by default modules that load are searched for cycles ninety times
    for name in load:
        importlib.import_module(name)
    gc.collect()
    gc.freeze()  # modules last as long as the process


def _listen(requests: IO[bytes], coming: queue.SimpleQueue[bytes]) -> None:
    """Pass on every request; end this process and its programs with the parent, whatever they are doing."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            coming.put(_exactly(requests, int.from_bytes(_exactly(requests, 8), "little")))
    for program in _programs:
        program.kill()
    if _POSIX:
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def _die_with_parent(number: int | None = signal.SIGKILL) -> None:
    """Have the kernel kill this process when the thread that started it ends, even inside a call; on Linux only."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            import ctypes

            ctypes.CDLL(None).prctl(1, number or 0)  # PR_SET_PDEATHSIG


def _send(pipe: IO[bytes], message: bytes) -> None:
    pipe.write(len(message).to_bytes(8, "little"))
    pipe.write(message)
    pipe.flush()


def _exactly(pipe: IO[bytes], size: int) -> bytes:
    content = pipe.read(size)
    if len(content) < size:
        raise EOFError
    return content

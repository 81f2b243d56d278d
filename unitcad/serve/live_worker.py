"""A worker process of the live page: kept warm, with limits of memory and time, replaced when it dies or hangs."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import os
import signal
import sys
import traceback

from unitcad.children import end_with_parent, message_pipes

_START = "import sys; sys.path[:] = {path!r}; from unitcad.serve.live_worker import work; work({memory!r}, {preload!r})"
MEMORY = 4 << 30
"""Bytes of address space that a worker may take."""
START_S = 60.0
"""Seconds that a worker may take to start, besides those of its first question."""
LARGEST = 64 << 20
"""Bytes of a question or an answer."""
PRELOAD = (
    "unitcad.serve.answers",
    "unitcad.mould_checks",
    "unitcad.estimating",
    "unitcad.export.svg",
    "unitcad.casting.procedure",
)


class WorkerLost(Exception):
    """The end of a worker in the middle of a question: it took too long, too much memory, or crashed."""


class TimeIsUp(WorkerLost):
    """No answer within `seconds`."""

    def __init__(self, seconds: float) -> None:
        super().__init__(f"no answer within {seconds:g} s")
        self.seconds = seconds


class WorkerEnded(WorkerLost):
    """A process that has ended by itself, or by others."""


class Worker:
    """One worker process, which answers one question at a time; another is ready where `prepare` was called."""

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self._child: asyncio.subprocess.Process | None = None
        self._spare: asyncio.Task[asyncio.subprocess.Process] | None = None
        self._closed = False
        self.turn = asyncio.Lock()
        """Whoever asks holds it, and may look after waiting whether the question still stands."""

    @property
    def pid(self) -> int | None:
        """Process id of the worker that runs now."""
        return self._child.pid if self._child and self._child.returncode is None else None

    async def ask(self, function: str, *parts: bytes, seconds: float) -> bytes:
        """Return what a function "module:name" gives for byte strings, under `turn`.

        Raises WorkerLost where the worker hangs, or where it ends and so does another one that is asked the same; the
        next question gets another one.
        """
        try:
            return await self._asked(function, *parts, seconds=seconds)
        except WorkerEnded:
            # It may have ended while it had nothing to do.
            return await self._asked(function, *parts, seconds=seconds)

    def prepare(self, function: str, *parts: bytes) -> None:
        """Have another process ready for when this one is ended, warmed by a question whose answer is not wanted."""
        if self._spare is None and not self._closed:
            self._spare = asyncio.create_task(self._warmed((function.encode(), *parts)))

    async def _warmed(self, parts: tuple[bytes, ...]) -> asyncio.subprocess.Process:
        child = await self._started()
        try:
            async with asyncio.timeout(START_S):
                await self._exchange(child, parts)
        except (TimeoutError, OSError, EOFError, WorkerLost, asyncio.CancelledError):
            await _killed(child)
        return child

    async def _asked(self, function: str, *parts: bytes, seconds: float) -> bytes:
        fresh = self.pid is None
        child = await self._running()
        try:
            async with asyncio.timeout(seconds + START_S * fresh):
                return await self._exchange(child, (function.encode(), *parts))
        except TimeoutError:
            await self._end()
            raise TimeIsUp(seconds) from None
        except (OSError, EOFError):
            await self._end()
            raise WorkerEnded("the worker ended: out of memory, or a fault in a kernel") from None
        except asyncio.CancelledError:
            # Half an answer would be taken for the next one.
            await self._end()
            raise

    async def close(self) -> None:
        """End the worker; no other one is started. A question under way gets WorkerLost."""
        self._closed = True
        spare, self._spare = self._spare, None
        if spare:
            spare.cancel()
            await asyncio.wait([spare])
            if not spare.cancelled():
                await _killed(spare.result())
        await self._end()

    async def _running(self) -> asyncio.subprocess.Process:
        if self._closed:
            raise WorkerLost("the server is ending")
        if self.pid is None and self._spare:
            spare = self._spare
            await asyncio.wait([spare])
            self._spare = None
            self._child = None if spare.cancelled() else spare.result()
        if self.pid is None:
            self._child = await self._started()
        assert self._child
        if self._closed:  # meanwhile
            await self._end()
            raise WorkerLost("the server is ending")
        return self._child

    async def _started(self) -> asyncio.subprocess.Process:
        start = _START.format(path=sys.path, memory=self.memory, preload=PRELOAD)
        return await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-c", start,
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, limit=LARGEST, start_new_session=True,
        )  # fmt: skip

    async def _exchange(self, child: asyncio.subprocess.Process, parts: tuple[bytes, ...]) -> bytes:
        assert child.stdin
        assert child.stdout
        child.stdin.write(b"".join([len(parts).to_bytes(4, "little"), *map(_framed, parts)]))
        await child.stdin.drain()
        ok = await child.stdout.readexactly(1)
        size = int.from_bytes(await child.stdout.readexactly(8), "little")
        content = await child.stdout.readexactly(size)
        if ok != b"\1":
            raise WorkerLost(content.decode("utf-8", "replace"))
        return content

    async def _end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            await _killed(child)


async def _killed(child: asyncio.subprocess.Process) -> None:
    if child.returncode is None:
        # Not child.kill(), which reaps a child that has ended just now, so that asyncio misses its end.
        with contextlib.suppress(ProcessLookupError):
            os.kill(child.pid, signal.SIGKILL)
    await child.wait()


def work(memory: int, preload: tuple[str, ...]) -> None:
    """Answer questions from standard input until it ends."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    questions, answers = message_pipes()
    for name in preload:
        importlib.import_module(name)
    while count := int.from_bytes(questions.read(4), "little"):
        parts = [questions.read(int.from_bytes(questions.read(8), "little")) for _ in range(count)]
        module, _, name = parts[0].decode().partition(":")
        try:
            answer = b"\1", getattr(importlib.import_module(module), name)(*parts[1:])
        except MemoryError:
            answer = b"\0", b"it takes more memory than a worker may have"
        except Exception as error:
            if os.environ.get("UNITCAD_TRACEBACK"):
                traceback.print_exc()
            answer = b"\0", f"internal error: {type(error).__name__}: {error} (a bug)".encode("utf-8", "replace")
        answers.write(answer[0] + _framed(answer[1]))
        answers.flush()


def _framed(content: bytes) -> bytes:
    return len(content).to_bytes(8, "little") + content

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


class Worker:
    """One worker process, which answers one question at a time."""

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self._child: asyncio.subprocess.Process | None = None
        self._closed = False
        self.turn = asyncio.Lock()
        """Whoever asks holds it, and may look after waiting whether the question still stands."""

    @property
    def pid(self) -> int | None:
        """Process id of the worker that runs now."""
        return self._child.pid if self._child and self._child.returncode is None else None

    async def ask(self, function: str, *parts: bytes, seconds: float) -> bytes:
        """Return what a function "module:name" gives for byte strings, under `turn`.

        Raises WorkerLost where the worker hangs or ends; the next question gets another one.
        """
        fresh = self.pid is None
        child = await self._running()
        try:
            async with asyncio.timeout(seconds + START_S * fresh):
                return await self._exchange(child, (function.encode(), *parts))
        except TimeoutError:
            await self._end()
            raise WorkerLost(f"no answer within {seconds:g} s") from None
        except (OSError, EOFError):
            await self._end()
            raise WorkerLost("the worker ended: out of memory, or a fault in a kernel") from None
        except asyncio.CancelledError:
            # Half an answer would be taken for the next one.
            await self._end()
            raise

    async def close(self) -> None:
        """End the worker; no other one is started. A question under way gets WorkerLost."""
        self._closed = True
        await self._end()

    async def _running(self) -> asyncio.subprocess.Process:
        if self._closed:
            raise WorkerLost("the server is ending")
        if self._child is None or self._child.returncode is not None:
            start = _START.format(path=sys.path, memory=self.memory, preload=PRELOAD)
            self._child = await asyncio.create_subprocess_exec(
                sys.executable, "-P", "-c", start,
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, limit=LARGEST, start_new_session=True,
            )  # fmt: skip
        if self._closed:  # meanwhile
            await self._end()
            raise WorkerLost("the server is ending")
        return self._child

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

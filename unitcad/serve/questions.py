"""The questions of the pages, each to the worker for its kind; a newer one of a page takes an older one's place."""

from __future__ import annotations

import asyncio
import contextlib

import msgspec

from unitcad.serve.live_worker import TimeIsUp, Worker, WorkerLost
from unitcad.serve.messages import Ask, Trusted, What

ANSWER_S: dict[What, float] = {"unit": 20.0, "moulds": 60.0, "estimate": 30.0}
"""Seconds that a question may take, by what is asked."""
GRACE_S = 1.5
"""Seconds after which an overtaken question is ended: before, its answer is nearer than another worker."""
_UNDONE: dict[What, str] = {"unit": "not made", "moulds": "not judged", "estimate": "not estimated"}
_MOST_PAGES = 100
"""Pairs of a page and a question whose newest one is remembered."""


class Superseded(Exception):
    """A newer question of the same page about the same thing."""


class Questions:
    """The workers, one for each kind of question; they are warmed up with the first text."""

    def __init__(self, text: str, trusted: Trusted) -> None:
        self.workers = {what: Worker() for what in ANSWER_S}
        self.trusted = msgspec.json.encode(trusted)
        self._text = text
        self._newest: dict[tuple[str, What], asyncio.Event] = {}

    async def warm(self, what: What) -> None:
        """Have a worker answer about the first text."""
        worker = self.workers[what]
        with contextlib.suppress(WorkerLost):
            async with worker.turn:
                await worker.ask(*self._parts(Ask(text=self._text, what=what)), seconds=ANSWER_S[what])

    async def ask(self, ask: Ask) -> bytes:
        """Return the answer to a question. Raises Superseded where a newer one of its page came, WorkerLost."""
        worker = self.workers[ask.what]
        overtaken = self._overtake(ask)
        async with worker.turn:
            if overtaken.is_set():
                raise Superseded
            answer = asyncio.create_task(worker.ask(*self._parts(ask), seconds=ANSWER_S[ask.what]))
            try:
                await asyncio.wait([answer], timeout=GRACE_S)
                if not answer.done():
                    worker.prepare(*self._parts(Ask(text=self._text, what=ask.what)))
                    await _either(answer, overtaken)
                if not answer.done():
                    raise Superseded
                return await answer
            except TimeIsUp as error:
                raise WorkerLost(f"{_UNDONE[ask.what]}: it took more than {error.seconds:g} s") from None
            finally:
                answer.cancel()  # which ends its worker, where it is under way
                await asyncio.wait([answer])

    async def close(self) -> None:
        """End the workers; a question under way is answered that the server is ending."""
        await asyncio.gather(*(worker.close() for worker in self.workers.values()))

    def _overtake(self, ask: Ask) -> asyncio.Event:
        """Tell the older question of the same page; returns what a newer one will set."""
        key = ask.page, ask.what
        older = self._newest.pop(key, None)
        if older:
            older.set()
        self._newest[key] = overtaken = asyncio.Event()
        while len(self._newest) > _MOST_PAGES:
            del self._newest[next(iter(self._newest))]
        return overtaken

    def _parts(self, ask: Ask) -> tuple[str, bytes, bytes]:
        return "unitcad.serve.answers:respond", msgspec.json.encode(ask), self.trusted


async def _either(answer: asyncio.Task[bytes], event: asyncio.Event) -> None:
    """Wait until an answer is there or an event is set."""
    waiting = asyncio.create_task(event.wait())
    try:
        await asyncio.wait([answer, waiting], return_when=asyncio.FIRST_COMPLETED)
    finally:
        waiting.cancel()

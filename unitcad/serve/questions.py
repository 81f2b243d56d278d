"""The questions of the pages, each to the worker for its kind; a newer one of a page takes an older one's place."""

from __future__ import annotations

import asyncio

import msgspec

from unitcad.errors import UnitcadError
from unitcad.serve.messages import ALL, Ask, Held, Trusted, What
from unitcad.workers import Pool, TimedOut, WorkerEnded

ANSWER_S: dict[What, float] = {"unit": 20.0, "moulds": 60.0, "estimate": 30.0}
"""Seconds that a question may take, by its kind."""
GRACE_S = 1.5
"""Seconds after which an overtaken question is ended: before, its answer is nearer than another worker."""
_UNDONE: dict[What, str] = {"unit": "not made", "moulds": "not judged", "estimate": "not estimated"}
MEMORY = 4 << 30
"""Bytes of address space that a worker may take."""
PRELOAD = (
    "unitcad.serve.answers",
    "unitcad.checks",
    "unitcad.estimate_inputs",
    "unitcad.export.svg",
    "unitcad.casting.procedure",
)
_MOST_PAGES = 100
"""Pairs of a page and a question whose newest one is remembered."""


class Superseded(Exception):
    """A newer question of the same page about the same thing."""


class Questions:
    """The workers, one for each kind of question, so that its parts stay in its memory."""

    def __init__(self, text: str, trusted: Trusted, held: Held = ALL) -> None:
        self.trusted, self.held = msgspec.json.encode(trusted), msgspec.json.encode(held)
        self._text = text
        self._pools: dict[What, Pool] = {}
        self.turns = {what: asyncio.Lock() for what in ANSWER_S}
        self._newest: dict[tuple[str, What], asyncio.Future[None]] = {}

    def pool(self, what: What) -> Pool:
        """Return the worker of a kind, which first answers the question of the text at the start: this warms it up."""
        if what not in self._pools:
            self._pools[what] = Pool(memory=MEMORY, load=PRELOAD)
            self._pools[what].submit(*self._parts(Ask(text=self._text, what=what)), seconds=ANSWER_S[what])
        return self._pools[what]

    async def ask(self, ask: Ask) -> bytes:
        """Return the answer to a question. Raises Superseded if a newer one of its page came, WorkerEnded, NoWorker."""
        overtaken = self._overtake(ask)
        async with self.turns[ask.what]:
            if overtaken.done():
                raise Superseded
            answer = asyncio.create_task(self.call(ask.what, *self._parts(ask), seconds=ANSWER_S[ask.what]))
            try:
                await asyncio.wait([answer], timeout=GRACE_S)
                await asyncio.wait([answer, overtaken], return_when=asyncio.FIRST_COMPLETED)
                if not answer.done():
                    raise Superseded
                return await answer
            except TimedOut:
                raise WorkerEnded(f"{_UNDONE[ask.what]}: it took more than {ANSWER_S[ask.what]:g} s") from None
            finally:
                answer.cancel()  # which ends its worker if it is under way
                await asyncio.wait([answer])

    async def call(self, what: What, function: str, *parts: bytes, seconds: float) -> bytes:
        """Call a function "module:name" in the worker of a kind; once more if the worker ends by itself."""
        for left in (1, 0):
            call = self.pool(what).submit(function, *parts, seconds=seconds)
            try:
                return await asyncio.wrap_future(call)
            except TimedOut:
                raise
            except WorkerEnded:  # it may have ended while it had nothing to do
                if not left:
                    raise
            except MemoryError:
                raise WorkerEnded("it takes more memory than a worker may have") from None
            except UnitcadError:
                raise
            except asyncio.CancelledError:
                task = asyncio.current_task()
                if task is None or task.cancelling():
                    raise
                raise WorkerEnded("its worker was stopped before it began") from None
            except Exception as error:
                raise WorkerEnded(f"internal error: {type(error).__name__}: {error} (a bug)") from error
            finally:
                call.stop()
        raise AssertionError

    async def close(self) -> None:
        """End the workers; a question under way is answered that its worker was stopped."""
        await asyncio.gather(*(asyncio.to_thread(pool.shutdown) for pool in self._pools.values()))

    def _overtake(self, ask: Ask) -> asyncio.Future[None]:
        """Notify the older question of the same page; return the future that a newer one will end."""
        key = ask.page, ask.what
        older = self._newest.pop(key, None)
        if older:
            older.set_result(None)
        self._newest[key] = overtaken = asyncio.get_running_loop().create_future()
        while len(self._newest) > _MOST_PAGES:
            del self._newest[next(iter(self._newest))]
        return overtaken

    def _parts(self, ask: Ask) -> tuple[str, bytes, bytes, bytes]:
        return "unitcad.serve.answers:respond", msgspec.json.encode(ask), self.trusted, self.held

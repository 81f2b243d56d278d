"""Whose question a worker is on: one that is overtaken is ended after a grace, and none of another page."""

import asyncio
import contextlib
import os
import signal
import time

import msgspec
import pytest
from running import apart

from unitcad.errors import UnitcadError
from unitcad.serve import questions
from unitcad.serve.messages import Ask, Trusted
from unitcad.serve.questions import Questions, Superseded
from unitcad.workers import WorkerEnded


def answered(message, trusted):
    """Answer in a worker as a test says in the question's text: the seconds that it takes, or "die"."""
    ask = msgspec.json.decode(message, type=Ask)
    if ask.text == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(float(ask.text))
    return str(os.getpid()).encode()


def with_questions(act):
    """Act on questions whose workers have answered one each."""

    async def run():
        asked = Questions("0", Trusted())
        try:
            for what in ("unit", "moulds"):
                await asked.call(
                    what, f"{__name__}:answered", msgspec.json.encode(Ask(text="0", what=what)), b"", seconds=60
                )
            await asyncio.sleep(0.5)
            await act(asked)
        finally:
            await asked.close()

    apart(run())


@pytest.fixture(autouse=True)
def _answers(monkeypatch):
    monkeypatch.syspath_prepend(os.path.dirname(__file__))
    monkeypatch.setattr("unitcad.serve.questions.PRELOAD", ())
    monkeypatch.setattr(Questions, "_parts", lambda self, ask: (f"{__name__}:answered", msgspec.json.encode(ask), b""))
    monkeypatch.setattr(questions, "GRACE_S", 0.5)


def last_pid(asked):
    """The worker that answers next: the one used last."""
    return asked.pool("moulds").submit(os.getpid).result()


def asking(asked, text, page="a", what="moulds"):
    return asyncio.create_task(asked.ask(Ask(text=text, what=what, page=page)))


def test_an_overtaken_question_is_ended_with_its_worker():
    async def act(asked):
        first = last_pid(asked)
        older = asking(asked, "60")
        await asyncio.sleep(2.0)
        newer = asking(asked, "0")
        with pytest.raises(Superseded):
            await older
        assert int(await newer) != first
        # It can be done again.
        older = asking(asked, "60")
        await asyncio.sleep(0.1)
        newer = asking(asked, "0")
        await newer
        assert older.done()

    with_questions(act)


def test_a_burst_of_edits_keeps_the_worker():
    async def act(asked):
        first = last_pid(asked)
        every = []
        for _ in range(20):
            every.append(asking(asked, "0.1"))
            await asyncio.sleep(0.02)
        done = await asyncio.gather(*every, return_exceptions=True)
        assert int(done[-1]) == first
        assert any(isinstance(one, Superseded) for one in done)
        assert last_pid(asked) == first

    with_questions(act)


def test_another_page_s_question_is_not_ended():
    async def act(asked):
        first = last_pid(asked)
        other = asking(asked, "2", "b")
        await asyncio.sleep(0.1)
        mine = [asking(asked, "0", "a") for _ in range(3)]
        others_unit = asking(asked, "0", "b", "unit")  # another kind, which overtakes nothing
        assert int(await other) == first
        done = await asyncio.gather(*mine, return_exceptions=True)
        assert [isinstance(one, Superseded) for one in done] == [True, True, False]
        await others_unit

    with_questions(act)


def test_a_worker_killed_while_idle_is_replaced_unseen():
    async def act(asked):
        pid = last_pid(asked)
        os.kill(pid, signal.SIGKILL)
        assert int(await asking(asked, "0")) != pid
        # It ends right under the question.
        pid = last_pid(asked)
        under_way = asking(asked, "0.3")
        await asyncio.sleep(0.1)
        os.kill(pid, signal.SIGKILL)
        assert int(await under_way) != pid
        with pytest.raises(WorkerEnded, match="worker died"):
            await asking(asked, "die")
        assert int(await asking(asked, "0"))

    with_questions(act)


def test_a_time_limit_is_told_as_one(monkeypatch):
    async def act(asked):
        monkeypatch.setitem(questions.ANSWER_S, "moulds", 1.0)
        with pytest.raises(WorkerEnded, match="not judged: it took more than 1 s"):
            await asking(asked, "60")
        monkeypatch.setitem(questions.ANSWER_S, "moulds", 60.0)  # a new worker takes its time to start
        assert int(await asking(asked, "0"))

    with_questions(act)


def test_no_process_is_left(monkeypatch):
    """Those under way and the one that is made ready end with the questions."""
    pids = []

    async def act(asked):
        asked._text = "30"
        under_way = asking(asked, "60")
        await asyncio.sleep(1.0)
        pids.extend(pid for pool in asked._pools.values() for pid in pool.pids)
        await asked.close()
        with contextlib.suppress(UnitcadError):
            await under_way

    with_questions(act)
    assert len(pids) == 2
    assert not any(os.path.exists(f"/proc/{pid}") for pid in pids)

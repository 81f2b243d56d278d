"""What the page shows of a question that has no answer: in time, at all, or none but an overtaken one's."""

from __future__ import annotations

import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from live import WALL, Live
from running import Server, serving


def fulfil(visit: Live, answer: Any) -> None:
    """Answer questions in the server's place where `answer`, given one, has something: a status and a message."""

    def handle(route: Any) -> None:
        given = answer(route.request.post_data_json)
        if given == "never":
            return
        if given:
            route.fulfill(status=given[0], content_type="application/json", body=json.dumps(given[1]))
        else:
            route.continue_()

    visit.page.route("**/ask", handle)


def test_a_time_limit_is_not_told_as_a_refusal(running: Any, server: Server) -> None:
    visit, late = Live(running, server), {"moulds": "not judged: it took more than 60 s"}
    late["estimate"] = "not estimated: it took more than 30 s"
    fulfil(
        visit, lambda ask: ask["what"] in late and (500, {"faults": [{"message": late[ask["what"]]}], "again": True})
    )
    visit.page.fill(WALL, "1.3")
    visit.until(lambda: visit.state == "moulds not judged")
    visit.settled()
    assert "took more than 60 s" in visit.page.inner_text("#faults")
    assert "took more than 30 s" in visit.page.inner_text("#estimated")
    assert "no moulds" not in visit.page.inner_text("#page")
    late.clear()
    visit.pressed(visit.page.locator("#faults").get_by_role("button", name="Try again"))
    assert "passed" in visit.state
    assert visit.page.inner_text("#faults") == ""
    visit.console.clear()  # the 500s
    visit.close()


def test_a_fault_of_the_server_leaves_paler_figures_and_a_button(running: Any, server: Server) -> None:
    visit, ended = Live(running, server), [True]
    fault = {"faults": [{"message": "the worker ended: out of memory, or a fault in a kernel"}], "again": True}
    fulfil(visit, lambda ask: ask["what"] == "unit" and ended and (500, fault))
    visit.page.fill(WALL, "1.3")
    visit.until(lambda: "worker ended" in visit.state)
    visit.settled()
    assert visit.page.get_attribute("#page", "data-stale") == "true"
    paler = "(one) => getComputedStyle(document.querySelector(one)).opacity"
    assert [visit.page.evaluate(paler, one) for one in ("#figures", "#glance", "#estimated")] == ["0.55"] * 3
    ended.clear()
    visit.pressed(visit.page.locator("#faults").get_by_role("button", name="Try again"))
    assert "passed" in visit.state
    assert "wall_mm = 1.3" in visit.page.input_value("#text")
    assert visit.page.evaluate(paler, "#figures") == "1"
    visit.console.clear()
    visit.close()


def test_the_next_question_does_not_wait_for_one_that_takes_long(running: Any, server: Server) -> None:
    visit = Live(running, server)
    fulfil(visit, lambda ask: ask["what"] == "moulds" and "wall_mm = 1.3\n" in ask["text"] and "never")
    visit.page.fill(WALL, "1.3")
    visit.until(lambda: visit.state == "judging the moulds")
    visit.page.fill(WALL, "1.4")
    visit.until(lambda: "passed" in visit.state)
    visit.page.unroute("**/ask")
    visit.close()


@pytest.mark.parametrize("count", [1, 3])
def test_workers_that_are_killed_while_idle_are_not_noticed(running: Any, tmp_path: Path, count: int) -> None:
    with serving(tmp_path) as own:
        visit = Live(running, own)
        children = Path(f"/proc/{own.process.pid}/task/{own.process.pid}/children").read_text().split()
        for pid in children[:count]:
            os.kill(int(pid), signal.SIGKILL)
        visit.choose(WALL, "1.3")
        assert "passed" in visit.state
        visit.close()


def test_an_overtaken_question_is_no_fault(server: Server, text: str) -> None:
    """Two of one page at the same time, of which the newer one is put while the older one waits for the first."""
    with ThreadPoolExecutor(3) as asking:
        every = []
        for _ in range(3):
            every.append(asking.submit(server.send, "/ask", {"text": text, "what": "moulds", "page": "same"}))
            time.sleep(0.05)
        answers = [one.result() for one in every]
    assert [status for status, _, _ in answers] == [200, 200, 200]
    told = [json.loads(content) for _, content, _ in answers]
    assert told[1] == {"superseded": True}
    assert told[2]["checks"]

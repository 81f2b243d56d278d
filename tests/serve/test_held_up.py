"""Clients and files that would hold up others: downloads that nobody reads, askers that leave, huge files, two jobs."""

import asyncio
import json
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from running import TOKEN, against, serving

from unitcad.files import TEMPORARY, scratch
from unitcad.serve.access_keys import AccessKeys
from unitcad.serve.request_guard import Limits, RequestGuard
from unitcad.serve.server import Connection

HEAD = f"GET / HTTP/1.1\r\nHost: x:1\r\nX-Unitcad-Token: {TOKEN}\r\n\r\n".encode()


class Quick(Connection):
    """A connection whose client may take nothing for a short time."""

    write_s = 0.3


def behind_a_guard(app, client):
    """Run a client against an app behind a guard that lets one request in."""
    guard = RequestGuard(app, TOKEN, frozenset({"x:1"}), "cookie", AccessKeys(TOKEN), Limits(requests=1))
    against(guard, Quick, client, timeout_graceful_shutdown=1)


def answered(connect):
    """Ask until the only place is free; a test's time limit is 20 s."""
    end = time.monotonic() + 20
    while True:
        with connect() as line:
            line.sendall(HEAD)
            if b" 200 " in line.recv(100):
                return
        assert time.monotonic() < end, "the place does not get free"
        time.sleep(0.05)


def test_an_answer_that_nobody_reads_frees_its_place():
    begun = threading.Event()

    async def app(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(1 if begun.is_set() else 500):
            await send({"type": "http.response.body", "body": b"x" * (1 << 20), "more_body": True})
            begun.set()
        await send({"type": "http.response.body", "body": b""})

    def client(connect):
        with connect() as unread:
            unread.sendall(HEAD)
            assert begun.wait(10)
            answered(connect)

    behind_a_guard(app, client)


def test_an_asker_who_leaves_ends_the_work_for_the_answer():
    begun, ended = threading.Event(), threading.Event()

    async def app(scope, receive, send):
        if not begun.is_set():
            begun.set()
            try:
                await asyncio.sleep(600)
            finally:
                ended.set()
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    def client(connect):
        with connect() as leaving:
            leaving.sendall(HEAD)
            assert begun.wait(10)
        assert ended.wait(10)
        answered(connect)

    behind_a_guard(app, client)


def test_an_address_is_bounded_without_a_token(server):
    """A check of the key of each of its folders would take minutes."""
    for path in ("/files/" + "a/" * 5000, "/?" + "&" * 5000):
        head = f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n"
        assert b" 414 " in server.raw(head.encode())


def test_of_two_jobs_at_once_one_runs_and_a_refused_sweep_leaves_nothing(server, text):
    sweep = {"text": text, "key": "no_such_key", "low": 1.0, "high": 2.0, "count": 2}
    before = sorted(server.folder.rglob("*"))
    with ThreadPoolExecutor(4) as apart:
        answers = list(apart.map(lambda _: server.send("/sweep", sweep), range(4)))
    assert sorted(status for status, *_ in answers) == [200, 422, 422, 422]
    state, _ = server.ended(next(json.loads(content) for status, content, _ in answers if status == 200))
    assert state["code"] == 2, state
    assert sorted(server.folder.rglob("*")) == before


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows")
def test_a_start_removes_the_leftovers_of_a_killed_server_and_none_of_a_live_one(tmp_path, text):
    out = tmp_path / "out"
    out.mkdir()
    with scratch(out) as live:
        killed = (
            "import os, pathlib, signal, sys; from unitcad.files import scratch"
            "; kept = scratch(pathlib.Path(sys.argv[1]))"
            "; kept.__enter__(); os.kill(os.getpid(), signal.SIGKILL)"
        )
        subprocess.run([sys.executable, "-P", "-c", killed, str(out)])
        assert len(list(out.glob(f"{TEMPORARY}*"))) == 2
        with serving(tmp_path, "embedded"):
            assert list(out.glob(f"{TEMPORARY}*")) == [live]


def test_the_token_is_of_the_environment_and_not_passed_on(server, text):
    assert server.token == TOKEN
    server.ask(text)  # its workers have started
    proc = Path(f"/proc/{server.process.pid}")
    if proc.exists():
        assert TOKEN.encode() not in (proc / "cmdline").read_bytes()
        tasks = (proc / "task").iterdir()
        children = {pid for task in tasks for pid in (task / "children").read_text().split()}
        assert children
        assert not any(TOKEN.encode() in Path(f"/proc/{pid}/environ").read_bytes() for pid in children)

"""Requests and files that would hold up others: long addresses, two jobs, leftovers."""

import json
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from running import serving

from unitcad.files import TEMPORARY, scratch


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

"""Commands that start other processes: nothing runs on after the command, however it ends."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

sys.path += [str(Path(__file__).parent.parent / room) for room in ("sweeps", "serve")]
from batching import command, environment, ring_sweep
from process_trees import below, left, until
from running import Server

from unitcad.validation import templates

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def build(folder):
    """A build of eight units, with STEP, in mid-work: its helper is there."""
    return command("build", *["three-layer"] * 8, "-o", folder / "out"), 1


def batch(folder):
    sweep = ring_sweep(folder / "s", "slow", [float(height) for height in range(2, 20)])
    return command("batch", sweep, "-o", folder / "out", "-j", 2, "--cache", folder / "cache"), 2


def check(folder):
    """A check of files that take long to read."""
    rows = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"v {i} {i % 7} {i % 11}\n" for i in range(300_000))
    rows += "".join(f"f {i + 1} {i + 2} {i + 3}\n" for i in range(300_000))
    for name in ("a.obj", "b.obj", "c.obj"):
        (folder / name).write_text(rows)
    return command("check", "--jobs", 2, *(folder / name for name in ("a.obj", "b.obj", "c.obj"))), 2


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=lambda end: end.name)
@pytest.mark.parametrize("started", [build, batch, check], ids=lambda started: started.__name__)
def test_a_command_leaves_no_process(started, end, tmp_path):
    words, workers = started(tmp_path)
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(), start_new_session=True
    )
    try:
        others = below(process, workers)
        process.send_signal(end)
        _, errors = process.communicate(timeout=30)
        assert left(others) == []
        assert process.returncode == (130 if end == signal.SIGINT else -end)
        assert "Traceback" not in errors
    finally:
        process.kill()


def test_a_server_that_is_killed_in_mid_sweep_leaves_no_process(tmp_path):
    words = command("serve", "--no-browser", "encapsulating")
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout
        server = Server(process.stdout.readline().strip(), process)
        text = templates()["encapsulating"].read_text("utf-8")
        swept = {"text": text, "key": "diameter_mm", "low": 14.0, "high": 20.0, "count": 24}
        status, content, _ = server.send("/sweep", swept)
        assert status == 200, content
        job = json.loads(content)["job"]
        until(lambda: json.loads(server.send(f"/job/{job}")[1])["stage"].partition(" ")[0] not in ("", "0"))
        others = below(process, 4)  # workers of questions, the one of the job, its batch, the batch's own
        assert any("batch" in other.cmdline() for other in others)
        os.kill(process.pid, signal.SIGKILL)
        assert left(others) == []
    finally:
        process.kill()
        process.communicate()

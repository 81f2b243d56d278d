"""Commands that start other processes: nothing runs on after the command, however it ends."""

import os
import signal
import subprocess
import sys

import pytest
from process_trees import below, left, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def build(folder):
    """A build of eight units, with STEP, in mid-work: its helper is there."""
    return ["build", *["three-layer"] * 8, "-o", folder / "out"], 1


def check(folder):
    """A check of files that take long to read."""
    rows = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"v {i} {i % 7} {i % 11}\n" for i in range(300_000))
    rows += "".join(f"f {i + 1} {i + 2} {i + 3}\n" for i in range(300_000))
    for name in ("a.obj", "b.obj", "c.obj"):
        (folder / name).write_text(rows)
    return ["check", "--jobs", 2, *(folder / name for name in ("a.obj", "b.obj", "c.obj"))], 2


@pytest.mark.parametrize(
    ("started", "end"),
    [(build, signal.SIGKILL), (build, signal.SIGTERM), (check, signal.SIGKILL), (check, signal.SIGINT)],
)
def test_a_command_leaves_no_process(started, end, tmp_path):
    check_nothing_is_left(*started(tmp_path), end)


def check_nothing_is_left(words, workers, end, begun=lambda: True):
    """Check that a command with so many workers, whose work has `begun`, ends by a signal, and they with it."""
    command = [sys.executable, "-m", "unitcad", *map(str, words)]
    unbuffered = {**os.environ, "PYTHONUNBUFFERED": "1", "UNITCAD_TRACEBACK": ""}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=unbuffered, start_new_session=True
    )
    try:
        others = below(process, workers)
        until(begun)
        process.send_signal(end)
        _, errors = process.communicate(timeout=30)
        assert left(others) == []
        assert process.returncode == (130 if end == signal.SIGINT else -end)
        assert "Traceback" not in errors
    finally:
        process.kill()

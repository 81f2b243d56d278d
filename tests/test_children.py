"""Programs that were started end with this process, however it ends: nothing is left running."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from unitcad import children

STUBBORN = (
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('up', flush=True); time.sleep(600)"
)
ENDS = [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, "timeout"]
"""`timeout`: how a batch's --timeout ends a worker."""


def _parent(body: str, end: object) -> subprocess.Popen[str]:
    guard = "import faulthandler; faulthandler.dump_traceback_later(3, exit=True)\n" if end == "timeout" else ""
    return subprocess.Popen(
        [sys.executable, "-c", guard + body], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )


def _end(parent: subprocess.Popen[str], end: object) -> list[psutil.Process]:
    """Ends a parent whose program says that it is up; returns which of its descendants are left."""
    assert parent.stdout is not None
    assert parent.stdout.readline().strip()
    below = psutil.Process(parent.pid).children(recursive=True)
    assert below
    if isinstance(end, signal.Signals):
        parent.send_signal(end)
    parent.communicate(timeout=60)
    return psutil.wait_procs(below, timeout=15)[1]


@pytest.mark.parametrize("end", ENDS, ids=str)
def test_a_program_ends_with_its_parent(end: object) -> None:
    body = (
        "import sys; from unitcad import children\n"
        f"with children.started([sys.executable, '-c', {STUBBORN!r}]) as keeper:\n"
        "    print(keeper.stdout.readline().decode(), flush=True)\n"
        "    keeper.wait()\n"
    )
    assert _end(_parent(body, end), end) == []


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Xvfb")
@pytest.mark.parametrize("end", ENDS, ids=str)
def test_the_virtual_display_ends_with_its_parent(end: object) -> None:
    body = (
        "import time; from unitcad.export import picture\n"
        "with picture._virtual_display() as display:\n"
        "    print(display, flush=True)\n"
        "    time.sleep(600)\n"
    )
    assert _end(_parent(body, end), end) == []


def test_a_killed_keeper_takes_its_program_along() -> None:
    if sys.platform != "linux":
        pytest.skip("a parent-death signal is Linux's")
    with children.started([sys.executable, "-c", STUBBORN]) as keeper:
        assert keeper.stdout is not None
        assert keeper.stdout.readline() == b"up\n"
        below = psutil.Process(keeper.pid).children()
        keeper.kill()
        assert psutil.wait_procs(below, timeout=10)[1] == []


def test_a_program_gets_its_content_and_hands_back_what_it_says() -> None:
    content = bytes(range(256)) * 40_000
    code = "import sys; sys.stdout.buffer.write(sys.stdin.buffer.read()); sys.stderr.write('e'); sys.exit(7)"
    done = children.run([sys.executable, "-c", code], content=content, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (7, content, b"e")


def test_a_program_that_does_not_read_or_dies_is_no_error() -> None:
    code = "import os; os.abort()"
    assert children.run([sys.executable, "-c", code], content=b"x" * 10_000_000).returncode == 128 + signal.SIGABRT


def test_a_program_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    start = time.monotonic()
    with pytest.raises(subprocess.TimeoutExpired):
        children.run(["sleep", "600"], timeout=0.5)
    assert time.monotonic() - start < 5
    assert not [child for child in psutil.Process().children(recursive=True) if "sleep" in child.name()]


def test_there_is_no_such_program() -> None:
    with pytest.raises(FileNotFoundError):
        children.run(["no-such-program-of-ours"])

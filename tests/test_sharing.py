"""Work that a copy of the process shares: same results in the same order, whatever becomes of the copy."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from unitcad import sharing

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies are made on Linux")


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sharing, "cores", lambda: 2)


def _slow(k: int) -> tuple[int, int]:
    time.sleep(0.01)
    return k, os.getpid()


def _no_child_left() -> bool:
    try:
        return os.waitpid(-1, os.WNOHANG) == (0, 0)
    except ChildProcessError:
        return True


def test_two_processes_share_the_parts() -> None:
    with sharing.two_cores():
        done = sharing.shared(_slow, 30)
    assert [k for k, _ in done] == list(range(30))
    assert len({process for _, process in done}) == 2
    assert _no_child_left()


@pytest.mark.parametrize("allowed", [True, False])
def test_what_is_small_or_not_allowed_is_done_here(allowed: bool) -> None:
    if allowed:
        with sharing.two_cores():
            done = sharing.shared(_slow, 5, large=False)
    else:
        done = sharing.shared(_slow, 5)
    assert {process for _, process in done} == {os.getpid()}


def test_what_comes_first_is_done_here_while_the_copy_works() -> None:
    first: list[int] = []

    def begin() -> None:
        time.sleep(0.3)
        first.append(os.getpid())

    with sharing.two_cores():
        done = sharing.shared(_slow, 3, first=begin)
    assert first == [os.getpid()]
    assert os.getpid() not in {process for _, process in done}


@pytest.mark.parametrize("fate", ["killed", "raises"])
def test_what_a_copy_does_not_bring_back_is_done_here(fate: str) -> None:
    here = os.getpid()

    def work(k: int) -> int:
        time.sleep(0.01)
        if os.getpid() != here and k > 2:
            if fate == "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            raise ValueError
        return k * k

    with sharing.two_cores():
        assert sharing.shared(work, 20) == [k * k for k in range(20)]
    assert _no_child_left()


def test_where_no_copy_can_be_made_all_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_left() -> int:
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", none_left)
    before = len(os.listdir("/proc/self/fd"))
    with sharing.two_cores():
        assert {process for _, process in sharing.shared(_slow, 5)} == {os.getpid()}
    assert len(os.listdir("/proc/self/fd")) == before


def test_an_error_is_raised_here_and_the_copy_ended() -> None:
    def work(k: int) -> int:
        time.sleep(0.01)
        if k == 7:
            raise ValueError("seven")
        return k

    with sharing.two_cores(), pytest.raises(ValueError, match="seven"):
        sharing.shared(work, 20)
    assert _no_child_left()


def test_a_copy_ends_with_the_process(tmp_path: Path) -> None:
    """Killed, so that it can end nothing itself."""
    program = (
        "import os, time; from pathlib import Path; from unitcad import sharing; sharing.cores = lambda: 2\n"
        f"def work(k): Path({str(tmp_path)!r}, str(os.getpid())).touch(); time.sleep(60)\n"
        "with sharing.two_cores(): sharing.shared(work, 2)"
    )
    child = subprocess.Popen([sys.executable, "-c", program])
    until = time.monotonic() + 30
    while len(begun := list(tmp_path.iterdir())) < 2 and time.monotonic() < until:
        time.sleep(0.05)
    child.kill()
    child.wait()
    assert len(begun) == 2
    for process in begun:
        while Path("/proc", process.name).exists() and time.monotonic() < until:
            time.sleep(0.05)
        assert not Path("/proc", process.name).exists()

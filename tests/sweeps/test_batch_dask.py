"""Dask: a real scheduler, two workers on loopback, one killed half way; a scheduler that does not answer."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from batching import bytes_of, command, environment, ring_sweep, rows, unitcad

pytest.importorskip("distributed")


class Cluster:
    """Processes of the `dask` command; workers keep nothing on this disk but their own scratch folder."""

    def __init__(self, folder: Path, *tls: str, workers: int = 2) -> None:
        self.folder, self.workers = folder, []
        scheme = "tls" if tls else "tcp"
        here = ("--host", f"{scheme}://127.0.0.1", "--no-dashboard", *tls)
        self.scheduler = self._start("scheduler", "--port", "0", *here)
        self.address = self._read(self.scheduler, rf"Scheduler at:\s+({scheme}://\S+)")
        for _ in range(workers):
            self.workers.append(self._start("worker", self.address, "--no-nanny", "--nthreads", "1", *here))
            self._read(self.workers[-1], r"(Registered to)")

    def _start(self, kind: str, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", kind, *words],
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
            cwd=self.folder,
            env=environment(),
        )

    def _read(self, child: subprocess.Popen[str], pattern: str) -> str:
        assert child.stderr is not None
        for line in child.stderr:
            if match := re.search(pattern, line):
                return match[1]
        raise AssertionError("dask did not start")

    def close(self) -> None:
        for child in (*self.workers, self.scheduler):
            child.kill()
            child.communicate()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    (tmp_path / "cluster").mkdir()
    cluster = Cluster(tmp_path / "cluster")
    yield cluster
    cluster.close()


def test_a_cluster_that_loses_a_worker_makes_the_same_bytes(cluster: Cluster, tmp_path: Path) -> None:
    heights = [float(h) for h in range(2, 7)]
    sweep, out = ring_sweep(tmp_path / "s", "slow", heights, materials=5), tmp_path / "out"
    child = subprocess.Popen(
        command("batch", sweep, "-o", out, "--scheduler", cluster.address, "--json"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    end = time.monotonic() + 60
    while len(list(out.glob("ring-*"))) < 6 and time.monotonic() < end:
        time.sleep(0.02)
    cluster.workers[0].kill()
    output, errors = child.communicate(timeout=90)
    assert child.returncode == 0, errors
    summary = json.loads(output)
    assert summary["ok"] == 25
    assert summary["failed"] == 0
    assert "Traceback" not in errors
    assert not list((tmp_path / "cluster").rglob("*.stl"))  # results came back over the wire
    here = unitcad("batch", sweep, "-o", tmp_path / "here", "-j", 1, "--cache", tmp_path / "other")
    assert here.returncode == 0, here.stderr
    assert bytes_of(out) == bytes_of(tmp_path / "here")
    # Each geometry crossed once: the other materials came back as a few small files.
    assert summary["reused"] == 20


def test_a_variant_that_fails_on_a_cluster_is_named(cluster: Cluster, tmp_path: Path) -> None:
    sweep, out = ring_sweep(tmp_path / "s", "fails"), tmp_path / "out"
    done = unitcad("batch", sweep, "-o", out, "--scheduler", cluster.address, "--keep-going")
    assert done.returncode == 1
    assert [row["status"] for row in rows(out)] == ["ok", "failed", "ok", "ok"]
    assert rows(out)[1]["reason"] == "design ring.py:fails (line 32): ValueError: never"


def test_ctrl_c_takes_the_work_back_and_leaves_the_cluster(cluster: Cluster, tmp_path: Path) -> None:
    sweep, out = ring_sweep(tmp_path / "s", "slow", [float(h) for h in range(2, 9)]), tmp_path / "out"
    words = ("batch", sweep, "-o", out, "--scheduler", cluster.address)
    child = subprocess.Popen(command(*words), stderr=subprocess.PIPE, text=True, env=environment())
    end = time.monotonic() + 60
    journal = out / "journal.jsonl"
    while (
        not journal.exists() or journal.read_bytes().count(b"\n") < 3
    ) and time.monotonic() < end:  # its head, two done
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=30)
    assert child.returncode == 130
    assert "Traceback" not in errors
    again = unitcad(*words, "--json")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["ok"] == 7
    assert json.loads(again.stdout)["taken_up"] >= 2


@pytest.mark.parametrize("listening", [False, True], ids=["nobody", "somebody-mute"])
def test_a_scheduler_that_does_not_answer_is_told_within_ten_seconds(listening: bool, tmp_path: Path) -> None:
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        if listening:
            mute.listen()
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        sweep = ring_sweep(tmp_path / "s")
        code = (
            "import sys, time, unitcad.sweeps.cluster, unitcad.cli.command_line; from unitcad.cli import main\n"
            "import distributed; start = time.monotonic()\n"
            "try: main()\n"
            "finally: print(time.monotonic() - start)\n"
        )
        words = ("batch", str(sweep), "-o", str(tmp_path / "out"), "--scheduler", address)
        done = subprocess.run(
            [sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=60, env=environment()
        )
        assert done.returncode == 2, done.stderr
        assert float(done.stdout) < 10
        assert f"--scheduler {address}: no answer" in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("address", ["tcp://nowhere.invalid:8786", "nonsense://x", "tcp://127.0.0.1:notaport"])
def test_an_address_that_is_none(address: str, tmp_path: Path) -> None:
    done = unitcad("batch", ring_sweep(tmp_path / "s"), "-o", tmp_path / "out", "--scheduler", address)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("error: --scheduler")
    assert "within" not in done.stderr or "nowhere" in address  # only who waited says so


@pytest.mark.parametrize(
    "sent", [b"SSH-2.0-OpenSSH_9.6p1\r\n" + b"x" * 40, b"HTTP/1.1 400 Bad Request\r\n\r\n" + b"a" * 99, b"\xff" * 64]
)
def test_an_answer_that_is_no_schedulers(sent: bytes) -> None:
    from unitcad.errors import UnitcadError
    from unitcad.sweeps.cluster import dask_executor

    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        kept = []

        def answer() -> None:
            kept.append(other.accept()[0])
            kept[0].sendall(sent)

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(UnitcadError, match="not a Dask scheduler"):
            dask_executor(f"tcp://127.0.0.1:{other.getsockname()[1]}")
        kept[0].close()


def test_a_cluster_is_reached_from_where_an_event_loop_runs(cluster: Cluster) -> None:
    """As in a notebook's cell; in a process of its own, since a client's threads live on."""
    cell = (
        "import asyncio\n"
        "from unitcad.sweeps.cluster import dask_executor\n"
        "async def cell():\n"
        f"    print(dask_executor({cluster.address!r})[1])\n"
        "asyncio.run(cell())\n"
    )
    command = [sys.executable, "-c", cell]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout == "2\n", done.stderr

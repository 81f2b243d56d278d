"""Dask: a real scheduler, two workers on loopback, one killed half way; a scheduler that does not answer."""

import json
import pickle
import re
import signal
import socket
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from batching import bytes_of, environment, made, ring_sweep, started, summary_of, unitcad
from process_trees import until

from unitcad.errors import UnitcadError
from unitcad.spec import custom_code
from unitcad.sweeps import BatchOptions, load_sweep, run
from unitcad.sweeps.executors import SerialExecutor, dask_executor, open_executor
from unitcad.sweeps.sweep import from_file

dask = pytest.importorskip("dask")
pytest.importorskip("distributed")


class Cluster:
    """Processes of the `dask` command, on this machine's disk."""

    def __init__(self, folder, *tls, workers=2):
        self.folder, self.workers = folder, []
        scheme = "tls" if tls else "tcp"
        here = ("--host", f"{scheme}://127.0.0.1", "--no-dashboard", *tls)
        self.scheduler = self._start("scheduler", "--port", "0", *here)
        self.address = self._read(self.scheduler, rf"Scheduler at:\s+({scheme}://\S+)")
        for _ in range(workers):
            self.workers.append(self._start("worker", self.address, "--no-nanny", "--nthreads", "1", *here))
            self._read(self.workers[-1], r"(Registered to)")

    def _start(self, kind, *words):
        return subprocess.Popen(
            [sys.executable, "-m", "dask", kind, *words],
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
            cwd=self.folder,
            env=environment(),
        )

    def _read(self, child, pattern):
        for line in child.stderr:
            if match := re.search(pattern, line):
                return match[1]
        raise AssertionError("dask did not start")

    def close(self):
        for child in (*self.workers, self.scheduler):
            child.kill()
            child.communicate()


@pytest.fixture
def cluster(tmp_path):
    (tmp_path / "cluster").mkdir()
    cluster = Cluster(tmp_path / "cluster")
    yield cluster
    cluster.close()


def test_a_cluster_that_loses_a_worker_makes_the_same_bytes(cluster, tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "slow", materials=3), tmp_path / "rings"
    child = started("batch", sweep, "-o", out.parent, "--scheduler", cluster.address, "--json")
    journal = out / "journal.jsonl"
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 3)  # its head, three done
    cluster.workers[0].kill()
    output, errors = child.communicate(timeout=90)
    assert child.returncode == 0, errors
    summary = json.loads(output)
    assert (summary["ok"], summary["failed"]) == (12, 0)
    assert "Traceback" not in errors
    made(sweep, tmp_path / "here", cache=tmp_path / "other")
    assert bytes_of(out) == bytes_of(tmp_path / "here")
    assert summary["reused"] >= 7  # of four geometries in three materials; that of the killed worker may be made twice


@pytest.mark.long
def test_ctrl_c_takes_the_work_back_and_leaves_the_cluster(cluster, tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "slow", [float(h) for h in range(2, 9)]), tmp_path / "rings"
    words = ("batch", sweep, "-o", out.parent, "--scheduler", cluster.address)
    child, journal = started(*words), out / "journal.jsonl"
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 2)  # its head, two done
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=30)
    assert child.returncode == 130
    assert "Traceback" not in errors
    again = summary_of(*words[1:])
    assert again["ok"] == 7
    assert again["taken_up"] >= 2


@pytest.mark.parametrize(
    "listening", [pytest.param(False, marks=pytest.mark.long), True], ids=["nobody", "somebody-mute"]
)
def test_a_scheduler_that_does_not_answer_is_told_within_ten_seconds(listening, tmp_path):
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        if listening:
            mute.listen()
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        sweep = ring_sweep(tmp_path / "s")
        code = (
            "import sys, time, unitcad.sweeps.executors, unitcad.cli.command_line; from unitcad.cli import main\n"
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


@pytest.mark.parametrize(
    "sent", [b"SSH-2.0-OpenSSH_9.6p1\r\n" + b"x" * 40, b"HTTP/1.1 400 Bad Request\r\n\r\n" + b"a" * 99, b"\xff" * 64]
)
def test_an_answer_that_is_no_schedulers(sent):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        kept = []

        def answer():
            kept.append(other.accept()[0])
            kept[0].sendall(sent)

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(UnitcadError, match="not a Dask scheduler"):
            dask_executor(f"tcp://127.0.0.1:{other.getsockname()[1]}")
        kept[0].close()


@pytest.mark.long
def test_a_cluster_is_reached_from_where_an_event_loop_runs(cluster):
    """As in a notebook's cell; in a process of its own, since a client's threads live on."""
    cell = (
        "import asyncio\n"
        "from unitcad.sweeps.executors import dask_executor\n"
        "async def cell():\n"
        f"    print(dask_executor({cluster.address!r})[1])\n"
        "asyncio.run(cell())\n"
    )
    command = [sys.executable, "-c", cell]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=60)
    assert done.stdout == "2\n", done.stderr


CERTIFICATES = Path(__file__).parent / "certificates"
"""Of two authorities, each with the certificate and key of a member; valid until 2126."""


def _configured(ca, cert, key):
    files = {"CA_FILE": ca, "CLIENT__CERT": cert, "CLIENT__KEY": key}
    return {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(file) for name, file in files.items()}


def _authority(name):
    return [CERTIFICATES / name / file for file in ("authority.pem", "member.pem", "key.pem")]


@pytest.fixture(scope="module")
def encrypted(tmp_path_factory):
    options = zip(("--tls-ca-file", "--tls-cert", "--tls-key"), map(str, _authority("ours")), strict=True)
    cluster = Cluster(tmp_path_factory.mktemp("cluster"), *(word for pair in options for word in pair), workers=1)
    yield cluster
    cluster.close()


@pytest.mark.long
def test_a_cluster_behind_certificates_makes_the_same_bytes(encrypted, tmp_path):
    assert encrypted.address.startswith("tls://")
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2)
    env = {**environment(), **_configured(*_authority("ours"))}
    assert summary_of(sweep, "-o", tmp_path / "a", "--scheduler", encrypted.address, env=env)["ok"] == 4
    made(sweep, tmp_path / "here", cache=tmp_path / "other")
    assert bytes_of(tmp_path / "a" / "rings") == bytes_of(tmp_path / "here")


@pytest.mark.long
def test_who_is_not_of_the_authority_is_not_talked_to(encrypted, tmp_path):
    ours, others = _authority("ours"), _authority("others")
    sweep = ring_sweep(tmp_path / "s", heights=[2.0])
    for named in (others, (ours[0], *others[1:])):
        env = {**environment(), **_configured(*named)}
        done = unitcad("batch", sweep, "-o", tmp_path / "o", "--scheduler", encrypted.address, env=env)
        assert done.returncode == 2, done.stderr
        assert done.stderr.startswith(f"error: --scheduler {encrypted.address}: ")
        assert len(done.stderr.splitlines()) == 1
        assert not (tmp_path / "o" / "rings" / "variants.csv").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "needs certificates in Dask's configuration"),
        ("no certificate\n", "the certificates can't be used: "),
    ],
)
def test_certificates_that_can_not_be_used(text, message, tmp_path):
    file, named = tmp_path / "text", dict[str, str]()
    if text is not None:
        file.write_text(text)
        named = {"ca-file": str(file), "client.cert": str(file), "client.key": str(file)}
    with dask.config.set({f"distributed.comm.tls.{key}": value for key, value in named.items()}):
        opened = open_executor(None, "tls://127.0.0.1:9")
        with pytest.raises(UnitcadError, match=message), opened:
            pass


class Recording(SerialExecutor):
    """Keeps the bytes of each task and its answer, as a scheduler would get them, and how many variants it had."""

    def __init__(self):
        self.passed = []

    def submit(self, fn, /, *args, **kwargs):
        message = pickle.dumps((fn, args, kwargs))
        future = super().submit(*pickle.loads(message)[:1], *pickle.loads(message)[1])
        answer = pickle.dumps(future.result())
        self.passed.append((len(future.result()), len(message) + len(answer)))
        return future


def test_at_most_three_kilobytes_a_variant_pass_the_scheduler(tmp_path, monkeypatch):
    monkeypatch.setattr(custom_code, "_allowed", set())  # a task names the codes of earlier tests
    silicones = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
    data = {
        "base": "encapsulating",
        "set": {"output.formats": ["stl"]},
        "sweep": {"layers.0.material": silicones, "estimate.frequency_hz": [80.0, 125.0]},
    }
    executor = Recording()
    options = BatchOptions(("unit", "estimate"), check=False)
    summary = run(from_file(data, Path(), "few"), tmp_path / "out", options, executor, workers=1, remote=True)
    assert summary.ok == 10
    assert [variants for variants, _ in executor.passed] == [4, 6]
    assert max(size / variants for variants, size in executor.passed) <= 3000


class Elsewhere(SerialExecutor):
    """Workers on a machine of their own: their results are not on the disk of this one."""

    def submit(self, fn, /, task, **kwargs):
        return super().submit(fn, replace(task, out=task.out.with_name("elsewhere")), **kwargs)


def test_results_on_the_disk_of_another_machine_are_not_taken_for_kept(tmp_path):
    sweep, out = load_sweep(ring_sweep(tmp_path / "s", heights=[2.0], materials=2)), tmp_path / "out"
    (tmp_path / "elsewhere").mkdir()
    with pytest.raises(
        UnitcadError, match="have a disk of their own; choose with -o a folder on a disk that they and this"
    ):
        run(sweep, out, BatchOptions(("unit",)), Elsewhere(), workers=1, remote=True)
    assert (out / "journal.jsonl").read_text().count("\n") == 1  # its head alone
    assert run(sweep, out, BatchOptions(("unit",)), SerialExecutor(), workers=1, remote=True).ok == 2

"""Results in an object store, on a server of S3 (rclone): same bytes, lost workers, kills, another machine."""

import hashlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from batching import bytes_of, command, made, ring_sweep, rows, started, unitcad
from process_trees import until

obstore = pytest.importorskip("obstore")
RCLONE = Path(sys.executable).with_name("rclone")
KEYS = {"AWS_ACCESS_KEY_ID": "unitcad-tests", "AWS_SECRET_ACCESS_KEY": "no-secret", "AWS_REGION": "us-east-1"}

pytestmark = pytest.mark.skipif(not RCLONE.exists(), reason="needs rclone")


@pytest.fixture
def bucket(tmp_path, monkeypatch):
    """A server with one empty bucket, as a folder; the environment names it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (tmp_path / "served" / "bucket").mkdir(parents=True)
    keys = f"{KEYS['AWS_ACCESS_KEY_ID']},{KEYS['AWS_SECRET_ACCESS_KEY']}"
    words = [
        "serve",
        "s3",
        "--auth-key",
        keys,
        "--addr",
        f"127.0.0.1:{port}",
        str(tmp_path / "served"),
    ]
    server = subprocess.Popen([RCLONE, "--config", os.devnull, *words], stderr=subprocess.DEVNULL)
    for name, value in {**KEYS, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}"}.items():
        monkeypatch.setenv(name, value)
    until(lambda: _answers(port))
    yield tmp_path / "served" / "bucket"
    server.kill()
    server.wait()


def _answers(port):
    with socket.socket() as asked:
        return asked.connect_ex(("127.0.0.1", port)) == 0


def stored(prefix):
    """The bytes of the variants' files below a prefix, and of the tables."""
    apart = ("timings.json", "journal.jsonl")
    return {
        str(file.relative_to(prefix)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in prefix.rglob("*")
        if file.is_file() and file.name not in apart
    }


def batch(folder, *words):
    """Run a batch as a process in a folder of its own, as a machine has one; return its summary."""
    folder.mkdir(exist_ok=True)
    done = subprocess.run(command("batch", *words, "--json"), cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_bucket_has_the_bytes_of_a_folder_and_another_machine_resumes(bucket, tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2)
    words = (sweep, "-o", "s3://bucket/a/b", "-j", "1")
    assert batch(tmp_path / "one", *words)["ok"] == 4
    made(sweep, tmp_path / "plain")
    assert stored(bucket / "a/b/rings") == bytes_of(tmp_path / "plain")
    assert sorted(path.name for path in (tmp_path / "one/out/rings").glob("ring-*")) == []
    other = batch(tmp_path / "two", *words)
    assert (other["ok"], other["taken_up"]) == (4, 4)


def test_a_damaged_or_missing_object_is_made_again(bucket, tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0])
    words = (sweep, "-o", "s3://bucket", "-j", "0")
    batch(tmp_path / "one", *words)
    before = stored(bucket / "rings")
    from obstore.store import from_url

    first, second = sorted((bucket / "rings").glob("ring-*"))
    there = from_url("s3://bucket", client_options={"allow_http": True})
    obstore.put(there, next(first.rglob("*.stl")).relative_to(bucket).as_posix(), b"damaged")
    obstore.delete(there, (second / "manifest.json").relative_to(bucket).as_posix())
    assert batch(tmp_path / "one", *words)["taken_up"] == 1  # hashes are compared on request
    assert batch(tmp_path / "one", *words, "--verify")["taken_up"] == 1
    assert stored(bucket / "rings") == before


def test_a_killed_batch_resumes(bucket, tmp_path):
    sweep, here = ring_sweep(tmp_path / "s", "slow", [float(h) for h in range(2, 9)]), tmp_path / "one"
    here.mkdir()
    words = (sweep, "-o", "s3://bucket", "-j", "1")
    child, journal = started("batch", *words, cwd=here), here / "out/rings/journal.jsonl"
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 2)  # its head, two done
    child.send_signal(signal.SIGKILL)
    child.communicate(timeout=30)
    again = batch(here, *words)
    assert again["ok"] == 7
    assert again["taken_up"] >= 2
    made(sweep, tmp_path / "plain")
    assert stored(bucket / "rings") == bytes_of(tmp_path / "plain")


def test_shards_of_machines_without_a_shared_disk_meet_in_the_store(bucket, tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2)
    words = (sweep, "-o", "s3://bucket", "-j", "0")
    for number in (1, 2):
        assert batch(tmp_path / str(number), *words, "--shard", f"{number}/2")["ok"] == 2
    assert batch(tmp_path / "merged", *words)["taken_up"] == 4
    assert len(rows(tmp_path / "merged/out/rings")) == 4


def test_a_cluster_without_a_shared_disk(bucket, tmp_path):
    pytest.importorskip("distributed")
    from test_batch_dask import Cluster

    sweep = ring_sweep(tmp_path / "s", "slow", materials=3)
    (tmp_path / "cluster").mkdir()
    cluster = Cluster(tmp_path / "cluster")
    try:
        here = tmp_path / "one"
        here.mkdir()
        words = ("batch", sweep, "-o", "s3://bucket", "--scheduler", cluster.address, "--json")
        child, journal = started(*words, cwd=here), here / "out/rings/journal.jsonl"
        until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 3)
        cluster.workers[0].kill()
        output, errors = child.communicate(timeout=120)
    finally:
        cluster.close()
    assert child.returncode == 0, errors
    assert json.loads(output)["ok"] == 12
    assert list((here / "out/rings").glob("ring-*")) == []
    made(sweep, tmp_path / "plain")
    assert stored(bucket / "rings") == bytes_of(tmp_path / "plain")


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("s3://nowhere/rings", "bucket does not exist"),
        ("gs://bucket/rings", "takes a folder, or s3://bucket/prefix"),
        ("s3://", "takes a folder, or s3://bucket/prefix"),
        ("s3://bucket/a b", "takes a folder, or s3://bucket/prefix"),
    ],
)
def test_a_place_that_is_none_is_refused_in_one_line(bucket, address, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = unitcad("batch", ring_sweep(tmp_path / "s"), "-o", address)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert said in done.stderr
    assert not list(Path("out").rglob("ring-*"))


def test_a_server_that_is_gone_is_told_soon(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, value in {**KEYS, "AWS_ENDPOINT_URL": "http://127.0.0.1:9"}.items():
        monkeypatch.setenv(name, value)
    start = time.monotonic()
    done = unitcad("batch", ring_sweep(tmp_path / "s"), "-o", "s3://bucket")
    assert done.returncode == 2
    assert time.monotonic() - start < 60
    assert "-o s3://bucket/rings: " in done.stderr
    shutil.rmtree("out", ignore_errors=True)

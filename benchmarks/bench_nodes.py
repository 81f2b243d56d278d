"""A batch on several nodes: a Dask cluster in network namespaces against an S3-compatible store, with kills on the way.

    python benchmarks/bench_nodes.py --variants 100000 --geometries 500 [--workers 4] [--only unit,moulds] [--json FILE]

Needs root on Linux, and the extras dask, store and test. Each node (store, scheduler, workers, parent) has a network of
its own on one bridge. A worker sees the machine's files read-only and has an empty file system for its own. At a
quarter of the variants a worker is killed, at half the scheduler and at three quarters the parent, all by SIGKILL; the
same command then goes on. What is promised is asserted: see `judge`. Nothing outside the namespaces is reached.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import Any

HOME = Path(__file__).resolve().parent.parent
PACKAGES = os.pathsep.join(filter(None, [str(HOME), *sys.path]))
BUCKET, PORT, SCHEDULER_PORT = "units", 5000, 8786
STORE_SERVER = """
import time
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer("0.0.0.0", {port})
server.start()
server.get_host_and_port()
print("ready", flush=True)
while True:
    time.sleep(1)
"""
SAMPLE = 8
"""Variants whose files are compared with those made in one process."""
LATE_S = 120.0
"""Seconds that a node may take to be ready."""


class Node:
    """A network namespace on the bridge, and the processes in it."""

    def __init__(self, net: Net, name: str, address: str, own_files: bool) -> None:
        self.net, self.name, self.address, self.own_files = net, name, address, own_files
        sh(f"ip netns add {name}")
        sh(f"ip link add v-{name} type veth peer name eth0 netns {name}")
        sh(f"ip link set v-{name} master br0 up")
        sh(f"ip -n {name} addr add {address}/24 dev eth0")
        sh(f"ip -n {name} link set eth0 up")
        sh(f"ip -n {name} link set lo up")

    def start(self, words: list[str], log: str) -> subprocess.Popen[bytes]:
        """Start a process in the node; with `own_files` all that it can write to is an empty file system."""
        line = ["ip", "netns", "exec", self.name, *words]
        if self.own_files:
            root = self.net.scratch
            script = f'mount -t tmpfs node {root} && mount -o remount,bind,ro / && cd {root} && exec "$@"'
            line = ["ip", "netns", "exec", self.name, "unshare", "-m", "sh", "-c", script, "sh", *words]
        with open(self.net.scratch / "logs" / log, "ab") as file:
            return self.net.keep(
                subprocess.Popen(line, stdout=file, stderr=file, cwd=self.net.scratch, env=self.net.environment)
            )

    def bytes_passed(self) -> int:
        """Bytes that its interface has received and sent."""
        listed = json.loads(sh(f"ip -n {self.name} -s -j link show eth0"))[0]["stats64"]
        return listed["rx"]["bytes"] + listed["tx"]["bytes"]


class Net:
    """The bridge, the nodes' common environment, and every process that was started."""

    def __init__(self, scratch: Path) -> None:
        self.scratch = scratch
        self.children: list[subprocess.Popen[bytes]] = []
        self.environment = {
            **os.environ,
            "PYTHONPATH": PACKAGES,
            "HOME": str(scratch),
            "TMPDIR": str(scratch),
            "UNITCAD_CACHE": str(scratch / "cache"),
            "AWS_ENDPOINT_URL": f"http://10.77.0.2:{PORT}",
            "AWS_ACCESS_KEY_ID": "bench",
            "AWS_SECRET_ACCESS_KEY": "bench",
            "AWS_DEFAULT_REGION": "us-east-1",
        }
        (scratch / "logs").mkdir()
        sh("mount -t tmpfs netns /run && mkdir -p /run/netns && ip link set lo up")
        sh("ip link add br0 type bridge && ip addr add 10.77.0.1/24 dev br0 && ip link set br0 up")

    def keep(self, child: subprocess.Popen[bytes]) -> subprocess.Popen[bytes]:
        self.children.append(child)
        return child

    def close(self) -> None:
        for child in self.children:
            child.kill()
            child.wait()


def sh(line: str) -> str:
    return subprocess.run(["sh", "-ec", line], check=True, capture_output=True, text=True).stdout


def sweep_text(variants: int, geometries: int) -> str:
    """A sweep of `variants` over `geometries` diameters, which run fastest: 25 pairs of silicones, and rooms."""
    silicones = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
    rooms = max(1, variants // (25 * geometries))
    return (
        'base = "encapsulating"\nname = "nodes"\n[set]\n"output.formats" = ["stl"]\n[sweep]\n'
        f'"layers.0.material" = {silicones}\n"layers.1.material" = {silicones}\n'
        f'"casting.room_c" = {{ start = 20.0, stop = 26.0, num = {rooms} }}\n'
        f'"diameter_mm" = {{ start = 14.0, stop = 16.0, num = {geometries} }}\n'
    )


class Cluster:
    """Scheduler and workers, restarted when they are killed."""

    def __init__(self, net: Net, workers: int) -> None:
        self.net = net
        self.scheduler_node = Node(net, "sched", "10.77.0.3", own_files=True)
        self.nodes = [Node(net, f"work{i}", f"10.77.0.{10 + i}", own_files=True) for i in range(workers)]
        self.address = f"tcp://10.77.0.3:{SCHEDULER_PORT}"
        self.workers: list[subprocess.Popen[bytes]] = []
        self.begun = 0
        self.begin()

    def begin(self) -> None:
        for child in self.workers:
            child.kill()
            child.wait()
        self.begun += 1
        words = ["--host", "10.77.0.3", "--port", str(SCHEDULER_PORT), "--no-dashboard"]
        self.scheduler = self.scheduler_node.start(
            [sys.executable, "-m", "dask", "scheduler", *words], f"scheduler-{self.begun}"
        )
        awaited(self.net.scratch / "logs" / f"scheduler-{self.begun}", "Scheduler at", 1)
        self.workers = [self._worker(i) for i in range(len(self.nodes))]
        for i in range(len(self.nodes)):
            awaited(self.net.scratch / "logs" / f"worker{i}-{self.begun}", "Registered to", 1)

    def _worker(self, i: int) -> subprocess.Popen[bytes]:
        words = [self.address, "--host", self.nodes[i].address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        return self.nodes[i].start([sys.executable, "-m", "dask", "worker", *words], f"worker{i}-{self.begun}")

    def replace(self, i: int) -> None:
        self.workers[i].kill()
        self.workers[i].wait()
        self.workers[i] = self._worker(i)


def awaited(log: Path, text: str, times: int) -> None:
    end = time.monotonic() + LATE_S
    while time.monotonic() < end:
        if log.is_file() and log.read_text(errors="replace").count(text) >= times:
            return
        time.sleep(0.1)
    raise SystemExit(f"{log}: no {text!r}:\n{log.read_text()[-2000:] if log.is_file() else ''}")


def finished(journal: Path) -> int:
    """Variants in a journal."""
    return max(0, journal.read_bytes().count(b"\n") - 1) if journal.is_file() else 0


def run(asked: argparse.Namespace, scratch: Path) -> dict[str, Any]:
    net = Net(scratch)
    try:
        store = Node(net, "store", "10.77.0.2", own_files=False)
        parent = Node(net, "parent", "10.77.0.4", own_files=False)
        store.start([sys.executable, "-W", "ignore", "-c", STORE_SERVER.format(port=PORT)], "store")
        awaited(scratch / "logs" / "store", "ready", 1)
        made = f"import s3fs; s3fs.S3FileSystem().mkdir({BUCKET!r})"
        assert parent.start([sys.executable, "-c", made], "parent").wait(LATE_S) == 0
        cluster = Cluster(net, asked.workers)
        return measured(asked, net, parent, cluster)
    finally:
        net.close()


def measured(asked: argparse.Namespace, net: Net, parent: Node, cluster: Cluster) -> dict[str, Any]:
    sweep, out = net.scratch / "nodes.toml", net.scratch / "out"
    sweep.write_text(sweep_text(asked.variants, asked.geometries))
    words = [sys.executable, "-m", "unitcad", "batch", str(sweep), "-o", str(out), "--scheduler", cluster.address]
    words += ["--store", f"s3://{BUCKET}/run", "--only", asked.only, "--no-folders", "--json"]
    words += [] if asked.check else ["--no-check"]
    start, events, journal = time.monotonic(), [], out / "journal.jsonl"
    kills = {"worker": 0.25, "scheduler": 0.5, "parent": 0.75}
    while True:
        before = finished(journal)
        child = parent.start(words, "parent")
        while child.poll() is None:
            due = next((name for name, share in kills.items() if finished(journal) >= share * asked.variants), None)
            if due is None:
                time.sleep(0.2)
                continue
            del kills[due]
            events.append((due, finished(journal)))
            if due == "worker":
                cluster.replace(0)
            elif due == "scheduler":
                cluster.scheduler.send_signal(signal.SIGKILL)
                child.wait(LATE_S)
                cluster.begin()
            else:
                kill_group(child)
        last = last_json(net.scratch / "logs" / "parent") if child.returncode == 0 else {}
        if last:
            break
        assert finished(journal) > before or events, (net.scratch / "logs" / "parent").read_text()[-3000:]
        assert len(events) <= 3
        if child.returncode not in (-signal.SIGKILL, 2):
            raise SystemExit((net.scratch / "logs" / "parent").read_text()[-3000:])
    seconds = time.monotonic() - start
    return judge(asked, net, parent, sweep, out, last, events, seconds, before)


def kill_group(child: subprocess.Popen[bytes]) -> None:
    child.send_signal(signal.SIGKILL)
    child.wait(LATE_S)


def last_json(log: Path) -> dict[str, Any]:
    """Return the summary that a batch has printed last; it ends the log."""
    _, begun, text = ("\n" + log.read_text(errors="replace")).rpartition("\n{\n")
    return json.loads("{" + text) if begun else {}


def judge(
    asked: argparse.Namespace, net: Net, parent: Node, sweep: Path, out: Path, last: dict[str, Any],
    events: list[tuple[str, int]], seconds: float, before: int,
) -> dict[str, Any]:  # fmt: skip
    """Assert what is promised, and return the figures.

    Every variant is there; what the journal had before the last start was not made again; no geometry was made more
    often than once, but for those that were in flight; and a sample has the bytes that one process makes.
    """
    assert last["ok"] == last["variants"], last
    assert last["taken_up"] >= before > 0, (last, before)
    puts = Counter(
        re.findall(
            r'"PUT /units/run/(entries/../\w+|content/../\w+|packs/../\w+)',
            (net.scratch / "logs" / "store").read_text(),
        )
    )
    geometries = {name: count for name, count in puts.items() if name.startswith("entries/")}
    twice = sum(geometries.values()) - len(geometries)
    assert len(geometries) == asked.geometries, (len(geometries), asked.geometries)
    assert twice <= 2 * asked.workers * len(events), twice
    compare(asked, net, parent, sweep, out)
    size = subprocess.run(["du", "-sb", str(out)], check=True, capture_output=True, text=True).stdout.split()[0]
    return {
        "variants": last["variants"],
        "geometries": len(geometries),
        "workers": asked.workers,
        "killed": [{"what": what, "after": after} for what, after in events],
        "seconds": round(seconds, 1),
        "made_twice": twice,
        "puts_a_variant": round(sum(puts.values()) / last["variants"], 3),
        "puts": Counter(name.partition("/")[0] for name in puts.elements()),
        "parent_bytes_a_variant": round(parent.bytes_passed() / last["variants"]),
        "parent_bytes_a_variant, aim, at most": 3000,
        "out_bytes_a_variant": round(int(size) / last["variants"]),
    }


def compare(asked: argparse.Namespace, net: Net, parent: Node, sweep: Path, out: Path) -> None:
    """Export a sample from the store, and compare each file with that which this process makes."""
    from unitcad.cache import MemoryStore
    from unitcad.pipeline.make import Progress
    from unitcad.pipeline.write import subject
    from unitcad.sweeps import load_sweep

    wanted, chosen = load_sweep(sweep), {}
    for index in {asked.variants * i // SAMPLE for i in range(SAMPLE)}:
        spec = wanted.spec(index)
        chosen[subject(spec).folder_name] = spec
    words = [name[-12:] for name in chosen]
    words = [sys.executable, "-m", "unitcad", "export", *words, "--batch", str(out), "-o", str(out / "few")]
    assert parent.start(words, "export").wait(600) == 0, (net.scratch / "logs" / "export").read_text()
    store = MemoryStore()
    for name, spec in chosen.items():
        product = subject(spec).make(tuple(asked.only.split(",")), asked.check, store, Progress())
        content = {**product.own, **{path: store.content(sha) for path, sha in product.shared.items()}}
        folder = out / "few" / name
        there = {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
        there.pop("timings.json")
        assert there == content, name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=100_000)
    parser.add_argument("--geometries", type=int, default=500)
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--only", default="unit,moulds")
    parser.add_argument("--no-check", dest="check", action="store_false")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.variants % (25 * asked.geometries):
        parser.error(f"--variants: needs a multiple of 25 times --geometries, such as {25 * asked.geometries}")
    if asked.inside is None:
        if os.name != "posix" or os.geteuid() != 0 or not shutil.which("unshare") or not shutil.which("ip"):
            parser.error("needs root on Linux, unshare and ip")
        if lacking := [name for name in ("distributed", "s3fs", "moto", "flask", "flask_cors") if not find_spec(name)]:
            parser.error(f"needs {', '.join(lacking)}: pip install -c constraints.txt -e '.[dask,store,test]'")
        with tempfile.TemporaryDirectory(prefix="unitcad-nodes-") as scratch:
            words = [
                "unshare",
                "-n",
                "-m",
                "-p",
                "-f",
                "--mount-proc",
                "--propagation",
                "private",
                sys.executable,
                *sys.argv,
                "--inside",
                scratch,
            ]
            raise SystemExit(subprocess.run(words, check=False).returncode)
    figures = run(asked, asked.inside)
    text = json.dumps(figures, indent=1)
    print(text)
    if asked.json:
        asked.json.write_text(text + "\n")


if __name__ == "__main__":
    main()

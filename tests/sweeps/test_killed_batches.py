"""Batches killed at random moments: what was done stays as it is, nothing runs on, and the end is the same bytes."""

import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from batching import bytes_of, leftovers, ring_sweep, rows, started

from tests.robustness.test_orphans import check_nothing_is_left
from unitcad.pipeline.write import whole
from unitcad.sweeps.journal import JOURNAL

HEIGHTS = [float(height) for height in range(2, 8)]
MATERIALS = 2
VARIANTS = len(HEIGHTS) * MATERIALS


@dataclass(frozen=True)
class Reference:
    """A batch that nobody disturbed: its sweep, what it wrote, seconds that it took."""

    sweep: Path
    bytes: dict[str, str]
    seconds: float


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reference")
    sweep = ring_sweep(folder / "s", heights=HEIGHTS, materials=MATERIALS)
    start = time.monotonic()
    child = _start(sweep, folder / "rings", folder / "cache")
    child.communicate(timeout=300)
    assert child.returncode == 0
    return Reference(sweep, bytes_of(folder / "rings"), time.monotonic() - start)


def _start(sweep, out, cache):
    # A group of its own, so that a kill can be for the whole of it.
    return started("batch", sweep, "-o", out.parent, "-j", 2, "--cache", cache, "--json", start_new_session=True)


def _noted(out):
    """The variants that the journal has, and the folders that it names."""
    if not (out / JOURNAL).exists():
        return {}
    lines = (out / JOURNAL).read_bytes().split(b"\n")[1:-1]
    return {found["index"]: found["folder"] for found in map(json.loads, lines)}


def _kill(child, dice):
    """By SIGKILL: the parent, the whole group, or a worker and then the parent."""
    below = psutil.Process(child.pid).children(recursive=True)
    match dice.choice(("parent", "group", "worker")):
        case "parent":
            child.kill()
        case "group":
            os.killpg(child.pid, signal.SIGKILL)
        case "worker":
            if below:
                with contextlib.suppress(psutil.NoSuchProcess):
                    dice.choice(sorted(below, key=lambda process: process.pid)).kill()
                time.sleep(dice.random() * 0.2)
            child.kill()
    child.communicate()
    _, alive = psutil.wait_procs(below, timeout=30)
    assert not [process for process in alive if process.status() != psutil.STATUS_ZOMBIE]


@pytest.mark.parametrize(
    ("kills", "seed"), [(2, 1), *(pytest.param(5, seed, marks=pytest.mark.long) for seed in range(2, 14))]
)
def test_a_batch_that_is_killed_again_and_again(kills, seed, reference, tmp_path):
    dice, out, cache = random.Random(seed), tmp_path / "rings", tmp_path / "cache"
    noted = {}
    before = {}
    while kills:
        child = _start(reference.sweep, out, cache)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.communicate(timeout=dice.uniform(0.05, 0.9) * reference.seconds)
        if child.poll() is not None:  # it was done before it could be killed: from the start again
            assert child.returncode == 0
            assert bytes_of(out) == reference.bytes
            shutil.rmtree(out)
            shutil.rmtree(cache)
            noted, before = {}, {}
            continue
        _kill(child, dice)
        kills -= 1
        # Whoever has a name is whole, in the journal or not; no later run touches it.
        there = {path.name: path.stat().st_ino for path in out.glob("ring-*")}
        assert all(whole(out / name, hashes=True) for name in there)
        assert before.items() <= there.items()
        now = _noted(out)
        assert noted.items() <= now.items()
        assert set(now.values()) <= set(there)
        noted, before = now, there
    child = _start(reference.sweep, out, cache)
    told, _ = child.communicate(timeout=300)
    assert child.returncode == 0
    summary = json.loads(told)
    assert (summary["ok"], summary["failed"], summary["warnings"]) == (VARIANTS, 0, [])
    assert {name: (out / name).stat().st_ino for name in before} == before
    assert summary["taken_up"] == len(noted)
    assert bytes_of(out) == reference.bytes
    assert len(rows(out)) == VARIANTS
    assert not leftovers(out)


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT], ids=lambda end: end.name)
def test_a_batch_leaves_no_process(end, tmp_path):
    sweep = ring_sweep(tmp_path / "s", "slow", [float(height) for height in range(2, 20)])
    words = ["batch", sweep, "-o", tmp_path / "out", "-j", 2, "--cache", tmp_path / "cache", "--only", "unit"]
    # msgspec drops a KeyboardInterrupt that comes while it takes a type for the first time.
    check_nothing_is_left(words, 2, end, begun=(tmp_path / "s" / "calls").exists)

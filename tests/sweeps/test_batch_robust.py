"""Nothing lost: each of these really kills, crashes, hangs, interrupts or fills."""

import json
import os
import shutil
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import psutil
import pytest
from batching import calls, environment, leftovers, ring_sweep, rows, started, summary_of, unitcad
from process_trees import left, until

from unitcad.cache import DiskStore, MemoryStore, MissingContent, disk
from unitcad.errors import Unfinished, UnitcadError
from unitcad.meshcheck import Limits, Options
from unitcad.pipeline import geometry
from unitcad.pipeline.write import build, whole
from unitcad.validation import load

HEIGHTS = [2.0, 3.0, 4.0, 5.0]


def _results(out):
    if not out.exists():
        return []
    return [path for path in out.iterdir() if path.is_dir() and not path.name.startswith(".tmp-")]


def test_a_killed_worker_costs_its_variant_one_more_try(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "slow", HEIGHTS), tmp_path / "rings"
    child = started("batch", sweep, "-o", out.parent, "-j", 2, "--json")
    until(lambda: _results(out))
    psutil.Process(child.pid).children()[0].kill()
    output, errors = child.communicate(timeout=240)
    assert child.returncode == 0, errors
    summary = json.loads(output)
    assert (summary["ok"], summary["failed"]) == (4, 0)
    assert summary["retried"] <= 1
    assert not leftovers(out)


@pytest.mark.parametrize(
    ("function", "more", "reason"),
    [
        ("crashes", [], "the worker died (SIGABRT)"),
        ("hangs", ["--timeout", "2"], "timed out after 2 s"),
        ("fails", [], "design ring.py:fails (line 32): ValueError: never"),
    ],
)
def test_a_variant_that_can_not_be_made_is_named(function, more, reason, tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", function), tmp_path / "rings"
    done = unitcad("batch", sweep, "-o", out.parent, "-j", 1, "--keep-going", "--json", *more)
    assert done.returncode == 1, done.stderr
    summary = json.loads(done.stdout)
    assert (summary["ok"], summary["failed"], summary["retried"]) == (3, 1, 1)
    assert [(f["index"], f["status"], f["reason"]) for f in summary["failures"]] == [(1, "failed", reason)]
    assert [row["status"] for row in rows(out)] == ["ok", "failed", "ok", "ok"]
    assert rows(out)[1]["reason"] == reason
    assert len(_results(out)) == 3
    assert not leftovers(out)
    assert "Traceback" not in done.stderr


def test_what_failed_once_is_tried_again(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "fails_once"), tmp_path / "rings"
    assert summary_of(sweep, "-o", out.parent, "-j", 0)["retried"] == 1


def test_ctrl_c_stops_at_once_and_keeps_what_is_done(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "slow", HEIGHTS), tmp_path / "rings"
    child = started("batch", sweep, "-o", out.parent, "-j", 2, start_new_session=True)
    until(lambda: _results(out))
    workers = psutil.Process(child.pid).children(recursive=True)
    second = unitcad("batch", sweep, "-o", out.parent)
    assert second.returncode == 2
    assert "another batch is running" in second.stderr
    os.killpg(child.pid, signal.SIGINT)  # to the whole group, as a terminal does
    _, errors = child.communicate(timeout=120)
    assert child.returncode == 130
    assert "interrupted: " in errors
    assert "the same command resumes" in errors
    assert "Traceback" not in errors
    assert left(workers) == []
    assert all(whole(folder, hashes=True) for folder in _results(out))
    assert summary_of(sweep, "-o", out.parent, "-j", 0)["ok"] == 4
    assert not leftovers(out)


def test_no_space_left_stops_it_and_keeps_what_is_done(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "unit", HEIGHTS), tmp_path / "rings"
    full = _run_with_full_disk(sweep, out, tmp_path)
    assert full.returncode == 1, full.stderr
    assert "no space left" in full.stderr
    assert "Traceback" not in full.stderr
    done = _results(out)
    assert len(done) == 2
    assert all(whole(folder, hashes=True) for folder in done)
    assert summary_of(sweep, "-o", out.parent, "-j", 0)["ok"] == 4
    assert not leftovers(out)


def _run_with_full_disk(sweep, out, tmp_path):
    """A run whose worker finds the disk full from the third manifest on: by /dev/full."""
    site = tmp_path / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(
        "import builtins, os\n"
        "plain = open\n"
        f"count = {str(tmp_path / 'count')!r}\n"
        "def full(path, mode='r', *more, **named):\n"
        "    if mode == 'xb' and str(path).endswith('manifest.json'):\n"
        "        with plain(count, 'a') as file: file.write('x')\n"
        "        if os.path.getsize(count) > 2:\n"
        "            path, mode = '/dev/full', 'wb'\n"
        "    return plain(path, mode, *more, **named)\n"
        "builtins.open = full\n"
    )
    return unitcad("batch", sweep, "-o", out.parent, "-j", 1, env={**environment(), "PYTHONPATH": str(site)})


def test_a_refused_variant_stops_nothing(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s"), tmp_path / "rings"
    sweep.write_text(
        'base = "./ring.toml"\nname = "rings"\n[sweep]\nmode = "zip"\n'
        '"layers.0.wall_mm" = [0.1, 1.25, 0.2, 1.5]\n"parameters.height_mm" = [2.0, 3.0, 4.0, 5.0]\n'
    )
    for _ in range(2):
        done = unitcad("batch", sweep, "-o", out.parent, "-j", 0)
        assert done.returncode == 1
        assert "stopped" not in done.stderr
        for index, wall in ((0, "0.1"), (2, "0.2")):
            assert f"variant {index}: refused: layers.0.wall_mm = {wall}" in done.stderr
        assert [row["status"] for row in rows(out)] == ["refused", "ok", "refused", "ok"]
        assert rows(out)[0]["reason"].startswith("layers.0.wall_mm = 0.1")
        assert len(_results(out)) == 2
        assert calls(tmp_path / "s") == ["3.0", "5.0"]


def test_what_failed_before_is_tried_again_last(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "fails", [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]), tmp_path / "rings"
    assert unitcad("batch", sweep, "-o", out.parent, "-j", 1).returncode == 1
    assert len(_results(out)) < 5
    assert rows(out)[0]["status"] == "failed"
    again = unitcad("batch", sweep, "-o", out.parent, "-j", 1)
    assert again.returncode == 1
    assert "stopped: variant 0:" in again.stderr
    assert [row["status"] for row in rows(out)] == ["failed", *["ok"] * 5]


def test_a_cache_that_is_deleted_again_and_again_stops_no_batch(tmp_path):
    sweep, out, cache = ring_sweep(tmp_path / "s", "slow", HEIGHTS), tmp_path / "rings", tmp_path / "cache"
    child = started("batch", sweep, "-o", out.parent, "-j", 2, "--cache", cache)
    while child.poll() is None:
        shutil.rmtree(cache, ignore_errors=True)
        time.sleep(0.05)
    _, told = child.communicate()
    assert child.returncode == 0, told
    assert len(_results(out)) == 4
    assert all(whole(folder, hashes=True) for folder in _results(out))


def test_a_half_deleted_cache_is_waited_for_and_another_folder_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(disk, "_CLAIM_S", 0.01)
    half = tmp_path / "half"
    (half / "content" / "ab").mkdir(parents=True)
    with ThreadPoolExecutor(1) as others:
        others.submit(lambda: (time.sleep(0.1), shutil.rmtree(half)))
        DiskStore(half).close()
    assert (half / disk.MARK).is_file()
    (tmp_path / "theirs" / "content").mkdir(parents=True)
    with pytest.raises(UnitcadError, match="is not a cache of unitcad, and not empty"):
        DiskStore(tmp_path / "theirs")


class Forgetful(MemoryStore):
    """A store of which others delete each content before it is placed."""

    def place(self, sha256, target):
        raise MissingContent(sha256)


def test_a_build_does_without_a_cache_that_keeps_nothing(tmp_path):
    built = build(load("single-embedded", ["output.formats=['stl']"]), tmp_path, only=["unit"], store=Forgetful())
    assert whole(built.folder, hashes=True)


SPEC = ("single-embedded", ["output.formats=['stl']"])


def test_an_unfinished_check_is_not_stored_and_the_next_build_is_right(monkeypatch, tmp_path):
    store, out = DiskStore(tmp_path / "cache"), tmp_path / "out"
    monkeypatch.setattr(geometry, "Options", partial(Options, limits=Limits(seconds=1e-9)))
    for _ in range(2):
        with pytest.raises(Unfinished, match=r"layer1\.stl: its check was not finished"):
            build(load(*SPEC), out, only=("unit",), store=store)
        assert not list(out.glob("[!.]*"))
    monkeypatch.undo()
    assert build(load(*SPEC), out, only=("unit",), store=store).ok


def test_a_variant_whose_check_is_unfinished_fails_and_is_made_by_the_next_run(tmp_path):
    """The first run's workers have no time for a check; each variant is tried twice, as after every failure."""
    sweep, out = tmp_path / "sweep.toml", tmp_path / "walls"
    sweep.write_text('base = "single-embedded"\nname = "walls"\n[sweep]\n"layers.0.wall_mm" = [1.5, 2.0]\n')
    hurry = tmp_path / "hurry"
    hurry.mkdir()
    tries = tmp_path / "tries"
    (hurry / "sitecustomize.py").write_text(
        "import unitcad.meshcheck as check\n"
        "from dataclasses import replace\n"
        "whole = check.check_bytes\n"
        "def hurried(data, name, options):\n"
        f"    open({str(tries)!r}, 'a').write('x')\n"
        "    return whole(data, name, replace(options, limits=check.Limits(seconds=1e-9)))\n"
        "check.check_bytes = hurried\n"
    )
    cache = tmp_path / "cache"
    words = (
        "batch",
        sweep,
        "-o",
        tmp_path,
        "-j",
        1,
        "--cache",
        cache,
        "--formats=stl",
        "--only",
        "unit",
        "--keep-going",
    )
    paths = os.pathsep.join([str(hurry), str(Path(__file__).parents[2])])
    first = unitcad(*words, env={**environment(), "PYTHONPATH": paths})
    assert first.returncode == 1, first.stderr
    assert [row["status"] for row in rows(out)] == ["failed", "failed"]
    assert all("its check was not finished" in row["reason"] for row in rows(out))
    assert len(tries.read_text()) == 4  # a variant that fails is tried once more
    assert summary_of(*words[1:])["ok"] == 2

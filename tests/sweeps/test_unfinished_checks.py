"""A check that runs out of time or memory is no verdict: it is not stored, and another run tries again."""

from __future__ import annotations

import json
import os
import subprocess
from functools import partial
from pathlib import Path

import pytest
from batching import command, environment, rows, unitcad

from unitcad.cache import DiskStore
from unitcad.errors import Unfinished
from unitcad.meshcheck import Limits, Options
from unitcad.pipeline import make
from unitcad.pipeline.write import build
from unitcad.validation import load

SPEC = ("single-embedded", ["output.formats=['stl']"])


def test_an_unfinished_check_is_not_stored_and_the_next_build_is_right(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    store, out = DiskStore(tmp_path / "cache"), tmp_path / "out"
    monkeypatch.setattr(make, "Options", partial(Options, limits=Limits(seconds=1e-9)))
    for _ in range(2):
        with pytest.raises(Unfinished, match=r"layer1\.stl: its check was not finished"):
            build(load(*SPEC), out, only=("unit",), store=store)
        assert not list(out.glob("[!.]*"))
    monkeypatch.undo()
    assert build(load(*SPEC), out, only=("unit",), store=store).ok


def test_a_variant_whose_check_is_unfinished_fails_and_is_made_by_the_next_run(tmp_path: Path) -> None:
    """The first run's workers have no time for a check; each variant is tried twice, as after every failure."""
    sweep, out = tmp_path / "sweep.toml", tmp_path / "out"
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
    words = (
        "batch",
        sweep,
        "-o",
        out,
        "-j",
        1,
        "--cache",
        tmp_path / "cache",
        "--formats",
        "stl",
        "--only",
        "unit",
        "--keep-going",
    )
    paths = os.pathsep.join([str(hurry), str(Path(__file__).parents[2])])
    first = subprocess.run(
        command(*words), capture_output=True, text=True, check=False, timeout=120,
        env={**environment(), "PYTHONPATH": paths},
    )  # fmt: skip
    assert first.returncode == 1, first.stderr
    assert [row["status"] for row in rows(out)] == ["failed", "failed"]
    assert all("its check was not finished" in row["reason"] for row in rows(out))
    assert len(tries.read_text()) == 4  # a variant that fails is tried once more
    again = unitcad(*words, "--json")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["ok"] == 2

"""STEP from a process of its own: the same bytes, errors that pass through, and a process that is lost or left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("OCP")

from unitcad.children import Lost
from unitcad.errors import UnitcadError
from unitcad.export import step
from unitcad.export.step_process import StepProcess
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.build import build
from unitcad.shape import Revolve, Union, cylinder, polygon, turned
from unitcad.validation import load


def test_files_come_in_the_order_of_asking_and_with_the_same_bytes_as_here() -> None:
    bodies = MouldSet(load("single-embedded")).unit
    with StepProcess() as process:
        first, second = process.ask(bodies, "unit"), process.ask(bodies[:1], "layer")
        assert second() == step.content(bodies[:1], "layer")
        assert first() == step.content(bodies, "unit")


def test_what_fails_there_is_the_same_error_here_and_the_process_goes_on() -> None:
    """OCCT loses a part of this body: a cylinder and a cone lying in it, edge on edge."""
    bodies = MouldSet(load("single-embedded")).unit[:1]
    shape = Union((cylinder(1, 0, 1), turned(Revolve(polygon((0, 0), (1, 0), (0, 1))), "y", 3)))
    with StepProcess() as process:
        wrong, sound = process.ask([replace(bodies[0], shape=shape)], "wrong"), process.ask(bodies, "layer")
        with pytest.raises(UnitcadError, match="OCCT and manifold3d differ: 1 solids"):
            wrong()
        assert sound() == step.content(bodies, "layer")


def test_who_asks_a_process_that_has_ended_is_told() -> None:
    with StepProcess() as process:
        os.kill(process._child.pid, signal.SIGKILL)
        with pytest.raises(Lost):
            process.ask(MouldSet(load("single-embedded")).unit, "unit")()


def test_a_build_whose_process_is_lost_writes_its_step_itself(tmp_path: Path) -> None:
    spec = load("single-embedded", {"output.formats": ["step"]})
    with StepProcess() as process:
        os.kill(process._child.pid, signal.SIGKILL)
        lost = build(spec, tmp_path / "lost", only=("unit",), step=process)
    with StepProcess() as process:
        beside = build(spec, tmp_path / "beside", only=("unit",), step=process)
        child = process._child
    assert child.returncode is not None
    here = build(spec, tmp_path / "here", only=("unit",))
    assert lost.manifest == beside.manifest == here.manifest
    assert (lost.folder / "unit.step").read_bytes() == (beside.folder / "unit.step").read_bytes()


def test_the_command_loads_no_occt_itself_and_leaves_no_process(tmp_path: Path) -> None:
    psutil = pytest.importorskip("psutil")
    code = (
        "import sys; from unitcad.cli import app; "
        "app(['build', 'single-embedded', '--only', 'unit', '--no-check', '-o', sys.argv[1]], standalone_mode=False); "
        "print('OCP' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    folder, loaded = done.stdout.splitlines()
    assert "unit.step" in json.loads((Path(folder) / "manifest.json").read_text())["files"]
    assert loaded == ("False" if len(os.sched_getaffinity(0)) > 1 else "True")
    command = [sys.executable, "-m", "unitcad", "build", "encapsulating", "-o", str(tmp_path / "killed")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as parent:
        children = _wait(lambda: psutil.Process(parent.pid).children())
        parent.kill()
    assert _wait(lambda: not any(child.is_running() and child.status() != "zombie" for child in children))


def _wait(what):
    for _ in range(300):
        if found := what():
            return found
        time.sleep(0.1)
    raise AssertionError("waited for 30 s")

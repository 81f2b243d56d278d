"""Processes beside a build: the same bytes with them, without them and where they are lost; nothing left behind."""

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

from unitcad.children import cores
from unitcad.errors import Refusal, UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.beside import Beside, started
from unitcad.pipeline.build import Built, build
from unitcad.report.viewer_models import model
from unitcad.shape import Revolve, Union, cylinder, polygon, turned
from unitcad.spec import spec_hash
from unitcad.validation import load


def _files(built: Built) -> dict[str, bytes]:
    found = {p.relative_to(built.folder).as_posix(): p.read_bytes() for p in built.folder.rglob("*") if p.is_file()}
    return {path: content for path, content in found.items() if path != "timings.json"}


def _lost() -> bytes:
    raise LookupError("made here")


def _killed(process: Beside) -> None:
    for each in process._processes:
        os.kill(each._child.pid, signal.SIGKILL)


@pytest.mark.parametrize(("step", "rest"), [(False, True), (True, False), (True, True)])
def test_a_build_writes_the_same_with_processes_without_and_where_they_are_lost(
    tmp_path: Path, step: bool, rest: bool
) -> None:
    if step:
        pytest.importorskip("OCP")
    spec = load("single-embedded", {"output.formats": ["stl", "step"] if step else ["stl"]})
    only = ("unit", "casting", "estimate")
    here = _files(build(spec, tmp_path / "here", only=only, check=False))
    assert {"estimate.json", "steps/pieces.png", "steps/peel.png"} < here.keys()
    assert ("unit.step" in here) == step
    with Beside(step, rest) as processes:
        assert _files(build(spec, tmp_path / "beside", only=only, check=False, beside=processes)) == here
        children = [each._child for each in processes._processes]
    assert len(children) == step + rest
    assert all(child.returncode is not None for child in children)
    with Beside(step, rest) as processes:
        _killed(processes)
        assert _files(build(spec, tmp_path / "lost", only=only, check=False, beside=processes)) == here


def test_what_the_process_gives_is_taken_and_what_it_has_not_begun_is_made_here() -> None:
    spec = load("single-embedded")
    made_here: list[str] = []

    def here() -> dict[str, str]:
        made_here.append("estimate")
        return {"made": "here"}

    with Beside(rest=True) as process:
        first = process.estimate(spec, here)
        waiting = process.estimate(spec, here)
        assert waiting() == {"made": "here"}
        assert made_here == ["estimate"]
        assert first()["variant"]["diameter_mm"] == spec.diameter_mm
        assert made_here == ["estimate"]


def test_a_function_is_called_there_and_here_where_that_fails() -> None:
    spec, small = load("single-embedded"), load("single-embedded", {"moulds.bed_x_mm": 20})
    with Beside(rest=True) as process:
        assert process.call(spec_hash, spec)() == spec_hash(spec)
        with pytest.raises(Refusal, match="bed"):
            process.call(model, small)()
        assert process.call(spec_hash, spec)() == spec_hash(spec)
        _killed(process)
        assert process.call(spec_hash, spec)() == spec_hash(spec)
    assert Beside().call(spec_hash, spec)() == spec_hash(spec)


def test_what_is_refused_there_is_refused_here() -> None:
    spec = load("single-embedded")

    def here() -> dict[str, str]:
        raise LookupError("asked here")

    with Beside(rest=True) as process:
        (child,) = process._processes
        asked = child.answer(("estimate", "no spec"))
        assert asked.exception() is not None or asked.result() is None
        with pytest.raises(LookupError, match="asked here"):  # the process has ended, or said that it refuses
            process.estimate(spec, here)()


def test_step_files_come_in_the_order_of_asking_and_with_the_same_bytes_as_here() -> None:
    pytest.importorskip("OCP")
    from unitcad.export import step

    bodies = MouldSet(load("single-embedded")).unit
    with Beside(step=True) as process:
        first, second = process.step(bodies, "unit", _lost), process.step(bodies[:1], "layer", _lost)
        assert second() == step.content(bodies[:1], "layer")
        assert first() == step.content(bodies, "unit")


def test_what_fails_in_occt_is_the_same_error_here_and_the_process_goes_on() -> None:
    """OCCT loses a part of this body: a cylinder and a cone lying in it, edge on edge."""
    pytest.importorskip("OCP")
    from unitcad.export import step

    bodies = MouldSet(load("single-embedded")).unit[:1]
    shape = Union((cylinder(1, 0, 1), turned(Revolve(polygon((0, 0), (1, 0), (0, 1))), "y", 3)))
    with Beside(step=True) as process:
        wrong = process.step([replace(bodies[0], shape=shape)], "wrong", _lost)
        sound = process.step(bodies, "layer", _lost)
        with pytest.raises(UnitcadError, match="OCCT and manifold3d differ: 1 solids"):
            wrong()
        assert sound() == step.content(bodies, "layer")


def test_who_asks_a_process_that_has_ended_makes_the_step_itself() -> None:
    with Beside(step=True) as process:
        _killed(process)
        with pytest.raises(LookupError, match="made here"):
            process.step(MouldSet(load("single-embedded")).unit, "unit", _lost)()


def test_the_command_loads_no_scipy_itself(tmp_path: Path) -> None:
    if cores() < 2:
        pytest.skip("one core: everything is made in one process")
    code = (
        "import sys; from unitcad.cli import app; "
        "app(['build', 'encapsulating', '--formats', 'stl,3mf', '-o', sys.argv[1]], standalone_mode=False); "
        "print('scipy' in sys.modules, 'unitcad.batch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False False"


def test_the_command_loads_no_occt_itself_and_leaves_no_process(tmp_path: Path) -> None:
    psutil = pytest.importorskip("psutil")
    pytest.importorskip("OCP")
    code = (
        "import sys; from unitcad.cli import app; "
        "app(['build', 'single-embedded', '--only', 'unit', '--no-check', '-o', sys.argv[1]], standalone_mode=False); "
        "print('OCP' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    folder, loaded = done.stdout.splitlines()
    assert "unit.step" in json.loads((Path(folder) / "manifest.json").read_text())["files"]
    alone = cores() < 2
    assert loaded == str(alone)
    if alone:  # it has no other process
        return
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


@pytest.mark.parametrize(
    ("cores", "occt", "step", "rest", "begun"),
    [
        (1, True, True, True, []),
        (2, True, False, True, ["estimate"]),
        (2, True, True, True, ["step"]),
        (2, False, True, True, ["estimate"]),
        (3, True, True, True, ["step", "estimate"]),
        (3, True, True, False, ["step"]),
    ],
)
def test_no_more_processes_run_than_there_are_cores(
    monkeypatch: pytest.MonkeyPatch, cores: int, occt: bool, step: bool, rest: bool, begun: list[str]
) -> None:
    monkeypatch.setattr("unitcad.pipeline.beside.cores", lambda: cores)
    monkeypatch.setattr("unitcad.pipeline.beside.find_spec", lambda name: name if occt else None)
    monkeypatch.delitem(sys.modules, "OCP", raising=False)
    asked: list[str] = []
    monkeypatch.setattr("unitcad.children.Answering.__init__", lambda self, module, first: asked.append(first))
    started(step, rest)
    assert asked == begun


def test_processes_start_before_numpy_is_loaded():
    code = "import sys; import unitcad.cli.build_command, unitcad.pipeline.beside; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0

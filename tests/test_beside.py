"""A second process beside a build: the same bytes with it, without it and where it is lost; nothing left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from unitcad.pipeline.beside import Beside
from unitcad.pipeline.build import Built, build
from unitcad.validation import load


def _files(built: Built) -> dict[str, bytes]:
    found = {p.relative_to(built.folder).as_posix(): p.read_bytes() for p in built.folder.rglob("*") if p.is_file()}
    return {path: content for path, content in found.items() if path != "timings.json"}


def test_a_build_writes_the_same_with_a_process_without_and_where_it_is_lost(tmp_path: Path) -> None:
    spec, only = load("single-embedded", {"output.formats": ["stl"]}), ("casting", "estimate")
    here = _files(build(spec, tmp_path / "here", only=only, check=False))
    assert {"estimate.json", "steps/pieces.png", "steps/peel.png"} < here.keys()
    with Beside() as process:
        assert _files(build(spec, tmp_path / "beside", only=only, check=False, beside=process)) == here
        child = process._child
    assert child.returncode is not None
    with Beside() as process:
        os.kill(process._child.pid, signal.SIGKILL)
        assert _files(build(spec, tmp_path / "lost", only=only, check=False, beside=process)) == here


def test_what_the_process_gives_is_taken_and_what_it_has_not_begun_is_made_here() -> None:
    spec = load("single-embedded")
    made_here: list[str] = []

    def here() -> dict[str, str]:
        made_here.append("estimate")
        return {"made": "here"}

    with Beside() as process:
        first = process.estimate(spec, here)
        waiting = process.estimate(spec, here)
        assert waiting() == {"made": "here"}
        assert made_here == ["estimate"]
        assert first()["variant"]["diameter_mm"] == spec.diameter_mm
        assert made_here == ["estimate"]


def test_what_is_refused_there_is_refused_here() -> None:
    spec = load("single-embedded")

    def here() -> dict[str, str]:
        raise LookupError("asked here")

    with Beside() as process:
        asked = process.answer(("estimate", "no spec"))
        assert asked.exception() is not None or asked.result() is None
        with pytest.raises(LookupError, match="asked here"):  # the process has ended, or said that it refuses
            process.estimate(spec, here)()


def test_the_command_loads_no_scipy_itself(tmp_path: Path) -> None:
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one core: everything is made in one process")
    code = (
        "import sys; from unitcad.cli import app; "
        "app(['build', 'encapsulating', '--formats', 'stl,3mf', '-o', sys.argv[1]], standalone_mode=False); "
        "print('scipy' in sys.modules, 'unitcad.batch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False False"


@pytest.mark.parametrize(("cores", "formats", "count"), [(1, "stl", 0), (2, "stl", 1), (2, None, 1), (3, None, 2)])
def test_a_build_begins_no_more_processes_than_cores(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, cores: int, formats: str | None, count: int
) -> None:
    """With STEP, two cores are full: the process of estimate and pictures would only slow them."""
    begun: list[str] = []
    monkeypatch.setattr("unitcad.children.cores", lambda: cores)
    monkeypatch.setattr("unitcad.export.step_process.worthwhile", lambda: cores > 1)
    monkeypatch.setattr("unitcad.children.Answering.__init__", lambda self, module: begun.append(module))
    monkeypatch.setattr("unitcad.children.Answering.__enter__", lambda self: self)
    monkeypatch.setattr("unitcad.children.Answering.__exit__", lambda self, *what: None)
    from unitcad.cli.build_command import _beside, _step_process

    with _step_process(None, formats) as step, _beside(None, 1 if step is None else 2):
        pass
    assert len(begun) == count

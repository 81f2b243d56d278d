"""No command imports anything from the folder in which it runs."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from unitcad.cache import DiskStore

PLANTED = "open({mark!r}, 'w').close()\nraise SystemExit('planted')\n"
SCRIPT = shutil.which("unitcad", path=str(Path(sys.executable).parent)) or "unitcad"
SWEEP = 'base = "single-embedded"\n[set]\n"output.formats" = ["stl", "png"]\n[sweep]\ndiameter_mm = [14.0, 15.0]\n'
COMMANDS = [
    "batch sweep.toml --only unit -j 1",
    "check a.stl b.stl -j 2",
    "check a.step b.stl",
    "report result",
]
MORE = [
    "build single-embedded --formats stl,png --only unit",
    "build single-embedded --formats step,stl,3mf,svg,png,glb",
    "batch sweep.toml -j 0",
    "batch sweep.toml --only estimate",
    "batch sweep.toml --dry-run",
    "check a.stl",
    "check --manifest result",
    "estimate single-embedded",
    "estimate single-embedded --frequency 100:120:10 --json",
    "init mine",
    "list materials",
    "schema",
    "coupon fdm-0.4",
    "cache ls --cache cache",
    "cache gc --cache cache",
    "accuracy --help",
]


@cache
def _names():
    """Modules that anything might import: Python's own and those of what is installed."""
    found = set(importlib.metadata.packages_distributions()) | set(sys.stdlib_module_names)
    optional = {"OCP", "build123d", "cadquery", "distributed", "gmsh", "sitecustomize", "usercustomize"}
    return frozenset(name for name in found | optional if name.isidentifier()) - {"unitcad", "__main__"}


@pytest.fixture(scope="module")
def material(tmp_path_factory):
    """What the commands work on."""
    folder = tmp_path_factory.mktemp("material")
    (folder / "sweep.toml").write_text(SWEEP)
    command = [SCRIPT, "build", "single-embedded", "--formats", "stl", "--only", "unit", "-o", "out", "--no-check"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (result,) = (folder / "out").iterdir()
    result.rename(folder / "result")
    DiskStore(folder / "cache").close()
    stl = next((folder / "result").rglob("*.stl"))
    for name in ("a.stl", "b.stl", "a.step"):
        shutil.copy(stl, folder / name)
    return folder


def _planted(material, folder, spared=frozenset()):
    """A working directory full of modules, and the folder in which each leaves a mark when it runs."""
    here, ran = folder / "here", folder / "ran"
    shutil.copytree(material, here)
    ran.mkdir()
    for name in _names() - spared:
        (here / f"{name}.py").write_text(PLANTED.format(mark=str(ran / name)))
    return here, ran


def _run(command, here, ran):
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    environment["UNITCAD_CACHE"] = str(here.parent / "cache")
    done = subprocess.run(command, cwd=here, env=environment, capture_output=True, text=True, timeout=300)
    assert [path.name for path in ran.iterdir()] == []
    assert "planted" not in done.stderr + done.stdout
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 1)


@pytest.mark.parametrize("arguments", [*COMMANDS, *(pytest.param(more, marks=pytest.mark.long) for more in MORE)])
def test_nothing_is_imported_from_the_working_directory(arguments, material, tmp_path):
    here, ran = _planted(material, tmp_path)
    _run([SCRIPT, *arguments.split()], here, ran)


@pytest.mark.parametrize("arguments", ["check a.stl b.stl -j 2", pytest.param(MORE[0], marks=pytest.mark.long)])
def test_python_m_imports_no_more_than_python_itself(arguments, material, tmp_path):
    (tmp_path / "trivial.py").write_text("import sys\nprint(*sys.modules)\n")
    command = [sys.executable, "-m", "trivial"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    here, ran = _planted(material, tmp_path, frozenset(done.stdout.split()))
    _run([sys.executable, "-m", "unitcad", *arguments.split()], here, ran)

"""Code that lies in a result, or that a spec brings along, never runs unasked."""

import json
import os
import subprocess
import sys

import pytest

SPEC = """
name = "planted"
design = "{design}"
diameter_mm = 14.0
[[layers]]
material = "ecoflex-00-10"
wall_mm = 1.25
[output]
formats = []
tolerance_mm = 0.1
"""
CODE = """
open({ran!r}, "w").close()
from unitcad.shape import ring
def f(spec):
    return ring(4.5, 7.0, 0, 2.0)
"""


def _unitcad(*arguments, cwd):
    command = [sys.executable, "-m", "unitcad", *map(str, arguments)]
    environment = {**os.environ, "UNITCAD_CACHE": str(cwd / "cache")}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False, timeout=120)


class Planted:
    """A folder with code that leaves a mark when it runs: as a file, embedded in a spec, in results."""

    def __init__(self, folder):
        self.folder = folder
        self.ran = folder / "RAN"
        self.code = CODE.format(ran=str(self.ran))
        (folder / "d.py").write_text(self.code)
        (folder / "named.toml").write_text(SPEC.format(design="d.py:f"))
        source = f"design_source = {json.dumps(self.code)}\n"
        (folder / "embedded.toml").write_text(source + SPEC.format(design="d.py:f"))
        for place, manifest in (("results/one", "{}"), ("results/two", '{"parts": []}')):
            (folder / place).mkdir(parents=True)
            (folder / place / "manifest.json").write_text(manifest)
        (folder / "results/one/spec.toml").write_text(source + SPEC.format(design="d.py:f"))
        # Without the text: a path, to where the command runs or anywhere else.
        (folder / "results/two/spec.toml").write_text(SPEC.format(design=f"{folder}/d.py:f"))


@pytest.fixture
def planted(tmp_path):
    return Planted(tmp_path)


@pytest.mark.parametrize(
    "arguments",
    [
        "report results",
        "report results/one",
        "report results/two",
        "build embedded.toml --only unit",
        "build results/one/spec.toml --only unit",
        "estimate embedded.toml",
        "estimate results/one/spec.toml",
        "list templates",
        "check results",
    ],
)
def test_code_that_nobody_named_does_not_run(arguments, planted):
    done = _unitcad(*arguments.split(), cwd=planted.folder)
    assert not planted.ran.exists()
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
    if arguments.startswith(("build", "batch")) and "estimate" not in arguments:
        assert done.returncode in (1, 2)
        assert "--allow-code" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        "build named.toml --only unit",
        "build embedded.toml --only unit --allow-code",
    ],
)
def test_code_of_a_file_that_was_named_runs_and_other_code_when_allowed(arguments, planted):
    done = _unitcad(*arguments.split(), cwd=planted.folder)
    assert done.returncode == 0, done.stderr
    assert planted.ran.exists()


def test_an_estimate_reads_a_named_design_and_with_it_runs_its_file(planted):
    """Its file says whether it has an estimate; a function has none."""
    done = _unitcad("estimate", "named.toml", cwd=planted.folder)
    assert planted.ran.exists()
    assert done.returncode == 2, done.stderr
    assert "has no estimate" in done.stderr


def test_a_page_is_made_of_a_result_whose_code_does_not_run(planted):
    assert _unitcad("build", "named.toml", "--only", "unit", "-o", "results", cwd=planted.folder).returncode == 0
    planted.ran.unlink()
    done = _unitcad("report", "results", cwd=planted.folder)
    assert done.returncode == 0, done.stderr
    assert (planted.folder / "results" / "report.html").is_file()
    assert not planted.ran.exists()
    assert _unitcad("report", "results", "--allow-code", cwd=planted.folder).returncode == 0
    assert planted.ran.exists()

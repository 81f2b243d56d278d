"""Code that lies in a result, or that a spec brings along, never runs unasked."""

import json

import pytest

from tests.in_process import unitcad
from unitcad.spec.custom_code import allow_nothing

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
def mark():
    open({ran!r}, "w").close()
mark()
from unitcad.shape import ring
def f(spec):
    mark()  # this process keeps what it has run
    return ring(4.5, 7.0, 0, 2.0)
"""


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

    def run(self, arguments):
        """Run a command in the folder, as in a process that has been told of no code yet."""
        allow_nothing()
        return unitcad(*arguments.split(), cwd=self.folder)


@pytest.fixture
def planted(tmp_path, monkeypatch):
    monkeypatch.setenv("UNITCAD_CACHE", str(tmp_path / "cache"))
    yield Planted(tmp_path)
    allow_nothing()


@pytest.mark.parametrize(
    "arguments",
    [
        "report results",
        "build embedded.toml --only unit",
        "build results/one/spec.toml --only unit",
        "estimate embedded.toml",
        "estimate results/one/spec.toml",
        "list templates",
        "check results",
    ],
)
def test_code_that_nobody_named_does_not_run(arguments, planted):
    done = planted.run(arguments)
    assert not planted.ran.exists()
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
    if arguments.startswith(("build", "batch")) and not {"estimate", "--dry-run"} & {*arguments.split()}:
        assert done.returncode in (1, 2)
        assert "--allow-code" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    ["build named.toml --only unit", "build embedded.toml --only unit --allow-code"],
)
def test_code_of_a_file_that_was_named_runs_and_other_code_when_allowed(arguments, planted):
    done = planted.run(arguments)
    assert done.returncode == 0, done.stderr
    assert planted.ran.exists()


def test_an_estimate_of_a_named_design_has_a_curve_and_no_level(planted):
    done = planted.run("estimate named.toml")
    assert done.returncode == 0, done.stderr
    assert "Level at the edge: " not in done.stdout


def test_a_page_is_made_of_a_result_whose_code_does_not_run(planted):
    assert planted.run("build named.toml --only unit -o results").returncode == 0
    planted.ran.unlink()
    done = planted.run("report results")
    assert done.returncode == 0, done.stderr
    assert (planted.folder / "results" / "report.html").is_file()
    assert not planted.ran.exists()
    assert planted.run("report results --allow-code").returncode == 0
    assert planted.ran.exists()

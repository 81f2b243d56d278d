"""Every fault of a spec at once, each with its line; a value that is offered is accepted."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.validation import load, read, templates

BAD = """\
name = "bad"
design = "encapsulating"
diameter_mm = -3
colour = "red"

[[layers]]
material = "ecoflex-00-10"
wall_mm = 1.25
cap_mm = 1.25

[[layers]]      # the outer one
material = "butter"
wall_mm = "thick"
cap_mm = 1.25

[moulds]
printer = "prusa"
cavities = [
  1,
  0,
]

[estimate]
models = ["elements"]
"""
FAULTS = {
    "diameter_mm": 3,
    "colour": 4,
    "layers.1.material": 12,
    "layers.1.wall_mm": 13,
    "moulds.printer": 17,
    "moulds.cavities.1": 18,
    "estimate.models.0": 24,
}


@pytest.fixture
def bad(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(BAD)
    return file


def refusal(source, changes=()):
    with pytest.raises(Refusal) as refused:
        load(source, changes)  # type: ignore[arg-type]
    return refused.value


def test_all_faults_are_listed_with_their_lines(bad):
    first = refusal(bad)
    found = [first, *first.others]
    assert {one.field: one.line for one in found} == FAULTS
    assert {one.file for one in found} == {str(bad)}


def test_the_command_prints_a_line_a_fault_in_the_order_of_the_file(bad):
    done = subprocess.run(
        [sys.executable, "-m", "unitcad", "build", str(bad), "--json"], capture_output=True, text=True, cwd=bad.parent
    )
    assert done.returncode == 2
    lines = done.stderr.splitlines()
    assert [line.removeprefix(f"error: {bad}:").split(":")[0] for line in lines] == [str(n) for n in FAULTS.values()]
    error = json.loads(done.stdout)["error"]
    assert {one["field"]: one["line"] for one in (error, *error["others"])} == FAULTS
    assert [path.name for path in bad.parent.iterdir()] == ["bad.toml"]


def test_a_fault_that_only_follows_from_another_is_not_listed(tmp_path):
    """A diameter of 12.2 mm, the least that is accepted, has no room for this tail; one of 14 mm has."""
    data = read("encapsulating")
    data["diameter_mm"] = -3
    assert [one.field for one in (refusal(data), *refusal(data).others)] == ["diameter_mm"]


def test_a_value_from_an_option_has_no_line(bad, tmp_path):
    good = tmp_path / "good.toml"
    good.write_text(templates()["encapsulating"].read_text())
    refused = refusal(good, ["diameter_mm=-3"])
    assert (refused.file, refused.line) == (None, None)
    assert refused.located == str(refused)


def test_a_key_that_is_missing_is_on_the_line_of_its_table(tmp_path):
    file = tmp_path / "x.toml"
    file.write_text(
        BAD.replace('material = "butter"\n', "").replace("diameter_mm = -3\n", "").replace('"thick"', "1.2")
    )
    found = [refused := refusal(file), *refused.others]
    lines = {one.field: one.line for one in found}
    assert lines["layers.1.material"] == 10
    assert lines["diameter_mm"] is None


def test_init_writes_no_python_and_names_the_schema_that_schema_writes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    assert run(app, ["init", "mine"]).exit_code == 0
    text = Path("mine.toml").read_text()
    assert "None" not in text
    assert "fit_source" not in text
    named = text.splitlines()[0].removeprefix("#:schema ./")
    done = run(app, ["schema", "-o", named])
    assert done.output.strip() == named
    assert json.loads(Path(named).read_text()) == json.loads(run(app, ["schema"]).output)
    assert "None" not in Path(named).read_text()
    assert load("./mine.toml") == load("encapsulating", ["name=mine"])

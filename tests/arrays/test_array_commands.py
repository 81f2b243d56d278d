"""The commands know arrays: init, schema, list, build and report."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.cli import app
from unitcad.errors import Refusal

run = CliRunner()


def test_arrays_are_listed() -> None:
    shown = json.loads(run.invoke(app, ["list", "arrays", "--json"]).stdout)["arrays"]
    assert list(shown) == list(array_templates())
    assert all(about for about in shown.values())


@pytest.mark.parametrize("name", array_templates())
def test_a_new_file_is_the_template_under_its_own_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = run.invoke(app, ["init", "mine", "--template", name])
    assert done.exit_code == 0, done.output
    text = Path("mine.toml").read_text()
    assert text.startswith("#:schema ./unitcad-array.schema.json")
    assert {**load_array("mine.toml").asked, "name": name} == {**load_array(name).asked, "name": name}
    # Every further key that is offered is one: its table is accepted with the comment's sign taken away.
    offered = [line[2:] for line in text.splitlines() if line.startswith("# ") and " = " in line and "..." not in line]
    assert any(line.startswith('printer = "fdm-0.4"') for line in offered)


def test_the_schema_has_each_kind_of_layout() -> None:
    schema = json.loads(run.invoke(app, ["schema", "array"]).stdout)
    kinds = schema["$defs"]["AskedArray"]["properties"]["layout"]["oneOf"]
    assert {kind["$ref"].rpartition("/")[2] for kind in kinds} == {"GridTable", "HexTable", "RingTable", "ListTable"}
    jsonschema = pytest.importorskip("jsonschema")
    for path in array_templates().values():
        jsonschema.validate(tomllib.loads(path.read_text()), schema)


def test_a_refusal_names_file_line_and_the_pitch_that_fits(tmp_path: Path) -> None:
    file = tmp_path / "near.toml"
    file.write_text(array_templates()["hex-19"].read_text().replace("pitch_mm = 20.0", "pitch_mm = 12.0"))
    with pytest.raises(Refusal) as refused:
        load_array(file)
    assert refused.value.located.startswith(f"{file}:9: layout.pitch_mm = 12: ")
    assert refused.value.nearest == 18
    with pytest.raises(Refusal) as refused:
        load_array(file, ["layout.pitch_mm=11"])
    assert refused.value.line is None


def test_build_writes_an_array_and_its_page(tmp_path: Path) -> None:
    options = [
        "--formats",
        "stl",
        "--set",
        "layout.columns=1",
        "--set",
        "layout.rows=1",
        "--set",
        "moulds.cavities=[1,1]",
    ]
    options += ["--set", "sheet.strap_slot_mm=[3,8]"]
    done = run.invoke(app, ["build", "forearm-pockets", "-o", str(tmp_path), "--report", *options])
    assert done.exit_code == 0, done.output
    folder = Path(done.stdout.splitlines()[-1])
    page = (folder / "report.html").read_text()
    assert "1 units" not in page
    assert "The patch from the skin&#x27;s side" in page
    named = set(re.findall(r"sha256-([A-Za-z0-9+/=]+)", page.split("<title>")[0]))
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert {base64.b64encode(hashlib.sha256(each.encode()).digest()).decode() for each in scripts} < named
    assert 'class="stage-host"' in page
    assert (folder / "bench.html").is_file()
    assert (folder / "units/encapsulating/report.html").is_file()
    assert "1 unit on a sheet" in done.stderr

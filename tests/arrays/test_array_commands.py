"""The commands know arrays: init, schema, list, build and report."""

import base64
import hashlib
import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

from tests.in_process import unitcad
from unitcad.arrays.array_file import array_hash, array_templates, load_array
from unitcad.errors import Refusal


def test_arrays_are_listed():
    shown = json.loads(unitcad("list", "arrays", "--json").stdout)["arrays"]
    assert list(shown) == list(array_templates())
    assert all(about for about in shown.values())


@pytest.mark.parametrize("name", array_templates())
def test_a_new_file_is_the_template_under_its_own_name(name, tmp_path):
    assert unitcad("init", "mine", "--template", name, cwd=tmp_path).returncode == 0
    text = (tmp_path / "mine.toml").read_text()
    assert text.startswith("#:schema ./unitcad-array.schema.json")
    assert {**load_array(tmp_path / "mine.toml").asked, "name": name} == {**load_array(name).asked, "name": name}
    # Every further key that is offered is one: its table is accepted with the comment's sign taken away.
    offered = [line[2:] for line in text.splitlines() if line.startswith("# ") and " = " in line and "..." not in line]
    assert any(line.startswith('printer = "fdm-0.4"') for line in offered)


def test_the_schema_has_each_kind_of_layout():
    schema = json.loads(unitcad("schema", "array").stdout)
    kinds = schema["$defs"]["AskedArray"]["properties"]["layout"]["oneOf"]
    assert {kind["$ref"].rpartition("/")[2] for kind in kinds} == {"GridTable", "HexTable", "RingTable", "ListTable"}
    for path in array_templates().values():
        jsonschema.validate(tomllib.loads(path.read_text()), schema)


def test_a_refusal_names_file_line_and_the_pitch_that_fits(tmp_path):
    file = tmp_path / "near.toml"
    file.write_text(array_templates()["hex-19"].read_text().replace("pitch_mm = 20.0", "pitch_mm = 12.0"))
    with pytest.raises(Refusal) as refused:
        load_array(file)
    assert refused.value.located.startswith(f"{file}:9: layout.pitch_mm = 12: ")
    assert refused.value.nearest == 18
    with pytest.raises(Refusal) as refused:
        load_array(file, ["layout.pitch_mm=11"])
    assert refused.value.line is None


def test_build_writes_an_array_and_its_page(tmp_path):
    sets = "--set layout.columns=1 --set layout.rows=1 --set moulds.cavities=[1,1] --set sheet.strap_slot_mm=[3,8]"
    words = f"build forearm-pockets --report --formats stl {sets} -o"
    done = unitcad(*words.split(), tmp_path)
    assert done.returncode == 0, done.stderr
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
    assert "unit encapsulating is 4.6 mm high (drawn 4.61), caps 1.2 and 1.2" in done.stderr


def test_step_0_of_an_array_measures_each_unit_s_parts_and_its_command_builds_the_array(tmp_path):
    """Two kinds of units, one at a place of its own. A given value counts as measured, also the catalogue's own."""
    (tmp_path / "mixed.toml").write_text(
        'name = "mixed"\narray = "pockets"\nunit = "encapsulating"\n[[place]]\nat = "A1"\nunit = "motor-10mm"\n'
        '[layout]\nkind = "grid"\ncolumns = 2\nrows = 1\npitch_mm = 25.0\n'
    )
    given = ["--set", "unit.motor.thickness_mm=2", "--set", "place.0.unit.fpcb.thickness_mm=0.11"]
    words = "--only", "casting", "-o", tmp_path
    done = unitcad("build", tmp_path / "mixed.toml", *words, *given)
    assert "assumed: unit.fpcb.thickness_mm = 0.11 (usual stock)" in done.stderr
    folder = Path(done.stdout.splitlines()[-1])
    text = (folder / "casting.md").read_text()
    lines = re.findall(r"^- (\S+): (.* thickness): (.*)$", text, re.MULTILINE)
    assert lines == [
        ("motor-10mm", "motor thickness", "1.8 mm"),
        ("motor-10mm", "circuit thickness", "0.11 mm"),
        ("encapsulating", "motor thickness", "2 mm"),
        ("encapsulating", "circuit thickness", "0.11 mm (assumed; usual stock)"),
    ]
    (command,) = re.findall(r"^unitcad build array.toml (.*)$", text, re.MULTILINE)
    assert len(sets := command.replace("--set ", "").split()) == 8
    assert array_hash(load_array(folder / "array.toml", sets)) == array_hash(load_array(folder / "array.toml"))
    assert "(assumed;" not in (folder / "units/motor-10mm/casting.md").read_text()
    again = unitcad("build", folder / "array.toml", *words)
    assert "assumed: unit.motor.thickness_mm = 2" in again.stderr, "a result's file has every value"

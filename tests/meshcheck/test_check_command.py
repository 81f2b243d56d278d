"""`unitcad check` as a person or a CI job runs it."""

import hashlib
import json
import os
import re
from functools import partial

import pytest
from shapes import box, stl

from tests.in_process import unitcad

GOOD, HOLE, WARN = stl(box()), stl(box()[2:]), stl(box()) + bytes(16)


run = partial(unitcad, "check")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "good.stl").write_bytes(GOOD)
    (tmp_path / "sub" / "hole.stl").write_bytes(HOLE)
    (tmp_path / "sub" / "warn.STL").write_bytes(WARN)
    (tmp_path / "sub" / "notes.txt").write_text("not a mesh")
    return tmp_path


def test_exit_codes(folder):
    assert run("good.stl", cwd=folder).returncode == 0
    assert run("sub/hole.stl", cwd=folder).returncode == 1
    assert run("sub/warn.STL", cwd=folder).returncode == 0
    assert run("sub/warn.STL", "--fail-on", "warning", cwd=folder).returncode == 1
    assert run("none.stl", cwd=folder).returncode == 2
    assert run(cwd=folder).returncode == run("--manifest", "nowhere", cwd=folder).returncode == 2
    for wrong in (["--fail-on", "x"], ["--select", "Q"], ["--printer", "x"], ["--unit", "x"], ["--output-format", "x"]):
        result = run("good.stl", *wrong, cwd=folder)
        assert result.returncode == 2
        assert result.stderr.startswith("error: ")
        assert "Traceback" not in result.stderr


def test_reports_are_written_beside_the_one_that_is_printed(folder):
    copies = ("--report", "json=new folder/all.json", "--report", "junit=all.xml")
    result = run("sub", *copies, "--output-format", "github", cwd=folder)
    assert result.returncode == 1
    assert result.stdout.startswith("::error file=sub/hole.stl")
    assert (folder / "new folder/all.json").read_text("utf-8") == run("sub", "--json", cwd=folder).stdout
    assert (folder / "all.xml").read_text("utf-8").startswith("<?xml")


@pytest.mark.parametrize(("given", "said"), [
    ("all.json", "must be FORMAT=FILE"), ("json=", "must be FORMAT=FILE"), ("xml=a.xml", "--report = 'xml'"),
    ("json=sub", "this is a folder"), ("json=good.stl/a.json", "--report: good.stl/a.json: "),
])  # fmt: skip
def test_a_wrong_report_is_one_sentence_and_nothing_is_written(folder, given, said):
    before = sorted(folder.rglob("*"))
    result = run("good.stl", "--report", given, cwd=folder)
    assert result.returncode == 2
    assert said in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(folder.rglob("*")) == before


def test_folders_and_globs(folder):
    data = json.loads(run(".", "--json", cwd=folder).stdout)
    assert [entry["path"] for entry in data["files"]] == ["good.stl", "sub/hole.stl", "sub/warn.STL"]
    data = json.loads(run("**/*.stl", "--json", cwd=folder).stdout)
    assert [entry["path"] for entry in data["files"]] == ["good.stl", "sub/hole.stl"]
    (folder / "bare").mkdir()
    for name in ("bare", "no*.stl", "god.stl"):
        alone = run(name, "--json", cwd=folder)
        assert alone.returncode == 2
        assert json.loads(alone.stdout)["error"]["value"] == name
        result = run(name, "sub/warn.STL", "--json", cwd=folder)
        assert result.returncode == 2
        codes = {entry["path"]: entry["findings"][0]["code"] for entry in json.loads(result.stdout)["files"]}
        assert codes.keys() == {name, "sub/warn.STL"}
        assert codes[name] == "F012"


def test_hidden_folders_and_loops_are_left_out_and_each_file_is_judged_once(folder):
    (folder / ".git").mkdir()
    (folder / ".git" / "old.stl").write_bytes(HOLE)
    (folder / "sub" / "again.stl").symlink_to(folder / "good.stl")
    (folder / "sub" / "loop").symlink_to(folder, target_is_directory=True)
    for names in (["."], ["**/*.[sS][tT][lL]"], [".", "good.stl", "./sub"]):
        data = json.loads(run(*names, "--json", cwd=folder).stdout)
        assert [entry["path"] for entry in data["files"]] == ["good.stl", "sub/hole.stl", "sub/warn.STL"]


def test_jobs_give_the_same_answer(folder):
    one, two = run(".", "--json", cwd=folder), run(".", "--json", "--jobs", "2", cwd=folder)
    assert one.stdout == two.stdout
    assert one.returncode == two.returncode == 1


def test_explain_and_select(folder):
    explained = run("--explain", "t001")
    assert explained.returncode == 0
    assert explained.stdout.startswith("T001 boundary edge (error)")
    assert run("--explain", "T999").returncode == 2
    assert run("sub/hole.stl", "--ignore", "T", cwd=folder).returncode == 0
    assert run("sub/hole.stl", "--select", "F", cwd=folder).returncode == 0
    assert run("sub/hole.stl", "--select", "F,T001", cwd=folder).returncode == 1


def test_limits_and_the_number_of_shells(folder):
    assert "F011" in run("good.stl", "--max-faces", "5", cwd=folder).stdout
    assert "1 shell, 2 expected" in run("good.stl", "--shells", "2", cwd=folder).stdout


@pytest.mark.parametrize(
    ("unit", "mm"), [("mm", 1), ("CM", 10), ("m", 1000), ("in", 25.4), ("Inches", 25.4), ("ft", 304.8), ("INCH", 25.4)]
)
def test_units_by_their_short_names(folder, unit, mm):
    data = json.loads(run("good.stl", "--unit", unit, "--json", cwd=folder).stdout)
    assert data["files"][0]["facts"]["volume_mm3"] == pytest.approx((10 * mm) ** 3, rel=1e-12)


def test_a_manifest_holds_the_files_that_are_not_judged(folder):
    step = folder / "unit.step"
    step.write_bytes(b"ISO-10303-21; not judged here")
    listed = {"path": "unit.step", "sha256": hashlib.sha256(step.read_bytes()).hexdigest()}
    files = {"stl": {"path": "good.stl"}, "step": listed}
    part = {"name": "a", "role": "unit", "volume_mm3": 1000.0, "files": files}
    (folder / "manifest.json").write_text(json.dumps({"parts": [part]}))

    def codes(*more):
        result = run("--manifest", str(folder), "--json", *more, cwd=folder / "sub")
        entries = json.loads(result.stdout)["files"]
        return result.returncode, {entry["path"]: [f["code"] for f in entry["findings"]] for entry in entries}

    good = os.path.join("..", "good.stl")
    step_path = os.path.join("..", "unit.step")
    assert codes() == (0, {good: []})
    step.write_bytes(step.read_bytes() + b" ")
    assert codes() == (1, {good: [], step_path: ["M003"]})
    assert codes("../good.stl") == codes()
    assert codes("--ignore", "M003") == (0, {good: []})
    step.unlink()
    assert codes() == (1, {good: [], step_path: ["M004"]})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{}", "not a manifest of `unitcad build`: its top level lacks the key 'parts'"),
        ('{"parts": [{"name": "a"}]}', "parts[0] lacks the key 'role'"),
        ("[]", "its top level has a value of the wrong kind"),
        ('{"parts": [3]}', "parts[0] has a value of the wrong kind"),
        ('{"parts": 3}', "parts has a value of the wrong kind"),
        ("", "not JSON: Expecting value: line 1 column 1 (char 0)"),
    ],
)
def test_a_bad_manifest_is_one_sentence(folder, content, said):
    (folder / "manifest.json").write_text(content)
    result = run("--manifest", "manifest.json", cwd=folder)
    assert result.returncode == 2
    assert result.stderr.startswith("error: --manifest")
    assert result.stderr.endswith(f"{said}\n")
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs FIFOs")
def test_what_is_no_file_in_a_folder_is_found(tmp_path):
    (tmp_path / "good.stl").write_bytes(GOOD)
    (tmp_path / "gone.stl").symlink_to(tmp_path / "nothing.stl")
    os.mkfifo(tmp_path / "pipe.stl")
    done = run(tmp_path)
    assert done.returncode == 1
    assert re.search(r"gone\.stl.*F012.*no such file", done.stdout)
    assert re.search(r"pipe\.stl.*F012.*a pipe", done.stdout)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pictures", "hole.stl"], "--pictures = 'hole.stl': must name a folder; this is a file"),
        (["--json", "--output-format", "sarif"], "--output-format = 'sarif': --json asks for another one"),
    ],
)
def test_options_that_can_not_be_are_refused_before_the_work(words, said, tmp_path):
    (tmp_path / "hole.stl").write_bytes(HOLE)
    done = run("hole.stl", *words, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr + done.stdout

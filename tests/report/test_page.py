"""The page without a browser: what it holds, what it costs, what it refuses."""

import json
import re
import shutil
from importlib.resources import files
from pathlib import Path

import pytest
from pagetable import data_of
from typer.testing import CliRunner

from unitcad.cache import MemoryStore
from unitcad.cli import app
from unitcad.errors import UnitcadError
from unitcad.pipeline.write import build
from unitcad.report import page, read_results, write_report
from unitcad.report.html_page import REFERENCE, Pool
from unitcad.validation import load, templates

NAMESPACE = "http://www.w3.org/1999/xhtml"
"""Of HTML's elements: a name in three.js, which no browser opens."""


QUICK = ("no-fpcb", "three-layer")


def resolved(node, pool):
    if isinstance(node, list):
        return [resolved(item, pool) for item in node]
    if isinstance(node, dict):
        if REFERENCE in node:
            return resolved(pool[node[REFERENCE]], pool)
        return {key: resolved(value, pool) for key, value in node.items()}
    return node


def test_pool_says_everything_once():
    long = {"text": "x" * 500, "list": [list(range(200))] * 3}
    pool = Pool()
    first, again, other = pool.put({"a": long, "b": 1}), pool.put({"a": long, "b": 1}), pool.put({"a": long, "b": 2})
    assert first == again
    assert resolved(other, pool.entries) == {"a": long, "b": 2}
    assert json.dumps([first, again, other, pool.entries]).count("x" * 500) == 1
    assert pool.put("short") == "short"
    no_text = "\udc80" * 200
    assert resolved(pool.put([no_text, no_text]), pool.entries) == [no_text, no_text]


def test_a_page_holds_what_the_folder_holds(built):
    html = write_report(built).read_text("utf-8")
    data = data_of(html)
    ((_, entry),) = data["variants"]
    record = resolved(entry, data["pool"])
    assert record["manifest"] == json.loads((built / "manifest.json").read_text("utf-8"))
    assert record["estimate"] == json.loads((built / "estimate.json").read_text("utf-8"))
    assert record["drawings"]["section.svg"] == (built / "section.svg").read_text("utf-8")
    there = {file.relative_to(built).as_posix() for file in built.rglob("*") if file.is_file()}
    assert {path for path, _ in record["files"]} == there - {"report.html", "timings.json"}
    assert data["models"].keys() == {record["model"]}
    assert len(html.encode()) <= 3_000_000


def test_no_address_but_a_name(built):
    html = write_report(built).read_text("utf-8")
    assert set(re.findall(r"https?://[^\s\"'<>)]*", html)) <= {NAMESPACE}
    for name in ("fetch(", "XMLHttpRequest(", "WebSocket(", "sendBeacon", "importScripts", "@import", "url("):
        assert name not in html, name


def test_policy_forbids_every_connection(built):
    html = write_report(built).read_text("utf-8")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', html)
    assert policy
    assert "default-src &#x27;none&#x27;" in policy[1]
    assert "unsafe" not in policy[1]


def test_licences_travel_with_the_libraries(built):
    html = write_report(built).read_text("utf-8")
    for name, entry in page.vendored().items():
        assert f"{name} {entry['version']}" in html
        assert entry["licence"] == "MIT"
        for file in entry["files"]:
            assert (files("unitcad") / "report" / "vendor" / file).is_file()
    assert html.count("The above copyright notice and this permission notice shall be included") == 2


@pytest.mark.parametrize("name", [*page.PROGRAMS, *(f"../vendor/{n}" for n in page.VENDORED)])
def test_no_program_ends_its_element(name):
    text = (files("unitcad") / "report" / "app" / name).read_text("utf-8").lower()
    assert "</script" not in text
    assert "<!--" not in text


@pytest.mark.parametrize("name", [n for n in page.PROGRAMS])
def test_programs_set_text_and_never_markup(name):
    text = (files("unitcad") / "report" / "app" / name).read_text("utf-8")
    for way in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"):
        assert way not in text


def test_a_name_in_markup_stays_text(tmp_path):
    name = "</title><script>alert(1)</script>\"'&<img src=x onerror=alert(2)>"
    folder = build(load("embedded", [f"name={json.dumps(name)}", "output.formats=[]"]), tmp_path, only=["unit"]).folder
    html = write_report(folder).read_text("utf-8")
    assert "<script>alert" not in html
    assert "<img src=x" not in html
    assert "<title>&lt;/title&gt;" in html


def test_folders_of_a_batch(built, tmp_path):
    shutil.copytree(built, tmp_path / "a")
    shutil.copytree(built, tmp_path / "b")
    shutil.copytree(built, tmp_path / ".tmp-c")
    data = data_of(write_report(tmp_path).read_text("utf-8"))
    assert [folder for folder, _ in data["variants"]] == ["a", "b"]
    assert len(data["models"]) == 1
    assert data["table"]["columns"][0] == "name"
    assert [row[0] for row in data["table"]["rows"]] == ["a", "b"]


def test_a_batch_is_listed_as_it_lists_itself(built, tmp_path):
    shutil.copytree(built, tmp_path / "good")
    variants = [
        {"index": 0, "status": "ok", "folder": "good", "name": "good", "edge": 0.5, "flag": True, "none": None},
        {"index": 1, "status": "failed", "folder": "", "name": "bad"},
        {"index": 2, "status": "ok", "folder": "gone", "name": "gone"},
    ]
    batch = {"name": "sweep", "columns": ["index", "status", "folder", "name", "edge", "flag", "none"]}
    (tmp_path / "batch.json").write_text(json.dumps({**batch, "variants": variants}), "utf-8")
    data = data_of(write_report(tmp_path).read_text("utf-8"))
    assert data["title"] == "sweep: 3 variants"
    assert data["table"]["columns"] == ["name", "status", "edge", "flag", "none", "index"]
    assert data["table"]["rows"] == [
        ["good", "good", "ok", 0.5, "true", None, 0],
        ["", "bad", "failed", None, None, None, 1],
        ["", "gone", "ok", None, None, None, 2],
    ]
    assert "variants" not in data["batch"]


def test_the_levels_and_what_was_swept_come_first(sweep):
    columns = ["index", "status", "reason", "folder", "motor", "moulds.land_mm", "name", "design", "diameter_mm",
               "layer1_volume_mm3", "layer1_mass_g", "laws", "edge_level", "edge_low"]  # fmt: skip
    batch = {"name": "s", "columns": columns, "variants": [dict.fromkeys(columns)]}
    assert read_results.results_table(batch, [], {}).columns == [
        "name", "edge_level", "edge_low", "motor", "moulds.land_mm", "design", "diameter_mm",
        "status", "reason", "layer1_volume_mm3", "layer1_mass_g", "laws", "index",
    ]  # fmt: skip
    without = data_of((sweep / "report.html").read_text("utf-8"))["table"]["columns"]
    places = [
        0
        if name == "name" or name[:5] == "edge_"
        else 1 + (name not in ("design", "diameter_mm") and name[:7] != "layers.")
        for name in without
    ]
    assert places == sorted(places)
    assert set(places) == {0, 1, 2}


def test_what_is_no_result_is_refused(tmp_path):
    with pytest.raises(UnitcadError, match="no such folder"):
        write_report(tmp_path / "nothing")
    with pytest.raises(UnitcadError, match="no result"):
        write_report(tmp_path)
    (tmp_path / "manifest.json").write_text("{", "utf-8")
    with pytest.raises(UnitcadError, match=r"manifest.json: not JSON"):
        write_report(tmp_path)
    (tmp_path / "manifest.json").write_text("[]", "utf-8")
    with pytest.raises(UnitcadError, match="not a result of unitcad"):
        write_report(tmp_path)


def test_a_step_s_picture_is_a_png_in_the_folder(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    for name, content in {"a.png": read_results.PNG, "b.png": b"<script>"}.items():
        (folder / name).write_bytes(content)
    (tmp_path / "c.png").write_bytes(read_results.PNG)
    (folder / "d.png").symlink_to(tmp_path / "c.png")
    asked = ["a.png", "b.png", "../c.png", str(tmp_path / "c.png"), "d.png", "e.png", ""]
    assert list(read_results.step_pictures(folder, asked)) == ["a.png"]


def test_an_unreadable_spec_leaves_the_rest(built, tmp_path):
    shutil.copytree(built, tmp_path / "a")
    (tmp_path / "a" / "spec.toml").write_text("diameter_mm = ", "utf-8")
    (tmp_path / "a" / "estimate.json").unlink()
    record, spec = read_results.read_variant(tmp_path / "a", tmp_path)
    assert spec is None
    assert record.model is None
    assert "spec.toml" in record.no_model
    assert record.estimate is None
    write_report(tmp_path / "a")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.long) for name in sorted(templates())]
)
def test_every_template_has_a_page(name, tmp_path):
    store = MemoryStore()
    folder = build(load(name, ['output.formats=["stl"]']), tmp_path, check=False, store=store).folder
    assert write_report(folder).stat().st_size <= 3_000_000


def test_command(built, tmp_path):
    done = CliRunner().invoke(app, ["report", str(built)])
    assert done.exit_code == 0
    assert done.output.splitlines()[-1] == str(built / "report.html")
    done = CliRunner().invoke(app, ["report", str(built), "--json"])
    assert json.loads(done.output) == {
        "page": str(built / "report.html"),
        "bytes": (built / "report.html").stat().st_size,
    }
    done = CliRunner().invoke(
        app, ["build", "embedded", "-o", str(tmp_path), "--only", "unit", "--formats", "stl", "--report"]
    )
    assert done.exit_code == 0, done.output
    assert (Path(done.stdout.splitlines()[-1]) / "report.html").is_file()

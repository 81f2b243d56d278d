"""Pages of damaged or hostile results: nothing outside is read, nothing runs, nothing hangs, the rest is shown."""

import json
import os
import re
import shutil

import chromium
import hostile_results
import pytest
from hostile_results import KINDS, SECRET
from pagetable import data_of

from unitcad.errors import UnitcadError
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.validation import load

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links and pipes as POSIX has them")
SHOWN_IN_BROWSER = [
    "estimate.json is of wrong types",
    "casting.json is of wrong types",
    "names hold markup",
    "names hold half characters",
    "drawings hold scripts",
    "files have odd names",
]


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A result with everything but tools."""
    spec = load("embedded", ["output.formats=[]"])
    return build(spec, tmp_path_factory.mktemp("good"), only=["unit", "estimate", "casting"]).folder


def _spoilt(good, folder, kinds):
    """A folder of results: a good one, and one of each kind."""
    root = folder / "results"
    shutil.copytree(good, root / "good")
    hostile_results.outside(folder / "outside")
    for kind in kinds:
        there = root / re.sub(r"\W+", "-", kind)
        shutil.copytree(good, there)
        KINDS[kind][0](there)
    return root


def _data(page):
    return data_of(page.read_text("utf-8"))


def test_one_damaged_result_does_not_keep_the_others_from_the_page(good, tmp_path):
    root = _spoilt(good, tmp_path, list(KINDS))
    warnings = []
    data = _data(write_report(root, warnings.append))
    text = json.dumps(data)
    assert SECRET not in text
    assert not (tmp_path / "RAN").exists()
    shown = {folder for folder, _ in data["variants"]}
    damaged = dict(data["damaged"])
    for kind, (_, is_shown) in KINDS.items():
        folder = re.sub(r"\W+", "-", kind)
        assert (folder in shown, folder in damaged) == (is_shown, not is_shown), kind
    assert "good" in shown
    # The terminal says how many and which; those that are damaged in part are on the page as well.
    named = {line.split(":")[0].strip() for line in warnings[1:] if not line.startswith("  and ")}
    partly = {folder for folder, at in data["variants"] if data["pool"][at["\0"]]["damaged"]}
    assert warnings[0] == f"warning: {len(damaged) + len(partly)} of {len(KINDS) + 1} results are damaged:"
    assert set(damaged) <= named <= set(damaged) | partly
    assert len(named) == min(20, len(damaged) + len(partly))
    columns = ["folder", *data["table"]["columns"]]
    rows = [dict(zip(columns, row, strict=True)) for row in data["table"]["rows"]]
    assert {row["name"] for row in rows if row["status"] == "damaged"} == set(damaged)
    assert all(row["reason"] for row in rows if row["status"] == "damaged")
    assert write_report(root).read_bytes() == write_report(root).read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_result_alone_is_one_clear_error_or_a_page(kind, good, tmp_path):
    folder = _spoilt(good, tmp_path, [kind]) / re.sub(r"\W+", "-", kind)
    if not KINDS[kind][1]:
        with pytest.raises(UnitcadError, match=r"manifest\.json"):
            write_report(folder)
        return
    assert SECRET not in json.dumps(_data(write_report(folder)))


@pytest.mark.parametrize(
    "content", ["", "{", "[]", '{"columns": 5, "variants": []}', '{"columns": ["a"], "variants": [1]}', "pipe", "link"]
)
def test_a_damaged_batch_json_is_named_and_the_variants_are_shown(content, good, tmp_path):
    root = _spoilt(good, tmp_path, ["manifest.json is torn"])
    if content == "pipe":
        os.mkfifo(root / "batch.json")
    elif content == "link":
        (root / "batch.json").symlink_to(tmp_path / "outside" / "secret.json")
    else:
        (root / "batch.json").write_text(content)
    data = _data(write_report(root))
    assert dict(data["damaged"]).keys() == {"batch.json", "manifest-json-is-torn"}
    assert [row[0] for row in data["table"]["rows"]] == ["good", ""]


def test_a_damaged_variant_of_a_batch_is_named_in_its_table(good, tmp_path):
    root = _spoilt(good, tmp_path, ["manifest.json is torn"])
    variants = [
        {"index": i, "status": "ok", "folder": name} for i, name in enumerate(["good", "manifest-json-is-torn"])
    ]
    said = {"columns": ["index", "status", "reason", "folder"], "variants": variants}
    (root / "batch.json").write_text(json.dumps(said))
    table = _data(write_report(root))["table"]
    assert [[row[0], row[1 + table["columns"].index("status")]] for row in table["rows"]] == [
        ["good", "ok"],
        ["", "damaged"],
    ]


def test_in_a_browser_no_script_runs_and_nothing_is_asked_for(good, tmp_path, browser):
    root = _spoilt(good, tmp_path, [*SHOWN_IN_BROWSER, "manifest.json is torn"])
    page = write_report(root)
    _visited(browser, page, "")
    for kind in SHOWN_IN_BROWSER:
        text = _visited(browser, page, re.sub(r"\W+", "-", kind))
        assert "Files" in text
    folder = root / re.sub(r"\W+", "-", "drawings hold scripts")
    _visited(browser, write_report(folder), "")


def _visited(browser, page, fragment):
    """The page's text, when it has asked for nothing but itself and run nothing but its own."""
    visit = chromium.Visit(browser, page, fragment=fragment)
    try:
        visit.page.on("dialog", lambda dialog: visit.errors.append(f"dialog: {dialog.message}"))
        visit.page.wait_for_timeout(300)
        asked = [url for url in visit.requests if not url.startswith(("data:", "blob:"))]
        assert [url.partition("#")[0] for url in asked] == [page.resolve().as_uri()]
        assert visit.errors == []
        assert visit.page.evaluate("window.hit") is None
        assert "can't be drawn" not in visit.page.inner_text("main")
        return visit.page.inner_text("main")
    finally:
        visit.close()

"""A batch's page: rows named by what was swept, levels with their error, what no model reads, pins side by side."""

import json
from pathlib import Path

import pytest
from chromium import Visit
from pagetable import column

from unitcad.report import write_report
from unitcad.sweeps import BatchOptions, run
from unitcad.sweeps.executors import SerialExecutor
from unitcad.sweeps.sweep import from_file


@pytest.fixture(scope="module")
def walls(tmp_path_factory):
    """A batch of both designs with two outer walls, one name a design."""
    data = {
        "base": ["embedded", "encapsulating"],
        "set": {"output.formats": [], "name": "unit"},
        "sweep": {"layers.1.wall_mm": [1.1, 1.4]},
    }
    out = tmp_path_factory.mktemp("walls") / "batch"
    options = BatchOptions(only=("unit", "estimate"), cache=tmp_path_factory.mktemp("cache"))
    summary = run(from_file(data, Path(), "walls"), out, options, SerialExecutor(), workers=1)
    assert summary.ok == 4
    write_report(out)
    return out


@pytest.fixture
def visit(browser, walls):
    seen = Visit(browser, walls / "report.html")
    yield seen
    seen.close()


def variants(walls):
    return json.loads((walls / "batch.json").read_text())["variants"]


def test_rows_of_one_name_are_named_by_what_was_swept(visit):
    assert column(visit, "name") == [
        f"unit-wall{wall}: layer 2 wall {wall} mm, {name}"
        for name in ("embedded", "encapsulating")
        for wall in (1.1, 1.4)
    ]


def test_each_row_shows_its_section(visit):
    pictures = visit.page.locator(".variants tbody .thumbnail")
    assert pictures.count() == 4
    pictures.nth(3).scroll_into_view_if_needed()
    sizes = pictures.evaluate_all("(all) => Promise.all(all.map((one) => one.decode().then(() => one.naturalWidth)))")
    assert min(sizes) > 20
    assert len(set(pictures.evaluate_all("(all) => all.map((one) => one.src)"))) == 4


def test_levels_are_per_cent_with_the_models_typical_error(visit, walls):
    errors = json.loads((walls / "batch.json").read_text())["estimate"]["typical_error"]
    for shown, row in zip(column(visit, "edge_published, %"), variants(walls), strict=True):
        level, low, high = (float(word) for word in shown.replace("(", "").replace(")", "").replace("to ", "").split())
        assert level == pytest.approx(100 * row["edge_published"], rel=0.06)
        assert low == pytest.approx(100 * row["edge_published"] / errors["published"], rel=0.06)
        assert high == pytest.approx(100 * row["edge_published"] * errors["published"], rel=0.06)
    for shown in column(visit, "layer2_volume_mm3"):
        assert len(shown.replace(".", "")) <= 3


def test_a_filter_takes_what_a_cell_shows(visit):
    volume = column(visit, "layer2_volume_mm3")[0]
    visit.page.fill('input[name="filter-layer2_volume_mm3"]', volume)
    assert column(visit, "layer2_volume_mm3") == [volume]
    visit.page.fill('input[name="filter-layer2_volume_mm3"]', "")
    visit.page.fill('input[name="filter-edge_rule"]', "> 7")
    assert {name.rpartition(", ")[2] for name in column(visit, "name")} == {"embedded"}


def test_a_model_is_plotted_only_against_what_it_reads(visit):
    assert visit.page.input_value('select[name="plot-x"]') == "layers.1.wall_mm"
    assert visit.page.input_value('select[name="plot-y"]') == "edge_published"
    assert "4 of 4 points" in visit.page.inner_text("#plot .tip")
    disabled = visit.page.locator('select[name="plot-y"] option:disabled').all_inner_texts()
    assert disabled == ["edge_rule", "edge_divider"]
    unread = visit.page.inner_text("#plot .unread")
    assert "edge_rule, edge_divider, whose model does not read layers.1.wall_mm" in unread
    assert "typical error" in visit.page.inner_text("#plot .note")
    visit.page.select_option('select[name="plot-y"]', "layer2_volume_mm3")
    assert visit.page.locator("#plot .note").count() == 0


def test_pins_set_variants_side_by_side(visit, walls):
    assert "Pin two or three" in visit.page.inner_text("#compare")
    boxes = visit.page.locator(".variants .pin")
    boxes.nth(0).check()
    assert "one more" in visit.page.inner_text("#compare")
    boxes.nth(2).check()
    table = visit.page.locator("#compare table")
    assert table.locator("thead a").all_inner_texts() == [column(visit, "name")[0], column(visit, "name")[2]]
    assert table.locator("img.drawing").evaluate_all("(all) => all.every((one) => one.naturalWidth > 200)")
    said = table.locator("tbody tr").all_inner_texts()
    told = {line.split("\t")[0].strip(): [cell.strip() for cell in line.split("\t")[1:]] for line in said}
    assert told["design"] == ["embedded", "encapsulating"]
    assert told["layers.0.cap_mm"] == ["–", "1.25"]
    assert "layers.1.wall_mm" not in told
    answers = [json.loads((walls / v["folder"] / "estimate.json").read_text())["answer"] for v in variants(walls)]
    assert told["Estimate"] == [answers[0]["headline"], answers[2]["headline"]]
    assert "edge_rule, %" in told

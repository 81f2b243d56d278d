"""A batch's page: rows named by what was swept, levels with their error, what no model reads, pins side by side."""

import json
import math
from pathlib import Path

import numpy as np
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


LEVEL = "level at the edge, % (80 % range)"


def by_level(walls):
    """The variants from the least level up, as the page opens."""
    return sorted(variants(walls), key=lambda row: row["edge_level"])


def test_rows_are_named_by_what_was_swept_the_least_level_first(visit, walls):
    assert column(visit, "name") == [
        f"layer 2 wall {row['layers.1.wall_mm']:g} mm, {row['design']}" for row in by_level(walls)
    ]
    heads = visit.page.locator(".variants thead tr:first-child th").all_inner_texts()
    assert [head.strip(" ▲") for head in heads[:2]] == ["name", LEVEL]


def test_each_row_draws_level_range_and_measurement_on_one_axis(visit, walls):
    """The places of dots and ends of bars are logarithms of the levels in batch.json, as one line fits them all."""
    rows, seen = by_level(walls), visit.page.locator(".variants tbody tr")
    logs, places = [], []
    for i, row in enumerate(rows):
        track = seen.nth(i).locator(".track")
        left = [float(track.locator(kind).evaluate("(e) => parseFloat(e.style.left)")) for kind in (".dot", ".bar")]
        width = float(track.locator(".bar").evaluate("(e) => parseFloat(e.style.width)"))
        logs += [math.log(row[key]) for key in ("edge_level", "edge_low", "edge_high")]
        places += [*left, left[1] + width]
        assert track.locator(".measured").count() == (row["edge_measured"] is not None)
    slope, start = np.polyfit(logs, places, 1)
    assert places == pytest.approx([slope * one + start for one in logs], abs=0.01)
    assert min(places) > 0
    assert max(places) < 100


def test_each_row_shows_its_section(visit):
    pictures = visit.page.locator(".variants tbody .thumbnail")
    assert pictures.count() == 4
    pictures.nth(3).scroll_into_view_if_needed()
    sizes = pictures.evaluate_all("(all) => Promise.all(all.map((one) => one.decode().then(() => one.naturalWidth)))")
    assert min(sizes) > 20
    assert len(set(pictures.evaluate_all("(all) => all.map((one) => one.src)"))) == 4


def test_levels_are_per_cent_with_their_range(visit, walls):
    for shown, row in zip(column(visit, LEVEL), by_level(walls), strict=True):
        words = shown.replace("(", "").replace(")", "").replace("to ", "").split()
        numbers = [float(word) for word in words]
        assert numbers == pytest.approx([100 * row[f"edge_{key}"] for key in ("level", "low", "high")], rel=0.06)
    for shown in column(visit, "layer2_volume_mm3"):
        assert len(shown.replace(".", "")) <= 3


def test_a_filter_takes_what_a_cell_shows(visit):
    volume = column(visit, "layer2_volume_mm3")[0]
    visit.page.fill('input[name="filter-layer2_volume_mm3"]', volume)
    assert column(visit, "layer2_volume_mm3") == [volume]
    visit.page.fill('input[name="filter-layer2_volume_mm3"]', "")
    visit.page.fill('input[name="filter-edge_level"]', "> 7")
    assert {name.rpartition(", ")[2] for name in column(visit, "name")} == {"embedded"}


def test_the_plot_is_a_swept_key_that_the_level_reads_against_the_level(visit):
    assert visit.page.input_value('select[name="plot-x"]') == "design"
    assert visit.page.input_value('select[name="plot-y"]') == "edge_level"
    assert "4 of 4 points" in visit.page.inner_text("#plot .tip")
    visit.page.select_option('select[name="plot-x"]', "layers.1.wall_mm")
    assert visit.page.input_value('select[name="plot-y"]') != "edge_level"
    assert "does not read layers.1.wall_mm" in visit.page.inner_text("#plot .unread")


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
    assert told["design"] == ["encapsulating", "embedded"]
    assert told["layers.0.cap_mm"] == ["1.25", "–"]
    assert "layers.1.wall_mm" not in told
    answers = [json.loads((walls / v["folder"] / "estimate.json").read_text())["answer"] for v in variants(walls)]
    assert sorted(told["Estimate"]) == sorted([answers[0]["line"], answers[2]["line"]])

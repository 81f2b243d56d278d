"""An array's page in Chromium: the 3D view of a unit's page, with patch and tools."""

import numpy as np
import pytest
from chromium import Visit
from test_browser_variant import canvas, changed, drawn_share, shown

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_map import array_map
from unitcad.pipeline.write import build as build_array
from unitcad.report import write_report
from unitcad.report.map_file import MapFile
from unitcad.validation import load

SMALL = ["layout.columns=2", "layout.rows=2", "sheet.strap_slot_mm=[3, 8]", "output.formats=[]"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    array = load_array("forearm-patch", SMALL)
    return build_array(array, tmp_path_factory.mktemp("array"), only=["unit"], check=False).folder


@pytest.fixture
def visit(browser, folder):
    page = write_report(folder)
    seen = Visit(browser, page)
    seen.drawn()
    yield seen
    assert seen.errors == []
    assert seen.console == []
    assert seen.requests == [page.resolve().as_uri()]
    assert seen.overflowing() == []
    seen.close()


def test_the_patch_is_drawn_with_each_body_named_once(visit):
    assert shown(visit) == ["layer1", "layer2", "motor", "circuit"]
    whole = canvas(visit)
    assert drawn_share(whole) > 0.05
    visit.page.uncheck("input[name=part-motor]")
    without = canvas(visit)
    # The cut along x goes through two motors, one beside the other.
    columns = np.flatnonzero((np.abs(whole - without).max(axis=2) > 12).any(axis=0))
    assert np.diff(columns).max() > 20


@pytest.mark.smoke
def test_tools_are_shown_pour_by_pour_and_apart(visit):
    visit.page.check("input[value=moulds]")
    assert {"base", "cup1", "cup2", "layer1", "layer2"} <= set(shown(visit))
    visit.page.click("button[aria-label='Step on']")
    assert "cup2" not in shown(visit)
    assert {"base", "cup1", "layer1"} <= set(shown(visit))
    visit.page.click("button[aria-label='Step on']")
    assert {"base", "cup2", "layer1", "layer2"} <= set(shown(visit))
    together = canvas(visit)
    slider = visit.page.locator("input[name=apart]")
    slider.fill("100")
    assert changed(together, canvas(visit)) > 0.05


def test_print_has_pictures_and_no_controls(visit):
    assert visit.printed_faults() == []
    assert visit.page.locator("h2", has_text="Patch").is_visible()


def test_a_unit_that_runs_code_has_no_3d_view(folder, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / "manifest.json").write_bytes((folder / "manifest.json").read_bytes())
    text = (folder / "array.toml").read_text()
    assert 'design = "encapsulating"' in text
    code = 'design = "mine.py:mine"\ndesign_source = "raise SystemExit(7)"'
    (copy / "array.toml").write_text(text.replace('design = "encapsulating"', code))
    warnings = []
    page = write_report(copy, warnings.append).read_text()
    assert [line for line in warnings if "no 3D view" in line]
    assert "<script" not in page


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """The page of a small array with its map."""
    array = load_array("forearm-patch", SMALL)
    return write_report(build_array(array, tmp_path_factory.mktemp("map"), only=["estimate"], check=False).folder)


def test_units_are_switched_and_turned_by_clicking(browser, mapped):
    """The map, the list of units and the figures follow a click, a typed threshold and a moment of the cycle."""
    seen = Visit(browser, mapped)
    page, where = seen.page, "canvas.skin-map"
    page.locator(where).scroll_into_view_if_needed()
    whole = seen.pixels(where)
    page.locator("details:has(.skin-units)").evaluate("(node) => { node.open = true; }")
    box = page.locator(where).bounding_box()
    made = array_map(load_array("forearm-patch", SMALL))
    x0, _, x1, y1 = made.box_mm
    scale = (box["width"] - 74) / (x1 - x0)
    first = made.places[0]
    spot = {"x": (first.x - x0) * scale, "y": (y1 - first.y) * scale}
    page.locator(where).click(position=spot)
    assert not page.locator(f"input[name=unit-{first.name}]").is_checked()
    without = seen.pixels(where)
    assert changed(whole, without) > 0.05
    page.locator(where).click(position=spot)
    page.check("input[name=skin-click][value=phase]")
    page.locator(where).click(position=spot)
    assert page.locator(f"input[name=phase-{first.name}]").input_value() == "45"
    assert changed(whole, seen.pixels(where)) > 0.05
    page.click("button:text-is('One phase')")
    assert changed(whole, seen.pixels(where)) == 0
    page.fill("input[name=skin-threshold]", "2")
    page.fill("input[name=skin-share]", "20")
    told = page.locator(".figures").inner_text()
    assert "33 mm from its middle" in told
    assert "28 mm" in told
    page.check("input[name=skin-view][value=z]")
    start = seen.pixels(where)
    page.locator("input[name=cycle]").fill("90")
    assert changed(start, seen.pixels(where)) > 0.05
    page.click("button:text-is('Play')")
    page.wait_for_function("() => Number(document.querySelector('input[name=cycle]').value) > 120")
    page.click("button:text-is('Stop')")
    assert seen.overflowing() == []
    seen.close()


def test_the_map_of_one_unit_is_a_page_without_a_list_of_units(browser, tmp_path):
    path = tmp_path / "map.html"
    MapFile(path, 2.0, 0.2).of_unit(load("encapsulating"))
    seen = Visit(browser, path)
    assert seen.page.locator(".skin-units").count() == 0
    told = seen.page.locator(".figures").inner_text()
    assert "33 mm (17 to 39) from its middle. Threshold of touch at 125 Hz: 2 µm (typed)" in told
    assert "28 mm (17 to 28)" in told
    assert seen.requests == [path.resolve().as_uri()]
    seen.close()

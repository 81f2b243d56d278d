"""An array's page in Chromium: the 3D view of a unit's page, with patch and tools."""

import numpy as np
import pytest
from chromium import Visit
from test_browser_variant import canvas, changed, drawn_share, shown

from unitcad.arrays.array_file import load_array
from unitcad.pipeline.write import build as build_array
from unitcad.report import write_report

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

"""The page of a target: the table of proposals with its heads over its columns, and as cards on a phone."""

import pytest

from unitcad.search.design_files import contents
from unitcad.search.proposals import invert
from unitcad.search.target_file import load_target


@pytest.fixture(scope="module")
def design_html(tmp_path_factory):
    path = tmp_path_factory.mktemp("design") / "design.html"
    path.write_bytes(contents(invert(load_target("quiet-edge"), check=False), "out")["design.html"])
    return path


@pytest.mark.smoke
def test_heads_stand_over_their_columns_and_on_a_phone_beside_their_values(browser, design_html):
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.goto(design_html.as_uri())
    ends = "nodes => nodes.map(node => Math.round(node.getBoundingClientRect().right))"
    heads = page.eval_on_selector_all('.scroll[aria-label="proposals"] th', ends)
    first = page.eval_on_selector_all('.scroll[aria-label="proposals"] tbody tr:first-child td', ends)
    assert heads == first
    page.set_viewport_size({"width": 390, "height": 800})
    assert not page.locator("thead").first.is_visible()
    shown = page.eval_on_selector("td[data-head=hours]", "node => getComputedStyle(node, '::before').content")
    assert "hours" in shown
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.close()

"""A batch's page in Chromium: sorting, filtering, paging, the plot, opening a variant; markup stays text."""

import numpy as np
import pytest
from chromium import Visit
from pagetable import column, table_page


@pytest.fixture
def visit(browser, sweep):
    seen = Visit(browser, sweep / "report.html")
    yield seen
    assert {url.partition("#")[0] for url in seen.requests} == {(sweep / "report.html").resolve().as_uri()}
    seen.close()


def head(visit, name):
    return visit.page.locator(".variants thead th button", has_text=name).first


def test_markup_stays_text(visit, hostile):
    asked = []
    visit.page.on("dialog", lambda dialog: asked.append(dialog.message))
    assert hostile in column(visit, "name")
    visit.page.fill('input[name="search"]', "<script>alert('x')")
    assert column(visit, "name") == [hostile]
    visit.page.click(".variants tbody a")
    visit.drawn()
    assert visit.page.inner_text("h1") == hostile
    assert visit.page.title() == hostile
    assert visit.page.locator("main script, main b").count() == 0
    assert asked == []


def test_sorting(visit):
    head(visit, "layers.0.wall_mm").click()
    values = [float(text) for text in column(visit, "layers.0.wall_mm")]
    assert values == sorted(values)
    assert len(values) == 10
    head(visit, "layers.0.wall_mm").click()
    values = [float(text) for text in column(visit, "layers.0.wall_mm")]
    assert values == sorted(values, reverse=True)
    assert visit.page.get_attribute('th:has-text("layers.0.wall_mm")', "aria-sort") == "descending"
    # The sort is stable: equal walls keep the order of the folders.
    names = column(visit, "name")
    first = [name for name, value in zip(names, values, strict=True) if value == 1.5]
    assert first == sorted(first)


def test_filters_join(visit):
    visit.page.fill('input[name="filter-layers.0.wall_mm"]', "<= 1.25")
    visit.page.fill('input[name="filter-layers.0.material"]', "ecoflex")
    visit.page.fill('input[name="search"]', "embedded")
    assert column(visit, "name") == ["e 1.0 ecoflex-00-10", "e 1.25 ecoflex-00-10"]
    assert visit.page.inner_text(".count") == "2 of 10 variants"


def test_the_plot_shows_what_the_table_shows_and_opens_a_variant(visit):
    assert "10 of 10 points" in visit.page.inner_text("#plot .tip")
    visit.page.fill('input[name="filter-name"]', "e 1.5 ecoflex")
    visit.page.select_option('select[name="plot-x"]', "layers.0.wall_mm")
    visit.page.select_option('select[name="plot-y"]', "layer1_mm3")
    assert "1 of 1 points" in visit.page.inner_text("#plot .tip")
    over = visit.page.locator("#plot .u-over")
    over.scroll_into_view_if_needed()
    spots = np.argwhere(np.abs(visit.pixels("#plot .u-over") - visit.colour("series-1")).max(axis=2) < 70)
    y, x = spots.mean(axis=0)
    over.hover(position={"x": float(x), "y": float(y)})
    assert "e 1.5 ecoflex-00-10" in visit.page.inner_text("#plot .tip")
    over.click(position={"x": float(x), "y": float(y)})
    visit.drawn()
    assert visit.page.inner_text("h1") == "e 1.5 ecoflex-00-10"


@pytest.mark.smoke
def test_to_a_variant_and_back_by_keys(visit):
    visit.page.fill('input[name="filter-name"]', "c 1.25")
    visit.page.locator(".variants tbody a").focus()
    visit.page.keyboard.press("Enter")
    visit.drawn()
    assert visit.page.inner_text("h1") == "c 1.25"
    visit.page.locator("a.back").focus()
    visit.page.keyboard.press("Enter")
    visit.page.wait_for_selector(".variants")
    assert visit.page.inner_text(".count") == "1 of 10 variants"
    assert visit.page.evaluate("() => document.activeElement.textContent") == "c 1.25"
    head(visit, "name").focus()
    visit.page.keyboard.press("Enter")
    assert visit.page.get_attribute('th:has(button:text-is("name"))', "aria-sort") == "ascending"
    visit.page.go_back()
    visit.drawn()
    assert visit.page.inner_text("h1") == "c 1.25"


def test_nothing_overflows_at_390_pixels(browser, sweep):
    seen = Visit(browser, sweep / "report.html", width=390, height=844)
    assert seen.overflowing() == []
    seen.close()


def test_print_has_the_table_and_no_controls(visit):
    assert visit.printed_faults() == []
    # The heads of the columns stay, as text: beside a box Chromium repeats no head on the next page.
    assert visit.page.locator(".variants thead th").first.inner_text().strip() == "name"
    assert (
        visit.page.locator(".variants thead button").first.evaluate("(node) => getComputedStyle(node).display")
        == "contents"
    )
    assert (
        visit.page.locator(".variants .track").first.evaluate("(node) => getComputedStyle(node).printColorAdjust")
        == "exact"
    )


def test_two_thousand_rows_come_in_pages(browser, tmp_path):
    rows = [["", f"v{i}", i * 7 % 2000, f"group {i % 3}", None] for i in range(2000)]
    seen = Visit(browser, table_page(tmp_path, ["name", "value", "group", "empty"], rows))
    assert len(column(seen, "name")) == 100
    head(seen, "value").click()
    assert column(seen, "value") == [str(i) for i in range(100)]
    seen.page.click("text=Next ›")
    assert column(seen, "value") == [str(i) for i in range(100, 200)]
    assert "page 2 of 20" in seen.page.inner_text(".variants")
    seen.page.fill('input[name="filter-group"]', "group 1")
    assert "667 of 2000" in seen.page.inner_text(".count")
    assert "page 1 of 7" in seen.page.inner_text(".variants")
    assert "2000 failed" in seen.page.inner_text("header")
    seen.close()

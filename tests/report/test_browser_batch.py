"""A batch's page in Chromium: sorting, filtering, paging, the plot, opening a variant; markup stays text."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium import Visit
from pagetable import column, table_page

Image = pytest.importorskip("PIL.Image", reason="reading the screenshots needs Pillow")

A4_ACROSS = 1017
"""CSS pixels between the margins of an A4 sheet that lies on its side."""


@pytest.fixture
def visit(running: Any, sweep: Path) -> Iterator[Visit]:
    seen = Visit(running, sweep / "report.html")
    yield seen
    assert seen.errors == []
    assert seen.console == []
    assert {url.partition("#")[0] for url in seen.requests} == {(sweep / "report.html").resolve().as_uri()}
    seen.close()


def head(visit: Visit, name: str) -> Any:
    return visit.page.locator(".variants thead th button", has_text=name).first


def test_markup_stays_text(visit: Visit, hostile: str) -> None:
    asked: list[str] = []
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


def test_sorting(visit: Visit) -> None:
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


def test_a_column_with_gaps_sorts_them_last(visit: Visit) -> None:
    for _ in range(2):
        head(visit, "layers.1.wall_mm").click()
        assert column(visit, "layers.1.wall_mm")[-1] == "–"


@pytest.mark.parametrize(
    ("field", "text", "count"),
    [
        ("name", "e 1.5", 2),
        ("layers.0.wall_mm", "> 1.25", 4),
        ("layers.0.wall_mm", ">=1.25", 7),
        ("layers.0.wall_mm", "1.1..1.3", 3),
        ("layers.0.wall_mm", "= 1", 3),
        ("layers.0.wall_mm", "<1", 0),
        ("layers.0.material", "DRAGON", 4),
        ("design", "= embedded", 7),
    ],
)
def test_filtering(visit: Visit, field: str, text: str, count: int) -> None:
    visit.page.fill(f'input[name="filter-{field}"]', text)
    assert len(column(visit, "name")) == count
    assert visit.page.inner_text(".count") == f"{count} of 10 variants"


def test_filters_join(visit: Visit) -> None:
    visit.page.fill('input[name="filter-layers.0.wall_mm"]', "<= 1.25")
    visit.page.fill('input[name="filter-layers.0.material"]', "ecoflex")
    visit.page.fill('input[name="search"]', "embedded")
    assert column(visit, "name") == ["e 1.0 ecoflex-00-10", "e 1.25 ecoflex-00-10"]


def test_columns_that_do_not_vary_are_one_click_away(visit: Visit) -> None:
    assert "diameter_mm" not in visit.page.inner_text(".variants thead")
    visit.page.check('input[name="all-columns"]')
    assert set(column(visit, "diameter_mm")) == {"14"}


def test_the_plot_shows_what_the_table_shows_and_opens_a_variant(visit: Visit) -> None:
    assert "10 of 10 points" in visit.page.inner_text("#plot .tip")
    visit.page.fill('input[name="filter-name"]', "e 1.5 ecoflex")
    visit.page.select_option('select[name="plot-x"]', "layers.0.wall_mm")
    visit.page.select_option('select[name="plot-y"]', "layer1_mm3")
    assert "1 of 1 points" in visit.page.inner_text("#plot .tip")
    over = visit.page.locator("#plot .u-over")
    over.scroll_into_view_if_needed()
    image = np.asarray(Image.open(io.BytesIO(visit.picture("#plot .u-over"))).convert("RGB")).astype(int)
    accent = visit.page.evaluate("() => window.unitcad.theme.colour('series-1')")
    rgb = np.array([int(accent[i : i + 2], 16) for i in (1, 3, 5)])
    spots = np.argwhere(np.abs(image - rgb).max(axis=2) < 70)
    y, x = spots.mean(axis=0)
    over.hover(position={"x": float(x), "y": float(y)})
    assert "e 1.5 ecoflex-00-10" in visit.page.inner_text("#plot .tip")
    over.click(position={"x": float(x), "y": float(y)})
    visit.drawn()
    assert visit.page.inner_text("h1") == "e 1.5 ecoflex-00-10"


def test_texts_can_be_plotted_too(visit: Visit) -> None:
    visit.page.select_option('select[name="plot-x"]', "layers.0.material")
    visit.page.select_option('select[name="plot-y"]', "design")
    assert "10 of 10 points" in visit.page.inner_text("#plot .tip")


def test_to_a_variant_and_back_by_keys(visit: Visit) -> None:
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


@pytest.mark.parametrize("way", ["Back", "All variants"])
def test_back_from_a_variant_all_is_as_it_was_left(visit: Visit, way: str) -> None:
    visit.page.check('input[name="all-columns"]')
    visit.page.fill('input[name="filter-layers.0.wall_mm"]', "> 1")
    visit.page.fill('input[name="search"]', "e")
    head(visit, "layers.0.wall_mm").click()
    head(visit, "layers.0.wall_mm").click()
    visit.page.select_option('select[name="plot-x"]', "name")
    visit.page.select_option('select[name="plot-y"]', "design")
    visit.page.select_option('select[name="plot-group"]', "")
    scrolled = "(node) => { node.scrollTo(60, 0); return node.scrollLeft; }"
    assert visit.page.eval_on_selector(".variants .scroll", scrolled) == 60
    visit.page.evaluate("() => window.scrollTo(0, 80)")
    before = left(visit)
    assert before["names"][1] == "c 1.5"
    visit.page.locator(".variants tbody a").first.evaluate("(link) => link.click()")
    visit.drawn()
    assert visit.page.evaluate("() => window.scrollY") == 0
    # What is drawn while it is away takes the colours that were chosen meanwhile.
    visit.page.click('button[aria-label="Switch between light and dark"]')
    if way == "Back":
        visit.page.go_back()
    else:
        visit.page.click("a.back")
    visit.page.wait_for_selector(".variants")
    assert left(visit) == before
    image = Image.open(io.BytesIO(visit.picture("#plot canvas"))).convert("RGB")
    assert np.asarray(image).mean() < 80


def left(visit: Visit) -> dict[str, Any]:
    """What a person has set on the page, and what it shows for it."""
    set_to = "(nodes) => nodes.map((e) => [e.name, e.type === 'checkbox' ? e.checked : e.value])"
    return {
        "fields": visit.page.locator(".variants input, #plot select").evaluate_all(set_to),
        "names": column(visit, "name"),
        "sorted": visit.page.locator(".variants thead th").evaluate_all("(e) => e.map((th) => th.ariaSort)"),
        "plot": visit.page.get_attribute("#plot .plot", "aria-label"),
        "across": visit.page.eval_on_selector(".variants .scroll", "(node) => node.scrollLeft"),
        "down": visit.page.evaluate("() => window.scrollY"),
    }


def test_a_senseless_address_shows_the_table(running: Any, sweep: Path) -> None:
    for part in ("%E0%A4%A", "nothing", "<script>"):
        seen = Visit(running, sweep / "report.html", fragment=part)
        assert seen.page.locator(".variants").is_visible()
        assert seen.errors == []
        seen.close()


def test_nothing_overflows_at_390_pixels(running: Any, sweep: Path) -> None:
    seen = Visit(running, sweep / "report.html", width=390, height=844)
    assert seen.overflowing() == []
    seen.close()


@pytest.mark.parametrize("dark", [False, True])
def test_the_table_prints_with_its_heads_on_white(running: Any, sweep: Path, dark: bool) -> None:
    seen = Visit(running, sweep / "report.html", width=A4_ACROSS, dark=dark)
    seen.page.check('input[name="all-columns"]')
    light = ("#ffffff", "#0a6b62")
    assert (colours(seen) == light) != dark
    seen.page.emulate_media(media="print")
    assert [head for head in seen.page.locator(".variants thead th button").all() if not head.is_visible()] == []
    assert not seen.page.locator(".variants .filters").is_visible()
    assert not seen.page.locator(".variants input").first.is_visible()
    assert seen.page.inner_text(".count") == "10 of 10 variants"
    assert seen.overflowing() == []
    box = seen.page.locator(".variants table").bounding_box()
    assert box["x"] + box["width"] <= A4_ACROSS
    cut_off = "(cells) => cells.filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.textContent)"
    assert seen.page.locator(".variants th, .variants tbody td").evaluate_all(cut_off) == []
    assert seen.page.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert seen.page.evaluate("() => getComputedStyle(document.body).color") == "rgb(0, 0, 0)"
    # The plot is a picture: it must have been drawn again in the colours of paper.
    image = np.asarray(Image.open(io.BytesIO(seen.picture("#plot canvas"))).convert("RGB"))
    assert image.mean() > 230
    assert (np.abs(image.astype(int) - (0x0A, 0x6B, 0x62)).max(axis=2) < 8).sum() > 30
    for across, down in re.findall(rb"/MediaBox ?\[0 0 ([\d.]+) ([\d.]+)\]", seen.page.pdf(prefer_css_page_size=True)):
        assert float(across) > float(down)
    seen.page.emulate_media(media="screen")
    assert (colours(seen) == light) != dark
    seen.close()


def colours(visit: Visit) -> tuple[str, str]:
    """Of the ground under the table and of the first series."""
    return tuple(visit.page.evaluate("() => ['paper', 'series-1'].map(window.unitcad.theme.colour)"))


def test_the_plot_says_who_is_not_in_it_and_why(running: Any, tmp_path: Path) -> None:
    columns = ["name", "material", "wall_mm", "edge_rule", "reason"]
    rows: list[list[Any]] = [[f"f{i}", f"unit {i}", "soft", i, i / 10, None] for i in range(5)]
    rows += [["g", "unit", "stiff", 3, None, None]] * 2 + [["", "burst", "soft", None, None, "wall too thin"]]
    estimate = {"models": {"rule": {"edge_level": {"value": None, "reason": "no modulus is known"}}}}
    variants = [["g", {"estimate": estimate}]]
    seen = Visit(running, table_page(tmp_path, columns, rows, variants=variants))
    seen.page.select_option('select[name="plot-x"]', "wall_mm")
    seen.page.select_option('select[name="plot-y"]', "edge_rule")
    seen.page.select_option('select[name="plot-group"]', "material")
    assert "5 of 8 points" in seen.page.inner_text("#plot .tip")
    assert seen.page.locator("#plot .note").all_inner_texts() == [
        "1 has no wall_mm: burst, soft. Why: wall too thin.",
        "2 have no edge_rule: unit, stiff (2 times). Why: no modulus is known.",
        "1 has no edge_rule: burst, soft. Why: wall too thin.",
    ]
    assert seen.page.locator("#plot .key li").all_inner_texts() == ["soft", "stiff (no point)"]
    seen.page.fill('input[name="filter-edge_rule"]', "0..1")
    assert seen.page.locator("#plot .note").count() == 0
    seen.page.fill('input[name="filter-edge_rule"]', "")
    seen.page.fill('input[name="filter-material"]', "stiff")
    assert "0 of 2 points" in seen.page.inner_text("#plot .tip")
    assert seen.page.locator("#plot .note").all_inner_texts() == [
        "2 have no edge_rule: unit, stiff (2 times). Why: no modulus is known."
    ]
    assert seen.errors == []
    seen.close()


def test_the_legend_names_every_group(running: Any, tmp_path: Path) -> None:
    rows = [["", f"v{i}", i, i, f"group {i:02}"] for i in range(42)]
    seen = Visit(running, table_page(tmp_path, ["name", "a", "b", "group"], rows))
    seen.page.select_option('select[name="plot-group"]', "group")
    assert seen.page.locator("#plot .key li").all_inner_texts() == [
        *(row[-1] for row in rows[:40]),
        "and 2 more",
    ]
    seen.page.fill('input[name="search"]', "group 3")
    assert seen.page.locator("#plot .key li").all_inner_texts() == [row[-1] for row in rows[30:40]]
    seen.close()


def test_two_thousand_rows_come_in_pages(running: Any, tmp_path: Path) -> None:
    rows = [["", f"v{i}", i * 7 % 2000, f"group {i % 3}", None] for i in range(2000)]
    seen = Visit(running, table_page(tmp_path, ["name", "value", "group", "empty"], rows))
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
    assert seen.errors == []
    seen.close()


@pytest.mark.parametrize(("folder", "word"), [("many", "many"), ("Ann's rings", "'Ann'\\''s rings'")])
def test_a_row_without_a_folder_says_how_to_make_it(running: Any, tmp_path: Path, folder: str, word: str) -> None:
    page = table_page(tmp_path, ["name"], [["ring-0123456789ab", "ring"], ["", "failed"]], stored_in=folder)
    visit = Visit(running, page)
    note = visit.page.locator(".lacking")
    assert note.inner_text() == ""
    visit.page.click(".variants tbody a")
    visit.page.wait_for_function("() => document.querySelector('.lacking').textContent")
    assert f"unitcad export 0123456789ab --batch {word} && unitcad report {word}" in note.inner_text()
    assert visit.errors == []
    visit.close()

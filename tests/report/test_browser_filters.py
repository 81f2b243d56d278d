"""Filters of a batch's table in Chromium: numbers as numbers, texts as texts, and what is not understood says so."""

import pytest
from chromium import Visit
from pagetable import column, table_page

NUMBERS = [1, 1.1, 1.2, 1.25, 2, -3, 0.0517123456, None]
"""Of a numeric column, in the order of their rows."""


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("1.0", [1]),
        ("1", [1]),
        ("= 1.20", [1.2]),
        ("12e-1", [1.2]),
        ("0.0517123", [0.0517123456]),  # as it is shown
        ("> 1 < 1.2", [1.1]),
        (">=1, <=1.2", [1, 1.1, 1.2]),
        ("< 1.2 and > 1", [1.1]),
        ("≥ 1.25", [1.25, 2]),
        ("> 2 < 1", []),
        ("1..1.2", [1, 1.1, 1.2]),
        ("1...2", [1, 1.1, 1.2, 1.25, 2]),
        ("1.25..1", [1, 1.1, 1.2, 1.25]),
        ("-3 .. -1", [-3]),
        ("1.25..", [1.25, 2]),
        ("..0", [-3]),
        ("!1", [1.1, 1.2, 1.25, 2, -3, 0.0517123456, None]),
        ("!= 1", [1.1, 1.2, 1.25, 2, -3, 0.0517123456, None]),
        ("!> 1", [1, -3, 0.0517123456, None]),
    ],
)
def test_numbers_are_filtered_as_numbers(table_of_both, text, kept):
    table_of_both.page.fill('input[name="filter-value"]', text)
    assert column(table_of_both, "name") == [f"v{NUMBERS.index(value)}" for value in kept]
    assert table_of_both.page.get_attribute('input[name="filter-value"]', "aria-invalid") == "false"
    assert table_of_both.page.inner_text(".fault") == ""


@pytest.mark.parametrize(
    ("field", "text", "kept"),
    [
        ("mixed", "1.0", 2),  # the number 1 and the text "1.0 soft"
        ("mixed", "> 0", 1),
        ("mixed", "auto", 6),
        ("mixed", "!auto", 2),
        ("word", "!soft", 4),
        ("word", "= soft", 4),
        ("word", "<x>", 1),
        ("word", "!= soft", 4),
        ("word", "", 8),
    ],
)
def test_texts_are_filtered_as_texts(table_of_both, field, text, kept):
    table_of_both.page.fill(f'input[name="filter-{field}"]', text)
    assert len(column(table_of_both, "name")) == kept
    assert table_of_both.page.inner_text(".fault") == ""


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("value", ">"), ("value", "x"), ("value", "1,2"), ("value", "!x"), ("value", "!"), ("value", ".."),
        ("value", "> 1 < 2 < 3"), ("mixed", ">="), ("word", "> 1"), ("word", "!"), ("word", "="),
    ],
)  # fmt: skip
def test_a_filter_not_understood_says_so(table_of_both, field, text):
    page, own = table_of_both.page, f'input[name="filter-{field}"]'
    plain = page.eval_on_selector(own, "(node) => getComputedStyle(node).borderColor")
    page.fill(own, text)
    assert len(column(table_of_both, "name")) == len(NUMBERS)
    assert f'Not understood, so left out: "{text}" under {field}.' in page.inner_text(".fault")
    assert page.get_attribute(own, "aria-invalid") == "true"
    described = page.get_attribute(own, "aria-describedby")
    assert page.get_attribute(f"#{described}", "role") == "status"
    page.focus('input[name="search"]')
    look = "(node) => { const s = getComputedStyle(node); return [s.outlineStyle, s.outlineColor, s.borderColor]; }"
    style, outline, border = page.eval_on_selector(own, look)
    assert (style, outline) == ("solid", border)
    assert border != plain
    assert page.locator('.variants input[aria-invalid="true"]').count() == 1
    page.fill(own, "")
    assert page.inner_text(".fault") == ""
    assert page.get_attribute(own, "aria-invalid") == "false"


@pytest.fixture(scope="module")
def both(browser, tmp_path_factory):
    """A column of numbers, one of numbers and texts, one of texts."""
    rows = [["", f"v{i}", value, "auto", "soft" if i % 2 else "hard"] for i, value in enumerate(NUMBERS)]
    rows[0][3], rows[1][3], rows[2][4] = 1, "1.0 soft", "a <x> b"
    seen = Visit(browser, table_page(tmp_path_factory.mktemp("both"), ["name", "value", "mixed", "word"], rows))
    yield seen
    seen.close()


@pytest.fixture
def table_of_both(both):
    for field in both.page.locator(".filters input").all():
        field.fill("")
    return both

"""The page of a variant with a lab's fit: range, own measurement and the fit's own errors, wide and narrow."""

import pytest
from chromium import Visit

from unitcad.lab.fit_command import fit_toml
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.validation import load


@pytest.fixture(scope="module")
def fitted():
    return fit_lab(load_fit_lab("synthetic-bench"))


@pytest.fixture(scope="module")
def fit_page(fitted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fit")
    (folder / "lab-fit.toml").write_text(fit_toml(fitted))
    spec = load("embedded", {"estimate.fit": str(folder / "lab-fit.toml")})
    return write_report(build(spec, folder, only=["estimate"]).folder)


@pytest.fixture
def visit(browser, fit_page):
    seen = Visit(browser, fit_page)
    seen.page.get_by_text("How sure?").click()
    yield seen
    assert seen.errors == []
    assert seen.console == []
    seen.close()


def test_the_fit_s_own_error_stands_beside_the_stored_constants_one(visit, fitted):
    table = visit.page.locator('.scroll[aria-label="Error by the fit of synthetic-bench"] table')
    assert table.is_visible()  # under "How sure?", not among the folded tables
    rows = [row.split("\t") for row in table.locator("tbody tr").all_inner_texts()]
    assert "(baseline)" in rows[-1][0]
    for name in ("rule", "published", "corrected"):
        one = fitted.fit.model[name]
        row = next(row for row in rows if f"({name})" in row[0])
        assert float(row[1]) == pytest.approx(one.leave_one_out, rel=6e-3)
        assert one.own_leave_one_out is not None
        assert float(row[3]) == pytest.approx(one.own_leave_one_out, rel=6e-3)
        assert row[5] == one.coverage
    assert float(rows[-1][1]) == pytest.approx(fitted.fit.model["baseline"].leave_one_out, rel=6e-3)


def test_range_measurement_and_name_of_the_fit_are_there(visit, fitted):
    text = visit.page.inner_text("body")
    assert "80 % range of a new unit in the lab synthetic-bench" in text
    assert "Measured here (soft-inside): 9.8" in text
    assert "3 units of the lab's own" in text
    assert "by the stored constants" in text


@pytest.mark.parametrize("dark", [False, True])
def test_nothing_overflows_at_390_pixels(browser, fit_page, dark):
    seen = Visit(browser, fit_page, width=390, height=844, dark=dark)
    assert seen.overflowing() == []
    seen.close()

"""The estimate's blocks in Chromium: both drives' curves, ranges by finite elements, inputs seen; a study's picture."""

import json
from functools import partial

import numpy as np
import pytest
from chromium import Visit

from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.validation import load

pytest.importorskip("skfem")
DRAWS = 4
OPEN = """() => document.querySelectorAll("#estimate details").forEach((node) => { node.open = true; })"""


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The folder of a unit estimated by closed forms and, with few draws, by finite elements."""
    from unitcad.attenuation.fem import unit as prior_range

    models = 'estimate.models=["rule","divider","published","fem"]'
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prior_range, "range_block", partial(prior_range.range_block, draws=DRAWS))
        patch.setattr(prior_range, "FINENESS", 0.5)
        spec = load("encapsulating", ["output.formats=[]", models])
        folder = build(spec, tmp_path_factory.mktemp("solved"), only=["estimate"], check=False).folder
    write_report(folder)
    return folder


@pytest.fixture
def estimate(solved):
    return json.loads((solved / "estimate.json").read_text("utf-8"))


@pytest.fixture
def visit(browser, solved):
    seen = Visit(browser, solved / "report.html")
    seen.page.evaluate(OPEN)
    yield seen
    seen.close()


def cells(visit, label):
    """The texts of a table, its head first."""
    rows = visit.page.locator(f'#estimate table[aria-label="{label}"] tr, #estimate [aria-label="{label}"] table tr')
    return rows.evaluate_all("(rows) => rows.map((row) => [...row.cells].map((cell) => cell.innerText.trim()))")


def test_both_drives_are_drawn_and_stand_in_the_table(visit, estimate):
    visit.page.wait_for_selector("#estimate .plot canvas")
    legend = " ".join(visit.page.locator("#estimate ul.key").all_inner_texts())
    assert "Force turning in the skin's plane (this motor)" in legend
    assert "Force along the motor's axis" in legend
    image = visit.pixels("#estimate .plot canvas")
    for name in ("series-1", "series-3"):
        assert (np.abs(image - visit.colour(name)).max(axis=2) < 30).sum() > 150
    head, *rows = cells(visit, "The curve as numbers")
    layered = estimate["layered"]
    at = [
        head.index(name) for name in ("Force turning in the skin's plane (this motor)", "Force along the motor's axis")
    ]
    for row in rows:
        i = layered["r_mm"].index(float(row[0]))
        for column, drive in zip(at, ("flat", "axial"), strict=True):
            assert float(row[column]) == pytest.approx(100 * layered["drives"][drive]["u"]["value"][i], rel=1e-3)
    ratio = [float(row[head.index("Flat over axial, per newton")]) for row in rows]
    assert ratio[-1] > 100  # far out a sideways force moves more skin


def test_two_lines_lead_and_the_rest_is_folded(browser, solved, estimate):
    seen = Visit(browser, solved / "report.html")
    answer, shown = estimate["answer"], seen.page.inner_text("#estimate")
    for line in (answer["headline"], answer["lines"][1], answer["lines"][0][len(answer["headline"]) :].strip()):
        assert line in shown
    assert "How sure?" in shown
    assert answer["details"][0] not in shown
    seen.page.get_by_text("How sure?").click()
    assert answer["details"][0] in seen.page.inner_text("#estimate")
    seen.page.wait_for_selector("#estimate .plot canvas")
    width = seen.page.eval_on_selector("#estimate .plot canvas", "(node) => node.getBoundingClientRect().width")
    assert width > 300  # drawn although it was folded
    seen.close()


def test_a_range_by_finite_elements_has_a_bar_from_low_to_high(visit, estimate):
    levels = estimate["fem"]["levels"]
    chart = visit.page.locator("#estimate figure.ranges", has_text=f"of {DRAWS} draws")
    bars = chart.locator(".row:not(.scale)").evaluate_all(
        """(rows) => rows.map((row) => {
          const box = (name) => {
            const { left, right } = row.querySelector(name).getBoundingClientRect();
            return [left, right];
          };
          const name = row.querySelector(".name").innerText;
          return { name, track: box(".track"), bar: box(".bar"), dot: box(".dot") };
        })"""
    )
    spans = [(name, one) for one in levels for name, one in ((None, one), *one["by_contact"].items())]
    assert len(bars) == len(spans) == 12
    low, high = (pick(one[end] for _, one in spans) for pick, end in ((min, "low"), (max, "high")))
    left, width = bars[0]["track"][0], bars[0]["track"][1] - bars[0]["track"][0]
    scale = np.log(high * 1.5 / (low / 1.5))
    for bar, (contact, one) in zip(bars, spans, strict=True):
        assert contact is None or bar["name"].endswith(f": {contact}")
        wanted = [left + width * np.log(one[end] / (low / 1.5)) / scale for end in ("low", "median", "high")]
        dot = sum(bar["dot"]) / 2
        assert [bar["bar"][0], dot] == pytest.approx(wanted[:2], abs=8), bar
        assert bar["bar"][1] == pytest.approx(wanted[2], abs=8), bar
    head, *rows = cells(visit, "Medians by finite elements")
    assert [row[:2] for row in rows] == [
        [drive, read] for drive in ("flat", "axial") for read in ("skin at D/2", "the unit's own edge")
    ]
    for row, one in zip(rows, levels, strict=True):
        assert float(row[head.index("Median, %")]) == pytest.approx(100 * one["median"], rel=5e-3)


def test_the_inputs_that_a_model_sees(visit, estimate):
    head, *rows = cells(visit, "Inputs with an effect on the level")
    blocks = [estimate["models"][name]["sensitivities"] for name in ("rule", "divider", "published")]
    blocks += estimate["fem"]["sensitivities"]
    assert len(head) == 1 + len(blocks)
    largest = []
    for name, *shown_cells in rows:
        for cell, block in zip(shown_cells, blocks, strict=True):
            assert (cell == "not seen") == (name not in block["by"])
            if cell != "not seen":
                slope, _, rest = cell.replace("−", "-").partition(" (")
                assert float(slope) == pytest.approx(block["by"][name], rel=6e-3)
                tested = block.get("tested", {}).get(name)
                assert bool(rest) == bool(tested)
                if tested:
                    agree = f"{tested['agree']} of {tested['of']} agree" if tested["of"] else "untested"
                    assert rest.endswith(f"; {agree})")
        largest.append(max(abs(block["by"].get(name, 0.0)) for block in blocks))
    assert largest == sorted(largest, reverse=True)
    assert {"layers.0.wall_mm", "tissue thickness", "motor mass"} <= {row[0] for row in rows}


@pytest.mark.parametrize("dark", [False, True])
def test_nothing_of_it_is_wider_than_its_column(browser, solved, dark):
    seen = Visit(browser, solved / "report.html", width=390, height=844, dark=dark)
    seen.page.evaluate(OPEN)
    for width in (768, 1280, 1920, 390):
        seen.page.set_viewport_size({"width": width, "height": 844})
        seen.page.wait_for_function("() => document.documentElement.scrollWidth <= innerWidth")  # plots follow
        assert seen.overflowing() == [], width
    text = seen.page.eval_on_selector("#estimate .ranges .value", "(node) => getComputedStyle(node).color")
    behind = seen.page.eval_on_selector("body", "(node) => getComputedStyle(node).backgroundColor")
    bright = [sum(int(part) for part in rgb.removeprefix("rgb(").rstrip(")").split(",")) for rgb in (text, behind)]
    assert (bright[0] > bright[1]) == dark
    seen.close()

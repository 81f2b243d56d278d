"""The bench page in a browser: two pages of paper, timers that survive a reload, a record that the report shows."""

import json
import re

import pytest
from cast_records import spec_of
from chromium import Visit

from unitcad.casting.cast_record import ENDING, read_cast_record
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.spec import spec_hash
from unitcad.validation import load

SETS = {
    "encapsulating": (),
    "embedded": (),
    "three-layer": ("moulds.printer=sla",),
    "pass-through": ("moulds.pour=injected", "moulds.cavities=[1,2]"),
}


def bench(name, changes, out):
    spec = load(name, [*changes, "output.formats=[]"])
    folder = build(spec, out, only=("moulds", "casting"), check=False).folder
    write_report(folder)
    return folder / "bench.html"


@pytest.fixture(scope="module")
def page_of_one(tmp_path_factory):
    return bench("encapsulating", (), tmp_path_factory.mktemp("bench"))


@pytest.mark.parametrize("name", SETS)
def test_a_printed_sheet_fits_two_pages(name, browser, tmp_path):
    visit = Visit(browser, bench(name, SETS[name], tmp_path))
    pdf = visit.page.pdf(prefer_css_page_size=True)
    visit.page.emulate_media(media="print")
    least = visit.page.evaluate(
        """() => Math.min(...[...document.querySelectorAll("p, td, li, h1, h2, h3")]
          .filter((node) => node.checkVisibility()).map((node) => parseFloat(getComputedStyle(node).fontSize)))"""
    )
    assert least >= 8 * 96 / 72 - 0.01  # 8 pt
    rows = visit.page.locator("#plan tbody tr:visible").all_inner_texts()
    assert any("motor in" in row for row in rows)
    visit.close()
    assert 1 <= len(re.findall(rb"/Type\s*/Page[^s]", pdf)) <= 2


def test_on_paper_no_text_stands_beside_a_picture(browser, page_of_one):
    """Every line of a step has the width of its column, 60 mm: some forty letters of 8 pt."""
    visit = Visit(browser, page_of_one)
    visit.page.emulate_media(media="print")
    widths = visit.page.evaluate(
        """() => [...document.querySelectorAll("li.bench-step")].map((step) => {
          const image = step.querySelector("img"), text = step.querySelector("p.whole");
          if (!image || !image.checkVisibility() || !text.checkVisibility()) return null;
          const range = document.createRange();
          range.selectNodeContents(text);
          const over = image.getBoundingClientRect().bottom - range.getBoundingClientRect().top;
          return [over, getComputedStyle(image).float];
        }).filter(Boolean)"""
    )
    assert len(widths) > 10
    assert all(over < 1 and float == "none" for over, float in widths)
    visit.close()


def test_a_measured_length_changes_the_command_and_a_weighed_part_the_other(browser, page_of_one):
    """1.40 g of A at 1 to 1 ask for 1.40 g of B; a motor of 2.3 mm asks for other moulds, one of 2.03 does not."""
    visit = Visit(browser, page_of_one)
    page, code = visit.page, visit.page.locator("#first code")
    asked = code.inner_text()
    assert asked == (
        "unitcad build spec.toml --set motor.diameter_mm=7 --set motor.thickness_mm=2 "
        "--set fpcb.thickness_mm=0.11 --set moulds.filament_mm=1.75"
    )
    page.locator('[name="motor.thickness_mm"]').fill("2,03")
    assert code.inner_text() == asked.replace("thickness_mm=2 ", "thickness_mm=2.03 ")
    assert page.locator("#first .verdict").inner_text() == ""
    page.locator('[name="motor.thickness_mm"]').fill("2.3")
    assert code.inner_text() == "unitcad build spec.toml --set motor.thickness_mm=2.3"
    assert "build again" in page.locator("#first .verdict").inner_text()
    page.locator('[name="p1.a"]').fill("1.4")
    assert page.locator("#pour1 .part-b").inner_text() == "A is 1.40 g: weigh B to 1.40 g."
    assert page.locator("#pour2 .part-b").inner_text() == ""
    page.locator('[name="p1.a"]').fill("much")
    assert page.locator("#pour1 .part-b").inner_text() == ""
    visit.close()


def test_the_sheet_has_what_goes_wrong(browser, page_of_one):
    visit = Visit(browser, page_of_one)
    rows = visit.page.locator("#troubles tbody tr").count()
    said = (page_of_one.parent / "troubleshooting.md").read_text("utf-8")
    assert rows == said.count("\n## ") == len(json.loads((page_of_one.parent / "casting.json").read_text())["troubles"])
    visit.close()


@pytest.mark.parametrize(("width", "dark"), [(390, False), (390, True), (1280, False)])
def test_it_contacts_nothing_and_fits_its_window(width, dark, browser, page_of_one):
    visit = Visit(browser, page_of_one, width=width, dark=dark)
    assert {url.partition(":")[0] for url in visit.requests} <= {"file", "data"}
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    assert visit.page.locator("#assembly h2").inner_text() == "Motor in"
    casting = json.loads((page_of_one.parent / "casting.json").read_text("utf-8"))
    assert visit.page.locator("li.bench-step img").count() == sum(
        bool(step["picture"])
        for step in [
            *casting["preparation"],
            *(step for pour in casting["pours"] for step in pour["steps"]),
            *casting["release"],
            *casting["assembly"],
        ]
    )
    visit.close()


def test_a_timer_goes_on_through_a_reload(browser, page_of_one):
    visit = Visit(browser, page_of_one)
    page = visit.page
    page.get_by_role("button", name="Start pot life").first.click()
    began = page.evaluate("Object.values(JSON.parse(Object.values(localStorage)[0]).began)[0]")
    page.evaluate(
        """() => {
          const key = Object.keys(localStorage)[0], state = JSON.parse(localStorage[key]);
          for (const name of Object.keys(state.began)) state.began[name] -= 10 * 60000;
          localStorage[key] = JSON.stringify(state);
        }"""
    )
    page.reload()
    page.wait_for_selector("html[data-ready=yes]")
    shown = page.locator(".clock").first.inner_text()
    hours, minutes, _ = (int(part) for part in shown.split(":"))
    assert began > 0
    assert 18 <= 60 * hours + minutes <= 20  # of 30 min
    visit.close()


def test_one_hand_on_a_phone_goes_through_the_steps(browser, page_of_one):
    """The step to do, its timer and two large buttons are at the lower edge; a locked screen loses nothing."""
    visit = Visit(browser, page_of_one, 390, 844)
    page, steps = visit.page, visit.page.locator("li.bench-step")
    page.clock.install()
    page.reload()
    page.wait_for_selector("html[data-ready=yes]")
    done, bar = page.get_by_role("button", name="Done"), page.locator("#now")
    box = done.bounding_box()
    assert box["height"] >= 56
    assert box["width"] >= 200
    assert box["y"] > 844 - 120
    at = int(steps.filter(has=page.get_by_role("button", name="Start pot life")).first.get_attribute("data-step"))
    mix = steps.nth(at)
    for _ in range(at):
        done.click()
    assert page.locator("li.bench-step h3 input:checked").count() == at
    assert bar.get_by_role("button").first.inner_text().endswith(" Mix")
    assert mix.bounding_box()["y"] < 844 / 2
    assert bar.locator(".clock").inner_text() in ("pot life 0:30:00", "pot life 0:29:59")
    page.clock.fast_forward("10:00")  # a locked screen: ticks are lost
    page.evaluate("() => document.dispatchEvent(new Event('visibilitychange'))")
    assert bar.locator(".clock").inner_text().startswith("pot life 0:19:5")
    page.clock.fast_forward("25:00")
    page.reload()
    page.wait_for_selector("html[data-ready=yes]")
    assert bar.locator(".clock").inner_text().startswith("pot life over by 0:05:0")
    assert bar.get_by_role("button").first.inner_text().endswith(" Mix")
    page.get_by_role("button", name="Back").click()
    assert page.locator("li.bench-step h3 input:checked").count() == at - 1
    visit.close()


def test_the_schedule_counts_back(browser, page_of_one):
    casting = json.loads((page_of_one.parent / "casting.json").read_text("utf-8"))
    visit = Visit(browser, page_of_one)
    visit.page.locator("[name=ready]").fill("2101-03-14T12:00")
    visit.page.locator("[name=ready]").dispatch_event("change")
    begin = visit.page.locator("#plan .verdict").inner_text()
    minutes = 12 * 60 - round(casting["earliest_finish_min"]) % (24 * 60)
    assert f"{minutes // 60 % 24:02d}:{minutes % 60:02d}" in begin
    visit.page.locator("[name=ready]").fill("2001-03-14T12:00")
    visit.page.locator("[name=ready]").dispatch_event("change")
    assert "Too late" in visit.page.locator("#plan .verdict").inner_text()
    visit.close()


@pytest.mark.smoke
def test_the_record_is_saved_and_shown(browser, page_of_one):
    visit = Visit(browser, page_of_one)
    page, folder = visit.page, page_of_one.parent
    for name, text in {"p1.a": "1,02", "p1.b": "0.99", "u1.height": "4.6", "u1.w2.1": "1.3", "u1.w2.3": "1.2"}.items():
        page.locator(f'[name="{name}"]').fill(text)
    page.locator('[name="u1.mass"]').fill("much")
    page.get_by_role("button", name="Save the cast record").click()
    assert "Not saved" in page.locator("#save [role=status]").inner_text()
    page.locator('[name="u1.mass"]').fill("0.61")
    for name, wrong, limit in (
        ("u1.w1.1", "125", "must be 0.417 to 3.75 mm: 1.25 mm is asked"),
        ("u1.height", "46", "must be 1.54 to 13.8 mm: 4.61 mm is asked"),
        ("u1.mass", "6.1", "must be 0.203 to 1.83 g: 0.609 g is asked"),
        ("u1.d1", "1.4", "must be 4.67 to 42 mm: 14 mm is asked"),
    ):
        before = page.locator(f'[name="{name}"]').input_value()
        page.locator(f'[name="{name}"]').fill(wrong)
        assert page.locator(f'label:has([name="{name}"]) .limit').inner_text() == limit
        page.get_by_role("button", name="Save the cast record").click()
        assert "Not saved: 1 field" in page.locator("#save [role=status]").inner_text()
        page.locator(f'[name="{name}"]').fill(before)
    page.locator('textarea[name="notes"]').fill("first try\nwarm room")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the cast record").click()
    name = download.value.suggested_filename
    assert name.endswith(ENDING)
    download.value.save_as(folder / name)
    visit.close()
    record = read_cast_record(folder / name)
    assert spec_hash(spec_of(record))[:12] == record.spec_hash == folder.name[-12:]
    assert (record.pours[0].part_a_g, record.pours[0].part_b_g, record.pours[1].part_a_g) == (1.02, 0.99, None)
    assert record.notes == ("first try", "warm room")
    unit = record.unit(1)
    assert unit is not None
    assert (unit.height_mm, unit.mass_g, unit.wall_mm(1), unit.wall_mm(2)) == (4.6, 0.61, (), (1.3, 1.2))
    shown = Visit(browser, write_report(folder))
    text = shown.page.locator("#casts").inner_text()
    shown.close()
    assert all(words in text for words in (record.cast_on, "1.02", "0.61", "2: 1.3, 1.2", "warm room"))
    assert "another spec" not in text

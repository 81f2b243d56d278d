"""A variant's page in Chromium: it loads alone, draws, obeys its controls, by mouse and by keys, wide and narrow."""

import json
from pathlib import Path
from urllib.parse import unquote, urlparse

import numpy as np
import pytest
from chromium import LISTEN, Visit, launched

from unitcad.api.variant import Variant
from unitcad.pipeline.scenes import moments
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.validation import load, templates


@pytest.fixture
def visit(browser, page):
    seen = Visit(browser, page, script=LISTEN)
    seen.drawn()
    yield seen
    assert seen.requests == [page.resolve().as_uri()]
    seen.close()


def canvas(visit):
    """The 3D view's pixels, (height, width, 3), without its round corners."""
    return visit.pixels(".view canvas")[12:-12, 12:-12]


def drawn_share(image):
    """How much of the view is not its background."""
    return float((np.abs(image - image[2, image.shape[1] // 2]).max(axis=2) > 12).mean())


def changed(before, after):
    """How much of the view changed."""
    return float((np.abs(before - after).max(axis=2) > 12).mean())


def shown(visit):
    return visit.page.get_attribute(".stage-host", "data-shown").split()


def test_loads_from_a_file_and_asks_for_nothing(visit):
    assert visit.page.inner_text("h1") == "encapsulating"
    heads = visit.page.locator("section > h2").all_inner_texts()
    assert heads == [
        "Make it",
        "3D",
        "Section",
        "Attenuation estimate",
        "Mould checks and mesh checks",
        "Procedure",
        "Parts",
        "Files",
        "Spec",
    ]
    assert visit.page.locator("img.drawing").first.evaluate("(image) => image.naturalWidth") > 200


@pytest.mark.smoke
def test_the_view_draws_and_hiding_a_part_shows(visit):
    before = canvas(visit)
    assert drawn_share(before) > 0.1
    visit.page.uncheck('input[name="part-layer2"]')
    assert changed(before, canvas(visit)) > 0.02
    assert shown(visit) == ["layer1", "motor", "fpcb"]
    for name in ("layer1", "motor", "fpcb"):
        visit.page.uncheck(f'input[name="part-{name}"]')
    assert drawn_share(canvas(visit)) == 0
    visit.page.check('input[name="part-motor"]')
    assert 0.005 < drawn_share(canvas(visit)) < 0.2


def test_a_cut_shows_solid_faces_in_the_parts_colour(visit):
    visit.page.click("text=front")
    cut = canvas(visit)
    colours = [tuple(round(255 * c) for c in body.colour) for body in Variant.of("encapsulating").unit]
    for colour in colours[:3]:  # the circuit is thinner than a few pixels
        assert (np.abs(cut - colour).max(axis=2) <= 3).mean() > 0.01, colour
    visit.page.uncheck('input[name="cut"]')
    whole = canvas(visit)
    assert changed(cut, whole) > 0.05
    motor = colours[2]
    assert (np.abs(whole - motor).max(axis=2) <= 3).mean() < 0.001
    visit.page.check('input[name="cut"]')
    visit.page.select_option('select[name="axis"]', "z")
    assert changed(whole, canvas(visit)) > 0.02


def test_the_slider_goes_through_the_casting(visit):
    visit.page.check('input[type="radio"][value="moulds"]')
    tools = [tool.name for tool in Variant.of("encapsulating").plan.tools]
    assert sorted(shown(visit)) == sorted([*tools, "layer1", "layer2"])
    pictures = [canvas(visit)]
    expected = list(moments(Variant.of("encapsulating")))
    for i, moment in enumerate(expected, start=1):
        visit.page.fill('input[name="step"]', str(i))
        assert shown(visit) == list(moment.parts)
        assert moment.title in visit.page.inner_text(".step output")
        listed = visit.page.locator(".parts input").evaluate_all("(boxes) => boxes.map((box) => box.name)")
        assert listed == [f"part-{name}" for name in moment.parts]
        if i % 3 == 0 or i == len(expected):  # a screenshot costs most of the time
            pictures.append(canvas(visit))
            assert changed(*pictures[-2:]) > 0.002, moment.title
    visit.page.click('button[aria-label="Step back"]')
    assert shown(visit) == list(expected[-2].parts)
    visit.page.uncheck('input[name="part-layer2"]')
    visit.page.click('button[aria-label="Step back"]')
    assert shown(visit) == [name for name in expected[-3].parts if name != "layer2"]


def test_every_control_is_reached_and_worked_by_keys(visit):
    visit.page.check('input[type="radio"][value="moulds"]')
    visit.page.evaluate("() => { document.activeElement.blur(); window.scrollTo(0, 0); }")
    wanted = visit.page.evaluate(
        """() => {
          const radios = new Set();
          const all = document.querySelectorAll('a[href], button, input, select, summary, [tabindex="0"]');
          return [...all].filter((e) => {
            if (!e.checkVisibility() || e.disabled) return false;
            if (e.type !== "radio") return true;
            const first = !radios.has(e.name); radios.add(e.name); return first;  // arrows move within a group
          }).length;
        }"""
    )
    visit.page.evaluate("() => { window.reached = new Set(); }")
    for _ in range(wanted + 5):
        visit.page.keyboard.press("Tab")
        visit.page.evaluate("() => window.reached.add(document.activeElement)")
    reached = visit.page.evaluate("() => [...window.reached].filter((e) => e !== document.body).length")
    assert reached >= wanted
    # What takes a click and no focus would be out of reach. (A plot's points are in the tables too.)
    out_of_reach = visit.page.evaluate(
        """() => window.clickable
          .filter((e) => e.isConnected && e.checkVisibility && e.checkVisibility())
          .filter((e) => e.tabIndex < 0 && !e.closest(".plot"))
          .map((e) => e.outerHTML.slice(0, 80))"""
    )
    assert out_of_reach == []

    view = visit.page.locator(".view canvas")
    view.focus()
    before = canvas(visit)
    visit.page.keyboard.press("ArrowLeft")
    turned = canvas(visit)
    assert changed(before, turned) > 0.01
    visit.page.keyboard.press("+")
    assert changed(turned, canvas(visit)) > 0.01
    visit.page.locator('input[name="step"]').focus()
    visit.page.keyboard.press("ArrowRight")
    assert shown(visit) == ["base", "filament"]
    visit.page.locator('input[name="part-filament"]').focus()
    visit.page.keyboard.press("Space")
    assert shown(visit) == ["base"]
    visit.page.locator('input[value="moulds"]').focus()
    visit.page.keyboard.press("ArrowLeft")
    assert "motor" in shown(visit)
    visit.page.locator("summary", has_text="mould checks").focus()
    visit.page.keyboard.press("Enter")
    assert visit.page.locator("details[open] td", has_text="C100").count() > 0


def test_links_lead_to_files_that_are_there(visit, built):
    links = visit.page.locator("#files a").evaluate_all("(links) => links.map((link) => link.href)")
    assert len(links) > 10
    for link in links:
        assert Path(unquote(urlparse(link).path)).is_file(), link


def test_the_estimate_shows_models_and_the_measured_value(visit):
    lead = visit.page.inner_text("#estimate .lead")
    assert lead.startswith("5.2 % of the motor's amplitude at the edge (measured in the paper). Expect 3.1 to 6.8 %.")
    visit.page.get_by_text("How sure?").click()
    assert "factor 1.29 typical" in visit.page.inner_text("#estimate .lead-notes")
    visit.page.click("#estimate summary:has-text('Tables')")
    text = visit.page.inner_text("#estimate")
    for words in (
        "Paper, as published",
        "Fitted rule",
        "(rule)",
        "Measured: 5.17",
        "Also printed: 4.58",
        "12 of 12",
    ):
        assert words in text
    image = visit.pixels("#estimate .plot canvas")
    assert (np.abs(image - visit.colour("series-1")).max(axis=2) < 30).sum() > 150


def test_drawings_are_whole_at_390_pixels_and_large_on_demand(browser, page):
    seen = Visit(browser, page, width=390, height=844)
    drawings = seen.page.locator("img.drawing").all()
    assert len(drawings) == 3
    for image in drawings:
        box = image.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert box["width"] > 300
        natural = image.evaluate("(node) => [node.naturalWidth, node.naturalHeight]")
        assert box["width"] / box["height"] == pytest.approx(natural[0] / natural[1], rel=0.01)
        button = image.locator("xpath=../following-sibling::button")
        button.click()
        assert button.get_attribute("aria-pressed") == "true"
        assert image.bounding_box()["width"] == pytest.approx(natural[0], abs=1)
        assert seen.overflowing() == []
        button.press("Enter")
        assert image.bounding_box()["width"] == box["width"]
    seen.close()
    wide = Visit(browser, page)
    assert not wide.page.locator(".enlarge").first.is_visible()
    wide.close()


@pytest.mark.parametrize("dark", [False, True])
def test_nothing_overflows_at_390_pixels(browser, page, dark):
    seen = Visit(browser, page, width=390, height=844, dark=dark)
    seen.drawn()
    assert drawn_share(canvas(seen)) > 0.05
    for summary in seen.page.locator("summary").all():
        summary.click()
    assert seen.overflowing() == []
    seen.close()


def test_light_and_dark(browser, page):
    def background(visit):
        text = visit.page.evaluate("() => getComputedStyle(document.body).backgroundColor")
        return [int(part) for part in text.removeprefix("rgb(").removesuffix(")").split(",")]

    for dark in (False, True):
        seen = Visit(browser, page, dark=dark)
        assert (max(background(seen)) < 60) == dark
        seen.page.click('button[aria-label="Switch between light and dark"]')
        assert (max(background(seen)) < 60) != dark
        seen.close()


def test_the_procedure_is_all_there(visit, built):
    casting = json.loads((built / "casting.json").read_text("utf-8"))
    items = visit.page.locator("#procedure ol > li").all_inner_texts()
    pours = [step for pour in casting["pours"] for step in pour["steps"]]
    steps = [*casting["preparation"], *pours, *casting["release"], *casting["assembly"]]
    assert items == [f"{step['title']}. {step['short'] or step['text']}" for step in steps]
    assert "of which" in visit.page.locator("#procedure").inner_text()
    starts = visit.page.locator("#procedure ol").evaluate_all("(lists) => lists.map((list) => list.start)")
    lengths = visit.page.locator("#procedure ol").evaluate_all("(lists) => lists.map((list) => list.children.length)")
    assert starts == [1 + sum(lengths[:i]) for i in range(len(lengths))]
    for image in visit.page.locator("#procedure img").all():
        assert image.evaluate("(node) => node.naturalWidth") > 200
    assert visit.page.locator("#procedure figure img").count() == len(casting["pours"])
    pictured = [step["title"] for step in steps if step["picture"]]
    assert pictured
    shown = visit.page.locator("#procedure li > img.state")
    assert shown.evaluate_all("(nodes) => nodes.map((node) => node.alt)") == pictured
    assert visit.page.locator("#procedure img").count() == len(casting["pours"]) + len(pictured)


def test_print_shows_the_procedure_and_not_the_controls(visit):
    visit.page.emulate_media(media="print")
    assert visit.page.locator("#procedure").is_visible()
    assert visit.page.locator("#section img").is_visible()
    visit.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    assert visit.page.locator("#procedure details:not([open])").count() == 0
    assert visit.page.locator("#procedure td", has_text="pot life").first.is_visible()
    assert visit.printed_faults() == []
    for selector in ("nav", "#view", "#files", "#estimate", "button"):
        assert not visit.page.locator(selector).first.is_visible(), selector


def test_without_webgl_the_drawing_stands_in(browser, page):
    with launched(browser.browser_type, "--disable-3d-apis") as blind:
        seen = Visit(blind, page)
        seen.page.wait_for_selector(".stage-host .absent")
        assert "no 3D" in seen.page.inner_text(".stage-host")
        assert seen.page.locator(".stage-host img").is_visible()
        seen.console.clear()
        seen.close()


def test_what_is_absent_says_what_to_ask_for(browser, tmp_path):
    folder = build(load("embedded", ["output.formats=[]"]), tmp_path, only=["moulds"], check=False).folder
    seen = Visit(browser, write_report(folder))
    seen.drawn()
    for where, ask in (
        ("estimate", "estimate"),
        ("procedure", "casting"),
        ("section", "unit"),
        ("checks", "unit,moulds"),
    ):
        assert f"--only {ask}" in seen.page.inner_text(f"#{where}")
    seen.close()


@pytest.mark.parametrize("only", [["unit"], ["unit", "estimate"]])
def test_a_design_without_an_estimate_says_why(browser, only, tmp_path):
    """Whether or not it was asked for: the command that asks for it would be refused."""
    spec = load(next(iter(templates().values())).parent / "custom" / "dome.toml", ["output.formats=[]"])
    seen = Visit(browser, write_report(build(spec, tmp_path, only=only).folder))
    seen.page.wait_for_selector("#estimate .absent", timeout=10_000)
    shown = seen.page.inner_text("#estimate")
    assert "No estimate: the models describe" in shown
    assert "--only" not in shown
    seen.close()

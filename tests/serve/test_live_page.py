"""The live page in Chromium: every template, a refusal and its button, undo, two variants, saving and building."""

import json

import pytest
from live import WALL, Live
from running import serving

from unitcad.validation import load, templates


@pytest.fixture
def live(browser, server):
    visit = Live(browser, server)
    yield visit
    visit.close()


def test_every_template_is_shown_and_judged(live):
    for name in sorted(templates()):
        live.start_from(name)
        assert "checks: " in live.state, name
        assert live.page.inner_text("h1") == load(name).name
        bodies = set(live.page.get_attribute(".stage-host", "data-shown").split())
        assert f"layer{len(load(name).layers)}" in bodies, name
        assert live.page.locator("#estimate .lead").count() == 1, name
        assert live.page.locator("#section img").count() == 1
        if name == "encapsulating":
            assert "The unit comes out 4.6 mm high (drawn 4.61), caps 1.2 and 1.2. Print" in live.page.inner_text(
                "#glance"
            )
            first = live.page.locator('input[name="moulds.first_layer_mm"]')
            first.evaluate(
                "node => { for (let up = node; up; up = up.parentElement) if ('open' in up) up.open = true; }"
            )
            live.choose('input[name="moulds.first_layer_mm"]', "0.35")
            assert live.state.endswith(", 1 warning")
            assert "Warning: layer 1's cap comes out 1.15 mm for 1.25" in live.page.inner_text("#glance")
        assert live.page.locator(".spec-form .refusal:not(:empty)").count() == 0


@pytest.mark.smoke
def test_a_refused_value_stays_with_its_reason_and_a_button_that_accepts(live):
    live.choose(WALL, "0.2")
    assert live.state == "1 value is refused"
    fault = live.page.locator('.field[data-path="layers.0.wall_mm"] .refusal')
    assert "must be at least 0.5" in fault.inner_text()
    assert live.page.input_value(WALL) == "0.2"
    assert live.page.get_attribute(WALL, "aria-invalid") == "true"
    assert live.page.get_attribute("#page", "data-stale") == "true"
    fault.get_by_role("button").click()
    live.until(lambda: "checks: " in live.state)
    assert live.page.input_value(WALL) == "0.5"
    assert live.page.evaluate("() => document.activeElement.name") == "layers.0.wall_mm"


def test_a_part_fills_the_motor_s_fields_and_the_pieces_lie_side_by_side(live):
    def value(name):
        return live.page.input_value(f'[name="{name}"]')

    live.choose('input[name="motor.diameter_mm"]', "6.9")
    count = len(live.timings())
    live.page.select_option('select[name="motor.part"]', "VG1040003D")
    live.until(lambda: len(live.timings()) > count)
    live.settled()
    # It is refused at 14 mm, and its size is there all the same; the ring of air of 1 mm is kept.
    assert (value("motor.diameter_mm"), value("motor.thickness_mm"), value("motor.drive")) == ("10", "4", "axial")
    live.page.click("text=Use diameter_mm = 17")
    live.until(lambda: "checks: " in live.state)
    assert value("motor.diameter_mm") == "10"
    ranges = live.page.locator('.field[data-path="layers.0.wall_mm"] .range').inner_text()
    assert ranges == "0.5 to 5 mm"
    live.page.evaluate("() => window.scrollTo(0, document.body.scrollHeight)")
    assert live.page.get_by_role("button", name="Build this").bounding_box()["y"] < 100
    live.page.check('input[value="moulds"]')
    looks = [live.page.input_value('input[name="apart"]'), live.page.is_checked('input[name="cut"]')]
    assert looks == ["100", False]
    live.page.click('button[aria-label="Step on"]')
    assert live.page.input_value('input[name="apart"]') == "0"


IN_SIGHT = """(node) => {
  const { top, bottom } = node.getBoundingClientRect();
  return top >= document.querySelector(".top").getBoundingClientRect().bottom - 1 && bottom <= innerHeight + 1;
}"""


def test_a_reason_comes_to_the_person_and_the_chip_leads_to_it(browser, server):
    live = Live(browser, server, 390, 700)
    fault = live.page.locator('.field[data-path="layers.0.wall_mm"] .refusal')
    live.choose(WALL, "9")
    assert fault.evaluate(IN_SIGHT)
    live.page.evaluate("() => { document.activeElement.blur(); window.scrollTo(0, document.body.scrollHeight); }")
    assert not fault.evaluate(IN_SIGHT)
    live.page.get_by_role("link", name="1 value is refused").click()
    assert fault.evaluate(IN_SIGHT)
    assert live.page.evaluate("() => document.activeElement.name") == "layers.0.wall_mm"
    # A text that was refused by something else than a field in sight, as by undo and redo.
    for button in ("Undo", "Redo"):
        live.page.evaluate("() => window.scrollTo(0, 0)")
        live.pressed(live.page.get_by_role("button", name=button))
    assert fault.evaluate(IN_SIGHT)
    # A picked design tells its changes where it was picked.
    live.pressed(live.page.get_by_role("button", name="Undo"))
    count = len(live.timings())
    live.page.select_option('select[name="design"]', "embedded")
    live.until(lambda: len(live.timings()) > count)
    live.settled()
    told = live.page.locator('.field[data-path="design"] #also')
    assert told.inner_text().startswith("Left out: layers.0.cap_mm and layers.1.cap_mm.")
    assert told.evaluate(IN_SIGHT)
    assert "cap_mm" not in live.page.input_value("#text")
    live.pressed(live.page.get_by_role("button", name="Undo"))
    assert live.page.input_value("#text").count("cap_mm") == 2
    live.close()


def test_every_change_is_one_step_of_undo(live):
    name = '[name="name"]'
    # Two changes at once, sooner than the first is answered.
    live.page.evaluate(
        """() => {
          for (const [name, value] of [["layers.0.wall_mm", "1.3"], ["layers.1.wall_mm", "1.2"]]) {
            const input = document.querySelector(`input[name="${name}"]`);
            input.value = value;
            input.dispatchEvent(new Event("input"));
          }
        }"""
    )
    live.until(lambda: "wall_mm = 1.2\n" in live.page.input_value("#text").replace(" #", "\n"))
    live.settled()
    live.page.locator(WALL).press("Control+z")
    live.until(lambda: live.page.input_value('input[name="layers.1.wall_mm"]') == "1.25")
    assert live.page.input_value(WALL) == "1.3"
    live.start_from("embedded")
    assert live.page.input_value("#file-name") == "embedded.toml"
    assert "Other values than before: " in live.page.inner_text("#also")
    # The name that is typed has its own undo, and the text the page's.
    live.page.fill("#file-name", "x")
    live.page.locator("#file-name").press("Control+z")
    assert live.page.input_value(name) == "embedded"
    live.page.click("text=As TOML text")
    live.page.locator("#text").press("Control+z")
    live.until(lambda: live.page.input_value(name) == "encapsulating")
    live.settled()
    assert "1.3" in live.page.input_value("#text")


def test_the_file_that_was_opened_is_saved_without_a_question_until_it_changes(browser, tmp_path, text):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with serving(tmp_path, "mine.toml") as own:
        visit = Live(browser, own)
        for wall in ("1.3", "1.35"):
            visit.choose(WALL, wall)
            visit.page.click("text=Save spec")
            visit.until(lambda: "Saved as" in visit.page.inner_text("#do"))
            assert f"wall_mm = {wall}" in file.read_text()
            visit.page.reload()
            visit.page.wait_for_selector("html[data-ready=yes]")
        file.write_text(text + "# theirs\n")
        visit.choose(WALL, "1.4")
        visit.page.click("text=Save spec")
        visit.until(lambda: "was changed on disk" in visit.page.inner_text("#do"))
        assert file.read_text().endswith("# theirs\n")
        visit.page.click("text=Replace it")
        visit.until(lambda: "Saved as" in visit.page.inner_text("#do"))
        assert "wall_mm = 1.4" in file.read_text()
        visit.context.close()
        assert visit.errors == []


def test_form_and_text_are_in_step_and_changes_are_undone(live):
    live.page.click("text=As TOML text")
    live.choose(WALL, "1.4")
    text = live.page.input_value("#text")
    assert "wall_mm = 1.4" in text
    assert "# inside out" in text  # comments stay
    live.choose("#text", text.replace("wall_mm = 1.4", "wall_mm = 1.5"))
    assert live.page.input_value(WALL) == "1.5"
    live.page.wait_for_timeout(1000)  # typing without a pause is one step
    live.choose("#text", text + "\n[[")
    assert live.page.inner_text("#page").count("not TOML") == 1
    for wanted in ("1.5", "1.4", "1.25"):
        live.page.click("text=Undo")
        live.until(lambda wanted=wanted: live.page.input_value(WALL) == wanted)
    live.page.click("text=Redo")
    live.until(lambda: live.page.input_value(WALL) == "1.4")
    live.settled()


def test_every_control_changes_the_spec(live):
    """Each kind of control of every group, to a value that is accepted."""
    live.page.evaluate("() => document.querySelectorAll('.spec-form details').forEach((one) => { one.open = true; })")
    count = live.page.locator(".field").count()
    assert count > 50
    for path in (
        "diameter_mm", "motor.fill", "fpcb.tail", "layers.1.material", "moulds.cavities", "moulds.plate_mm",
        "casting.vacuum", "estimate.models",
    ):  # fmt: skip
        field = live.page.locator(f'.field[data-path="{path}"]')
        before = live.page.input_value("#text")
        kind = field.get_attribute("class").split()[1]
        main = field.locator("input, select").first
        if kind == "of-switch":
            main.click()
        elif kind == "of-word":
            words = [one.get_attribute("value") for one in main.locator("option").all()]
            main.select_option(next(word for word in words if word != main.input_value()))
        elif kind == "of-words":
            main.click()
        elif kind == "of-toml":
            main.fill("[1, 2]")
            main.press("Tab")
        else:
            field.locator('input[type="range"]').focus()
            live.page.keyboard.press("ArrowRight")
        live.until(lambda before=before: live.page.input_value("#text") != before)
        live.settled()
        assert "refused" not in live.state, (path, live.page.inner_text("#faults"))
    live.page.get_by_label("with circuit").click()
    live.until(lambda: "[fpcb]" not in live.page.input_value("#text"))
    live.settled()


def test_a_change_that_another_field_refuses_is_refused_where_it_was_made(live):
    live.choose(WALL, "9")
    assert live.page.get_attribute(WALL, "aria-invalid") == "true"
    assert live.page.get_attribute('input[name="diameter_mm"]', "aria-invalid") != "true"
    fault = live.page.locator('.field[data-path="layers.0.wall_mm"] .refusal')
    assert "walls of 10.25 a side need 27.7 mm" in fault.inner_text()
    buttons = [button.inner_text() for button in fault.get_by_role("button").all()]
    assert buttons == ["Use 2.15", "Use diameter_mm = 29.5"]
    live.pressed(fault.get_by_role("button").nth(1))
    assert live.page.input_value('input[name="diameter_mm"]') == "29.5"
    assert "checks: " in live.state


def test_changes_that_are_not_saved_outlast_a_reload(live):
    live.page.click("text=Pin this variant")
    live.choose(WALL, "1.4")
    live.page.reload()
    live.page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
    live.settled()
    assert live.page.input_value(WALL) == "1.4"
    assert live.page.inner_text("#pinned thead th") == "Pinned: encapsulating"
    live.page.get_by_role("button", name="Undo").click()
    live.until(lambda: live.page.input_value(WALL) == "1.25")
    live.page.get_by_role("button", name="Redo").click()
    live.until(lambda: live.page.input_value(WALL) == "1.4")
    live.page.click("text=Start from encapsulating.toml again")
    live.until(lambda: live.page.input_value(WALL) == "1.25")
    live.settled()


def test_layers_are_added_and_taken_out_and_the_focus_stays(live):
    """By keyboard, over a form that is made again."""
    focused = "() => document.activeElement.name"
    rows = live.page.locator('.field[data-path^="layers.2."]')
    live.pressed(live.page.get_by_role("button", name="Add a layer outside"), "Enter")
    assert (rows.count(), live.page.evaluate(focused)) == (3, "add")
    live.pressed(live.page.get_by_role("button", name="Remove layer 3"), "Enter")
    assert (rows.count(), live.page.evaluate(focused)) == (0, "add")
    live.pressed(live.page.get_by_label("with circuit"), "Space")
    assert live.page.evaluate(focused) == "with fpcb"
    live.pressed(live.page.get_by_role("button", name="cap: back to the default").first, "Enter")
    assert live.page.evaluate(focused) == "layers.0.cap_mm"


def test_a_pinned_variant_stands_beside_the_changed_one(live):
    live.page.click("text=Pin this variant")
    live.choose('input[name="diameter_mm"]', "16")
    table = live.page.locator("#pinned table")
    assert table.locator("img").count() == 2
    assert "diameter_mm" in table.inner_text()
    assert "14 mm" in table.inner_text()
    assert "16 mm" in table.inner_text()
    live.page.click("text=Go back to it")
    live.until(lambda: live.page.input_value('input[name="diameter_mm"]') == "14")
    live.settled()
    live.page.click("text=Unpin")
    assert table.count() == 0


def test_everything_works_from_the_keyboard(live):
    live.page.locator(WALL).focus()
    live.page.keyboard.press("Control+A")
    live.page.keyboard.type("0.3")
    live.until(lambda: "refused" in live.state)
    live.page.keyboard.press("Tab")
    for _ in range(6):  # over the slider to the button that accepts
        if live.page.evaluate("() => document.activeElement.textContent.startsWith('Use ')"):
            break
        live.page.keyboard.press("Tab")
    live.page.keyboard.press("Enter")
    live.until(lambda: "checks: " in live.state)
    assert live.page.input_value(WALL) == "0.5"
    live.page.keyboard.press("Control+z")
    live.until(lambda: "refused" in live.state or live.page.input_value(WALL) == "1.25")
    live.settled()


def test_nothing_is_wider_than_its_column(browser, server):
    """On a phone, a tablet, a desk and a wide screen, everything open, one pinned, one refused; dark."""
    visit = Live(browser, server, width=390, height=844, dark=True)
    visit.page.click("text=Pin this variant")
    visit.choose(WALL, "0.2")
    visit.page.evaluate("() => document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    for width in (390, 768, 1280, 1920):
        visit.page.set_viewport_size({"width": width, "height": 900})
        assert visit.overflowing() == [], width
        # Both variants are seen at once.
        now = visit.page.locator("#pinned thead th").nth(1).bounding_box()
        assert now["x"] + now["width"] <= width
    ground = visit.page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    assert ground == "rgb(20, 23, 26)"
    visit.close()


def test_a_refused_spec_that_is_saved_is_said_to_be_refused(browser, tmp_path):
    with serving(tmp_path) as own:
        visit = Live(browser, own)
        visit.choose(WALL, "0.2")
        visit.page.click("text=Save spec")
        visit.until(lambda: "Saved" in visit.page.inner_text("#do"))
        assert "wall_mm = 0.2" in (tmp_path / "encapsulating.toml").read_text()
        assert "nothing can be built from it yet" in visit.page.inner_text("#do")
        assert "must be at least 0.5" in visit.page.inner_text("#do")
        visit.choose(WALL, "0.7")
        visit.page.fill("#file-name", "good")
        visit.page.click("text=Save spec")
        visit.until(lambda: "good.toml" in visit.page.inner_text("#do"))
        assert "nothing can be built from it yet" not in visit.page.inner_text("#do")
        visit.close()


WORDS = """() => {
  const job = document.querySelector(".job");
  window.words = new Set();
  new MutationObserver(() => {
    const lead = job.querySelector(".lead");
    if (lead) window.words.add(lead.textContent);
  }).observe(job, { childList: true, subtree: true });
}"""
"""Keeps what the page says of a job."""


@pytest.mark.smoke
def test_save_and_build_from_the_page(browser, tmp_path):
    with serving(tmp_path, "single-embedded") as own:
        visit = Live(browser, own)
        visit.page.click("text=As TOML text")
        visit.choose("#text", visit.page.input_value("#text") + '\n[output]\nformats = ["stl"]\n')
        visit.page.click("text=Save spec")
        visit.until(lambda: (tmp_path / "single-embedded.toml").is_file())
        visit.page.evaluate(WORDS)
        visit.page.get_by_role("button", name="Build this").press("Enter")
        visit.page.get_by_role("button", name="Cancel").focus()
        visit.page.wait_for_selector('.job[data-ended="true"]', timeout=120_000)
        # The button kept the focus from stage to stage, and leaves it to the result.
        assert visit.page.evaluate("() => document.activeElement.className") == "job"
        words = visit.page.evaluate("() => [...window.words]")
        assert words[0] == "The build is under way: starting"
        assert len(words) > 2, words
        assert "The build is under way: plan" not in words
        assert any("drawing the" in each or "checking the moulds" in each for each in words), words
        assert f"In {tmp_path / 'out'}/" in visit.page.inner_text(".job")
        assert "The build is done." in visit.page.inner_text(".job")
        assert visit.page.locator(".job").first.evaluate(IN_SIGHT)
        visit.page.evaluate("() => window.scrollTo(0, 0)")
        assert "/files/" in visit.page.get_by_role("link", name="open the result").get_attribute("href")
        with visit.context.expect_page() as opened:
            visit.page.click("text=Open its page")
        result = opened.value
        result.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        # It runs apart from the server: no token, no cookie, no question.
        assert result.evaluate("() => window.origin") == "null"
        with result.expect_download() as under_way:
            result.locator("#files").get_by_role("link", name="base.stl", exact=True).first.click()
        assert under_way.value.path().stat().st_size > 1000
        visit.close()
    manifests = list((tmp_path / "out").glob("*/manifest.json"))
    assert len(manifests) == 1
    assert all(check["ok"] for check in json.loads(manifests[0].read_text())["mould_checks"])


def test_an_older_answer_does_not_replace_a_newer_one(live):
    """A slider that is dragged: the last value is the one that is shown, whatever was asked meanwhile."""
    live.page.evaluate(
        """async (selector) => {
          const input = document.querySelector(selector);
          for (let i = 0; i <= 40; i += 1) {
            input.value = String((1 + i / 100).toFixed(2));
            input.dispatchEvent(new Event("input"));
            await new Promise((done) => setTimeout(done, 5));
          }
        }""",
        WALL,
    )
    live.until(lambda: live.page.input_value("#text").count("wall_mm = 1.4") == 1)
    live.settled()
    assert live.page.input_value(WALL) == "1.4"
    live.page.click("text=Undo")  # one drag is one step
    live.until(lambda: live.page.input_value(WALL) == "1.25")
    live.settled()


@pytest.mark.long
def test_ten_thousand_random_edits(browser, server):
    """No error on either side, and no growth of memory or of the page's elements after the first thousand.

    A worker that answers for units levels off at 110 MB after some 500 distinct ones, where its caches are full.
    """
    import random

    import psutil

    rng = random.Random(20261122)
    visit = Live(browser, server)
    visit.page.evaluate("() => document.querySelectorAll('.spec-form details').forEach((one) => { one.open = true; })")

    def grown():
        """MB of the server and each of its workers, MB of the page, elements and texts that the browser holds."""
        process = psutil.Process(server.process.pid)
        heap = visit.context.new_cdp_session(visit.page)
        heap.send("HeapProfiler.collectGarbage")
        used = heap.send("Runtime.getHeapUsage")["usedSize"]
        nodes = heap.send("Memory.getDOMCounters")["nodes"]
        heap.detach()
        every = [process, *process.children(recursive=True)]
        return [one.memory_info().rss / 1e6 for one in every], used / 1e6, nodes

    early = None
    for i in range(10_000):
        if i % 50 == 0:
            visit.page.select_option('select[name="template"]', rng.choice(sorted(templates())))
        else:
            visit.page.evaluate(EDIT, rng.random())
        visit.page.wait_for_timeout(rng.choice((0, 5, 20, 60)))
        if i == 1000:
            visit.settled()
            early = grown()
    visit.settled()
    assert early is not None
    late = grown()
    # A worker that is made ready for a slow question may have come since: three at the most.
    assert len(late[0]) <= 7
    assert sum(late[0]) / len(late[0]) < 1.25 * sum(early[0]) / len(early[0])
    assert max(late[0]) < 150
    assert late[1] < 1.5 * early[1] + 20
    assert late[2] < 1.5 * early[2]
    visit.close()


EDIT = """(draw) => {
  const fields = [...document.querySelectorAll(".field")];
  const field = fields[Math.floor(draw * fields.length)];
  const rest = (draw * fields.length) % 1;
  const main = field.querySelector("input, select");
  if (main.tagName === "SELECT") {
    main.selectedIndex = Math.floor(rest * main.options.length);
    main.dispatchEvent(new Event("change"));
  } else if (main.type === "checkbox") main.click();
  else if (main.type === "number") {
    main.value = String(rest < 0.2 ? -rest : Number(main.value || 1) * (0.5 + rest));
    main.dispatchEvent(new Event("input"));
  } else {
    main.value = ["", "[1, 2]", "x", "[", '["rule"]', "fill"][Math.floor(rest * 6)];
    main.dispatchEvent(new Event("change"));
  }
}"""


def test_moulds_that_are_refused_are_not_shown(live):
    live.page.check('input[value="moulds"]')
    live.page.fill('input[name="diameter_mm"]', "300")  # the unit can be made, its moulds exceed the bed
    live.until(lambda: live.state == "no moulds")
    assert live.page.is_disabled('input[value="moulds"]')
    assert live.page.inner_text('label:has(> input[value="moulds"])') == "Moulds (none can be made)"
    assert live.page.get_attribute("#page", "data-moulds") == "none"
    assert "has no moulds" in live.page.inner_text("#faults")


def test_a_server_that_has_ended_is_told_at_every_button(browser, tmp_path):
    with serving(tmp_path) as own:
        visit = Live(browser, own)
        visit.page.fill("#file-name", "../x")
        visit.page.click("text=Save spec")
        assert "letters, digits" in visit.page.inner_text("#do")
        visit.page.fill("#file-name", "mine")
    visit.page.click("text=Save spec")
    visit.until(lambda: "does not answer" in visit.page.inner_text("#do"))
    visit.page.click("text=Build this")
    visit.until(lambda: "does not answer" in visit.page.inner_text(".job"))
    visit.context.close()
    assert visit.errors == []

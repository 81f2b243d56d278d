"""A batch's folder in the live page: its table, and a row that opens live."""

from pathlib import Path

import pytest
from live import WALL, Live
from pagetable import data_of
from running import serving

from unitcad.cache import MemoryStore
from unitcad.pipeline.write import build
from unitcad.sweeps import BatchOptions, run
from unitcad.sweeps.executors import SerialExecutor
from unitcad.sweeps.sweep import from_file
from unitcad.validation import load


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    out, store = tmp_path_factory.mktemp("batch"), MemoryStore()
    for wall in (1.0, 1.5):
        build(load("encapsulating", [f"layers.0.wall_mm={wall}", "output.formats=[]"]), out, only=["unit"], store=store)
    return out


@pytest.fixture(scope="module")
def own(batch):
    with serving(batch.parent, str(batch)) as server:
        yield server


@pytest.mark.smoke
def test_a_row_of_a_batch_opens_live(browser, own):
    visit = Live(browser, own)
    names = visit.page.locator("#variants tbody th a")
    assert names.count() == 2
    opened = []
    for index in (1, 0):
        before = visit.page.input_value(WALL)
        names.nth(index).click()
        visit.until(lambda before=before: visit.page.input_value(WALL) != before)
        visit.settled()
        opened.append(visit.page.input_value(WALL))
        # The spec begins below the header that stays, and is what the next Tab goes into.
        header, spec = (visit.page.locator(one).bounding_box() for one in (".top", "#spec"))
        assert spec["y"] >= header["y"] + header["height"]
        assert visit.page.evaluate("() => document.activeElement.id") == "spec"
    assert sorted(opened) == ["1", "1.5"]
    visit.close()


def test_a_refused_row_opens_with_its_values_and_its_refusal(browser, tmp_path):
    base = {"base": "single-embedded", "set": {"output.formats": []}}
    sweep = from_file({**base, "sweep": {"layers.0.wall_mm": [9.0, 1.0]}}, Path(), "walls")
    run(sweep, tmp_path / "walls", BatchOptions(("unit",), check=False), SerialExecutor(), workers=1)
    with serving(tmp_path, str(tmp_path / "walls")) as own:
        visit = Live(browser, own)
        # The page begins with the first variant that was made.
        assert visit.page.input_value(WALL) == "1"
        row = visit.page.locator("#variants tbody th a").first
        assert row.inner_text() == "variant 0"
        visit.pressed(row)
        visit.until(lambda: visit.page.input_value(WALL) == "9")
        visit.settled()
        assert visit.state == "1 value is refused"
        use = visit.page.locator('.field[data-path="layers.0.wall_mm"] .refusal').get_by_role("button").first
        visit.pressed(use)
        assert "checks: " in visit.state
        visit.close()


def test_the_folder_of_a_result_opens_its_spec(batch):
    folder = sorted(batch.glob("encapsulating-*"))[0]
    with serving(batch.parent, str(folder)) as one:
        assert data_of(one.send("/")[1].decode())["text"] == (folder / "spec.toml").read_text()


@pytest.mark.parametrize("folder", ["../secret", "..", "%2e%2e", "nothing"])
def test_no_folder_but_a_variant_s_is_read(own, folder):
    (own.folder / "secret").mkdir(exist_ok=True)
    (own.folder / "secret" / "spec.toml").write_text("name = 'secret'")
    assert own.send(f"/variant/{folder}")[0] == 404

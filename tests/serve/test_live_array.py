"""An array in the live page: the patch, its crosstalk, edits of it."""

import base64
import io
import json
import re
import tomllib

import pytest
import trimesh
from live import Live
from running import serving

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.arrays.array_page import patch_glb
from unitcad.arrays.crosstalk import crosstalk, heat_map_svg, patch_map_svg
from unitcad.arrays.patch import patch_moulds, patch_parts
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.serve.server import serve
from unitcad.validation import templates

NINE = array_templates()["forearm-pockets"].read_text("utf-8")
TEXT = NINE.replace("rows = 3", "rows = 1").replace("26.0", "8.0")
UNIT = re.compile(r"^unit = .*$", re.MULTILINE)


@pytest.fixture(scope="module")
def pockets(tmp_path_factory):
    folder = tmp_path_factory.mktemp("array")
    (folder / "pockets.toml").write_text(TEXT)
    with serving(folder, "pockets.toml") as server:
        yield server


def test_answers_are_those_of_the_commands(pockets):
    array = load_array(tomllib.loads(TEXT), ["layout.pitch_mm=22.0"])
    edit = [{"path": "layout.pitch_mm", "value": 22.0}]
    patch = pockets.ask(TEXT, "unit", edit)
    assert base64.b64decode(patch["model"]["unit"]) == patch_glb(patch_moulds(array).blank, patch_parts(array))
    drawn = dict(pockets.ask(TEXT, "estimate", edit)["drawings"])
    data = crosstalk(array)
    assert list(drawn.values()) == [patch_map_svg(array, data), heat_map_svg(data)]
    tools = pockets.ask(TEXT, "moulds", edit)
    moulds = patch_moulds(array)
    # As a build does: of sheet and tray, then of the unit and its moulds.
    found = [*check_moulds(moulds), *check_moulds(MouldSet(array.unit))]
    assert [check["code"] for check in tools["checks"]] == [finding.code for finding in found]
    meshes = trimesh.load_scene(io.BytesIO(base64.b64decode(tools["model"]["moulds"])), file_type="glb").geometry
    assert set(meshes) == set(tools["model"]["moulds_apart"]) > {tool.name for tool in moulds.plan.tools}


def test_a_pitch_that_is_too_small_gets_the_nearest_that_is_accepted(pockets):
    fault = pockets.ask(TEXT, "unit", [{"path": "layout.pitch_mm", "value": 15.0}])["faults"][0]
    assert fault["field"] == "layout.pitch_mm"
    assert "faults" not in pockets.ask(TEXT, "unit", [{"path": fault["field"], "value": fault["nearest"]}])
    assert "faults" in pockets.ask(TEXT, "unit", [{"path": fault["field"], "value": fault["nearest"] - 0.1}])


def test_every_fault_of_an_array_is_told(pockets):
    wrong = {"sheet.thickness_mm": 0.1, "sheet.margin_mm": 0.2, "moulds.plate_mm": 0.001}
    answer = pockets.ask(TEXT, "unit", [{"path": path, "value": value} for path, value in wrong.items()])
    faults = {fault["field"]: fault for fault in answer["faults"]}
    assert set(faults) == set(wrong)
    lines = answer["text"].splitlines()
    assert all(path.split(".")[1] in lines[faults[path]["line"] - 1] for path in wrong)
    offered = [{"path": path, "value": fault["nearest"]} for path, fault in faults.items()]
    assert "faults" not in pockets.ask(answer["text"], "unit", offered)


def test_a_tail_that_a_pitch_leaves_no_way_is_refused_at_the_pitch(pockets):
    """Both values offered are accepted: that of the pitch, and that of the unit, whose template stays named."""
    narrow = [{"path": "layout.pitch_mm", "value": 17.0}]
    message = {"text": NINE, "edits": narrow, "since": [{"path": "layout.pitch_mm", "value": 20.0}]}
    fault = json.loads(pockets.send("/ask", message)[1])["faults"][0]
    assert (fault["field"], fault["at"]) == ("unit.fpcb.tail_length_mm", "layout.pitch_mm")
    assert "faults" not in pockets.ask(NINE, "unit", [{"path": fault["at"], "value": fault["at_nearest"]}])
    shorter = pockets.ask(NINE, "unit", [*narrow, {"path": fault["field"], "value": fault["nearest"]}])
    assert "faults" not in shorter
    asked = tomllib.loads(shorter["text"])
    assert asked["unit"] == {"like": "encapsulating", "fpcb": {"tail_length_mm": fault["nearest"]}}
    assert asked["layout"] == tomllib.loads(NINE)["layout"] | {"pitch_mm": 17.0}
    assert "# a template, a spec file, or a table" in shorter["text"]


@pytest.mark.parametrize("text", [TEXT, TEXT.replace("pitch_mm = 20.0", "pitch_mm = [20.0, 22.0]")])
def test_pitch_and_counts_have_their_ranges(pockets, text):
    fields = {one["path"]: one for group in pockets.ask(text)["groups"] for one in group["fields"]}
    pitches = [one for path, one in fields.items() if path.startswith("layout.pitch_mm")]
    assert len(pitches) == (2 if "[20.0" in text else 1)
    assert all((one["kind"], one["low"], one["high"]) == ("number", 8, 60) for one in pitches)
    assert (fields["layout.columns"]["low"], fields["layout.columns"]["high"]) == (1, 100)
    assert any(name == "fdm-0.4" for name, _ in fields["moulds.printer"]["choices"])
    path = pitches[-1]["path"]
    fault = pockets.ask(text, "unit", [{"path": path, "value": 1001.0}])["faults"][0]
    assert fault["field"] == path
    assert "must be at most 1000" in fault["message"]
    assert "faults" not in pockets.ask(text, "unit", [{"path": path, "value": fault["nearest"]}])


@pytest.mark.parametrize(
    "unit",
    [
        '"{file}"', '"custom/dome"', '{{ like = "{file}" }}', '{{ like = "encapsulating", design = "evil.py:evil" }}',
        '{{ like = "encapsulating", design = "{folder}/evil.py:evil" }}',
        '{{ like = "encapsulating", estimate = {{ fit = "{file}" }} }}',
    ],
)  # fmt: skip
def test_files_that_an_array_names_are_not_read(pockets, unit, tmp_path):
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    secret = tmp_path / "secret.toml"
    secret.write_text('password = "hunter2"')
    text = UNIT.sub(lambda _: "unit = " + unit.format(file=secret, folder=tmp_path), TEXT)
    assert text != TEXT
    for what in ("unit", "moulds", "estimate"):
        answer = pockets.ask(text, what)
        assert "names only files" in answer["faults"][0]["message"]
        assert "hunter2" not in str(answer)
    assert pockets.send("/build", {"text": text})[0] == 422
    assert not (tmp_path / "ran").exists()


def test_a_file_that_the_server_s_own_array_names_is_read(tmp_path):
    (tmp_path / "mine.toml").write_text(templates()["encapsulating"].read_text("utf-8"))
    (tmp_path / "patch.toml").write_text(UNIT.sub('unit = "mine.toml"', TEXT))
    with serving(tmp_path, "patch.toml") as own:
        answer = own.ask((tmp_path / "patch.toml").read_text(), "unit", [{"path": "layout.pitch_mm", "value": 23.0}])
        assert "faults" not in answer
    (tmp_path / "evil.py").write_text("def evil(spec): return {}\n")
    (tmp_path / "mine.toml").write_text('design = "evil.py:evil"\n')
    with pytest.raises(Refusal, match="--allow-code"):
        serve(str(tmp_path / "patch.toml"))


@pytest.mark.smoke
def test_a_patch_is_shown_and_changed(browser, pockets):
    live = Live(browser, pockets)
    assert "checks: " in live.state
    assert live.page.inner_text("h1") == "forearm-pockets"
    assert "sheet" in live.page.get_attribute(".stage-host", "data-shown")
    assert live.page.locator("#estimate img").count() == 2
    # The line above the view has the crosstalk and the pours; the view has the tools too.
    glance = live.page.inner_text("#glance")
    assert glance.startswith(live.page.locator("#estimate p.lead").inner_text())
    assert re.search(r" of filament\. Mix [0-9.]+ g of .*[a-z0-9]\.$", glance)
    radios = live.page.locator(".stage .choice label")
    assert radios.all_inner_texts() == ["Patch", "Moulds"]
    assert "along x" in live.page.inner_text('.stage select[name="axis"]')
    live.page.check('.stage input[value="moulds"]')
    shown = live.page.get_attribute(".stage-host", "data-shown").split()
    assert {tool.name for tool in patch_moulds(load_array(tomllib.loads(TEXT))).plan.tools} < set(shown)
    live.page.check('.stage input[value="unit"]')
    before = live.page.locator("#estimate img").first.get_attribute("src")
    live.choose('input[name="sheet.margin_mm"]', "5")
    assert "sheet along x 80 mm" in live.page.inner_text("#figures")
    assert live.page.locator("#estimate img").first.get_attribute("src") != before
    # The pitch has a slider that is followed while it is dragged, the number of columns one of whole numbers.
    pitch = live.page.locator('.field[data-path="layout.pitch_mm"] input[type="range"]')
    pitch.focus()
    live.pressed(pitch, "ArrowRight")
    assert live.page.input_value('input[name="layout.pitch_mm"]') == "20.2"
    columns = live.page.locator('.field[data-path="layout.columns"] input[type="range"]')
    columns.focus()
    live.pressed(columns, "ArrowLeft")
    assert "units 2" in live.page.inner_text("#figures")
    # A unit in the patch's place is called one.
    live.start_from("encapsulating")
    assert radios.all_inner_texts() == ["Unit", "Moulds"]
    assert "along the tail" in live.page.inner_text('.stage select[name="axis"]')
    # It is looked at as a whole, as the button does.
    seen = live.page.locator(".stage canvas").screenshot()
    live.page.get_by_role("button", name="corner").click()
    assert live.page.locator(".stage canvas").screenshot() == seen
    live.close()

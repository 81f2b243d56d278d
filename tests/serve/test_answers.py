"""What the page is told is what the commands give: the same findings, the same estimate, the same refusals."""

import base64
import json
import time
import tomllib
from pathlib import Path

import pytest
from msgspec import structs
from running import serving

from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_spec
from unitcad.moulds.heights import height_warnings
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import glb_content
from unitcad.serve.application import values_of
from unitcad.serve.messages import Answer, Field, Sweep
from unitcad.serve.unit_answers import ANSWERS
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.sweep import from_file
from unitcad.validation import load, templates


@pytest.mark.parametrize("name", sorted(templates()))
def test_answers_are_those_of_the_commands(server, name):
    text = templates()[name].read_text("utf-8")
    spec = load(name)
    moulds = MouldSet(spec)
    unit = server.ask(text)
    assert "faults" not in unit
    assert base64.b64decode(unit["model"]["unit"]) == glb_content(moulds, moulds.unit)
    judged = server.ask(text, "moulds")
    assert judged["checks"] == json.loads(json.dumps([finding.as_dict() for finding in check_moulds(moulds)]))
    assert base64.b64decode(judged["model"]["moulds"]) == glb_content(moulds, moulds.plan.tools)
    assert [*judged["lines"]][-2].startswith("print ")
    if name == "encapsulating":
        assert server.ask(text, "estimate")["estimate"] == json.loads(json.dumps(estimate_spec(spec)))


def test_the_moulds_come_with_the_printed_heights_and_their_warnings():
    answer, spec = Answer(text=""), load("encapsulating", ["moulds.first_layer_mm=0.35"])
    ANSWERS["moulds"](spec, answer)
    assert answer.lines[0] == "The unit comes out 4.55 mm high (drawn 4.61), caps 1.15 and 1.2."
    assert answer.warnings == height_warnings(MouldSet(spec))
    assert "layer 1's cap comes out 1.15 mm for 1.25 (8 %)" in answer.warnings[0]


def test_every_fault_is_told_with_its_line_and_what_would_do(server, text):
    edits = [{"path": "layers.0.wall_mm", "value": 0.1}, {"path": "fpcb.tail_width_mm", "value": 0.1}]
    answer = server.ask(text, "unit", edits)
    faults = {fault["field"]: fault for fault in answer["faults"]}
    assert set(faults) == {"layers.0.wall_mm", "fpcb.tail_width_mm"}
    lines = answer["text"].splitlines()
    assert "wall_mm" in lines[faults["layers.0.wall_mm"]["line"] - 1]
    fixed = [{"path": field, "value": fault["nearest"]} for field, fault in faults.items()]
    assert "faults" not in server.ask(answer["text"], "unit", fixed)
    # The form shows what was typed, refused or not.
    fields = {field["path"]: field for group in answer["groups"] for field in group["fields"]}
    assert fields["layers.0.wall_mm"]["value"] == 0.1


def test_a_text_that_is_no_toml_is_told_with_its_line(server, text):
    answer = server.ask(text.replace("diameter_mm =", "diameter_mm = ="))
    assert len(answer["faults"]) == 1
    assert "not TOML" in answer["faults"][0]["message"]
    assert answer["faults"][0]["line"] == next(
        i for i, line in enumerate(answer["text"].splitlines(), 1) if "= =" in line
    )
    longest = server.ask(text + "\nlong = " + "9" * 5000)
    assert "number of more than 1000 characters" in longest["faults"][0]["message"]
    assert longest["faults"][0]["line"] == len(text.splitlines()) + 2


def test_the_form_has_every_key_of_the_schema_with_its_range(server, text):
    groups = server.ask(text)["groups"]
    fields = {field["path"]: field for group in groups for field in group["fields"]}
    assert {"name", "design", "diameter_mm", "layers.0.wall_mm", "layers.1.material", "motor.part"} <= set(fields)
    assert {"moulds.printer", "casting.vacuum", "estimate.frequency_hz", "output.tolerance_mm"} <= set(fields)
    assert fields["layers.0.wall_mm"]["low"] == 0.5
    assert any(word == "dragon-skin-30" for word, _ in fields["layers.0.material"]["choices"])
    assert [group["title"] for group in groups if not group.get("present", True)] == ["Wires"]
    assert all(set(field) <= set(Field.__struct_fields__) for field in fields.values())


SMALL = templates()["single-embedded"].read_text("utf-8")


def test_a_build_is_that_of_the_command_and_can_be_cancelled(tmp_path):
    with serving(tmp_path, "single-embedded", "-o", "made") as own:
        quick = SMALL + '\n[output]\nformats = ["stl"]\n'
        state = json.loads(own.send("/build", {"text": quick})[1])
        assert own.send("/build", {"text": quick})[0] == 422  # one at a time
        state, stages = own.ended(state)
        assert state["code"] == 0
        assert (tmp_path / state["folder"] / "manifest.json").is_file()
        timed = json.loads((tmp_path / state["folder"] / "timings.json").read_text())["seconds"]
        assert set(stages) <= {"", "page", *timed}
        assert {"mould checks", "page"} <= set(stages)
        assert not any("stage" in line for line in state["lines"])
        status, _, headers = own.send(f"/files/{state['page']}")
        assert status == 200
        assert headers["content-security-policy"].startswith("sandbox ")
        state = json.loads(own.send("/build", {"text": quick.replace("14.0", "15.0")})[1])
        time.sleep(0.5)
        state = json.loads(own.send("/cancel", {"job": state["job"]})[1])
        assert state["ended"]
        assert state["code"] != 0
        assert len(list((tmp_path / "made").glob("single-embedded-*"))) == 1


def test_a_sweep_of_silicones_has_two_or_more_and_the_level_reads_it():
    asked = Sweep(text="", key="layers.0.material", words=["ecoflex-00-10", "dragon-skin-30", "ecoflex-00-10"])
    assert values_of(asked) == ["ecoflex-00-10", "dragon-skin-30"]
    with pytest.raises(Refusal, match="two values or more"):
        values_of(structs.replace(asked, words=["ecoflex-00-10"] * 2))
    assert values_of(Sweep(text="", key="moulds.vents", low=4, high=8, count=3)) == [4, 6, 8]
    data = {"base": "encapsulating", "sweep": {asked.key: values_of(asked)}}
    assert swept_estimate(from_file(data, Path(), "sweep"), 2).unread == []


def test_each_sweep_is_a_batch_beside_its_sweep_file(tmp_path):
    (tmp_path / "out" / "sweep-1").mkdir(parents=True)
    with serving(tmp_path) as own:
        quick = SMALL + "\n[output]\nformats = []\n"
        # At 3.0 the circuit's pad has to be smaller than the default for 2.5.
        message = {"text": quick, "key": "layers.0.wall_mm", "low": 2.0, "high": 3.0, "count": 2}
        state = json.loads(own.send("/sweep", message)[1])
        state, stages = own.ended(state)
        assert state["code"] == 0, state
        assert stages[0] == "0 of 2 variants"
        assert "1 of 2 variants" in stages or "2 of 2 variants" in stages
        assert stages[-1] == "page"
        assert state["page"].partition("/")[2] == "sweep-2/sweep/report.html"
        assert own.send(f"/files/{state['page']}")[0] == 200
    folder = tmp_path / "out" / "sweep-2"
    assert sorted(path.name for path in folder.iterdir()) == ["spec.toml", "sweep", "sweep.toml"]
    swept = from_file(tomllib.loads((folder / "sweep.toml").read_text()), folder, "sweep")
    assert swept.axes == {"layers.0.wall_mm": [2.0, 3.0]}
    # Defaults follow the key's values: the base is the text itself.
    assert (folder / "spec.toml").read_text() == quick

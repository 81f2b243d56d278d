"""`unitcad estimate` of arrays: the answer first, tables behind --details, layouts compared, what is refused."""

import json

import pytest
from typer.testing import CliRunner

from unitcad.arrays.array_file import load_array
from unitcad.arrays.circuit import circuit_files, has_circuit
from unitcad.arrays.crosstalk import crosstalk, crosstalk_files, crosstalk_lines, extras, ratios
from unitcad.cli import app
from unitcad.errors import Refusal

NINE, WIDE = "forearm-pockets", "--set=layout.pitch_mm=28"


def run(*words):
    found = CliRunner().invoke(app, ["estimate", *words], env={"COLUMNS": "200"})
    return found.exit_code, found.stdout, found.stderr


def test_the_answer_comes_first_and_the_tables_behind_details():
    code, out, _ = run(NINE)
    assert code == 0
    first, answer, *_ = out.splitlines()
    assert first.startswith("forearm-pockets: 9 units (encapsulating 14 mm), 125 Hz, flat drive, forearm")
    data = crosstalk(load_array(NINE))
    assert answer.strip() == crosstalk_lines(data)[0]
    assert "35 % (11 to 39) of a unit's motion at its edge reaches" in answer
    assert "its nearest neighbour (A1 to A2, 20 mm apart), and 59 %" in answer
    assert "B2 gets the most" in out
    assert "%" not in out.splitlines()[-1]
    _, more, _ = run(NINE, "--details", "--frequency", "150")
    assert "150 Hz" in more


def test_json_is_the_data_and_several_are_compared_with_the_first(tmp_path):
    code, out, _ = run(NINE, "--json")
    assert code == 0
    assert json.loads(out) == json.loads(json.dumps(crosstalk(load_array(NINE))))
    code, out, _ = run(NINE, "hex-19", "--json")
    both = json.loads(out)
    assert [one["array"] for one in both["arrays"]] == ["forearm-pockets", "hex-19"]
    (ratio,) = both["ratios"]
    one, other = both["arrays"]
    phases = [each["worst"]["worst_phases"]["value"] for each in (other, one)]
    assert ratio["worst_phases"] == pytest.approx(phases[0] / phases[1], rel=1e-5)
    assert ratio["nearest_centre"] == pytest.approx(1, abs=1e-4)
    _, text, _ = run(NINE, "hex-19")
    assert "hex-19 over forearm-pockets: nearest neighbour x 1.00" in text


def test_a_ratio_with_a_single_unit_is_none():
    one = load_array(NINE, ["layout.columns=1", "layout.rows=1", "sheet.strap_slot_mm=[3, 8]"])
    (ratio,) = ratios([crosstalk(one), crosstalk(load_array(NINE))])
    assert ratio["nearest_centre"] is None
    assert ratio["in_phase"] is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((NINE, "encapsulating"), "SPEC = 'encapsulating': is a unit"),
        ((NINE, "--model", "paper"), "--model = 'paper'"),
        ((NINE, "--set", "layout.pitch_mm=14"), "nearest accepted"),
    ],
)
def test_what_an_array_has_not_is_refused(words, said):
    found = CliRunner().invoke(app, ["estimate", *words])
    assert isinstance(found.exception, Refusal)
    assert said in str(found.exception)


def test_an_estimate_reads_no_tail():
    """At 16 mm a tail of 10 mm finds no way between nine units: a build is refused, the crosstalk is not."""
    close = ("--set", "layout.pitch_mm=16", "--set", "sheet.strap_slot_mm=[3,8]")
    with pytest.raises(Refusal, match="finds no straight way"):
        load_array(NINE, ["layout.pitch_mm=16", "sheet.strap_slot_mm=[3,8]"])
    _, text, _ = run(NINE, *close, "--json")
    assert json.loads(text)["nearest"]["distance_mm"] == 16


def test_the_files_of_crosstalk_and_circuit():
    array = load_array(NINE)
    assert not has_circuit(array)
    assert circuit_files(array) == ({}, {})
    files = crosstalk_files(array)
    assert set(files) == {
        "crosstalk.json",
        "crosstalk.csv",
        "crosstalk.svg",
        "crosstalk-patch.svg",
    }
    joined = load_array("forearm-patch", ["output.formats=[]"])
    made, why = circuit_files(joined)
    assert set(made) == {"circuit.dxf", "circuit.svg", "circuit-pads.csv"}
    assert why == {}
    assert b"<title>circuit</title>" in crosstalk_files(joined)["crosstalk-patch.svg"]


def test_without_ezdxf_the_other_files_are_made_and_the_dxf_says_why(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ezdxf", None)
    made, why = circuit_files(load_array("forearm-patch"))
    assert "circuit.svg" in made
    assert "ezdxf" in why["circuit.dxf"]


def test_units_without_an_estimate_have_no_crosstalk_and_the_reason_is_told():
    place = [{"at": "A1", "unit": {"like": "encapsulating", "estimate": {"tissue": "gel-50kpa"}}}]
    files, lacking = extras(load_array({**load_array(NINE).asked, "place": place}), ["estimate"])
    assert files == {}
    assert "one tissue" in lacking["crosstalk.json"]

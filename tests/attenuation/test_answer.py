"""What leads an estimate: two lines with level, range and the paper's model; the details; levels in per cent."""

import json
import re

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

from unitcad.attenuation.edge.estimates import percent
from unitcad.attenuation.edge.models import assessments, stored
from unitcad.cli import app
from unitcad.designs import design_of
from unitcad.estimate_inputs import estimate_spec
from unitcad.validation import load, templates


def lead(spec, *changes):
    return estimate_spec(load(spec, changes))["answer"]


def test_a_unit_that_was_measured_leads_with_the_measurement_and_a_range():
    found = lead("encapsulating")
    assert found["headline"] == (
        "5.2 % of the motor's amplitude at the edge (measured in the paper). "
        f"Expect {100 * found['p10']:.2g} to {100 * found['p90']:.2g} %."
    )
    source = " By a rule fitted to nine measured levels; the paper states neither their surface nor axis."
    assert found["lines"][0] == found["headline"] + source
    assert [one["level"] for one in found["measured"]] == [0.0517, 0.0458]
    assert found["level"] == 0.0517
    assert "Also measured: 4.58 %." in found["details"]


def test_a_unit_that_nobody_measured_names_the_nearest():
    found = lead("embedded", "layers.0.wall_mm=1.3")
    assert found["measured"] == []
    assert found["level"] == found["p50"]
    assert found["headline"].startswith(f"{100 * found['p50']:.2g} % of the motor's amplitude at the edge. Expect ")
    assert found["lines"][0].endswith("Nearest measured: embedded E10/D30, 15.6 %.")
    assert any("This unit differs in walls: the range is wider for it" in line for line in found["details"])


def test_the_second_line_is_the_papers_model_with_its_error_and_the_baselines():
    found, scores = lead("embedded"), assessments()
    data = estimate_spec(load("embedded"))
    for name in ("published", "corrected"):
        level = data["models"][name]["edge_level"]["value"]
        assert found["analytic"][name]["value"] == level
        assert f"{100 * level:.2g} %" in found["lines"][1]
    published, baseline = (scores[name].leave_one_out.geometric_mean for name in ("published", "baseline"))
    assert f"error: factor {published:.2f}; baseline, the means of four classes: {baseline:.2f}." in found["lines"][1]
    assert "its path of u_z through the walls" in found["lines"][1]


def test_the_answer_does_not_depend_on_the_models_that_are_asked_for():
    every, one = lead("embedded"), lead("embedded", 'estimate.models=["divider"]')
    assert one == every


def test_the_rules_error_and_how_often_its_ranges_held_are_in_the_details():
    found, best = lead("embedded"), assessments()["rule"].leave_one_out
    assert (found["model"], found["coverage"]) == ("rule", 8)
    assert (found["typical_error"], found["worst_error"]) == pytest.approx((best.geometric_mean, best.worst), rel=1e-6)
    assert "baseline: 1.3" in found["details"][0]
    assert "Coverage of the 80 % range: 8 of 9" in found["details"][1]


def test_how_many_ranges_held_is_counted_again():
    """A rule fitted to eight units by least squares; its scale from their own left-out residuals."""
    y = np.log([0.4518, 0.395, 0.6018, 0.0886, 0.156, 0.609, 0.04, 0.0517, 0.671])
    x = np.stack([np.ones(9), [0, 0, 0, 1, 1, 0, 2, 2, 0]], axis=1)

    def out(rows, i):
        kept = rows[rows != i]
        return y[i] - x[i] @ np.linalg.lstsq(x[kept], y[kept], rcond=None)[0]

    held = 0
    for i in range(9):
        others = np.delete(np.arange(9), i)
        scale = np.sqrt(sum(out(others, j) ** 2 for j in others) / 7)
        held += abs(out(np.arange(9), i)) <= scale * stats.t.ppf(0.9, 6)
    assert lead("embedded")["coverage"] == held


def test_one_material_units_are_said_to_be_one_level():
    found = lead("single-embedded")
    assert any("same level; 39.5, 45.2 and 60.2 % were measured" in line for line in found["details"])
    assert not any("same level" in line for line in lead("embedded")["details"])


def test_without_a_level_the_reason_leads():
    found = lead("embedded", "layers.0.material=ecoflex-00-50")
    assert (found["model"], found["level"], found["p10"]) == (None, None, None)
    assert found["lines"][0].startswith("Not known: ecoflex-00-50 youngs_modulus")
    assert found["lines"][1].startswith("The paper's analytic model gives no number: ecoflex-00-50")


def test_a_modulus_that_is_a_range_gives_a_range_alone():
    found = lead("embedded", "layers.0.material=ecoflex-00-30")
    assert found["level"] is None
    assert re.match(r"Expect \d\d to \d\d % of the motor's", found["lines"][0])
    s, q = stored()["rule"].values()
    assert found["p10"] < s * q
    assert found["p90"] > s  # the range holds both ends


def test_a_range_above_every_measured_level_says_so():
    found = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10")
    assert found["p90"] > 0.671
    assert "(above the highest level that the paper prints as a number, 67 %)" in found["headline"]
    assert "no measured level" not in lead("embedded")["headline"]


def test_what_is_next_to_nothing_is_not_called_nothing():
    assert percent(1.3e-10) == "below 0.01 %"
    assert percent(0.0) == "below 0.01 %"
    assert percent(0.0204) == "2.0 %"
    far = lead("encapsulating", "estimate.frequency_hz=1000")
    assert not any(re.search(r"\b0 %|e-\d", line) for line in [*far["lines"], *far["details"]])


@pytest.mark.parametrize("name", templates())
def test_no_sentence_has_a_fraction_for_a_level_or_a_long_number(name):
    if design_of(load(name)).passes is None:
        pytest.skip("no model of this design")
    found = lead(name)
    for line in [*found["lines"], *found["details"]]:
        assert not re.search(r"\d\.\d{3}|\d\d\.\d\d|e-\d", line), line
        assert not re.search(r"\b0\.0[02-9]", line), line


def test_the_command_leads_with_two_lines_and_keeps_the_rest_for_details():
    run = CliRunner().invoke
    plain = run(app, ["estimate", "embedded"]).output
    assert len(plain.splitlines()) < 10
    found = lead("embedded")
    for line in found["lines"]:
        assert line in plain
    full = run(app, ["estimate", "embedded", "--details"]).output
    tables = ("error against the table", "|u| of the skin, % of that", "input + 1 %", "% of an", "leave-one-class-out")
    for words in tables:
        assert words not in plain
        assert words in full
    for line in found["details"]:
        assert line not in plain
        assert line in full


def test_a_build_ends_with_the_two_lines(tmp_path):
    shown = CliRunner().invoke(app, ["build", "embedded", "--only", "estimate", "-o", str(tmp_path)]).output
    manifest = json.loads(next(tmp_path.rglob("manifest.json")).read_text("utf-8"))
    assert manifest["estimate"]["lines"] == lead("embedded")["lines"]
    for line in manifest["estimate"]["lines"]:
        assert any(line in one for one in shown.splitlines())


def test_a_unit_too_far_from_the_measured_ones_gets_no_level():
    far = lead("embedded", "diameter_mm=300")
    assert far["too_far"]
    assert far["level"] is None
    assert far["headline"].startswith("No level: this unit is too far from the measured ones")
    assert lead("three-layer")["level"] is not None


def test_what_the_paper_prints_of_a_unit_without_a_level_is_in_the_first_line():
    """187.7 % of one of the controls, 39.5 to 60.2 %."""
    stiff = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=dragon-skin-10-medium")
    assert "187.7 % of a control that it does not name for this unit: 74 to 110 %." in stiff["lines"][0]
    soft = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10")
    assert "The paper states of this unit: amplifies slightly more than D30/D10." in soft["lines"][0]

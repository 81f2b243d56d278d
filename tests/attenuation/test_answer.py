"""The answer: one typed object, its one line, what widens or voids its range, and how two answers are compared."""

import json
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

import unitcad
from unitcad.attenuation.edge.answer import WIDEST
from unitcad.attenuation.edge.scores import scores
from unitcad.attenuation.edge.scoring import assessments, choice
from unitcad.attenuation.edge.words import ANY_FORM, NO_EFFECT, comparison, details, effect, first_line, lines, percent
from unitcad.cli import app
from unitcad.designs import design_of
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec, estimate_spec
from unitcad.spec import to_toml
from unitcad.validation import from_data, load, read, templates


def lead(spec, *changes):
    return answer_spec(load(spec, changes))


def told(one, layers=2):
    return list(details(one, layers, "small-strain", {}))


def test_the_first_line_of_a_measured_unit():
    found = lead("encapsulating")
    assert first_line(found) == (
        "Level at the edge: 4.6 % of the motor's amplitude (3.1 to 6.8). Measured in the paper for this unit: 5.2 %."
    )
    assert [one.level for one in found.measured] == [0.0517, 0.0458]
    assert "Also measured: 4.58 %." in told(found)
    assert found.wider == ()


def test_every_place_prints_the_one_object(tmp_path):
    """Command, JSON, build, manifest, Python, and the row of a batch."""
    one = lead("embedded", "layers.0.wall_mm=1.3")
    line, numbers = first_line(one), [one.level, one.low, one.high]
    run = CliRunner().invoke
    changed = ["embedded", "--set", "layers.0.wall_mm=1.3"]
    assert line in run(app, ["estimate", *changed]).output
    data = json.loads(run(app, ["estimate", *changed, "--json"]).output)["answer"]
    assert data["line"] == line
    assert [data[key] for key in ("level", "low", "high")] == pytest.approx(numbers, rel=1e-8)
    shown = run(app, ["build", *changed, "--only", "estimate", "-o", str(tmp_path)]).output
    assert any(line in each for each in shown.splitlines())
    (manifest,) = (json.loads(path.read_text("utf-8")) for path in tmp_path.rglob("manifest.json"))
    assert manifest["estimate"]["line"] == line
    assert [manifest["estimate"][key] for key in ("level", "low", "high")] == pytest.approx(numbers, rel=1e-8)
    python = unitcad.estimate("embedded", set={"layers.0.wall_mm": 1.3})
    assert str(python) == line
    assert line in repr(python)
    assert [python.level, python.low, python.high] == pytest.approx(numbers, rel=1e-8)
    assert python.measured is None
    assert unitcad.estimate("embedded").measured == 0.156


def test_the_level_is_the_rules_next_to_the_measurement():
    """A wall of 1.251 mm in place of 1.25 moves nothing: the measurement never replaces the level."""
    exact, nearly = lead("embedded"), lead("embedded", "layers.0.wall_mm=1.251")
    assert nearly.level == pytest.approx(exact.level, rel=1e-3)
    assert (exact.measured[0].level, nearly.measured) == (0.156, ())


def test_the_lines_of_an_estimate():
    found, score = lead("embedded"), assessments()["published"].leave_one_out.geometric_mean
    level, source, analytic = lines(found)
    assert level == first_line(found)
    assert source == (
        "The level is that of a rule fitted to 9 measured units. It misses a unit that it was not fitted to by "
        f"{ANY_FORM}."
    )
    published = 100 * estimate_spec(load("embedded"))["models"]["published"]["edge_level"]["value"]
    error = f"a factor of {score:.1f}"
    assert analytic == f"The paper's analytic model gives {published:.2g} %. It misses a measured unit by {error}."
    scored = [assessments()[name].leave_one_out.geometric_mean for name in ("rule", "baseline")]
    scored.append(choice().score.geometric_mean)
    assert f"a factor of about {min(scored):.1f} to {max(scored):.1f}, whatever the form of the rule" == ANY_FORM


def test_a_range_that_prints_the_same_is_not_said_to_be_wider():
    """A draft of 3 degrees changed no digit, and the sentence said "wider range"."""
    usual, near, far = (
        answer_spec(load("encapsulating", change)) for change in ([], ["moulds.draft_deg=3"], ["diameter_mm=16"])
    )
    assert first_line(near).split(". ")[0] == first_line(usual).split(". ")[0]
    assert near.wider == ()
    assert "diameter" in far.wider


def test_the_answer_does_not_depend_on_the_models_that_are_asked_for():
    every, one = (
        estimate_spec(load("embedded", change))["answer"] for change in ([], ['estimate.models=["published"]'])
    )
    assert one == every


def test_a_build_shows_the_level_alone(tmp_path):
    shown = CliRunner().invoke(app, ["build", "embedded", "--only", "estimate", "-o", str(tmp_path)]).output
    assert first_line(lead("embedded")) in shown
    assert "analytic" not in shown


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
    assert lead("embedded").source.coverage == held == 8
    assert "Coverage of the 80 % range: 8 of 9" in told(lead("embedded"))[1]


def test_one_material_units_are_said_to_be_one_level():
    assert any("same level; 39.5, 45.2 and 60.2 % were measured" in line for line in told(lead("single-embedded"), 1))
    assert not any("same level" in line for line in told(lead("embedded")))


def test_a_silicone_without_any_modulus_has_no_level():
    data = read("embedded")
    data["materials"] = {"blend": {**RAW, "status": "spec", "source": "made up"}}
    data["layers"][0]["material"] = "blend"
    found = answer_spec(from_data(data))
    assert (found.level, found.low, found.high) == (None, None, None)
    assert first_line(found) == "No level at the edge: no modulus of blend is known."
    assert lines(found)[1].startswith("The paper's analytic model gives no number: blend")


RAW = {
    "density_g_cm3": 1.0, "mixed_viscosity_cps": 1000, "pot_life_min": 30, "cure_h": 4, "shore": "00-20",
    "modulus_100pct_kpa": 50, "tensile_mpa": 1.0, "elongation_pct": 800, "casting_floor_mm": 1.0,
    "poisson_ratio": 0.49, "loss_factor": 0.2, "mix_ratio": 1.0,
}  # fmt: skip


def test_a_silicone_with_a_slow_pull_alone_has_a_wider_range():
    known, slow = lead("embedded"), lead("embedded", "layers.0.material=ecoflex-00-50")
    assert slow.high / slow.low > 1.1 * known.high / known.low
    assert "silicones" in slow.wider
    assert lines(slow)[2].startswith("The paper's analytic model gives no number: ecoflex-00-50")


def test_a_range_beyond_every_measured_level_names_the_highest():
    found = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10")
    assert found.high > 0.671
    assert found.above == 0.671
    assert "The highest measured level is 67 %." in first_line(found)
    assert lead("embedded").above is None


def test_what_is_next_to_nothing_is_not_called_nothing():
    assert percent(1.3e-10) == "below 0.01 %"
    assert percent(0.0) == "below 0.01 %"
    assert percent(0.0204) == "2.0 %"
    far = lead("encapsulating", "estimate.frequency_hz=1000")
    assert not any(re.search(r"\b0 %|e-\d", line) for line in [*lines(far), *told(far)])


@pytest.mark.parametrize("name", templates())
def test_no_sentence_has_a_fraction_for_a_level_or_a_long_number(name):
    if design_of(load(name)).passes is None:
        pytest.skip("no model of this design")
    found = lead(name)
    for line in [*lines(found), *told(found)]:
        assert not re.search(r"\d\.\d{3}|\d\d\.\d\d|e-\d", line), line
        assert not re.search(r"\b0\.0[02-9]", line), line


def test_the_command_leads_with_the_lines_and_keeps_the_rest_for_details():
    run = CliRunner().invoke
    plain = run(app, ["estimate", "embedded"]).output
    assert len(plain.splitlines()) < 10
    for line in lines(lead("embedded")):
        assert line in plain
    full = run(app, ["estimate", "embedded", "--details"]).output
    for words in (
        "error against the table",
        "|u| of the skin, % of that",
        "input + 1 %",
        "% of an",
        "leave-one-class-out",
    ):
        assert words not in plain
        assert words in full
    for line in told(lead("embedded")):
        assert line not in plain
        assert line in full


def test_a_unit_too_far_from_the_measured_ones_gets_a_range_and_no_level():
    far = lead("embedded", "diameter_mm=300")
    assert far.level is None
    assert far.high > WIDEST * far.low
    assert first_line(far).startswith("No level at the edge: the range is too wide, ")
    assert "Wider range: no measured unit had its diameter." in first_line(far)
    assert lead("three-layer").level is not None


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        (["skin_mm=1"], "film on the skin side"),
        (["motor.lip_mm=0.5"], "lip"),
        (["motor.fill=true"], "silicone round the motor"),
        (["estimate.tissue=gel-50kpa"], "tissue"),
        (["motor.drive=axial"], "axial drive"),
        (["diameter_mm=16"], "diameter"),
        (["layers.0.wall_mm=1.8"], "walls"),
        (["layers.0.cap_mm=2"], "caps"),
        (["estimate.frequency_hz=200"], "frequency"),
    ],
)
def test_what_widens_a_range_stands_in_the_first_line(changes, name):
    plain, found = lead("encapsulating"), lead("encapsulating", *changes)
    assert name in found.wider
    assert re.search(rf"Wider range: no measured unit had its [^.]*{name}", first_line(found))
    assert found.high / found.low > plain.high / plain.low
    assert found.measured == ()


def test_features_widen_as_much_as_they_do():
    """A thin film does little, an axial drive leaves no level; both enter by one mechanism, without a step."""
    widths = [
        np.log(one.high / one.low)
        for one in (lead("encapsulating", f"skin_mm={mm}") for mm in (0.3, 0.5, 1.0, 2.0, 4.0))
    ]
    assert np.all(np.diff(widths) > 0)
    assert widths[0] < 1.02 * np.log(lead("encapsulating").high / lead("encapsulating").low)
    assert lead("encapsulating", "motor.drive=axial").level is None
    own = ["tissue.mine.skin.density_kg_m3=1100", "tissue.mine.skin.poisson_ratio=0.49", "estimate.tissue=mine"]
    softer = lead("encapsulating", *own, "tissue.mine.skin.youngs_modulus_kpa=30")
    stiffer = lead("encapsulating", *own, "tissue.mine.skin.youngs_modulus_kpa=3e8")
    assert stiffer.level is None
    assert softer.level is not None


@pytest.mark.parametrize("name", ["dome", "strap-lugs"])
def test_a_custom_design_has_no_level_by_the_same_mechanism(name):
    spec = load(f"custom/{name}")
    found = answer_spec(spec)
    assert first_line(found).startswith("No level at the edge: the rule knows embedded and encapsulating units only.")
    shown = CliRunner().invoke(app, ["estimate", f"custom/{name}"])
    assert first_line(found) in shown.output
    assert shown.output.count(found.reason) == 1
    assert "The paper's analytic model gives no number either." in shown.output
    assert shown.exit_code == 0
    data = estimate_spec(spec)
    json.dumps(data, allow_nan=False)
    assert data["layered"]["drives"]
    assert all(block["edge_level"]["low"] is None for block in data["models"].values())


def test_a_custom_design_that_states_its_passes_has_a_wider_range(tmp_path):
    (tmp_path / "own.py").write_text(
        "from dataclasses import replace\nfrom unitcad.designs.encapsulating import DESIGN\n"
        "OWN = replace(DESIGN, name='own', tooling='complement')\n"
    )
    text = to_toml(load("encapsulating")).replace('design = "encapsulating"', 'design = "own.py:OWN"')
    (tmp_path / "own.toml").write_text(text)
    found, shipped = answer_spec(load(str(tmp_path / "own.toml"))), lead("encapsulating")
    assert "shape of its own" in found.wider
    assert found.measured == ()
    assert found.high / found.low > 2 * shipped.high / shipped.low


def test_what_the_paper_prints_of_a_unit_without_a_level_is_in_the_first_line():
    """187.7 % of one of the controls, 39.5 to 60.2 %."""
    stiff = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=dragon-skin-10-medium")
    assert "The paper prints 187.7 % of a control that it does not name: 74 to 110 %." in first_line(stiff)
    soft = lead("embedded", "layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10")
    assert "The paper states of this unit: amplifies slightly more than D30/D10." in first_line(soft)


def test_two_answers_are_compared_model_against_model():
    base = lead("encapsulating")
    for change in ("layers.0.wall_mm=1.5", "diameter_mm=16", "motor.part=VC0720B001F"):
        other = lead("encapsulating", change)
        assert effect(other, base) == NO_EFFECT, change
    assert effect(lead("embedded"), base) == "a factor of 3.3"
    assert effect(lead("encapsulating", "motor.drive=axial"), base) == "not compared: a level is not known"
    bands = comparison([("a", base), ("b", lead("three-layer"))])
    assert bands[0]["no measured unit had its"] == "-"
    assert bands[1]["no measured unit had its"] == "silicones, walls, caps and diameter"


def test_several_units_are_a_table_and_a_dot_plot(tmp_path):
    svg = tmp_path / "levels.svg"
    shown = CliRunner().invoke(app, ["estimate", "encapsulating", "embedded", "--svg", str(svg)]).output
    cells = [[cell.strip() for cell in line.split("│")[1:-1]] for line in shown.splitlines() if "│" in line]
    assert cells == [
        ["encapsulating", "4.6 (3.1 to 6.8)", "5.2", "-"],
        ["embedded", "15 (10 to 22)", "16", "a factor of 3.3"],
    ]
    assert shown.count("fitted to 9 measured units") == 1  # the model once, not a line a unit
    drawn = ElementTree.fromstring(svg.read_text())
    place = {name: [one for one in drawn.iter() if one.tag.endswith(name)] for name in ("circle", "polygon", "text")}
    ticks = {
        float(one.text): float(one.get("x"))
        for one in place["text"]
        if one.text.replace(".", "").isdigit()
    }  # fmt: skip
    # The dots, after that of the key, lie where the axis has the answers' levels.
    low, high = min(ticks), max(ticks)
    for dot, one in zip(place["circle"][1:], (lead("encapsulating"), lead("embedded")), strict=True):
        share = math.log(100 * one.level / low) / math.log(high / low)
        assert float(dot.get("cx")) == pytest.approx(ticks[low] + share * (ticks[high] - ticks[low]), abs=0.1)
    assert len(place["polygon"]) == 1 + 2
    again = tmp_path / "again.svg"
    CliRunner().invoke(app, ["estimate", "encapsulating", "embedded", "--json", "--svg", str(again)])
    assert again.read_bytes() == svg.read_bytes()
    refused = CliRunner().invoke(app, ["estimate", "encapsulating", "--svg", str(tmp_path / "a.png")])
    assert isinstance(refused.exception, Refusal)


def test_the_stored_scores_lead_to_the_same_answer_as_scores_made_anew():
    found = scores()
    assert found.lead.model == "rule"
    assert found.models["rule"].leave_one_out.geometric_mean == pytest.approx(
        assessments()["rule"].leave_one_out.geometric_mean, rel=1e-5
    )

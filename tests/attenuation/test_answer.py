"""What leads an estimate: the level to go by, its errors, what was measured, what is not read, the null; per cent."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from unitcad.attenuation.edge.answer import answer
from unitcad.attenuation.edge.fitted_models import assessments
from unitcad.attenuation.edge.predictive import HELD, STACKED, predictive_of
from unitcad.cli import app
from unitcad.estimating import estimate_input, estimate_spec
from unitcad.text import listed
from unitcad.validation import load, templates


def lead(spec: str, *changes: str) -> dict[str, Any]:
    return estimate_spec(load(spec, changes))["answer"]


def test_the_best_by_the_left_out_score_leads_with_its_errors() -> None:
    found, scores = lead("embedded", "layers.0.wall_mm=1.3"), assessments()
    assert found["model"] == min(
        ("bush", "fitted", "paper", "consistent"), key=lambda m: scores[m].left_out.geometric_mean
    )
    best = scores[found["model"]].left_out
    assert (found["typical_error"], found["worst_error"]) == pytest.approx((best.geometric_mean, best.worst))
    first = found["lines"][0]
    assert f"{100 * found['level']:.2g} % of the motor's amplitude" in first
    assert f"factor of {best.geometric_mean:.2g}, at worst {best.worst:.2g}" in first
    assert found["measured"] == []
    assert found["lines"][1].endswith("15.6 and 15.7 %; this unit differs in walls.")


def test_a_unit_that_was_measured_leads_with_the_measurement() -> None:
    found = lead("encapsulating")
    assert found["lines"][0].startswith(
        "5.17 % of the motor's amplitude at the edge, measured in the paper (also 4.58 %"
    )
    assert [one["level"] for one in found["measured"]] == [0.0517, 0.0458]
    assert "The model bush expects" in found["lines"][0]


def test_the_null_is_named_beside_each_model_that_it_beats_and_no_other() -> None:
    found, scores = lead("embedded"), assessments()
    null = scores["null"].left_out.geometric_mean
    worse = [m for m in ("bush", "fitted", "paper", "consistent") if scores[m].left_out.geometric_mean > null]
    assert sorted(found["better_null"]) == sorted(worse)
    others = next(line for line in found["lines"] if line.startswith("Other models"))
    told = {part.split()[0]: part for part in others.removeprefix("Other models: ").split("); ")}
    for model, part in told.items():
        assert ("the null's" in part) == (model in worse), part
    alone = lead("embedded", 'estimate.models=["paper"]')
    assert "does better: x 1.5" in alone["lines"][0]


def test_what_the_model_does_not_read_is_said_in_words() -> None:
    """The divider reads two moduli; nothing of the body is read by any closed form."""
    found = lead("embedded", 'estimate.models=["fitted"]')
    assert "walls" in found["not_seen"]
    assert "moduli" not in found["not_seen"]
    assert "body" in found["not_seen"]
    changed = lead("embedded", 'estimate.models=["fitted"]', "layers.0.wall_mm=1.5")
    assert changed["level"] == found["level"]
    assert "walls" not in lead("embedded", 'estimate.models=["bush"]')["not_seen"]


def test_a_layer_that_alone_is_not_read_is_named_by_its_place() -> None:
    """Layer 1 reaches the motor whatever its wall, if it fills the gap."""
    found = lead("encapsulating", "motor.fill=true")
    assert found["model"] == "bush"
    assert "layers.0.wall_mm" in found["not_seen"]


def test_a_model_of_another_drive_does_not_lead() -> None:
    found = lead("embedded", "motor.drive=axial")
    assert found["model"] == "fitted"
    assert "bush" not in found["weights"]


def test_without_a_level_the_reason_leads() -> None:
    found = lead("embedded", "layers.0.material=ecoflex-00-50")
    assert found["model"] is None
    assert found["lines"][0].startswith("Not known: ecoflex-00-50 youngs_modulus")


def test_a_range_without_a_value_is_a_range() -> None:
    found = lead("embedded", "layers.0.material=ecoflex-00-30")
    assert found["level"] is None
    assert re.match(r"\d\d to \d\d % of the motor's", found["lines"][0])


def test_a_range_whose_ends_round_alike_is_one_number_and_two_digits_are_kept() -> None:
    data = estimate_spec(load("embedded", ["layers.0.wall_mm=1.3"]))
    data["models"]["bush"]["edge_level"] = {"value": None, "low": 0.4512, "high": 0.4538}
    data["models"]["fitted"]["edge_level"] = {"value": 0.02, "low": 0.013, "high": 0.047}
    data["models"]["paper"]["edge_level"] = {"value": None, "low": 0.02, "high": 0.047}
    first, *rest = answer(data, None)["lines"]
    assert first.startswith("45 % of the motor's amplitude at the edge, by bush.")
    others = next(line for line in rest if line.startswith("Other models"))
    assert "fitted 2.0 % (" in others
    assert "paper 2.0 to 4.7 % (" in others


@pytest.mark.parametrize("name", templates())
def test_no_sentence_has_a_fraction_for_a_level_or_a_long_number(name: str) -> None:
    for line in lead(name)["lines"]:
        assert not re.search(r"\d\.\d{3}|\d\d\.\d\d|e-\d", line), line
        assert not re.search(r"\b0\.0\d", line), line


def test_a_lab_s_fit_orders_by_its_own_scores() -> None:
    data = estimate_spec(load("embedded"))
    names = ("bush", "fitted", "paper", "consistent", "null")
    scores = dict(zip(names, (1.6, 1.5, 1.2, 1.4, 1.3), strict=True))
    data["fit"] = {"name": "ours", "left_out": {name: {"geometric_mean": one} for name, one in scores.items()}}
    data["own_measured"] = [{"unit": "U1", "value": 0.098, "low": 0.09, "high": 0.107}]
    found = answer(data, None)
    assert found["model"] == "paper"
    assert sorted(found["better_null"]) == ["bush", "consistent", "fitted"]
    first = found["lines"][0]
    assert first.startswith("9.8 % (9 to 10.7) of the motor's amplitude at the edge, measured on U1")
    assert "80 %" not in first
    assert "units of the fit ours" in first


def test_levels_of_one_source_are_named_together() -> None:
    data = estimate_spec(load("encapsulating"))
    data["own_measured"] = [{"unit": "U1", "value": 0.098, "low": 0.09, "high": 0.107}]
    first = answer(data, None)["lines"][0]
    assert "measured on U1 (also 5.17 % and 4.58 % in the paper)." in first


def test_the_range_is_that_of_the_stacked_models() -> None:
    """Its ends against the mixture's probability, counted in draws from each model's distribution."""
    found = lead("embedded", "layers.0.wall_mm=1.3")
    expected = predictive_of([estimate_input(load("embedded", ["layers.0.wall_mm=1.3"]))])
    assert found["weights"] == pytest.approx(dict(zip(expected.models, expected.weights, strict=True)))
    random = np.random.default_rng(7)
    which = random.choice(len(expected.models), 200_000, p=expected.weights)
    t = random.standard_t(expected.degrees_of_freedom[which])
    levels = np.exp(expected.centre[0, which] + expected.scale[0, which] * t)
    for key, share in (("p10", 0.1), ("p50", 0.5), ("p90", 0.9)):
        assert np.mean(levels <= found[key]) == pytest.approx(share, abs=0.004)
    told = (
        f"The 80 % range by bush and crossings is {100 * found['p10']:.2g} to {100 * found['p90']:.2g} % (6 of the nine"
    )
    assert told in found["lines"][0]


def test_how_many_ranges_held_is_said_of_all_models_together() -> None:
    assert lead("embedded")["held"] == HELD[STACKED]
    assert lead("embedded", 'estimate.models=["paper"]')["held"] is None


@pytest.mark.parametrize(
    ("spec", "changes", "new"),
    [
        ("encapsulating", (), []),
        ("single-embedded", (), []),
        ("encapsulating", ("layers.0.wall_mm=2.0",), ["walls"]),
        ("encapsulating", ("layers.0.cap_mm=1.5",), ["caps"]),
        ("embedded", ("diameter_mm=17",), ["diameter"]),
        ("embedded", ("layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10"), []),
        ("embedded", ("layers.0.material=ecoflex-00-30",), ["silicones"]),
    ],
)
def test_what_no_measured_unit_had_is_said_with_the_error(spec: str, changes: tuple[str, ...], new: list[str]) -> None:
    found = lead(spec, *changes)
    assert found["not_measured"] == new
    assert ("how far off bush is here is not known" in found["lines"][0]) == bool(new)
    if new:
        assert f"None of them is like this one in {listed(new)}:" in found["lines"][0]


def test_a_range_needs_every_input() -> None:
    assert lead("embedded", "layers.0.material=ecoflex-00-50")["p10"] is None


def test_the_command_leads_with_the_answer_and_keeps_tables_for_details() -> None:
    run = CliRunner().invoke
    plain = run(app, ["estimate", "embedded"]).output
    assert len(plain.splitlines()) < 10
    for line in lead("embedded")["lines"]:
        assert line in plain
    full = run(app, ["estimate", "embedded", "--details"]).output
    for words in ("error against the table", "|u| of the skin, % of that", "1 % more of", "% of an"):
        assert words not in plain
        assert words in full


def test_a_build_ends_with_the_answer(tmp_path: Any) -> None:
    done = CliRunner().invoke(app, ["build", "embedded", "--only", "estimate", "-o", str(tmp_path), "--json"])
    found = json.loads(done.output)["variants"][0]["manifest"]["estimate"]
    assert found["model"] == "bush"
    shown = CliRunner().invoke(app, ["build", "embedded", "--only", "estimate", "-o", str(tmp_path)]).output
    assert f"embedded: {found['answer']}" in shown.splitlines()
    assert found["answer"] == lead("embedded")["lines"][0]

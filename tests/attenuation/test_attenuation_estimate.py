"""The estimate as data and as a command: the contract, nulls with reasons, measured values, spread, the same bytes."""

import json
import math
import re

import numpy as np
import pytest
from msgspec import structs
from typer.testing import CliRunner

from tests.in_process import unitcad
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.estimates import summary
from unitcad.attenuation.edge.level import corners
from unitcad.attenuation.edge.models import edge_levels
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.validation import load

SOFT, MEDIUM, STIFF = "ecoflex-00-10", "dragon-skin-10-medium", "dragon-skin-30"


def pair(design, inner, outer, *more):
    return load(design, [f"layers.0.material={inner}", f"layers.1.material={outer}", *more])


@pytest.fixture(scope="module")
def encapsulating():
    return estimate_spec(load("encapsulating"))


def test_contract(encapsulating):
    assert list(encapsulating) == ["variant", "answer", "models", "layered", "measured", "table_error", "assumptions"]
    assert list(encapsulating["models"]) == ["rule", "published", "corrected"]
    for block in encapsulating["models"].values():
        assert {"edge_level", "hierarchical_over_control", "table_error", "assumptions"} <= set(block)
        assert {"levels", "ratios", "directions", "leave_one_out"} <= set(block["table_error"])
        level = block["edge_level"]
        assert level["low"] <= level["value"] <= level["high"]
        assert [one["control"] for one in block["hierarchical_over_control"]] == [SOFT, STIFF]
    assert "baseline" in encapsulating["table_error"]
    assert "sideways force" in encapsulating["assumptions"][0]
    text = json.dumps(encapsulating, allow_nan=False)
    assert "validated" not in text.lower()
    assert json.loads(text) == encapsulating


def test_level_is_the_array_function_at_nominal_values(encapsulating):
    e, rho = [15e3, 355e3], [1040.0, 1080.0]
    units = Units(e, rho, [0.4999] * 2, [0.2] * 2, [1.25e-3] * 2, 2 * math.pi * 125, 2.0)
    for model, block in encapsulating["models"].items():
        assert block["edge_level"]["value"] == pytest.approx(float(edge_levels(units, model)), rel=1e-8)
        amplitude = block["edge_amplitude_um"]["value"]
        assert amplitude == pytest.approx(300 * block["edge_level"]["value"], rel=1e-8)


def test_constraints(encapsulating):
    paper = encapsulating["models"]["published"]
    rows = [(row["equation"], row["control"]) for row in paper["constraints"]]
    first = [(name, SOFT) for name in ("5a", "5b", "6a", "6b")]
    assert rows == [*first, ("6c", None), ("6d", None), *((name, STIFF) for name, _ in first)]
    assert [row["holds"] for row in paper["constraints"]] == [True, True, False, False, *[True] * 6]
    against = paper["hierarchical_over_control"][1]
    of_path = paper["constraints"][7]
    assert of_path["left"] / of_path["right"] == pytest.approx(against["value"], rel=1e-9)


def test_measured_in_both_prints_and_one_unit_without_a_figure():
    both = estimate_spec(load("encapsulating"))["measured"]
    assert (both["level"], both["also_printed"], both["same_size"]) == (0.0517, 0.0458, True)
    assert both["hierarchical_over_control"][0]["value"] == pytest.approx(0.0517 / 0.4518)
    amplified = estimate_spec(pair("embedded", STIFF, MEDIUM))["measured"]
    assert amplified["level"] is None
    assert amplified["over_a_control_not_named"] == 1.877
    assert estimate_spec(load("three-layer"))["measured"] is None


@pytest.mark.parametrize(
    ("template", "change", "differs"),
    [
        ("motor-10mm", (), ["motor", "diameter", "frequency"]),
        ("encapsulating", ("motor.drive=axial",), ["axial drive"]),
        ("encapsulating", ("layers.0.wall_mm=1.0",), ["walls"]),
        ("encapsulating", ("estimate.tissue=rigid-plate",), ["tissue"]),
        ("encapsulating", ("motor.lip_mm=0.5",), ["lip"]),
        ("encapsulating", ("skin_mm=0.5",), ["film on the skin side"]),
    ],
)
def test_measured_is_said_of_the_same_unit_only(template, change, differs):
    found = estimate_spec(load(template, list(change)))
    assert found["measured"]["same_size"] is False
    assert set(differs) <= set(found["measured"]["differs_in"])
    assert summary(found)["measured"] is None
    asked = [argument for one in change for argument in ("--set", one)]
    shown = run(template, *asked, "--details").stdout
    assert not any("measured" in line and "5.17" in line and "│" in line for line in shown.splitlines())
    assert "Measured in the paper" not in shown
    said = " ".join(shown.split())
    assert "Nearest measured unit: encapsulating E10/D30, 5.17 %. This unit differs in" in said
    assert all(name in said.split("This unit differs in")[1].split(".")[0] for name in differs)


def test_single_layer_is_its_own_control():
    found = estimate_spec(load("single-embedded"))
    for block in found["models"].values():
        assert block["hierarchical_over_control"] is None
        assert "own control" in block["hierarchical_over_control_reason"]
    assert found["measured"]["level"] == 0.395


def test_material_known_as_a_range_only():
    found = estimate_spec(pair("embedded", "ecoflex-00-30", STIFF))
    for model in ("published", "corrected"):
        level = found["models"][model]["edge_level"]
        assert level["value"] is None
        assert level["low"] < level["high"], model
        assert "fractional" in level["reason"]
    assert any("range" in line for line in found["assumptions"])


def test_material_not_known_is_null_with_the_reason():
    found = estimate_spec(pair("encapsulating", "ecoflex-00-50", STIFF))
    assert found["models"]["rule"]["edge_level"]["value"] is not None  # by the silicone's place
    for model in ("published", "corrected"):
        level = found["models"][model]["edge_level"]
        assert (level["value"], level["low"], level["high"]) == (None, None, None)
        assert "100 % modulus is static" in level["reason"]
    assert found["layered"]["drives"]
    json.dumps(found, allow_nan=False)


def test_an_own_material_changes_the_level_and_not_the_skin(encapsulating):
    own = load(
        "encapsulating",
        ["materials.mine.like=ecoflex-00-10", "materials.mine.youngs_modulus_kpa=150", "layers.0.material=mine"],
    )
    changed = estimate_spec(own)
    assert changed["answer"]["level"] > encapsulating["answer"]["level"]
    assert changed["layered"] == encapsulating["layered"]


def test_poisson_at_one_half_gives_no_pressure_wave():
    own = load(
        "encapsulating",
        ["materials.mine.like=ecoflex-00-10", "materials.mine.poisson_ratio=0.5", "layers.0.material=mine"],
    )
    block = estimate_spec(own)["models"]["published"]
    (path, *_) = (row for row in block["constraints"] if row["equation"] == "5a")
    assert path["left"] is path["margin"] is path["holds"] is None
    assert "1/2" in path["reason"]
    assert block["edge_level"]["value"] is not None


def test_spread_holds_every_corner(encapsulating):
    units = corners(estimate_input(load("encapsulating")))
    columns = [units.poisson_ratio, units.tan_delta, units.omega[:, None]]
    assert len(np.unique(np.concatenate(columns, axis=1)[1:], axis=0)) == 2**5
    levels = edge_levels(units, "published")
    assert levels.size == 1 + 2**5  # nu and tan delta of two silicones, and the frequency
    found = encapsulating["models"]["published"]["edge_level"]
    assert found["low"] == pytest.approx(levels.min(), rel=1e-8)
    assert found["high"] == pytest.approx(levels.max(), rel=1e-8)


def test_many_ranges_are_taken_one_at_a_time():
    names = [f"m{i}" for i in range(7)]
    variant = estimate_input(load("encapsulating"))
    many = structs.replace(variant, layers=tuple(structs.replace(variant.layers[0], material=name) for name in names))
    assert corners(many).omega.size == 1 + 2 * (7 * 2 + 1)


def test_same_input_same_bytes(encapsulating):
    assert json.dumps(estimate_spec(load("encapsulating"))) == json.dumps(encapsulating)
    digits = [len(repr(v).replace("-", "").replace(".", "").split("e")[0].strip("0")) for v in _floats(encapsulating)]
    assert max(digits) <= 9


def _floats(data):
    if isinstance(data, float):
        yield data
    for one in data.values() if isinstance(data, dict) else data if isinstance(data, list) else ():
        yield from _floats(one)


def run(*arguments):
    return CliRunner().invoke(app, ["estimate", *arguments])


def test_command_as_json():
    one = run("encapsulating", "--json", "--model", "published", "--frequency", "110")
    assert one.exit_code == 0
    found = json.loads(one.stdout)
    assert list(found["models"]) == ["published"]
    assert found["variant"]["frequency_hz"]["value"] == 110
    two = json.loads(run("encapsulating", "embedded", "--json", "--set", "layers.0.wall_mm=1.3").stdout)
    assert [one["variant"]["layers"][0]["wall_mm"] for one in two["estimates"]] == [1.3, 1.3]


def test_the_tables_of_a_person(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = run("encapsulating", "embedded", "--details").stdout
    assert shown.count("error against the table") == 1
    assert shown.index("chosen among") > shown.index("embedded: embedded")
    assert shown.index("|u| of the skin") < shown.index("change of the edge level")
    assert "…" not in shown


@pytest.mark.parametrize("model", ["divider", "layered", "baseline"])
def test_a_model_that_gives_no_estimate_is_refused_with_those_that_do(model):
    refused = run("encapsulating", "--model", model).exception
    assert isinstance(refused, Refusal)
    for name in ("rule", "published", "corrected", "fem", "all"):
        assert name in refused.limit


def test_a_range_stays_a_range_in_the_papers_details():
    """No small-strain modulus: no coefficient or side is given at a middle that nobody declared."""
    found = estimate_spec(pair("embedded", "ecoflex-00-30", STIFF), ("published",))["models"]["published"]
    for row in found["constraints"]:
        assert row["left"] is row["right"] is row["margin"] is None
        low, high = row["margin_low"], row["margin_high"]
        if low is None:
            assert row["holds"] is None
            assert "1/2" in row["reason"]
            continue
        assert row["holds"] == (True if low > 0 else False if high <= 0 else None)
        assert row.get("reason") == ("depends" if row["holds"] is None else None)
    assert {row["holds"] for row in found["constraints"] if row["equation"] == "6d"} == {True}
    s = found["coefficients"]["s"]
    assert s["k_t"] == [None, None]
    assert s["k_t_low"][0] < s["k_t_high"][0]


def test_a_legal_extreme_prints_no_warning():
    """Walls of 20 mm of a soft silicone with all damping, at 1000 Hz: paths of 1e-40, and ratios of two of them."""
    own = ["materials.own.like=ecoflex-00-10", "materials.own.youngs_modulus_kpa=0.01"]
    changes = [*own, "materials.own.loss_factor=2", "estimate.frequency_hz=1000", "diameter_mm=100"]
    layers = [f"layers.{i}.{key}" for i in (0, 1) for key in ("material=own", "wall_mm=20", "cap_mm=20")]
    layers[3] = "layers.1.material=dragon-skin-30"
    shown = run("encapsulating", *[part for one in [*changes, *layers] for part in ("--set", one)], "--details")
    assert shown.exit_code == 0, shown.output
    assert "Warning" not in shown.output + shown.stderr


def test_details_have_every_table():
    shown = unitcad("estimate", "encapsulating", "--details").stdout
    for word in ("published", "corrected", "baseline", "5.17 and 4.58", "sideways", "input + 1 %"):
        assert word in shown
    # The rule's row is not the answer's, and each kind of bracket is told.
    rows = {
        line.split("│")[1].strip(): line.split("│")[2].strip() for line in shown.splitlines() if line.count("│") > 3
    }
    level = re.search(r"Level at the edge: (\S+) % of the motor's amplitude (\(.*?\))\.", shown)
    assert level
    assert rows["answer"] == f"{level[1]} {level[2]}"
    assert rows["rule, all units alike"] != level[1]
    assert "of the answer its 80 % range, of a model the ends of its inputs' ranges" in " ".join(shown.split())

"""One body has one level, however it is cut into layers; a unit of more than two has none."""

from __future__ import annotations

import json
import math
from pathlib import Path
from random import Random
from typing import Any

import pytest
import tomli_w

from unitcad.attenuation.edge.level import model_block
from unitcad.attenuation.edge.predictive import predictive_of
from unitcad.attenuation.edge.variant_units import MANY_LAYERS
from unitcad.errors import Refusal
from unitcad.estimating import estimate_input, estimate_spec, frequency_table_of_spec
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.search.target_file import load_target
from unitcad.spec import Spec
from unitcad.sweeps.batch_call import batch
from unitcad.sweeps.estimate_table import evaluate
from unitcad.sweeps.sweep import from_file
from unitcad.validation import from_data, load

MATERIALS = ("ecoflex-00-10", "ecoflex-00-30", "dragon-skin-10-medium", "dragon-skin-30")
MODELS = ["bush", "fitted", "paper", "consistent"]


def drawn(rng: Random, layers: int) -> dict[str, Any]:
    """Return a spec's data without a circuit, so that any first cap will do."""
    design = rng.choice(["encapsulating", "embedded"])
    walls = [rng.uniform(1.1, 2.5) for _ in range(layers)]
    return {
        "name": "cut",
        "design": design,
        "diameter_mm": round(7.4 + 2 * sum(walls) + rng.uniform(0, 5), 3),
        "motor": {"part": "LCM0720A3463F"},
        "layers": [
            {
                "material": rng.choice(MATERIALS),
                "wall_mm": wall,
                **({"cap_mm": rng.uniform(1.1, 3)} if design == "encapsulating" else {}),
            }
            for wall in walls
        ],
        "estimate": {"models": MODELS},
    }


def cut(data: dict[str, Any], rng: Random) -> dict[str, Any]:
    """Return the same body with every layer cut in two of its silicone."""
    pieces = []
    for layer in data["layers"]:
        # A wall and a cap of less than 0.5 mm are refused.
        wall = rng.uniform(0.5, layer["wall_mm"] - 0.5)
        pieces += [{**layer, "wall_mm": wall}, {**layer, "wall_mm": layer["wall_mm"] - wall}]
        if "cap_mm" in layer:
            pieces[-2]["cap_mm"] = rng.uniform(0.5, layer["cap_mm"] - 0.5)
            pieces[-1]["cap_mm"] = layer["cap_mm"] - pieces[-2]["cap_mm"]
    return {**data, "layers": pieces}


def levels(spec: Spec) -> tuple[list[float], list[str | None]]:
    """Return all numbers on a unit's level before they are rounded, and the reasons why there are none."""
    variant = estimate_input(spec)
    found = [float(one[0]) for one in predictive_of([variant]).range]
    reasons = []
    for model in MODELS:
        block = model_block(variant, model)
        for one in [block["edge_level"], *(block["hierarchical_over_control"] or [])]:
            found += [math.nan if one[key] is None else one[key] for key in ("value", "low", "high")]
            reasons.append(one.get("reason"))
    return found, reasons


@pytest.mark.parametrize("seed", range(30))
def test_a_cut_changes_no_level(seed: int) -> None:
    rng = Random(seed)
    whole = drawn(rng, rng.randint(1, 3))
    expected, reasons = levels(from_data(whole))
    found, again = levels(from_data(cut(whole, rng)))
    assert found == pytest.approx(expected, rel=1e-9, nan_ok=True)
    assert again == reasons


def numbers(data: Any) -> list[float]:
    """Return the numbers in an estimate's blocks on levels."""
    if isinstance(data, dict):
        return [one for key in ("value", "low", "high", "p10", "p50", "p90", "level") for one in _number(data.get(key))]
    return []


def _number(value: Any) -> list[float]:
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("models", [MODELS, ["fitted"], ["mechanics"]])
def test_three_layers_have_no_level_and_one_reason(models: list[str]) -> None:
    found = estimate_spec(load("three-layer", {"estimate.models": models}))
    assert numbers(found["answer"]) == []
    assert found["answer"]["not_measured"] == ["number of layers", "diameter"]
    for block in found["models"].values():
        assert numbers(block["edge_level"]) == []
        assert block["edge_level"]["reason"] == MANY_LAYERS
        assert [numbers(one) for one in block["hierarchical_over_control"]] == [[], [], []]
    if models == ["mechanics"]:
        assert (found["mechanics"]["levels"], found["mechanics"]["reason"]) == ([], MANY_LAYERS)
    else:
        assert found["answer"]["lines"][0] == f"Not known: {MANY_LAYERS}"
        assert found["variant"]["not_known"] == MANY_LAYERS
    table = frequency_table_of_spec(load("three-layer"), [100.0, 150.0])
    for row in table["frequencies"]:
        assert [numbers(one) for one in row["edge_level"].values()] == [[]] * 4


def test_two_pieces_of_one_silicone_are_named_by_the_first() -> None:
    soft, hard = "ecoflex-00-10", "dragon-skin-30"
    layers = [{"material": name, "wall_mm": 0.7, "cap_mm": 1.0} for name in (soft, soft, hard, hard)]
    spec = from_data({**drawn(Random(1), 1), "design": "encapsulating", "layers": layers, "diameter_mm": 17.0})
    found = estimate_spec(spec)
    assert [layer["wall_mm"] for layer in found["variant"]["layers"]] == [1.4, 1.4]
    seen = found["models"]["bush"]["inputs_seen"]
    assert {name for name in [*seen["by"], *seen["not_seen"]] if name.endswith(".wall_mm")} == {
        "layers.0.wall_mm",
        "layers.2.wall_mm",
    }


def test_a_batch_gives_each_variant_the_level_of_its_estimate() -> None:
    """The table's arrays merge as the estimate does: silicones and walls of three layers, swept."""
    axes = {f"layers.{i}.material": [*MATERIALS[:1], *MATERIALS[2:]] for i in range(3)}
    sweep = from_file({"base": "three-layer", "sweep": {**axes, "layers.1.wall_mm": [1.0, 1.5]}}, Path(), "cut")
    (block,) = evaluate(sweep, sweep.count)
    known = 0
    for index in range(sweep.count):
        spec = sweep.spec(index)
        assert isinstance(spec, Spec)
        names = [layer.material for layer in spec.layers]
        models = estimate_spec(spec)["models"]
        for model in MODELS:
            level, expected = float(block.levels[model][index]), models[model]["edge_level"]["value"]
            assert (level != level) == (expected is None) == (names[0] != names[1] != names[2])
            if expected is not None:
                known += 1
                assert level == pytest.approx(expected, rel=1e-8)
    assert known == 4 * 2 * 15


@pytest.mark.parametrize("only", [("estimate",), ("unit", "estimate")])
def test_a_batch_says_why_a_variant_has_no_level(only: tuple[str, ...], tmp_path: Path) -> None:
    data = {"base": ["three-layer", "encapsulating"], "sweep": {"output.tolerance_mm": [0.05]}}
    batch(from_file(data, Path(), "both"), tmp_path / "out", only=only, formats="stl", jobs=1, cache=tmp_path / "cache")
    three, two = json.loads((tmp_path / "out" / "batch.json").read_text())["variants"]
    assert (three["status"], three["reason"], two["reason"]) == ("ok", MANY_LAYERS, "")
    assert [three[f"edge_{model}"] for model in MODELS] == [None] * 4
    assert all(two[f"edge_{model}"] for model in MODELS)


def test_a_search_and_a_fit_refuse_three_layers(tmp_path: Path) -> None:
    (tmp_path / "quiet.toml").write_text("[target]\nedge_max = 0.1\n[vary]\nlayers = [2, 3]\n")
    with pytest.raises(Refusal, match=r"vary\.layers\.1 = 3: .*2"):
        load_target(tmp_path / "quiet.toml")
    own = {"name": "bench", "unit": [{"name": "three", "spec": "three-layer", "level": {"value": 0.1}}]}
    (tmp_path / "lab.toml").write_text(tomli_w.dumps(own))
    with pytest.raises(Refusal, match=r"unit\.0 = 'three': can't be fitted: no measured unit"):
        fit_lab(load_fit_lab(str(tmp_path / "lab.toml")))

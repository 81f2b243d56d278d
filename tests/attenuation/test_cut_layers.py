"""One body has one level: a cut into layers changes nothing, and a layer that is hardly another one changes little."""

from random import Random

import numpy as np
import pytest

from unitcad.attenuation.edge.level import edge_level
from unitcad.attenuation.edge.measured import merge_layers
from unitcad.attenuation.edge.models import MODELS
from unitcad.attenuation.edge.ranges import predictive_of
from unitcad.attenuation.fem.unit import ALIKE
from unitcad.attenuation.fem.unit import level as finite_elements
from unitcad.estimate_inputs import answer_spec, estimate_input, estimate_spec
from unitcad.validation import from_data

MATERIALS = ("ecoflex-00-10", "ecoflex-00-30", "dragon-skin-10-medium", "dragon-skin-30")
SPECS = 100


def drawn(rng, layers):
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
        "estimate": {"models": list(MODELS)},
    }


def cut(layer, rng):
    """Return a layer in two pieces. A wall and a cap of less than 0.5 mm are refused."""
    wall = rng.uniform(0.5, layer["wall_mm"] - 0.5)
    pieces = [{**layer, "wall_mm": wall}, {**layer, "wall_mm": layer["wall_mm"] - wall}]
    if "cap_mm" in layer:
        pieces[0]["cap_mm"] = rng.uniform(0.5, layer["cap_mm"] - 0.5)
        pieces[1]["cap_mm"] = layer["cap_mm"] - pieces[0]["cap_mm"]
    return pieces


def levels(data):
    """Return every number on a unit's level before it is rounded: models and answer; NaN where there is none."""
    variant = estimate_input(from_data(data))
    found = [float(end[0]) for end in predictive_of([variant]).range]
    for model in MODELS:
        block = edge_level(variant, model)
        found += [np.nan if block[key] is None else block[key] for key in ("value", "low", "high")]
    return np.array(found)


@pytest.mark.parametrize("seed", range(SPECS))
def test_a_cut_changes_no_level(seed):
    rng = Random(seed)
    whole = drawn(rng, rng.randint(1, 3))
    pieces = [piece for layer in whole["layers"] for piece in cut(layer, rng)]
    assert levels({**whole, "layers": pieces}) == pytest.approx(levels(whole), rel=1e-9, nan_ok=True)


def nearly(whole, rng):
    """Return the same body with one half of a cut layer 1e-6 stiffer."""
    at = rng.randrange(len(whole["layers"]))
    pieces = cut(whole["layers"][at], rng)
    name = pieces[0]["material"]
    side = rng.randrange(2)
    pieces[side] = {**pieces[side], "material": "nearly"}
    kpa = KPA[name] * (1 + 1e-6)
    layers = [*whole["layers"][:at], *pieces, *whole["layers"][at + 1 :]]
    return {**whole, "layers": layers, "materials": {"nearly": {"like": name, "youngs_modulus_kpa": kpa}}}


KPA = {"ecoflex-00-10": 15.0, "dragon-skin-10-medium": 250.0, "dragon-skin-30": 355.0}


def known(rng, layers):
    """Return a spec whose silicones have a modulus."""
    data = drawn(rng, layers)
    for layer in data["layers"]:
        layer["material"] = rng.choice(list(KPA))
    return data


@pytest.mark.parametrize("seed", range(SPECS))
def test_a_layer_that_is_hardly_another_one_changes_the_level_little(seed):
    rng = Random(seed)
    whole = known(rng, rng.randint(1, 3))
    expected, found = levels(whole), levels(nearly(whole, rng))
    assert np.isfinite(expected).all()
    values = [1, *range(3, len(expected), 3)]  # the answer's median and each model's value
    assert found[values] == pytest.approx(expected[values], rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_finite_elements_have_both_halves_of_the_law(seed):
    pytest.importorskip("skfem")
    rng = Random(seed)
    whole = known(rng, 1 + seed % 3)
    other = [nearly(whole, rng), {**whole, "layers": [piece for layer in whole["layers"] for piece in cut(layer, rng)]}]

    def solved(data):
        return finite_elements(merge_layers(estimate_input(from_data(data)), ALIKE), 125.0, "axial", "skin", None, 0.5)

    assert [solved(one) for one in other] == pytest.approx([solved(whole)] * 2, rel=1e-4)


def test_three_layers_are_marked_and_have_a_wider_range():
    names = ["ecoflex-00-10", "dragon-skin-30", "ecoflex-00-10"]
    data = known(Random(5), 3)
    for layer, name in zip(data["layers"], names, strict=True):
        layer["material"] = name
    three = answer_spec(from_data(data))
    two = answer_spec(from_data({**data, "layers": data["layers"][:2]}))
    assert ["number of layers" in one.wider for one in (two, three)] == [False, True]
    assert three.high / three.low > 1.1 * two.high / two.low


def test_two_pieces_of_one_silicone_are_named_by_the_first():
    soft, hard = "ecoflex-00-10", "dragon-skin-30"
    layers = [{"material": name, "wall_mm": 0.7, "cap_mm": 1.0} for name in (soft, soft, hard, hard)]
    spec = from_data({**drawn(Random(1), 1), "design": "encapsulating", "layers": layers, "diameter_mm": 17.0})
    found = estimate_spec(spec)
    assert [layer["wall_mm"] for layer in found["variant"]["layers"]] == [1.4, 1.4]
    seen = found["models"]["published"]["sensitivities"]
    assert {name for name in [*seen["by"], *seen["no_effect"]] if name.endswith(".wall_mm")} == {
        "layers.0.wall_mm",
        "layers.2.wall_mm",
    }
    assert seen["tested"]["layers.2.youngs_modulus_kpa"]["of"] == 2

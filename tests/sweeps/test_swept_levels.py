"""Each variant of a sweep has the levels of its own estimate."""

from pathlib import Path

import pytest

from tests.attenuation.test_moduli_source import leave_one_out
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.models import MODELS
from unitcad.estimate_inputs import estimate_spec
from unitcad.spec import Spec
from unitcad.sweeps.estimate_table import evaluate
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.sweep import from_file
from unitcad.validation import load


def test_a_batch_gives_each_variant_the_level_of_its_estimate():
    """The table's arrays merge as the estimate does: silicones and walls of three layers, swept."""
    axes = {f"layers.{i}.material": ["ecoflex-00-10", "dragon-skin-10-medium", "dragon-skin-30"] for i in range(3)}
    sweep = from_file({"base": "three-layer", "sweep": {**axes, "layers.1.wall_mm": [1.0, 1.5]}}, Path(), "cut")
    (block,) = evaluate(sweep, sweep.count)
    for index in range(sweep.count):
        spec = sweep.spec(index)
        assert isinstance(spec, Spec)
        models = estimate_spec(spec)["models"]
        for model in MODELS:
            assert float(block.levels[model][index]) == pytest.approx(models[model]["edge_level"]["value"], rel=1e-8)


def test_a_sweep_of_the_source_has_each_variant_s_own_levels():
    sweep = from_file({"base": "embedded", "sweep": {"estimate.moduli": ["small-strain", "quasi-static"]}}, Path(), "s")
    levels = next(iter(evaluate(sweep, sweep.count))).levels
    for i, moduli in enumerate(("small-strain", "quasi-static")):
        models = estimate_spec(load("embedded", [f"estimate.moduli={moduli}"]))["models"]
        for model, block in models.items():
            assert levels[model][i] == pytest.approx(block["edge_level"]["value"], rel=1e-6)
    slow = from_file(
        {"base": "embedded", "sweep": {"estimate.moduli": ["quasi-static"], "layers.0.wall_mm": [1.2, 1.3]}},
        Path(),
        "s",
    )
    found = swept_estimate(slow, slow.count)
    assert found is not None
    assert found.typical_error["published"] == pytest.approx(leave_one_out(measured_table("quasi-static")), rel=1e-4)

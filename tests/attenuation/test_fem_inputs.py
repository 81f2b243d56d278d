"""What the finite elements see: slopes against specs that were changed and solved anew."""

import math

import pytest

pytest.importorskip("skfem")

from unitcad.attenuation.edge.level import changed, sensitivities
from unitcad.attenuation.fem.unit import STEP, fem_sensitivities, level
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load


def test_slopes_of_both_readings_are_those_of_specs_that_were_changed():
    variant = estimate_input(load("embedded"))
    lines = []
    found = {one["reading"]: one for one in fem_sensitivities(variant, lines.append)}
    assert set(found) == {"skin", "edge"}
    assert len(set(lines)) == len(changed(variant))
    for path, value in (("layers.0.wall_mm", 1.25), ("motor.thickness_mm", 2.0), ("estimate.frequency_hz", 125.0)):
        specs = [load("embedded", [f"{path}={value * factor!r}"]) for factor in (math.exp(-STEP), math.exp(STEP))]
        inputs = [estimate_input(spec) for spec in specs]
        for reading, one in found.items():
            low, high = (level(each, each.frequency.middle, "flat", reading, fineness=0.5) for each in inputs)
            assert one["by"].get(path, 0.0) == pytest.approx(math.log(high / low) / (2 * STEP), abs=0.02), path


def test_a_unit_without_a_modulus_has_no_slopes():
    assert fem_sensitivities(estimate_input(load("embedded", ["layers.0.material=ecoflex-00-50"]))) == []


def test_no_poisson_s_ratio_above_one_half_is_asked_for():
    seen = []

    def watch(variants):
        seen.extend(layer.poisson_ratio.middle for one in variants for layer in one.layers)
        return [one.layers[0].poisson_ratio.middle ** 2 for one in variants]

    found = sensitivities(estimate_input(load("embedded")), watch, STEP)
    assert max(seen) <= 0.5
    assert found["by"] == {"layers.0.poisson_ratio": 2.0}

"""What a model reads: slopes against those of specs that were changed and worked out anew, and against formulas."""

import math

import numpy as np
import pytest

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.contrast import unit_of_scale
from unitcad.attenuation.edge.level import changed, nominal, sensitivities, stack_inputs
from unitcad.attenuation.edge.models import MODELS, edge_levels, stored
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.validation import load

SPECS = {
    "encapsulating": (),
    "embedded": (),
    "filled": ("motor.fill=true",),
    "single-encapsulating": (),
}
STEP = 1e-3


def spec_of(name, *more):
    return load("encapsulating" if name == "filled" else name, [*SPECS[name], *more])


def asked(spec, path):
    """The spec's value at a path of the estimate's inputs; None for what a spec has elsewhere or not at all."""
    parts = path.split(".")
    if parts[0] == "layers" and parts[2] in ("wall_mm", "cap_mm"):
        return getattr(spec.layers[int(parts[1])], parts[2])
    if path == "diameter_mm":
        return spec.diameter_mm
    if path in ("motor.diameter_mm", "motor.thickness_mm"):
        return getattr(spec.motor, parts[1])
    if path in ("fpcb.pad_diameter_mm", "fpcb.thickness_mm"):
        return getattr(spec.fpcb, parts[1])
    return spec.estimate.frequency_hz if path == "estimate.frequency_hz" else None


@pytest.mark.parametrize("name", SPECS)
@pytest.mark.parametrize("model", ["published", "corrected"])
def test_slopes_are_those_of_specs_that_were_changed(name, model):
    spec = spec_of(name)
    variant = estimate_input(spec)
    found = sensitivities(variant, lambda variants: edge_levels(stack_inputs(variants), model))
    compared = 0
    for path in changed(variant):
        value = asked(spec, path)
        if value is None:
            continue
        pad = spec.fpcb and path != "fpcb.pad_diameter_mm"
        keep = [f"fpcb.pad_diameter_mm={spec.fpcb.pad_diameter_mm!r}"] if pad else []
        specs = [spec_of(name, *keep, f"{path}={value * factor!r}") for factor in (math.exp(-STEP), math.exp(STEP))]
        low, high = (float(edge_levels(nominal(estimate_input(one)), model)[0]) for one in specs)
        slope = math.log(high / low) / (2 * STEP)
        assert found["by"].get(path, 0.0) == pytest.approx(slope, abs=2e-4), path
        compared += 1
    assert compared >= 6


def test_slopes_by_formula():
    """The rule: n ln q over the unit of the scale, between equal silicones. published: the exponents along the walls."""
    blocks = estimate_spec(load("encapsulating"))["models"]
    between = ["layers.0.material=dragon-skin-10-medium", "layers.1.material=dragon-skin-30"]
    slope = -2 * math.log(stored()["rule"]["q"]) / unit_of_scale()
    slopes = {"layers.0.youngs_modulus_kpa": slope, "layers.1.youngs_modulus_kpa": -slope}
    own = estimate_spec(load("encapsulating", between))["models"]["rule"]["sensitivities"]["by"]
    assert own == pytest.approx(slopes, abs=1e-4)
    paper = blocks["published"]["sensitivities"]["by"]
    (exponents,) = cf.exponents(nominal(estimate_input(load("encapsulating"))))
    assert [paper[f"layers.{i}.wall_mm"] for i in (0, 1)] == pytest.approx([-e for e in exponents], abs=1e-4)
    assert paper["estimate.frequency_hz"] == pytest.approx(-sum(exponents), abs=1e-4)


@pytest.mark.parametrize("name", SPECS)
def test_each_input_is_seen_or_named_as_not_seen(name):
    spec = spec_of(name)
    for model, block in estimate_spec(spec)["models"].items():
        seen = block["sensitivities"]
        assert model in MODELS
        assert {*seen["by"], *seen["no_effect"]} == set(changed(estimate_input(spec)))
        assert not set(seen["by"]) & set(seen["no_effect"])
    models = estimate_spec(spec)["models"]
    assert not models["rule"]["sensitivities"]["by"]  # beyond the measured pairs, or a single layer
    assert "layers.0.wall_mm" in models["published"]["sensitivities"]["by"]


def test_a_slope_has_the_pairs_that_were_measured_and_a_range_with_zero_if_they_contradict():
    models = estimate_spec(load("encapsulating"))["models"]
    tested = models["published"]["sensitivities"]["tested"]
    slope = models["published"]["sensitivities"]["by"]["layers.1.youngs_modulus_kpa"]
    outer = tested["layers.1.youngs_modulus_kpa"]
    assert (outer["agree"], outer["of"]) == (0, 2)
    assert (outer["low"], outer["high"]) == (slope, pytest.approx(np.log(0.156 / 0.0886) / np.log(355 / 250), abs=1e-4))
    for name, one in tested.items():
        assert one["low"] <= 0 <= one["high"], name
    single = estimate_spec(load("single-embedded"))["models"]["published"]["sensitivities"]["tested"]
    assert single["layers.0.youngs_modulus_kpa"]["of"] == 3
    stiff = ["layers.0.material=dragon-skin-30", "layers.1.material=ecoflex-00-10"]
    untested = estimate_spec(load("embedded", stiff))["models"]["published"]["sensitivities"]["tested"]
    assert {one["of"] for one in untested.values()} == {0}


def test_another_model_s_slopes_come_from_the_same_function():
    variant = estimate_input(load("encapsulating"))

    def cube_of_the_mass(variants):
        return [one.geometry.motor_mass.middle**3 * one.tissue[0].shear_modulus.middle ** -0.5 for one in variants]

    found = sensitivities(variant, cube_of_the_mass)
    assert found["by"] == {"motor mass": 3.0, "tissue shear modulus": -0.5}
    nothing = sensitivities(variant, lambda variants: np.full(len(variants), np.nan))
    assert nothing["by"] is None
    assert "no finite level" in nothing["reason"]

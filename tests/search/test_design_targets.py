"""Target files: what is refused, with which nearest value; the shipped ones; lists, schema and a file to start from."""

import json
import tomllib

import jsonschema
import pytest

from tests.in_process import unitcad
from tests.refusals import refuses
from unitcad.attenuation.edge.ranges import predictive_of
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.search.candidates import candidates
from unitcad.search.proposals import leads_block
from unitcad.search.target_file import load_target, target_of
from unitcad.validation.load import shipped_files

BLEND = {
    "density_g_cm3": 1.0, "mixed_viscosity_cps": 1000, "pot_life_min": 30, "cure_h": 4, "shore": "00-20",
    "modulus_100pct_kpa": 50, "tensile_mpa": 1.0, "elongation_pct": 800, "casting_floor_mm": 1.0,
    "poisson_ratio": 0.49, "loss_factor": 0.2, "mix_ratio": 1.0,
}  # fmt: skip
"""A silicone whose modulus nobody knows."""


@pytest.mark.parametrize(
    ("data", "field", "limit", "nearest"),
    [
        ({"target": {}}, "target.edge_max", "is required, or edge_min", None),
        ({}, "target", "is required", None),
        ({"target": {"edge_max": 6}}, "target.edge_max", "fraction of the motor's amplitude", 0.06),
        ({"target": {"edge_max": 0.1, "edge_min": 0.2}}, "target.edge_min", "excludes edge_max", None),
        ({"target": {"edge_max": 0.1, "crosstalk_ratio_max": 0.2}}, "target.pitch_mm", "required with", None),
        (
            {"target": {"edge_max": 0.1, "diameter_mm": 9}},
            "target.diameter_mm",
            "unknown key",
            "target.diameter_max_mm",
        ),
        ({"at_hand": {"materials": ["ecoflex-00-10"] * 2}}, "at_hand.materials.1", "is given twice", None),
        ({"at_hand": {"designs": ["embeded"]}}, "at_hand.designs.0", "unknown name", "embedded"),
        (
            {"materials": {"blend": BLEND}, "at_hand": {"materials": ["blend"]}},
            "at_hand.materials",
            "none can be tried: blend: no",
            None,
        ),
        ({"vary": {"wall_mm": [2.0, 1.0]}}, "vary.wall_mm", "from the least to the largest", [1.0, 2.0]),
        ({"vary": {"layers": [1, 9]}}, "vary.layers.1", "at most 2", 2),
        ({"vary": {"layers": [2], "step_mm": 0.01}}, "vary.step_mm", "more than 20000 sets of lengths", 0.02),
        ({"estimate": {"fit": "none.toml"}}, "estimate.fit", "none.toml", None),
        ({"spec": {"motor": {"part": "x"}}}, "spec.motor.part", "is in at_hand.motors", None),
    ],
)
def test_what_is_refused(data, field, limit, nearest):
    given = data if "target" in data or not data else {"target": {"edge_max": 0.06}, **data}
    with refuses(field, limit) as refused:
        candidates(target_of(given))
    assert refused.value.nearest == nearest


def test_a_fault_of_a_table_for_every_spec_is_named():
    wrong = {"target": {"edge_max": 0.06}, "spec": {"fpcb": {"tail_width_mm": 30.0}}}
    with pytest.raises(Refusal, match=r"^spec\.fpcb\.tail_width_mm = 30: "):
        candidates(target_of(wrong))


def test_shipped_targets_load_and_are_listed():
    listed = unitcad("list", "targets").stdout
    for name in ("amplify", "published", "quiet-edge"):
        assert load_target(name).name == name
        assert name in listed


def test_a_target_to_start_from(tmp_path):
    assert unitcad("init", "mine", "--template", "quiet-edge", cwd=tmp_path).returncode == 0
    assert load_target(tmp_path / "mine.toml").goals.edge_max == 0.06
    done = unitcad("init", "other", "--template", "quiet", cwd=tmp_path)
    assert done.returncode == 2
    assert "--template = 'quiet': unknown name; closest: quiet-edge" in done.stderr
    assert not (tmp_path / "other.toml").exists()


def test_the_schema_takes_the_shipped_targets():
    schema = json.loads(unitcad("schema", "target").stdout)
    for path in shipped_files("targets").values():
        jsonschema.validate(tomllib.loads(path.read_text("utf-8")), schema)


def test_a_design_s_range_is_that_of_the_estimate():
    target = target_of({"target": {"edge_max": 0.3}, "estimate": {"moduli": "quasi-static"}, "vary": {"layers": [2]}})
    assert leads_block(target)["by"] == "the paper's nine levels, by the moduli of a slow pull"
    found = candidates(target)
    spec = found.spec(3)
    expected = predictive_of([estimate_input(spec)])
    assert found.probability[3] == pytest.approx(expected.at_most(0.3)[0], rel=1e-9)
    assert spec.estimate.moduli == "quasi-static"

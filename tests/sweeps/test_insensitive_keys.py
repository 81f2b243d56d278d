"""A batch says which swept keys a model of the edge level does not read."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.attenuation.test_moduli_source import leave_one_out
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.models import MODELS, assessments
from unitcad.cli import app
from unitcad.sweeps.estimate_table import levels
from unitcad.sweeps.insensitive_keys import swept_estimate, warnings
from unitcad.sweeps.sweep import from_file, load_sweep


def swept(base="encapsulating", mode="product", **values):
    paths = {path.replace("__", "."): value for path, value in values.items()}
    return from_file({"base": base, "sweep": {"mode": mode, **paths}}, Path(), "s")


def estimated(sweep):
    return swept_estimate(sweep, sweep.count)


def unread(sweep):
    return {model: keys for model, keys in estimated(sweep).insensitive.items() if keys}


def test_the_walls_of_the_shipped_sweep_do_not_enter_rule_and_divider():
    walls = ["layers.0.wall_mm", "layers.1.wall_mm"]
    assert unread(load_sweep("thickness")) == {"rule": walls, "divider": walls}


def test_the_reading_keys_are_those_that_move_a_level():
    """Against the batch's own table: over an axis alone a level moves where, and only where, the key is read."""
    sweep = load_sweep("thickness")
    rows = [levels(sweep.spec(index)) for index in range(sweep.count)]
    for model in MODELS:
        grid = np.reshape([row[f"edge_{model}"] for row in rows], (2, 4, 4))
        moved = [bool((grid.max(axis=axis) / grid.min(axis=axis) > 1 + 1e-9).any()) for axis in (1, 2)]
        missing = unread(sweep).get(model, [])
        assert moved == ["layers.0.wall_mm" not in missing, "layers.1.wall_mm" not in missing], model


def test_a_key_that_no_model_reads_is_said_once():
    sweep = swept(fpcb__pad_diameter_mm=[8.0, 8.5])
    assert sorted(unread(sweep)) == sorted(MODELS)
    assert warnings(estimated(sweep)) == [
        "no model of the edge level reads fpcb.pad_diameter_mm: the level stays the same"
    ]


def test_keys_of_tooling_casting_and_files_are_no_matter_of_the_estimate():
    sweep = swept(moulds__plate_mm=[4.0, 5.0], casting__room_c=[20.0, 25.0], output__tolerance_mm=[0.01, 0.02])
    assert unread(sweep) == {}


@pytest.mark.parametrize("mode", ["zip", "cases"])
def test_keys_that_vary_together_are_told_apart(mode):
    """The side of the softer layer moves every model's level; the wall beside it moves none of rule's and divider's."""
    names, walls = ["ecoflex-00-10", "dragon-skin-10-medium"], [1.25, 1.5]
    if mode == "zip":
        sweep = swept(mode="zip", layers__0__material=names, layers__0__wall_mm=walls)
    else:
        cases = [{"layers.0.material": n, "layers.0.wall_mm": w} for n, w in zip(names, walls, strict=True)]
        sweep = from_file({"base": "encapsulating", "sweep": {"mode": "cases", "cases": cases}}, Path(), "s")
    assert unread(sweep) == {"rule": ["layers.0.wall_mm"], "divider": ["layers.0.wall_mm"]}


def test_a_level_that_is_not_known_says_nothing():
    sweep = swept(base="embedded", layers__0__material=["ecoflex-00-50"], layers__0__wall_mm=[1.0, 1.25])
    assert unread(sweep) == {}


def test_a_batch_of_units_without_estimates_has_none(tmp_path):
    sweep = swept(base=str(Path("templates/custom/strap-lugs.toml").resolve()), diameter_mm=[14.0, 14.5])
    assert estimated(sweep) is None
    assert warnings(None) == []


def test_the_terminal_warns_and_batch_json_tells(tmp_path):
    done = CliRunner().invoke(app, ["batch", "thickness", "--only", "estimate", "-o", str(tmp_path / "b")])
    assert done.exit_code == 0
    warning = "warning: rule and divider do not read layers.0.wall_mm and layers.1.wall_mm: their level stays the same"
    assert warning in done.output
    told = json.loads((tmp_path / "b" / "batch.json").read_text())["estimate"]
    assert told["not_measured"] == {"layers.0.wall_mm": 1.25, "layers.1.wall_mm": 1.25}
    assert told["insensitive"] == {
        "rule": ["layers.0.wall_mm", "layers.1.wall_mm"],
        "divider": ["layers.0.wall_mm", "layers.1.wall_mm"],
        "published": [],
        "corrected": [],
    }
    for model, typical in told["typical_error"].items():
        assert typical == pytest.approx(assessments()[model].leave_one_out.geometric_mean, rel=1e-5)
    assert warning in CliRunner().invoke(app, ["batch", "thickness", "--dry-run", "--only", "estimate"]).output
    quiet = CliRunner().invoke(app, ["batch", "thickness", "--dry-run", "--only", "unit", "--limit", "2"])
    assert "does not read" not in quiet.output


@pytest.mark.parametrize(
    ("base", "values", "lengths"),
    [
        ("encapsulating", {"layers__0__wall_mm": [1.25, 1.5]}, {"layers.0.wall_mm": 1.25}),
        ("encapsulating", {"layers__0__wall_mm": [1.25]}, {}),
        (
            "encapsulating",
            {"diameter_mm": [14.0, 15.0], "layers__1__cap_mm": [1.0]},
            {"diameter_mm": 14.0, "layers.1.cap_mm": 1.25},
        ),
        ("encapsulating", {"layers__0__material": ["ecoflex-00-10", "dragon-skin-10"]}, {}),
        ("single-embedded", {"layers__0__wall_mm": [2.0, 2.5]}, {"layers.0.wall_mm": 2.5}),  # of the measured controls
        ("three-layer", {"layers__0__wall_mm": [1.0, 1.5]}, {}),
        (["three-layer", "encapsulating"], {"layers__0__wall_mm": [1.0, 1.5]}, {"layers.0.wall_mm": 1.25}),
    ],
)
def test_swept_lengths_that_every_measured_unit_had_alike_are_named(base, values, lengths):
    found = estimated(swept(base, **values))
    assert found.not_measured == lengths
    told = [line for line in warnings(found) if line.startswith("every measured unit had")]
    assert len(told) == len(set(lengths.values()))
    assert all(any(path in line and f"{length:g} mm" in line for line in told) for path, length in lengths.items())


def test_the_typical_error_is_that_of_the_swept_source_of_moduli():
    found = estimated(swept("embedded", estimate__moduli=["quasi-static"], layers__0__wall_mm=[1.2, 1.3]))
    assert found.typical_error["published"] == pytest.approx(leave_one_out(measured_table("quasi-static")), rel=1e-4)

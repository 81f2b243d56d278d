"""A batch says which swept keys the level at the edge does not read."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from unitcad.attenuation.edge.words import NO_EFFECT, effect
from unitcad.cli import app
from unitcad.estimate_inputs import answer_spec
from unitcad.sweeps.insensitive_keys import swept_estimate, warnings
from unitcad.sweeps.sweep import from_file, load_sweep


def swept(base="encapsulating", mode="product", **values):
    paths = {path.replace("__", "."): value for path, value in values.items()}
    return from_file({"base": base, "sweep": {"mode": mode, **paths}}, Path(), "s")


def estimated(sweep):
    return swept_estimate(sweep, sweep.count)


def unread(sweep):
    return estimated(sweep).unread


def test_the_level_does_not_read_the_walls_of_the_shipped_sweep():
    """What moves it there is the weight of the measured unit; no change of it is shown as an effect."""
    sweep = load_sweep("thickness")
    assert unread(sweep) == ["layers.0.wall_mm", "layers.1.wall_mm"]
    answers = [answer_spec(sweep.spec(index)) for index in range(sweep.count)]
    for group in (answers[:16], answers[16:]):
        assert all(effect(one, group[0]) == NO_EFFECT for one in group)


def test_a_key_that_is_not_read_is_named():
    sweep = swept(fpcb__pad_diameter_mm=[8.0, 8.5])
    assert warnings(estimated(sweep)) == [
        "the level at the edge does not read fpcb.pad_diameter_mm: at most its range changes"
    ]


def test_keys_of_tooling_casting_and_files_are_no_matter_of_the_estimate():
    sweep = swept(moulds__plate_mm=[4.0, 5.0], casting__room_c=[20.0, 25.0], output__tolerance_mm=[0.01, 0.02])
    assert unread(sweep) == []


@pytest.mark.parametrize("mode", ["zip", "cases"])
def test_keys_that_vary_together_are_told_apart(mode):
    """The side of the softer layer moves the level; the wall next to it does not."""
    names, walls = ["ecoflex-00-10", "dragon-skin-10-medium"], [1.25, 1.5]
    if mode == "zip":
        sweep = swept(mode="zip", layers__0__material=names, layers__0__wall_mm=walls)
    else:
        cases = [{"layers.0.material": n, "layers.0.wall_mm": w} for n, w in zip(names, walls, strict=True)]
        sweep = from_file({"base": "encapsulating", "sweep": {"mode": "cases", "cases": cases}}, Path(), "s")
    assert unread(sweep) == ["layers.0.wall_mm"]


def test_a_level_that_is_not_known_says_nothing():
    sweep = swept(base=str(Path("templates/custom/strap-lugs.toml").resolve()), diameter_mm=[14.0, 14.5])
    assert unread(sweep) == []
    assert warnings(None) == []


def test_the_terminal_warns_and_batch_json_tells(tmp_path):
    done = CliRunner().invoke(app, ["batch", "thickness", "--only", "estimate", "-o", str(tmp_path / "b")])
    assert done.exit_code == 0
    warning = (
        "warning: the level at the edge does not read layers.0.wall_mm and layers.1.wall_mm: at most its range changes"
    )
    assert warning in done.output
    told = json.loads((tmp_path / "b" / "thickness" / "batch.json").read_text())["estimate"]
    assert told == {
        "unread": ["layers.0.wall_mm", "layers.1.wall_mm"],
        "not_measured": {"layers.0.wall_mm": 1.25, "layers.1.wall_mm": 1.25},
    }
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

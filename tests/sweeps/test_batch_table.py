"""Estimate-only sweeps: the table has what single estimates give, variant by variant."""

import csv
import json
from pathlib import Path

import pytest
from batching import bytes_of, unitcad

from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec
from unitcad.sweeps import BatchOptions, estimate_table
from unitcad.sweeps.sweep import from_file

SILICONES = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
BOTH = ["encapsulating", "single-embedded"]
SWEEPS = {
    "free axes": (
        BOTH,
        {
            "layers.0.wall_mm": [1.0, 1.3],
            "layers.0.material": SILICONES,
            "estimate.frequency_hz": {"start": 60.0, "stop": 240.0, "num": 3},
        },
    ),
    "two layers": (
        "embedded",
        {"layers.1.material": SILICONES, "layers.0.material": SILICONES, "casting.room_c": 20.0},
    ),
    "three layers": (
        "three-layer",
        {**{f"layers.{i}.material": SILICONES[::3] for i in range(3)}, "layers.1.wall_mm": [1.0, 1.5]},
    ),
    "bound axes": (
        "encapsulating",
        {"motor.part": ["LCM0720A3463F"], "diameter_mm": [14.0, 15.5], "motor.fill": [False, True]},
    ),
    "zip": (
        "encapsulating",
        {"mode": "zip", "layers.0.material": SILICONES, "estimate.frequency_hz": [50.0, 60.0, 70.0, 80.0, 90.0]},
    ),
    "moduli": (
        ["embedded", "encapsulating"],
        {"estimate.moduli": ["small-strain", "quasi-static"], "layers.0.material": ["ecoflex-00-10", "dragon-skin-30"]},
    ),
    "own silicone": (
        "encapsulating",
        {
            "materials.ours.like": ["ecoflex-00-10"],
            "materials.ours.youngs_modulus_kpa": [20.0, 80.0],
            "layers.0.material": ["ours", "ecoflex-00-10"],
        },
    ),
    "models": (
        "encapsulating",
        {"estimate.models": [["published"], ["published", "rule"]], "layers.0.material": SILICONES[::2]},
    ),
}


def _sweep(name):
    base, axes = SWEEPS[name]
    return from_file({"base": base, "sweep": axes}, Path(), "test")


def _rows(sweep, out):
    estimate_table.write_estimates(sweep, out, BatchOptions(("estimate",)))
    return json.loads((out / "batch.json").read_text())["variants"]


@pytest.mark.parametrize("name", SWEEPS)
def test_the_table_is_what_single_estimates_give(name, tmp_path):
    sweep = _sweep(name)
    rows = _rows(sweep, tmp_path / "o")
    assert len(rows) == sweep.count
    numbers = 0
    for i, row in enumerate(rows):
        spec = sweep.spec(i)
        one = answer_spec(spec)
        measured = one.measured[0].level if one.measured else None
        expected = {"level": one.level, "low": one.low, "high": one.high, "measured": measured}
        assert (row["index"], row["design"], row["diameter_mm"]) == (i, spec.design, spec.diameter_mm)
        assert {key for key in row if key.startswith("edge_")} == {f"edge_{key}" for key in expected}
        for key, single in expected.items():
            assert row[f"edge_{key}"] == (None if single is None else pytest.approx(single, rel=1e-8))
            numbers += single is not None
    assert numbers >= len(rows)  # not a table of nothing


def test_what_validation_refuses_is_refused_here(tmp_path):
    axes = {"layers.0.wall_mm": [1.0, 2.0, 3.0], "layers.0.material": ["ecoflex-00-10", "nonsense", "dragon-skin-30"]}
    sweep = from_file({"base": "embedded", "sweep": axes}, Path(), "test")
    rows = _rows(sweep, tmp_path / "o")
    for i, row in enumerate(rows):
        try:
            sweep.spec(i)
        except Refusal:
            assert row["status"] == "refused"
            assert row["reason"]
        else:
            assert row["status"] == "ok"
    assert [row["status"] for row in rows] == ["ok", "refused", "ok"] * 2 + ["refused"] * 3


def test_the_command_writes_the_same_table_each_time_and_no_folders(tmp_path):
    done = unitcad("batch", "all-materials", "--only", "estimate", "-o", tmp_path / "a", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["ok"] == 50
    assert unitcad("batch", "all-materials", "--only", "estimate", "-o", tmp_path / "b").returncode == 0
    assert bytes_of(tmp_path / "a" / "all-materials") == bytes_of(tmp_path / "b" / "all-materials")
    assert not [path for path in (tmp_path / "a" / "all-materials").iterdir() if path.is_dir()]
    with open(tmp_path / "a" / "all-materials" / "variants.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 50
    assert sum(bool(row["edge_level"]) for row in rows) == 50
    assert sum(bool(row["edge_measured"]) for row in rows) == 12
    again = ("batch", "all-materials", "--only", "estimate", "-o", tmp_path / "a")
    assert unitcad(*again, "--set", "diameter_mm=15").returncode == 2  # another batch's folder


def test_a_table_that_was_interrupted_is_taken_up_where_it_stopped(tmp_path):
    sweep, at = _sweep("zip"), []

    def watch(summary, outcome):
        at.append(outcome and outcome.index)
        if at == [0, 1]:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        estimate_table.write_estimates(sweep, tmp_path / "o", BatchOptions(("estimate",)), watch)
    summary = estimate_table.write_estimates(sweep, tmp_path / "o", BatchOptions(("estimate",)), watch)
    assert at == [0, 1, *range(sweep.count), None]
    assert (summary.resumed, summary.ok) == (2, sweep.count)
    _rows(sweep, tmp_path / "whole")
    tables = [(tmp_path / folder / "batch.json").read_bytes() for folder in ("o", "whole")]
    assert tables[0] == tables[1]

"""Sweep files: what they expand to, and what is refused, with the closest that would do."""

import itertools
import json
from pathlib import Path

import pytest
from batching import ring_sweep, unitcad
from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.errors import Refusal, UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import build_key
from unitcad.pipeline.subjects import subject
from unitcad.sweeps import load_sweep
from unitcad.sweeps.run import count_variants
from unitcad.sweeps.sweep import Range, from_file, known_paths
from unitcad.validation import load, read
from unitcad.validation.load import shipped_files

SOFT, STIFF = "ecoflex-00-10", "dragon-skin-30"


def _sweep(table, base="encapsulating", **more):
    return from_file({"base": base, "sweep": table, **more}, Path(), "test")


def test_a_product_runs_over_every_combination_the_last_path_fastest():
    table = {"layers.0.material": [SOFT, STIFF], "layers.0.wall_mm": {"start": 1.0, "stop": 1.5, "num": 3}, "name": "x"}
    sweep = _sweep(table, base=["encapsulating", "no-fpcb"])
    assert sweep.count == 12
    expected = itertools.product(["encapsulating", "no-fpcb"], [SOFT, STIFF], [1.0, 1.25, 1.5])
    for i, (base, material, wall) in enumerate(expected):
        spec = sweep.spec(i)
        assert sweep.values(i) == (base, {"layers.0.material": material, "layers.0.wall_mm": wall, "name": "x"})
        assert (spec.layers[0].material, spec.layers[0].wall_mm, spec.name) == (material, wall, "x")
        assert (spec.fpcb is None) == (base == "no-fpcb")


def test_a_zip_walks_its_lists_together_and_repeats_what_is_one():
    table = {"mode": "zip", "diameter_mm": [14.0, 15.0, 14.0], "estimate.frequency_hz": 90.0, "motor.fill": [False]}
    sweep = _sweep({**table, "layers.0.material": [SOFT, STIFF, "ecoflex-00-50"]})
    assert [sweep.spec(i).diameter_mm for i in range(sweep.count)] == [14.0, 15.0, 14.0]
    assert {sweep.spec(i).estimate.frequency_hz for i in range(3)} == {90.0}
    assert sweep.spec(2).layers[0].material == "ecoflex-00-50"


def test_cases_name_their_base_and_values():
    cases = [{"diameter_mm": 15.0}, {"base": "single-embedded", "name": "one", "layers.0.wall_mm": 2.4}]
    sweep = _sweep({"mode": "cases", "cases": cases})
    assert [sweep.spec(i).name for i in (0, 1)] == ["encapsulating-diameter15", "one"]
    assert [len(sweep.spec(i).layers) for i in (0, 1)] == [2, 1]
    assert sweep.spec(1).layers[0].wall_mm == 2.4


def test_a_variant_s_folder_carries_the_swept_values():
    walls = {"layers.0.wall_mm": [1.0, 1.2], "layers.1.wall_mm": [1.0], "motor.fill": [True, False], "fpcb.tail": "one"}
    sweep = _sweep({**walls, "moulds.cavities": [[1, 1], [2, 3]], "layers.0.material": [SOFT, STIFF]}, "embedded")
    names = [subject(sweep.spec(i)).folder_name[:-13] for i in range(sweep.count)]
    assert names[0] == "embedded-wall1-fill-cavities1x1-ecoflex-00-10"
    assert names[-1] == "embedded-wall1.2-no-fill-cavities2x3-dragon-s"
    both = _sweep({"layers.0.wall_mm": [1.0, 1.2], "layers.1.wall_mm": [1.1, 1.3]}, "embedded").spec(2)
    assert subject(both).folder_name == f"embedded-wall1-1.2-wall2-1.1-{subject(both).hash[:12]}"
    assert subject(load("embedded", {"name": "com1.5 .x."})).folder_name.startswith("com1-5-x-")  # a device on Windows


def test_whole_tables_and_fixed_values():
    table = {"fpcb": [{"tail": "one"}, {"tail": "both"}], "moulds.cavities": [[1, 1], [1, 2]]}
    sweep = _sweep(table, set={"output.formats": ["stl"]})
    assert [sweep.spec(i).fpcb.tail for i in range(4)] == ["one", "one", "both", "both"]
    assert [sweep.spec(i).moulds.cavities for i in range(2)] == [(1, 1), (1, 2)]
    assert sweep.spec(3).output.formats == ("stl",)


def test_a_range_has_both_its_ends_and_no_digits_of_rounding():
    values = Range(start=1.0, stop=2.0, num=11)
    assert [values[i] for i in range(len(values))] == [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0]
    assert Range(start=3.0, stop=9.0, num=1)[0] == 3.0


@pytest.mark.parametrize(
    ("name", "count", "geometries"), [("published", 15, 4), ("thickness", 32, 32), ("all-materials", 50, 2)]
)
def test_shipped_sweeps_hold_what_they_say(name, count, geometries):
    sweep = load_sweep(name)
    assert sweep.count == count
    specs = [sweep.spec(i) for i in range(count)]
    assert len({build_key(MouldSet(spec), ("unit", "moulds"), True) for spec in specs}) == geometries
    assert set(shipped_files("sweeps")) == {"published", "thickness", "all-materials"}


def test_the_paper_sweep_has_every_measured_unit():
    from unitcad import catalogue

    table = catalogue.measurements()
    sweep = load_sweep("published")
    there = {
        (spec.design, "/".join(layer.material for layer in spec.layers))
        for spec in (sweep.spec(i) for i in range(sweep.count))
    }
    for design, measured in table.designs.items():
        for unit in (*table.controls, *measured.levels, *measured.over_a_control_not_named, *measured.directions):
            assert (design, "/".join(table.layers(unit))) in there


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"layers.0.wal_mm": [1.0]}, ["sweep.layers.0.wal_mm", "nearest accepted: 'layers.0.wall_mm'"]),
        ({"estimate.freq": [1.0]}, ["nearest accepted: 'estimate.frequency_hz'"]),
        ({"diameter": [1.0]}, ["nearest accepted: 'diameter_mm'"]),
        ({"layers.2.wall_mm": [1.0]}, ["sweep.layers.2.wall_mm: the base has no entry 2 of layers: they are 0 to 1"]),
        ({"diameter_mm.x": [1.0]}, ["unknown key"]),
        ({}, ["the sweep is empty"]),
        ({"diameter_mm": []}, ["sweep.diameter_mm", "the sweep is empty"]),
        ({"mode": "cases"}, ["the sweep is empty"]),
        ({"mode": "cases", "cases": [{"nme": 1}]}, ["unknown key"]),
        ({"mode": "cases", "cases": [{}], "diameter_mm": [1.0]}, ["[[sweep.cases]] only"]),
        ({"cases": [{}]}, ["another mode", "cases"]),
        ({"mode": "prodct", "diameter_mm": [14.0]}, ["sweep.mode", "closest: product"]),
        (
            {"mode": "zip", "diameter_mm": [14.0, 15.0], "motor.diameter_mm": [7.0, 7.1, 7.2]},
            ["diameter_mm has 2", "has 3"],
        ),
        ({"diameter_mm": [14.0, 15.0, 14.0]}, ["has 14 twice", "nearest accepted: [14.0, 15.0]"]),
        ({"diameter_mm": {"start": 1.0, "stop": 2.0, "num": 0}}, ["sweep.diameter_mm.num = 0", "nearest accepted: 1"]),
        ({"diameter_mm": {"start": 1.0, "stop": 2.0}}, ["sweep.diameter_mm.num", "is required"]),
        ({"diameter_mm": {"start": 1.0, "stop": 2.0, "num": 1e12}}, ["sweep.diameter_mm.num", "takes a whole number"]),
        ({"diameter_mm": {"start": 1.0, "stop": 2.0, "nmu": 3}}, ["diameter_mm"]),
        ({"diameter_mm": {"start": 1.0, "stop": 1.0, "num": 3}}, ["same value"]),
        ({"diameter_mm": [float("nan")]}, []),
    ],
)
def test_what_can_not_be_is_refused(table, words):
    with pytest.raises(UnitcadError) as refused:
        sweep = _sweep(table)
        sweep.spec(0)
    for word in words:
        assert word in str(refused.value)


def test_a_key_that_no_sweep_file_has():
    with pytest.raises(Refusal, match=r"unknown key.*nearest accepted: 'sweep'"):
        from_file({"base": "embedded", "sweep": {"diameter_mm": [14.0]}, "sweeps": {}}, Path(), "test")


def test_every_path_of_a_spec_may_be_swept():
    data = read("encapsulating")
    paths = known_paths(data)
    assert {"layers.1.cap_mm", "motor.fill", "fpcb.tail", "estimate.frequency_hz", "output.formats"} <= set(paths)
    _sweep({path: 1.0 for path in paths if path not in ("mode", "cases")})


def test_a_thousand_million_variants_are_counted_and_limited(tmp_path):
    axis = {"start": 14.0, "stop": 20.0, "num": 1000}
    sweep = _sweep({"diameter_mm": axis, "layers.0.wall_mm": axis, "layers.1.wall_mm": axis})
    assert sweep.count == 10**9
    with pytest.raises(Refusal, match=r"1000000000.*--limit"):
        count_variants(sweep, None)
    assert count_variants(sweep, 10) == 10
    assert sweep.values(10**9 - 1)[1] == {"diameter_mm": 20.0, "layers.0.wall_mm": 20.0, "layers.1.wall_mm": 20.0}
    file = tmp_path / "big.toml"
    file.write_text(
        'base = "embedded"\n[sweep]\n'
        + "".join(f'"{path}" = {{ start = 14.0, stop = 20.0, num = 1000 }}\n' for path in sweep.paths)
    )
    done = unitcad("batch", file, "-o", tmp_path / "out")
    assert done.returncode == 2
    assert "1000000000" in done.stderr
    assert "--limit" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("diameters", "code", "said"),
    [([0.5, 0.6], 2, "every variant is refused"), ([14.0, 0.5], 0, "variant 1 is refused: diameter_mm = 0.5")],
)
def test_a_dry_run_tells_what_is_refused_and_fails_if_all_is(diameters, code, said, tmp_path):
    sweep = tmp_path / "s.toml"
    sweep.write_text(f'base = "encapsulating"\n[sweep]\ndiameter_mm = {diameters}\n')
    done = unitcad("batch", sweep, "-o", tmp_path / "out", "--dry-run", "--only", "unit")
    assert done.returncode == code
    assert said in done.stderr
    assert "variant 0 is refused: " not in done.stderr


def test_dry_run_counts_and_makes_nothing(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0, 4.0], materials=5)
    done = unitcad("batch", sweep, "-o", tmp_path / "out", "--dry-run", "--json", "--allow-code")
    assert done.returncode == 0, done.stderr
    preview = json.loads(done.stdout)
    assert (preview["variants"], preview["geometries"], preview["exact"]) == (15, 3, True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["publishd"], "closest: published"),
        (["published", "--limit", "0"], "--limit"),
        (["published", "--only", "unitt"], "closest: unit"),
        (["published", "--formats", "stp"], "--formats"),
        (["published", "--set", "diametr_mm=3"], "diameter_mm"),
        (["published", "-j", "0", "--timeout", "3"], "--timeout"),
        (["published", "--only", "estimate", "--scheduler", "tcp://127.0.0.1:9"], "--scheduler"),
        (["no/such.toml"], "no such file"),
    ],
)
def test_asked_wrongly(words, message, tmp_path):
    done = unitcad("batch", *words, cwd=tmp_path)
    assert done.returncode == 2, done.stdout
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("out*"))


def test_a_fault_of_a_base_s_file_is_said_with_file_and_line(tmp_path):
    """Not that of a swept value, nor of one that --set gives."""
    text = 'name = "x"\ndiameter_mm = 14\n[moulds]\nland_mm = -1\n[motor]\nthickness_mm = "thick"\n'
    layers = '[[layers]]\nmaterial = "ecoflex-00-10"\nwall_mm = 1.25\ncap_mm = 1.25\n'
    (tmp_path / "base.toml").write_text(text + 2 * layers)
    (tmp_path / "s.toml").write_text('base = "base.toml"\n[sweep]\ndiameter_mm = [-3, 14]\n')
    sweep = load_sweep(tmp_path / "s.toml").overridden(["moulds.land_mm=-2"])
    with pytest.raises(Refusal) as refused:
        sweep.spec(0)
    said = sweep.faults(0, refused.value)
    assert f"{tmp_path / 'base.toml'}:6: motor.thickness_mm = 'thick'" in said
    assert "; and moulds.land_mm = -2" in said
    assert said.startswith("diameter_mm = -3") or "; and diameter_mm = -3" in said


def test_a_batch_s_folder_is_no_device():
    from unitcad.sweeps.sweep import from_file

    data = {"base": "encapsulating", "name": "Con", "sweep": {"diameter_mm": [14.0, 15.0]}}
    assert from_file(data, Path(), "x").slug == "con-batch"
    assert from_file({**data, "name": "Cone"}, Path(), "x").slug == "cone"


def test_the_shipped_sweeps_are_listed():
    done = CliRunner().invoke(app, ["list", "sweeps"])
    assert [line.split("\t")[0] for line in done.output.splitlines()] == ["all-materials", "published", "thickness"]
    assert all(len(line.split("\t")[1]) > 20 for line in done.output.splitlines())
    assert all(line.endswith(".") for line in done.output.splitlines())

"""`unitcad fit`: its file and results, cast records in it, the shrunk fits, and a fit in `estimate` and `build`."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy import stats
from signals import repeats, wave

from tests.in_process import unitcad
from tests.refusals import refuses
from unitcad.attenuation.edge.closed_form import published_path
from unitcad.attenuation.edge.measured import nominal
from unitcad.attenuation.edge.models import COMPARED, stored
from unitcad.attenuation.edge.ranges import predictive_of, unit_key
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input, estimate_spec, fit_of
from unitcad.files import sha256
from unitcad.lab.fit_command import contents, fit_toml, leads_text, order, sections
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.spec import spec_hash, to_data
from unitcad.sweeps.estimate_table import levels
from unitcad.sweeps.sweep import load_sweep
from unitcad.validation import load

UNITS = [
    {"name": "a", "spec": "embedded", "level": {"value": 0.11, "low": 0.1, "high": 0.12}},
    {"name": "b", "spec": "encapsulating", "frequency_hz": 110.0, "level": {"value": 0.06}},
]


def _written(folder, unit=UNITS, **changes):
    """Write a lab's file; a value of None is left out."""
    units = [{key: value for key, value in one.items() if value is not None} for one in unit]
    path = folder / "lab.toml"
    path.write_text(tomli_w.dumps({"name": "bench", "unit": units, **changes}))
    return str(path)


@pytest.fixture(scope="module")
def bench():
    """The lab that is shipped, fitted."""
    return fit_lab(load_fit_lab("synthetic-bench"))


def test_the_shipped_lab_says_that_it_is_synthetic(bench):
    assert "Synthetic" in bench.lab.settings.note
    made = contents(bench)
    fit = tomllib.loads(made["lab-fit.toml"])
    assert fit["units"] == 3
    assert set(fit["model"]) == set(COMPARED)
    assert fit["leads"] == "rule"
    data = json.loads(made["fit.json"])
    assert len(data["units"]) == 12


def test_the_units_on_which_the_models_differ_most_come_first(bench):
    """The levels of each unit of the lab are those of a fit without it, whose own constants the model has."""
    lab, made = bench.lab, contents(bench)
    rows = json.loads(made["fit.json"])["models_differ_on"]
    assert {row["unit"] for row in rows} == {unit.name for unit in lab.units}
    assert [row["factor"] for row in rows] == sorted((row["factor"] for row in rows), reverse=True)
    levels = rows[0]["levels"]
    assert set(levels) == set(COMPARED) - {"baseline"}
    assert rows[0]["factor"] == pytest.approx(max(levels.values()) / min(levels.values()), rel=1e-5)
    (unit,) = [unit for unit in lab.units if unit.name == rows[0]["unit"]]
    without = fit_lab(replace(lab, units=tuple(other for other in lab.units if other is not unit)))
    path = published_path(nominal(estimate_input(unit.spec, unit.frequency_hz)))
    expected = without.fit.model["published"].constants["s"] * float(path[0])
    assert levels["published"] == pytest.approx(expected, rel=1e-4)
    assert sections(bench)[-1][1][1][0] == unit.name


def test_levels_come_from_a_file_of_measure(tmp_path):
    level = {"distance_mm": 0.0, "value": 0.2, "low": 0.18, "high": 0.22, "frequency_hz": 131.5}
    rows = [
        {"unit": "b", "chain": "line", **level},
        {"unit": "b", "chain": "bandpass", **level, "value": 0.3},
        {"unit": "b", "chain": "line", **level, "distance_mm": 5.0, "value": 0.1},
    ]
    measured = {"status": "measured", "chain": "line", "level": rows}
    (tmp_path / "measured.toml").write_text(tomli_w.dumps(measured))
    unit = {"name": "b", "spec": "embedded", "measured": "measured.toml"}
    lab = load_fit_lab(_written(tmp_path, unit=[UNITS[0], unit]))
    assert (lab.units[1].level.value, lab.units[1].frequency_hz) == (0.2, 131.5)
    assert {one.file for one in lab.inputs} == {"lab.toml", "measured.toml"}
    with pytest.raises(Refusal, match="unknown name"):
        load_fit_lab(_written(tmp_path, unit=[UNITS[0], {**unit, "name": "c"}]))
    (tmp_path / "measured.toml").write_bytes(b"")
    with pytest.raises(Refusal, match="is no file of unitcad measure"):
        load_fit_lab(_written(tmp_path, unit=[UNITS[0], unit]))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"level": None}, "level"),
        ({"measured": "m.toml"}, "level"),
        ({"level": None, "measured": "m.toml"}, "measured"),
        ({"spec": "embeded"}, "spec"),
        ({"spec": None}, "spec"),
        ({"set": {"layers.0.wall_mm": -1}}, "layers.0.wall_mm"),
        ({"level": {"value": 0.2, "low": 0.3, "high": 0.4}}, "level.value"),
        ({"level": {"value": 0.2, "low": 0.1}}, "level.high"),
        ({"level": {"value": -0.2}}, "level.value"),
        ({"frequency_hz": 0.1}, "frequency_hz"),
    ],
)
def test_a_unit_that_can_not_be_meant_is_refused(tmp_path, changes, field):
    with refuses(f"unit.0.{field}"):
        load_fit_lab(_written(tmp_path, unit=[{**UNITS[0], **changes}]))


@pytest.mark.parametrize(
    ("key", "value", "field"),
    [
        ("unit", [], "unit"),
        ("unit", [UNITS[0], UNITS[0]], "unit.1.name"),
        ("include_paper_units", False, "unit"),
        ("moduli", "static", "moduli"),
        ("between_labs", -1.0, "between_labs"),
        ("levels", 3, "levels"),
    ],
)
def test_a_lab_that_can_not_be_meant_is_refused(tmp_path, key, value, field):
    with refuses(field):
        fit_lab(load_fit_lab(_written(tmp_path, **{key: value})))


def test_a_silicone_needs_a_modulus_of_the_chosen_source(tmp_path):
    """Nobody measured Ecoflex 00-50 at the motor's frequency; its tensile test stands."""
    units = [*UNITS, {**UNITS[0], "name": "c", "set": {"layers.0.material": "ecoflex-00-50"}}]
    with pytest.raises(Refusal, match="no modulus is known"):
        fit_lab(load_fit_lab(_written(tmp_path, unit=units)))
    made = fit_lab(load_fit_lab(_written(tmp_path, unit=units, moduli="quasi-static")))
    assert made.fit.moduli == "quasi-static"


def test_the_command_writes_its_files_and_prints_the_null(tmp_path):
    out = tmp_path / "fit"
    done = unitcad("fit", _written(tmp_path), "-o", out)
    assert done.returncode == 0, done.stderr
    assert "baseline" in done.stdout
    assert "rule leads" in done.stdout
    assert done.stdout.splitlines()[-1] == str(out)
    assert sorted(file.name for file in out.iterdir()) == ["fit.json", "fit.svg", "lab-fit.toml"]
    shown = unitcad("fit", _written(tmp_path), "--json")
    assert json.loads(shown.stdout)["fit"] == tomllib.loads((out / "lab-fit.toml").read_text())


def two_labs(folder, own=3):
    """Write units of this lab, of lab b, whose levels are 1.5 times as high, and of two castings of it."""
    kinds = ("single-embedded", "embedded", "encapsulating")
    levels = {"single-embedded": 0.45, "embedded": 0.12, "encapsulating": 0.045}
    units = [{"name": f"a{i}", "spec": kind, "level": {"value": levels[kind]}} for i, kind in enumerate(kinds[:own])]
    for i in range(12):
        level = {"value": 1.5 * levels[kinds[i % 3]] * (1.1 if i < 6 else 1 / 1.1)}
        units.append({"name": f"b{i}", "lab": "b", "batch": f"c{i // 6}", "spec": kinds[i % 3], "level": level})
    return _written(folder, units)


def test_another_lab_s_units_have_that_lab_s_factor(tmp_path):
    result = fit_lab(load_fit_lab(two_labs(tmp_path)))
    rows = {(row["kind"], row["name"]): row for row in json.loads(contents(result)["fit.json"])["effects"]}
    of_b = rows["lab", "b"]
    assert 1 < of_b["factor"] < 1.5 < of_b["high"]  # drawn to 1: three units of this lab do not tell much
    assert rows["batch", "b, c0"]["factor"] > rows["batch", "b, c1"]["factor"]
    assert {name for kind, name in rows if kind == "scatter"} == {"between labs", "between units", "between batches"}
    assert (result.fit.units, [one.lab for one in result.fit.measured]) == (3, [None] * 3 + ["b"] * 12)
    (tmp_path / "lab-fit.toml").write_text(fit_toml(result))
    answer = estimate_spec(load("embedded", {"estimate.fit": str(tmp_path / "lab-fit.toml")}))["answer"]
    assert "fitted to 3 units of bench, 12 of other labs and the 9 of the paper" in answer["lines"][1]
    assert answer["level"] == pytest.approx(0.12, rel=0.15)
    assert [one["level"] for one in answer["measured"]] == [0.12]


def test_without_units_of_its_own_a_lab_has_a_wider_range(tmp_path):
    ends = {}
    for own in (0, 3):
        (tmp_path / "lab-fit.toml").write_text(fit_toml(fit_lab(load_fit_lab(two_labs(tmp_path, own)))))
        done = unitcad(
            "estimate", "embedded", "--fit", tmp_path / "lab-fit.toml", "--set", "layers.0.wall_mm=2", "--json"
        )
        answer = json.loads(done.stdout)["answer"]
        ends[own] = answer["high"] / answer["low"]
        assert answer["measured"] == []
    assert ends[0] > 1.1 * ends[3]
    said = unitcad("fit", two_labs(tmp_path, 0)).stdout
    assert "as without units of the lab's own" in said


def test_units_of_one_cast_record_are_one_batch(tmp_path):
    cast_record(tmp_path, lambda data: data.update(units=[{"cavity": 1}, {"cavity": 2}, {"cavity": 4}]))
    level = {"value": 0.06}
    units = [{"name": f"u{i}", "cast": CAST, "cavity": i, "level": level} for i in (1, 2)]
    units += [{"name": "u4", "cast": CAST, "cavity": 4, "batch": "other", "level": level}]
    units += [{"name": "paper's", "lab": "paper", "spec": "embedded", "level": {"value": 0.1}}]
    result = fit_lab(load_fit_lab(_written(tmp_path, units)))
    assert result.campaigns.batch.tolist() == [-1] * 9 + [0, 0, 1, -1]
    assert result.campaigns.lab.tolist() == [1] * 9 + [0, 0, 0, 1]
    assert list(result.leading.batches) == [0]


LOSSY = {"like": "ecoflex-00-10", "youngs_modulus_kpa": 15, "loss_factor": 1.0}


def thick(folder):
    """Write a lab of eight made-up units whose level falls with the wall, as the published model has it."""
    rng = np.random.default_rng(3)
    units = []
    for i, wall in enumerate((1.0, 1.5, 2.5, 4.0, 6.0, 8.0, 10.0, 12.0)):
        changes = {"layers.0.material": "lossy", "layers.0.wall_mm": wall, "diameter_mm": 45.0}
        spec = load("embedded", {"materials.lossy": LOSSY, **changes})
        level = 0.2 * float(published_path(nominal(estimate_input(spec)))[0]) * np.exp(0.05 * rng.normal())
        units.append({"name": f"u{i}", "spec": "embedded", "set": changes, "level": {"value": level}})
    return _written(folder, units, materials={"lossy": LOSSY})


def test_a_lab_where_thickness_matters_overturns_the_rule(tmp_path):
    """By the written rule: told apart from rule and baseline on the lab's own units, each left out."""
    result = fit_lab(load_fit_lab(thick(tmp_path)))
    assert result.fit.leads == order(result)[0] == "published"
    assert "published leads: x " in leads_text(result)
    (tmp_path / "lab-fit.toml").write_text(fit_toml(result))
    common = {"materials.lossy": LOSSY, "layers.0.material": "lossy", "diameter_mm": 45.0}
    common["estimate.fit"] = str(tmp_path / "lab-fit.toml")
    thin, wide = (
        estimate_spec(load("embedded", {**common, "layers.0.wall_mm": wall}))["answer"] for wall in (2.0, 9.0)
    )
    assert thin["source"]["model"] == "published"
    assert thin["level"] > 1.5 * wide["level"]
    assert "the model published fitted to 8 units of bench and the 9 of the paper" in thin["lines"][1]


def test_a_lab_s_own_units_draw_the_range_of_their_neighbours(tmp_path):
    """The residual of the lab's unit enters at its own lengths; at others the range is wider."""
    fit = fit_lab(load_fit_lab(_written(tmp_path))).fit
    at, near, far = (
        predictive_of([estimate_input(load("embedded", {"diameter_mm": d}))], fit) for d in (14.0, 15.0, 60.0)
    )
    model = COMPARED["rule"]
    own = np.array(list(fit.model["rule"].constants.values()))
    plain = float(model.logs(nominal(estimate_input(load("embedded"))), own)[0])
    residual = np.log(0.11) - plain
    assert fit.measured[0].residual == pytest.approx(residual, abs=1e-5)
    assert at.centre[0] == pytest.approx(plain + 0.5 * residual, abs=1e-3)
    assert abs(far.centre[0] - plain) < abs(near.centre[0] - plain) < abs(at.centre[0] - plain)
    assert at.scale[0] < near.scale[0] < far.scale[0]


def one_kind(folder):
    """Write a lab of eight made-up units of one design and one pair of silicones, which differ in the walls."""
    units = []
    for i, wall in enumerate(np.linspace(1.0, 4.0, 8)):
        changes = {"layers.0.wall_mm": wall, "layers.1.wall_mm": wall, "diameter_mm": 9.0 + 4 * wall}
        units.append({"name": f"u{i}", "spec": "embedded", "set": changes, "level": {"value": 0.2 / wall}})
    return _written(folder, unit=units, include_paper_units=False)


def test_a_lab_of_one_kind_of_unit_gives_a_fit_that_is_taken(tmp_path):
    """No unit tells s from q: that is said. The lab's own measurement leads, and the paper's is in the details only."""
    result = fit_lab(load_fit_lab(one_kind(tmp_path)))
    assert (result.fit.model["rule"].at_bound, result.fit.model["rule"].constants["q"]) == ("q", 1.0)
    made = contents(result)
    assert "rule: the units do not determine q" in made["fit.json"]
    (tmp_path / "lab-fit.toml").write_text(made["lab-fit.toml"])
    fit = {"estimate.fit": str(tmp_path / "lab-fit.toml")}
    assert estimate_spec(load("embedded", {**fit, "diameter_mm": 13.0}))["answer"]["nearest"]["unit"] == "u1"
    found = estimate_spec(load("embedded", fit))["answer"]
    assert found["measured"] == []
    assert found["level"] is not None
    assert found["above"] in (None, pytest.approx(0.2))
    assert "The paper measured 16 % for this unit, in its own lab." in found["details"]
    own = estimate_spec(load("embedded", {**fit, "layers.0.wall_mm": 1, "layers.1.wall_mm": 1, "diameter_mm": 13}))
    assert "Measured on u0: 20 %." in own["answer"]["line"]


WALLS = {1: (1.38, 1.42, 1.40), 2: (1.11, 1.09)}
CAST = "u.cast.json"


def cast_record(folder, change=lambda data: None):
    """Write a cast record: unit 1 without walls, unit 2 with the walls above, unit 3 not usable."""
    spec = load("encapsulating")
    walls = [{"layer": layer, "places_mm": list(places)} for layer, places in WALLS.items()]
    data = {
        "format": "unitcad cast record",
        "version": 1,
        "spec_name": spec.name,
        "spec_hash": spec_hash(spec)[:12],
        "spec": to_data(spec),
        "cast_on": "2026-03-14",
        "pours": [{"index": 1, "material": "ecoflex-00-10", "part_a_g": 10.0}],
        "units": [{"cavity": 1}, {"cavity": 2, "walls": walls}, {"cavity": 3, "usable": False}],
    }
    change(data)
    (folder / CAST).write_text(json.dumps(data))
    return folder / CAST


def cast_fit_file(folder, **unit):
    level = {} if "measured" in unit else {"level": {"value": 0.06, "low": 0.055, "high": 0.065}}
    return _written(folder, [{"name": "b", "cast": CAST, **level, **unit}])


def test_measured_walls_stand_in_for_the_spec_s(tmp_path):
    """The fit computes the unit with the walls that it has, and knows it by the spec that was asked for."""
    cast_record(tmp_path)
    lab = load_fit_lab(cast_fit_file(tmp_path, cavity=2))
    one = lab.units[0]
    assert [layer.wall_mm for layer in one.built.layers] == pytest.approx([1.40, 1.10])
    assert [layer.wall_mm for layer in one.spec.layers] == [1.25, 1.25]
    assert {file.file: file.sha256 for file in lab.inputs}[CAST] == sha256(tmp_path / CAST)
    fit = fit_lab(lab).fit
    direct = {"name": "b", "spec": "encapsulating", "level": {"value": 0.06, "low": 0.055, "high": 0.065}}
    direct["set"] = {"layers.0.wall_mm": 1.4, "layers.1.wall_mm": 1.1}
    typed = fit_lab(load_fit_lab(_written(tmp_path, [direct]))).fit
    for name in COMPARED:
        assert fit.model[name].constants == pytest.approx(typed.model[name].constants, rel=1e-5)
    assert fit.measured[0].key == unit_key(estimate_input(load("encapsulating")))
    assert fit.measured[0].source == "as typed, walls as measured, 1.4, 1.1 mm"


@pytest.mark.parametrize(
    ("unit", "change", "field", "part"),
    [
        ({}, None, "unit.0.cavity", "is required: u.cast.json has the cavities 1, 2, 3"),
        ({"cavity": 9}, None, "unit.0.cavity", "has no such unit; it has 1, 2, 3; nearest accepted: 2"),
        ({"cavity": 3}, None, "unit.0.cavity", "not usable"),
        ({"cavity": 2, "cast": "gone.cast.json"}, None, "unit.0.cast", "no such file"),
        ({"cavity": 2, "spec": "encapsulating"}, None, "unit.0.cast", "excludes spec"),
        ({"cavity": 2, "cast": None, "spec": "encapsulating"}, None, "unit.0.cavity", "there is no cast"),
        ({"cavity": 2, "set": {"layers.0.wall_mm": 1.0}}, None, "unit.0.set", "the record has the spec that was cast"),
        ({"cavity": 2}, lambda d: d.update(version=2), "unit.0.cast", "version = 2: must be at most 1"),
        ({"cavity": 2}, lambda d: d.pop("spec"), "unit.0.cast", "spec: is required here"),
        ({"cavity": 2}, lambda d: d["spec"].update(diameter_mm=3), "unit.0.cast", "diameter_mm"),
        ({"cavity": 2}, lambda d: d["units"][1]["walls"][0].update(layer=3), "unit.0.cast", "the spec has 2 layers"),
        ({"cavity": 2}, lambda d: d["pours"][0].update(material="ecoflex-00-30"), "unit.0.cast", "has ecoflex-00-10"),
    ],
)  # fmt: skip
def test_a_cast_record_that_can_not_be_meant_is_refused(unit, change, field, part, tmp_path):
    cast_record(tmp_path, change or (lambda data: None))
    with refuses(field, part):
        load_fit_lab(cast_fit_file(tmp_path, **unit))


def _campaign(folder):
    repeats(folder, m=wave(250), e=wave(25))
    sensor = '[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'
    records = 'reference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'
    (folder / "c.toml").write_text(f'name = "c"\n{sensor}[[unit]]\nname = "b"\n{records}')
    return folder / "c.toml"


def test_a_campaign_s_unit_goes_into_a_fit_by_its_cast_record(tmp_path):
    cast_record(tmp_path)
    campaign = _campaign(tmp_path)
    done = unitcad("measure", campaign, "-o", tmp_path / "m")
    assert done.returncode == 0, done.stderr
    lab = load_fit_lab(cast_fit_file(tmp_path, cavity=2, measured="m/measured.toml"))
    assert lab.units[0].level.value == pytest.approx(0.1, rel=0.01)
    assert lab.units[0].source == "m/measured.toml, chain line, walls as measured, 1.4, 1.1 mm"


@pytest.fixture(scope="module")
def text(bench):
    return fit_toml(bench)


@pytest.fixture
def fit_file(text, tmp_path):
    path = tmp_path / "lab-fit.toml"
    path.write_text(text)
    return path


def test_the_level_is_by_the_fit_s_constants_with_a_students_t_range(fit_file, text):
    spec = load("embedded", {"estimate.fit": str(fit_file)})
    data, plain = estimate_spec(spec), estimate_spec(load("embedded"))
    fit = tomllib.loads(text)
    gradients = {"rule": [1.0, 1.0]}
    for model, block in data["models"].items():
        one, before, level = fit["model"][model], plain["models"][model], block["edge_level"]["value"]
        s = one["constants"]["s"]
        expected = s / stored()[model]["s"] * before["edge_level"]["value"]
        expected = s * one["constants"]["q"] if model == "rule" else expected
        assert level == pytest.approx(expected, rel=1e-5)
        g = np.array(gradients.get(model, [1.0]))
        scale = one["model_error"] * np.sqrt(1 + g @ np.array(one["covariance"]) @ g)
        ends = np.exp(stats.t.ppf([0.1, 0.9], one["degrees_of_freedom"], np.log(level), scale))
        assert [block["predictive"]["p10"], block["predictive"]["p90"]] == pytest.approx(ends, rel=1e-7)
        error = block["fit_error"]
        assert error["leave_one_out"]["geometric_mean"] == one["leave_one_out"]
        keys = ("own_leave_one_out", "own_by_stored", "coverage")
        assert [error[key] for key in keys] == [one[key] for key in keys]
        assert error["baseline"] == fit["model"]["baseline"]["leave_one_out"]
        assert block["table_error"] == before["table_error"]  # of the stored constants, and said to be
    assert data["table_error"]["constants"].startswith("the stored ones")
    assert data["fit"]["name"] == "synthetic-bench"
    assert data["fit"]["leads"] == data["answer"]["source"]["model"] == "rule"
    assert [own["value"] for own in data["own_measured"]] == [0.098]
    assert estimate_spec(load(spec, {"layers.0.wall_mm": 1.3}))["own_measured"] == []


@pytest.fixture
def with_fit(fit_file):
    """Write a spec beside a fit, which it names."""
    spec = fit_file.with_name("u.toml")
    spec.write_text(Path("templates/embedded.toml").read_text() + '\n[estimate]\nfit = "lab-fit.toml"\n')
    return spec


def test_a_spec_names_its_fit_and_stands_alone(fit_file, with_fit):
    spec = load(str(with_fit))
    assert spec.estimate.fit == "lab-fit.toml"
    fit_file.unlink()
    again = load(spec, {"layers.0.wall_mm": 1.3})
    assert again.estimate.fit_source == spec.estimate.fit_source
    renamed = fit_file.with_name("other.toml")
    renamed.write_text(spec.estimate.fit_source.replace('"synthetic-bench"', '"other"'))
    other = load(spec, {"estimate.fit": str(renamed)})
    assert estimate_spec(other)["fit"]["name"] == "other"
    assert other.estimate.fit == "other.toml"


def test_builds_follow_the_fit(fit_file, text, tmp_path):
    """Another fit is another result; the same fit the same bytes."""

    def built(out, *options):
        done = unitcad("build", "embedded", "--only", "estimate", "-o", tmp_path / out, *options)
        return Path(done.stdout.splitlines()[-1])

    plain, fitted = built("a"), built("a", "--fit", fit_file)
    again = built("b", "--fit", fit_file)
    assert plain.name != fitted.name == again.name
    assert (fitted / "estimate.json").read_bytes() == (again / "estimate.json").read_bytes()
    assert "predictive" in (fitted / "estimate.json").read_text()
    fit_file.write_text(text.replace('"synthetic-bench"', '"other"'))
    assert built("a", "--fit", fit_file).name not in (plain.name, fitted.name)


def test_the_terminal_shows_fit_range_and_own_measurement(fit_file):
    said = unitcad("estimate", "embedded", "--fit", fit_file, "--details").stdout
    for words in ("P10 to P90", "measured here", "synthetic-bench", "rule leads"):
        assert words in said
    own = fit_of(load("embedded", {"estimate.fit": str(fit_file)}))
    _, by_fit = said.split("error by the lab's fit")
    for name in ("rule", "published", "corrected"):
        assert f"x {own.model[name].leave_one_out:.2f}" in by_fit
    assert "9.8 %" in said.splitlines()[1]
    assert "a rule fitted to 3 units of synthetic-bench and the 9 of the paper" in said
    shown = json.loads(unitcad("estimate", "embedded", "--fit", fit_file, "--json").stdout)
    assert len(shown["fit"]["sha256"]) == 64


def test_a_sweep_s_table_takes_the_fit(with_fit):
    text = 'base = "./u.toml"\n[sweep]\n"layers.0.material" = ["ecoflex-00-10"]\n'
    with_fit.with_name("s.toml").write_text(text)
    sweep = load_sweep(with_fit.with_name("s.toml"))
    exact = estimate_spec(load(str(with_fit)))["answer"]
    assert [levels(sweep.spec(0))[f"edge_{key}"] for key in ("level", "low", "high")] == [
        pytest.approx(exact[key], rel=1e-8) for key in ("level", "low", "high")
    ]


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("model.published", None, "model.published: is required"),
        ("model.published.constants", {"kappa": 1.0}, "must be s"),
        ("model.published.constants.s", -1.0, "model.published.constants.s"),
        ("model.published.degrees_of_freedom", 0, "degrees_of_freedom"),
        ("model.rule.covariance", [[1.0]], "needs 2 rows"),
        ("model.rule.covariance", [[1.0, 3.0], [3.0, 1.0]], "is no covariance"),
        ("model.published.model_error", 0.0, "model_error"),
        ("format", 2, "format"),
        ("moduli", "quasi-static", "quasi-static moduli"),
        ("surprise", 1, "surprise"),
    ],
)
def test_a_bad_fit_is_refused(text, path, value, says, tmp_path):
    *way, last = path.split(".")
    data = node = tomllib.loads(text)
    for step in way:
        node = node[step]
    node[last] = value
    if value is None:
        del node[last]
    (tmp_path / "bad.toml").write_text(tomli_w.dumps(data))
    with pytest.raises(Refusal, match=says):
        load("embedded", {"estimate.fit": str(tmp_path / "bad.toml")})


@pytest.mark.parametrize("content", [b"", b"\x00\xff", b"[[[", b"a = 1\n" * 3])
def test_what_is_no_fit_is_refused(content, tmp_path):
    (tmp_path / "bad.toml").write_bytes(content)
    with pytest.raises(Refusal, match=r"estimate\.fit"):
        load("embedded", {"estimate.fit": str(tmp_path / "bad.toml")})
    with pytest.raises(Refusal, match=r"estimate\.fit"):
        load("embedded", {"estimate.fit": "not-there.toml"})

"""`unitcad fit`: what the file may hold, what is refused, what is written."""

from __future__ import annotations

import hashlib
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy import stats
from typer.testing import CliRunner

from unitcad.attenuation.edge.closed_form import crossings, published_path
from unitcad.attenuation.edge.measured import nominal
from unitcad.attenuation.edge.models import COMPARED
from unitcad.attenuation.edge.ranges import predictive_of
from unitcad.cli import app
from unitcad.errors import Refusal, UnitcadError
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.lab.fit_command import contents
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.validation import load

UNITS = [
    {"name": "a", "spec": "embedded", "level": {"value": 0.11, "low": 0.1, "high": 0.12}},
    {"name": "b", "spec": "encapsulating", "frequency_hz": 110.0, "level": {"value": 0.06}},
]


def _written(folder: Path, **changes: object) -> str:
    data = {"name": "bench", "unit": UNITS, **changes}
    path = folder / "lab.toml"
    path.write_text(tomli_w.dumps({key: value for key, value in data.items() if value is not None}))
    return str(path)


def test_the_shipped_lab_says_that_it_is_synthetic_and_gives_the_same_bytes() -> None:
    lab = load_fit_lab("synthetic-bench")
    assert "Synthetic" in lab.settings.note
    made = contents(fit_lab(lab))
    assert made == contents(fit_lab(lab))
    fit = tomllib.loads(made["lab-fit.toml"])
    assert fit["units"] == 3
    assert set(fit["model"]) == set(COMPARED)
    assert fit["leads"] == "rule"
    assert "baseline" in made["fit.md"]
    assert "Synthetic" in made["fit.md"]
    data = json.loads(made["fit.json"])
    assert len(data["units"]) == 12
    assert set(data["by_moduli"]) == {"small-strain", "quasi-static", "data sheet"}


def test_the_units_on_which_the_models_differ_most_come_first() -> None:
    """The levels of each unit of the lab are those of a fit without it, whose own constants the model has."""
    lab = load_fit_lab("synthetic-bench")
    result = fit_lab(lab)
    rows = json.loads(contents(result)["fit.json"])["models_differ_on"]
    assert {row["unit"] for row in rows} == {unit.name for unit in lab.units}
    assert [row["factor"] for row in rows] == sorted((row["factor"] for row in rows), reverse=True)
    for row in rows:
        assert set(row["levels"]) == set(COMPARED) - {"baseline"}
        assert row["factor"] == pytest.approx(max(row["levels"].values()) / min(row["levels"].values()), rel=1e-5)
        unit = next(unit for unit in lab.units if unit.name == row["unit"])
        others = replace(lab, units=tuple(other for other in lab.units if other is not unit))
        without = fit_lab(others).fit.model["crossings"].constants["s"]
        path = crossings(nominal(estimate_input(unit.spec, unit.frequency_hz)))
        assert row["levels"]["crossings"] == pytest.approx(without * float(path[0]), rel=1e-4)
    page = contents(result)["fit.md"]
    assert f"| {rows[0]['unit']} |" in page.partition("## Units on which the models differ most")[2]


def test_levels_come_from_a_file_of_measure(tmp_path: Path) -> None:
    level = {"distance_mm": 0.0, "value": 0.2, "low": 0.18, "high": 0.22, "frequency_hz": 131.5}
    rows = [
        {"unit": "b", "spec": "campaign/u.toml", "chain": "line", **level},
        {"unit": "b", "chain": "bandpass", **level, "value": 0.3},
        {"unit": "b", "chain": "line", **level, "distance_mm": 5.0, "value": 0.1},
    ]
    (tmp_path / "u.toml").write_text(Path("templates/embedded.toml").read_text())
    sha = hashlib.sha256((tmp_path / "u.toml").read_bytes()).hexdigest()
    measured = {
        "status": "measured",
        "chain": "line",
        "level": rows,
        "source": [{"file": "campaign/u.toml", "sha256": sha}],  # as the campaign's file names it
    }
    (tmp_path / "measured.toml").write_text(tomli_w.dumps(measured))
    units = [UNITS[0], {"name": "b", "spec": "u.toml", "measured": "measured.toml"}]
    lab = load_fit_lab(_written(tmp_path, unit=units))
    assert lab.units[1].level.value == 0.2
    assert lab.units[1].frequency_hz == 131.5
    assert {one.file for one in lab.inputs} == {"lab.toml", "u.toml", "measured.toml"}
    (tmp_path / "u.toml").write_text((tmp_path / "u.toml").read_text() + "# changed\n")
    with pytest.raises(Refusal, match="SHA-256 differs"):
        load_fit_lab(_written(tmp_path, unit=units))
    units[1] = {**units[1], "spec": "encapsulating"}
    measured["level"][0]["spec"] = "embedded"
    (tmp_path / "measured.toml").write_text(tomli_w.dumps(measured))
    with pytest.raises(Refusal, match="measured of the template embedded, not encapsulating"):
        load_fit_lab(_written(tmp_path, unit=units))
    (tmp_path / "measured.toml").write_bytes(b"")
    units[1] = {**units[1], "name": "c"}
    with pytest.raises(UnitcadError):
        load_fit_lab(_written(tmp_path, unit=units))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"unit": []}, "unit"),
        ({"unit": [UNITS[0], UNITS[0]]}, "unit.1.name"),
        ({"unit": [{"name": "a", "spec": "embedded"}]}, "unit.0.level"),
        ({"unit": [{**UNITS[0], "measured": "m.toml"}]}, "unit.0.level"),
        ({"unit": [{"name": "a", "spec": "embedded", "measured": "m.toml"}]}, "unit.0.measured"),
        ({"unit": [{**UNITS[0], "spec": "embeded"}]}, "unit.0.spec"),
        ({"unit": [{**UNITS[0], "set": {"layers.0.wall_mm": -1}}]}, "unit.0.layers.0.wall_mm"),
        ({"unit": [{**UNITS[0], "level": {"value": 0.2, "low": 0.3, "high": 0.4}}]}, "unit.0.level.value"),
        ({"unit": [{**UNITS[0], "level": {"value": 0.2, "low": 0.1}}]}, "unit.0.level.high"),
        ({"unit": [{**UNITS[0], "level": {"value": -0.2}}]}, "unit.0.level.value"),
        ({"unit": [{**UNITS[0], "frequency_hz": 0.1}]}, "unit.0.frequency_hz"),
        ({"include_paper_units": False}, "unit"),
        ({"moduli": "static"}, "moduli"),
        ({"between_labs": -1.0}, "between_labs"),
        ({"levels": 3}, "levels"),
    ],
)
def test_what_is_refused(tmp_path: Path, changes: dict, field: str) -> None:
    with pytest.raises(Refusal) as refused:
        fit_lab(load_fit_lab(_written(tmp_path, **changes)))
    assert refused.value.field.startswith(field)


def test_a_silicone_without_a_modulus_leaves_that_source_out(tmp_path: Path) -> None:
    """Nobody measured Ecoflex 00-50 at the motor's frequency; its tensile test and data sheet stand."""
    units = [*UNITS, {**UNITS[0], "name": "c", "set": {"layers.0.material": "ecoflex-00-50"}}]
    with pytest.raises(Refusal, match="no modulus is known"):
        fit_lab(load_fit_lab(_written(tmp_path, unit=units)))
    made = fit_lab(load_fit_lab(_written(tmp_path, unit=units, moduli="quasi-static")))
    assert made.by_source["small-strain"].reason.startswith("unit.2.layers.0")
    assert made.fit.moduli == "quasi-static"
    assert "ecoflex-00-50" in contents(made)["fit.md"]


def test_the_command_writes_four_files_and_prints_the_null(tmp_path: Path) -> None:
    out = tmp_path / "fit"
    done = CliRunner().invoke(app, ["fit", _written(tmp_path), "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "baseline" in done.output
    assert "rule leads" in done.output
    assert done.output.strip().splitlines()[-1] == str(out)
    assert sorted(file.name for file in out.iterdir()) == ["fit.json", "fit.md", "fit.svg", "lab-fit.toml"]
    shown = CliRunner().invoke(app, ["fit", _written(tmp_path), "--json"])
    assert json.loads(shown.output)["fit"] == tomllib.loads((out / "lab-fit.toml").read_text())


def test_units_that_do_not_determine_q_are_named(tmp_path: Path) -> None:
    """Controls alone: nothing states a softer inside does, and the fit says so."""
    names = ("ecoflex-00-10", "dragon-skin-30")
    units = [
        {
            "name": f"u{i}{j}",
            "spec": "single-embedded",
            "set": {"layers.0.material": names[i]},
            "level": {"value": 0.4 + 0.03 * (i + 2 * j)},
        }
        for i in (0, 1)
        for j in range(3)
    ]
    result = fit_lab(load_fit_lab(_written(tmp_path, unit=units, include_paper_units=False)))
    assert result.fit.model["rule"].at_bound == "q"
    assert result.fit.model["rule"].constants["q"] == 1.0
    assert "rule: the units do not determine q" in contents(result)["fit.md"]


def thick(folder: Path, scatter: float) -> str:
    """Write a lab of eight made-up units whose level falls with the wall, as the published model has it."""
    rng = np.random.default_rng(3)
    own = {"like": "ecoflex-00-10", "youngs_modulus_kpa": 15, "loss_factor": 1.0}
    units = []
    for i, wall in enumerate((1.0, 1.5, 2.5, 4.0, 6.0, 8.0, 10.0, 12.0)):
        changes = {"layers.0.material": "lossy", "layers.0.wall_mm": wall, "diameter_mm": 45.0}
        spec = load("embedded", {"materials.lossy": own, **changes})
        level = 0.2 * float(published_path(nominal(estimate_input(spec)))[0]) * np.exp(scatter * rng.normal())
        units.append({"name": f"u{i}", "spec": "embedded", "set": changes, "level": {"value": level}})
    return _written(folder, unit=units, materials={"lossy": own})


def test_a_lab_where_thickness_matters_overturns_the_rule(tmp_path: Path) -> None:
    """By the written rule: told apart from rule and baseline on the lab's own units, each left out."""
    result = fit_lab(load_fit_lab(thick(tmp_path, 0.05)))
    assert result.fit.leads == "published"
    judged = {name: np.abs(one.errors[one.own]) for name, one in result.chosen.judged.items()}
    for other in ("rule", "baseline"):
        assert judged["published"].mean() < judged[other].mean()
        assert stats.wilcoxon(judged["published"], judged[other]).pvalue < 0.05
    assert result.chosen.order[0] == "published"
    assert "published leads: x " in contents(result)["fit.md"]
    (tmp_path / "lab-fit.toml").write_text(contents(result)["lab-fit.toml"])
    lossy = {"materials.lossy": {"like": "ecoflex-00-10", "youngs_modulus_kpa": 15, "loss_factor": 1.0}}
    common = {
        **lossy,
        "layers.0.material": "lossy",
        "diameter_mm": 45.0,
        "estimate.fit": str(tmp_path / "lab-fit.toml"),
    }
    thin, wide = (
        estimate_spec(load("embedded", {**common, "layers.0.wall_mm": wall}))["answer"] for wall in (2.0, 9.0)
    )
    assert thin["model"] == "published"
    assert thin["level"] > 1.5 * wide["level"]
    assert "By published fitted to 8 units of bench and the paper's nine." in thin["lines"][0]


def test_a_lab_whose_units_scatter_about_the_rule_keeps_it(tmp_path: Path) -> None:
    assert fit_lab(load_fit_lab(thick(tmp_path, 0.8))).fit.leads == "rule"


def test_a_lab_s_own_units_draw_the_range_of_their_neighbours(tmp_path: Path) -> None:
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
    assert at.below[0] < near.below[0] < far.below[0]


def one_kind(folder: Path) -> str:
    """Write a lab of eight made-up units of one design and one pair of silicones, which differ in the walls."""
    units = []
    for i, wall in enumerate(np.linspace(1.0, 4.0, 8)):
        changes = {"layers.0.wall_mm": wall, "layers.1.wall_mm": wall, "diameter_mm": 9.0 + 4 * wall}
        units.append({"name": f"u{i}", "spec": "embedded", "set": changes, "level": {"value": 0.2 / wall}})
    return _written(folder, unit=units, include_paper_units=False)


def test_a_lab_of_one_kind_of_unit_gives_a_fit_that_is_taken(tmp_path: Path) -> None:
    """No unit tells s from q: that is said, and the file of the fit is still one."""
    result = fit_lab(load_fit_lab(one_kind(tmp_path)))
    assert "rule: the units do not determine q" in contents(result)["fit.md"]
    (tmp_path / "lab-fit.toml").write_text(contents(result)["lab-fit.toml"])
    answer = estimate_spec(load("embedded", {"estimate.fit": str(tmp_path / "lab-fit.toml"), "diameter_mm": 13.0}))[
        "answer"
    ]
    assert answer["nearest"]["unit"] == "u1"


def test_with_a_fit_the_lab_s_own_measurement_leads(tmp_path: Path) -> None:
    """The paper's level of this unit is in the details only, and the highest level is the lab's."""
    (tmp_path / "lab-fit.toml").write_text(contents(fit_lab(load_fit_lab(one_kind(tmp_path))))["lab-fit.toml"])
    fit = {"estimate.fit": str(tmp_path / "lab-fit.toml")}
    found = estimate_spec(load("embedded", fit))["answer"]
    assert found["measured"] == []
    assert found["level"] == found["p50"] != 0.156
    assert found["highest"] == pytest.approx(0.2)
    assert "The paper measured 16 % for this unit, in its own lab." in found["details"]
    own = estimate_spec(load("embedded", {**fit, "layers.0.wall_mm": 1, "layers.1.wall_mm": 1, "diameter_mm": 13}))
    assert own["answer"]["lines"][0].startswith("20 % of the motor's amplitude at the edge (measured on u0).")

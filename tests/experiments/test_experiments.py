"""`unitcad experiments`: conditions and ratios, what is updated by a measurement, the lab's file, the command."""

from __future__ import annotations

import json
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm

from unitcad.attenuation.edge.fitted_models import path_of
from unitcad.attenuation.edge.level import nominal
from unitcad.errors import Refusal
from unitcad.experiments.draws import Draws
from unitcad.experiments.experiments_command import experiments
from unitcad.experiments.lab_file import Lab, lab_of_data, load_lab
from unitcad.experiments.most_telling import _about_order, decision_between, most_telling
from unitcad.experiments.protocol import Condition, Ratio, ratios
from unitcad.experiments.ranking import Predictions, best_sets, singles
from unitcad.experiments.rivals import available
from unitcad.experiments.study import predictions, study
from unitcad.experiments.study_files import shown, write_study
from unitcad.validation import load

UNITS = {
    "soft inside": {"base": "embedded", "layers.1.material": "dragon-skin-10-medium"},
    "stiff inside": {
        "base": "encapsulating",
        "layers.0.material": "dragon-skin-10-medium",
        "layers.1.material": "ecoflex-00-10",
    },
}
LAB: dict[str, Any] = {
    "units": UNITS,
    "frequencies_hz": [60, 200],
    "bodies": ["forearm", "gel-50kpa"],
    "rivals": ["paper", "crossings", "fitted"],
    "draws": 40,
}


def _lab(**changes: Any) -> Lab:
    return lab_of_data({**LAB, **changes}, Path(), "test")


CONDITIONS = tuple(Condition(u, f, b) for u in "AB" for f in (60.0, 200.0) for b in ("gel", "plate"))


def test_a_ratio_changes_one_thing() -> None:
    found = ratios(CONDITIONS, ["unit", "frequency", "body"])
    assert len(found) == 8 * 3 / 2
    assert all(len(ratio.changed) == 1 for ratio in found)
    assert {ratio.changed for ratio in ratios(CONDITIONS, ["frequency"])} == {("frequency",)}
    assert all(r.above.frequency_hz > r.below.frequency_hz for r in ratios(CONDITIONS[::-1], ["frequency"]))
    assert str(Ratio(CONDITIONS[0], CONDITIONS[1])) == "A at 60 Hz, on gel over plate"


def _gaussian(seed: int = 0, draws: int = 300) -> Predictions:
    """Three rivals whose log readings are independent of each other."""
    rng = np.random.default_rng(seed)
    logs = tuple(rng.normal(m, 0.2, (draws, len(CONDITIONS))) * (np.arange(8) % 3) for m in (0.0, 0.2, -0.3))
    return Predictions(("a", "b", "c"), CONDITIONS, logs, noise=0.1, discrepancy=0.15, seed=1)


def test_the_errors_of_a_ratio_and_of_the_same_comparison_again() -> None:
    predicted = _gaussian()
    for ratio in ratios(CONDITIONS, ["unit", "frequency", "body"]):
        _, covariance = predicted.log_ratios([ratio])
        assert covariance == pytest.approx(np.array([[2 * 0.1**2 + 0.15**2]]))
    at = dict(zip([(c.unit, c.frequency_hz, c.body) for c in CONDITIONS], CONDITIONS, strict=True))
    same = [Ratio(at["A", f, "gel"], at["B", f, "gel"]) for f in (60.0, 200.0)]
    _, covariance = predicted.log_ratios(same)
    assert covariance[0, 1] == pytest.approx(0.15**2 / 2)
    shared = [same[0], Ratio(at["A", 60.0, "gel"], at["A", 60.0, "plate"])]
    _, covariance = predicted.log_ratios(shared)
    assert covariance[0, 1] == pytest.approx(0.1**2 + 0.15**2 / 4)  # the reading that both have in common


def test_a_measurement_updates_rivals_and_draws_by_bayes_rule() -> None:
    predicted = _gaussian(draws=20)
    chosen = ratios(CONDITIONS, ["unit", "body"])[:3]
    values = (1.2, 0.9, 1.4)
    logs, covariance = predicted.log_ratios(chosen)
    likelihood = [
        np.array([multivariate_normal(row, covariance, allow_singular=True).pdf(np.log(values)) for row in log])
        for log in logs
    ]
    updated = predicted.updated(tuple(zip(chosen, values, strict=True)))
    evidence = np.array([one.mean() for one in likelihood])
    assert updated.weights == pytest.approx(evidence / evidence.sum())
    for share, one in zip(updated.shares, likelihood, strict=True):
        assert share == pytest.approx(one / one.sum())
    assert max(updated.effective_draws) < 20


def test_a_set_holds_no_ratio_that_follows_from_the_others() -> None:
    conditions = tuple(Condition(unit, 125.0, "gel") for unit in "ABC")
    logs = tuple(np.random.default_rng(m).normal(m, 0.5, (30, 3)) for m in range(2))
    predicted = Predictions(("a", "b"), conditions, logs, 0.1, 0.15, 1)
    ranked = singles(predicted, ratios(conditions, ["unit"]), lambda stage: None)
    assert len(ranked) == 3  # the third is the quotient of the other two
    sets = best_sets(predicted, ranked, 3, lambda stage: None)
    assert [len(one.ratios) for one in sets] == [1, 2]
    assert sets[1].information.bits > sets[0].information.bits


def test_draws_are_repeatable_and_spread_evenly() -> None:
    draws = Draws(50, 1, "paper")
    found = draws.uniform("kappa")
    assert found == pytest.approx(Draws(50, 1, "paper").uniform("kappa"), rel=0)
    others = (Draws(50, 2, "paper").uniform("kappa"), Draws(50, 1, "x").uniform("kappa"), draws.uniform("gap"))
    assert all(np.abs(other - found).min() > 1e-9 for other in others)
    for group in (found[::2], found[1::2]):
        assert sorted(np.floor(group * 25)) == list(range(25))
    kept = Draws(50, 1, "paper", kept=(7, 3))
    assert kept.uniform("kappa") == pytest.approx(found[[7, 3]], rel=0)
    found = Draws(2000, 1).between("E", 10.0, 40.0)
    assert (found.min(), np.median(found), found.max()) == pytest.approx((10, 20, 40), rel=0.03)


@pytest.mark.parametrize("name", ["paper", "consistent", "crossings"])
def test_a_closed_form_without_unknowns_is_the_model_of_the_estimate(name: str) -> None:
    lab = _lab(modulus_factor=1.0)
    for variant in lab.variants.values():
        (rival,) = available([name]).rivals
        found = rival.levels(variant, Draws(400, 1, name))
        ranges = [layer.tan_delta.ends for layer in variant.layers]
        assert ranges == [(0.1, 0.3)] * 2
        assert found.min() <= float(path_of(name)(nominal(variant))[0]) * (1 + 1e-6)
        assert found.max() >= float(path_of(name)(nominal(variant))[0]) * (1 - 1e-6)
        if name == "crossings":
            assert found == pytest.approx(
                np.full(400, float(path_of(name)(nominal(variant))[0])), rel=1e-4
            )  # Poisson's ratio to 1/2


def test_closed_forms_see_neither_body_nor_frequency() -> None:
    predicted = predictions(_lab(), available(["crossings", "fitted"]).rivals)
    for ratio in ratios(predicted.conditions, ["frequency", "body"]):
        for log in predicted.log_ratios([ratio])[0]:
            assert log == pytest.approx(0.0, abs=1e-12)
        assert predicted.information([ratio]).high < 1e-6


def test_a_measured_ratio_moves_the_rivals_and_is_not_offered_again() -> None:
    reading = {"frequency_hz": 60, "body": "forearm"}
    ends = {"above": {"unit": "soft inside", **reading}, "below": {"unit": "stiff inside", **reading}}
    before = study(_lab())
    first = next(
        one for one in before["experiments"] if one["above"] == ends["above"] and one["below"] == ends["below"]
    )
    value = first["predicted"]["crossings"]["middle"]
    after = study(_lab(measured=[{**ends, "ratio": value}]))
    of = {rival["name"]: rival["probability"] for rival in after["rivals"]}
    assert of["crossings"] == max(of.values()) > 1 / 3
    assert after["most_bits"] < before["most_bits"] == pytest.approx(np.log2(3), rel=1e-5)
    assert len(after["experiments"]) == len(before["experiments"]) - 1


def _reading(unit: str, hertz: float) -> dict[str, Any]:
    return {"unit": unit, "frequency_hz": hertz, "body": "forearm"}


def _measured(unit: str, hertz: float) -> dict[str, Any]:
    return {"measured": [{"above": _reading(unit, hertz), "below": _reading("soft inside", 60), "ratio": 1.0}]}


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"noise": 0.0}, "noise"),
        ({"draws": 5}, "draws"),
        ({"bodies": ["forarm"]}, "bodies.0"),
        ({"bodies": ["forearm", "forearm"]}, "bodies.1"),
        ({"frequencies_hz": [1e6]}, "frequencies_hz.0"),
        (
            {"frequencies_hz": list(range(1, 21)), "units": dict.fromkeys("abcdef", UNITS["soft inside"])},
            "frequencies_hz",
        ),
        ({"rivals": ["crosings"]}, "rivals.0"),
        ({"rivals": ["paper"]}, "rivals"),
        ({"compare": ["unti"]}, "compare.0"),
        ({"compare": ["unit"], "units": {"one": UNITS["soft inside"]}}, "compare"),
        ({"units": {"one": {}}}, "units.one.base"),
        ({"units": {"one": {"base": "embeded"}}}, "units.one.base"),
        ({"units": {"one": {"base": "embedded", "diameter_mm": -1}}}, "units.one.diameter_mm"),
        ({"units": {"one": {"base": "embedded", "layers.0.material": "ecoflex-00-50"}}}, "units.one.layers.0"),
        ({"colour": 1}, "colour"),
        (_measured("soft", 60), "measured.0.above.unit"),
        (_measured("soft inside", 61), "measured.0.above.frequency_hz"),
        (_measured("soft inside", 60), "measured.0"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_not_valid_is_refused_by_its_field(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(Refusal) as refused:
        study(_lab(**changes))
    assert refused.value.field == field
    assert len(str(refused.value)) < 300


def _run(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "unitcad", "experiments", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=120)


def test_the_command_prints_the_same_bytes_again_and_writes_a_folder(tmp_path: Path) -> None:
    words = ("paper", "--rivals", "crossings,fitted", "--compare", "unit", "--draws", "20", "--json", "-o", "found")
    first, second = (_run(*words, folder=tmp_path) for _ in range(2))
    assert (first.returncode, first.stderr) == (0, "")
    assert first.stdout == second.stdout
    data = json.loads(first.stdout)
    assert data == json.loads((tmp_path / "found" / "experiments.json").read_text("utf-8"))
    assert [rival["name"] for rival in data["rivals"]] == ["crossings", "fitted"]
    bits = [one["bits"] for one in data["experiments"]]
    assert bits == sorted(bits, reverse=True)
    assert all(0 <= one["low"] <= one["bits"] <= one["high"] <= data["most_bits"] + 1e-9 for one in data["experiments"])
    plot = ElementTree.fromstring((tmp_path / "found" / "experiments.svg").read_text("utf-8"))
    assert plot.tag.endswith("svg")
    page = (tmp_path / "found" / "experiments.md").read_text("utf-8")
    assert data["settles"] in page
    assert data["experiments"][0]["experiment"] in page
    other = json.loads(_run(*words, "--seed", "2", folder=tmp_path).stdout)
    assert other["experiments"][0]["bits"] != data["experiments"][0]["bits"]


def test_where_nothing_tells_rivals_apart_the_study_says_so_and_lists_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The closed forms alone, compared by frequency and body: every ratio is 1. Once it said "Measure first ..."."""
    monkeypatch.setattr("unitcad.experiments.element_rivals.installed", lambda: False)
    data = study(load_lab("paper", {"draws": 20}))
    assert data["settles"] == (
        "Nothing here tells these rivals apart: the best measurements say 0.00 ± 0.00 of 1.58 bits."
    )
    assert shown(data) == []
    (tmp_path / "experiments.svg").touch()  # of an earlier study
    write_study(data, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"experiments.json", "experiments.md"}
    page = (tmp_path / "experiments.md").read_text("utf-8")
    assert "0.00 ± 0.00 |" not in page
    assert page.index("Left out, needs scikit-fem") < page.index("Nothing here tells")
    assert page.count("needs scikit-fem") == 1


def test_the_terminal_says_what_a_bit_is_what_is_left_out_and_where_the_rest_stands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("unitcad.experiments.element_rivals.installed", lambda: False)
    monkeypatch.setenv("COLUMNS", "100")
    experiments("paper", rivals="all", compare="unit", draws=20)
    text = capsys.readouterr().out
    head = text[: text.index("predicted ratio (10 to 90 %")]
    assert "left out, needs scikit-fem" in head
    assert "One bit decides for certain between two rivals that are equally probable." in head
    assert "Predictions of the first 4; all ratios stand in experiments.json of -o FOLDER." in text
    assert "0.00 ±" not in text
    experiments("paper", draws=20)
    text = capsys.readouterr().out
    assert "Nothing here tells these rivals apart" in text
    assert "Measure first" not in text
    assert "predicted ratio" not in text


def test_the_command_refuses_in_one_line(tmp_path: Path) -> None:
    done = _run("papr", folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: LAB = 'papr': not known; closest: paper; nearest accepted: 'paper'\n"
    assert list(tmp_path.iterdir()) == []


def test_a_lab_may_bring_bodies_and_spec_files(tmp_path: Path) -> None:
    (tmp_path / "unit.toml").write_text(
        'name = "u"\ndesign = "embedded"\ndiameter_mm = 14\n[[layers]]\nmaterial = "ecoflex-00-10"\nwall_mm = 2\n'
    )
    (tmp_path / "lab.toml").write_text(
        'frequencies_hz = [60]\nbodies = ["forearm", "slab"]\n[units.a]\nbase = "unit.toml"\n'
        "[tissue.slab.gel]\ndensity_kg_m3 = 1000\nyoungs_modulus_kpa = 20\npoisson_ratio = 0.49\n"
    )
    lab = load_lab(tmp_path / "lab.toml")
    assert [c.body for c in lab.conditions] == ["forearm", "slab"]
    assert lab.variants[lab.conditions[1]].tissue[0].shear_modulus.middle == pytest.approx(20e3 / 2 / 1.49)


def test_a_lab_may_bring_silicones_of_its_own(tmp_path: Path) -> None:
    """A table as `unitcad material` writes it: of a dynamic test, or of a slow pull where the unit asks for that."""
    (tmp_path / "lab.toml").write_text(
        'frequencies_hz = [60, 200]\nbodies = ["forearm"]\n'
        '[units.dynamic]\nbase = "embedded"\n"layers.0.material" = "our-blend"\n'
        '[units.slow]\nbase = "embedded"\n"layers.0.material" = "our-blend"\n"estimate.moduli" = "quasi-static"\n'
        '[materials.our-blend]\nlike = "ecoflex-00-30"\n'
        'youngs_modulus_kpa = { value = 90.68, low = 85.07, high = 96.67, status = "measured", source = "dma.csv" }\n'
        'loss_factor = { value = 0.1724, low = 0.1657, high = 0.1794, status = "measured", source = "dma.csv" }\n'
        'quasistatic_modulus_kpa = { value = 40, low = 30, high = 50, status = "measured", source = "pull.csv" }\n'
    )
    lab = load_lab(tmp_path / "lab.toml")
    layers = {condition.unit: variant.layers[0] for condition, variant in lab.variants.items()}
    assert layers["dynamic"].youngs_modulus.ends == pytest.approx((85.07e3, 96.67e3))
    assert layers["dynamic"].tan_delta.ends == pytest.approx((0.1657, 0.1794))
    assert layers["slow"].youngs_modulus.ends == pytest.approx((30e3, 50e3))


def test_the_most_telling_experiment_is_the_first_of_a_study_of_the_two() -> None:
    specs = {
        name: load(table["base"], {path: value for path, value in table.items() if path != "base"})
        for name, table in UNITS.items()
    }
    telling = most_telling(("crossings", "fitted"), specs)
    lab = {"frequencies_hz": [60, 125, 200], "bodies": ["rigid-plate", "gel-50kpa"], "draws": 200}
    first = study(_lab(rivals=["crossings", "fitted"], **lab))["experiments"][0]
    assert str(telling.ratio) == first["experiment"]
    assert telling.information.bits == pytest.approx(first["bits"], rel=1e-5)
    for words in (first["experiment"], "crossings", "fitted", "of the one bit between them."):
        assert words in telling.sentence


def _entropy(p: float) -> float:
    return float(-sum(x * np.log2(x) for x in (p, 1 - p) if x > 0))


@pytest.mark.parametrize("middle", [0.0, 0.2, -0.5])
def test_what_a_measurement_says_about_the_order_of_two_candidates(middle: float) -> None:
    """Gaussian rivals, for which the information about the sign of the true log ratio is one integral."""
    conditions, spread = (Condition("A", 125.0, "gel"), Condition("B", 125.0, "gel")), 0.3
    evenly = middle + spread * norm.ppf((np.arange(600) + 0.5) / 600)
    logs = [np.stack([np.random.default_rng(m).permutation(evenly), np.zeros(600)], axis=-1) for m in range(2)]
    predicted = Predictions(("a", "b"), conditions, tuple(logs), noise=0.1, discrepancy=0.15, seed=1)
    found, higher = _about_order(predicted, Ratio(*conditions))
    true, noise = np.hypot(spread, 0.15), np.hypot(0.1, 0.1)
    assert higher == pytest.approx(norm.cdf(middle / true), abs=1e-3)

    def left(y: float) -> float:
        gain = true**2 / (true**2 + noise**2)
        p = norm.cdf((middle + gain * (y - middle)) / (true * np.sqrt(1 - gain)))
        return float(norm.pdf(y, middle, np.hypot(true, noise))) * _entropy(float(p))

    exact = _entropy(float(norm.cdf(middle / true))) - quad(left, middle - 3, middle + 3, limit=200)[0]
    assert found.bits == pytest.approx(exact, abs=max(found.error, 0.02))
    assert found.error < 0.06


def test_a_decision_between_two_candidates() -> None:
    stiff = {"layers.0.material": "dragon-skin-10-medium", "layers.1.material": "ecoflex-00-10"}
    soft = {"layers.0.material": "ecoflex-00-10", "layers.1.material": "dragon-skin-10-medium"}
    known = decision_between({"stiff inside": load("embedded", stiff), "soft inside": load("embedded", soft)})
    assert known.first_higher > 0.99
    assert known.sentence.startswith("No measurement is needed to order the two: stiff inside has the higher level")
    asked = {"flat": load("encapsulating"), "three layers": load("three-layer")}
    found = decision_between(asked)
    assert found.sentence.startswith("Measure flat over three layers, at 125 Hz on forearm: crossings ")
    assert found.sentence.count(".\n") == 0
    assert 0.1 < found.order.bits < found.open_bits <= 1
    assert found.open_bits == pytest.approx(_entropy(found.first_higher))
    assert found.predicted["bush"]["low"] > 2 > 1 > found.predicted["crossings"]["low"]
    assert found == decision_between(asked)
    turned = decision_between({"three layers": asked["three layers"], "flat": asked["flat"]})
    assert turned.first_higher == pytest.approx(1 - found.first_higher, abs=0.05)
    # Each at its own frequency: the small motor turns faster.
    small = decision_between({"small": load("motor-10mm"), "flat": load("encapsulating")})
    assert [end.frequency_hz for end in (small.ratio.above, small.ratio.below)] == [225.0, 125.0]


def test_candidates_that_cannot_be_compared_are_refused() -> None:
    one = {"one": load("embedded")}
    with pytest.raises(Refusal, match="two candidates are compared"):
        decision_between(one)
    with pytest.raises(Refusal, match=r"units\.other\.layers\.0"):
        decision_between({**one, "other": load("embedded", {"layers.0.material": "ecoflex-00-50"})})
    with pytest.raises(Refusal, match=r"rivals\.0"):
        decision_between({**one, "other": load("encapsulating")}, rivals=["crosings"])

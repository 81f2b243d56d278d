"""What would decide between the best two, and what a measurement of a candidate says about the wish."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from unitcad.attenuation.edge.lab_fit import LabFit, ModelFit
from unitcad.attenuation.edge.predictive import predictive_of
from unitcad.estimating import estimate_input
from unitcad.experiments.most_telling import decision_between
from unitcad.search.best_two import below_by_ranking, best_two
from unitcad.search.design_words import first_other, level_line
from unitcad.search.proposals import invert
from unitcad.search.target_file import load_target, target_of
from unitcad.validation import load

THIN_CAP = load("encapsulating", {"layers.1.cap_mm": 0.6})


def _data(**tables: Any) -> dict[str, Any]:
    return {"target": {"edge_max": 0.06}, **tables}


@pytest.fixture(scope="module")
def quiet() -> dict[str, Any]:
    return invert(load_target("quiet-edge"), check=False).data


def test_the_sentence_has_the_rankings_models_and_says_where_it_differs(quiet: dict[str, Any]) -> None:
    decision = quiet["decision"]
    assert decision["weights"] == quiet["models"]["weights"]
    assert set(decision["predicted"]) == {"bush", "crossings"}
    assert decision["first_below_by_ranking"] > 0.5 > decision["first_below"]
    assert quiet["decides"] == (
        f"The ranking expects #1 below #2 ({100 * decision['first_below_by_ranking']:.0f} %); the same models held to "
        f"the measured levels of their kinds expect the reverse ({100 - 100 * decision['first_below']:.0f} %): "
        "the order is open. Cast and measure both."
    )


def test_where_both_were_measured_the_sentence_follows_the_measurements() -> None:
    """By the moduli of a slow pull the models put the unit that was measured at 4 % above the one at 5.17 %."""
    at_hand = {"materials": ["ecoflex-00-10", "dragon-skin-30", "dragon-skin-10-medium"]}
    made = invert(target_of(_data(at_hand=at_hand, estimate={"moduli": "quasi-static"})), check=False)
    data, decision = made.data, made.data["decision"]
    assert [one["measured"]["level"] for one in data["proposals"][:2]] == [0.0517, 0.04]
    assert decision["weights"] == data["models"]["weights"]
    assert decision["first_below_by_ranking"] > 0.8
    assert data["decides"] == (
        "The two best were measured, #1 printed as 5.17 % and 4.58 %, #2 as 4 %, each unit once. By its measurement "
        "#2 is the lower; the ranking, which has the models alone, expects the reverse "
        f"({100 * decision['first_below_by_ranking']:.0f} %). To be sure of the order cast and measure both again."
    )
    both = list(zip(made.specs[:2], data["proposals"][:2], strict=True))

    def said(first: dict[str, Any], second: dict[str, Any]) -> str:
        own = [{**one, "measured": {**one["measured"], **m}} for (_, one), m in zip(both, (first, second), strict=True)]
        return str(best_two(target_of(_data()), [spec for spec, _ in both], own)[0])

    assert "#1 is the lower" in said({"level": 0.03, "also": None}, {})
    assert "leave the order of the two open" in said({"level": 0.05, "also": 0.039}, {})
    assert "By its measurement" not in said({"by": "your lab (a)"}, {})


def test_weights_count_in_a_decision() -> None:
    specs = {"flat": load("encapsulating"), "thin cap": THIN_CAP}
    alone = decision_between(specs, ["crossings"]).first_higher
    assert decision_between(specs, {"crossings": 1.0, "bush": 0.0}).first_higher == pytest.approx(alone, abs=1e-9)
    both = [decision_between(specs, {"crossings": 1.0 - w, "bush": w}).first_higher for w in (0.1, 0.5, 0.9)]
    assert both[1] - both[0] == pytest.approx(both[2] - both[1], abs=1e-6)
    assert abs(both[2] - both[0]) > 0.1


def test_the_order_by_the_ranking_is_that_of_drawn_levels() -> None:
    pair = [predictive_of([estimate_input(spec)]) for spec in (load("encapsulating"), THIN_CAP)]
    rng, drawn = np.random.default_rng(2), []
    one = pair[0]
    for k, weight in enumerate(one.weights):
        t = rng.standard_t(one.degrees_of_freedom[k], (2, 200_000))
        levels = [p.centre[0, k] + p.scale[0, k] * each for p, each in zip(pair, t, strict=True)]
        drawn.append(weight * np.mean(levels[0] < levels[1]))
    assert below_by_ranking(pair) == pytest.approx(sum(drawn), abs=3e-3)
    assert below_by_ranking(pair[::-1]) == pytest.approx(1 - sum(drawn), abs=3e-3)


def _fit(kappa: float) -> LabFit:
    ends: dict[str, Any] = {key: {} for key in ("low", "high", "stored")} | {"left_out_low": 1.1, "left_out_high": 1.3}
    one = ModelFit(
        constants={"s": 1.0, "kappa": kappa},
        covariance=[[0.1, 0.0], [0.0, 1e-6]],
        discrepancy=0.2,
        degrees_of_freedom=5,
        left_out=1.2,
        **ends,
    )
    rest = structs.replace(one, constants={"s": 1.0}, covariance=[[0.1]])
    return LabFit(
        format=1, name="lab", units=7, moduli="dynamic", with_paper=True, between_labs=1.0, seed=1,
        model={"fitted": one, **dict.fromkeys(("bush", "paper", "consistent"), rest)}, null=rest,
    )  # fmt: skip


def test_a_labs_fit_gives_its_own_constants() -> None:
    """The divider's ratio of two units is (1 + kappa p1 c1)/(1 + kappa p2 c2): kappa moves it."""
    specs = {"a": load("encapsulating"), "b": load("embedded")}
    ratios = [
        decision_between(specs, {"fitted": 1.0}, fit=_fit(kappa)).predicted["fitted"]["middle"] for kappa in (0.01, 5.0)
    ]
    assert ratios[0] > 0.7
    assert ratios[1] == pytest.approx(0.5, abs=0.05)


def test_two_of_one_level_are_the_same_for_a_purpose() -> None:
    target = load_target("amplify")
    made = invert(target, check=False)
    by_name = {one["name"]: (spec, one) for one, spec in zip(made.data["proposals"], made.specs, strict=True)}
    slow, fast = (by_name[f"encapsulating-{name}-1.25-1.25"] for name in ("d30-e10", "d10-e10"))
    sentence, _ = best_two(replace(target), [slow[0], fast[0]], [{**slow[1], "measured": None}, fast[1]])
    assert sentence is not None
    assert sentence.startswith("#1 and #2 are the same for your purpose: their levels' ratio is ")
    hours = [f"{one[1]['cure_hours']:.3g}" for one in (fast, slow)]
    assert sentence.endswith(f"Take the faster, #2: {hours[0]} h against {hours[1]} h.")


def test_a_control_of_a_design_that_is_not_said_is_one_unit() -> None:
    vary = {"wall_mm": [2.5, 2.5], "layers": [1]}
    made = invert(
        target_of({"target": {"edge_max": 0.5}, "vary": vary, "at_hand": {"materials": ["dragon-skin-10-medium"]}}),
        check=False,
    ).data
    assert [one["design"] for one in made["proposals"]] == ["encapsulating", "embedded"]
    assert made["decides"].startswith("One unit of this silicone was measured, 39.5 %, once; of which of the two")
    assert all("of which design is not said" in level_line(one) for one in made["proposals"])


def test_a_unit_measured_outside_the_wish_is_no_proposal() -> None:
    data = invert(target_of({"target": {"edge_min": 0.1, "edge_max": 0.2}}), check=False).data["proposals"]
    measured = {one["name"]: one for one in data if one["measured"]}
    outside = measured["embedded-e10-d10-1.25-1.25"]
    assert outside["nearest_other"]
    assert "measured 8.9 % (the paper): outside the wish" in level_line(outside)
    assert not data[0]["nearest_other"]
    assert [one["nearest_other"] for one in data] == sorted(one["nearest_other"] for one in data)
    assert [one["rank"] for one in data] == list(range(1, len(data) + 1))


def test_what_is_less_probable_than_asked_for_is_called_so() -> None:
    data = invert(load_target("paper"), check=False).data["proposals"]
    assert first_other(data) == 3
    assert "probability 0.10, below your 50 %, " in level_line(data[2])
    assert "measured 5.2 % (the paper, also printed as 4.6 %): meets the wish" in level_line(data[0])


def test_a_unit_that_was_measured_within_the_wish_is_never_refused() -> None:
    wish = {"edge_max": 0.042, "probability_min": 0.6}
    data = invert(target_of(_data(target=wish, estimate={"models": ["crossings", "fitted"]})), check=False).data
    assert data["proposals"][0]["name"] == "encapsulating-e10-d10-1.25-1.25"
    assert data["proposals"][0]["measured"]["meets"]
    assert not data["proposals"][0]["nearest_other"]

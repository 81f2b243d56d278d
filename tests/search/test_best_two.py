"""The order of the best two, and what a measurement of a candidate says about the wish."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from unitcad.attenuation.edge.predictive import predictive_of
from unitcad.estimating import estimate_input
from unitcad.search.design_text import is_first_other, level_line
from unitcad.search.proposals import below_by_ranking, best_two, invert
from unitcad.search.target_file import load_target, target_of
from unitcad.validation import load


def _data(**tables: Any) -> dict[str, Any]:
    return {"target": {"edge_max": 0.06}, **tables}


@pytest.fixture(scope="module")
def quiet() -> dict[str, Any]:
    return invert(load_target("quiet-edge"), check=False).data


def test_the_sentence_has_the_order_that_the_ranking_expects(quiet: dict[str, Any]) -> None:
    decision = quiet["decision"]
    assert decision["weights"] == quiet["models"]["weights"]
    assert decision["ratios"].keys() == quiet["models"]["weights"].keys()
    assert 0.55 < decision["first_below"] < 0.99
    assert quiet["decides"] == f"The ranking expects #1 below #2 ({100 * decision['first_below']:.0f} %)."


def test_the_ratio_of_the_best_two_is_that_of_their_estimates(quiet: dict[str, Any]) -> None:
    both = [one["by_model"] for one in quiet["proposals"][:2]]
    levels = [
        predictive_of([estimate_input(spec)], [model]).quantile(0.5)[0]
        for model in both[0]
        for spec in invert(load_target("quiet-edge"), check=False).specs[:2]
    ]
    ratios = [first / second for first, second in zip(levels[::2], levels[1::2], strict=True)]
    assert list(quiet["decision"]["ratios"].values()) == pytest.approx(ratios, rel=1e-6)


def test_where_both_were_measured_the_sentence_follows_the_measurements() -> None:
    """By the moduli of a slow pull the models put the unit that was measured at 4 % above the one at 5.17 %."""
    at_hand = {"materials": ["ecoflex-00-10", "dragon-skin-30", "dragon-skin-10-medium"]}
    made = invert(target_of(_data(at_hand=at_hand, estimate={"moduli": "quasi-static"})), check=False)
    data, decision = made.data, made.data["decision"]
    assert [one["measured"]["level"] for one in data["proposals"][:2]] == [0.0517, 0.04]
    assert decision["weights"] == data["models"]["weights"]
    assert decision["first_below"] > 0.8
    assert data["decides"] == (
        "#1 was measured at 5.17 % and 4.58 %, #2 at 4 %: #2 is the lower; by the models alone "
        f"the ranking expects #1 below #2 ({100 * decision['first_below']:.0f} %)."
    )
    both = list(zip(made.specs[:2], data["proposals"][:2], strict=True))

    def said(first: dict[str, Any], second: dict[str, Any]) -> str:
        own = [{**one, "measured": {**one["measured"], **m}} for (_, one), m in zip(both, (first, second), strict=True)]
        return str(best_two(target_of(_data()), [spec for spec, _ in both], own)[0])

    assert "#1 is the lower" in said({"level": 0.03, "also": None}, {})
    assert "which one is lower stays open" in said({"level": 0.05, "also": 0.039}, {})
    assert "was measured at" not in said({"by": "your lab (a)"}, {})


def test_the_order_by_the_ranking_is_that_of_drawn_levels() -> None:
    pair = [predictive_of([estimate_input(load(name))]) for name in ("encapsulating", "three-layer")]
    rng, drawn = np.random.default_rng(2), []
    one = pair[0]
    for k, weight in enumerate(one.weights):
        t = rng.standard_t(one.degrees_of_freedom[k], (2, 200_000))
        levels = [p.centre[0, k] + p.scale[0, k] * each for p, each in zip(pair, t, strict=True)]
        drawn.append(weight * np.mean(levels[0] < levels[1]))
    assert below_by_ranking(pair) == pytest.approx(sum(drawn), abs=3e-3)
    assert below_by_ranking(pair[::-1]) == pytest.approx(1 - sum(drawn), abs=3e-3)


def test_two_of_one_level_are_the_same_for_a_purpose() -> None:
    target = load_target("amplify")
    made = invert(target, check=False)
    by_name = {one["name"]: (spec, one) for one, spec in zip(made.data["proposals"], made.specs, strict=True)}
    slow, fast = (by_name[f"encapsulating-{name}-1.25-1.25"] for name in ("d30-e10", "d10-e10"))
    sentence, _ = best_two(replace(target), [slow[0], fast[0]], [{**slow[1], "measured": None}, fast[1]])
    assert sentence is not None
    assert sentence.startswith(
        "#1 and #2 are the same for your purpose: the ranking expects levels with a ratio of 1.02. "
    )
    hours = " and ".join(f"{one[1]['cure_hours']:.3g}" for one in (slow, fast))
    assert sentence.endswith(f"They are out of the mould in {hours} h.")


def test_a_control_of_a_design_that_is_not_said_is_one_unit() -> None:
    vary = {"wall_mm": [2.5, 2.5], "layers": [1]}
    made = invert(
        target_of({"target": {"edge_max": 0.5}, "vary": vary, "at_hand": {"materials": ["dragon-skin-10-medium"]}}),
        check=False,
    ).data
    assert [one["design"] for one in made["proposals"]] == ["encapsulating", "embedded"]
    assert "39.5 %, #2 at 39.5 %: which one is lower stays open" in made["decides"]
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
    assert [i for i in range(len(data)) if is_first_other(data, i)] == [2]
    assert "probability 0.10, below your 50 %, " in level_line(data[2])
    assert "measured 5.2 % (the paper, also printed as 4.6 %): meets the wish" in level_line(data[0])


def test_a_unit_that_was_measured_within_the_wish_is_never_refused() -> None:
    wish = {"edge_max": 0.042, "probability_min": 0.6}
    data = invert(target_of(_data(target=wish, estimate={"models": ["crossings", "fitted"]})), check=False).data
    assert data["proposals"][0]["name"] == "encapsulating-e10-d10-1.25-1.25"
    assert data["proposals"][0]["measured"]["meets"]
    assert not data["proposals"][0]["nearest_other"]

"""What a result says of itself: specs that keep the models, what was not measured, refusals, the ranking."""

from __future__ import annotations

import csv
import itertools
from typing import Any

import pytest

from unitcad.errors import Refusal, UnknownKey
from unitcad.estimating import estimate_spec
from unitcad.inverse.design_files import ranking
from unitcad.inverse.design_words import explanation_lines, reasons, size_line, title
from unitcad.inverse.explanation import explain
from unitcad.inverse.proposals import Inversion, invert
from unitcad.inverse.target_file import load_target, target_of

FIELD = "target.edge_max"


def _target(vary: dict[str, Any] | None = None, **wish: Any) -> Inversion:
    return invert(target_of({"target": {"edge_max": 0.2, **wish}, "vary": vary or {}}), check=False)


@pytest.fixture(scope="module")
def paper() -> Inversion:
    return invert(load_target("paper"), check=False)


@pytest.fixture(scope="module")
def quiet() -> Inversion:
    return invert(load_target("quiet-edge"), check=False)


def test_the_estimate_of_a_proposals_spec_has_its_range(paper: Inversion, quiet: Inversion) -> None:
    for made in (paper, quiet):
        for spec, one in zip(made.specs, made.data["proposals"], strict=True):
            answer = estimate_spec(spec)["answer"]
            ends = [answer[end] for end in ("p10", "p50", "p90")]
            assert ends == pytest.approx([one["edge"][end] for end in ("p10", "p50", "p90")], rel=1e-6)
            assert answer["weights"] == pytest.approx(made.data["models"]["weights"])
    assert paper.specs[0].estimate.models == ("fitted", "paper")


def test_lengths_of_no_measured_number_of_layers_are_not_called_measured() -> None:
    one = _target({"layers": [3], "wall_mm": [1.0, 1.0]}).data["proposals"][0]
    notes = " | ".join(one["relies_on"])
    assert "no unit of 3 layers was measured" in notes
    assert "0.83" not in notes


def test_only_lengths_that_some_candidate_has_are_counted(paper: Inversion) -> None:
    two = {"target": {"edge_max": 0.6}, "at_hand": {"materials": ["ecoflex-00-10"]}}
    tried = invert(target_of(two), check=False).data["tried"]
    assert (tried["candidates"], tried["geometries"]) == (10, 10)
    assert paper.data["tried"]["geometries"] == 60


def test_lengths_that_were_never_measured_stand_in_the_title(paper: Inversion, quiet: Inversion) -> None:
    assert title(quiet.data["proposals"][0]).endswith("walls 1.75 and 1 mm (not measured at these lengths)")
    assert title(paper.data["proposals"][0]).endswith("walls 1.25 and 1.25 mm")


def test_a_frequency_that_no_model_reads_is_said() -> None:
    notes = _target(frequency_hz=216.6667).data["proposals"][0]["relies_on"]
    assert "217 Hz: measured was at 125 Hz, and no model here reads it" in notes


def test_the_ranking_has_the_proposals_numbers_and_the_measurements(quiet: Inversion) -> None:
    rows = list(csv.DictReader(ranking(quiet).splitlines()))
    p = [float(row["probability"]) for row in rows]
    assert all(first >= second - 2e-6 for first, second in itertools.pairwise(p))
    numbered = {row["name"]: row["proposal"] for row in rows if row["proposal"]}
    of_grid = {one["name"]: str(one["rank"]) for one in quiet.data["proposals"] if not one["refined"]}
    assert numbered == of_grid
    measured = {row["name"]: row["measured"] for row in rows if row["measured"]}
    assert measured["encapsulating-e10-d30-1.25-1.25"] == "0.0517"
    assert all("1.25-1.25" in name for name in measured)


def test_crosstalk_that_tells_no_designs_apart_and_the_level_at_the_neighbour(quiet: Inversion) -> None:
    one = quiet.data["proposals"][0]
    at = one["crosstalk"]["value"] * one["edge"]["p50"]
    assert one["crosstalk"]["neighbour"] == pytest.approx(at, rel=1e-6)
    assert any("the same for every unit of 14 mm and tells no designs apart" in line for line in reasons(one))


def test_a_mass_is_shown_as_exactly_as_its_limit() -> None:
    one = _target({"wall_mm": [1.5, 1.5]}, mass_max_g=1.052).data["proposals"][0]
    assert f"{one['mass_g']:.3g} g with motor" in size_line(one)


def test_another_diameter_and_a_unit_that_was_not_tried_are_explained(paper: Inversion, quiet: Inversion) -> None:
    why = explain(paper, "motor-10mm")["reasons"]
    assert any("diameters of 14 to 15.2 mm are tried, and this one's is 17" in line for line in why)
    head = explanation_lines(explain(quiet, "three-layer"))[0]
    assert head.endswith("if it were tried")


def test_every_wish_that_is_impossible_alone_has_its_nearest() -> None:
    wish: dict[str, Any] = {"height_max_mm": 2.0, "cure_hours_max": 3.0}
    with pytest.raises(Refusal, match=r"target\.height_max_mm = 2: 2\.11 mm .*target\.cure_hours_max = 3: 4\.\d+ h"):
        _target(**wish)


def test_a_crosstalk_that_is_out_of_reach_says_what_reaches_it() -> None:
    with pytest.raises(Refusal, match=r"a larger target\.pitch_mm or other vary\.diameter_mm") as refused:
        _target(crosstalk_ratio_max=0.3, pitch_mm=20)
    assert "not tried, without a modulus: ecoflex-00-30" in str(refused.value)


def test_what_is_typed_in_per_cent_has_a_nearest() -> None:
    with pytest.raises(Refusal) as refused:
        target_of({"target": {"edge_max": "6 %"}})
    assert (refused.value.field, refused.value.nearest) == (FIELD, 0.06)


def test_an_unknown_key_points_at_the_targets_schema() -> None:
    with pytest.raises(UnknownKey, match="`unitcad schema target` lists all"):
        target_of({"target": {"edge_max": 0.06, "crosstalk": 0.3}})

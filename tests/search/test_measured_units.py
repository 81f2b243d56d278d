"""What a measurement of a candidate says about the target."""

from unitcad.search.design_files import level_line
from unitcad.search.proposals import invert
from unitcad.search.target_file import load_target, target_of


def _data(**tables):
    return {"target": {"edge_max": 0.06}, **tables}


def test_a_control_of_a_design_that_is_not_said_is_one_unit():
    vary = {"wall_mm": [2.5, 2.5], "layers": [1]}
    made = invert(
        target_of({"target": {"edge_max": 0.5}, "vary": vary, "at_hand": {"materials": ["dragon-skin-10-medium"]}}),
        check=False,
    ).data
    assert [one["design"] for one in made["proposals"]] == ["embedded", "encapsulating"]
    assert all("the paper, which does not name the design" in level_line(one) for one in made["proposals"])


def test_a_unit_measured_outside_the_goals_is_no_proposal():
    data = invert(target_of({"target": {"edge_max": 0.085}}), check=False).data["proposals"]
    names = [one["name"] for one in data]
    assert "embedded-e10-d10-1.25-1.25" not in names  # measured: 8.9 %
    assert [one["measured"] is None for one in data] == sorted(one["measured"] is None for one in data)
    assert [one["rank"] for one in data] == list(range(1, len(data) + 1))
    data = invert(load_target("published"), check=False).data["proposals"]
    assert "The measurement (5.2 %, also printed as 4.6 %, the paper) meets the target." in level_line(data[1])


def test_a_unit_that_was_measured_within_the_goals_is_never_refused():
    goals = {"edge_max": 0.042, "probability_min": 0.6}
    data = invert(target_of(_data(target=goals)), check=False).data
    assert data["proposals"][0]["name"] == "encapsulating-e10-d10-1.25-1.25"
    assert data["proposals"][0]["measured"]["meets"]

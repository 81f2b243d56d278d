"""What a result says of itself: specs that keep the models, what was not measured, refusals, the ranking."""

import csv
import html
import itertools

import pytest

from unitcad.attenuation.curve import crosstalk_ratio
from unitcad.errors import Refusal, UnknownKey
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.search.design_files import contents, explanation_lines, head_lines, lines, ranking, title
from unitcad.search.proposals import explain, invert
from unitcad.search.target_file import load_target, target_of
from unitcad.spec import to_data, to_toml
from unitcad.validation import from_data, load


def _target(vary=None, **goals):
    return invert(target_of({"target": {"edge_max": 0.2, **goals}, "vary": vary or {}}), check=False)


@pytest.fixture(scope="module")
def paper():
    return invert(load_target("published"), check=False)


@pytest.fixture(scope="module")
def quiet():
    return invert(load_target("quiet-edge"), check=False)


def test_the_estimate_of_a_proposals_spec_has_its_range(quiet):
    for spec, one in zip(quiet.specs, quiet.data["proposals"], strict=True):
        answer = estimate_spec(spec)["answer"]
        assert {end: answer[end] for end in ("p10", "p50", "p90")} == pytest.approx(one["edge"], rel=1e-6)
        assert answer["model"] == quiet.data["leads"]["model"] == "rule"


def test_lengths_that_were_never_measured_stand_in_the_title(paper, quiet):
    thick = _target({"layers": [2], "wall_mm": [1.5, 1.5]}).data["proposals"][0]
    assert title(thick).endswith("walls 1.5 and 1.5 mm (not measured at these lengths)")
    for made in (paper, quiet):
        assert title(made.data["proposals"][0]).endswith("walls 1.25 and 1.25 mm")


def test_a_frequency_that_nobody_measured_at_is_said():
    one = _target(frequency_hz=216.6667).data["proposals"][0]
    assert "frequency" in one["relies_on"]
    assert any(line.startswith("the nearest measured unit differs in") and "frequency" in line for line in lines(one))


def test_what_the_evidence_ranks_and_what_not_is_said(quiet):
    said = head_lines(quiet.data)
    assert said[1].startswith(
        "probabilities by rule, fitted to the paper's nine levels; ranked by design and which side"
    )
    unranked = "walls, caps, diameter, frequency, or silicones with the same side soft"
    assert said[2] == f"not ranked by {unranked}, except by an assumed line below a ratio of 16.7"
    second = lines(quiet.data["proposals"][1])
    assert second[0] == "as likely as number 1; among equals the unit that is easier to make comes first"
    page = contents(quiet, "x")
    assert all(said[2] in page[name].decode() for name in ("design.md", "design.html"))


def test_the_ranking_has_the_proposals_numbers_and_the_measurements(quiet):
    rows = list(csv.DictReader(ranking(quiet).splitlines()))
    p = [float(row["probability"]) for row in rows]
    assert all(first >= second - 2e-6 for first, second in itertools.pairwise(p))
    numbered = {row["name"]: row["proposal"] for row in rows if row["proposal"]}
    assert numbered == {one["name"]: str(one["rank"]) for one in quiet.data["proposals"]}
    measured = {row["name"]: row["measured"] for row in rows if row["measured"]}
    assert measured["encapsulating-e10-d30-1.25-1.25"] == "0.0517"
    assert all("1.25-1.25" in name or name.endswith("-2.5") for name in measured)


def test_crosstalk_that_tells_no_designs_apart_and_the_level_at_the_neighbour(quiet):
    one = quiet.data["proposals"][0]
    at = one["crosstalk"]["value"] * one["edge"]["p50"]
    assert one["crosstalk"]["neighbour"] == pytest.approx(at, rel=1e-6)
    assert any("the same for every unit of this diameter" in line for line in lines(one))


def test_a_mass_is_shown_as_exactly_as_its_limit():
    one = _target({"wall_mm": [1.5, 1.5]}, mass_max_g=1.052).data["proposals"][0]
    assert f"{one['mass_g']:.3g} g with motor" in lines(one)[0]


def test_another_diameter_and_a_unit_that_was_not_tried_are_explained(quiet):
    why = explain(quiet, "motor-10mm")["reasons"]
    assert any("diameters from 14 to 15.2 mm are tried (vary.diameter_mm), not 17" in line for line in why)
    head = explanation_lines(explain(quiet, "pass-through"))[0]
    assert head.endswith(" if it were tried")
    layers = explanation_lines(explain(quiet, "three-layer"))
    assert any("vary.layers has no 3" in line for line in layers)


def _spec(made, at, folder, **changes):
    """Write a proposal's spec with other values, and return the file."""
    file = folder / "mine.toml"
    file.write_text(to_toml(from_data({**to_data(made.specs[at]), "name": "mine", "fpcb": {}, **changes})), "utf-8")
    return str(file)


def test_a_proposals_own_spec_is_recognised_and_another_is_not_called_a_proposal(paper, quiet, tmp_path):
    for made in (paper, quiet):
        own = explain(made, _spec(made, 1, tmp_path))
        assert (own["listed"], own["reasons"], own["among"]) == (2, [], True)
        assert explanation_lines(own)[1:] == ["  it is among the proposals, as number 2"]
    thicker = [{"material": m, "wall_mm": 1.5, "cap_mm": 1.5} for m in paper.data["proposals"][0]["materials"]]
    of_table = explain(paper, _spec(paper, 0, tmp_path, layers=thicker))
    assert any("vary.wall_mm goes from 1.25 to 1.25 mm, and a wall is 1.5" in line for line in of_table["reasons"])
    between = [{**one, "wall_mm": 1.3, "cap_mm": 1.3} for one in thicker]
    lines = explanation_lines(explain(quiet, _spec(paper, 0, tmp_path, layers=between)))
    assert any("not tried: its lengths are between the steps" in line for line in lines)
    motor = {"part": "LCM0720A3463F", "fill": True}
    filled = explanation_lines(explain(paper, _spec(paper, 0, tmp_path, motor=motor)))
    assert any("with another motor or circuit" in line for line in filled)
    assert not any("among the proposals" in line for line in [*lines, *filled])


def test_a_specs_crosstalk_over_its_limit_is_among_the_reasons(tmp_path):
    """The edge of a wider unit lies nearer to its neighbour's middle."""
    made = _target(crosstalk_ratio_max=0.4, pitch_mm=20)
    wider = load("encapsulating", {"diameter_mm": 17.0})
    (tmp_path / "wider.toml").write_text(to_toml(wider))
    over = [line for line in explain(made, str(tmp_path / "wider.toml"))["reasons"] if "crosstalk" in line]
    ratio = crosstalk_ratio(estimate_input(wider), 20e-3).value
    assert over == [f"over a limit: crosstalk ratio {ratio:.3g} of at most 0.4"]
    assert not any("crosstalk" in line for line in explain(made, "encapsulating")["reasons"])


def test_the_command_that_builds_is_quoted(paper):
    found = contents(paper, "odd dir/design-published")
    file = f"odd dir/design-published/specs/1-{paper.data['proposals'][0]['name']}.toml"
    assert f"`unitcad build '{file}'`" in found["design.md"].decode()
    assert f"unitcad build '{file}'" in html.unescape(found["design.html"].decode())


def test_a_measurement_is_shown_and_the_nearest_others_are_no_proposals(paper):
    names = {one["rank"]: one["name"] for one in paper.data["proposals"]}
    first = explanation_lines(explain(paper, names[1]))
    assert "measured 4 % (the paper): meets the target; probability 0.9" in first[0]
    wide = _target({"layers": [2], "wall_mm": [1.25, 1.25]}, edge_max=0.05, probability_min=0.45)
    other = next(one for one in wide.data["proposals"] if one["measured"] and not one["measured"]["meets"])
    said = explanation_lines(explain(wide, other["name"]))
    assert f"outside the target; probability {other['probability']:.2f}" in said[0]
    assert said[1:] == [
        "  it is no proposal: it was measured outside the target, and is among the nearest others as number "
        f"{other['rank']}"
    ]


def test_a_crosstalk_that_is_out_of_reach_says_what_reaches_it():
    with pytest.raises(Refusal, match=r"; or target\.pitch_mm = 22.* in its place") as refused:
        _target(crosstalk_ratio_max=0.3, pitch_mm=20)
    assert "not tried, without a modulus: ecoflex-00-30" in str(refused.value)


def test_an_unknown_key_points_at_the_targets_schema(tmp_path):
    (tmp_path / "mine.toml").write_text("[target]\nedge_max = 0.06\nxyz = 0.3\n")
    with pytest.raises(UnknownKey, match="`unitcad schema target` lists all"):
        load_target(tmp_path / "mine.toml")

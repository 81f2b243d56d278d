"""What a result says of itself: specs that keep the models, what was not measured, refusals, the ranking."""

import csv
import html
import itertools
import re

import pytest

from unitcad.attenuation.edge.words import first_line
from unitcad.errors import UnknownKey
from unitcad.estimate_inputs import answer_spec
from unitcad.search.design_files import contents, head_lines, level_line, lines, ranking, title
from unitcad.search.proposals import invert
from unitcad.search.target_file import load_target, target_of


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
        answer = answer_spec(spec)
        assert one["edge"]["line"] == first_line(answer)
        assert level_line(one).startswith(first_line(answer))
        for end in ("low", "level", "high"):
            assert one["edge"][end] == pytest.approx(getattr(answer, end), rel=1e-6)
        assert answer.source.model == quiet.data["leads"]["model"] == "rule"


def test_lengths_that_were_never_measured_stand_in_the_title(paper, quiet):
    thick = _target({"layers": [2], "wall_mm": [1.5, 1.5]}).data["proposals"][0]
    assert title(thick).endswith("walls 1.5 and 1.5 mm (not measured at these lengths)")
    for made in (paper, quiet):
        assert title(made.data["proposals"][0]).endswith("walls 1.25 and 1.25 mm")


def test_a_frequency_that_nobody_measured_at_is_said():
    one = _target(frequency_hz=216.6667).data["proposals"][0]
    assert "frequency" in one["relies_on"]
    assert "Wider range: no measured unit had its frequency" in level_line(one)


def test_what_the_evidence_ranks_and_what_not_is_said(quiet):
    said = head_lines(quiet.data)
    assert said[1].startswith(
        "probabilities by rule, fitted to the paper's nine levels; ranked by design and which side"
    )
    unranked = "walls, caps, diameter, frequency, or silicones with the same side soft"
    line = "except by an assumed line between equal silicones and the measured pairs"
    assert said[2] == f"not ranked by {unranked}, {line}"
    second = lines(quiet.data["proposals"][1])
    assert second[0] == "as likely as number 1; among equals the unit that is easier to make comes first"
    page = contents(quiet, "x")["design.html"].decode()
    assert said[2] in page
    # The level of each proposal is in the table, before its range; the measurement has its own column.
    for one in quiet.data["proposals"]:
        found = re.search(r"Level at the edge: (\S+) % of the motor's amplitude (\(.*?\))\.", one["edge"]["line"])
        assert found
        assert f'data-head="level, % (80 % range)">{found[1]} {found[2]}</td>' in page


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
    at = one["crosstalk"]["value"] * one["edge"]["level"]
    assert one["crosstalk"]["neighbour"] == pytest.approx(at, rel=1e-6)
    assert any("the same for every unit of this diameter" in line for line in lines(one))


def test_a_mass_is_shown_as_exactly_as_its_limit():
    one = _target({"wall_mm": [1.5, 1.5]}, mass_max_g=1.052).data["proposals"][0]
    assert f"{one['mass_g']:.3g} g with motor" in lines(one)[0]


def test_the_command_that_builds_is_quoted(paper):
    found = contents(paper, "odd dir/design-published")
    file = f"odd dir/design-published/specs/1-{paper.data['proposals'][0]['name']}.toml"
    assert f"unitcad build '{file}'" in html.unescape(found["design.html"].decode())


def test_an_unknown_key_points_at_the_targets_schema(tmp_path):
    (tmp_path / "mine.toml").write_text("[target]\nedge_max = 0.06\nxyz = 0.3\n")
    with pytest.raises(UnknownKey, match="`unitcad schema target` lists all"):
        load_target(tmp_path / "mine.toml")

"""Piles of faces and shells: what would take all time or memory is bounded, and found is what was found by then."""

import numpy as np
import pytest
from shapes import box, finding, stl

from unitcad.geometry import boxes
from unitcad.geometry.boxes import TooMany
from unitcad.meshcheck.geometry import crossings


def cone(n, height=30):
    """A cone of n facets of radius 20; its base is a fan round its middle."""
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rim = np.stack([20 * np.cos(turn), 20 * np.sin(turn), 0 * turn], axis=1)
    after, tip, middle = np.roll(rim, -1, axis=0), np.full_like(rim, [0, 0, height]), np.zeros_like(rim)
    return np.concatenate([np.stack([rim, after, tip], axis=1), np.stack([after, rim, middle], axis=1)])


def test_a_cone_of_many_facets_is_looked_at_in_few_pairs(monkeypatch, judge):
    """Each facet has 4000 others at its tip, which are never compared, and few at its base."""
    looked = []
    real = crossings._sieved
    monkeypatch.setattr(crossings, "_sieved", lambda *given: looked.append(len(given[1])) or real(*given))
    report = judge(stl(cone(2000)))
    assert report.findings == ()
    assert sum(looked) < 400 * 4000


@pytest.mark.parametrize("n", [40, 300])
def test_nested_cubes_are_solid_and_hollow_in_turn(n, judge):
    """Every other one faces inwards: all are sound, and none overlaps."""
    cubes = [(box() - 5) * (1 + i / 20) for i in range(n)]
    sound = np.concatenate([cube if (n - i) % 2 else cube[:, ::-1] for i, cube in enumerate(cubes)])
    report = judge(stl(sound))
    assert {found.code: found.count for found in report.findings} == {"G006": n // 2}
    all_out = judge(stl(np.concatenate(cubes)))
    assert {found.code: found.count for found in all_out.findings} == {"G002": n // 2}


def test_one_face_many_times_is_a_face_and_its_duplicates(judge):
    n = 2000
    report = judge(stl(np.repeat(np.array([[[0, 0, 0], [10, 0, 0], [0, 10, 0]]], float), n, axis=0)))
    found = {finding.code: finding for finding in report.findings}
    assert found["T009"].count == n - 1
    assert (found["T003"].count, found["T007"].count, found["T007"].severity) == (3, 3, "error")
    assert not report.has("F011")


@pytest.mark.parametrize(
    ("module", "bound", "name"),
    [(crossings, "_MOST_LOOKS", "faces"), (boxes, "MOST_PAIRS", "boxes")],
)
def test_too_many_pairs_end_a_check_which_says_what_it_found(module, bound, name, monkeypatch, judge):
    monkeypatch.setattr(module, bound, 20)
    monkeypatch.setattr(crossings, "_LOOKS", 0)
    body = np.concatenate([box(at=(i, i, i)) for i in range(20)])
    report = judge(stl(np.concatenate([body, box()[2:] + 100])))
    limit = finding(report, "F011")
    assert limit.message == f"more than 20 pairs of {name} lie at each other; not all are compared"
    assert report.has("T001")
    assert report.facts.shells == 21


def test_a_soup_of_triangles_is_looked_at_no_further_than_it_takes(monkeypatch, judge):
    """Once so many pairs meet, the others say nothing new: the same findings, from half the pairs."""
    soup = stl(np.random.default_rng(3).uniform(0, 10, (700, 3, 3)))
    whole, looked = judge(soup), []
    real = crossings._sieved
    monkeypatch.setattr(crossings, "_sieved", lambda *given: looked.append(len(given[1])) or real(*given))
    monkeypatch.setattr(crossings, "_BLOCK", 2000)
    monkeypatch.setattr(crossings, "_FEW", 11_000)
    assert {one.code for one in judge(soup).findings} == {one.code for one in whole.findings}
    assert sum(looked) < 100_000


def test_pairs_of_boxes_are_those_of_all_pairs_however_wide_a_level_is(monkeypatch):
    low = np.random.default_rng(1).uniform(0, 4, (400, 3))
    high = low + 1
    meet = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    expected = np.argwhere(np.triu(meet, 1))
    for wide in (1 << 20, 7):
        monkeypatch.setattr(boxes, "_WIDE", wide)
        assert np.array_equal(boxes.box_pairs(low, high, lambda: None), expected)
    monkeypatch.setattr(boxes, "MOST_PAIRS", len(expected) - 1)
    with pytest.raises(TooMany):
        boxes.box_pairs(low, high, lambda: None)

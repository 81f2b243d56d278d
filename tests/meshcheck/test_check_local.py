"""Tolerances belong to a shell and its edges: what else is in the file has no say, nor do scale, place and attitude."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from malformed import with_sliver
from shapes import CUBE_CORNERS, CUBE_FACES, box, finding, stl, turned

from unitcad.meshcheck import Options, check_bytes, check_mesh
from unitcad.meshcheck.geometry.mesh import weld_exact
from unitcad.meshcheck.rules.registry import explain

BEAM = box((30_000, 10, 10), (0, 5, 0))


def codes(report):
    return {found.code for found in report.findings} - {"S001"}


def _noisy(gap, size=10.0):
    """A cube of which one triangle lies `gap` (part of the size, each way) off its place."""
    cube = box((size, size, size))
    cube[0] += gap * size
    return cube


def _sheet():
    """A flat tetrahedron: closed, without thickness."""
    a, b, c, d = np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0], [3, 3, 0]], float)
    return np.array([[a, b, d], [b, c, d], [c, a, d], [a, c, b]])


@pytest.mark.parametrize(("gap", "closes"), [(0.0001, True), (0.019, True), (0.04, False)])
@pytest.mark.parametrize("company", [False, True])
@pytest.mark.parametrize("size", [5, 10, 300])
def test_the_weld_reaches_as_far_as_the_rule_says(gap, closes, company, size):
    """By absolute size: a triangle of a cube lies `gap` mm off its place."""
    assert "nearer than 0.02 mm" in explain("T006")
    soup = box((size, size, size))
    soup[0] += gap / np.sqrt(3)
    if company:
        soup = np.concatenate([soup, BEAM + np.array([0, 0, 2 * size])])
    report = check_mesh(*weld_exact(soup))
    assert report.has("T006") == closes
    assert report.has("T001") == (not closes)
    if closes:
        assert f"{gap:g} mm apart at most" in finding(report, "T006").message


@pytest.mark.parametrize(("gap", "closes"), [(0.009, True), (0.011, False)])
def test_the_weld_reaches_no_farther_than_a_tenth_of_the_shortest_edge(gap, closes):
    """A pyramid of a tenth of a millimetre on a plate of 3 m has one side off its place: a crack, if not welded."""
    assert "a tenth of the shortest edge" in explain("T006")
    low, high = 0.0, 3e3
    rim = np.array([[low, low, 0], [high, low, 0], [high, high, 0], [low, high, 0]])
    foot = np.array([[500, 500, 0], [500.1, 500, 0], [500.1, 500.1, 0], [500, 500.1, 0]], float)
    tip = np.array([500.05, 500.05, 0.1])
    found = []
    for k in range(4):
        m = (k + 1) % 4
        found += [[rim[k], rim[m], foot[m]], [rim[k], foot[m], foot[k]], [foot[k], foot[m], tip]]
        found += [[rim[m], rim[k], rim[k] - [0, 0, 9]], [rim[m], rim[k] - [0, 0, 9], rim[m] - [0, 0, 9]]]
    under = rim - [0, 0, 9]
    found += [[under[0], under[2], under[1]], [under[0], under[3], under[2]]]
    soup = np.array(found)
    assert codes(check_mesh(*weld_exact(soup))) == set()
    soup[2] += [0, gap * np.sqrt(0.5), gap * np.sqrt(0.5)]
    report = check_mesh(*weld_exact(soup))
    assert report.has("T006") == closes
    assert report.has("T005") == (not closes)


def test_normals_are_those_of_the_faces_as_stored():
    """Beside a part of 300 mm a weld by the file's size would move a corner of the small cube far."""
    soup = np.concatenate([_noisy(0.24, 0.012), box((300, 300, 300), (20, 20, 20))])
    for some in (soup, soup[:12], _noisy(5e-6)):
        stored = some.astype(np.float32).astype(float)
        normal = np.cross(stored[:, 1] - stored[:, 0], stored[:, 2] - stored[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        report = check_bytes(stl(stored, normals=normal), "a.stl")
        assert not report.has("T013")
        assert check_bytes(stl(stored, normals=-normal), "a.stl").has("T013")


@pytest.mark.parametrize(("shift", "crosses"), [(5e-5, True), (-5e-5, False)])
def test_crossings_are_those_of_the_faces_as_stored(shift, crosses):
    """A side of a cube pushed in by less than the tolerance passes through the top, pulled out it does not."""
    soup = box()
    soup[0] += [shift, 0, 5e-5]
    report = check_bytes(stl(soup), "a.stl", Options(strict=True))
    assert report.has("T006")
    assert report.has("G001") == crosses
    assert report.facts.volume_mm3 == pytest.approx(1000, rel=1e-4)


def test_a_vertex_that_no_face_uses_has_no_part_in_the_size():
    """At 30 km it would let a missing face of the cube pass, and take a cube for a sheet."""
    points = np.concatenate([CUBE_CORNERS * 10, [[3e7, 0, 0]]])
    assert codes(check_mesh(points, CUBE_FACES)) == {"T012"}
    assert codes(check_mesh(points, CUBE_FACES[1:])) == {"T001", "T012"}


@pytest.mark.parametrize(
    ("part", "code"),
    [(with_sliver(), "T011"), (_sheet(), "G007"), (box(at=(25_000, 0, 100)), "V002")],
    ids=["sliver", "sheet", "far"],
)
def test_small_shells_are_judged_by_their_own_size(part, code, judge):
    alone = codes(judge(stl(part)))
    report = judge(stl(np.concatenate([part, BEAM - [0, 0, 50]])))
    assert code in alone
    assert codes(report) == alone
    assert finding(report, code).count == 1


PARTS = {
    "sound": box(),
    "hole": box()[1:],
    "seam": _noisy(5e-6),
    "gap": _noisy(5e-2),
    "sliver": with_sliver(),
    "sheet": _sheet(),
    "line": np.concatenate([box(), [[[0, 0, 0], [10, 0, 0], [5, 0, 0]]]]),
    "inside out": box()[:, ::-1],
    "turned over": np.concatenate([box()[:1, ::-1], box()[1:]]),
    "hollow": np.concatenate([box(), box((5, 5, 5), (2, 2, 2))[:, ::-1]]),
    "nested": np.concatenate([box(), box((5, 5, 5), (2, 2, 2))]),
    "pierced": np.concatenate([box(), box((5, 5, 20), (2, 2, -5))]),
    "stacked": np.concatenate([box(), box((4, 4, 4), (3, 3, 10))]),
    "edge to edge": np.concatenate([box(), box(at=(10, 10, 0))]),
    "twice": np.concatenate([box(), box()]),
}


@settings(max_examples=60)
@given(
    one=st.sampled_from(sorted(PARTS)),
    other=st.sampled_from(sorted(PARTS)),
    scale=st.sampled_from([0.02, 1.0, 3.7, 500.0]),
    seed=st.integers(0, 99),
)
def test_two_parts_far_apart_have_the_findings_of_each(one, other, scale, seed):
    """In double precision, the second part scaled and turned; both stay as they are when they are judged together."""
    first, second = PARTS[one] + 0.0, turned(PARTS[other], seed, scale)
    second += [50 - second[:, :, 0].min(), 0, 0]
    alone = codes(check_mesh(*weld_exact(first))) | codes(check_mesh(*weld_exact(second)))
    assert codes(check_mesh(*weld_exact(np.concatenate([first, second])))) == alone


@settings(max_examples=60)
@given(
    part=st.sampled_from(["sound", "hole", "seam", "gap", "inside out", "turned over", "hollow", "nested", "pierced"]),
    seed=st.integers(0, 999),
    scale=st.sampled_from([0.15, 1.0, 3.7, 90.0]),
    mirror=st.booleans(),
)
def test_scale_place_attitude_and_mirror_do_not_matter(part, seed, scale, mirror):
    """As float32; a shift of up to five sizes leaves the grid fine enough for each of these defects."""
    moved = turned(PARTS[part], seed, scale, 50 * scale, mirror)
    plain = codes(check_bytes(stl(PARTS[part]), "a.stl"))
    found = codes(check_bytes(stl(moved), "a.stl"))
    if part in ("seam", "gap"):  # which side of its neighbours the loose face lies on decides whether it crosses them
        plain, found = plain - {"G001"}, found - {"G001"}
    assert found == plain

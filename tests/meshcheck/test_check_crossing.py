"""Self-crossing against an independent reference in fractions, and on solids whose answer is known."""

import time
from fractions import Fraction

import numpy as np
import pytest
from exact_pairs import counts, reference
from shapes import CUBE_CORNERS, CUBE_FACES, finding

from unitcad.geometry.boxes import boxes_of, frame_of, meeting_between, meeting_pairs
from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.geometry.predicates import (
    common_point,
    integers,
    meet,
)
from unitcad.meshcheck.rules.f_file import Deadline
from unitcad.meshcheck.rules.registry import explain


@pytest.mark.parametrize("kind", ["grid", "grid sharing a corner", "random", "random sharing a corner"])
def test_triangles_meet_as_fractions_say(kind):
    rng = np.random.default_rng(7)
    corners = rng.integers(-2, 3, (700, 2, 3, 3)).astype(float) if "grid" in kind else rng.normal(size=(700, 2, 3, 3))
    if "corner" in kind:
        corners[:, 1, 0] = corners[:, 0, 1]
    normal = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    corners = corners[(np.abs(normal).sum(axis=-1) > 0).all(axis=1)]
    found = meet(corners[:, 0], corners[:, 1])
    compared = crossing = 0
    for i, (a, b) in enumerate(corners):
        expected = reference(a, b)
        if expected is None:
            continue
        compared += 1
        crossing += expected[0]
        assert expected == (bool(found.crosses[i]), bool(found.touches[i])), (a, b)
    assert compared > 500
    assert 20 < crossing < compared - 20


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 3), (5, 40), (200, 77), (300, 4)])
def test_box_pairs_are_all_that_meet(n, m):
    rng = np.random.default_rng(0)
    low = rng.random((n + m, 3))
    places = np.concatenate([low, low + 0.1])
    steps = frame_of(places).steps(places)
    rows = np.arange(n + m)
    both_sets = boxes_of(steps, rows, rows + n + m)
    boxes, others = both_sets[:n].astype(int), both_sets[n:].astype(int)

    def naive(a, b):
        return bool((a[:3] <= 65_535 - b[3:]).all() and (b[:3] <= 65_535 - a[3:]).all())

    own = {
        tuple(sorted(p))
        for i, j in meeting_pairs(both_sets[:n], Deadline(60).tick)
        for p in zip(i.tolist(), j.tolist(), strict=True)
    }
    assert own == {(a, b) for a in range(n) for b in range(a + 1, n) if naive(boxes[a], boxes[b])}
    both = {
        p
        for i, j in meeting_between(both_sets[:n], both_sets[n:], Deadline(60).tick)
        for p in zip(i.tolist(), j.tolist(), strict=True)
    }
    assert both == {(a, b) for a in range(n) for b in range(m) if naive(boxes[a], others[b])}
    apart = (low[:n, None] > low[None, n:] + 0.1).any(axis=2) | (low[None, n:] > low[:n, None] + 0.1).any(axis=2)
    assert both >= {(int(a), int(b)) for a, b in np.argwhere(~apart)}  # steps lose no pair


def _codes(*parts):
    points, faces, start = [], [], 0
    for corners, triangles in parts:
        points.append(corners * 10)
        faces.append(triangles + start)
        start += len(corners)
    return {found.code for found in check_mesh(np.concatenate(points), np.concatenate(faces)).findings}


CUBE = (CUBE_CORNERS, CUBE_FACES)
TURN = np.array([[1, -1, 0], [1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        (CUBE_CORNERS + np.array([3, 0, 0]), set()),
        (CUBE_CORNERS + np.array([0, 0, 1]), {"G003", "G004"}),
        (CUBE_CORNERS + np.array([0.5, 0.25, 1]), {"G003", "G004"}),
        (CUBE_CORNERS + np.array([1, 0, 1]), {"G003"}),
        (CUBE_CORNERS + 1, {"G003"}),
        (CUBE_CORNERS * [0.5, 0.5, 2] + [0.25, 0.25, -0.5], {"G001", "G002"}),
        (CUBE_CORNERS + 0.5, {"G001", "G002"}),
        (CUBE_CORNERS * 0.5 + 0.25, {"G002"}),
        ((CUBE_CORNERS - 0.5) @ TURN.T * [0.5, 0.5, 2] + 0.5, {"G001", "G002"}),
    ],
    ids=["apart", "stacked", "stacked aside", "edge", "corner", "pierced", "half in", "inside", "through edges"],
)
def test_two_cubes(corners, expected):
    assert _codes(CUBE, (corners, CUBE_FACES)) == expected
    assert _codes((corners, CUBE_FACES), CUBE) == expected


def test_cavity_and_inverted_shell():
    inner = CUBE_CORNERS * 0.5 + 0.25
    assert _codes(CUBE, (inner, CUBE_FACES[:, ::-1])) == {"G006"}
    assert _codes((CUBE_CORNERS, CUBE_FACES[:, ::-1])) == {"T008"}
    assert _codes(CUBE, (inner, CUBE_FACES[:, ::-1]), (CUBE_CORNERS * 0.2 + 0.4, CUBE_FACES)) == {"G006"}


def _sphere(n):
    """A torus knot-free tube: a torus of n x n quads, wavy, so that nothing is coplanar."""
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(n) * 2 * np.pi / n, indexing="ij")
    r = 8 + 0.3 * np.sin(9 * u) * np.sin(7 * v)
    points = np.stack([(20 + r * np.cos(v)) * np.cos(u), (20 + r * np.cos(v)) * np.sin(u), r * np.sin(v)], axis=-1)
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    a, b, c, d = i * n + j, (i + 1) % n * n + j, (i + 1) % n * n + (j + 1) % n, i * n + (j + 1) % n
    faces = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)])
    return points.reshape(-1, 3), faces


def test_a_wavy_torus_does_not_cross_itself_until_it_is_pushed_through():
    points, faces = _sphere(60)
    assert check_mesh(points, faces).findings == ()
    moved = points.copy()
    moved[30 * 60 + 15] *= [-1.5, 1, 1]  # one vertex of the far side, pulled across the hole
    found = {item.code for item in check_mesh(moved, faces).findings}
    assert "G001" in found


@pytest.mark.parametrize("mesh", ["closed", "with holes", "with faces turned over"])
def test_crossing_count_equals_brute_force(mesh):
    points, faces = _sphere(6)
    rng = np.random.default_rng(2)
    points = points + rng.normal(scale=2.5, size=points.shape)
    some = rng.random(len(faces)) < 0.1
    if mesh == "with holes":
        faces = faces[~some]
    elif mesh == "with faces turned over":
        faces[some] = faces[some][:, ::-1]
    report = check_mesh(points, faces)
    crossing = finding(report, "G001")
    assert crossing.count == counts(points, faces)[0] > 0


def test_one_missing_face_does_not_make_it_slow():
    """Faces round a vertex are left aside wherever they surround it, hole or no hole elsewhere."""
    points, faces = _sphere(100)
    start = time.perf_counter()
    whole = check_mesh(points, faces)
    closed = time.perf_counter() - start
    opened = check_mesh(points, faces[1:])
    assert whole.findings == ()
    assert [found.code for found in opened.findings] == ["T001"]
    assert time.perf_counter() - start - closed < 10 * closed + 0.5


def test_a_denormal_beside_ordinary_numbers_is_decided_without_a_warning():
    """Warnings are errors here; the coordinates' exponents lie farther apart than a float's range."""
    values = np.array([[0.0, 1e-320, 10.0]])
    whole = integers(values).astype(object)[0].tolist()
    assert whole[0] == 0
    assert whole[2] * Fraction(1e-320) == whole[1] * 10


@pytest.mark.parametrize("code", ["G001", "G002", "P019"])
def test_rules_that_are_softer_in_some_files_say_so(code):
    assert "3MF" in explain(code)
    assert "warning" in explain(code).split("\n", 1)[1]


@pytest.mark.parametrize("code", ["G002", "G003"])
@pytest.mark.parametrize(("shared", "overlap"), [(0.0, False), (0.9e-6, False), (1.1e-6, True)])
def test_shells_in_line_overlap_from_a_millionth_on_as_the_rules_say(code, shared, overlap):
    assert "a millionth of the smaller one" in explain(code)
    points = np.concatenate([CUBE_CORNERS, CUBE_CORNERS * [2, 1, 1] + [1 - shared, 0, 0]]) * 10
    found = {item.code for item in check_mesh(points, np.concatenate([CUBE_FACES, CUBE_FACES + 8])).findings}
    assert "G003" in found
    assert ("G002" in found) == overlap


def _two(scale, at):
    """A cube of 10 mm and a second box."""
    points = np.concatenate([CUBE_CORNERS * 10, CUBE_CORNERS * scale + np.array(at)])
    return points, np.concatenate([CUBE_FACES, CUBE_FACES + 8])


@pytest.mark.parametrize(
    ("code", "scale", "at", "low", "high"),
    [
        ("G001", (2, 2, 20), (4, 4, 5), (4, 4, 10), (6, 6, 10)),  # a pillar through the top
        ("G001", (10, 10, 10), (9, 8, 7), (9, 8, 7), (10, 10, 10)),
        ("G002", (10, 10, 10), (9, 8, 7), (9, 8, 7), (10, 10, 10)),
        ("G003", (2, 2, 2), (10, 4, 4), (10, 4, 4), (10, 6, 6)),
        ("G003", (5, 5, 5), (10, 10, 10), (10, 10, 10), (10, 10, 10)),
        ("G003", (5, 5, 5), (10, 10, 2), (10, 10, 2), (10, 10, 7)),
        ("G004", (2, 2, 2), (10, 4, 4), (10, 4, 4), (10, 6, 6)),
    ],
)
@pytest.mark.parametrize("shift", [0.0, 777.7])
def test_places_are_where_the_shells_meet_and_differ(code, scale, at, low, high, shift):
    points, faces = _two(scale, at)
    report = check_mesh(points + shift, faces)
    places = finding(report, code).locations
    where = np.array([place.xyz for place in places]) - shift
    assert (where >= np.array(low) - 1e-6).all()
    assert (where <= np.array(high) + 1e-6).all()
    assert len({tuple(row) for row in np.round(where, 4).tolist()}) == len(places)
    assert code in ("G002", "G003") or len({place.face for place in places}) == len(places) > 1


def test_touching_shells_are_placed_pair_by_pair():
    boxes = [CUBE_CORNERS * 10 + [10 * k, 0, 0] for k in range(4)]
    report = check_mesh(np.concatenate(boxes), np.concatenate([CUBE_FACES + 8 * k for k in range(4)]))
    places = finding(report, "G003").locations
    assert sorted(place.xyz[0] for place in places if place.xyz) == pytest.approx([10, 20, 30])


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ([[1, 1, -1], [1, 1, 1], [1, -9, 0]], (1, 0.5, 0)),  # a segment from the edge y = 0 to (1, 1, 0)
        ([[2, 2, 0], [2, 2, 5], [9, 2, 5]], (2, 2, 0)),  # a corner on the inside
        ([[0, 0, 0], [0, 0, 3], [6, 0, 3]], (0, 0, 0)),  # a common corner
        ([[0, 0, 0], [6, 0, 0], [0, 0, 3]], (3, 0, 0)),  # a common edge
        ([[1, 1, 0], [2, 1, 0], [1, 2, 0]], (4 / 3, 4 / 3, 0)),  # in one plane, inside
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1]], None),
    ],
)
@pytest.mark.parametrize("scale", [1.0, 1e38, 1e-150])
def test_the_middle_of_what_two_triangles_share(other, expected, scale):
    found = common_point(*(scale * np.array(corners) for corners in ([[0, 0, 0], [6, 0, 0], [0, 6, 0]], other)))
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        assert np.array(found) / scale == pytest.approx(expected, abs=1e-7)

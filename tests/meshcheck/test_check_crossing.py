"""Self-crossing against an independent reference in fractions, and on solids whose answer is known."""

import numpy as np
import pytest
from exact_pairs import counts
from shapes import CUBE_CORNERS, CUBE_FACES, finding

from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.rules.registry import explain


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


@pytest.mark.parametrize(("shared", "overlap"), [(0.0, False), (3.9, False), (4.1, True)])
def test_shells_in_line_overlap_from_four_float32_steps_on_as_the_rules_say(shared, overlap):
    """Their faces lie on each other and do not cross."""
    assert "four float32 steps" in explain("G003")
    step = float(np.spacing(np.float32(30)))
    points = np.concatenate([CUBE_CORNERS * 10, CUBE_CORNERS * [20, 10, 10] + [10 - shared * step, 0, 0]])
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
    assert sorted(place.xyz[0] for place in places) == pytest.approx([10, 20, 30])

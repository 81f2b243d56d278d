"""Crossings, overlaps and folds too shallow for a printer are warnings; what is deep is an error, however it is cut."""

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES, FORMATS, box, finding, in_format, stl, turned


def severities(report):
    return {found.code: found.severity for found in report.findings if found.code in ("G001", "G002", "G008", "G009")}


def pieces(triangles, times):
    """The same surface with each triangle cut into four, again and again."""
    for _ in range(times):
        a, b, c = triangles.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return triangles


def strips(n, at, up):
    """A square of 20 mm as n strips, each two long triangles, at the height `at`."""
    x = np.linspace(0, 20, n + 1)
    a, b = (np.stack([x, np.full(n + 1, y), np.full(n + 1, at)], axis=1) for y in (0.0, 20.0))
    found = np.concatenate([np.stack([a[:-1], a[1:], b[1:]], axis=1), np.stack([a[:-1], b[1:], b[:-1]], axis=1)])
    return found if up else found[:, ::-1]


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize(("depth", "right"), [(1e-5, "info"), (0.0056, "warning"), (0.05, "error"), (3.0, "error")])
def test_two_boxes_by_the_depth_of_their_overlap(depth, right, name, judge):
    """3MF's fill rule settles what crosses, whatever its depth."""
    content = in_format(np.concatenate([box(), box((6, 6, 10), (2, 2, 10 - depth))]), name)
    found = severities(judge(content, name))
    assert found["G001"] == ("warning" if name.endswith("3mf") and right == "error" else right)
    assert found.get("G002", right) == found["G001"]
    strict = severities(judge(content, name, strict=True))
    assert set(strict.values()) == ({"warning"} if name.endswith("3mf") else {"error"})


@pytest.mark.parametrize("seed", range(6))
def test_turned_boxes_overlap_as_those_that_stand(seed, judge):
    both = {depth: np.concatenate([box(), box((6, 6, 10), (2, 2, 10 - depth))]) for depth in (0.002, 0.5)}
    found = [severities(judge(stl(turned(body, seed, shift=20)))) for body in both.values()]
    assert [set(codes.values()) for codes in found] == [{"warning"}, {"error"}]


@pytest.mark.parametrize("times", [0, 3, 5])
@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-6, 0.3])
def test_a_deep_crossing_is_an_error_however_fine_or_aligned_its_faces_are(times, offset, judge):
    """One shell that crosses itself: a bar of 8 mm through a plate, both open, so that no volume tells.

    With small offsets the edges of one nearly lie on the faces of the other.
    """
    size = 8.0 / 2**times
    plate, bar = (
        np.array([[[-4, -4, 0], [4, -4, 0], [0, 4, 0]]], float),
        np.array([[[offset, -4, -4], [offset, 4, -4], [offset, 0, 4]]], float),
    )
    found = severities(judge(stl(pieces(np.concatenate([plate, bar]), times))))
    assert found == {"G001": "error"}, size


@pytest.mark.parametrize("times", [0, 2, 4])
def test_a_small_deep_crossing_of_fine_faces_is_an_error(times, judge):
    """Faces far smaller than what is called shallow: 0.5 mm in pieces of 0.03 mm and less."""
    scale = 0.1
    both = np.concatenate([box(), box((6, 6, 10), (2.1, 2.2, 5.03))]) * scale
    assert severities(judge(stl(pieces(both, times)), select=("G001",))) == {"G001": "error"}


@pytest.mark.parametrize(("n", "m"), [(1, 5), (1, 1999), (7, 5), (2000, 1), (2000, 1999)])
def test_a_fin_without_thickness_is_an_error_however_its_sides_are_cut(n, m, judge):
    """Both sides of a square in one plane, one cut into n strips, the other into m: strips of 0.01 mm and wider."""
    found = severities(judge(stl(np.concatenate([strips(n, 0, True), strips(m, 0, False)]))))
    assert found["G009"] == "error"


@pytest.mark.parametrize(("width", "right"), [(1e-4, "info"), (3e-4, "info"), (0.1, "warning"), (0.5, "error")])
@pytest.mark.parametrize("name", ["binary.stl", "part.ply", "part.obj"])
def test_a_vertex_across_its_neighbours_edge_folds_the_top(width, right, name, judge):
    """The top of a cube of 20 mm has a vertex in its middle, `width` across the diagonal that it should lie on."""
    corners = np.concatenate([CUBE_CORNERS * 20, [[10 + width / np.sqrt(2), 10 - width / np.sqrt(2), 20]]])
    rest = np.array([face for face in CUBE_FACES if not {*face.tolist()} <= {1, 3, 5, 7}])
    fan = [[1, 5, 8], [5, 7, 8], [7, 3, 8], [3, 1, 8]]
    good = np.concatenate([rest, fan])
    assert severities(judge(in_format(corners[good], name), name)) == {}
    # The same vertex joined to one triangle of the two only.
    cut = np.concatenate([rest, [[1, 5, 7], [7, 3, 8], [3, 1, 8], [1, 7, 8]]])
    found = severities(judge(in_format(corners[cut], name), name))
    assert set(found.values()) == {right}
    assert "G009" in found


@pytest.mark.parametrize(("thick", "right"), [(0.01, "warning"), (0.03, "error")])
def test_a_foil_that_lies_in_a_box_is_an_error_from_what_a_layer_may_show(thick, right, judge):
    found = severities(judge(stl(np.concatenate([box(), box((6, 6, thick), (2, 2, 5))]))))
    assert found == {"G002": right}


@pytest.mark.parametrize("more", [0, 1, 3])
@pytest.mark.parametrize("seed", [None, 0, 1])
def test_faces_without_area_back_to_back_are_that_alone(more, seed, judge):
    """Beside a cube and apart from it, some pairs of faces whose corners lie on a line."""
    lines = [np.array([[20, 0, z], [22, 0, z], [24, 0, z]], float) for z in range(more + 1)]
    pairs = np.array([face for line in lines for face in (line, line[::-1])])
    body = np.concatenate([box(), pairs])
    if seed is not None:  # by right angles, so that the corners stay on a line exactly
        body = np.roll(body, seed + 1, axis=2)
    report = judge(stl(body))
    assert {found.code: found.severity for found in report.findings} == {"T010": "info"}


def test_a_file_of_faces_without_area_only_has_no_volume(judge):
    line = np.array([[0, 0, 0], [2, 0, 0], [4, 0, 0]], float)
    report = judge(stl(np.array([line, line[::-1]])))
    assert report.has("G007")
    assert report.verdict == "error"


def test_the_message_says_the_depth(judge):
    report = judge(stl(np.concatenate([box(), box((6, 6, 10), (2, 2, 9.995))])))
    assert finding(report, "G001").message.endswith("that cross, 0.005 mm deep at most")


@pytest.mark.parametrize("times", [2, 3000])
def test_triangles_that_lie_on_each_other_are_judged_once(times, judge):
    """One polygon round the same four corners many times: Clipper splits each edge at each other one for minutes."""
    polygon = f"v 0 0 0\nv 0 0 9\nv 0 9 0\nv 0 9 9\nf {'1 2 3 4 ' * times}\n"
    assert severities(judge(polygon.encode(), "part.obj"))["G009"] == "error"


@pytest.mark.parametrize(("corners", "right"), [(400, None), (3000, "error")])
def test_a_face_of_many_corners_that_crosses_itself_is_not_judged(corners, right, judge):
    """All its triangles meet: random corners in a plane. A comb of as many corners crosses nothing."""
    points = np.random.default_rng(1).uniform(0, 100, (corners, 2))
    comb = [(0.01 * i, 0 if i % 2 else 9) for i in range(corners - 2)] + [(0.01 * corners, -1), (-1, -1)]
    for places, said in ((points.tolist(), right), (comb, None)):
        text = "".join(f"v {x} {y} 0\n" for x, y in places) + f"f {' '.join(str(i + 1) for i in range(corners))}\n"
        found = judge(text.encode(), "part.obj").findings
        assert next((each.severity for each in found if each.code == "F011"), None) == said


@pytest.mark.parametrize("cycle", ["0 1 2 ", "0 1 2 3 "])
def test_a_polygon_that_runs_over_itself_again_and_again_ends(cycle, judge):
    times = 100_000 // len(cycle.split())
    text = f"OFF\n4 1 0\n0 0 0\n10 0 0\n0 10 0\n0 0 10\n{times * len(cycle.split())} {cycle * times}\n"
    assert judge(text.encode(), "part.off").verdict == "error"

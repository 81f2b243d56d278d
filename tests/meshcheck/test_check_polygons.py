"""Polygons of PLY, OBJ and OFF: faces of differing sizes, concave ones, bent ones, and where they stand."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polygon_files import every_way, obj, off, ply
from shapes import CUBE_CORNERS, finding, turned

from unitcad.meshcheck.readers import reader_of
from unitcad.meshcheck.rules.f_file import Deadline, Limits

QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
HALF = [[0, 1, 3], [0, 3, 2], *QUADS[1:]]  # a cube of five quads and two triangles
CHEVRON = [(0, 0), (4, 0), (1, 1), (0, 4)]  # a quad with a reflex corner
SHARP = [(0, 0), (9, 0), (9, 9), (8, 1), (7, 9), (6, 1), (5, 9), (4, 1), (3, 9), (2, 1), (0, 9)]
NOTCHED = [(0, 0), (3, 0), (6, 0), (6, 5), (4, 5), (4, 2), (2, 2), (2, 5), (0, 5), (0, 3)]  # corners on a line


def read(name, content):
    findings = []
    mesh = reader_of(name.rpartition(".")[2])(memoryview(content), Limits(), Deadline(60), findings)
    assert {found.code for found in findings} <= {"T012"}
    return mesh


def prism(outline, turn, hand):
    """A prism whose caps are one polygon each, beginning at corner `turn`; mirrored for hand -1."""
    n = len(outline)
    plan = np.array(outline, float) * [hand, 1]
    points = np.vstack([np.column_stack([plan, np.full(n, z)]) for z in (0.0, 5.0)])
    faces = [np.roll(np.arange(n)[::-1], turn).tolist(), np.roll(np.arange(n, 2 * n), turn).tolist()]
    faces += [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    return points, faces if hand > 0 else [face[::-1] for face in faces]


@pytest.mark.parametrize("faces", [QUADS, HALF], ids=["quads", "mixed"])
def test_faces_of_differing_sizes_are_read_in_every_format(faces, judge):
    for name, content in every_way(CUBE_CORNERS * 10, faces).items():
        report = judge(content, name)
        assert report.findings == (), name
        assert (report.facts.triangles, report.facts.vertices) == (12, 8)
        assert report.facts.volume_mm3 == pytest.approx(1000)


@pytest.mark.parametrize(("outline", "area"), [(CHEVRON, 4), (SHARP, 45), (NOTCHED, 24)], ids=["quad", "comb", "notch"])
@pytest.mark.parametrize("hand", [1, -1])
def test_concave_polygons_are_cut_within_their_outline(outline, area, hand, judge):
    for turn in range(len(outline)):
        points, faces = prism(outline, turn, hand)
        for name, content in (("a.ply", ply(points, faces, "")), ("a.obj", obj(points, faces)),
                              ("a.off", off(points, faces)), ("b.ply", ply(turned(points, 3), faces))):  # fmt: skip
            report = judge(content, name)
            assert report.findings == (), (turn, name)
            assert report.facts.volume_mm3 == pytest.approx(5 * area, rel=1e-9)
            assert report.facts.triangles == 2 * (len(outline) - 2) + 2 * len(outline)


def test_polygons_that_are_not_flat_are_named(judge):
    bent = CUBE_CORNERS * 10
    bent[7, 2] += 1  # of the three quads round this corner the one at z = 10 is not flat any more
    for name, content in every_way(bent, QUADS).items():
        (found,) = judge(content, name).findings
        assert (found.code, found.severity, found.count) == ("F013", "warning", 1)
        assert found.locations[0].face == 5
        assert found.message.endswith(" mm off")
    near = CUBE_CORNERS * 10
    near[7, 2] += 0.01  # within a thousandth of the face
    assert judge(ply(near, QUADS), "a.ply").findings == ()


def test_rounding_bends_no_polygon(judge):
    points, faces = prism(SHARP, 0, 1)
    for seed in range(5):
        report = judge(ply(turned(points, seed) + 500, faces, "<", coordinate="float"), "a.ply")
        assert not report.has("F013")


def test_places_are_those_of_the_polygons(judge):
    """A hole beside face 4 of the file, its line and its object, though that face is two triangles."""
    content = obj(CUBE_CORNERS * 10, QUADS[:-1]).decode().split("\n")
    first = next(i for i, line in enumerate(content) if line.startswith("f"))
    content.insert(first + 3, "g left out\no  the lid # 1")
    content.insert(first, "o body")
    report = judge("\n".join(content), "a.obj")
    hole = finding(report, "T001")
    lines = "\n".join(content).split("\n")
    for place in hole.locations:
        assert place.face < 5
        assert lines[place.line - 1] == "f " + " ".join(str(i + 1) for i in QUADS[place.face])
        assert place.object == ("body" if place.face < 3 else "the lid # 1")
    text = ply(CUBE_CORNERS * 10, QUADS[:-1], "").decode()
    hole = finding(judge(text, "a.ply"), "T001")
    assert all(text.split("\n")[place.line - 1][:2] == "4 " for place in hole.locations)


def test_groups_name_faces_where_there_is_no_object(judge):
    content = obj(CUBE_CORNERS * 10, QUADS[:-1]).replace(b"f ", b"g side\nf ", 1)
    hole = finding(judge(content, "a.obj"), "T001")
    assert {place.object for place in hole.locations} == {"side"}


@pytest.mark.parametrize(
    ("name", "content", "code", "said", "line"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", "P011", "vertex -4, of 3 above it", 4),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "P011", "vertex 0; OBJ counts from 1", 4),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n 3\n", "F003", "export unwrapped lines", 4),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1\nf 1 2 3\n", "F003", "a vertex with 2 numbers", 3),
        ("a.obj", "v 0 0 0\nv\nv 0 1 0\nf 1 2 3\n", "F003", "a vertex with 0 numbers", 2),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 /3\n", "F004", "is not a vertex's index", 4),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3.0\n", "F004", "'3.0' is not a vertex's index", 4),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1-2 0\nf 1 2 3\n", "F004", "'1-2' is not a number", 3),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf\n", "F008", "1 face with fewer than three vertices", 4),
        ("a.off", "4OFF\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n", "F003", "4OFF cannot be read", None),
        ("a.off", "OFF BINARY\n3 1 0\n", "F003", "binary OFF cannot be read", None),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "F003", "a vertex with 2 numbers", 4),
        ("a.off", "OFF\n3 1.5 0\n0 0 0\n", "F003", "the counts of vertices, faces and edges are missing", None),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", "F004", "'1.5' is not a vertex's index", None),
    ],
)  # fmt: skip
def test_what_breaks_a_text_is_named_with_its_line(name, content, code, said, line, judge):
    found = finding(judge(content, name), code)
    assert said in found.message
    assert [place.line for place in found.locations] == ([line] if line else [])


POINTS = st.lists(st.tuples(*[st.floats(-1e6, 1e6, width=32)] * 3), min_size=3, max_size=9)
FACES = st.lists(st.lists(st.integers(0, 8), min_size=3, max_size=7), min_size=1, max_size=9)


def area_vector(points, face):
    ring = points[face] - points[face[0]]
    return np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)


@settings(max_examples=60)
@given(corners=POINTS, drawn=FACES)
def test_any_polygons_keep_their_corners_and_area_in_every_format(corners, drawn):
    """Whatever the outline: as many triangles as it takes, its own corners, and its own vector of area."""
    points = np.array(corners, float)
    faces = [[i % len(points) for i in face] for face in drawn]
    expected = np.array([area_vector(points, face) for face in faces])
    for name, content in every_way(points, faces).items():
        found = reader_of(name.rpartition(".")[2])(memoryview(content), Limits(), Deadline(60), [])
        assert len(found.faces) == sum(len(face) - 2 for face in faces)
        of = np.arange(len(found.faces)) if found.source.polygons is None else found.source.polygons
        a, b, c = (found.vertices[found.faces[:, k]] for k in range(3))
        areas = np.zeros_like(expected)
        np.add.at(areas, of, np.cross(b - a, c - a))
        scale = np.abs(points).max() ** 2 + 1e-300
        np.testing.assert_allclose(areas / scale, expected / scale, atol=1e-13)
        for polygon, face in enumerate(faces):
            used = found.vertices[found.faces[of == polygon]].reshape(-1, 3)
            assert {tuple(p) for p in used.tolist()} <= {tuple((points[i] + 0.0).tolist()) for i in face}


@pytest.mark.parametrize(("coordinate", "count", "index"), list(itertools.product(
    ("float", "double", "float32", "float64", "short", "int16"), ("char", "uint8", "ushort", "int32"),
    ("uchar", "int8", "uint16", "int", "uint"))))  # fmt: skip
def test_all_types_of_ply(coordinate, count, index):
    for order in "<>":
        mesh = read("a.ply", ply(CUBE_CORNERS * 10, HALF, order, coordinate=coordinate, count=count, index=index))
        assert (len(mesh.faces), len(mesh.vertices)) == (12, 8)

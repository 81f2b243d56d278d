"""Edges, shells and welds against plain Python on random meshes."""

from collections import defaultdict

import numpy as np
import pytest
from scipy import ndimage
from shapes import CUBE_CORNERS, CUBE_FACES, box, finding, stl, surface

from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.geometry import topology
from unitcad.meshcheck.geometry.mesh import weld_exact


@pytest.mark.parametrize("collisions", [False, True])
def test_weld_joins_equal_corners_only_in_their_order(collisions, monkeypatch):
    if collisions:
        monkeypatch.setattr("unitcad.meshcheck.geometry.mesh._mix", lambda bits: bits[:, 0].astype(np.uint64) % 3)
    rng = np.random.default_rng(0)
    corners = rng.integers(-2, 3, (500, 3, 3)).astype(np.float32) * np.float32(0.1)
    corners[corners == 0] = -0.0
    vertices, faces = weld_exact(corners)
    assert vertices.tolist() == list(map(list, dict.fromkeys(map(tuple, (corners.reshape(-1, 3) + 0.0).tolist()))))
    assert (vertices[faces] == corners).all()


def _pinched_by_search(faces):
    """Vertices of which the faces are in several parts, joined across edges of two; without edges of more."""
    by_edge, at = defaultdict(list), defaultdict(set)
    for n, face in enumerate(faces):
        for k in range(3):
            by_edge[frozenset((face[k], face[k - 1]))].append(n)
            at[face[k]].add(n)
    found = []
    for vertex, around in sorted(at.items()):
        edges = [of for edge, of in by_edge.items() if vertex in edge]
        parts = {n: {n} for n in around}
        for one, other in (of for of in edges if len(of) == 2):
            if parts[one] is not parts[other]:
                parts[one] |= parts[other]
                for n in parts[other]:
                    parts[n] = parts[one]
        if max(map(len, edges)) <= 2 and len({id(part) for part in parts.values()}) > 1:
            found.append(vertex)
    return found


@pytest.mark.parametrize("seed", range(40))
def test_pinches_of_open_meshes_as_a_search_finds_them(seed):
    rng = np.random.default_rng(seed)
    faces = np.concatenate([CUBE_FACES + 8 * n for n in range(5)])
    joined = np.arange(40)
    joined[rng.choice(40, 6)] = rng.choice(40, 6)
    faces = joined[faces]
    faces = faces[rng.random(len(faces)) < rng.choice([0.8, 0.95, 1.0])]
    flipped = rng.random(len(faces)) < rng.choice([0.0, 0.1])
    faces[flipped] = faces[flipped, ::-1]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole].astype(np.int32)
    found = topology.pinched_vertices(faces, topology.edges_of(faces, 40), 40)
    assert found.tolist() == _pinched_by_search(faces.tolist())


def test_indices_out_of_range_and_empty():
    assert check_mesh(CUBE_CORNERS, CUBE_FACES + 1).has("P011")
    assert check_mesh(CUBE_CORNERS, np.empty((0, 3))).has("F001")
    assert check_mesh(CUBE_CORNERS * np.nan, CUBE_FACES).has("V001")


def _labelled(cells, steps):
    """Components of cells; neighbours differ in up to `steps` coordinates."""
    found = np.zeros(cells.shape, int)
    ndimage.label(cells, ndimage.generate_binary_structure(3, steps), output=found)
    return found


@pytest.mark.parametrize("seed", range(12))
def test_shells_of_cubes_that_touch_in_edges(seed):
    """Cubes joined by faces are one solid; each of its shells parts it from what lies together outside of it."""
    rng = np.random.default_rng(seed)
    solid = rng.random((4, 4, 4)) < (0.35 if seed % 2 else 0.65)
    parts = _labelled(solid, 1)
    outside = [np.pad(parts != i, 1, constant_values=True) for i in range(1, parts.max() + 1)]
    expected = sum(int(_labelled(space, 2).max()) for space in outside)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    vertices, faces = weld_exact(rng.permutation(surface(solid.astype(int), rng)))
    for points in (vertices, vertices @ turn * 7.3 + 40):
        report = check_mesh(points, faces)
        assert report.has("T003")
        assert report.facts.shells == expected


def _turned_diagonals(triangles):
    pairs = triangles.reshape(-1, 2, 3, 3)
    a, b, c, d = pairs[:, 0, 0], pairs[:, 0, 1], pairs[:, 0, 2], pairs[:, 1, 2]
    return np.stack([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)], axis=1).reshape(-1, 3, 3)


def test_four_faces_at_an_edge_that_do_not_all_agree_are_wound_wrongly(judge):
    """Two cubes that meet along an edge, one face there turned over: its other two edges say so, and this one too."""
    cubes = np.concatenate([box(), box(at=(10, 10, 0))])
    upright = (cubes[:, :, :2] == 10).all(axis=2).sum(axis=1) == 2
    turned = np.argmax(upright)
    cubes[turned] = cubes[turned, ::-1]
    report = judge(stl(cubes))
    assert finding(report, "T007").count == 3


_BESIDE = box(at=(10, 0, 0))
_FOUR = [box(), _BESIDE, box(at=(0, 10, 0)), box(at=(10, 10, 0))]


@pytest.mark.parametrize(
    ("parts", "shells", "duplicates"),
    [
        ([box(), _BESIDE], 2, 0),
        ([box(), _turned_diagonals(_BESIDE)], 2, 0),
        ([box()[:, ::-1], _BESIDE[:, ::-1]], 2, 0),
        (_FOUR, 4, 0),
        ([box(), box(at=(10, 10, 0))], 2, 0),
        ([box(), box((10, 5, 5))], 2, 0),
        ([box(), _BESIDE[:, ::-1]], None, 2),
        ([box(), box()], 2, 12),
        ([box(), box()[:, ::-1]], 2, 12),
        ([box()[1:], _BESIDE], None, 2),
        ([box(), _BESIDE, _BESIDE], None, 14),
        ([box(), box()[:1, ::-1]], None, 1),
        ([box(), box()[:1], box()[:1, ::-1]], None, 2),
    ],
    ids=["side by side", "other diagonals", "both inverted", "four", "edge to edge", "inside at an edge",
         "one inverted", "twice", "hollow without a wall", "one open", "two and its copy", "a face over",
         "a fin"],
)  # fmt: skip
def test_shells_that_share_edges_are_told_apart_and_share_no_duplicates(parts, shells, duplicates, judge):
    content = stl(np.concatenate(parts))
    report = judge(content)
    assert sum(found.count for found in report.findings if found.code == "T009") == duplicates
    assert report.has("G003") or report.has("G002") or duplicates
    if shells:
        assert report.facts.shells == shells
        assert not judge(content, shells=shells).has("G005")
        assert judge(content, shells=shells + 1).has("G005")

"""Edges, shells and welds against plain Python on random meshes."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np
import pytest
from scipy import ndimage
from shapes import CUBE_CORNERS, CUBE_FACES, box, stl

from unitcad.geometry.components import components
from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.geometry import topology
from unitcad.meshcheck.geometry.mesh import weld_exact
from unitcad.meshcheck.geometry.rays import winding_numbers


def _random_faces(seed: int, n_vertices: int, n_faces: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, n_vertices, (n_faces * 2, 3)).astype(np.int32)
    keep = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return faces[keep][:n_faces]


@pytest.mark.parametrize("seed", range(6))
def test_edges_are_counted_as_a_dictionary_counts_them(seed: int) -> None:
    faces = _random_faces(seed, 12, 20)
    counted: Counter[tuple[int, int]] = Counter()
    for face in faces.tolist():
        for k in range(3):
            a, b = face[k], face[(k + 1) % 3]
            counted[min(a, b), max(a, b)] += 1
    edges = topology.edges_of(faces, 12)
    found = {(int(a), int(b)): int(n) for a, b, n in zip(edges.low, edges.high, edges.size, strict=True)}
    assert found == dict(counted)


@pytest.mark.parametrize(("n_vertices", "n_faces"), [(12, 0), (12, 20), (90, 4000), (70_000, 60_000)])
def test_edges_are_sorted_by_their_ends(n_vertices: int, n_faces: int) -> None:
    faces = _random_faces(1, n_vertices, n_faces)
    start, end = topology.half_edges(faces)
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((np.arange(len(low)), high, low))
    for room in (n_vertices, 2**31):  # packed into words, and by two keys
        found = topology._sorted_edges(faces, room)
        for array, expected in zip(found, (order, low[order], high[order]), strict=True):
            assert array.dtype == np.int32
            assert (array == expected).all()


@pytest.mark.parametrize("n", [1, 5, 300, 70_000])
def test_components_as_a_search_finds_them(n: int) -> None:
    rng = np.random.default_rng(n)
    left, right = rng.integers(0, n, (2, n // 2 + 1))
    label = components(n, left, right)
    neighbours = defaultdict(list)
    for a, b in zip(left.tolist(), right.tolist(), strict=True):
        neighbours[a].append(b)
        neighbours[b].append(a)
    seen: dict[int, int] = {}
    number = -1
    for node in range(n):
        if node in seen:
            continue
        number += 1
        stack = [node]
        while stack:
            here = stack.pop()
            if here not in seen:
                seen[here] = number
                stack += neighbours[here]
    assert label.tolist() == [seen[node] for node in range(n)]


@pytest.mark.parametrize("collisions", [False, True])
def test_weld_joins_equal_corners_only_in_their_order(collisions: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if collisions:
        monkeypatch.setattr("unitcad.meshcheck.geometry.mesh._mix", lambda bits: bits[:, 0].astype(np.uint64) % 3)
    rng = np.random.default_rng(0)
    corners = rng.integers(-2, 3, (500, 3, 3)).astype(np.float32) * np.float32(0.1)
    corners[corners == 0] = -0.0
    vertices, faces = weld_exact(corners)
    assert vertices.tolist() == list(map(list, dict.fromkeys(map(tuple, (corners.reshape(-1, 3) + 0.0).tolist()))))
    assert (vertices[faces] == corners).all()


def test_weld_survives_a_hash_collision(monkeypatch: pytest.MonkeyPatch) -> None:
    corners = np.random.default_rng(1).normal(size=(50, 3, 3))
    expected = {tuple(row) for row in corners.reshape(-1, 3).tolist()}
    monkeypatch.setattr("unitcad.meshcheck.geometry.mesh._mix", lambda bits: np.zeros(len(bits), np.uint64))
    vertices, faces = weld_exact(corners)
    assert {tuple(row) for row in vertices.tolist()} == expected
    assert (vertices[faces] == corners).all()


def test_two_cubes_at_a_vertex_are_pinched_there() -> None:
    faces = np.concatenate([CUBE_FACES, np.where(CUBE_FACES == 0, 7, CUBE_FACES + 8)]).astype(np.int32)
    edges = topology.edges_of(faces, 16)
    assert edges.closed
    assert topology.pinched_vertices(faces, edges, 16).tolist() == [7]
    assert topology.shells_of(faces, edges, topology.turns_of(np.zeros((16, 3)), faces, edges)).max() == 1


def _pinched_by_search(faces: list[list[int]]) -> list[int]:
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
def test_pinches_of_open_meshes_as_a_search_finds_them(seed: int) -> None:
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


@pytest.mark.parametrize(
    ("point", "expected"), [((5, 5, 5), 1), ((0.1, 9.9, 5), 1), ((-1, 5, 5), 0), ((5, 5, 10.5), 0)]
)
def test_winding_number(point: tuple[float, float, float], expected: int) -> None:
    for faces, sign in ((CUBE_FACES, 1), (CUBE_FACES[:, ::-1], -1)):
        span = np.array([0]), np.array([len(faces)])
        found = winding_numbers(CUBE_CORNERS * 10, faces, *span, np.array([point]), lambda: None)
        assert found.tolist() == [sign * expected]


def test_counts_of_a_cube_with_a_missing_face() -> None:
    report = check_mesh(CUBE_CORNERS * 10, CUBE_FACES[1:])
    assert [(found.code, found.count) for found in report.findings] == [("T001", 3)]
    assert report.facts.watertight is False
    assert report.facts.volume_mm3 is None


def test_indices_out_of_range_and_empty() -> None:
    assert check_mesh(CUBE_CORNERS, CUBE_FACES + 1).has("P011")
    assert check_mesh(CUBE_CORNERS, np.empty((0, 3))).has("F001")
    assert check_mesh(CUBE_CORNERS * np.nan, CUBE_FACES).has("V001")


@pytest.mark.parametrize("gap", [0.0, 5e-5, 2e-3])
def test_welding_has_a_tolerance(gap: float) -> None:
    """1e-5 of the diagonal of 17.3 is 1.7e-4 mm."""
    soup = (CUBE_CORNERS * 10)[CUBE_FACES]
    soup[0] += gap
    report = check_mesh(soup.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert report.has("T006") == (gap < 1.7e-4)
    assert report.has("T001") == (gap > 1.7e-4)


def test_ordinary_float32_rounding_raises_nothing(judge) -> None:
    """A box turned by odd angles and rounded to float32 has faces that are not quite flat: no finding."""
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    for shift in (0, 37.7, 211.3):
        assert judge(stl(box((13, 7, 3)) @ turn.T + shift)).findings == ()


def _voxels(solid: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The border of a set of unit cubes as triangles, outwards, in any order and with either diagonal."""
    found = []
    for cell in np.argwhere(solid):
        for axis in range(3):
            for way in (0, 1):
                beyond = cell.copy()
                beyond[axis] += 2 * way - 1
                if (beyond >= 0).all() and (beyond < solid.shape).all() and solid[tuple(beyond)]:
                    continue
                u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
                ring = [cell + way * np.eye(3)[axis] + w for w in (0 * u, u, u + v, v)]
                ring = ring if way else ring[::-1]
                k = int(rng.integers(0, 2))
                found += [[ring[k], ring[k + 1], ring[k + 2]], [ring[k], ring[k + 2], ring[(k + 3) % 4]]]
    return rng.permutation(np.array(found))


def _labelled(cells: np.ndarray, steps: int) -> np.ndarray:
    """Components of cells; neighbours differ in up to `steps` coordinates."""
    found = np.zeros(cells.shape, int)
    ndimage.label(cells, ndimage.generate_binary_structure(3, steps), output=found)
    return found


@pytest.mark.parametrize("seed", range(12))
def test_shells_of_cubes_that_touch_in_edges(seed: int) -> None:
    """Cubes joined by faces are one solid; each of its shells parts it from what lies together outside of it."""
    rng = np.random.default_rng(seed)
    solid = rng.random((4, 4, 4)) < (0.35 if seed % 2 else 0.65)
    parts = _labelled(solid, 1)
    outside = [np.pad(parts != i, 1, constant_values=True) for i in range(1, parts.max() + 1)]
    expected = sum(int(_labelled(space, 2).max()) for space in outside)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    vertices, faces = weld_exact(_voxels(solid, rng))
    for points in (vertices, vertices @ turn * 7.3 + 40):
        report = check_mesh(points, faces)
        assert report.has("T003")
        assert report.facts.shells == expected


def _turned_diagonals(triangles: np.ndarray) -> np.ndarray:
    pairs = triangles.reshape(-1, 2, 3, 3)
    a, b, c, d = pairs[:, 0, 0], pairs[:, 0, 1], pairs[:, 0, 2], pairs[:, 1, 2]
    return np.stack([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)], axis=1).reshape(-1, 3, 3)


@pytest.mark.parametrize(
    ("parts", "shells"),
    [
        ([box(), box(at=(10, 0, 0))], 2),
        ([box(), _turned_diagonals(box(at=(10, 0, 0)))], 2),
        ([box(), box(at=(10, 0, 0)), box(at=(0, 10, 0)), box(at=(10, 10, 0))], 4),
        ([box(), box(at=(10, 10, 0))], 2),
        ([box(), box()], 2),
        ([box(), box((10, 5, 5))], 2),
    ],
    ids=["face to face", "other diagonals", "four about an edge", "edge to edge", "twice", "inside at an edge"],
)
def test_shells_that_share_edges_are_told_apart(parts: list[np.ndarray], shells: int, judge) -> None:
    report = judge(stl(np.concatenate(parts)), shells=shells)
    assert report.facts.shells == shells
    assert not report.has("G005")
    assert judge(stl(np.concatenate(parts)), shells=shells + 1).has("G005")


def test_four_faces_at_an_edge_that_do_not_all_agree_are_wound_wrongly(judge) -> None:
    """Two cubes that meet along an edge, one face there turned over: its other two edges say so, and this one too."""
    cubes = np.concatenate([box(), box(at=(10, 10, 0))])
    upright = (cubes[:, :, :2] == 10).all(axis=2).sum(axis=1) == 2
    turned = np.argmax(upright)
    cubes[turned] = cubes[turned, ::-1]
    report = judge(stl(cubes))
    assert next(found.count for found in report.findings if found.code == "T007") == 3


_BESIDE = box(at=(10, 0, 0))


@pytest.mark.parametrize(
    ("parts", "duplicates"),
    [
        ([box(), _BESIDE], 0),
        ([box(), _turned_diagonals(_BESIDE)], 0),
        ([box()[:, ::-1], _BESIDE[:, ::-1]], 0),
        ([box(), _BESIDE, box(at=(0, 10, 0)), box(at=(10, 10, 0))], 0),
        ([box(), _BESIDE[:, ::-1]], 2),
        ([box(), box()], 12),
        ([box(), box()[:, ::-1]], 12),
        ([box()[1:], _BESIDE], 2),
        ([box(), _BESIDE, _BESIDE], 14),
        ([box(), box()[:1, ::-1]], 1),
        ([box(), box()[:1], box()[:1, ::-1]], 2),
    ],
    ids=["side by side", "other diagonals", "both inverted", "four", "one inverted", "twice", "hollow without a wall",
         "one open", "two and its copy", "a face turned over", "a fin"],
)  # fmt: skip
def test_closed_shells_side_by_side_share_no_duplicates(parts: list[np.ndarray], duplicates: int, judge) -> None:
    report = judge(stl(np.concatenate(parts)))
    assert sum(found.count for found in report.findings if found.code == "T009") == duplicates
    assert report.has("G003") or duplicates

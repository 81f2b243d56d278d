"""Floats may leave a pair of faces open, but what they set apart is apart: against exact signs."""

from __future__ import annotations

import numpy as np
import pytest

from unitcad.geometry.boxes import frame_of, ranks_of, slabs_of
from unitcad.meshcheck.geometry import crossings
from unitcad.meshcheck.geometry.mesh import Mesh, area_vectors
from unitcad.meshcheck.geometry.predicates import meet
from unitcad.meshcheck.geometry.sieves import (
    MOST_RANK,
    Contacts,
    Planes,
    arranged,
    face_boxes,
    planes_of,
    ranked_boxes,
    stars_of,
)
from unitcad.meshcheck.geometry.topology import topology_of
from unitcad.meshcheck.rules.f_file import Deadline

N = 4000


def _pairs(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Corners of pairs of triangles (n, 3, 3), near to touching."""
    if kind == "lattice":
        return rng.integers(-2, 3, (2, N, 3, 3)).astype(float)[0], rng.integers(-2, 3, (N, 3, 3)).astype(float)
    a, b = rng.normal(size=(2, N, 3, 3))
    weight = rng.dirichlet(np.ones(3), N)
    inside = np.einsum("nk,nkd->nd", weight, a)
    b[:, 0] = inside + rng.normal(size=(N, 3)) * 10.0 ** rng.uniform(-17, -3, (N, 1))
    if kind == "one plane":
        b = inside[:, None] + np.einsum("nck,nkd->ncd", rng.normal(size=(N, 3, 2)), a[:, 1:] - a[:, :1])
    if kind == "slivers":
        a[:, 2] = a[:, 0] + (a[:, 1] - a[:, 0]) * rng.random((N, 1)) + rng.normal(size=(N, 3)) * 1e-9
    if kind == "sizes":
        size = 10.0 ** rng.uniform(-6, 3, (N, 1, 1))
        return a * size, b * size
    if kind == "far away":
        return a + 1e6, b + 1e6
    return a, b


def _planes(a: np.ndarray, b: np.ndarray) -> Planes:
    """Faces 0 to n - 1 are a, n to 2 n - 1 are b."""
    points = np.concatenate([a, b]).reshape(-1, 3)
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    return planes_of(
        np.ascontiguousarray(points.T),
        np.ascontiguousarray(faces.T),
        np.ascontiguousarray(area_vectors(points, faces).T),
    )


KINDS = ["lattice", "near", "one plane", "slivers", "sizes", "far away"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_plane_sets_apart_is_apart(kind: str) -> None:
    a, b = _pairs(kind, np.random.default_rng(KINDS.index(kind)))
    planes, i = _planes(a, b), np.arange(N)
    solid = (planes.normal != 0).any(axis=0)
    none = np.zeros(N, np.int8)
    by_plane = planes.one_side(i, planes.vertices(i + N), none) | planes.one_side(i + N, planes.vertices(i), none)
    ids = [planes.vertices(f) for f in (i, i + N)]
    seen = planes.seen_apart(i, planes.corners(ids[0]), planes.corners(ids[1]), none)
    whole = np.flatnonzero(solid[:N] & solid[N:])
    exact = meet(a[whole], b[whole])
    meets = exact.touches | exact.crosses | exact.overlaps
    assert not (meets & (by_plane | seen)[whole]).any()
    assert (by_plane | seen)[whole].sum() > 100


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shared", [1, 2])
def test_faces_that_share_corners_have_no_more_in_common(kind: str, shared: int) -> None:
    """No crossing and no common area; of faces at one edge the third corner is off the plane or across the edge."""
    a, b = _pairs(kind, np.random.default_rng([shared, KINDS.index(kind)]))
    b[:, :shared] = a[:, :shared]
    planes, i = _planes(a, b), np.arange(N)
    count = np.full(N, shared, np.int8)
    found = planes.one_side(i, planes.vertices(i + N), count)
    one, other = (planes.corners(planes.vertices(f)) for f in (i, i + N))
    found |= planes.seen_apart(i, one, other, count)
    solid = (planes.normal != 0).any(axis=0)
    rows = np.flatnonzero(found & solid[:N] & solid[N:])
    exact = meet(a[rows], b[rows])
    assert len(rows) > N / 20
    assert not (exact.crosses | exact.overlaps).any()
    if shared == 2:  # the third corner is off the plane, or in it and across the edge
        assert ((exact.side_b != 0).sum(axis=1) <= 1).all()


@pytest.mark.parametrize("seed", range(3))
def test_slabs_keep_faces_that_touch(seed: int) -> None:
    """Pairs that share a corner, in a frame whose axes differ much in length."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(300, 3)) * [1, 10.0**-seed, 1000]
    faces = rng.integers(0, len(points), (2000, 3)).astype(np.int32)
    i, j = np.triu_indices(len(faces), 1)
    touch = (faces[i][:, :, None] == faces[j][:, None, :]).any(axis=(1, 2))
    slabs = slabs_of(frame_of(points).steps(points), *np.ascontiguousarray(faces.T))
    kept = slabs.meeting(i[touch], j[touch])
    assert len(kept[0]) == touch.sum()
    assert len(slabs.meeting(i[~touch], j[~touch])[0]) < (~touch).sum()


def test_boxes_that_touch_hold_faces_that_do_no_more() -> None:
    """On a lattice, where most boxes have sides in common."""
    a, b = _pairs("lattice", np.random.default_rng(7))
    points = np.ascontiguousarray(np.concatenate([a, b]).reshape(-1, 3).T)
    faces = np.ascontiguousarray(np.arange(6 * N).reshape(-1, 3).T)
    i, j = np.arange(N), np.arange(N, 2 * N)
    solid = [(area_vectors(c.reshape(-1, 3), np.arange(3 * N).reshape(-1, 3)) != 0).any(axis=1) for c in (a, b)]
    exact = meet(a, b)
    apart = ((a.min(axis=1) > b.max(axis=1)) | (b.min(axis=1) > a.max(axis=1))).any(axis=1)
    touch = np.zeros(N, bool)  # in a plane that does not hold a side of one and all of the other
    for one, other in ((a, b), (b, a)):
        plane = one.max(axis=1)
        held = (one == plane[:, None]).sum(axis=1) + (other == plane[:, None]).sum(axis=1)
        touch |= ((plane == other.min(axis=1)) & (held < 5)).any(axis=1)
    ranks = ranks_of(frame_of(points.T).steps(points.T), points.T, MOST_RANK)
    assert ranks is not None
    # Single precision, negative zeros among it; double; all vertices, and only those of some faces; by ranks.
    signed = np.where((points == 0) & (np.arange(6 * N) % 2 == 0), -0.0, points)
    more = np.concatenate([points * 0.1, np.zeros((3, 18 * N))], axis=1)
    for boxes in (
        *(face_boxes(columns, faces) for columns in (points, points - 3, signed, points * 0.1, more)),
        ranked_boxes(ranks, faces),
    ):
        found = boxes.touching(i, j)
        assert (found == (touch | apart)).all()
        rows = found & solid[0] & solid[1]
        assert (rows & exact.touches).sum() > 20
        assert not (rows & (exact.crosses | exact.overlaps)).any()


def test_ranks_tell_all_coordinates_apart_or_are_none() -> None:
    rng = np.random.default_rng(2)
    points = rng.integers(0, 200, (5000, 3)) * [0.1, 3.0, 1000.0] - 7
    steps = frame_of(points).steps(points)
    ranks = ranks_of(steps, points, 199)
    assert ranks is not None
    for axis in range(3):
        assert (np.unique(points[:, axis])[ranks[axis]] == points[:, axis]).all()
    assert ranks_of(steps, points, 198) is None
    points[5, 1] += 1e-9
    assert ranks_of(frame_of(points).steps(points), points, MOST_RANK) is None
    few = points[:50]  # are sorted, however near they are
    ranks = ranks_of(frame_of(few).steps(few), few, MOST_RANK)
    assert ranks is not None
    for axis in range(3):
        assert (np.unique(few[:, axis])[ranks[axis]] == few[:, axis]).all()


@pytest.mark.parametrize("every", [False, True])
@pytest.mark.parametrize("shells", [3, 40, 1_000_000])
def test_contacts_keep_the_first_pair_of_two_shells(shells: int, every: bool) -> None:
    """Also of shells that share a slot, in one block and over several."""
    rng = np.random.default_rng(shells)
    contacts = Contacts(shells, every)
    expected: dict[int, list[tuple[int, int]]] = {}
    for block in range(5):
        one, other = (
            rng.integers(0, shells, (2, 3000)) // 1000 * 1000 if shells > 40 else rng.integers(0, shells, (2, 90))
        )
        keys = contacts.keys(one, other)
        pairs = np.stack([np.arange(len(keys)) + block * 5000, rng.integers(0, 99, len(keys))], axis=1)
        for key, pair in zip(keys.tolist(), pairs.tolist(), strict=True):
            expected.setdefault(key, []).append(tuple(pair))
        open_ = contacts.open(keys)
        contacts.add(keys[open_], pairs[open_])
    for _ in range(2):
        keys, pairs = contacts.pairs()
        wanted = [(key, pair) for key in sorted(expected) for pair in expected[key][: None if every else 1]]
        assert list(zip(keys.tolist(), map(tuple, pairs.tolist()), strict=True)) == wanted
    low, high = contacts.shells_of(keys).T
    assert (contacts.keys(high, low) == keys).all()


def test_few_pairs_and_many_are_sieved_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sieve of the faces in some pairs says what that of all faces does."""
    rng = np.random.default_rng(4)
    points = np.concatenate([rng.normal(size=(900, 3)), rng.integers(-2, 3, (900, 3)) + 0.1])
    faces = np.arange(1800, dtype=np.int32).reshape(-1, 3)
    found = []
    for sparse in (0, 10**9):
        monkeypatch.setattr(crossings, "_SPARSE", sparse)
        top = topology_of(Mesh(points, faces), Deadline(60).tick)
        meeting = crossings.crossings_of(top, arranged(top), stars_of(top), Deadline(60).tick, every=True)
        assert meeting.faces is not None
        assert ("sieve" in vars(meeting.faces)) == (sparse > 0)
        found.append((joined := crossings.joined)(meeting.crossing).tolist() + joined(meeting.covering).tolist())
        found[-1] += meeting.contact.pairs()[1].tolist()
    assert sum(map(len, found[0])) > 100
    assert found[0] == found[1]

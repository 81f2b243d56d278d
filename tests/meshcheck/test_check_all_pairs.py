"""Every pair of faces of small meshes against fractions: degenerate ones above all, that fill the exact stages."""

import numpy as np
import pytest
from exact_pairs import counts, off_plane
from shapes import CUBE_CORNERS, CUBE_FACES

from unitcad.geometry import boxes
from unitcad.meshcheck.geometry import crossings
from unitcad.meshcheck.geometry.mesh import Mesh, weld_exact
from unitcad.meshcheck.geometry.resolution import STEPS
from unitcad.meshcheck.geometry.topology import topology_of
from unitcad.meshcheck.rules.f_file import Deadline

KINDS = ["lattice", "lattice of tenths", "random", "one tilted plane", "sheared lattice", "slivers", "about a vertex",
         "two heights", "boxes", "turned boxes", "block of boxes", "block of boxes and sheets", "far away"]  # fmt: skip


def _soup(kind, rng):
    """Triangles (n, 3, 3)."""
    n = int(rng.integers(6, 15))
    lattice = rng.integers(-2, 3, (n, 3, 3)).astype(float)
    if kind == "lattice":
        return lattice
    if kind == "lattice of tenths":
        return lattice * 0.1
    if kind == "one tilted plane":
        return rng.integers(-3, 4, (n, 3, 2)) @ rng.integers(-5, 6, (2, 3)).astype(float)
    if kind == "sheared lattice":
        return (lattice @ rng.normal(size=(3, 3))).astype(np.float32).astype(float)
    if kind == "slivers":
        lattice[:, 2] = lattice[:, 0] + (lattice[:, 1] - lattice[:, 0]) * rng.random((n, 1))
        return (lattice + rng.normal(size=(n, 3, 3)) * 1e-7).astype(np.float32).astype(float)
    if kind == "about a vertex":
        lattice[:, 0] = 0
        return lattice
    if kind == "two heights":
        return np.abs(lattice) * [1, 1, 0.5]
    if "block" in kind:
        sizes = [1.0, 1.0, 0.0] if "sheets" in kind else [1.0, 1.0, 0.5]
        places = rng.integers(0, 3, (4, 3)).astype(float)
        boxes = [CUBE_CORNERS * (rng.choice(sizes, 3) if i % 2 else 1) + at for i, at in enumerate(places)]
        return np.concatenate([box[CUBE_FACES[:, :: rng.choice([1, -1])]] for box in boxes])
    if "boxes" in kind:
        boxes = [CUBE_CORNERS * rng.choice([0.5, 1, 2], 3) + rng.choice([0, 0.5, 1], 3) for _ in range(2)]
        if kind == "turned boxes":
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            boxes = [(box @ turn).astype(np.float32).astype(float) for box in boxes]
        return np.concatenate([box[CUBE_FACES] for box in boxes])
    if kind == "far away":
        return (rng.normal(size=(n, 3, 3)) * 0.01 + [1000, 0, 0]).astype(np.float32).astype(float)
    return rng.normal(size=(n, 3, 3))


def _compare(kind, seed):
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    soup = _soup(kind, rng)
    if seed % 2:
        vertices, faces = weld_exact(soup)
    else:
        vertices, faces = soup.reshape(-1, 3), np.arange(3 * len(soup), dtype=np.int32).reshape(-1, 3)
    top = topology_of(Mesh(vertices, faces), Deadline(60).tick)
    solid, vertices = (top.stored_areas != 0).any(axis=1), top.mesh.vertices
    faces, labels = top.stored[solid], top.shells[solid]
    if len(faces) < 2:
        return 0, 0, 0
    crossing, overlaps, touching = counts(vertices, faces)
    shells = {tuple(sorted((int(labels[i]), int(labels[j])))) for i, j in touching if labels[i] != labels[j]}
    found = crossings.crossings_of(top, Deadline(60).tick)
    assert len(crossings.join_pairs(found.crossing)) == crossing
    assert {tuple(pair) for pair in found.touching().tolist()} == shells
    lying = crossings.join_pairs(found.lying)
    # Of pairs that share an edge those count that are folded at it; of slivers what is wider than rounding.
    if kind not in ("slivers", "sheared lattice", "turned boxes"):
        assert overlaps[0] <= len(lying) <= overlaps[1]
    for i, j in lying.tolist():
        corners = [vertices[found.faces.corners[:, k]] for k in (i, j)]
        assert min(off_plane(*corners), off_plane(*corners[::-1])) <= STEPS * np.spacing(
            np.float32(1e3 if kind == "far away" else 8)
        )
    return crossing, len(lying), len(shells)


@pytest.mark.parametrize("kind", KINDS)
def test_every_pair_is_what_fractions_say(kind, monkeypatch):
    """As it runs, and with pairs decided in many small blocks."""
    sums = np.zeros(3, int)
    for seed in range(8):
        if seed == 4:
            monkeypatch.setattr(crossings, "_BLOCK", 3)
            monkeypatch.setattr(boxes, "_STEP_BITS", 2)
            monkeypatch.setattr(boxes, "_STEP", 4)
        sums += _compare(kind, seed)
    assert sums[2] > 0


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_every_pair_of_thousands_of_meshes(kind):
    for seed in range(100, 500):
        _compare(kind, seed)


@pytest.mark.parametrize(("kind", "seed"), [("about a vertex", 100), ("two heights", 104), ("one tilted plane", 397)])
def test_shells_that_share_no_more_than_an_edge_touch(kind, seed):
    _compare(kind, seed)


def test_pairs_of_boxes_alike_are_the_only_ones_left_out():
    rng = np.random.default_rng(5)
    corners = np.sort(rng.integers(0, 60_000, (3000, 2, 3)).astype(np.uint16), axis=1)
    corners[:, 1] = np.minimum(corners[:, 0].astype(int) + 9_000, 60_000)
    rows = np.concatenate([corners[:, 0], 65_535 - corners[:, 1]], axis=1)
    alike = np.repeat(rng.integers(-1, 4, 30), 100)

    def found(numbers):
        return {(min(i, j), max(i, j)) for block in boxes.meeting_pairs(rows, alike=numbers)
                for i, j in zip(*(side.tolist() for side in block), strict=True)}  # fmt: skip

    whole, fewer = found(None), found(alike)
    lost = np.array(sorted(whole - fewer))
    assert fewer < whole
    assert (alike[lost[:, 0]] == alike[lost[:, 1]]).all()
    assert (alike[lost[:, 0]] >= 0).all()


def _prism(n, pierced):
    """A prism on a polygon of n sides, its ends fans round their middles; `pierced` has a bar through one end."""
    angle = np.arange(n) * 2 * np.pi / n
    ring = np.stack([50 * np.cos(angle), 50 * np.sin(angle)], axis=1)
    low, high = (np.column_stack([ring, np.full(n, z)]) for z in (0.0, 10.0))
    onwards = [np.roll(end, -1, axis=0) for end in (low, high)]
    middles = [np.broadcast_to([0.0, 0.0, z], (n, 3)) for z in (0.0, 10.0)]
    faces = [(low, onwards[0], onwards[1]), (low, onwards[1], high), (onwards[0], low, middles[0]),
             (high, onwards[1], middles[1])]  # fmt: skip
    bar = (CUBE_CORNERS * [4.0, 4.0, 20.0] + [20.0, 5.0, 5.0])[CUBE_FACES]
    return np.concatenate([*(np.stack(corner, axis=1) for corner in faces), *([bar] if pierced else [])])


@pytest.mark.parametrize("pierced", [False, True])
def test_a_fan_of_many_faces_is_crossed_by_others_only(pierced, monkeypatch):
    mesh = Mesh(*weld_exact(_prism(500, pierced)), indexed=False)
    topology = topology_of(mesh, Deadline(60.0).tick)
    found = []
    for least in (10**9, 64):
        monkeypatch.setattr(crossings, "_FAN", least)
        some = crossings.crossings_of(topology, Deadline(60.0).tick)
        found.append({tuple(sorted(pair)) for pair in some.faces.original[some.deep].tolist()})
    assert found[0] == found[1]
    assert bool(found[0]) == pierced


def test_pairs_of_a_fan_are_not_compared():
    """200,000 sides took more than a minute: all boxes of an end meet round its middle."""
    mesh = Mesh(*weld_exact(_prism(4000, False)), indexed=False)
    topology = topology_of(mesh, Deadline(60.0).tick)
    ticks = [0]

    def tick():
        ticks[0] += 1

    some = crossings.crossings_of(topology, tick)
    assert not some.crossed
    assert ticks[0] < 100

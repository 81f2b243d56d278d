"""Many small shells: what is found shell by shell is what a tree over all faces finds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES

from unitcad.meshcheck import Options, check_mesh
from unitcad.meshcheck.geometry import crossings, sieves

Built = tuple[np.ndarray, np.ndarray]


def _bodies(rng: np.random.Generator, corners: list[np.ndarray]) -> Built:
    """Return a mesh of boxes, their faces turned inwards now and then, in any order."""
    faces = [CUBE_FACES[:, :: 1 if rng.random() < 0.95 else -1] + 8 * i for i in range(len(corners))]
    order = rng.permutation(len(corners))
    return np.concatenate(corners), np.concatenate([faces[i] for i in order]).astype(np.int32)


def voxels(rng: np.random.Generator) -> Built:
    """Draw a block of cubes with holes in it, some of them halved, so that sides lie in sides."""
    there = np.argwhere(rng.random((9, 9, 9)) < 0.6)
    return _bodies(rng, [CUBE_CORNERS * rng.choice([1, 1, 0.5], 3) + at for at in there.astype(float)])


def crossing(rng: np.random.Generator) -> Built:
    """Draw a block of cubes of which some reach into others, or stand off by a hair."""
    there = np.argwhere(rng.random((8, 8, 8)) < 0.6).astype(float)
    off = rng.choice([0, 0, 0, 0.25, 2.0**-20, -(2.0**-20)], (len(there), 3))
    return _bodies(rng, [CUBE_CORNERS + at for at in there + off])


def sheets(rng: np.random.Generator) -> Built:
    """Draw boxes and sheets without thickness, of many sizes, on a lattice."""
    places = rng.integers(0, 8, (500, 3)).astype(float)
    return _bodies(rng, [CUBE_CORNERS * rng.choice([0, 1, 2], 3, p=[0.2, 0.6, 0.2]) + at for at in places])


@pytest.mark.parametrize("draw", [voxels, crossing, sheets])
@pytest.mark.parametrize("seed", range(3))
def test_findings_are_those_of_a_tree_over_all_faces(
    draw: Callable[[np.random.Generator], Built], seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = draw(np.random.default_rng(seed))
    used = _watched(monkeypatch)

    def counts() -> dict[str, int]:
        return {finding.code: finding.count for finding in check_mesh(*mesh, Options()).findings}

    by_shell = counts()
    assert used == [True]
    monkeypatch.setattr(crossings, "LEAST_SHELLS", 10**9)
    assert counts() == by_shell
    assert used == [True]
    assert by_shell.keys() >= {"G003", "G004"}
    assert ("G001" in by_shell) == (draw is not voxels)


def _watched(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Return a list that gets whether a mesh was looked at shell by shell."""
    real, used = sieves.small_shells, list[bool]()

    def watched(*given: object) -> object:
        made = real(*given)
        used.append(made is not None)
        return made

    monkeypatch.setattr(sieves, "small_shells", watched)
    return used


def test_shells_that_all_share_a_corner_or_are_large_are_looked_at_by_the_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    used = _watched(monkeypatch)
    rng = np.random.default_rng(1)
    tips = rng.normal(size=(400, 3, 3)) + 3 * rng.normal(size=(400, 1, 3))
    fans = np.concatenate([np.zeros((400, 1, 3)), tips], axis=1).reshape(-1, 3)
    four = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    check_mesh(fans, (four + 4 * np.arange(400)[:, None, None]).reshape(-1, 3).astype(np.int32))
    boxes = [CUBE_CORNERS + np.array([2 * i, 0, 0]) for i in range(300)]
    one, other = _bodies(rng, boxes)
    turns = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    ring = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    cone = np.array([[i, (i + 1) % 30, 30] for i in range(30)] + [[(i + 1) % 30, i, 31] for i in range(30)])
    points = np.concatenate([one, ring + np.array([0, 9, 0]), [[0, 9, 1], [0, 9, -1]]])
    check_mesh(points, np.concatenate([other, cone + len(one)]).astype(np.int32))
    assert used == [False, False]

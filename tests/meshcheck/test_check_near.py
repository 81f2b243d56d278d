"""Pairs of points within reach, as all pairs of points tell them: ordinary sets, crowds, sets beside far points."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from unitcad.meshcheck.geometry import topology


def _every(points: np.ndarray, reach: float) -> set[tuple[int, int]]:
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    return {(int(i), int(k)) for i, k in np.argwhere(np.triu(distance <= reach, 1))}


def _found(points: np.ndarray, reach: float) -> set[tuple[int, int]]:
    return {(min(a, b), max(a, b)) for a, b in topology._within(points, reach).tolist()}


@pytest.mark.parametrize("far", [0.0, 1e6, 1e30])
@pytest.mark.parametrize("n", [2, 7, 600])
def test_pairs_are_those_of_all_points(n: int, far: float) -> None:
    """Beside a far point the boxes' steps are too coarse: then the tree of points decides."""
    rng = np.random.default_rng(n)
    points = np.concatenate([some := rng.random((n, 3)) * 100, some + rng.normal(size=some.shape) * 1e-4])
    if far:
        points = np.concatenate([points, np.full((1, 3), far)])
    for reach in (2e-4, 1e-3):
        assert _found(points, reach) == _every(points, reach)


def test_a_pair_at_the_reach_itself_counts() -> None:
    points = np.array([[0.0, 0, 0], [0.25, 0, 0], [0.5 + 1e-12, 0, 0]])
    assert _found(points, 0.25) == {(0, 1)}


@pytest.mark.parametrize("far", [0.0, 1e9])
def test_a_crowd_has_no_pairs(far: float) -> None:
    points = np.concatenate([np.random.default_rng(0).random((3000, 3)) * 1e-3, np.full((1, 3), far)])
    assert not _found(points, 1e-2)


def test_short_seams_load_no_scipy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)  # importing it fails
    rng = np.random.default_rng(1)
    points = np.concatenate([some := rng.random((200, 3)) * 50, some + 1e-5])
    assert len(_found(points, 1e-4)) == 200

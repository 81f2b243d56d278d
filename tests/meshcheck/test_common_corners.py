"""Faces with a corner in common, by words and by corners, against sets."""

from __future__ import annotations

import numpy as np
import pytest

from unitcad.meshcheck.geometry.sieves import MOST_VERTICES, common_corners


@pytest.mark.parametrize("first", [0, MOST_VERTICES - 12, MOST_VERTICES - 11])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_common_corners_are_those_of_sets(first: int, share: float) -> None:
    """From vertex 0, up to the last one that fits a word, and beyond."""
    rng = np.random.default_rng(first)
    corners = (first + rng.integers(0, 12, (3, 300))).astype(np.int32)
    counts = rng.random(corners.shape) < share
    i, j = rng.integers(0, 300, (2, 5000))
    found = common_corners(corners, counts, first + 12).of(i, j)
    own = [set(face[counted].tolist()) for face, counted in zip(corners.T, counts.T, strict=True)]
    every = [set(face) for face in corners.T.tolist()]
    assert found.tolist() == [bool(own[a] & every[b]) for a, b in zip(i, j, strict=True)]

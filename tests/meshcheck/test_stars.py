"""Stars that are taken for height fields: no two of their faces cross, by fractions."""

from itertools import combinations

import numpy as np
import pytest
from exact_pairs import reference

from unitcad.meshcheck.geometry import sieves
from unitcad.meshcheck.geometry.mesh import area_vectors


def _star(rng, rounds, fold, rough):
    """Neighbours of the origin in their order: so many rounds, folded by a right angle along an axis or not, rough."""
    angles = np.sort(rng.random(rng.integers(3, 9) * rounds)) * 2 * np.pi * rounds
    flat = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * rng.uniform(0.2, 1.0, (len(angles), 1))
    if fold:
        down = flat[:, 1] < 0
        flat[down, 2], flat[down, 1] = flat[down, 1], 0.0
    points = np.round(flat + rough * rng.normal(size=flat.shape), 3)
    return points[:, rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)


def _asked(points):
    """The columns of the origin and its neighbours, the corners of the faces, and twice their area vectors."""
    vertices = np.concatenate([np.zeros((1, 3)), points])
    around = np.arange(1, len(vertices))
    faces = np.stack([np.zeros_like(around), around, np.roll(around, -1)], axis=1).astype(np.int32)
    areas = area_vectors(vertices, faces)
    return vertices.T.copy(), faces.T.copy(), areas.T.copy()


@pytest.mark.parametrize("rounds", [1, 2])
@pytest.mark.parametrize("fold", [False, True])
@pytest.mark.parametrize("rough", [0.0, 0.05, 0.4])
def test_faces_of_a_height_field_do_not_cross(rounds, fold, rough):
    rng, taken = np.random.default_rng(3), 0
    for _ in range(150):
        columns, corners, areas = _asked(_star(rng, rounds, fold, rough))
        asked = np.zeros(columns.shape[1], bool)
        asked[0] = True
        if not sieves.height_fields(columns, corners, areas, asked)[0]:
            continue
        taken += 1
        triangles = columns.T[corners.T]
        for one, other in combinations(range(len(triangles)), 2):
            if (other - one) % len(triangles) not in (1, len(triangles) - 1):
                met = reference(triangles[one], triangles[other])
                assert met is None or not met[0]
    assert (taken > 20) == (rounds == 1)

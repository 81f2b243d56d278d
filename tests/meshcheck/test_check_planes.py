"""Floats may leave a pair of faces open, but what they set apart is apart: against exact signs."""

import numpy as np
import pytest

from unitcad.meshcheck.geometry.mesh import area_vectors
from unitcad.meshcheck.geometry.predicates import meet
from unitcad.meshcheck.geometry.sieves import planes_of

N = 4000


def _pairs(kind, rng):
    """Corners of pairs of triangles (n, 3, 3), near to touching."""
    if kind == "lattice":
        return rng.integers(-2, 3, (2, N, 3, 3)).astype(float)[0], rng.integers(-2, 3, (N, 3, 3)).astype(float)
    a, b = rng.normal(size=(2, N, 3, 3))
    weight = rng.dirichlet(np.ones(3), N)
    inside = np.einsum("nk,nkd->nd", weight, a)
    b[:, 0] = inside + rng.normal(size=(N, 3)) * 10.0 ** rng.uniform(-17, -3, (N, 1))
    if kind == "slivers":
        a[:, 2] = a[:, 0] + (a[:, 1] - a[:, 0]) * rng.random((N, 1)) + rng.normal(size=(N, 3)) * 1e-9
    if kind == "sizes":
        size = 10.0 ** rng.uniform(-6, 3, (N, 1, 1))
        return a * size, b * size
    if kind == "far away":
        return a + 1e6, b + 1e6
    return a, b


def _planes(a, b):
    """Faces 0 to n - 1 are a, n to 2 n - 1 are b."""
    points = np.concatenate([a, b]).reshape(-1, 3)
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    return planes_of(
        np.ascontiguousarray(points.T),
        np.ascontiguousarray(faces.T),
        np.ascontiguousarray(area_vectors(points, faces).T),
        np.zeros(len(faces)),
    )


KINDS = ["lattice", "near", "slivers", "sizes", "far away"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_plane_sets_apart_is_apart(kind):
    a, b = _pairs(kind, np.random.default_rng(KINDS.index(kind)))
    planes, i = _planes(a, b), np.arange(N)
    solid = (planes.normal != 0).any(axis=0)
    none = np.zeros(N, np.int8)
    one, other = (
        planes.one_side(*pair, none)[0] for pair in ((i, planes.vertices(i + N)), (i + N, planes.vertices(i)))
    )
    by_plane = one | other
    whole = np.flatnonzero(solid[:N] & solid[N:])
    exact = meet(a[whole], b[whole])
    meets = exact.touches | exact.crosses | exact.overlaps
    assert not (meets & by_plane[whole]).any()
    assert by_plane[whole].sum() > 100

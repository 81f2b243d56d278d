"""Signs of determinants against fractions, kind by kind, and which arithmetic decides them."""

import random
from fractions import Fraction

import numpy as np
import pytest

from unitcad.meshcheck.geometry import predicates
from unitcad.meshcheck.geometry.predicates import orient2d, orient3d

N = 600


def _spread(rng, low, high):
    return rng.normal(size=(4, N, 3)) * 10.0 ** rng.uniform(low, high, (4, N, 3))


def _flat(rng, p):
    """The fourth point in the plane of the others, to rounding."""
    p[3] = p[0] + rng.normal(size=(N, 1)) * (p[1] - p[0]) + rng.normal(size=(N, 1)) * (p[2] - p[0])
    return p


def _points(kind, rng):
    p = rng.normal(size=(4, N, 3))
    if kind == "slivers":
        p[1:] = p[0] + rng.normal(size=(3, N, 1)) * (p[1] - p[0])
    elif kind == "all on a line":
        p = np.round(p * 64)
        p[1:] = p[0] + np.array([2, 3, -7])[:, None, None] * (p[1] - p[0])
    elif kind == "on a plane of short numbers":
        p = np.round(p * 1024) / 1024
        p[3] = p[0] + rng.integers(-9, 9, (N, 1)) * (p[1] - p[0]) + rng.integers(-9, 9, (N, 1)) * (p[2] - p[0])
    elif kind == "on a plane far away":
        p = _flat(rng, p) + 1e4
    elif kind == "on a plane, of every size":
        p = _flat(rng, _spread(rng, -30, 30))
    elif kind == "beside the largest":
        p = _spread(rng, -45, 37)
        p[3, :, :2] = p[0, :, :2]
    elif kind == "subnormal":
        p = rng.integers(-3, 4, p.shape) * 5e-324
        p[0] += rng.integers(0, 2, (N, 3))
    elif kind == "on a line off by a bit":
        p[:] = p[0] + np.arange(4)[:, None, None] * (p[1] - p[0])
        p[3] = np.nextafter(p[3], np.inf)
    elif kind == "nearly one point":
        p = p[0] + rng.integers(-2, 3, (4, N, 3)) * np.spacing(p[0])
    elif kind == "lattice":
        p = rng.integers(-1, 2, (4, N, 3)) * 0.1
    else:
        p = _flat(rng, p)
    return p


KINDS = [
    "slivers",
    "all on a line",
    "on a plane of short numbers",
    "on a plane far away",
    "on a plane, of every size",
    "beside the largest",
    "subnormal",
    "on a line off by a bit",
    "nearly one point",
    "lattice",
    "on a plane",
]


@pytest.mark.parametrize("single", [False, True], ids=["float64", "float32"])
@pytest.mark.parametrize("kind", KINDS)
def test_signs_are_those_of_fractions(kind, single):
    p = _points(kind, np.random.default_rng(8))
    if single:
        p = p.astype(np.float32).astype(np.float64)
    solid, flat = orient3d(*p), orient2d(*p[:3, :, :2])
    assert (predicates.orient2d_columns(*(corners.T for corners in p[:3, :, :2])) == flat).all()
    for i in range(N):
        a, b, c, d = ([Fraction(float(x)) for x in point] for point in p[:, i])
        u, v, w = ([x - y for x, y in zip(q, d, strict=True)] for q in (a, b, c))
        det = (
            u[2] * (v[0] * w[1] - w[0] * v[1]) + v[2] * (w[0] * u[1] - u[0] * w[1]) + w[2] * (u[0] * v[1] - v[0] * u[1])
        )
        assert solid[i] == (det > 0) - (det < 0)
        area = (a[0] - c[0]) * (b[1] - c[1]) - (a[1] - c[1]) * (b[0] - c[0])
        assert flat[i] == (area > 0) - (area < 0)


def _next_to_parallel(seed):
    """Whole numbers p, q, r, s of 40 bits and their determinant p s - q r, which is -1, 0 or 1."""
    rng = random.Random(seed)
    q = rng.getrandbits(40) | (1 << 39) | 1
    while True:
        p = rng.getrandbits(40) | (1 << 39)
        if np.gcd(p, q) == 1:
            break
    s = pow(p, -1, q)
    r = (p * s - 1) // q
    turn = rng.choice((-1, 0, 1))
    return ([p, q, r, s] if turn > 0 else [r, s, p, q] if turn < 0 else [p, q, 2 * p, 2 * q]), turn


@pytest.mark.parametrize("power", [-20, 0, 300])
def test_products_that_agree_in_all_but_the_last_bit(power):
    drawn = [_next_to_parallel(seed) for seed in range(500)]
    corner = np.random.default_rng(1).integers(-(2**38), 2**38, (500, 2))
    a = np.array([numbers[:2] for numbers, _ in drawn]) + corner
    b = np.array([numbers[2:] for numbers, _ in drawn]) + corner
    found = orient2d(*(np.ldexp(points.astype(np.float64), power) for points in (a, b, corner)))
    assert found.tolist() == [turn for _, turn in drawn]

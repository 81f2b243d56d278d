"""Signs of plane determinants beside whole numbers and fractions, where the float filter can't tell."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

from unitcad.meshcheck.geometry.predicates import orient2d


def _next_to_parallel(seed: int) -> tuple[list[int], int]:
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
def test_products_that_agree_in_all_but_the_last_bit(power: int) -> None:
    drawn = [_next_to_parallel(seed) for seed in range(500)]
    corner = np.random.default_rng(1).integers(-(2**38), 2**38, (500, 2))
    a = np.array([numbers[:2] for numbers, _ in drawn]) + corner
    b = np.array([numbers[2:] for numbers, _ in drawn]) + corner
    found = orient2d(*(np.ldexp(points.astype(np.float64), power) for points in (a, b, corner)))
    assert found.tolist() == [turn for _, turn in drawn]


def test_differences_that_are_rounded_themselves() -> None:
    rng = np.random.default_rng(11)
    a, b = rng.normal(size=(2, 600, 2)) * 10.0 ** rng.uniform(-3, 3, (2, 600, 1))
    c = a + rng.uniform(-2, 2, (600, 1)) * (b - a)
    found = orient2d(a, b, c)
    for i in range(600):
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(x)) for x in point[i]] for point in (a, b, c))
        exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
        assert found[i] == (exact > 0) - (exact < 0)

"""The ways on which air leaves a cavity: drawn landscapes, and levels flooded one by one."""

import random

import numpy as np
import pytest

from unitcad.checks.air import _ways_out
from unitcad.geometry.components import components


def flooded(edges, height, opening):
    """The highest level at which each vertex and an opening lie on one piece of what is not below it."""
    found = np.full(len(height), -np.inf)
    lowest = height[edges].min(axis=1)
    for level in np.unique(height):
        part = components(len(height), *edges[lowest >= level].T)
        out = np.isin(part, part[opening & (height >= level)]) & (height >= level)
        found[out] = level
    return found.tolist()


def test_air_goes_over_the_higher_of_two_saddles():
    """Tops at 5, 7 and 6 with saddles at 2 and 3 between them; the opening is the last."""
    height = np.array([5.0, 2.0, 7.0, 3.0, 6.0])
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    opening = np.array([False, False, False, False, True])
    assert _ways_out(edges, height, opening).tolist() == [2.0, 2.0, 3.0, 3.0, 6.0]
    beside = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [0, 4]])
    assert _ways_out(beside, height, opening).tolist() == [5.0, 2.0, 3.0, 3.0, 6.0]
    assert _ways_out(edges, height, ~opening & False).tolist() == [-np.inf] * 5


@pytest.mark.parametrize("seed", range(40))
def test_the_ways_out_are_those_of_flooded_levels(seed):
    pick = random.Random(seed)
    n = pick.randint(2, 60)
    height = np.array([pick.choice([pick.uniform(0, 9), pick.randint(0, 4)]) for _ in range(n)], float)
    edges = np.array([pick.sample(range(n), 2) for _ in range(pick.randint(1, 2 * n))])
    opening = np.array([pick.random() < 0.15 for _ in range(n)])
    assert _ways_out(edges, height, opening).tolist() == flooded(edges, height, opening)

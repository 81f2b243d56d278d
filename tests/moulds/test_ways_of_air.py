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


@pytest.mark.parametrize("seed", range(40))
def test_the_ways_out_are_those_of_flooded_levels(seed):
    pick = random.Random(seed)
    n = pick.randint(2, 60)
    height = np.array([pick.choice([pick.uniform(0, 9), pick.randint(0, 4)]) for _ in range(n)], float)
    edges = np.array([pick.sample(range(n), 2) for _ in range(pick.randint(1, 2 * n))])
    opening = np.array([pick.random() < 0.15 for _ in range(n)])
    assert _ways_out(edges, height, opening).tolist() == flooded(edges, height, opening)

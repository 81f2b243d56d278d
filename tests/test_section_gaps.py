"""The gap between plane sections: exact lengths, and other ways to the same number."""

import math
import random

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from unitcad.geometry.segments import between_convex, between_outlines
from unitcad.kernels.mesh import gap


def square(half, x=0.0, y=0.0):
    return np.array([(-half, -half), (half, -half), (half, half), (-half, half)]) + np.array((x, y))


def star(pick, x, y):
    """A polygon of seven to sixty corners, two to five from its middle."""
    angles = np.linspace(0, 2 * math.pi, pick.randint(7, 60), endpoint=False)
    radii = np.array([pick.uniform(2, 5) for _ in angles])
    return np.stack([x + radii * np.cos(angles), y + radii * np.sin(angles)], axis=1)


def test_what_overlaps_or_lies_inside_has_no_gap():
    whole = CrossSection([square(9)])
    for x in (0, 8.9):
        assert gap(whole, CrossSection([square(1, x)]), 5.0) == 0.0
        assert gap(CrossSection([square(1, x)]), whole, 5.0) == 0.0


@pytest.mark.parametrize("seed", range(30))
def test_the_gap_is_that_of_prisms_and_of_convex_outlines(seed):
    pick = random.Random(seed)
    one, other = star(pick, 0, 0), star(pick, pick.uniform(4, 14), pick.uniform(-9, 9))
    sections = CrossSection([one]), CrossSection([other])
    prisms = [Manifold.extrude(section, 1.0) for section in sections]
    assert gap(*sections, 6.0) == pytest.approx(prisms[0].min_gap(prisms[1], 6.0), abs=1e-6)
    hulls = [section.hull().to_polygons()[0] for section in sections]
    exact = between_convex(*([(float(x), float(y)) for x, y in hull] for hull in hulls))
    if exact:
        assert between_outlines([hulls[0]], [hulls[1]], 50.0) == pytest.approx(exact, abs=1e-9)

"""Faults planted in a gang of 3 by 3 cells: each is found, at its cell."""

import math

import pytest
from faulty_sets import set_of, with_fault
from manifold3d import Manifold

from tests.sample_bodies import LEADLESS
from unitcad.checks import draw, mould_checks
from unitcad.kernels.mesh import shells
from unitcad.shape import box, cut, cylinder, moved, union

GANG = LEADLESS, "moulds.cavities=[3,3]"
BELOW = box(-1, 1, -1, 1, -30, -29)
"""A box under the middle of a plate."""


def test_shells_are_what_manifold_tells_apart():
    hollow = Manifold.sphere(3, 16) - Manifold.cube((1, 1, 1), True)
    parts = [Manifold.cube((1, 2, 1)).translate((3 * i, 0, 0)) for i in range(40)] + [hollow.translate((0, 50, 0))]
    solid = Manifold.compose(parts)
    found, known = shells(solid), solid.decompose()
    assert len(found) == len(known) == 42  # a cavity is a shell, with a volume below 0
    assert sorted(map(sizes, found)) == sorted(map(sizes, known))


def sizes(solid):
    return tuple(round(value, 9) for value in (*solid.bounding_box(), solid.volume()))


def test_of_filaments_that_leave_together_the_one_that_is_caught_is_named():
    """A piece of the base below the middle filament stops it, and no other."""
    faulty = with_fault(set_of(*GANG), "base", lambda base: union((base, BELOW)))
    found = [f for f in draw.findings(faulty) if not f.ok]
    assert [f.where for f in found] == ["pour 2: filament5 out against base"]
    radius = faulty.spec.moulds.filament_mm / 2
    # Over the box lie half the elbow's disc and 1 mm of the lying tail.
    assert found[0].value == pytest.approx(math.pi / 2 * radius**2 + 2 * radius, rel=1e-3)


def hole(x, y, radius=0.6):
    """Draw a hole through a cup."""
    return moved(cylinder(radius, -1, 20), x, y)


# Cells stand 18 mm apart, the middle one, the fifth, at 0, 0.
FAULTS = {
    "a lip in a corner cell": ("C300", "pour 2: cup2 out", "cup2", lambda s: union((s, box(16, 18, 24.9, 25.1, 1, 2)))),
    "a lump in the middle cell": ("C100", "pour 2 cell 5", "cup2", lambda s: union((s, box(-1, 1, 6.5, 7.2, 1, 2)))),
    "a lump in an edge cell": ("C100", "pour 2 cell 4", "cup2", lambda s: union((s, box(-20, -18, 6.5, 7.2, 1, 2)))),
    "a lump in a corner cell": ("C100", "pour 2 cell 9", "cup2", lambda s: union((s, box(17, 19, 24.5, 25.2, 1, 2)))),
    "a leak between two cells": ("C100", "pour 2 cell 5", "cup2", lambda s: cut(s, [box(6, 13, -0.5, 0.5, 1, 2)])),
    "a hole between two cells": ("C000", "cup2 genus", "cup2", lambda s: cut(s, [hole(9.5, 0)])),
    "a hole between four cells": ("C000", "cup2 genus", "cup2", lambda s: cut(s, [hole(9.5, 5.5)])),
    "a hole at the edge": ("C240", "cup2: wall", "cup2", lambda s: cut(s, [hole(-28.5, 0)])),
    "a hole at the corner": ("C000", "cup1 genus", "cup1", lambda s: cut(s, [hole(25.5, 25.5)])),
    "a filament too thick in a corner": (
        "C200",
        "pour 1: base and filament1",
        "filament1",
        lambda s: union((s, box(-19, -17.8, -19.5, -18.5, 0, 1))),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found(fault):
    code, where, tool, change = FAULTS[fault]
    moulds = with_fault(set_of(*GANG), tool, change)
    found = [finding.where for finding in mould_checks()[code].findings(moulds) if not finding.ok]
    assert any(place.startswith(where) for place in found), found

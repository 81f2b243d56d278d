"""Profiles and trees: refusals, closed forms, hashes."""

import math
import pickle
import subprocess
import sys

import numpy as np
import pytest

from unitcad.kernels.mesh import arrays, realise
from unitcad.shape import (
    Place,
    ProfileError,
    Revolve,
    box,
    content_hash,
    cut,
    cylinder,
    mm,
    moved,
    polygon,
    rectangle,
    ring,
    rotated,
    turned,
    union,
)
from unitcad.shape.lettering import engraving


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (2, 2), (2, 0), (0, 2)),  # a bow tie
        ((0, 0), (0, 1), (1, 0)),  # clockwise
        ((0, 0), (1, 0)),  # no area
        ((0, 0), (2, 0), (2, 2), (1, 0), (0, 2)),  # touches itself
        ((0, 0), (3, 0), (1, 0), (3, 3)),  # folds back
        ((0, 3), (-2, -3), (3, 1), (-3, 1), (2, -3)),  # a pentagram: it only turns left, but twice round
    ],
)
def test_a_profile_that_bounds_no_area_is_refused(corners):
    with pytest.raises(ProfileError):
        polygon(*corners)


def test_a_revolved_profile_stays_off_the_far_side_of_the_axis():
    with pytest.raises(ProfileError, match="axis"):
        Revolve(rectangle(-1, 0, 2, 1))


def test_lengths_lie_on_the_grid_and_sums_are_exact():
    assert mm(0.1) * 1024 == round(0.1 * 1024)
    assert mm(1.25) + mm(2.11) == mm(mm(1.25) + mm(2.11))
    assert rectangle(0, 0, 0.1, 1).vertices[1][0] == mm(0.1)


def test_equal_trees_hash_equal_in_another_process_and_unequal_ones_do_not():
    tree = cut(union((ring(1, 2, 0, 1), moved(box(0, 1, 0, 1, 0, 1), x=3))), [turned(cylinder(0.5, 0, 2), "x", 1)])
    code = (
        "from unitcad.shape import *;"
        "print(content_hash(cut(union((ring(1, 2, 0, 1), moved(box(0, 1, 0, 1, 0, 1), x=3))),"
        "[turned(cylinder(0.5, 0, 2), 'x', 1)])))"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    assert content_hash(tree) == other
    assert content_hash(pickle.loads(pickle.dumps(tree))) == other
    assert content_hash(cylinder(1, 0, 1)) != content_hash(cylinder(1, 0, 1 + 1 / 1024))
    assert content_hash(union((tree,))) == content_hash(tree)


def test_turns_by_any_angle_are_rotations_and_opposite_ones_mirror_each_other():
    rod = box(2, 3, -0.25, 0.25, 0, 1)
    for degrees in (0.1, 28.6, 45, 61.4, 89.9, 133, 179):
        left, right = (realise(rotated(rod, "z", sign * degrees), 32).bounding_box() for sign in (1, -1))
        assert (left[1], left[4]) == (-right[4], -right[1])
        corners = arrays(realise(rotated(rod, "z", degrees), 32))[0]
        x, y, _ = corners.mean(axis=0)
        assert math.degrees(math.atan2(y, x)) == pytest.approx(degrees)
        assert np.hypot(*corners[:, :2].T).max() == pytest.approx(math.hypot(3, 0.25))
    assert rotated(rod, "x", -270) == turned(rod, "x", 1)
    assert rotated(rod, "x", 360) is rod


@pytest.mark.parametrize(
    "turn",
    [
        ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
        ((0.8, -0.59, 0), (0.6, 0.8, 0), (0, 0, 1)),
        ((2, 0, 0), (0, 2, 0), (0, 0, 2)),
    ],
    ids=["mirror", "skew", "scale"],
)
def test_what_is_no_rotation_is_refused(turn):
    with pytest.raises(ProfileError, match="is no rotation"):
        Place(box(0, 1, 0, 1, 0, 1), turn)


def test_equal_points_of_a_turned_frame_are_equal_to_the_last_bit():
    """However deep a move lies under the turn: a crack one rounding wide between two pieces is a leak."""
    drawn = box(3, 5, 1, 4, -2, 2), moved(box(-7, -5, 0.25, 3.25, 0, 4), 10, 0.75, -2)
    for degrees in (10.1, 33.3, 57.7, 121.9):
        one, other = (arrays(realise(rotated(shape, "y", degrees), 32))[0] for shape in drawn)
        assert set(map(tuple, one.tolist())) == set(map(tuple, other.tolist()))


@pytest.mark.parametrize("character", "0123456789ABCDEFL")
def test_every_character_is_one_piece_of_sound_outline(character):
    solid = realise(engraving(character, 0.8, 0, 0.4), 32)
    assert len(solid.decompose()) == 1
    cells = solid.volume() / 0.4 / 0.64
    assert cells == pytest.approx(round(cells), abs=0.05)
    assert solid.genus() == {"0": 1, "6": 1, "8": 2, "9": 1, "A": 1, "B": 1, "D": 1}.get(character, 0)

"""An array round its limb: which length is kept, how the ring closes, what is stretched."""

import math

import numpy as np
import pytest

from tests.arrays.made_arrays import made
from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_page import FINEST, pictures
from unitcad.arrays.array_page import bent as bent_mesh
from unitcad.arrays.patch import patch_moulds
from unitcad.arrays.sheet import bending
from unitcad.kernels.mesh import realise
from unitcad.shape import box


def test_the_middle_of_the_sheet_keeps_its_length():
    """Wrapped about the limb, the middle plane is as long as it was flat, and eight pitches go round once."""
    array = load_array("wrist-band")
    bent = bending(array)
    middle = 40 + (3.36 + 4.61) / 2
    assert bent.middle_radius == pytest.approx(middle, abs=1e-3)
    angles = [place.x / bent.middle_radius for place in array.places]
    assert np.diff(angles) == pytest.approx([2 * math.pi / 8] * 7, abs=1e-4)
    assert bent.closed == pytest.approx(2 * math.pi * middle, abs=1e-2)
    x0, _, x1, _ = array.sheet.outline
    assert bent.ends == pytest.approx(bent.closed - (x1 - x0))


def test_strains_and_sagitta_are_those_of_the_geometry():
    """A face at the middle's radius +- t/2 has the arc's length times that ratio; a flat unit is a tangent."""
    array = load_array("wrist-band")
    bent = bending(array)
    arc, outer = bent.middle_radius, bent.middle_radius + 1.25 / 2
    assert bent.strain == pytest.approx(outer / arc - 1)
    # Flat units of 14 mm leave 20.5 of 34.5 mm to bend: the sheet there has the smaller radius of the same angle.
    pitch = 2 * math.pi * bent.middle_radius / 8
    radius = (pitch - 14) / (2 * math.pi / 8)
    assert bent.strain_between == pytest.approx(1.25 / 2 / radius, rel=1e-3)
    assert math.hypot(40 - bent.sagitta, 7) == pytest.approx(40)
    assert patch_moulds(array).plan.stretches == (("sheet bent round 40 mm", pytest.approx(100 * bent.strain_between)),)
    assert bending(load_array("forearm-patch")) is None


def test_the_bent_sheet_has_the_flat_ones_volume():
    """Pappus: round its own middle a plate keeps its volume. The ends meet but for what is left between them."""
    moulds = made("wrist-band")
    array, drawn = moulds.array, moulds.array.sheet
    x0, y0, x1, y1 = drawn.outline
    plate = realise(box(x0, x1, y0, y1, drawn.low, drawn.high), 24)
    vertices, faces = bent_mesh(array, plate)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    bent = bending(array)
    # A chord of a step s cuts s^2 / 6 R^2 off the sector under it.
    assert 1 - (FINEST / bent.middle_radius) ** 2 / 6 < volume / plate.volume() < 1
    assert "pictures/patch-bent.png" in pictures(moulds)
    assert "pictures/patch-bent.png" not in pictures(made("forearm-patch"))

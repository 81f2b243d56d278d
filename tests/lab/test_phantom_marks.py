"""What is written on the phantom: points and their numbers on the lid, a frame's number, names of the section."""

import xml.etree.ElementTree as ET
from functools import cache
from itertools import pairwise

import pytest
from msgspec.structs import replace

from unitcad.export.svg import text_width
from unitcad.kernels.mesh import bounds, realise
from unitcad.lab import phantom_command
from unitcad.lab.phantom import load_phantom, phantom_set
from unitcad.shape import box, cylinder, moved, union
from unitcad.shape.lettering import engraving

STROKE, DEPTH = 0.8, 0.4
"""Of the printer fdm-0.4."""


@cache
def _skin():
    return phantom_set(load_phantom("skin"))


def volume(shape):
    return realise(shape, 64).volume()


@pytest.mark.parametrize("diameter", [4.0, 14.0, 40.0])
def test_the_lid_has_a_seat_and_a_hole_for_each_point(diameter):
    """Each hole is a cylinder of 1.25 mm; those that meet the seat are cut with it."""
    made = phantom_set(replace(load_phantom("skin"), unit_diameter_mm=diameter, points_mm=(2.5, 6.25, 30.0)))
    (body,) = [one for one in made.tools if one.name == "lid"]
    lid = realise(body.shape, 64)
    low, high = bounds(lid)[2], bounds(lid)[5]
    radius = diameter / 2
    through = [
        cylinder(radius, low, high),
        *(moved(cylinder(1.25, low, high), radius + d, 0.0) for d in (2.5, 6.25, 30)),
    ]
    assert (realise(union(through), 64) ^ lid).volume() == pytest.approx(0.0, abs=1e-6)
    middle = realise(box(-radius - 5, radius + 35, -radius - 5, radius + 5, low, high), 64)
    assert (middle - lid).volume() == pytest.approx(volume(union(through)), rel=1e-6)


def test_a_frame_has_the_number_of_its_pour_where_the_blade_does_not_run():
    made = _skin()
    size = made.size
    reach = next(bounds(realise(b.shape, 64)) for b in made.tools if b.kind == "blade")[3]
    frames = [body for body in made.tools if body.kind == "frame"]
    assert [body.name for body in frames] == ["frame3", "frame2"]
    for body in frames:
        top = bounds(realise(body.shape, 64))[5]
        beside = box(reach, size.outer + 14.0, size.ear_y + size.hole, size.ear_y + 9.0, top - 0.3, top - 0.1)
        gone = (realise(beside, 64) - realise(body.shape, 64)).volume()
        assert gone == pytest.approx(volume(engraving(body.name[-1], STROKE, 0.0, 0.2)), rel=1e-3)


def test_every_name_of_the_section_is_on_the_page():
    made = _skin()
    root = ET.fromstring(phantom_command.contents(made)["section.svg"])
    named = {body.name for body in (*made.tools, *made.layers)}
    texts = {str(one.text): float(one.get("x", "nan")) for one in root.iter("{http://www.w3.org/2000/svg}text")}
    rows = sorted((x - text_width(t) / 2, x + text_width(t) / 2) for t, x in texts.items() if t in named)
    assert {"muscle", "hypodermis", "skin", "frame2", "frame3", "tray", "plate"} <= set(texts)
    assert rows[0][0] >= 0
    assert rows[-1][1] <= float(root.get("width", "nan"))
    assert all(left[1] < right[0] for left, right in pairwise(rows))

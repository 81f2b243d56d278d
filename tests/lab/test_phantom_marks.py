"""What is written on the phantom: points and their numbers on the lid, a frame's number, names of the section."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from functools import cache
from itertools import pairwise

import pytest

from unitcad.catalogue import printers
from unitcad.export import drawing
from unitcad.kernels.mesh import bounds, realise
from unitcad.lab.phantom import PhantomSet, phantom_files, phantom_set
from unitcad.lab.phantom.box import marks, numbers
from unitcad.lab.phantom.recipe import load_phantom
from unitcad.shape import Shape, box, cylinder, moved, union
from unitcad.shape.lettering import engraving

STROKE, DEPTH = 0.8, 0.4
"""Of the printer fdm-0.4."""


@cache
def _skin() -> PhantomSet:
    return phantom_set(load_phantom("skin"))


def volume(shape: Shape) -> float:
    return realise(shape, 64).volume()


@pytest.mark.parametrize(
    ("diameter", "printer", "points"),
    [
        (14.0, "fdm-0.4", (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)),
        (8.0, "fdm-0.25", (0.0, 3.5, 7.0, 10.5, 14.0, 17.5, 21.0, 25.0, 30.0)),
        (40.0, "fdm-0.4", (0.0, 3.5, 7.0, 30.0)),
        (4.0, "fdm-0.4", (2.5, 6.25, 60.0)),
    ],
)
def test_no_number_of_the_lid_meets_the_seat_a_hole_or_another(
    diameter: float, printer: str, points: tuple[float, ...]
) -> None:
    """What the engraving takes from a lid with seat and holes is the figures' own volume, no less."""
    one, seat = printers()[printer], diameter / 2
    stroke, depth = float(one.engraving_stroke_mm), float(one.engraving_depth_mm)
    plate = realise(box(-40, 110, -40, 40, 0.0, 4.0), 64)
    through = [cylinder(seat, -1.0, 5.0), *(moved(cylinder(1.25, -1.0, 5.0), seat + d, 0.0) for d in points)]
    lid = plate - realise(union(marks(points, seat, stroke, depth, 0.0, 4.0)), 64)
    texts = [f"{distance:g}" for distance in points]
    figures = sum(volume(engraving(part, stroke, 0.0, depth)) for text in texts for part in text.split("."))
    decimal_points = depth * stroke**2 * sum(text.count(".") for text in texts)
    taken = (plate - realise(union(through), 64)).volume() - lid.volume()
    assert taken == pytest.approx(figures + decimal_points, rel=1e-3)
    placed = numbers(points, seat, stroke)
    for i, (x0, y0, x1, y1) in enumerate(placed):
        near = min(abs(y0), abs(y1))
        assert math.hypot(x0, near) >= seat + 1.0 - 1e-9
        assert near >= 1.25 + 2.0
        for x2, y2, x3, y3 in placed[:i]:
            assert max(x0 - x3, x2 - x1, y0 - y3, y2 - y1) >= 1.0 - 1e-9


def test_a_frame_has_the_number_of_its_pour_where_the_blade_does_not_run() -> None:
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


def test_every_name_of_the_section_is_on_the_page() -> None:
    made = _skin()
    root = ET.fromstring(phantom_files.contents(made)["section.svg"])
    named = {body.name for body in (*made.tools, *made.layers)}
    texts = {str(one.text): float(one.get("x", "nan")) for one in root.iter("{http://www.w3.org/2000/svg}text")}
    rows = sorted(
        (x - drawing.text_width(t) / 2, x + drawing.text_width(t) / 2) for t, x in texts.items() if t in named
    )
    assert {"muscle", "hypodermis", "skin", "frame2", "frame3", "tray", "plate"} <= set(texts)
    assert rows[0][0] >= 0
    assert rows[-1][1] <= float(root.get("width", "nan"))
    assert all(left[1] < right[0] for left, right in pairwise(rows))

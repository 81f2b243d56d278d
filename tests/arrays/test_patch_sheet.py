"""The drawing of an array: each place in the table is where the unit or its tool is, each length that of the mesh."""

import math

import numpy as np
import pytest
import trimesh

from tests.arrays.made_arrays import made
from tests.drawn_sheets import ISO_5455, allowed, cells, faults, measured, number, table
from unitcad.arrays.array_file import array_hash
from unitcad.arrays.patch import patch_bodies
from unitcad.arrays.patch_sheet import array_sheets, without_sheet
from unitcad.export import drawing
from unitcad.kernels.mesh import arrays, bounds, realise

NAMES = [
    "forearm-patch",
    *(
        pytest.param(name, marks=pytest.mark.long)
        for name in ("wrist-band", "hex-19", "forearm-pockets", "sleeve-curved")
    ),
]


def sheets_of(name):
    moulds = made(name)
    return moulds, list(array_sheets(moulds, ("unit", "moulds"), array_hash(moulds.array)))


@pytest.mark.parametrize("name", NAMES)
def test_a_caliper_finds_lengths_and_places(name):
    moulds, (patch, *tools) = sheets_of(name)
    named = {sheet.facts[0][0][1]: sheet for sheet in tools}
    drawn = [body for body in moulds.plan.pieces if moulds.plan.called(body.name) in named and body.made == "printed"]
    assert len(drawn) == len(tools) >= 2
    for body in drawn:
        sheet, solid = named[moulds.plan.called(body.name)], moulds.mesh(body)
        for one, found in measured(solid, sheet):
            off = allowed(one.value, moulds.segments)
            assert found == pytest.approx(number(one.text, one.side == "right"), abs=off), (body.name, one)
        assert len(sheet.checks) == 5
        assert sheet.datum == pytest.approx(bounds(solid)[:2], abs=0.01)
        inside = [p for p in moulds.array.places if hit_box(bounds(solid), p)]
        assert [hole.name for hole in sheet.holes][: len(inside)] == [p.name for p in inside] * bool(sheet.holes)
        page, *_ = drawing.pages([sheet])
        for hole in sheet.holes:
            at = hole.x - bounds(solid)[0], hole.y - bounds(solid)[1]
            assert table(page)[hole.name][:2] == pytest.approx(at, abs=0.01)
            assert on_mesh(solid, hole, moulds.segments), (body.name, hole)
    units = {place.name: place for place in moulds.array.places}
    assert {hole.name for hole in patch.holes if hole.name in units} == set(units)


def test_tools_with_curved_faces_have_no_sheet_and_are_named():
    moulds = made("sleeve-curved")
    assert [each["output"] for each in without_sheet(moulds)] == ["drawing of base 2", "drawing of lid 2"]
    assert not without_sheet(made("forearm-patch"))


def hit_box(box, place):
    return box[0] < place.x < box[3] and box[1] < place.y < box[4]


def on_mesh(solid, hole, segments):
    """Whether the outline at some level has a round of the hole's size about its middle, or a slot's sides."""
    vertices, faces = arrays(solid)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    sizes = [float(part) for part in hole.size.removeprefix("Ø").split(" x ")]
    for z in np.linspace(*mesh.bounds[:, 2], 41)[1:-1] + 1e-4:
        cut = np.asarray(trimesh.intersections.mesh_plane(mesh, (0, 0, 1), (0, 0, z))).reshape(-1, 2, 3)
        points = cut[:, :, :2].reshape(-1, 2) - (hole.x, hole.y)
        if len(sizes) == 2:
            near = points[(abs(points) < np.array(sizes) / 2 + 0.1).all(axis=1)]
            if len(near) and np.ptp(near, axis=0) == pytest.approx(sizes, abs=allowed(max(sizes), segments)):
                return True
            continue
        near = abs(np.hypot(*points.T) - sizes[0] / 2) < allowed(sizes[0], segments)
        if len(set(np.floor(np.arctan2(*points[near].T) / (math.tau / 12)))) >= 7:
            return True
    return False


@pytest.mark.parametrize("name", NAMES)
def test_no_text_is_on_a_line_and_scales_are_those_of_iso_5455(name):
    for page in drawing.pages(sheets_of(name)[1]):
        assert not list(faults(page))
        assert cells(page)["scale"] in ISO_5455


def test_the_patch_is_measured_from_its_edges():
    moulds, (patch, *tools) = sheets_of("forearm-patch")
    silicone = [body for body in patch_bodies(moulds.array) if body.made == "cast"]
    boxes = np.array([bounds(realise(body.shape, moulds.segments)) for body in silicone])
    (x0, y0), (x1, y1) = boxes[:, :2].min(axis=0), boxes[:, 3:5].max(axis=0)
    assert [one.value for one in patch.plan.lengths] == pytest.approx([x1 - x0, y1 - y0], abs=0.01)
    assert patch.datum == pytest.approx((x0, y0), abs=0.01)
    assert patch.front.lengths[-1].value == pytest.approx(
        boxes[:, 5].max() - boxes[:, 2].min(), abs=0.12
    )  # the circuit
    (page,) = drawing.pages([patch])
    motors = {
        body.name.partition("-")[0]: bounds(realise(body.shape, 64))
        for body in patch_bodies(moulds.array)
        if body.kind == "motor"
    }
    for name, box in motors.items():
        at = (box[0] + box[3]) / 2 - x0, (box[1] + box[4]) / 2 - y0
        assert table(page)[name][:2] == pytest.approx(at, abs=0.01)
    assert len(motors) == 9
    assert [(hole.name, hole.size) for hole in patch.holes][-2:] == [("S1", "3 x 26"), ("S2", "3 x 26")]
    assert [note.text for note in patch.plan.notes] == ["4× R10"]
    assert [[hole.size for hole in tool.holes if hole.name[0] == "S"] for tool in tools] == [[], [], ["3 x 26"] * 2, []]

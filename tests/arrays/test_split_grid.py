"""Tools larger than the bed along y, along both axes, and of hexagons: a grid of pieces whose seams cross."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_page import take_apart
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.constructions.back_sheet import drawing_of
from unitcad.arrays.patch import patch_moulds
from unitcad.arrays.piece_seams import weep
from unitcad.checks import mould_checks
from unitcad.geometry.segments import between_convex, to_segment
from unitcad.kernels.mesh import bounds
from unitcad.moulds.cuts import BESIDE
from unitcad.shape import box, cut, moved

TWO = ["layout.rows=2", "layout.columns=2"]
BED = {"x": "moulds.bed_x_mm", "y": "moulds.bed_y_mm"}
ARRAYS = {
    "band": ("wrist-band", []),
    "patch, y": ("forearm-patch", ["layout.rows=6", "layout.columns=1", f"{BED['y']}=110"]),
    "patch, x and y": ("forearm-patch", ["layout.pitch_mm=110", *TWO, f"{BED['x']}=140", f"{BED['y']}=140"]),
    "hexagon, y": ("hex-19", [f"{BED['y']}=80"]),
    "hexagon, x and y": ("hex-19", ["layout.rings=3", f"{BED['x']}=110", f"{BED['y']}=100"]),
}
PIECES = {"patch, y": 2, "patch, x and y": 4, "hexagon, y": 2, "hexagon, x and y": 4}
MOSTLY = [pytest.param(name, marks=pytest.mark.long if name == "patch, x and y" else ()) for name in PIECES]
"""A large patch takes half a minute and more, and the hexagons have seams along both axes too."""


@cache
def made(name):
    template, overrides = ARRAYS[name]
    return patch_moulds(load_array(template, overrides))


@pytest.mark.parametrize("name", MOSTLY)
def test_every_piece_has_its_number(name):
    moulds = made(name)
    for each in moulds.plan.splits:
        assert [piece.name for piece in each.pieces] == [f"{each.tool}-{i + 1}" for i in range(PIECES[name])]
        middles = [bounds(moulds.mesh(piece)) for piece in each.pieces]
        # From the left, row by row from the top.
        assert sorted(middles, key=lambda b: (-round((b[1] + b[4]) / 20), b[0])) == middles


@pytest.mark.parametrize("name", ["band", "patch, y"])
def test_no_seam_of_a_cup_lies_over_one_of_the_base(name):
    base, *cups = ({(s.across, s.at) for s in each.seams} for each in made(name).plan.splits)
    assert not any(base & cup for cup in cups)


@pytest.mark.parametrize("name", ["hexagon, y", "hexagon, x and y"])
def test_a_hexagons_seams_keep_clear_of_its_cores(name):
    """The distance of every core from line and teeth, measured on the corners."""
    array = made(name).arranged
    (each,) = made(name).plan.splits
    for seam in each.seams:
        assert seam.teeth
        for place in array.places:
            at = (place.x, place.y) if seam.across == "x" else (place.y, -place.x)
            radius = place.radius - array.sheet.hold_mm
            line = (seam.line[0], *seam.corners, seam.line[-1])
            assert min(to_segment(at, *ends) for ends in pairwise(line)) >= radius + BESIDE - 1e-6
            assert all(between_convex(tooth.corners, [at]) >= radius + BESIDE - 1e-6 for tooth in seam.teeth)


@pytest.mark.parametrize("name", MOSTLY)
def test_the_silicone_in_the_seams_is_what_c250_measures(name):
    """What is refused by lengths and heights, and what is measured on meshes."""
    moulds = made(name)
    (*_, found) = (f for f in mould_checks()["C250"].findings(moulds) if "silicone" in f.where)
    tool, sheet = moulds.plan.splits[-1], moulds.arranged.sheet
    x0, y0, _, x1, y1, _ = bounds(moulds.solids[tool.tool])
    plate, rim = moulds.spec.moulds.plate_mm, moulds.plan.steps[-1].rim
    heights = (plate, plate + rim) if moulds.construction.own_tails else (sheet.low, rim)
    assert weep(moulds.arranged, tool.seams, (x0, y0, x1, y1), heights) == pytest.approx(found.value, rel=0.03)


def test_a_corner_broken_off_where_seams_cross_is_caught():
    moulds = made("hexagon, x and y")
    plan, sound = moulds.plan, moulds.plan.splits[-1]
    ((x, y),) = sound.crossings
    broken = cut(sound.pieces[0].shape, [moved(box(-0.3, 0, 0, 0.3, -99, 99), x, y)])
    faulty = replace(sound, pieces=(replace(sound.pieces[0], shape=broken), *sound.pieces[1:]))
    altered = patch_moulds(moulds.arranged, replace(plan, splits=(*plan.splits[:-1], faulty)))
    found = [f.where for f in mould_checks()["C250"].findings(altered) if not f.ok]
    assert any("where seams cross" in each for each in found), found


def test_pieces_of_a_grid_are_drawn_apart_both_ways():
    moulds = made("hexagon, x and y")
    by = {body.name: offset[:2] for body, offset in take_apart(moulds) if body.name.startswith("base")}
    signs = {name: (math.copysign(1, x), math.copysign(1, y)) for name, (x, y) in by.items()}
    assert signs == {"base-1": (-1, 1), "base-2": (1, 1), "base-3": (-1, -1), "base-4": (1, -1)}


def test_the_procedure_says_how_a_grid_is_joined_and_what_the_bed_is_too_small_for():
    procedure = array_procedure(made("patch, x and y"), [100.0] * 2, 1000.0, {})
    (step,) = [step for step in procedure.preparation if step.title == "Join the pieces"]
    assert "row by row from the back" in step.text
    assert "cup 2 in 4 pieces" in step.text
    blade = next(item for item in procedure.bill if item.item == "blade")
    assert blade.made == "tool"
    assert "bar of metal, 157 mm long" in blade.note
    assert not any("blade" in line for line in procedure.printing.how)


def test_a_single_tooth_at_a_corner_may_be_missing_but_no_piece_is_loose():
    """Of a grid of four by six units no tooth fits beside the outermost row: the other seam holds these pieces."""
    overrides = ["layout.rows=4", "layout.columns=6", "moulds.bed_x_mm=110", "moulds.bed_y_mm=80"]
    drawing = drawing_of(load_array("forearm-patch", [*overrides, "moulds.plinth_clearance_mm=0.05"]))
    for found in (drawing.base_seams, drawing.cup_seams):
        assert {seam.across for seam in found} == {"x", "y"}
        assert all(seam.teeth for seam in found)

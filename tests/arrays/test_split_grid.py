"""Tools larger than the bed along y, and of hexagons; along both axes they are refused."""

from functools import cache
from itertools import pairwise

import pytest

from tests.arrays.made_arrays import refusal_of
from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.arrays.piece_seams import weep
from unitcad.checks import mould_checks
from unitcad.geometry.segments import between_convex, to_segment
from unitcad.kernels.mesh import bounds
from unitcad.moulds.cuts import BESIDE

BED = {"x": "moulds.bed_x_mm", "y": "moulds.bed_y_mm"}
ARRAYS = {
    "band": ("wrist-band", []),
    "patch, y": ("forearm-patch", ["layout.rows=6", "layout.columns=1", f"{BED['y']}=110"]),
    "hexagon, y": ("hex-19", [f"{BED['y']}=80"]),
}
CUT_Y = ["patch, y", "hexagon, y"]


@cache
def made(name):
    template, overrides = ARRAYS[name]
    return patch_moulds(load_array(template, overrides))


@pytest.mark.parametrize("name", CUT_Y)
def test_every_piece_has_its_number(name):
    moulds = made(name)
    for each in moulds.plan.splits:
        assert [piece.name for piece in each.pieces] == [f"{each.tool}-1", f"{each.tool}-2"]
        middles = [bounds(moulds.mesh(piece)) for piece in each.pieces]
        assert sorted(middles, key=lambda b: -b[1]) == middles, "from the top"


@pytest.mark.parametrize("name", ["band", "patch, y"])
def test_no_seam_of_a_cup_lies_over_one_of_the_base(name):
    base, *cups = ({(s.across, s.at) for s in each.seams} for each in made(name).plan.splits)
    assert not any(base & cup for cup in cups)


def test_a_hexagons_seams_keep_clear_of_its_cores():
    """The distance of every core from line and teeth, measured on the corners."""
    array = made("hexagon, y").array
    (each,) = made("hexagon, y").plan.splits
    for seam in each.seams:
        assert seam.teeth
        for place in array.places:
            at, radius = (place.y, -place.x), place.radius - array.sheet.hold_mm
            assert min(to_segment(at, *ends) for ends in pairwise(seam.line)) >= radius + BESIDE - 1e-6
            assert all(between_convex(tooth.corners, [at]) >= radius + BESIDE - 1e-6 for tooth in seam.teeth)


@pytest.mark.parametrize("name", CUT_Y)
def test_the_silicone_in_the_seams_is_what_c250_measures(name):
    """What is refused by lengths and heights, and what is measured on meshes."""
    moulds = made(name)
    (*_, found) = (f for f in mould_checks()["C250"].findings(moulds) if "silicone" in f.where)
    tool, sheet = moulds.plan.splits[-1], moulds.array.sheet
    x0, y0, _, x1, y1, _ = bounds(moulds.solids[tool.tool])
    plate, rim = moulds.spec.moulds.plate_mm, moulds.plan.steps[-1].rim
    heights = (plate, plate + rim) if moulds.construction.own_tails else (sheet.low, rim)
    assert weep(moulds.array, tool.seams, (x0, y0, x1, y1), heights) == pytest.approx(found.value, rel=0.03)


def test_tools_larger_than_the_bed_along_both_axes_are_refused_with_the_bed_that_one_cut_needs():
    changes = {"layout.rows": 4, "layout.columns": 6, "moulds.bed_x_mm": 110, "moulds.bed_y_mm": 80}
    refused = refusal_of("forearm-patch", changes)
    assert refused.field == "moulds.bed_y_mm"
    assert "tools are cut across one only" in refused.limit
    assert made_of(changes | {refused.field: refused.nearest}).plan.splits


def made_of(changes):
    return patch_moulds(load_array("forearm-patch", changes))

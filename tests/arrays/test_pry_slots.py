"""Pry slots: every piece of a base that is cut has one at an edge, clear of what stands there; else it is refused."""

import math
from functools import cache

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.constructions.back_sheet import _base_letters, drawing_of
from unitcad.arrays.patch import patch_moulds
from unitcad.arrays.piece_seams import along_side, outer_sides, pieces
from unitcad.moulds.base import PRY_HALF_WIDTH
from unitcad.shape import box, union

THREE = {"moulds.bed_x_mm": 60}
CUT = [
    THREE,
    {"layout.columns": 12, "moulds.bed_x_mm": 110},
    {"layout.rows": 12},
]


@cache
def three():
    return patch_moulds(load_array("forearm-patch", THREE))


@pytest.mark.parametrize("changes", CUT, ids=["3 x 1", "3 x 1, wide", "1 x 2"])
def test_every_piece_of_a_cut_base_has_a_slot_and_two_pins_clear_of_it(changes):
    drawn = drawing_of(load_array("forearm-patch", changes))
    wall = drawn.spec.moulds.least_wall_mm - 1e-9
    plate = (-drawn.lay.plate[0], -drawn.lay.plate[1], *drawn.lay.plate)
    of_base = pieces(plate, drawn.base_seams)
    assert len(of_base) > 1
    for number, piece in enumerate(of_base, 1):
        own = [slot for slot in drawn.pry if slot.piece == number]
        sides = {slot.side for slot in own}
        assert sides
        assert sides <= set(outer_sides(piece, plate))
        # At both ends, where the piece has two opposite edges of the base.
        assert len(sides) == 2 or {"left", "right"} & sides
        standing = [pin for pin in drawn.pins.places if piece[0] < pin[0] < piece[2] and piece[1] < pin[1] < piece[3]]
        assert len(standing) >= 2
        for slot in own:
            x0, y0, x1, y1 = slot.taken(drawn.lay)
            inside = along_side(piece, slot.side)
            assert inside[0] < slot.middle - PRY_HALF_WIDTH < slot.middle + PRY_HALF_WIDTH < inside[1]
            for px, py in standing:
                beside = math.hypot(max(x0 - px, 0, px - x1), max(y0 - py, 0, py - y1))
                assert beside >= drawn.hole + wall
    assert {slot.piece for slot in drawn.pry} == {*range(1, len(of_base) + 1)}


def test_the_middle_piece_of_three_has_its_slots_in_front_and_behind():
    assert [slot[:2] for slot in three().plan.pry_slots] == [(1, "left"), (2, "front"), (2, "back"), (3, "right")]


def test_the_slots_reach_under_the_cup_from_the_plates_edge():
    """A screwdriver of 7.5 x 0.7 mm gets in from outside, 1 mm far under the cup."""
    moulds = three()
    lay, base = moulds.plan.layout, moulds.mesh(moulds.plan.tool("base"))
    for _, side, middle in moulds.plan.pry_slots:
        if side in ("front", "back"):
            sign = 1 if side == "back" else -1
            low, high = sorted((sign * (lay.cup[1] - 1), sign * (lay.plate[1] + 1)))
            tip = box(middle - 3.75, middle + 3.75, low, high, -0.75, -0.05)
            assert (base ^ moulds.meshes([tip])[0]).volume() == 0


def test_marks_of_pieces_keep_clear_of_slots():
    """The middle piece has room for its number alone. No face of a mark is open to a slot."""
    moulds = three()
    lay = moulds.plan.layout
    drawn = drawing_of(moulds.array)
    letters = moulds.meshes([union(tuple(_base_letters(drawn, "B62A6")))])[0]
    assert len(letters.decompose()) == 6 + 1 + 6
    for slot in drawn.pry:
        x0, y0, x1, y1 = slot.taken(lay)
        assert (letters ^ moulds.meshes([box(x0 - 0.5, x1 + 0.5, y0 - 0.5, y1 + 0.5, -2, 1)])[0]).volume() == 0

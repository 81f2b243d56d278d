"""Pockets: every mould check holds on the tray, and a fault drawn into it is caught."""

from dataclasses import replace

import pytest

from tests.arrays.made_arrays import findings, made
from tests.moulds.faulty_sets import broken
from unitcad.arrays.array_file import load_array
from unitcad.arrays.constructions import construction_of
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import check_moulds, overlap
from unitcad.errors import Refusal
from unitcad.moulds.cavities import BALANCE
from unitcad.shape import box, cut, cylinder, moved, polygon, union
from unitcad.shape.tree import Revolve
from unitcad.validation import load


@pytest.mark.parametrize("name", ["forearm-pockets", "hex-19"])
def test_only_the_hold_is_shared_and_the_cavity_is_the_sheet(name):
    moulds = made(name)
    assert [f for f in findings(name) if f.code == "C200" and "sheet" in f.where]
    (cavity,) = moulds.cavities
    assert cavity.reached.volume() == pytest.approx(moulds.mesh(moulds.unit[0]).volume(), rel=BALANCE)


def test_a_pocket_is_smaller_than_its_unit_by_the_hold():
    array = load_array("forearm-pockets", ["sheet.hold_mm=0.35"])
    moulds = patch_moulds(array)
    held = [f for f in check_moulds(moulds) if f.where.startswith("pocket")]
    assert [f.value for f in held] == [pytest.approx(100 * (7 / 6.65 - 1))]
    solid = moulds.mesh(moulds.unit[0])
    assert solid.genus() == 9 + 2
    free = cylinder(6.64, -1, 9)
    for place in array.places:
        x, y = place.x, place.y
        assert (solid ^ moulds.meshes([moved(free, x, y)])[0]).volume() == 0
        assert (solid ^ moulds.meshes([moved(cylinder(6.7, -1, 9), x, y)])[0]).volume() > 1


LAYOUT = {"kind": "grid", "columns": 2, "rows": 2, "pitch_mm": 24}


def _of(unit, **more):
    return {"name": "own", "array": "pockets", "unit": unit, "layout": LAYOUT, **more}


@pytest.mark.parametrize(
    ("unit", "why"), [("custom/strap-lugs", r"reaches 12\.5 mm"), ("custom/dome", "at the sheet's height")]
)
def test_a_unit_that_is_no_disc_is_refused_with_one_that_is_held(unit, why):
    name = unit.rpartition("/")[2]
    placed = _of("encapsulating", place=[{"at": "B2", "unit": unit}], sheet={"thickness_mm": 1.5})
    for field, data in (("unit", _of(unit)), ("place.0.unit", placed)):
        with pytest.raises(Refusal, match=why) as refused:
            load_array(data)
        assert (refused.value.field, refused.value.value) == (field, name)
        assert load_array(data, {field: refused.value.nearest})


def test_a_tail_that_leaves_at_the_sheet_is_refused():
    with pytest.raises(Refusal, match="leave at the sheet's height") as refused:
        load_array(_of("custom/film-closed", sheet={"thickness_mm": 3.3}))
    assert refused.value.field == "unit"


def test_units_that_meet_each_other_or_the_sheet_are_caught():
    """A tail turned into a neighbour, and lugs that no refusal kept out: 12 by 4 by 1.5 mm through the sheet."""
    array = load_array("forearm-pockets")
    turned = replace(array, places=(replace(array.places[0], angle_deg=0.0), *array.places[1:]))
    assert {f.where for f in overlap.findings(patch_moulds(turned)) if not f.ok} == {"unit: A1 and A2"}
    array = load_array(_of("encapsulating"))
    lugs = replace(array, places=tuple(replace(place, unit=load("custom/strap-lugs")) for place in array.places))
    caught = {f.where: f.value for f in overlap.findings(patch_moulds(lugs)) if not f.ok}
    assert caught["unit: sheet and A1"] > 10
    assert caught["unit: A2 and B2"] > 1


_FAULTS = [
    ("C100", "a core 0.1 too wide", lambda base: union((base, moved(cylinder(6.9, -1, 2), 20, 20)))),
    ("C100", "no core of a strap slot", lambda base: cut(base, [box(29, 34, -14, 14, 0, 3)])),
    ("C100", "a hole in the wall", lambda base: cut(base, [box(35, 60, -1, 1, 0.5, 1.5)])),
    ("C200", "a core that widens", lambda base: union((base, Revolve(polygon((0, 0.5), (7.2, 2), (0, 2)))))),
    ("C000", "a loose piece", lambda base: union((base, box(-1, 1, 60, 62, 0, 2)))),
    ("C400", "a hollow roof", lambda base: union((base, cut(box(-4, 4, 6, 14, 1, 2), [box(-3, 3, 9, 11, 0.9, 1.6)])))),
]  # fmt: skip


@pytest.mark.parametrize(("code", "what", "change"), _FAULTS, ids=[what for _, what, _ in _FAULTS])
def test_a_fault_in_the_tray_is_caught(code, what, change):
    array = load_array("forearm-pockets")
    plan = construction_of("pockets", "flat").plan(array)
    base = change(plan.tools[0].shape)
    altered = replace(plan, tools=(replace(plan.tools[0], shape=base), *plan.tools[1:]))
    assert code in broken(patch_moulds(array, altered))

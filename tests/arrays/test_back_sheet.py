"""Back sheets: every mould check holds on their tools, and a fault drawn into one is caught by its code."""

import math
from dataclasses import replace

import pytest

from tests.arrays.made_arrays import less, made, more, notch, with_tool
from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import mould_checks
from unitcad.errors import Refusal
from unitcad.moulds.pieces import Removal
from unitcad.shape import box, cut, cylinder, moved


def test_the_silicone_has_the_volume_of_its_lengths():
    """Twelve notches, 3.4 wide and 2.11 high, in nine rings; the sheet 76 x 60 x 1.25, corners of 10, two slots."""
    moulds = made("forearm-patch")
    layer1, layer2 = (moulds.mesh(body).volume() for body in moulds.unit)
    drawn = moulds.array.sheet
    slots = 2 * (3 * 23 + math.pi * 1.5**2)
    sheet = (76 * 60 - (4 - math.pi) * drawn.corner_mm**2 - slots) * 1.25
    rings = 9 * math.pi * (7**2 - 5.75**2) * 3.36 - 12 * notch(5.75, 7) * 2.11
    inner = 9 * math.pi * (5.75**2 * 3.36 - 4.5**2 * 2.11) - 12 * notch(4.5, 5.75) * 2.11
    assert layer2 == pytest.approx(sheet + rings, rel=1e-3)
    assert layer1 == pytest.approx(inner, rel=2e-3)


def test_a_cup_goes_on_the_pins_in_one_attitude_only():
    pins = made("forearm-patch").plan.pins
    turned = {(-x, -y) for x, y in pins.places}
    assert len(turned - set(pins.places)) == 2
    assert min(math.dist(p, q) for p in turned - set(pins.places) for q in pins.places) > pins.hole_radius


# Units at -20, 0, 20; cup 1: bore 5.75, groove 6.75 to 8.25; cup 2: groove from 31 to 32.5 at y, pins at y = 35.45.
FAULTS = [
    ("C000", "cup1", "a pin's hole into a groove", less(moved(cylinder(2.15, -1, 2.5), 0, 7.5))),
    ("C000", "cup2", "a pin's hole into the groove", less(moved(cylinder(2.15, -1, 3.7), 10, 31.75))),
    ("C240", "cup2", "a pin's hole 0.5 from a bore", less(moved(cylinder(2.15, -1, 2.4), 0, 29.6))),
    ("C210", "base", "a pin 0.1 too thick", more(moved(cylinder(2.1, 0, 1.5), 23.2, -35.45))),
    ("C210", "base", "a fin 0.1 too wide", more(box(-15, -12.5, -1.8, 1.8, 0, 2.11))),
    ("C100", "base", "a fin 0.2 low", less(box(-15, -12.5, -2, 2, 1.91, 3))),
    ("C200", "base", "a fin longer than its slot", more(box(-12, -11.4, -1.7, 1.7, 0, 2.11))),
    ("C300", "cup2", "a lip in a bore", more(box(-7.2, -6.9, -1, 1, 2.5, 2.8))),
    ("C310", "base", "a core into the cap, which has no hole for it", more(cylinder(3, 0, 2.31))),
    ("C410", "cup2", "a lid with a pinhole", more(cut(box(-38, 38, -30, 30, 4.4, 4.61), [box(0, 0.3, 0, 0.3, 4, 5)]))),
]


@pytest.mark.parametrize(("code", "tool", "what", "change"), FAULTS, ids=[f"{f[0]}-{f[1]}-{f[2]}" for f in FAULTS])
def test_a_planted_fault_is_caught(code, tool, what, change):
    found = mould_checks()[code].findings(with_tool(made("forearm-patch"), tool, change))
    assert not all(f.ok for f in found), what


def test_an_impossible_order_is_caught():
    """Cup 2 lifted, or the patch pushed out over the fins before the base is off."""
    moulds = made("forearm-patch")
    plan, last = moulds.plan, moulds.plan.steps[-1]
    for order in (
        (*last.removals[:-2], Removal("cup2", (0, 0, 1)), last.removals[-2]),
        (*last.removals[:-2], last.removals[-2], last.removals[-2], last.removals[-1]),
        last.removals[:1] + last.removals[-2:] + last.removals[1:-2],
    ):
        steps = (*plan.steps[:-1], replace(last, removals=order))
        found = mould_checks()["C300"].findings(patch_moulds(moulds.array, replace(plan, steps=steps)))
        assert not all(f.ok for f in found)


def test_corners_of_the_circuit_that_reach_into_silicone_are_refused_before_they_overlap():
    data = {"name": "hex", "array": "back-sheet", "unit": "encapsulating"}
    data |= {"layout": {"kind": "hex", "rings": 2, "pitch_mm": 21.04}}
    overlaps = mould_checks()["C200"].findings
    try:
        found = list(overlaps(patch_moulds(load_array(data))))
    except Refusal as refused:
        assert refused.field == "circuit.corner_mm"
        found = list(overlaps(patch_moulds(load_array(data, [f"circuit.corner_mm={refused.nearest}"]))))
    assert [f for f in found if not f.ok] == []

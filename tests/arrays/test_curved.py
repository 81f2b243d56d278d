"""Back sheets cast round the limb: every mould check holds on their tools, and a fault drawn into one is caught."""

import math
from dataclasses import replace
from functools import partial

import pytest

from tests.arrays.made_arrays import less, made, more, notch, refusal_of, with_tool
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import mould_checks
from unitcad.moulds.pieces import CAST, Removal
from unitcad.shape import box, cut, cylinder, moved, rotated

R = 40.0


sleeve = partial(made, "sleeve-curved")
pair = partial(sleeve, "layout.columns=2", "layout.rows=1")
"""Two units side by side: what is quick to judge."""


def test_the_silicone_has_the_volume_of_its_lengths():
    """A barrel 1.25 thick and 60 long with corners of 10; what each unit adds under it, summed over its foot."""
    moulds = sleeve()
    layer1, layer2 = (moulds.mesh(body).volume() for body in moulds.unit)
    sheet = moulds.array.sheet
    low, back = R + sheet.low, R + sheet.high
    assert back == pytest.approx(math.hypot(R + 4.61, 5.75), abs=1 / 1024)
    turn = 60 / (R + (sheet.low + sheet.high) / 2)

    def area(radius):
        """Of a cylinder's part of the sheet: each corner keeps a quarter disc, seen square to the sheet's end."""
        n, lost = 2000, 0.0
        for i in range(n):
            x = 10 * (i + 0.5) / n  # from the end's plane inwards
            lost += (10 - math.sqrt(100 - (10 - x) ** 2)) * (10 / n) / math.sqrt(1 - (x / radius) ** 2)
        return radius * turn * 60 - 4 * lost

    barrel = sum(area(low + 1.25 * (i + 0.5) / 50) for i in range(50)) * 1.25 / 50

    def under(inner, outer, top):
        """Between a unit's foot and the sheet: from `top` up, or from the skin where that is 0."""
        n, total = 400, 0.0
        for i in range(n):
            for k in range(n):
                x, y = (outer * (2 * (j + 0.5) / n - 1) for j in (i, k))
                if inner <= math.hypot(x, y) < outer:
                    total += math.sqrt(low**2 - x**2) - R - top
        return total * (2 * outer / n) ** 2

    rings = 9 * (under(5.75, 7, 0) + under(0, 5.75, 3.36)) - 12 * notch(5.75, 7) * 2.11
    assert layer2 == pytest.approx(barrel + rings, rel=2e-3)
    assert layer1 == pytest.approx(
        sum(moulds.mesh_of(shape).volume() for shape in moulds.plan.steps[0].layer), rel=1e-9
    )


def test_each_unit_stands_where_its_arc_is():
    """The middle of its foot touches the limb, at the angle that its place has on the sheet's middle."""
    moulds = sleeve()
    middle = R + (moulds.array.sheet.low + moulds.array.sheet.high) / 2
    motors = {body.name: moulds.mesh(body) for body in moulds.plan.laid_later if body.kind == "motor"}
    for place in moulds.array.places:
        x0, y0, z0, x1, y1, z1 = motors[f"{place.name}-motor"].bounding_box()
        x, y, z = (x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2 + R
        assert math.atan2(x, z) == pytest.approx(place.x / middle, abs=1e-9)
        assert (math.hypot(x, z), y) == (pytest.approx(R + 1.0, abs=2e-3), pytest.approx(place.y, abs=1e-9))


def at(shape, degrees):
    """What is drawn about the z axis, the skin at z = 0, turned about the limb's axis."""
    return moved(rotated(moved(shape, z=R), "y", degrees), z=-R)


SLANT = math.degrees(10 / (R + 4.3545))
SEAT = pair().plan.steps[-1].pins.seat
FAULTS = [
    ("C100", "lid2", "a seam across the land", less(box(-0.2, 0.2, 5, 40, 4.5, 5.5))),
    ("C200", "base2", "a core 0.05 too high", more(at(cylinder(4, 0, 2.16), SLANT))),
    ("C220", "lid2", "holes for the pins too wide", less(box(-99, 99, -99, 99, SEAT - 1, SEAT + 3))),
    ("C300", "base2", "a knob on a slanted core", more(at(cylinder(4.7, 1.0, 1.4), SLANT))),
    ("C400", "lid2", "the vents of an end that are shut", more(box(-4, 4, 8, 11, 5.1, 8))),
    ("C410", "lid2", "a sprue that is nearly shut", more(cut(box(-2, 2, -2, 2, 6, 7.98), [box(0, 0.3, 0, 0.3, 5, 9)]))),
]


@pytest.mark.parametrize(("code", "tool", "what", "change"), FAULTS, ids=[f"{f[0]}-{f[1]}-{f[2]}" for f in FAULTS])
def test_a_planted_fault_is_caught(code, tool, what, change):
    faulty = mould_checks()[code].findings(with_tool(pair(), tool, change))
    assert not all(f.ok for f in faulty), what


def test_a_wrong_axis_or_an_impossible_order_is_caught():
    """Units pulled straight up, or along a neighbour's axis; the cast before the lid; Layer 1 never taken out."""
    plan = pair().plan
    first, last = plan.steps
    parts = [removal for removal in last.removals if removal.piece == CAST]
    others = last.removals[: -len(parts)]
    upright = (*others, *(replace(part, direction=(0, 0, 1)) for part in parts))
    neighbours = (*others, replace(parts[0], direction=parts[1].direction), *parts[1:])
    for index, removals, caught in (
        (1, upright, "pour 2: cast at A1 out against base2"),
        (1, neighbours, "pour 2: cast at A1 out against base2"),
        (1, (*parts, *others), "pour 2: cast at A1 out against lid2"),
        (1, (*others, *parts[1:-1]), "mm3 of the silicone stay"),
        (1, (*others, parts[0], *parts), "pour 2: cast at A1 out"),
        (1, (*others, Removal(CAST, (0, 0, 1))), "pour 2: cast out against base2"),
        (0, first.removals[:-1], "pour 1: cast stays"),
    ):
        steps = [first, last]
        steps[index] = replace(steps[index], removals=removals)
        found = mould_checks()["C300"].findings(patch_moulds(pair().array, replace(plan, steps=tuple(steps))))
        assert any(caught in f.where for f in found if not f.ok), caught


def test_a_unit_laid_in_at_its_neighbours_slant_is_an_overlap():
    plan = pair().plan
    first, last = plan.steps
    swapped = replace(last, earlier=(rotated(last.earlier[0], "y", 0.5), *last.earlier[1:]))
    moulds = patch_moulds(pair().array, replace(plan, steps=(first, swapped)))
    assert any("layer1 laid in" in f.where for f in mould_checks()["C200"].findings(moulds) if not f.ok)


@pytest.fixture(scope="module")
def procedure():
    moulds = sleeve()
    return array_procedure(moulds, [moulds.mesh(body).volume() for body in moulds.unit], 1000.0, {})


def test_layer_1_is_taken_out_and_laid_in_before_the_rest_is_injected(procedure):
    first, last = ([step.title for step in pour.steps] for pour in procedure.pours)
    assert first[-1] == "Cup 1 off"
    order = ["Layer 1 out", "Filament into base 2", "Wipe Layer 1", "Lay Layer 1 in", "Lid 2 on", "Inject", "Cure"]
    assert [title for title in last if title in order] == order
    assert last[-1] == "Lid 2 off"
    assert [step.title for step in procedure.release] == ["Filament out", "Peel off"]
    assert procedure.time_line[-1].name == "motors and circuit in"
    # What is cast flat bonds later.
    assert not any("Release agent, if any" in step.text for pour in procedure.pours for step in pour.steps)
    assert "No release agent" in next(step.text for step in procedure.pours[0].steps if step.title == "Cup 1 on")


def test_what_is_weighed_and_bought_is_that_of_both_pours(procedure):
    volumes = [sleeve().mesh(body).volume() for body in sleeve().unit]
    # A sprue of 3 mm and four vents of 1 mm through the lid's 3 mm, and 0.25 mm into the sheet: the vents, which stand
    # 2.5 degrees aside, that far below its back at their outer edges.
    back = sleeve().array.radius_mm + sleeve().array.sheet.high
    lower = back - math.sqrt(back**2 - (back * math.sin(math.radians(2.5)) + 0.5) ** 2)
    volumes[1] += math.pi * (1.5**2 * 3.25 + 4 * 0.5**2 * (3.25 + lower))
    for pour, volume in zip(procedure.pours, volumes, strict=True):
        net, density = (
            next(f.value for f in pour.figures if f.name == name) for name in ("in the cavities, net", "density")
        )
        assert net == pytest.approx(volume * density / 1000, rel=1e-6)
    items = {item.item: item.quantity for item in procedure.bill}
    assert items["filament"] == items["filament, straight"] == 9
    assert (items["syringe"], items["flexible circuit"], items["lid 2"]) == (1, 1, 1)
    assert (items["degassing container"], items["narrow pliers"]) == (1, 1)
    assert "flat pliers" not in items  # for tongues that are cut


def test_curved_tools_beyond_the_bed_are_refused_with_the_rows_that_fit():
    """A row more does not fit."""
    refused = refusal_of("sleeve-curved", ["layout.rows=12"])
    assert refused.field == "layout.rows"
    assert made("sleeve-curved", f"layout.rows={refused.nearest}").plan
    refusal_of("sleeve-curved", [f"layout.rows={int(str(refused.nearest)) + 1}"])

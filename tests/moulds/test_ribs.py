"""The ribs that centre a cup: where they stand, and what they do to its eccentricity."""

import math

import numpy as np
import pytest
from faulty_sets import broken, set_of, with_fault

from tests.sample_bodies import LEADLESS
from unitcad.casting.figures import UNEVEN, eccentricity
from unitcad.catalogue import printers
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.moulds.base import draw_taper
from unitcad.moulds.cup import rib_shapes, ribs, skirt_end, slot_shapes
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Common, box, cut, union
from unitcad.validation import templates

SETS = [
    ("encapsulating",),
    ("embedded", "moulds.printer=fdm-0.25"),
    ("encapsulating", "moulds.cavities=[2,3]"),
    ("encapsulating", "moulds.pour=injected"),
    ("custom/strap-lugs",),
    ("custom/film-closed",),
    ("encapsulating", "moulds.printer=sla"),
    ("embedded", "moulds.printer=sla", "moulds.cavities=[2,2]"),
    ("custom/strap-lugs", "moulds.printer=sla"),
]


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_ribs_stay_clear_of_cavity_windows_tongues_and_pry_slots(source):
    """Measured between meshes: half a millimetre to whatever else the cup touches or lets through."""
    moulds = set_of(*source)
    (standing,) = [moulds.meshes(rib_shapes(moulds.frame))]
    assert len(ribs(moulds.frame)) == 8
    for step in moulds.plan.steps:
        others = moulds.meshes((*step.layer, *step.earlier, *step.seals))
        others += [moulds.solids[tongue.name] for tongue in moulds.plan.standing(step, "tongue")]
        assert min(rib.min_gap(other, 2.0) for rib in standing for other in others) > 0.5
    plate = -moulds.spec.moulds.plinth_height_mm
    assert min(rib.bounding_box()[2] for rib in standing) > plate + 0.2


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_the_crushed_volume_is_that_of_the_crests(source):
    """What base and cup share, by the trapezium of a crest: its height x depth x (line + depth), and its two ramps."""
    moulds = set_of(*source)
    line, depth = float(printers()[moulds.spec.moulds.printer].least_feature_mm), moulds.spec.moulds.rib_interference_mm
    (first, *_) = standing = ribs(moulds.frame)
    least = len(standing) * (first.top - first.bottom) * depth * (line + depth)
    ramps = len(standing) * (first.head - first.foot - first.top + first.bottom) * depth * (line + depth)
    for step in moulds.plan.steps:
        shared = (moulds.solids[step.cup] ^ moulds.solids["base"]).volume()
        assert 0.98 * least < shared < least + ramps
        assert (moulds.pressed[step.cup] ^ moulds.solids["base"]).volume() < 1e-9


def test_the_shift_of_unequal_ribs_is_that_of_a_simulated_press():
    """The cup is let go at its place and moved by each rib's force until nothing moves it: no algebra in common."""
    moulds = set_of("embedded", "moulds.cavities=[2,2]")
    standing, depth = ribs(moulds.frame), 0.1
    rng, worst = np.random.default_rng(3), 0.0
    for strengths in rng.choice((1 - UNEVEN, 1 + UNEVEN), (15, len(standing))):
        x = y = turn = 0.0
        for _ in range(4000):
            fx = fy = moment = 0.0
            for rib, strength in zip(standing, strengths, strict=True):
                nx, ny = rib.inwards
                crushed = depth + nx * (x - turn * rib.y) + ny * (y + turn * rib.x)
                # The plinth pushes the rib back the way that it came from.
                px, py = -nx * strength * crushed, -ny * strength * crushed
                fx, fy, moment = fx + px, fy + py, moment + rib.x * py - rib.y * px
            x, y, turn = x + 0.05 * fx, y + 0.05 * fy, turn + 2e-4 * moment
        assert math.hypot(fx, fy) < 1e-9
        worst = max(worst, *(math.hypot(x - turn * c.y, y + turn * c.x) for c in moulds.plan.layout.cells))
    bound = eccentricity(moulds).as_drawn_mm
    assert worst <= 1.1 * bound
    assert worst > 0.3 * bound


@pytest.mark.parametrize("name", sorted(templates()))
@pytest.mark.parametrize("printer", ["fdm-0.4", "fdm-0.25", "sla"])
def test_ribs_leave_a_fifth_of_the_eccentricity(name, printer):
    moulds = set_of(name, f"moulds.printer={printer}")
    without = eccentricity(set_of(name, f"moulds.printer={printer}", "moulds.rib_interference_mm=0"))
    made = eccentricity(moulds)
    assert without.as_drawn_mm == pytest.approx(math.sqrt(2) * moulds.spec.moulds.plinth_clearance_mm)
    assert made.as_drawn_mm < 0.25 * without.as_drawn_mm
    assert made.at_worst_mm < 0.3 * without.at_worst_mm


def test_ribs_too_low_for_the_play_leave_the_rest_of_it():
    made = eccentricity(set_of("encapsulating", "moulds.rib_interference_mm=0.02"))
    assert made.at_worst_mm == pytest.approx(math.sqrt(2) * 0.13)


def test_no_ribs_where_none_are_asked_for():
    for printer in ("sla", "fdm-0.4"):
        moulds = set_of("encapsulating", "moulds.rib_interference_mm=0", f"moulds.printer={printer}")
        assert moulds.spec.moulds.plinth_height_mm == 2.0
        assert rib_shapes(moulds.frame) == []
        assert broken(moulds) == set()
        assert all("play" in f.where for f in check_moulds(moulds) if f.code == "C220")
        assert eccentricity(moulds).ribs == 0


def test_a_rib_wider_into_the_plinth_than_half_a_line_is_refused():
    with pytest.raises(Refusal) as refused:
        set_of("encapsulating", "moulds.rib_interference_mm=0.25")
    assert (refused.value.field, refused.value.nearest) == ("moulds.rib_interference_mm", 0.2)
    assert broken(set_of("encapsulating", "moulds.rib_interference_mm=0.2")) == set()


def test_a_resin_cup_s_leaves_bend_within_the_limit_and_into_their_slots():
    """By the beam's closed formula: 1.5 x 0.5 x 0.13 / 3.06^2, the arm from the crest's measured top to the seat."""
    moulds = set_of("encapsulating", "moulds.printer=sla")
    rib = ribs(moulds.frame)[0]
    found = {f.where: f for f in check_moulds(moulds) if f.code == "C220" and "leaf" in f.where}
    assert len(found) == 4
    for cup in ("cup1", "cup2"):
        strain, room = found[f"{cup}: strain at the root of a rib's leaf"], found[f"{cup}: room behind a rib's leaf"]
        least, most = (150 * 0.5 * 0.13 / arm**2 for arm in (-rib.top, -rib.head))
        assert least * 0.98 < strain.value < most * 1.02 < 1.2
        assert room.value == pytest.approx(0.5, abs=0.005)


def _leaf_broken(change):
    moulds = with_fault(set_of("encapsulating", "moulds.printer=sla"), "cup1", change)
    return {f.where for f in check_moulds(moulds) if f.code == "C220" and not f.ok}


def test_faults_of_a_leaf_are_found():
    """A slot that ends low, one that a flaw fills, a leaf twice as thick, and one that is not freed at one side."""
    moulds = set_of("encapsulating", "moulds.printer=sla")
    slots, rib = slot_shapes(moulds.frame)[0], ribs(moulds.frame)[0]
    strain, room = "cup1: strain at the root of a rib's leaf", "cup1: room behind a rib's leaf"
    x, y = rib.x, rib.y
    recess = draw_taper(moulds.plan.layout, moulds.spec.moulds.plinth_clearance_mm, skirt_end(moulds.spec))

    def filled(*space):
        return lambda shape: union((shape, cut(Common((slots, box(*space))), [recess])))

    assert _leaf_broken(filled(-20, 20, -20, 20, -1.0, 0.0)) == {strain}
    assert _leaf_broken(filled(x - 0.2, x + 2, y - 1, y + 2, -9, 0.0)) == {strain, room}
    assert _leaf_broken(filled(x, x + 1.1, y - 1.2, y + 1.2, -9, 0.0)) == {strain}
    assert _leaf_broken(filled(x - 0.2, x + 2, y + 1.2, y + 2, -9, 0.0)) == {strain, room}


def test_a_plinth_too_low_for_the_leaves_is_refused():
    with pytest.raises(Refusal) as refused:
        set_of("encapsulating", "moulds.printer=sla", "moulds.plinth_height_mm=2")
    assert refused.value.field == "moulds.plinth_height_mm"
    nearest = f"moulds.plinth_height_mm={refused.value.nearest}"
    assert broken(set_of("encapsulating", "moulds.printer=sla", nearest)) == set()


def test_a_printer_of_ones_own_without_the_key_has_none():
    from unitcad.validation import from_data, read

    entry = {
        name: float(value) if not isinstance(value.value, str) else value.value
        for name in printers()["fdm-0.4"].__struct_fields__
        if name not in ("name", "rib_interference_mm") and (value := getattr(printers()["fdm-0.4"], name)) is not None
    }
    data = {**read(LEADLESS), "moulds": {"printer": "ours"}, "printers": {"ours": entry}}
    moulds = MouldSet(from_data(data))
    assert moulds.spec.moulds.rib_interference_mm == 0
    assert broken(moulds) == set()

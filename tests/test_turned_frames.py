"""What is turned by any angle: it balances and overlaps as unturned solids do, and the kernels agree on it.

A unit stands in a block at a slant: the block has its moat, with core and fin; an insert sits on the core, silicone
fills the rest. All of it is drawn in the unit's frame and turned as a whole; the block is drawn in another frame. The
joint of insert and block has a seal: where faces meet but for a rounding, booleans lose up to 2e-4 of the cavity at one
slant in eleven.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold

from tests.sample_bodies import LEADLESS
from unitcad.checks import balance, draw, overlap
from unitcad.checks.draw import blocked
from unitcad.errors import UnitcadError
from unitcad.kernels import bounds, mesh
from unitcad.moulds.mould_set import MouldSet, origin_of
from unitcad.moulds.pieces import CAST, Removal, base_piece
from unitcad.moulds.plan import Step
from unitcad.shape import Common, box, cut, cylinder, exact_volume, moved, ring, rotated, union
from unitcad.shape.tree import Body
from unitcad.validation import load

SEGMENTS, TOP = 48, 6.0
CORE, FIN = cylinder(4.9, 0, 2.125), box(0, 9, -1.7, 1.7, 0, 2.125)
MOAT = cut(cylinder(7, 0, 40), [CORE, FIN])
INSERT = cut(cylinder(5.75, 0, 4), [CORE, FIN])
SEAL = cylinder(5.75, -1 / 8, 4)
"""The insert without its hollow, and sunk into the floor: no joint is left beside the cavity."""
WITHOUT_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)
SLANTS = st.tuples(st.floats(-180, 180), st.floats(-60, 60), st.floats(-180, 180))
"""Turns about z, y and z again, degrees."""
AT = st.tuples(*[st.integers(-20_000, 20_000).map(lambda steps: steps / 1024)] * 2)


def placed(shape, slant, at):
    """The solid at a slant, where its unit stands."""
    first, tilt, second = slant
    return moved(rotated(rotated(rotated(shape, "z", first), "y", tilt), "z", second), *at)


def axis_of(slant):
    """The unit's axis, by mathematics of its own: the first turn is about it."""
    _, tilt, second = (math.radians(degrees) for degrees in slant)
    return math.sin(tilt) * math.cos(second), math.sin(tilt) * math.sin(second), math.cos(tilt)


def block(at):
    return moved(box(-60, 60, -60, 60, -20, TOP), *at)


def mould(slant, at, insert=INSERT):
    """The block as a mould: an insert lies in the moat, the rest is poured."""
    spec = load(LEADLESS)
    plan = MouldSet(spec).plan
    room, laid = placed(MOAT, slant, at), placed(insert, slant, at)
    step = Step(
        index=1,
        name="layer1",
        material="",
        tools=("base",),
        layer=(cut(Common((room, block(at))), [placed(INSERT, slant, at)]),),
        earlier=(),
        seals=(placed(SEAL, slant, at),),
        inserts=(Body("insert", "unit", "layer", laid, (0.5, 0.5, 0.5), made="cast"),),
        rim=TOP,
        top=TOP,
    )
    return planned(spec, replace(plan, tools=(base_piece(cut(block(at), [room])),), steps=(step,)))


def planned(spec, plan):
    """The set of a spec with other tools and pours."""
    made = MouldSet(spec, origin=replace(origin_of(spec), plan=lambda: plan))
    made.__dict__["rib_spaces"] = Manifold()  # there is no cup to be centred
    return made


def faults(moulds):
    """The codes of balance and overlap that a mould breaks."""
    found = [*balance.findings(moulds), *(f for f in overlap.findings(moulds) if f.where.startswith("pour"))]
    assert {finding.code for finding in found} == {"C100", "C200"}
    return {finding.code for finding in found if not finding.ok}


@settings(max_examples=25, deadline=None, phases=WITHOUT_SHRINKING)
@given(SLANTS, AT)
def test_a_mould_balances_and_nothing_overlaps_at_any_slant(slant, at):
    assert faults(mould(slant, at)) == set()


@settings(max_examples=10, deadline=None, phases=WITHOUT_SHRINKING)
@given(SLANTS)
def test_what_blocks_a_piece_along_its_own_axis_is_the_same_volume_at_any_slant(slant):
    collar = moved(cylinder(8, 0, 0.5), z=3)
    for piece, area in ((INSERT, 0.0), (union((INSERT, collar)), math.pi * (8**2 - 7**2))):
        stays = cut(cylinder(9, -3, 20), [union((MOAT, piece))])
        one, other = (mesh.realise(placed(shape, slant, (0, 0)), SEGMENTS) for shape in (piece, stays))
        met = sum(blocked(one, {"": other}, axis_of(slant)).values())
        assert met == pytest.approx(area * (20 - 3.5), abs=1e-6)


def test_a_cast_comes_out_of_a_slanted_moat_along_its_axis_and_not_straight_up():
    slant = (12.0, 28.6, 40.0)
    moulds = mould(slant, (3.0, 2.0))
    for way, comes in ((axis_of(slant), True), ((0, 0, 1), False), (axis_of((12.0, 24.0, 40.0)), False)):
        (step,) = moulds.plan.steps
        steps = (replace(step, removals=(Removal(CAST, way),), inserts=()),)
        ordered = planned(moulds.spec, replace(moulds.plan, steps=steps))
        found = list(draw.findings(ordered))
        assert [finding.ok for finding in found] == [comes]


@settings(max_examples=4, deadline=None, phases=WITHOUT_SHRINKING)
@given(SLANTS, AT)
def test_the_kernels_agree_at_any_slant(slant, at):
    occt = pytest.importorskip("unitcad.kernels.occt", exc_type=UnitcadError)  # type: ignore[arg-type]
    from benchmarks.accuracy.brep_measures import measure

    wall = placed(ring(3, 5, -1, 2), slant, at)
    base = cut(block(at), [placed(MOAT, slant, at)])
    tube, whole = (measure(solid) for solid in occt.solids([wall, base]))
    assert tube.volume == pytest.approx(exact_volume(wall), rel=1e-9)
    for shape, true in ((wall, tube), (base, whole)):
        solid, allowed = mesh.realise(shape, SEGMENTS), 2 * bounds.deviation(shape, SEGMENTS)
        assert len(solid.decompose()) == true.solids == 1
        assert abs(solid.volume() - true.volume) <= bounds.volume_bound(shape, SEGMENTS) + 1e-9 * true.volume
        for found, exact in zip(solid.bounding_box(), true.box, strict=True):
            assert abs(found - exact) <= allowed + 1e-5

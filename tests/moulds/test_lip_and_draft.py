"""A lip at the cavity's mouth, and draft of bores and core: the unit follows, and balance holds."""

import math

import pytest
from faulty_sets import set_of, with_fault

from unitcad.attenuation.edge.words import lines
from unitcad.checks import check_moulds, strains
from unitcad.checks.balance import findings as balance
from unitcad.designs.dimensions import LIP_LEAN_DEG
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec
from unitcad.validation import load


def frustum(low, high, height):
    return math.pi * height * (low**2 + low * high + high**2) / 3


def test_a_layer_has_the_volume_of_its_cones():
    """Wall and cap of Layer 1 at 2 degrees, less the tail's slot: in closed form, apart from the drawing."""
    moulds, plain = set_of("encapsulating", "moulds.draft_deg=2"), set_of("encapsulating")
    taper, slot = math.tan(math.radians(2)), 3.4 * 0.4
    whole = frustum(5.75, 5.75 - 3.36 * taper, 3.36) - frustum(4.5, 4.5 - 2.11 * taper, 2.11)
    straight = frustum(5.75, 5.75, 3.36) - frustum(4.5, 4.5, 2.11)
    cut = straight - plain.solids["layer1"].volume()  # by the slot, which a wall of the same width has
    assert slot * 1.25 < cut < slot * 1.5
    assert moulds.solids["layer1"].volume() == pytest.approx(whole - cut, rel=1e-3)


def test_the_motor_lies_on_the_lip_s_cone_and_its_mouth_is_narrower_by_the_lip():
    dims = set_of("encapsulating", "motor.lip_mm=0.5").dimensions
    (mouth, _), (_, edge), (wide, meets), _ = dims.core_outline
    assert mouth == pytest.approx(3.5 - 0.5)
    assert wide == pytest.approx(4.5)
    assert (wide - mouth) / (meets - edge) == pytest.approx(math.tan(math.radians(LIP_LEAN_DEG)))
    there = mouth + (dims.motor_low - edge) * math.tan(math.radians(LIP_LEAN_DEG))
    assert 0 < there - dims.motor_radius < 0.011  # where the motor lies the cone is as wide as it
    assert dims.motor_height - dims.motor_low == pytest.approx(2.0)
    assert dims.core_height == pytest.approx(dims.motor_low + 2.11)


def test_a_lip_stretches_over_the_core_and_the_motor_goes_through_it():
    """The mouth of 6 mm passes a core of 9 and a pad of 8.4 mm."""
    found = {
        strain.where.partition(",")[0]: strain.percent
        for strain in strains(set_of("encapsulating", "motor.lip_mm=0.5"))
    }
    assert found["peel off the core"] == pytest.approx(100 * (4.5 / 3 - 1), rel=1e-3)
    assert found["motor through the lip"] == pytest.approx(100 * (4.2 / 3 - 1))
    wires = {strain.where: strain.percent for strain in strains(set_of("no-fpcb", "motor.lip_mm=0.5"))}
    assert wires["motor through the lip"] == pytest.approx(100 * (3.5 / 3 - 1))
    above = [strain.where for strain in strains(set_of("embedded", "motor.lip_mm=0.5"))]
    assert "motor through the lip" not in above  # it is set in from above


def test_a_lip_that_silicone_does_not_stretch_over_breaks_c310():
    """Planted: a margin so small that no lip is left."""
    broken = [
        f for f in check_moulds(set_of("encapsulating", "motor.lip_mm=1.7", "casting.strain_margin=0.1")) if not f.ok
    ]
    assert {finding.code for finding in broken} == {"C310"}
    assert any(finding.where == "motor through the lip" for finding in broken)


@pytest.mark.parametrize("tool", ["base", "cup1", "cup2"])
def test_a_tool_drawn_without_draft_breaks_balance(tool):
    """Planted: one piece of the set that is straight."""
    straight = set_of("encapsulating").plan.tool(tool).shape
    faulty = with_fault(set_of("encapsulating", "moulds.draft_deg=1"), tool, lambda _: straight)
    assert any(not finding.ok for finding in balance(faulty))


@pytest.mark.parametrize(
    ("changes", "field", "nearest"),
    [
        (["motor.lip_mm=2"], "motor.lip_mm", 1.725),
        (["motor.lip_mm=0.5", "diameter_mm=18"], "motor.lip_mm", 0),
        (["moulds.draft_deg=4"], "moulds.draft_deg", 3),
        (["moulds.draft_deg=3", "diameter_mm=12.2"], "diameter_mm", 12.411),
        (["moulds.draft_deg=1", "fpcb.pad_diameter_mm=9"], "fpcb.pad_diameter_mm", 8.926),
    ],
)
def test_refused_with_a_value_that_is_accepted(changes, field, nearest):
    with pytest.raises(Refusal) as refused:
        load("encapsulating", changes)
    assert (refused.value.field, refused.value.nearest) == (field, pytest.approx(nearest, abs=2e-3))
    load("encapsulating", [*changes, f"{field}={refused.value.nearest}"])


def test_a_lip_is_told_apart_from_the_measured_units():
    (level, *_) = lines(answer_spec(load("encapsulating", ["motor.lip_mm=0.5"])))
    assert level.endswith("Wider range: no measured unit had its lip.")

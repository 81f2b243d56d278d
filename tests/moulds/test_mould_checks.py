"""Every mould check passes for every template, and each catches the faults planted in a tool's tree."""

import math
from dataclasses import replace

import pytest
from faulty_sets import broken, set_of, with_fault, with_plan, without

from docs.released import released
from unitcad.checks import balance, check_moulds, mould_checks
from unitcad.errors import Refusal
from unitcad.moulds import lid
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST, Removal
from unitcad.shape import box, cut, cylinder, moved, polygon, ring, union
from unitcad.shape.tree import Common, Revolve
from unitcad.validation import from_data, templates


@pytest.mark.parametrize("name", sorted(templates()))
def test_every_template_passes_every_mould_check(name):
    findings = check_moulds(set_of(name))
    assert [finding for finding in findings if not finding.ok] == []
    assert {finding.code for finding in findings} == set(mould_checks())
    balance = [finding.value for finding in findings if finding.code == "C100"]
    assert max(balance) < 1e-12


@pytest.mark.long
def test_a_wedge_that_a_union_of_many_loses_is_no_leak():
    """One of 10,000 random specs: with a circle in 328 sides, manifold3d's union of the tools lacks 0.025 mm3."""
    layers = [
        {"material": "ecoflex-00-50", "wall_mm": 0.5, "cap_mm": 10.0},
        {"material": "ecoflex-00-50", "wall_mm": 3.964, "cap_mm": 9.951},
        {"material": "ecoflex-00-10", "wall_mm": 0.5, "cap_mm": 5.201},
    ]
    data = {
        "name": "wedge",
        "design": "encapsulating",
        "diameter_mm": 57.003,
        "motor": {"diameter_mm": 4.72, "thickness_mm": 10.225},
        "fpcb": {"thickness_mm": 0.224, "tail_width_mm": 5.459},
        "layers": layers,
        "moulds": {"plinth_clearance_mm": 0.231, "window_clearance_mm": 0.455, "slot_height_mm": 0.424},
        "output": {"tolerance_mm": 0.0009},
    }
    moulds = MouldSet(from_data(data))
    assert max(finding.value for finding in balance.findings(moulds)) < 1e-12


VARIANTS = [
    ("encapsulating", "moulds.cavities=[1,2]"),
    ("encapsulating", "moulds.pour=injected"),
    ("encapsulating", "moulds.printer=sla"),
    ("encapsulating", "moulds.printer=fdm-0.25", "moulds.cavities=[2,1]"),
    ("encapsulating", "motor.fill=true"),
    # Between a wide tongue's tip and the ledge's riser rounding leaves a film, which holds no air.
    ("encapsulating", "fpcb.tail=both", "fpcb.tail_width_mm=6.0"),
    ("encapsulating", "motor.lip_mm=0.5"),
    ("encapsulating", "moulds.draft_deg=3"),
    ("encapsulating", "motor.fill=true", "motor.lip_mm=0.4", "moulds.draft_deg=1", "moulds.pour=injected"),
    ("encapsulating", "moulds.shrinkage_percent=2", "motor.lip_mm=0.5", "skin_mm=0.5"),
    ("encapsulating", "moulds.bore_compensation_mm=0.1", "moulds.draft_deg=1"),
    ("embedded", "moulds.cavities=[2,1]", "moulds.pour=injected"),
    ("embedded", "motor.fill=true", "moulds.printer=sla"),
    ("embedded", "motor.lip_mm=0.5", "moulds.draft_deg=2"),
    ("embedded", "moulds.shrinkage_percent=0.3", "moulds.cavities=[2,2]"),
    ("no-fpcb", "motor.lip_mm=0.3", "moulds.draft_deg=1", "moulds.printer=sla"),
    ("three-layer", "motor.lip_mm=0.5", "moulds.draft_deg=3", "moulds.cavities=[1,2]"),
    ("pass-through", "moulds.bore_compensation_mm=0.2", "moulds.printer=sla", "moulds.pour=injected"),
]


@pytest.mark.parametrize("source", VARIANTS, ids=" ".join)
def test_variants_pass_every_mould_check(source):
    moulds = set_of(*source)
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []


def less(*tools):
    return lambda shape: cut(shape, tools)


def more(*parts):
    return lambda shape: union((shape, *parts))


def shifted(x=0.0, y=0.0, z=0.0):
    return lambda shape: moved(shape, x, y, z)


# The encapsulating template: core of radius 4.5 up to 2.11, bores 5.75 and 7, rims 3.36 and 4.61, slot 1.8 to 2.2.
FAULTS = [
    ("C000", "cup1", "empty", lambda shape: Common((box(0, 1, 0, 1, 0, 1), box(2, 3, 2, 3, 2, 3)))),
    ("C000", "cup1", "in two pieces", less(box(-99, 99, 9, 9.5, -99, 99))),
    ("C000", "cup2", "window closed", more(box(8, 10, -3, 3, 1.5, 2.7))),
    ("C000", "cup2", "a hollow inside", less(box(9, 9.5, 4, 5, 1, 1.5))),
    ("C100", "base", "a pit of 0.3 in the core", less(moved(cylinder(0.15, 1.81, 9), 2.5, 1.5))),
    ("C100", "base", "a scratch under the seat", less(box(4, 20, 3, 3.2, -0.1, 0.5))),
    ("C100", "cup1", "a scratch in the seat", less(box(-20, -4, 3, 3.2, -1, 0.1))),
    ("C100", "filament", "filament 0.5 low", shifted(z=-0.5)),
    ("C100", "cup1", "bore too small", more(ring(5.7, 6, 0, 3.36))),
    ("C100", "cup2", "bore too large", less(cylinder(7.05, -1, 9))),
    ("C100", "cup1", "a pinhole through the wall", less(box(-99, 0, -0.2, 0.2, 2.6, 2.8))),
    ("C100", "cup1", "stands 0.1 high", shifted(z=0.1)),
    ("C100", "base", "core 0.05 high", more(ring(2, 4.5, 2, 2.16))),
    ("C100", "tongue", "0.5 out", shifted(x=0.5)),
    ("C200", "tongue", "0.1 too deep", shifted(x=-0.1)),
    ("C200", "cup2", "bore into Layer 1", more(moved(cylinder(0.5, 0, 3), -5.5, 0))),
    ("C200", "base", "plinth too wide", more(box(-9.9, 9.9, -5, 5, -2, -0.5))),
    ("C210", "base", "plinth 0.1 too wide", more(box(-9.6, 9.6, -5, 5, -2, -0.5))),
    ("C210", "tongue", "0.08 too thick", more(box(6, 15, -1, 1, 1.7, 1.8))),
    ("C220", "cup1", "no ribs at -x", less(box(-9.82, -9.0, -8, 8, -1.6, -0.3))),
    ("C220", "cup1", "no ribs at -x and -y", less(box(-9.82, 8, -9.82, 8, -1.6, -0.3))),
    ("C220", "cup2", "a rib of 0.05 more", more(box(-9.9, -9.45, 3.5, 3.7, -1.3, -0.6))),
    ("C220", "base", "plinth 0.05 narrower at +x", less(box(9.45, 10.5, -99, 99, -1.9, 1))),
    ("C220", "cup1", "a rib up to the seat", more(box(9.45, 9.9, 3.4, 3.8, -0.9, 0))),
    ("C000", "cup1", "a pin's hole into the groove", less(moved(cylinder(2.0, -3, 2.5), 0, 7.5))),
    ("C240", "cup1", "a pin's hole 0.5 under the groove", less(moved(cylinder(0.5, -3, 1.86), 0, 7.5))),
    ("C240", "cup2", "a slot beside the groove", less(box(-2, 2, 9.9, 10.5, 2.0, 9))),
    ("C240", "cup1", "a hole 0.5 from the bore", less(moved(cylinder(0.3, 0.5, 2.5), -6.55, 0))),
    ("C240", "cup2", "a hole 0.6 from the groove", less(moved(cylinder(0.3, 3.5, 9), -10.4, 0))),
    ("C250", "base", "larger than the bed", more(box(-120, 120, -5, 5, -4, -3))),
    ("C300", "cup1", "a lip of 0.05 in the bore", more(ring(5.7, 5.8, 1.0, 1.2))),
    ("C300", "cup1", "a lip of 0.01 in the bore", more(ring(5.74, 5.8, 1.0, 1.2))),
    ("C300", "cup2", "a bore that narrows upwards", more(Revolve(polygon((7.1, 0.2), (7.1, 4), (6.95, 4))))),
    ("C300", "cup2", "a hook under the plate", more(box(-25, -12, -1, 1, -7, -6.5), box(-25, -18.5, -1, 1, -7, 0.5))),
    ("C300", "tongue", "a barb inside Layer 1", more(box(4.6, 5.2, -2.2, 2.2, 1.9, 2.2))),
    ("C300", "base", "an arm over the rim", more(box(-16, -14, -1, 1, -2, 6), box(-16, -11, -1, 1, 5, 6))),
    ("C300", "filament", "a knob in the core", more(cylinder(1.3, 1.2, 1.6))),
    ("C410", "cup1", "a ceiling with a pinhole", more(ring(0.15, 6, 3.2, 3.36))),
    ("C400", "tongue", "a hollow under it", less(box(5.0, 5.5, -1, 1, 0, 2.0))),
    (
        "C400",
        "cup1",
        "a pocket in the wall",
        less(box(-6.2, -5, -0.5, 0.5, 1.0, 2.0), box(-6.2, -5.9, -0.5, 0.5, 1.0, 2.5)),
    ),
]


@pytest.mark.parametrize(("code", "tool", "what", "change"), FAULTS, ids=[f"{f[0]}-{f[1]}-{f[2]}" for f in FAULTS])
def test_a_planted_fault_is_caught(code, tool, what, change):
    found = mould_checks()[code].findings(with_fault(set_of("encapsulating"), tool, change))
    assert not all(finding.ok for finding in found), what


def test_every_released_check_has_a_planted_fault():
    """The inventory lists the checks of the last release; a new one gets its fault before the next."""
    # A bar inside the template's layer does not stretch it by its limit: C310 has closed forms below.
    known = released() & set(mould_checks())
    assert len(known) > 10
    assert known <= {fault[0] for fault in FAULTS} | {"C260", "C310"} <= set(mould_checks())


def test_a_forgotten_tongue_is_a_leak():
    assert "C100" in broken(without(set_of("encapsulating"), "tongue"))


def reordered(moulds, index, change):
    """Return the set with other removals after one pour (from 0)."""
    steps = tuple(
        replace(step, removals=change(step.removals)) if i == index else step
        for i, step in enumerate(moulds.plan.steps)
    )
    return with_plan(moulds, replace(moulds.plan, steps=steps))


@pytest.mark.parametrize(
    ("index", "change", "where", "why"),
    [
        (0, lambda order: order[::-1], "pour 1: cup1 out against tongue", "undercut"),
        (0, lambda order: order[:1], "pour 1: cup1 stays", "pour 2 has no place for it"),
        (1, lambda order: order[:1], "pour 2: cup2 stays", "it holds the unit"),
        (1, lambda order: (*order, order[0]), "pour 2: tongue out", "it is not there"),
        (0, lambda order: (*order, Removal("lid1", (0, 0, 1))), "pour 1: lid1 out", "it is not there"),
        (0, lambda order: (*order, Removal(CAST, (0, 0, 1))), "pour 1: cast out", "pour 2 is cast on it"),
        (1, lambda order: (order[0], Removal("cup2", (0, 0, -1))), "pour 2: cup2 out against base", "undercut"),
        (1, lambda order: (Removal(CAST, (0, 0, 1)), *order), "pour 2: cast out against tongue", "undercut"),
    ],
)
def test_an_order_of_removal_that_is_impossible_is_caught(index, change, where, why):
    findings = check_moulds(reordered(set_of("encapsulating"), index, change))
    named = [finding for finding in findings if finding.code == "C300" and not finding.ok]
    assert where in [finding.where for finding in named]
    assert why in " ".join(finding.advice for finding in named if finding.where == where)


def test_a_unit_that_is_pushed_out_last_holds_nothing():
    """The silicone comes out by itself: neither base nor cup holds it any more, whatever is left on the bench."""

    def pushed(order):
        down = (0, 0, -1)
        return (order[0], Removal("filament", down), Removal("base", down), Removal(CAST, down))

    moulds = reordered(set_of("encapsulating"), 1, pushed)
    assert [finding.where for finding in check_moulds(moulds) if finding.code == "C300" and not finding.ok] == []


@pytest.mark.parametrize(("reach", "sides"), [(5.5, 1), (6.7, 1), (6.7, 2)])
def test_the_peel_over_a_bar_printed_on_the_core(reach, sides):
    """The hull of a circle and one or two bars in closed form: tangents, arcs and the bars' ends."""
    radius, half = 4.5, 1.7
    bars = [box(min(0, s * reach), max(0, s * reach), -half, half, 1.805, 2.0) for s in (1, -1)[:sides]]
    bar_set = with_fault(set_of("encapsulating", "casting.strain_margin=0.01"), "base", more(*bars))
    far = math.hypot(reach, half)
    tangent, angle = math.sqrt(far**2 - radius**2), math.atan(half / reach) + math.acos(radius / far)
    around = sides * (2 * tangent + 2 * half) + (2 * math.pi - 2 * sides * angle) * radius
    expected = around / (2 * math.pi * radius) - 1
    findings = [f for f in check_moulds(bar_set) if f.code == "C310" and f.where.startswith("peel")]
    assert len(findings) == 1
    # An area-true polygon of n sides is longer than its circle by a share of (pi / n)^2 / 6.
    assert findings[0].value == pytest.approx(
        100 * expected, abs=100 * (1 + expected) * (math.pi / bar_set.segments) ** 2 / 6
    )
    assert not findings[0].ok
    assert "no more than" in findings[0].advice


def test_strain_within_the_margin_is_kept():
    bar = box(0, 5.75, -1.7, 1.7, 1.805, 2.0)
    findings = check_moulds(with_fault(set_of("encapsulating"), "base", more(bar)))
    assert all(f.ok for f in findings if f.code == "C310")
    assert max(f.value for f in findings if f.code == "C310") > 5


@pytest.mark.parametrize("name", ["encapsulating", "pass-through"])
def test_chain_pad_through_the_slot_needs_124_percent(name):
    """The circuit's pad of 8.4 through the slot of 3.4 by 0.4: 2 (8.4 + 0.11) over 2 (3.4 + 0.4), less one."""
    findings = check_moulds(set_of(name, "fpcb.tail_end_width_mm=8.4"))
    value = next(f.value for f in findings if f.where == "tail through the slot")
    assert value == pytest.approx(100 * (2 * 8.51 / 7.6 - 1))
    assert round(value) == 124


def test_air_under_a_tongue_is_the_formulas():
    """The widest tail that the ledge leaves: C400 measures what lengths say; on thin walls it is refused."""
    moulds = set_of("encapsulating", "fpcb.tail_width_mm=6.3", "output.tolerance_mm=0.001")
    measured = [f.value for f in check_moulds(moulds) if f.code == "C400"]
    expected = [lid.under_tongue(moulds.dimensions, moulds.dimensions.exit, layer) for layer in range(2)]
    assert measured == pytest.approx(expected, rel=0.01)
    with pytest.raises(Refusal) as refused:
        set_of("encapsulating", "fpcb.tail_width_mm=6.3", "layers.0.wall_mm=0.6", "layers.1.wall_mm=1.9")
    assert refused.value.field == "fpcb.tail_width_mm"
    narrower = f"fpcb.tail_width_mm={refused.value.nearest}"
    kept = check_moulds(set_of("encapsulating", narrower, "layers.0.wall_mm=0.6", "layers.1.wall_mm=1.9"))
    assert [finding for finding in kept if not finding.ok] == []


@pytest.mark.parametrize("height", [1.0, 1.033, 1.1, 1.2, 1.3, 1.39, 1.5, 1.61])
def test_walls_of_a_low_cup_are_whole(height):
    """Letters as deep as the overflow groove: 0.4 mm at 1.03 mm, where letters 0.63 mm off the groove were too near.

    At 1.2 mm the groove's floor is 0.6 mm thick, which broke C240.
    """
    data = {
        "name": "low",
        "design": "embedded",
        "diameter_mm": 10.0,
        "motor": {"diameter_mm": 3.0, "thickness_mm": height, "fill": True},
        "layers": [{"material": "ecoflex-00-10", "wall_mm": 0.5}],
    }
    findings = check_moulds(MouldSet(from_data(data)))
    assert "C240" in {finding.code for finding in findings}
    assert [finding for finding in findings if not finding.ok] == []

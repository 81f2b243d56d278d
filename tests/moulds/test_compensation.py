"""Shrinkage and the printer's narrow bores: made up for in the tools alone, and C100 compares what is meant."""

import numpy as np
import pytest
from faulty_sets import set_of, with_fault, with_plan

from unitcad.casting.procedure import procedure
from unitcad.catalogue import materials
from unitcad.checks.balance import findings as balance
from unitcad.designs.dimensions import growth
from unitcad.errors import Refusal
from unitcad.kernels.mesh import bounds
from unitcad.pipeline.write import build
from unitcad.validation import load

SHRUNK = ("encapsulating", "moulds.shrinkage_percent=2")
WIDER = ("encapsulating", "moulds.bore_compensation_mm=0.1")


def test_tools_are_larger_by_the_shrinkage_and_the_unit_is_not():
    """Caps of 1.176 mm are 1.2 mm in the tools, whole layers: no rim moves."""
    caps = "layers.0.cap_mm=1.176", "layers.1.cap_mm=1.176"
    shrunk, plain = set_of(*SHRUNK, *caps), set_of("encapsulating", *caps)
    assert growth(shrunk.spec) == pytest.approx(1 / 0.98)
    for name in ("layer1", "layer2"):
        assert shrunk.solids[name].volume() == plain.solids[name].volume()
        step = shrunk.plan.steps[int(name[-1]) - 1]
        assert shrunk.mesh_of(step.layer[0]).volume() * 0.98**3 == pytest.approx(plain.solids[name].volume(), rel=5e-4)
    assert shrunk.plan.dimensions.outer_radius == pytest.approx(7 / 0.98)
    # Clearances are the printer's: they do not grow.
    assert shrunk.spec.moulds.plinth_clearance_mm == plain.spec.moulds.plinth_clearance_mm


def test_the_silicones_value_is_the_default_and_the_bulletins_say_nil():
    stated = [silicone.shrinkage_percent for silicone in materials().values() if silicone.shrinkage_percent is not None]
    assert {float(value) for value in stated} == {0.0}
    own = {"house": {"like": "ecoflex-00-30", "shrinkage_percent": 1.5}}
    spec = load("encapsulating", {"materials": own, "layers.0.material": "house"})
    assert spec.moulds.shrinkage_percent == 1.5
    assert load(spec, {"layers.0.material": "ecoflex-00-30"}).moulds.shrinkage_percent == 0.0
    assert load("encapsulating").moulds.shrinkage_percent == 0.0


def test_tools_that_do_not_follow_the_shrinkage_break_balance():
    """Planted: cup 2 and the base of the set without shrinkage, and layers that are not larger."""
    plain = set_of("encapsulating").plan
    for tool in ("cup2", "base"):
        faulty = with_fault(set_of(*SHRUNK), tool, lambda _, tool=tool: plain.tool(tool).shape)
        assert any(not finding.ok for finding in balance(faulty))
    unscaled = with_plan(set_of("encapsulating", "moulds.shrinkage_percent=1"), plain)
    broken = [finding.where for finding in balance(unscaled) if not finding.ok]
    assert broken == ["pour 1: as it shrinks", "pour 2: as it shrinks"]


def test_the_first_part_is_measured_as_it_is_after_shrinking():
    """Caps of 1.25 / 0.98 come nearest in 1.2 mm of layers, over a core of 2.2: 4.6 mm, which shrink to 4.51 mm."""
    plain, shrunk = (procedure(set_of(*source), (200.0, 300.0)) for source in (SHRUNK[:1], SHRUNK))
    assert (shrunk.measure[1:3], shrunk.assembly) == (plain.measure[1:3], plain.assembly)
    assert shrunk.measure[0] == "Height over all: 4.51 mm (4.61 drawn, in layers of 0.2)."


def test_bores_are_wider_in_the_files_alone(tmp_path):
    """A cup's file has a bore of 7.1 mm, its wall as before; the checked piece has one of 7."""
    moulds = set_of(*WIDER)
    tool = moulds.plan.tool("cup2")
    cup, wide = moulds.mesh_of(tool.shape), moulds.mesh_of(tool.in_file.shape)
    assert bounds(cup) == bounds(wide)
    taken = np.pi * (7.1**2 - 7**2) * 4.61
    assert cup.volume() - wide.volume() == pytest.approx(taken, rel=0.05)  # less the window
    built = build(load(WIDER[0], [*WIDER[1:], "output.formats=['stl']"]), tmp_path, only=("moulds",))
    (part,) = [part for part in built.manifest["parts"] if part["name"] == "cup2"]
    assert part["volume_mm3"] == pytest.approx(wide.volume(), rel=1e-9)
    assert built.manifest["compensation"] == {"shrinkage_percent": 0.0, "bore_compensation_mm": 0.1}
    assert built.manifest["check"]["errors"] == 0
    assert set_of(*WIDER).plan.label != set_of("encapsulating").plan.label


def test_moulds_of_other_kinds_refuse_what_they_do_not_draw():
    with pytest.raises(Refusal, match="complement"):
        _ = set_of("custom/strap-lugs", "moulds.shrinkage_percent=1").plan

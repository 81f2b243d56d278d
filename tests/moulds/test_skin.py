"""A film that closes the skin side: drawn below z = 0, cast in a tray, its silicone bought, its steps at the end."""

import math
import re
from pathlib import Path

import msgspec
import pytest
from casting_rules import broken_rules
from faulty_sets import mesh_findings, set_of, with_fault

from unitcad.attenuation.edge.words import lines
from unitcad.casting.procedure import procedure
from unitcad.casting.steps import casting_summary
from unitcad.casting.views import picture_path, views
from unitcad.checks import check_moulds, overlap
from unitcad.checks.balance import findings as balance
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec
from unitcad.pipeline.write import build
from unitcad.shape import cut, cylinder, moved, union
from unitcad.validation import load

SETS = [
    ("encapsulating", "skin_mm=0.5"),
    ("encapsulating", "skin_mm=20"),  # thicker than its floor, and than the unit
    ("embedded", "skin_mm=0.3", "moulds.cavities=[2,2]"),
    ("no-fpcb", "skin_mm=1.0", "motor.lip_mm=0.3", "moulds.draft_deg=2"),
    ("three-layer", "skin_mm=0.6", "moulds.printer=sla", "moulds.pour=injected"),
]


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_every_mould_check_holds_and_the_tray_prints(source):
    moulds = set_of(*source)
    found = check_moulds(moulds)
    assert [finding for finding in found if not finding.ok] == []
    assert [finding for finding in overlap.of_unit(moulds) if not finding.ok] == []
    assert sum(f.where.startswith("skin-tray cell") for f in found) == len(moulds.plan.layout.cells)
    assert mesh_findings(moulds) == []


def test_the_film_is_a_disc_below_the_skin_plane_and_adds_its_mass(tmp_path):
    built = build(load("encapsulating", ["skin_mm=0.5", "output.formats=['stl']"]), tmp_path, only=("unit", "moulds"))
    (film,) = [part for part in built.manifest["parts"] if part["name"] == "skin"]
    assert film["volume_mm3"] == pytest.approx(math.pi * 7**2 * 0.5, rel=1e-3)
    assert film["bbox_mm"][2::3] == pytest.approx([-0.5, 0.0])
    assert film["material"] == "dragon-skin-30"
    assert (built.folder / "moulds" / "skin-tray.stl").is_file()
    assert (built.folder / "unit" / "skin.stl").is_file()


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_the_procedure_ends_with_the_skin(source):
    moulds = set_of(*source)
    made = procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)
    assert broken_rules(made) == []
    assert (made.later_mixes, made.last) == (1, "Motor in and skin on")
    assert " Motor in and skin on, with 1 more mix: " in [*casting_summary(msgspec.to_builtins(made))][1]
    on, cure = made.assembly[-2:]
    assert (on.title, cure.title) == ("Skin on", "Let the skin cure")
    assert on.picture == picture_path("skin-on")
    assert "skin-on" in views(moulds)
    last, cells = moulds.spec.layers[-1].material, len(moulds.plan.layout.cells)
    assert cure.wait_min == pytest.approx(60 * made.pours[-1].cure_h)
    bought = sum(i.quantity for i in made.bill if i.item.startswith(f"{last} part"))
    poured = sum(p.part_a_g + p.part_b_g for p in made.pours if p.material == last)
    (weighed,) = (step for step in made.assembly if step.title == "Mix for the skin")
    grams = [float(text) for text in re.findall(r"([\d.]+) g of", weighed.text)]
    assert sum(grams) == pytest.approx(bought - poured, rel=0.01)
    film = cells * math.pi * (moulds.spec.diameter_mm / 2) ** 2 * moulds.spec.skin_mm / 1000
    assert bought - poured >= max(2.0, 1.5 * film)
    assert "skin tray" in {item.item for item in made.bill}


@pytest.mark.parametrize(
    "fault",
    [
        lambda tray: union((tray, moved(cylinder(1, 0, 0.3), 0, 0, 4.1))),  # a bump on the floor
        lambda tray: cut(tray, [cylinder(1, 0, 4.2)]),  # a hole through it
        lambda tray: moved(tray, 0.05),  # off its place
    ],
    ids=["bump", "hole", "aside"],
)
def test_a_fault_in_the_tray_breaks_balance(fault):
    faulty = with_fault(set_of("encapsulating", "skin_mm=0.5"), "skin-tray", fault)
    assert [f.where for f in balance(faulty) if not f.ok] == ["skin-tray cell 1"]


def test_refused_with_a_value_that_is_accepted():
    with pytest.raises(Refusal) as refused:
        load("encapsulating", ["skin_mm=0.1"])
    assert (refused.value.field, refused.value.nearest) == ("skin_mm", 0.3)
    custom = str(Path(__file__).parents[2] / "templates/custom/strap-lugs.toml")
    with pytest.raises(Refusal, match="draws its own skin side"):
        load(custom, ["skin_mm=0.5"])
    for key, value in (("moulds.draft_deg", 1.0), ("motor.lip_mm", 0.5)):
        with pytest.raises(Refusal, match="moulds by complement follow the bodies") as refused:
            load(custom, [f"{key}={value}"])
        assert (refused.value.field, refused.value.nearest) == (key, 0.0)


def test_the_estimate_is_said_to_be_that_of_the_open_unit():
    (level, *_) = lines(answer_spec(load("embedded", ["skin_mm=0.5"])))
    assert level.endswith("Wider range: no measured unit had its film on the skin side.")

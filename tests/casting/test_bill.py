"""The bill: everything that a step takes, and the number of every piece."""

import re

import pytest

from tests.sample_bodies import LEADLESS
from unitcad.casting.bill import plural
from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_markdown
from unitcad.casting.views import BenchPictures
from unitcad.catalogue import materials
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import assumed_lengths
from unitcad.validation import load, warnings

LOOSE = (LEADLESS, "design=embedded", "layers=[{ material = 'ecoflex-00-10', wall_mm = 2.5 }]", "motor.fill=false")


def moulds_of(*source):
    return MouldSet(load(source[0], list(source[1:])))


def casting(*source):
    moulds = moulds_of(*source)
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


def quantities(made):
    return {item.item: item.quantity for item in made.bill}


@pytest.mark.parametrize("cells", [1, 6])
def test_the_silicone_of_a_filled_ring_is_bought(cells):
    """Its volume is the difference of two drawn units: Layer 1 up to the motor, and with a ring of air."""
    gang = f"moulds.cavities=[1,{cells}]"
    drawn = [MouldSet(load(LOOSE[0], [*LOOSE[1:3], f"motor.fill={fill}"])) for fill in ("true", "false")]
    filled, loose = (moulds.mesh(moulds.unit[0]).volume() for moulds in drawn)
    bought = quantities(casting(*LOOSE, gang, "casting.minimum_mix_g=0.1"))
    of_pour = sum(pour.part_a_g for pour in casting(*LOOSE, gang, "casting.minimum_mix_g=0.1").pours)
    grams = cells * (filled - loose) / 1000 * float(materials()["ecoflex-00-10"].density_g_cm3)
    waste = 1 + load(LEADLESS).casting.waste
    ring = max(grams * waste, 0.1)
    assert bought["ecoflex-00-10 part A"] - of_pour == pytest.approx(ring / 2, rel=1e-4)
    assert bought["petroleum jelly"] == 1
    assert bought["mixing cups and sticks"] == 2


def test_a_ring_s_silicone_cures_and_is_no_smear():
    made = casting(*LOOSE)
    (cure,) = (step for step in made.assembly if step.kind == "cure")
    assert cure.title == "Let the ring cure"
    assert "smear" not in " ".join(step.text for step in made.assembly)
    assert cure.wait_min == 60 * made.pours[0].cure_h


def test_a_pin_for_bubbles_is_bought_for_an_open_pour_only():
    assert "pin" in quantities(casting("encapsulating"))
    assert "pin" not in quantities(casting("encapsulating", "moulds.pour=injected"))


def test_pictures_and_bill_count_pieces():
    gang = ("encapsulating", "moulds.cavities=[2,3]")
    assert quantities(casting(*gang))["filament"] == 6
    bench = BenchPictures(moulds_of(*gang))
    bench.picture("pieces")
    assert {"6 filaments", "7 tongues"} <= {name.text for name in bench.written}


@pytest.mark.parametrize(
    ("change", "stays", "late"),
    [
        ((), False, False),
        (("casting.vacuum=false", "layers.0.material=ecoflex-00-30"), False, False),
        (("casting.vacuum=false",), True, False),
        (("casting.room_c=43",), False, True),
    ],
)
def test_a_pour_s_faults_are_data_and_its_words_agree(change, stays, late):
    pours = casting("encapsulating", *change).pours
    for pour in pours:
        assert pour.bubbles_stay == ("bubbles stay" in pour.verdict)
        assert (pour.over_pot_life_min > 0) == ("after the pot life" in pour.verdict)
    assert any(pour.bubbles_stay for pour in pours) >= stays
    assert any(pour.over_pot_life_min > 0 for pour in pours) >= late


@pytest.mark.parametrize(
    ("motor", "item", "note"),
    [
        ({}, "LCM0720A3463F", "7 x 2 mm (assumed), ERM"),
        ({"thickness_mm": 2.3}, "LCM0720A3463F", "7 x 2.3 mm, ERM"),
        ({"thickness_mm": 3.0}, "own motor", "7 x 3 mm"),
        ({"diameter_mm": 8.0}, "own motor", "8 x 2 mm (assumed)"),
        ({"part": "VC0720B001F", "diameter_mm": 6.0}, "own motor", "6 x 2 mm"),
    ],
)
def test_a_motor_of_other_sizes_has_no_part_number(motor, item, note):
    bill = {line.item: line.note for line in casting("embedded", *(f"motor.{k}={v}" for k, v in motor.items())).bill}
    assert bill[item] == note
    assert len({"own motor", "LCM0720A3463F", "VC0720B001F"} & bill.keys()) == 1


def test_the_sheet_begins_with_what_to_measure():
    """Step 0 has the lengths of the bought parts, as drawn, and a command that builds with them."""
    spec = load("encapsulating")
    assert spec.fpcb
    drawn = {
        "motor.diameter_mm": spec.motor.diameter_mm,
        "motor.thickness_mm": spec.motor.thickness_mm,
        "fpcb.thickness_mm": spec.fpcb.thickness_mm,
        "moulds.filament_mm": spec.moulds.filament_mm,
    }
    made = casting("encapsulating")
    assert {size.keys[0]: size.value_mm for size in made.printing.sizes} == drawn
    text = to_markdown(made)
    (command,) = re.findall(r"^unitcad build spec.toml (.*)$", text, re.MULTILINE)
    assert text.index("## 0. Measure first") < text.index("## Print") < text.index("## Before the first pour")
    assert load("encapsulating", command.replace("--set ", "").split()) == spec
    assert "motor thickness: 2 mm (assumed; 2 to 2.65). A motor of 2.65 mm stands 0.65 mm out at the skin." in text
    wires = {size.keys[0] for size in casting("no-fpcb").printing.sizes}
    assert "wires.diameter_mm" in wires
    assert "fpcb.thickness_mm" not in wires


def test_several_of_an_item_are_plural():
    names = ["flexible circuit", "pad of stacked card", "filament, straight", "LCM0720A3463F"]
    several = ["flexible circuits", "pads of stacked card", "filaments, straight", "LCM0720A3463F"]
    assert [plural(name) for name in names] == several


def test_a_length_that_is_given_is_not_assumed():
    """Planted: what the catalogue assumes is typed as measured."""
    measured = casting("encapsulating", "motor.thickness_mm=2.3", "fpcb.thickness_mm=0.13")
    assert not any(size.assumed for size in measured.printing.sizes)
    assert assumed_lengths(load("encapsulating")).keys() == {"motor.thickness_mm", "fpcb.thickness_mm"}
    assert assumed_lengths(load("embedded", ["motor.part=VC0720B001F"])).keys() == {"fpcb.thickness_mm"}


def test_both_designs_fix_the_motor_by_the_same_words_and_bill():
    fixed = {name: casting(name) for name in ("encapsulating", "embedded")}
    sentences = {
        re.sub(r"where it touches [^:]*:", "where it touches ...:", step.text.split("thinly")[1].split(".")[0])
        for made in fixed.values()
        for step in made.assembly
        if "adhesive" in step.required_tools or "silicone adhesive" in step.text
    }
    assert len(sentences) == 1
    for made in fixed.values():
        assert "silicone adhesive" in {item.item for item in made.bill}
        assert made.assembly[-1].wait_min == 24 * 60


def test_warnings_lead_the_sheet():
    """Planted: a closed cavity, and a roof of 25 mm; the sheets of the templates have none."""
    for source, words in (((LEADLESS,), "no way out"), (("encapsulating", "diameter_mm=30"), "ring of air of 9 mm")):
        text = to_markdown(casting(*source))
        assert words in text[: text.index("## 0. Measure first")]
    assert "Warning" not in to_markdown(casting("encapsulating"))


def test_a_cavity_without_a_way_out_for_leads_is_a_warning():
    leads = warnings(load(LEADLESS))
    assert "no way out for the motor's leads" in leads[0]
    open_ring = load(LOOSE[0], LOOSE[1:])  # leads leave upwards
    assert leads[0] not in warnings(open_ring)

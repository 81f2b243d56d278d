"""The procedure of a back sheet: its order, its amounts and its words."""

import re
from dataclasses import asdict

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.drawings import HELD, tape_places
from unitcad.casting.steps import pour_warnings
from unitcad.shape.lettering import seen


@pytest.fixture(scope="module")
def made():
    moulds = patch_moulds(load_array("forearm-patch"))
    return array_procedure(moulds, [moulds.mesh(body).volume() for body in moulds.unit], 1000.0, {})


def test_the_base_comes_off_before_the_patch_is_pushed_out(made):
    assert [step.title for step in made.release] == ["Filament out", "Base off, downwards", "Push out"]
    titles = [[step.title for step in pour.steps] for pour in made.pours]
    assert titles[0][-1] == "Cup 1 off"
    assert titles[1][-1] == "Cure"
    assert all("Grease the flanks" in each for each in titles)
    assert "Leave cup 2 on" in made.release[1].text


def test_the_silicone_of_all_units_is_mixed_once(made):
    """1.91 g of Layer 1 for nine units; 7.35 g of Layer 2 and sheet (6.87 cm3 of 1.07 g/cm3)."""
    net = [next(f.value for f in pour.figures if f.name == "in the cavities, net") for pour in made.pours]
    assert net == [pytest.approx(1.90, abs=0.02), pytest.approx(7.35, abs=0.02)]
    assert any("1.90 + 7.35 = 9.25 g" in line for line in made.measure)


def test_every_step_has_its_own_title_and_what_joins_all_units_counts_once(made):
    assert [step.title for step in made.assembly] == [
        "Solder the motors",
        "Lay the circuit in",
        "Let the adhesive cure",
    ]
    assert made.time_line[-1].name == "motors and circuit in"
    for pour in made.pours:
        volume, density, net = (
            next(f for f in pour.figures if f.name == name)
            for name in ("volume of this pour", "density", "in the cavities, net")
        )
        assert net.value == pytest.approx(volume.value * density.value / 1000)
        assert net.source == "computed: volume x density"
    assert "The sheet: 76.00 x 60.00 mm" in " ".join(made.measure)


def test_the_words_name_marks_faces_and_lengths_of_this_set(made):
    """Layer 1 is 5.5 mm in radius, the unit 7, a fin ends 1.2 mm outside it; the plate under 2.11 mm of core is 4."""
    sort = made.preparation[0].text
    assert f"b{seen(made.label)} on the base" in sort
    greased = [next(step.text for step in pour.steps if step.title == "Grease the flanks") for pour in made.pours]
    unit = load_array("forearm-patch").unit
    reach, walls = unit.diameter_mm / 2 + 1.2, [layer.wall_mm for layer in unit.layers]
    inner = unit.diameter_mm / 2 - walls[1]
    assert [float(re.findall(r"outermost ([0-9.]+) mm", text)[0]) for text in greased] == pytest.approx(
        [reach - inner, 1.2]
    )
    assert all("top and end face" in text for text in greased)
    (bent,) = [step.text for step in made.preparation if step.title == "Filament in"]
    leg = unit.moulds.plate_mm + patch_moulds(load_array("forearm-patch")).dimensions.core_height + 2
    assert f"one leg {leg:.2g} mm long" in bent
    on = [step.text for pour in made.pours for step in pour.steps if step.title.endswith(" on")]
    assert all("in the middle of" in text and "towards that corner" not in text for text in on)


def test_each_piece_of_a_long_tool_is_held_down():
    moulds = patch_moulds(load_array("wrist-band"))
    count = len(tape_places(moulds))
    made = array_procedure(moulds, [100.0] * 2, 1000.0, {})
    hold = next(step.text for step in made.pours[0].steps if step.title == "Hold cup 1 down")
    assert count >= 2 * moulds.plan.layout.cup[0] / HELD
    assert f"run {count} strips of tape from" in hold
    assert "Each piece needs one" in hold
    (tape,) = [item for item in made.bill if item.item == "adhesive tape"]
    assert tape.quantity == 2 * 2 * count


def test_a_pour_that_outlasts_its_pot_life_is_warned_of():
    """56 cavities take half a minute each; nine do not."""
    large = load_array("forearm-patch", ["layout.columns=8", "layout.rows=7"])
    for array, late in ((large, True), (load_array("forearm-patch"), False)):
        moulds = patch_moulds(array)
        pours = array_procedure(moulds, [100.0] * 2, 1000.0, {}).pours
        warned = list(pour_warnings([asdict(pour) for pour in pours]))
        assert [line.split(" in pour")[0] for line in warned] == ["mixing and pouring outlast the pot life"] * late


def test_agent_goes_into_the_last_cup_alone(made):
    """Nothing bonds to the sheet's skin side; Layer 1 and the core's face bond later."""
    on = [next(step.text for step in pour.steps if step.title.endswith(" on")) for pour in made.pours]
    assert on[0].startswith("No release agent: what is cast here bonds later")
    assert "only on the sheet's bed and the bores of cup 2" in on[1]
    assert "None in the fins' slots, on the base and Layer 1." in on[1]
    assert "release agent" in {item.item for item in made.bill}

"""The procedure of a back sheet: its order, its amounts and its words."""

from __future__ import annotations

import math
import re
from dataclasses import asdict
from itertools import pairwise

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_procedure import back_sheet_procedure
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.drawings import HELD, TAPE_WIDTH, side_places, tape_places
from unitcad.casting.procedure import Procedure
from unitcad.casting.steps import pour_warnings
from unitcad.moulds.base import PRY_HALF_WIDTH
from unitcad.shape.lettering import seen


@pytest.fixture(scope="module")
def made() -> Procedure:
    moulds = patch_moulds(load_array("forearm-patch"))
    return back_sheet_procedure(moulds, [moulds.mesh(body).volume() for body in moulds.unit], 1000.0)


def test_the_base_comes_off_before_the_patch_is_pushed_out(made: Procedure) -> None:
    assert [step.title for step in made.release] == ["Filament out", "Base off, downwards", "Push out"]
    titles = [[step.title for step in pour.steps] for pour in made.pours]
    assert titles[0][-1] == "Cup 1 off"
    assert titles[1][-1] == "Cure"
    assert all("Grease the flanks" in each for each in titles)
    assert "Leave cup 2 on" in made.release[1].text


def test_the_silicone_of_all_units_is_mixed_once(made: Procedure) -> None:
    """1.91 g of Layer 1 for nine units; 7.35 g of Layer 2 and sheet (6.87 cm3 of 1.07 g/cm3)."""
    net = [next(f.value for f in pour.figures if f.name == "in the cavities, net") for pour in made.pours]
    assert net == [pytest.approx(1.90, abs=0.02), pytest.approx(7.35, abs=0.02)]
    assert any("1.90 + 7.35 = 9.25 g" in line for line in made.measure)


def test_words_speak_of_the_pieces_that_are_there(made: Procedure) -> None:
    steps = [*made.preparation, *(step for pour in made.pours for step in pour.steps), *made.release, *made.assembly]
    words = " ".join(step.text for step in steps)
    assert "plinth" not in words
    assert "tongue" not in words
    assert "over the pins" in words
    assert "Solder the 9 motors to the circuit's pads" in words
    (circuit,) = [item for item in made.bill if item.item == "flexible circuit"]
    assert circuit.quantity == 1
    assert "cup 1 and blade upside down" in " ".join(made.printing.how)
    assert "unitcad build array.toml --slice -o sliced" in " ".join(made.printing.how)
    assert made.warnings == ()  # the tails are the common circuit's


def test_every_step_has_its_own_title_and_what_joins_all_units_counts_once(made: Procedure) -> None:
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


def test_the_words_name_marks_faces_and_lengths_of_this_set(made: Procedure) -> None:
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
    assert all("the top and the end face" in text for text in greased)
    (bent,) = [step.text for step in made.preparation if step.title == "Filament in"]
    leg = unit.moulds.plate_mm + patch_moulds(load_array("forearm-patch")).dimensions.core_height + 2
    assert f"one leg {leg:.2g} mm long" in bent
    on = [step.text for pour in made.pours for step in pour.steps if step.title.endswith(" on")]
    assert all("leave it in the middle" in text and "towards that corner" not in text for text in on)


def test_the_level_is_asked_for_the_longest_surface(made: Procedure) -> None:
    """A phone's 0.2 degrees leave 0.27 mm over 76 mm, more than a dent; a level of 0.03 degrees leaves 0.04."""
    (level,) = [step.text for step in made.preparation if step.title == "Level the bench"]
    assert 76 * math.tan(math.radians(0.2)) > 0.1
    assert f"leave {76 * math.tan(math.radians(0.03)):.1g} mm across the sheet of 76 mm" in level
    assert "spirit level" in level
    assert "phone" not in level


def test_pieces_of_split_tools_have_readable_names() -> None:
    moulds = patch_moulds(load_array("wrist-band"))
    made = back_sheet_procedure(moulds, [100.0] * 2, 1000.0)
    printed = [item.item for item in made.bill if item.made.startswith("printed")]
    assert printed[:4] == ["base, piece 1", "base, piece 2", "cup 1, piece 1", "cup 1, piece 2"]
    left = 271.82 * math.tan(math.radians(0.03))
    assert f"leave {left:.1g} mm across the sheet of 272 mm" in " ".join(s.text for s in made.preparation)


def test_each_piece_of_a_long_tool_is_held_down() -> None:
    """A strip of tape for each 60 mm, and one between any two seams of base and cups, clear of the filaments."""
    moulds = patch_moulds(load_array("wrist-band"))
    places, half = tape_places(moulds), moulds.plan.layout.cup[0]
    seams = sorted({seam.at for split in moulds.plan.splits for seam in split.seams})
    for low, high in pairwise((-half, *seams, half)):
        assert any(low <= at and at + TAPE_WIDTH <= high for at in places)
    for cell in moulds.plan.layout.cells:
        assert all(not at < cell.x < at + TAPE_WIDTH for at in places)
    made = back_sheet_procedure(moulds, [100.0] * 2, 1000.0)
    hold = next(step.text for step in made.pours[0].steps if step.title == "Hold cup 1 down")
    assert len(places) >= 2 * half / HELD
    assert f"run {len(places)} strips of tape from" in hold
    (inner,) = re.findall(r"one at either end, the others ([^.;]*) mm from the left one[.] Each piece", hold)
    assert [float(at) for at in re.findall(r"\d+", inner)] == pytest.approx(
        [at - places[0] for at in places[1:-1]], rel=0.05
    )
    (tape,) = [item for item in made.bill if item.item == "adhesive tape"]
    assert tape.quantity == 2 * 2 * len(places)


def test_a_pour_that_outlasts_its_pot_life_is_warned_of() -> None:
    """144 cavities take half a minute each; nine do not."""
    large = load_array("forearm-patch", ["layout.columns=12", "layout.rows=12"])
    for array, late in ((large, True), (load_array("forearm-patch"), False)):
        moulds = patch_moulds(array)
        pours = back_sheet_procedure(moulds, [100.0] * 2, 1000.0).pours
        warned = list(pour_warnings([asdict(pour) for pour in pours]))
        assert [line.split(" in pour")[0] for line in warned] == ["mixing and pouring outlast the pot life"] * late


def test_each_piece_of_a_base_in_three_is_held_and_levered() -> None:
    """The middle piece is too narrow for a strip beside its filaments: one reaches 1 mm over a seam."""
    moulds = patch_moulds(load_array("forearm-patch", ["moulds.bed_x_mm=60"]))
    (base, *_), places = moulds.plan.splits, tape_places(moulds)
    half = moulds.plan.layout.cup[0]
    assert len(base.pieces) == 3
    for low, high in pairwise((-half, *(seam.line[0][0] for seam in base.seams), half)):
        assert max(min(high, at + TAPE_WIDTH) - max(low, at) for at in places) >= TAPE_WIDTH - 1
    made = back_sheet_procedure(moulds, [100.0] * 2, 1000.0)
    (off,) = [step.text for step in made.release if step.title == "Base off, downwards"]
    assert "in every pry slot; at a piece that has none" in off
    assert "Leave the tape on the underside" in off
    assert "The tape stays on until the base is off" in " ".join(step.text for step in made.preparation)


def test_pieces_between_others_have_tape_on_the_other_sides() -> None:
    """A base in three rows: the middle one reaches neither front nor back; its strip leaves the pry slot free."""
    moulds = patch_moulds(load_array("forearm-patch", ["layout.rows=12", "moulds.bed_y_mm=100"]))
    (base, *_) = moulds.plan.splits
    assert (len(base.pieces), base.columns) == (3, 1)
    assert side_places(moulds)
    for at in side_places(moulds):
        assert at >= PRY_HALF_WIDTH or at + TAPE_WIDTH <= -PRY_HALF_WIDTH
    low, high = (seam.line[0][0] for seam in base.seams)
    assert any(low <= at and at + TAPE_WIDTH <= high for at in side_places(moulds))
    made = back_sheet_procedure(moulds, [100.0] * 2, 1000.0)
    hold = next(step.text for step in made.pours[0].steps if step.title == "Hold cup 1 down")
    assert "The two other sides have" in hold
    (tape,) = [item for item in made.bill if item.item == "adhesive tape"]
    assert tape.quantity == 2 * 2 * (len(tape_places(moulds)) + len(side_places(moulds)))


@pytest.mark.parametrize(
    ("changes", "cut_alike"), [(["layout.columns=8", "moulds.bed_x_mm=140"], False), (["moulds.bed_x_mm=60"], True)]
)
def test_pins_hold_no_cup_in_line_that_is_cut_where_the_base_is(changes: list[str], cut_alike: bool) -> None:
    made = back_sheet_procedure(patch_moulds(load_array("forearm-patch", changes)), [100.0] * 2, 1000.0)
    (join,) = [step.text for step in made.preparation if step.title == "Join the pieces"]
    assert ("The pins hold the pieces of each cup in line" in join) is not cut_alike
    assert ("cut at the same gap" in join) is cut_alike


def test_agent_goes_into_the_last_cup_alone(made: Procedure) -> None:
    """Nothing bonds to the sheet's skin side; Layer 1 and the core's face bond later."""
    assert [[(face.tool, face.face) for face in pour.agent] for pour in made.pours] == [[], [("cup2", "bore")]]
    on = [next(step.text for step in pour.steps if step.title.endswith(" on")) for pour in made.pours]
    assert on[0].startswith("No release agent: what is cast here bonds later")
    assert "only on the sheet's bed and the bores of cup 2" in on[1]
    assert "None in the slots for the fins, on the base and Layer 1." in on[1]
    assert "release agent" in {item.item for item in made.bill}
    assert not any(bond.face.tool == "cup2" for bond in made.bonds)

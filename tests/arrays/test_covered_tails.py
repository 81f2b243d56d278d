"""Tails that end under the sheet: found, told how far before its edge, and what to do."""

import json

import pytest
from casting_rules import broken_rules

from tests.arrays.made_arrays import pockets_cast
from unitcad.arrays.array_file import load_array
from unitcad.arrays.sheet import rounded
from unitcad.arrays.tails import MOST_NAMES, covered_tails, covered_tails_warning, tail_half_width, tail_length
from unitcad.errors import Refusal
from unitcad.kernels.mesh import realise
from unitcad.pipeline.write import build as build_array
from unitcad.report import write_report
from unitcad.shape import Extrude, box, moved, rotated

SIDES = ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3, 8]", "unit.fpcb.tail_length_mm=2"]


TURNED = [{"at": "A3", "angle_deg": 0}, {"at": "C1", "angle_deg": 180}, {"at": "C3", "angle_deg": 0}]


def test_tails_of_the_template_come_out_where_a_quarter_turn_lets_them():
    array = load_array("forearm-pockets")
    assert [place.angle_deg for place in array.places] == [90, 90, 90, 45, 45, 225, 270, 270, 270]
    assert [(tail.place, bool(tail.blocked_by), tail.angle_deg) for tail in covered_tails(array)] == [
        (name, True, None) for name in ("B1", "B2", "B3")
    ]


def test_a_tail_that_comes_out_at_another_angle_is_told_it():
    array = load_array("forearm-pockets", {"place": TURNED})
    covered = {tail.place: tail for tail in covered_tails(array)}
    # The ends lie at 20 + 7 + 10 = 37 mm, the sheet's edge at 38.
    found = [(covered[name].short_mm, covered[name].length_mm, covered[name].angle_deg) for name in ("A3", "C1", "C3")]
    assert found == [(1.0, 11.0, 90.0), (1.0, 11.0, 270.0), (1.0, 11.0, 270.0)]
    (said,) = covered_tails_warning(array)
    assert "With angle_deg = 90 A3 would come out as it is. With angle_deg = 270 C1 and C3 would" in said
    assert "fpcb.tail_length_mm" not in said
    turned = [{**place, "angle_deg": covered[place["at"]].angle_deg} for place in TURNED]
    assert {tail.place for tail in covered_tails(load_array("forearm-pockets", {"place": turned}))} == {
        "B1",
        "B2",
        "B3",
    }


@pytest.mark.parametrize("name", ["forearm-pockets", "hex-19"])
def test_a_tail_longer_by_so_much_has_its_end_out_of_the_sheet(name):
    """Against solids: a slice across the tail meets the sheet before that length and misses it beyond."""
    array = load_array(name)
    plan = realise(Extrude(rounded(array.sheet.outline, array.sheet.corner_mm), -1, 1), 256)
    for tail in covered_tails(array):
        place = array.placed(tail.place)
        half = tail_half_width(place.unit)
        end = place.radius + tail_length(place.unit) + tail.short_mm

        def meets(at, place=place, half=half):
            slice_ = moved(rotated(box(at, at + 0.01, -half, half, -1, 1), "z", place.angle_deg), place.x, place.y)
            return (realise(slice_, 256) ^ plan).volume() > 1e-9

        assert meets(end - 0.05)
        assert not meets(end + 0.02)


def test_what_is_said_to_help_helps_and_what_is_blocked_is_refused():
    longer = covered_tails(load_array("forearm-pockets", ["unit.fpcb.tail_length_mm=11"]))
    assert [tail.place for tail in longer] == ["B1", "B2", "B3"]
    middle = next(tail for tail in longer if tail.place == "B2")
    with pytest.raises(Refusal):
        load_array("forearm-pockets", [f"unit.fpcb.tail_length_mm={middle.length_mm}"])


def test_nothing_is_hidden_by_a_sheet_under_the_tails_or_where_one_circuit_serves_all():
    assert covered_tails(load_array("forearm-pockets", ['unit="single-embedded"', "sheet.thickness_mm=1.2"])) == ()
    assert covered_tails(load_array("forearm-patch")) == ()


def test_a_warning_names_some_places_and_counts_the_others():
    array = load_array("hex-19", ["layout.rings=4"])
    covered, (said,) = covered_tails(array), covered_tails_warning(array)
    stopped = sum(bool(tail.blocked_by) for tail in covered)
    assert stopped > MOST_NAMES
    assert f"and {stopped - MOST_NAMES} others." in said


def test_procedure_manifest_and_page_say_what_to_do(tmp_path):
    array = load_array("forearm-pockets", SIDES)
    covered = covered_tails(array)
    assert covered
    _, made = pockets_cast(array)
    wires, units_in = made.assembly
    assert (wires.title, units_in.title) == ("Wires on covered tails", "Units in")
    assert all(tail.place in wires.text for tail in covered)
    (bought,) = [item for item in made.bill if item.item == "lead wire"]
    assert bought.quantity == 2 * len(covered)
    assert broken_rules(made) == []
    built = build_array(array, tmp_path, only=["unit"], check=False)
    (warned,) = [line for line in built.manifest["warnings"] if line.startswith("tails end under the sheet")]
    page = write_report(built.folder).read_text("utf-8")
    assert "<h2>Warnings</h2>" in page
    assert warned.split(":")[0] in page
    assert page.count("reaches the edge, or solder wires on") + page.count("solder wires on</td>") >= len(covered)
    told = json.loads((built.folder / "manifest.json").read_bytes())["array"]["covered_tails"]
    assert [(tail["place"], tail["short_mm"]) for tail in told] == [(tail.place, tail.short_mm) for tail in covered]

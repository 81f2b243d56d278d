"""Tails that end under the sheet: found, and named with the remedy."""

import json

import pytest
from casting_rules import broken_rules

from tests.arrays.made_arrays import pockets_cast
from unitcad.arrays.array_file import load_array
from unitcad.arrays.sheet import rounded
from unitcad.arrays.tails import MOST_NAMES, covered_tails, covered_tails_warning, tail_half_width, tail_length
from unitcad.kernels.mesh import realise
from unitcad.pipeline.write import build as build_array
from unitcad.report import write_report
from unitcad.shape import Extrude, box, moved, rotated

SIDES = ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3, 8]", "unit.fpcb.tail_length_mm=2"]


def test_tails_of_the_template_come_out_where_a_quarter_turn_lets_them():
    array = load_array("forearm-pockets")
    assert [place.angle_deg for place in array.places] == [90, 90, 90, 45, 45, 225, 270, 270, 270]
    assert covered_tails(array) == ("B1", "B2", "B3")


@pytest.mark.parametrize("name", ["forearm-pockets", "hex-19"])
def test_the_end_of_a_covered_tail_is_over_the_sheet_and_of_no_other(name):
    """Against solids: a slice across the tail's end meets the sheet."""
    array = load_array(name)
    plan = realise(Extrude(rounded(array.sheet.outline, array.sheet.corner_mm), -1, 1), 256)
    for place in array.places:
        half, end = tail_half_width(place.unit), place.radius + tail_length(place.unit)
        slice_ = moved(rotated(box(end, end + 0.01, -half, half, -1, 1), "z", place.angle_deg), place.x, place.y)
        meets = (realise(slice_, 256) ^ plan).volume() > 1e-9
        assert meets == (place.name in covered_tails(array))


def test_nothing_is_hidden_by_a_sheet_under_the_tails_or_where_one_circuit_serves_all():
    assert covered_tails(load_array("forearm-pockets", ['unit="single-embedded"', "sheet.thickness_mm=1.2"])) == ()
    assert covered_tails(load_array("forearm-patch")) == ()


def test_a_warning_names_some_places_and_counts_the_others():
    array = load_array("hex-19", ["layout.rings=4"])
    covered, (said,) = covered_tails(array), covered_tails_warning(array)
    assert len(covered) > MOST_NAMES
    assert f"and {len(covered) - MOST_NAMES} others:" in said


def test_procedure_manifest_and_page_say_what_to_do(tmp_path):
    array = load_array("forearm-pockets", SIDES)
    covered = covered_tails(array)
    assert covered
    _, made = pockets_cast(array)
    wires, units_in = made.assembly
    assert (wires.title, units_in.title) == ("Wires on covered tails", "Units in")
    assert all(name in wires.text for name in covered)
    (bought,) = [item for item in made.bill if item.item == "lead wire"]
    assert bought.quantity == 2 * len(covered)
    assert broken_rules(made) == []
    built = build_array(array, tmp_path, only=["unit"], check=False)
    (warned,) = [line for line in built.manifest["warnings"] if line.startswith("tails end under the sheet")]
    page = write_report(built.folder).read_text("utf-8")
    assert "<h2>Warnings</h2>" in page
    assert warned.split(":")[0] in page
    assert page.count("under the sheet: solder wires on") == len(covered)
    told = json.loads((built.folder / "manifest.json").read_bytes())["array"]["covered_tails"]
    assert told == list(covered)

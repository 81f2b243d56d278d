"""What refusals of arrays say: digits, names, keys of other kinds, keys that do nothing."""

import pytest

from tests.arrays.made_arrays import refusal_of
from unitcad.arrays.array_file import load_array
from unitcad.errors import unknown_key, unknown_name


def test_a_distance_just_too_small_is_told_with_enough_digits():
    refused = refusal_of("sleeve-curved", ["limb.radius_mm=34.4"])
    assert "are 3.9957 mm apart and need 4 mm" in refused.limit


def test_of_equally_close_keys_the_first_of_the_table_is_offered():
    assert refusal_of("hex-19", ["moulds.bed_mm=200"]).nearest == "moulds.bed_x_mm"


@pytest.mark.parametrize("count", [11, 12])
def test_a_list_names_the_last_rather_than_counts_it(count):
    names = [f"n{i:02}" for i in range(count)]
    said = unknown_name("unit", "zzz", names).limit
    assert said.endswith(", n10" if count == 11 else "n09 and 2 more")
    keys = names[: count - 5]
    assert (" more" in unknown_key("zzz", 1, keys).limit) == (len(keys) > 6)


def test_keys_of_another_kind_of_layout_are_to_be_left_out_together():
    refused = refusal_of("sleeve-curved", ["layout.kind=hex", "layout.rings=1"])
    assert refused.field == "layout.columns"
    assert refused.limit.endswith("leave out layout.columns and layout.rows")


@pytest.mark.parametrize("cavities", ["[2, 2]", "fill"])
def test_cavities_of_a_back_sheet_are_refused_and_not_passed_over(cavities):
    refused = refusal_of("forearm-patch", [f"moulds.cavities={cavities}"])
    assert (refused.field, refused.nearest) == ("moulds.cavities", [1, 1])
    assert load_array("forearm-patch", ["moulds.cavities=[1, 1]"])


def test_a_sheet_is_as_thick_as_fits_where_no_thickness_is_asked_for():
    points = {"kind": "list", "points_mm": [[0, 0], [40, 0]]}
    data = {"name": "thin", "array": "pockets", "unit": "embedded", "layout": points}
    data["place"] = [{"at": "P2", "unit": "encapsulating"}]
    most = refusal_of(data, ["sheet.thickness_mm=2"]).nearest
    assert load_array(data).sheet.thickness_mm == pytest.approx(most, abs=1e-3)

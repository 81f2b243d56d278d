"""What a refusal of an array offers is put in, and accepted; where more has to change, its sentence says what."""

import re

import pytest

from tests.arrays.made_arrays import refusal_of
from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet

_SHEET = {"array": "back-sheet", "unit": "encapsulating"}
_HEX = {**_SHEET, "layout": {"kind": "hex", "rings": 1, "pitch_mm": 20}}
_POINTS = {**_SHEET, "unit": "embedded", "layout": {"kind": "list", "points_mm": [[0, 0], [20, 0], [10, 40]]}}
_RESIN = {"moulds.printer": "sla"}


TWELVE = {"layout.columns": 12, "moulds.cavities": [1, 1], "moulds.bed_x_mm": 30}
OFFERED = [
    ("forearm-patch", {"layout.pitch_mm": 15}, "layout.pitch_mm"),
    ("forearm-patch", {"sheet.thickness_mm": 2}, "sheet.thickness_mm"),
    ("forearm-patch", {"moulds.pour": "injected"}, "moulds.pour"),
    ("sleeve-curved", {"limb.radius_mm": 20}, "limb.radius_mm"),
    ("sleeve-curved", {"unit": "single-encapsulating"}, "limb.cast"),
    ("sleeve-curved", {"sheet.thickness_mm": 4}, "sheet.thickness_mm"),
    ("sleeve-curved", {"moulds.bed_z_mm": 20}, "moulds.bed_z_mm"),
    ("sleeve-curved", {"layout.rows": 6, "moulds.bed_y_mm": 100}, "moulds.bed_y_mm"),
    ("wrist-band", {"moulds.bed_x_mm": 40}, "moulds.bed_x_mm"),
    ("hex-19", {"moulds.bed_x_mm": 60}, "moulds.bed_x_mm"),
    ("forearm-pockets", {"moulds.bed_y_mm": 60}, "moulds.bed_y_mm"),  # a strap slot as long as two rows
    ("forearm-pockets", TWELVE, "moulds.bed_x_mm"),
    ("forearm-patch", {"layout.rows": 4, "layout.columns": 6, "moulds.bed_y_mm": 20}, "moulds.bed_y_mm"),
    # A sheet longer than its way round the limb.
    ("wrist-band", {"sheet.margin_mm": 8}, "layout.count"),
    ("wrist-band", {"limb.radius_mm": 30}, "layout.count"),
    ("forearm-patch", {"layout.columns": 4, "limb.radius_mm": 10}, "limb.radius_mm"),
]


@pytest.mark.parametrize(("name", "changes", "field"), OFFERED)
def test_what_can_not_be_cast_is_refused_with_what_would(name, changes, field):
    refused = refusal_of(name, changes)
    assert refused.field == field
    assert patch_moulds(load_array(name, {**changes, field: refused.nearest})).plan
    if changes == {"moulds.bed_x_mm": 40}:
        assert "silicone" in str(refused), "what the seams would take up"


REFUSED = [
    ("forearm-patch", {"unit": "embedded"}, "unit.design", "encapsulating"),
    ("forearm-patch", {"unit": "no-fpcb"}, "unit.fpcb", None),
    ("forearm-patch", {"sheet.hold_mm": 0.2}, "sheet.hold_mm", None),
    # What moulds of arrays do not draw.
    ("forearm-patch", {"unit.moulds.shrinkage_percent": 0.1}, "unit.moulds.shrinkage_percent", 0.0),
    ("forearm-patch", {"unit.moulds.bore_compensation_mm": 0.1}, "unit.moulds.bore_compensation_mm", 0.0),
    ("forearm-pockets", {"unit.skin_mm": 0.5}, "unit.skin_mm", 0.0),
    ("sleeve-curved", {"unit": "embedded"}, "unit.design", "encapsulating"),
    ("forearm-pockets", {"sheet.strap_slot_mm": [0.1, 5]}, "sheet.strap_slot_mm.0", 0.8),
    ("forearm-patch", {"sheet.strap_slot_mm": [5, 0.1]}, "sheet.strap_slot_mm.1", 0.8),
    ("forearm-patch", {"moulds.bed_x_mm": 10}, "moulds.bed_x_mm", 56.4),
    ("sleeve-curved", {"limb.radius_mm": 500}, "limb.radius_mm", 339.74),
    ("hex-19", {"layout.pitch_mm": 500}, "layout.pitch_mm", 52.82),
    ("forearm-pockets", {"layout.pitch_mm": [20, 900]}, "layout.pitch_mm.1", 210.3),
    ("forearm-pockets", {"sheet.strap_slot_mm": [1000, 20]}, "sheet.strap_slot_mm.0", 202.39),
    ("wrist-band", {"limb.radius_mm": 1000}, "limb.radius_mm", 263.39),
]


@pytest.mark.parametrize(("name", "changes", "field", "nearest"), REFUSED)
def test_what_can_not_be_made_is_refused(name, changes, field, nearest):
    refused = refusal_of(name, changes)
    assert (refused.field, refused.nearest) == (field, nearest)


def named(limit, before, after):
    """Return what a sentence names between two words, by paths."""
    (part,) = re.findall(f"{before} (.*?)(?: {after}|;|$)", limit)
    pairs = re.findall(r"([a-z_.0-9]+) = ('?)([^' ]+)", part)
    return {path: text if quote else float(text) if "." in path and "mm" in path else int(text)
            for path, quote, text in pairs}  # fmt: skip


@pytest.mark.parametrize(
    ("data", "changes", "field", "also"),
    [
        (_HEX, {}, "circuit.row_width_mm", {"circuit.corner_mm"}),
        (_POINTS, {}, "unit.design", {"unit.layers.0.cap_mm", "unit.layers.1.cap_mm", "circuit.rows"}),
    ],
)
def test_the_value_offered_is_accepted_with_what_it_also_needs(data, changes, field, also):
    source = {"name": "offered", **data}
    refused = refusal_of(source, changes)
    assert refused.field == field
    more = named(refused.limit, "also needs", "then") if also else {}
    assert set(more) == also
    assert patch_moulds(load_array(source, {**changes, field: refused.nearest, **more})).plan


def test_a_plate_that_fits_turned_by_a_quarter_says_so():
    array = load_array("hex-19", _RESIN)
    with pytest.raises(Refusal, match=r"turned by a quarter it fits: moulds\.bed_x_mm = 80, bed_y_mm = 130") as refused:
        MouldSet(array.unit).plan  # noqa: B018
    assert MouldSet(load_array(array, {"moulds.cavities": refused.value.nearest}).unit).plan
    assert MouldSet(load_array(array, {"moulds.bed_x_mm": 80, "moulds.bed_y_mm": 130}).unit).plan


def test_another_unit_in_a_back_sheet_is_named():
    refused = refusal_of("forearm-patch", {"place": [{"at": "B2", "unit": "motor-10mm"}]})
    assert (refused.field, refused.value, refused.nearest) == ("place.0.unit", "motor-10mm", None)
    assert "leave it out" in refused.limit


@pytest.mark.parametrize(("name", "tail"), [("hex-19", 2.7), ("forearm-pockets", 6.6)])
def test_the_pitch_offered_is_the_nearest_that_needs_nothing_else(name, tail):
    refused = refusal_of(name, {"layout.pitch_mm": 12})
    assert refused.nearest == 18
    assert "at 16, unit.fpcb.tail_length_mm = 10: the tail of" in refused.limit
    assert f"at most {tail} mm" in refused.limit
    assert load_array(name, {"layout.pitch_mm": 18})
    assert refusal_of(name, {"layout.pitch_mm": 17.9}).field == "unit.fpcb.tail_length_mm"


def test_where_no_pitch_does_alone_the_combination_is_offered():
    changes = {"layout.pitch_mm": 12, "unit.fpcb.tail_length_mm": 60}
    first = refusal_of("forearm-pockets", changes)
    offers = {one.field: one.nearest for one in (first, *first.others)}
    assert offers.keys() == changes.keys()
    assert load_array("forearm-pockets", offers)
    for path in changes:
        assert refusal_of("forearm-pockets", {**offers, path: changes[path]}).field == path


@pytest.mark.parametrize("pitch", [0, -3])
@pytest.mark.parametrize("name", ["forearm-pockets", "hex-19"])
def test_a_pitch_out_of_range_is_refused_before_what_follows_from_it(name, pitch):
    refused = refusal_of(name, {"layout.pitch_mm": pitch})
    assert (refused.field, refused.file) == ("layout.pitch_mm", None)
    assert refused.limit.startswith("must be at least 1")


@pytest.mark.parametrize(("unit", "tail"), [("three-layer", 5.6), ("pass-through", 7.1)])
def test_a_tail_too_long_is_told_the_length(unit, tail):
    refused = refusal_of("hex-19", {"unit": unit})
    assert (refused.field, refused.nearest) == ("unit.fpcb.tail_length_mm", tail)
    assert load_array("hex-19", {"unit": unit, "unit.fpcb.tail_length_mm": tail})


def test_an_angle_at_which_a_tail_runs_into_a_unit_is_told_the_nearest_free_one():
    points = {"kind": "list", "points_mm": [[0, 0], [20, 0]]}
    data = {"name": "pair", "array": "pockets", "unit": "encapsulating", "layout": points}
    changes = {"place": [{"at": "P2", "angle_deg": 180}]}
    refused = refusal_of(data, changes)
    assert (refused.field, refused.nearest) == ("place.0.angle_deg", 207)
    for angle in (153, 207):
        assert load_array(data, {"place": [{"at": "P2", "angle_deg": angle}]})
    for angle in (154, 206):
        with pytest.raises(Refusal):
            load_array(data, {"place": [{"at": "P2", "angle_deg": angle}]})


def test_the_name_that_was_meant_is_offered_before_another_one():
    limit, nearest = "unknown name; closest: pockets, and its units are held with their own circuits", "pockets"
    with pytest.raises(Refusal) as refused:
        load_array("forearm-patch", {"array": "pocket"})
    assert (refused.value.limit.partition("; [")[0], refused.value.nearest) == (limit, nearest)


@pytest.mark.parametrize("layout", [{"kind": "banana", "count": 5}, {"kind": "rong", "cuont": 5}])
def test_an_unknown_kind_of_layout_draws_no_faults_of_another_kind(layout):
    """The keys of a grid, which is tried in its place, are neither missing nor are the typed ones unknown."""
    refusal = refusal_of({**_SHEET, "name": "a", "layout": layout, "limb": {"radius_mm": 40}})
    assert refusal.field == "layout.kind"
    assert refusal.others == ()

"""Array files: layouts give their points, what does not fit is refused with a value that does."""

import gc
import math
from itertools import combinations

import msgspec
import pytest

import unitcad
from tests.refusals import refuses
from unitcad.arrays.array_file import array_templates, expand, load_array
from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.layouts import layouts
from unitcad.arrays.sheet import rounded
from unitcad.validation import compound_kind, default_template, load, templates


def _array(layout, **more):
    return load_array({"name": "a", "array": "pockets", "unit": default_template(), "layout": layout, **more})


def _nearest(array):
    at = [(p.x, p.y) for p in array.places]
    return [min(math.dist(p, q) for q in at if q != p) for p in at]


@pytest.mark.parametrize("name", array_templates())
def test_a_template_settles_to_data_that_give_the_same_array(name):
    array = load_array(name)
    assert load_array(array.asked) == array
    assert load_array(msgspec.json.decode(msgspec.json.encode(array.asked))) == array
    for source in (name, array_templates()[name]):
        kind = compound_kind(source)
        assert kind.name == "array"
    assert compound_kind(default_template()) is None


def test_a_grid_has_rows_from_the_top_and_columns_along_x():
    array = _array({"kind": "grid", "columns": 3, "rows": 2, "pitch_mm": [20, 25]})
    assert [(p.name, p.x, p.y) for p in array.places] == [
        ("A1", -20, 12.5), ("A2", 0, 12.5), ("A3", 20, 12.5), ("B1", -20, -12.5), ("B2", 0, -12.5), ("B3", 20, -12.5),
    ]  # fmt: skip
    assert array.pitch_mm == 20


@pytest.mark.parametrize(("rings", "count"), [(1, 7), (2, 19), (3, 37)])
def test_a_hexagon_has_six_neighbours_at_the_pitch(rings, count):
    array = _array({"kind": "hex", "rings": rings, "pitch_mm": 21}, moulds={"bed_x_mm": 400, "bed_y_mm": 400})
    assert len(array.places) == count
    assert _nearest(array) == pytest.approx([21] * count, abs=2e-3)
    inner = [sum(math.dist((p.x, p.y), (q.x, q.y)) < 21.1 for q in array.places) - 1 for p in array.places]
    assert inner.count(6) == count - 6 * rings


def place_of(array, name):
    return {place.name: place for place in array.places}[name]


def test_a_ring_goes_once_round_the_limb():
    array = _array({"kind": "ring", "count": 4, "bands": 3, "band_pitch_mm": 50}, limb={"radius_mm": 40})
    assert len(array.places) == 12
    assert array.radius_mm == 40
    # Round the middle of the sheet, which is bent and keeps its length there: from 2.61 to 4.61 over the skin.
    assert array.middle_radius_mm == pytest.approx(40 + 3.61, abs=1e-3)
    assert 4 * (place_of(array, "A2").x - place_of(array, "A1").x) == pytest.approx(2 * math.pi * 43.61, abs=8 / 1024)
    assert place_of(array, "A1").y - place_of(array, "B1").y == 50


def test_listed_points_keep_their_distances():
    points = [[0, 0], [25, 3], [7, 31]]
    array = _array({"kind": "list", "points_mm": points})
    for (p, a), (q, b) in combinations(zip(points, array.places, strict=True), 2):
        assert math.dist(p, q) == pytest.approx(math.dist((a.x, a.y), (b.x, b.y)), abs=2e-3)


_GRID = {"kind": "grid", "columns": 3, "rows": 3, "pitch_mm": 20}
REFUSED = [
    ({"layout": {**_GRID, "pitch_mm": [20, 12]}}, "layout.pitch_mm.1", 16),
    ({"layout": {"kind": "ring", "count": 30}, "limb": {"radius_mm": 40}}, "layout.count", 13),
    ({"layout": {"kind": "ring", "count": 4}}, "limb.radius_mm", 40),
    ({"layout": {"kind": "ring", "count": 4, "bands": 2}, "limb": {"radius_mm": 40}}, "layout.band_pitch_mm", 40),
    ({"layout": {"kind": "list", "points_mm": [[0, 0], [10, 0]]}}, "layout.points_mm.1", [16, 0]),
    ({"layout": {"kind": "list", "points_mm": [[3, 3], [3, 3]]}}, "layout.points_mm.1", [19, 3]),
    ({"place": [{"at": [4, 1]}]}, "place.0.at", [3, 1]),
    ({"place": [{"at": "B4"}]}, "place.0.at", None),
    ({"place": [{"at": "B2", "angle_deg": 0}]}, "place.0.angle_deg", 27),
    ({"array": "back-sheet", "place": [{"at": "B2", "angle_deg": 0}]}, "place.0.angle_deg", None),
    ({"sheet": {"hold_mm": 5}}, "sheet.hold_mm", 1.4),
    ({"sheet": {"corner_mm": 30}}, "sheet.corner_mm", 10),
    ({"sheet": {"strap_slot_mm": [3, 60]}}, "sheet.strap_slot_mm.1", 50),
    ({"unit": {"like": default_template(), "fpcb": {"tail_length_mm": 60}}}, "unit.fpcb.tail_length_mm", 15),
    ({"unit": {"like": default_template(), "diameter_mm": 5}}, "unit.diameter_mm", 12.2),
    ({"unit": "hex-19"}, "unit", None),
    ({"moulds": {"land_mm": 0.1}}, "moulds.land_mm", 0.8),
    ({"limb": {"cast": "curved"}}, "limb.cast", "flat"),
]


@pytest.mark.parametrize(("change", "field", "nearest"), REFUSED, ids=lambda value: str(value)[:40])
def test_what_does_not_fit_is_refused_with_what_does(change, field, nearest):
    with refuses(field) as refused:
        _array(**{"layout": _GRID, **change})
    assert refused.value.nearest == nearest


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("columns", [1, 2])
def test_corners_that_meet_are_drawn(columns, rows):
    array = _array({"kind": "grid", "columns": columns, "rows": rows, "pitch_mm": 20})
    x0, y0, x1, y1 = array.sheet.outline
    radius = array.sheet.corner_mm
    area = (x1 - x0) * (y1 - y0) - (4 - math.pi) * radius**2
    assert rounded(array.sheet.outline, radius).area == pytest.approx(area)
    assert rounded(array.sheet.outline, radius, 1.0).area > area


def test_a_place_may_hold_another_unit_in_pockets():
    other = {"like": default_template(), "diameter_mm": 16}
    array = _array(_GRID, place=[{"at": [1, 1], "unit": other, "angle_deg": 135}])
    assert [unit.diameter_mm for unit in array.units] == [16, 14]
    assert place_of(array, "A1").angle_deg == 135
    assert place_of(array, "A2").unit.diameter_mm == 14


def test_a_unit_file_lies_beside_the_array_file(tmp_path):
    (tmp_path / "mine.toml").write_text(
        templates()[default_template()].read_text("utf-8").replace("diameter_mm = 14.0", "diameter_mm = 15.0")
    )
    (tmp_path / "a.toml").write_text(
        'name = "a"\narray = "pockets"\nunit = "mine.toml"\n[layout]\nkind = "hex"\nrings = 1\npitch_mm = 20\n'
    )
    array = load_array(tmp_path / "a.toml", ["unit.layers.0.wall_mm=1.0"])
    assert array.unit.diameter_mm == 15
    assert array.unit.layers[0].wall_mm == 1.0
    assert load(array.asked["unit"]) == array.unit


def test_no_table_lets_the_decoder_read_beyond_its_memory():
    """A union of a fixed tuple and of numbers or texts with limits makes msgspec read other limits."""
    data = expand({"name": "a", "array": "pockets", "unit": default_template(), "layout": _GRID})
    for _ in range(3):
        msgspec.convert(data, AskedArray)
        for pitch in (20.0, [20.0, 21.0]):
            assert msgspec.convert({**_GRID, "pitch_mm": pitch}, layouts()["grid"].table)
        gc.collect()


@pytest.mark.parametrize("source", ["forearm-pockets", {"array": "pockets"}])
def test_load_refuses_arrays(source):
    with pytest.raises(unitcad.UnitcadError, match="an array of units"):
        load(source)

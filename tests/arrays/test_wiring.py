"""The common circuit's rows, spine and tail: where they lie, what they may not run into, what is offered instead."""

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.circuit import LEAST_BEND, wiring
from unitcad.errors import Refusal

NINE = {
    "name": "nine",
    "array": "back-sheet",
    "unit": {"like": "encapsulating", "fpcb": {"tail_length_mm": 2.0}},
    "layout": {"kind": "grid", "columns": 3, "rows": 3, "pitch_mm": 20.0},
}

WIDE = {"kind": "grid", "columns": 2, "rows": 2, "pitch_mm": 30.0}


def nine(**tables):
    return load_array({**NINE, **tables})


def over(array, *sets):
    return load_array(array, sets)


def test_nine_units_have_three_rows_and_a_spine_between_two_columns():
    found = wiring(nine())
    assert [place.name for place in found.places] == [f"{row}{column}" for row in "ABC" for column in (1, 2, 3)]
    assert [(row.start, row.end) for row in found.rows] == [((-20, y), (20, y)) for y in (20, 0, -20)]
    (spine,) = found.spine
    assert (spine.start, spine.end) == ((10, 21.5), (10, nine().sheet.outline[1] - 10))
    assert found.pad.high - found.pad.low == pytest.approx(0.11)


def test_a_spine_is_laid_where_it_is_asked_for():
    assert wiring(nine(circuit={"spine_mm": -10.0})).spine[-1].end[0] == -10
    turned = wiring(nine(circuit={"rows": "y", "spine_mm": 10.0, "tail_mm": 3.0}))
    assert turned.spine[-1].end == (nine().sheet.outline[0] - 3, 10)
    assert turned.rows[0].start[0] == turned.rows[0].end[0]


def test_a_hexagon_has_a_spine_that_steps_from_gap_to_gap():
    hexagon = nine(layout={"kind": "hex", "rings": 2, "pitch_mm": 22.0})
    found = wiring(hexagon)
    assert len(found.spine) == 6
    assert len(found.rows) == 5


def test_one_column_needs_no_rows():
    found = wiring(nine(layout={"kind": "grid", "columns": 1, "rows": 4, "pitch_mm": 18.0}))
    assert found.rows == ()
    assert found.spine[-1].end[0] == 0


@pytest.mark.parametrize(
    ("tables", "field", "nearest"),
    [
        ({"circuit": {"spine_mm": 3.0}}, "circuit.spine_mm", 10.0),
        ({"circuit": {"row_width_mm": 5.5}}, "circuit.row_width_mm", 5.0),
        ({"circuit": {"row_width_mm": 9.5}, "layout": WIDE}, "circuit.row_width_mm", 8.4),
        ({"circuit": {"rows": "y"}, "sheet": {"strap_slot_mm": [3.0, 26.0]}}, "circuit.rows", "x"),
        ({"layout": {"kind": "hex", "pitch_mm": 20.0}}, "circuit.row_width_mm", 2.3),
        ({"unit": "no-fpcb"}, "unit.fpcb", None),
    ],
)
def test_what_does_not_fit_is_refused_with_what_would(tables, field, nearest):
    with pytest.raises(Refusal) as refused:
        wiring(nine(**tables))
    assert (refused.value.field, refused.value.nearest) == (field, nearest)
    if nearest is not None:
        wiring(over(nine(**tables), f"{field}={nearest!r}".replace("'", '"')))


def test_units_in_pockets_keep_circuits_of_their_own():
    with pytest.raises(Refusal, match="own circuit") as refused:
        nine(array="pockets", circuit={})
    assert (refused.value.field, refused.value.nearest) == ("array", "back-sheet")


def test_a_narrow_limb_bends_the_circuit_between_two_pads_too_much():
    thick = {"like": "encapsulating", "fpcb": {"tail_length_mm": 2.0, "thickness_mm": 0.6}}
    close = {"kind": "grid", "columns": 3, "rows": 3, "pitch_mm": [18.0, 18.0]}
    array = nine(unit=thick, layout=close, limb={"radius_mm": 10.0})
    with pytest.raises(Refusal, match="bent") as refused:
        wiring(array)
    assert refused.value.field == "limb.radius_mm"
    pad = wiring(nine(unit=thick, layout=close)).pad.radius
    assert refused.value.nearest == pytest.approx(LEAST_BEND * 0.6 * 18 / (18 - 2 * pad), abs=1e-3)
    wiring(over(array, f"limb.radius_mm={refused.value.nearest}"))

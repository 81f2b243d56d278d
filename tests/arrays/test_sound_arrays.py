"""Arrays of every construction and many sizes keep every mould check, and each tool prints without support."""

from functools import partial

import pytest

from tests.arrays.made_arrays import findings, made
from tests.moulds.faulty_sets import mesh_findings
from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import check_moulds, mould_checks

PAIR = "layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3,8]"
PATCH, POCKETS, CURVED, LOW = "forearm-patch", "forearm-pockets", "sleeve-curved", "unit=single-embedded"
long = partial(pytest.param, marks=pytest.mark.long)
SHIPPED = [
    (PATCH,),
    (PATCH, "unit=three-layer", "layout.pitch_mm=24", *PAIR),
    (PATCH, "unit=single-encapsulating", "moulds.printer=fdm-0.25", *PAIR),
    long((PATCH, "layout.columns=1", "layout.pitch_mm=18")),
    long((PATCH, "layout.rows=1", "sheet.strap_slot_mm=[3,8]", "moulds.printer=fdm-0.25", "sheet.thickness_mm=1.5")),
    (PATCH, "sheet.thickness_mm=0.6", "circuit.row_width_mm=2", "layout.pitch_mm=[18,19]", "sheet.margin_mm=7",
     "layout.columns=2", "layout.rows=2"),
    # Grooves side by side: 0.4 mm apart, and where fins cut what two of them share.
    (PATCH, "layout.rows=2", "layout.columns=2", "layout.pitch_mm=[20.66,20.2]", "moulds.land_mm=2.88"),
    # Round strap slots.
    *((name, slot, "layout.columns=2", "layout.rows=1")
      for name, slot in ((PATCH, "sheet.strap_slot_mm=[3,3]"), (POCKETS, "sheet.strap_slot_mm=[3,2]"))),
    # Tools larger than the bed, along x and along y.
    ("wrist-band",),
    long((PATCH, "moulds.bed_x_mm=60")),
    long(("hex-19", "moulds.bed_y_mm=80")),
    (POCKETS, "layout.columns=12", "layout.rows=1", "sheet.strap_slot_mm=[3,8]"),
    (POCKETS,),
    ("hex-19",),
    # The groove of a low tray, and a unit that is held under its tail.
    *((POCKETS, f"sheet.thickness_mm={mm}", LOW) for mm in (0.6, 1.2)),
    (CURVED, "layout.columns=2", "layout.rows=1"),
    long((CURVED,)),
]  # fmt: skip


@pytest.mark.parametrize("source", SHIPPED, ids=" ".join)
def test_a_shipped_array_keeps_every_check_and_prints(source):
    moulds, found = made(*source), findings(*source)
    assert [f for f in found if not f.ok] == []
    assert max(f.value for f in found if f.code == "C100") < 1e-6 or moulds.construction.own_tails
    assert {f.code for f in found} >= {"C000", "C100", "C200", "C300", "C310", "C400", "C410"}
    assert moulds.construction.own_tails or {f.code for f in found} == set(mould_checks())
    assert mesh_findings(moulds) == []


BACK_SHEET = {"name": "other", "array": "back-sheet", "unit": "encapsulating"}
NARROW = {"kind": "grid", "columns": 1, "rows": 3, "pitch_mm": 17.54}


def tape(like, columns, pitch):
    layout = {"kind": "grid", "columns": columns, "rows": 1, "pitch_mm": pitch}
    return {**BACK_SHEET, "unit": {"like": like}, "layout": layout}


OTHERS = {
    "label as deep as its shallow groove": {
        **BACK_SHEET, "array": "pockets", "layout": NARROW, "moulds": {"groove_depth_mm": 0.3},
    },
    "film": {
        **BACK_SHEET, "array": "pockets", "unit": "custom/film-closed",
        "layout": {"kind": "grid", "columns": 2, "rows": 2, "pitch_mm": 24},
    },
}  # fmt: skip
LONG = {
    # A seam's tooth and a notch's window stop the groove between them: a slit of 0.031 mm stayed beside a tape's.
    "tape": tape("motor-10mm", 10, 25),
    "tape of larger units": tape("encapsulating", 12, 23),
    "curved hex": {
        **BACK_SHEET,
        "layout": {"kind": "hex", "rings": 1, "pitch_mm": 20},
        "circuit": {"row_width_mm": 2},
        "limb": {"radius_mm": 45, "cast": "curved"},
    },
    "curved, strap slots": {
        **BACK_SHEET,
        "unit": {"like": "three-layer"},
        "layout": {"kind": "list", "points_mm": [[-12, -3], [13, 4]]},
        "sheet": {"strap_slot_mm": [3, 8]},
        "limb": {"radius_mm": 61.7, "cast": "curved"},
    },
}


@pytest.mark.parametrize("name", [*OTHERS, *(pytest.param(name, marks=pytest.mark.long) for name in LONG)])
def test_another_array_keeps_every_check_and_prints(name):
    moulds = patch_moulds(load_array({**OTHERS, **LONG}[name]))
    assert [f for f in check_moulds(moulds) if not f.ok] == []
    assert mesh_findings(moulds) == []

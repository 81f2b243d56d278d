"""What an array warns of: too many motors for its circuit's width, a groove drawn less deep than asked for."""

import json
from dataclasses import asdict, replace
from html import escape

import pytest

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.arrays.array_page import write_array_page
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.arrayed import said_of_unit
from unitcad.arrays.circuit import GAP_MM, TRACK_MM, crowded_tracks
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.procedure import procedure as unit_procedure
from unitcad.casting.steps import casting_summary
from unitcad.checks.gap import play_missing
from unitcad.moulds.cup import groove_depth_of
from unitcad.moulds.heights import as_printed, height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline.write import build as build_array


def test_144_motors_need_a_tail_of_29_mm():
    """145 tracks of 0.1 mm with 146 gaps; 3 mm hold 14, for 13 motors and their return."""
    (said,) = crowded_tracks(load_array("forearm-patch", {"layout.rows": 12, "layout.columns": 12}))
    assert "144 tracks" in said
    assert f"need {145 * TRACK_MM + 146 * GAP_MM:.1f} mm" in said
    assert "enough for 13 motors" in said
    fourteen = load_array("forearm-patch", {"layout.rows": 2, "layout.columns": 7})
    assert crowded_tracks(fourteen)
    assert not crowded_tracks(replace(fourteen, places=fourteen.places[:13]))


@pytest.mark.parametrize("name", array_templates())
def test_no_template_warns(name):
    array = load_array(name)
    assert not crowded_tracks(array)
    assert shallow_grooves(patch_moulds(array)) == []
    assert play_missing(patch_moulds(array)) == []


def test_casting_alone_warns_of_play_that_the_mould_checks_would_miss(tmp_path):
    array = load_array(
        "wrist-band",
        {"layout.count": 3, "limb.radius_mm": 20, "moulds.bed_x_mm": 60, "moulds.plinth_clearance_mm": 0.05},
    )
    built = build_array(array, tmp_path, only=("casting",))
    warned = json.loads((built.folder / "manifest.json").read_bytes())["warnings"]
    (said,) = [line for line in warned if "moulds.plinth_clearance_mm = 0.05" in line]
    assert said.endswith("(C210 and C250)")


def test_manifest_and_page_say_it(tmp_path):
    changes = {"moulds.groove_depth_mm": 3.3, "circuit.row_width_mm": 1.5, "layout.columns": 2,
               "layout.rows": 4, "output.formats": ["stl"]}  # fmt: skip
    array = load_array("forearm-patch", changes)
    built = build_array(array, tmp_path, only=("unit",), check=False)
    circuit, groove = json.loads((built.folder / "manifest.json").read_bytes())["warnings"][:2]
    assert "1.5 mm wide (circuit.row_width_mm), enough for 6 motors" in circuit
    depths = [groove_depth_of(array.unit, step.rim) for step in patch_moulds(array).plan.steps]
    assert depths == pytest.approx([1.6, 2.2])
    assert groove.endswith("the groove is drawn 1.6 mm on cup 1 and 2.2 mm on cup 2")
    page = write_array_page(built.folder, print).read_text("utf-8")
    assert escape(circuit) in page
    assert escape(groove) in page


def test_an_array_names_the_keys_of_its_file():
    """The suggestion without "unit." was an unknown key."""
    said = height_warnings(patch_moulds(load_array("forearm-patch", ["moulds.first_layer_mm=0.3"])))
    better = [line.split("; ")[1].split(" would")[0].replace(" = ", "=") for line in said]
    assert better[0].startswith("unit.layers.0.cap_mm=")
    assert height_warnings(patch_moulds(load_array("forearm-patch", ["moulds.first_layer_mm=0.3", *better]))) == []


def test_a_placed_unit_of_another_kind_is_named_by_its_place():
    given = {"array": "pockets", "layout": {"kind": "grid", "columns": 2, "rows": 1, "pitch_mm": 24.0}, "name": "two",
             "unit": "encapsulating", "moulds": {"first_layer_mm": 0.35}, "sheet": {"thickness_mm": 2.0},
             "place": [{"at": [2, 1], "unit": "no-fpcb"}]}  # fmt: skip
    array = load_array(given)
    said = [line for unit in array.units for line in said_of_unit(array, unit).values()]
    assert any("; unit.layers.0.cap_mm = " in line for line in said)
    assert any("; place.0.unit.layers.0.cap_mm = " in line for line in said)


def test_units_go_into_their_pockets_without_a_wait():
    moulds = patch_moulds(load_array("forearm-pockets"))
    own = MouldSet(moulds.array.unit)
    procedure = array_procedure(moulds, [1000.0], 0.0, {"units/one": unit_procedure(own, [100.0, 100.0])})
    assert [*casting_summary(asdict(procedure))][1].endswith(" Units in: 18 min more at the bench.")


def test_a_curved_array_has_caps_only():
    assert as_printed(patch_moulds(load_array("sleeve-curved"))) == "cap 1.2 mm (drawn 1.25)"
    assert as_printed(patch_moulds(load_array("forearm-pockets"))) == ""

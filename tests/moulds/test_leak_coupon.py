"""The leak coupon: gauges measured on its meshes, and readings of a printer of known errors that make up for them."""

import json
import math
import tomllib

import pytest
from manifold3d import CrossSection

from tests.in_process import unitcad
from tests.sample_bodies import LEADLESS
from unitcad import Refusal
from unitcad.casting.leak_coupon import LeakCoupon, Readings
from unitcad.casting.preparation import slicer_settings
from unitcad.catalogue import printers
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data, read
from unitcad.validation.cupboard import add_entry, read_cupboard

PRINTERS = ["fdm-0.4", "fdm-0.25", "sla"]


def run(*words):
    return unitcad("coupon", *words)


def sizes(mesh):
    x0, y0, z0, x1, y1, z1 = mesh.bounding_box()
    return x1 - x0, y1 - y0, z1 - z0


@pytest.mark.parametrize("name", PRINTERS)
def test_gauges_are_those_of_the_meshes(name):
    made = LeakCoupon(name)
    base, cup, tongue = (made.moulds.mesh(body) for body in made.pieces)
    layer, drawn = float(printers()[name].layer_mm), {key: gauge.drawn_mm for key, gauge in made.gauges.items()}
    assert [len(mesh.decompose()) for mesh in (base, cup, tongue)] == [1, 1, 1]
    bore = max(cup.slice(0.2).to_polygons(), key=lambda loop: -abs(loop).max())
    area = abs(CrossSection([bore[::-1]]).area() or CrossSection([bore]).area())
    assert math.sqrt(4 * area / math.pi) == pytest.approx(drawn["bore"], abs=0.003)
    wall = cup.trim_by_plane((1, 0, 0), cup.bounding_box()[3] - 1).slice(1.1)
    y = sorted(y for piece in wall.decompose() for y in piece.bounds()[1::2])
    assert y[2] - y[1] == pytest.approx(drawn["window"], abs=0.003)
    strip = tongue.trim_by_plane((-1, 0, 0), -6.0)
    assert sizes(strip)[1] == pytest.approx(drawn["tongue"], abs=0.003)
    assert sizes(cup)[2] == pytest.approx(drawn["cup"], abs=layer / 2 + 0.001)
    assert sizes(cup)[1] == pytest.approx(drawn["outside"], abs=0.003)
    assert sizes(base)[1] == pytest.approx(drawn["outside"], abs=0.003)  # so that across shows the shift
    assert sizes(base + cup)[2] == pytest.approx(drawn["seated"], abs=layer / 2 + 0.001)
    # Only the ribs touch the plinth: no more than the interference, and nothing else.
    assert (base ^ cup).volume() > 0
    assert (base ^ cup).slice(-1.0).area() < 8 * 2 * float(printers()[name].rib_interference_mm)


def test_a_printer_of_known_errors_is_made_up_for():
    narrow, wide, squeezed = 0.11, 0.04, 0.06  # a side: inner faces, outer faces, the first layer
    made = LeakCoupon("fdm-0.4")
    drawn = {key: gauge.drawn_mm for key, gauge in made.gauges.items()}
    readings = Readings(
        bore_mm=drawn["bore"] - 2 * narrow,
        rim_mm=drawn["rim"] - 2 * narrow - 2 * squeezed,
        window_mm=drawn["window"] - 2 * narrow,
        tongue_mm=drawn["tongue"] + 2 * wide,
    )
    values = {each.key: each.value for each in made.settings(readings)[0]}
    entry = {"mine": {"like": "fdm-0.4", **values}}
    spec = from_data({**read(LEADLESS), "printers": entry, "moulds": MINE})
    # Drawn with the entry and printed with the errors, bore and gaps are the catalogue's.
    assert spec.moulds.bore_compensation_mm - narrow == pytest.approx(0)
    assert spec.moulds.window_clearance_mm - narrow - wide == pytest.approx(0.1)
    assert spec.moulds.plinth_clearance_mm - narrow - wide == pytest.approx(0.15)
    assert values["elephant_foot_mm"] == pytest.approx(0.2 + squeezed)


MINE = {"printer": "mine"}


def test_crush_and_play_move_the_ribs():
    made = LeakCoupon("fdm-0.4")
    seated, outside = made.gauges["seated"].drawn_mm, made.gauges["outside"].drawn_mm

    def ribs(**given):
        return {each.key: each.value for each in made.settings(Readings(**given))[0]}["rib_interference_mm"]

    assert ribs(seated_mm=seated) == pytest.approx(0.1)
    # A taper of 5 degrees closes by 0.0875 mm over each mm that the cup goes down.
    assert ribs(seated_mm=seated + 0.4) == pytest.approx(0.1 - 0.4 * 0.08749, abs=6e-4)
    assert ribs(outside_mm=outside + 0.1, across_mm=outside + 0.13) == pytest.approx(0.13)
    # Squish lowers both pieces, so a cup that stands too high reads so much less.
    height = made.gauges["cup"].drawn_mm
    assert ribs(cup_mm=height - 0.04, seated_mm=seated - 0.08 + 0.4) == pytest.approx(0.065, abs=6e-4)


def test_a_first_layer_of_another_height_is_told_apart_from_squish():
    made = LeakCoupon("fdm-0.4")
    height = made.gauges["cup"].drawn_mm
    _, advice = made.settings(Readings(cup_mm=height + 0.1))
    assert "first_layer_mm" in advice[0]
    values, advice = made.settings(Readings(cup_mm=height + 0.1, first_layer_mm=0.3))
    assert [each.value for each in values] == [0.3]
    assert "Change nothing" in advice[0]
    _, advice = made.settings(Readings(cup_mm=height - 0.03))
    assert "Change nothing" in advice[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["bore_mm=6"], "readings.bore_mm = 6: the cup's bore from below"),
        (["bore_mm=6"], "nearest accepted: 7"),
        (["bore_mm=wide"], "readings.bore_mm"),
        (["bor_mm=7"], "bore_mm"),
        (["rim_mm=7.9"], "readings.bore_mm: is required with rim_mm"),
        (["recess=6"], "readings.recess = 6"),
        (["none.toml"], "none.toml: no such file"),
        (["leak=wet"], "readings.leak"),
    ],
)
def test_a_reading_out_of_range_is_one_error_and_writes_nothing(words, said, tmp_path):
    given = [part for word in words for part in ("--read", word)]
    result = run("fdm-0.4", *given, "--cupboard", tmp_path / "cupboard.toml")
    assert result.returncode == 2
    assert said in result.stderr.replace("\n", " ")
    assert not (tmp_path / "cupboard.toml").exists()


def test_the_entry_is_added_to_a_cupboard_that_is_kept(tmp_path):
    file, form = tmp_path / "cupboard.toml", tmp_path / "readings.toml"
    owned = '# mine\n[at_hand]\nmaterials = ["ecoflex-00-10"]  # two tins\n'
    file.write_text(owned)
    form.write_text('bore_mm = 7.8\nleak = "tongue"\nribs = 4\n')
    result = run("fdm-0.4", "--read", form, "--read", "recess=2", "--cupboard", file, "--json")
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["options"] == [
        "--set moulds.plinth_clearance_mm=0.1125",
        "--set moulds.rib_interference_mm=0.125",
        "--set moulds.bore_compensation_mm=0.1",
    ]
    assert file.read_text().startswith(owned)
    mine = printers(read_cupboard(file).printers)["mine"]
    assert (mine.bore_compensation_mm.value, mine.bore_compensation_mm.status) == (0.1, "measured")
    assert "bore_mm 7.8" in mine.bore_compensation_mm.source
    assert mine.layer_mm == printers()["fdm-0.4"].layer_mm
    # Once more: the name is taken; nothing changes. Under another name, from the own entry on.
    before = file.read_bytes()
    again = run("fdm-0.4", "--read", form, "--cupboard", file)
    assert again.returncode == 2
    assert "nearest accepted: 'mine-2'" in again.stderr.replace("\n", " ")
    assert file.read_bytes() == before
    better = run("mine", "--read", "bore_mm=7.96", "--name", "better", "--cupboard", file)
    assert better.returncode == 0, better.stderr
    entry = tomllib.loads(file.read_text())["printers"]["better"]
    assert entry["like"] == "fdm-0.4"
    assert entry["bore_compensation_mm"] == pytest.approx(0.12)  # 0.1 in the print, and 0.02 more
    assert entry["rib_interference_mm"]["value"] == 0.125
    assert "ribs 4" in entry["rib_interference_mm"]["source"]


def test_a_cupboard_that_would_break_stays_as_it_is(tmp_path):
    file = tmp_path / "cupboard.toml"
    file.write_text("printers = {}\n")
    with pytest.raises(Exception, match=r"takes no entry printers\.mine"):
        add_entry(file, "printers", "mine", 'like = "fdm-0.4"')
    assert file.read_text() == "printers = {}\n"
    with pytest.raises(Refusal):
        add_entry(file, "printers", "fdm-0.4", 'like = "sla"')


def test_elephant_foot_reaches_the_slicer():
    own = {"mine": {"like": "fdm-0.4", "elephant_foot_mm": 0.26}}
    spec = from_data({**read(LEADLESS), "printers": own, "moulds": MINE})
    assert slicer_settings(MouldSet(spec))["elefant_foot_compensation"] == "0.26"

"""The coupon: every station has the clearance that its line of TOML says, measured on the meshes."""

import json
import math
import tomllib
from pathlib import Path

import pytest
from manifold3d import CrossSection, Manifold
from typer.testing import CliRunner

from tests.sample_bodies import LEADLESS
from unitcad.casting import coupon
from unitcad.catalogue import printers
from unitcad.kernels.mesh import area_true, realise
from unitcad.shape import moved, turned
from unitcad.validation import from_data, read

GRID = 2 / 1024
SEGMENTS = 64


LEAK = {f"leak-{kind}.stl" for kind in ("base", "cup", "tongue")} | {"leak-coupon.3mf", "leak-coupon.md"}
LEAK |= {"leak-coupon.png", "readings.toml"}


def pieces(name):
    return {body.name: realise(body.shape, SEGMENTS) for body in coupon.Coupon(printers()[name]).bodies()}


@pytest.mark.parametrize("name", ["fdm-0.4", "fdm-0.25", "sla"])
def test_stations_have_the_clearances_they_say(name):
    printer = printers()[name]
    plate = pieces(name)["coupon-plate"]
    assert len(plate.decompose()) == 1
    assert plate.genus() == 5
    values, made = {fit.feature: fit.values_mm for fit in coupon.Coupon(printer).fits.values()}, coupon.Coupon(printer)
    _, plug, tongue = (body.shape for body in made.bodies())
    for i in range(5):
        # The plug, turned over, its handle on the plate: below the plate's face only its sides are near.
        x = made.x(i)
        inside = moved(turned(plug, "x", 2), x, made.y("recess"), coupon.PLATE + 4)
        mesh = realise(inside, SEGMENTS)
        assert (mesh ^ plate).volume() < 1e-6
        below = mesh.trim_by_plane((0, 0, -1), 0.3 - coupon.PLATE)
        assert below.min_gap(plate, 1) == pytest.approx(values["recess"][i], abs=2 * GRID)
        if "ribs" in values:
            pressed = realise(
                moved(turned(plug, "x", 2), x, made.y("ribs"), coupon.PLATE + made.boss + 4),
                SEGMENTS,
            )
            # So far under the mouth a rib has its full depth, on a leaf or without.
            level = coupon.PLATE + made.boss - 0.4
            patches = (pressed.slice(level) ^ plate.slice(level)).decompose()
            sizes = [(x1 - x0, y1 - y0) for x0, y0, x1, y1 in (patch.bounds() for patch in patches)]
            assert len(sizes) == 8
            assert [min(size) for size in sizes] == pytest.approx([values["ribs"][i]] * 8, abs=2 * GRID)
            # Handle and boss are of one size: what a caliper reads across both is the shift.
            x0, y0, x1, y1 = pressed.slice(coupon.PLATE + made.boss + 1).bounds()
            around = Manifold.cube((x1 - x0, y1 - y0, 1.0)).translate((x0, y0, coupon.PLATE + 1))
            outside = Manifold.cube((x1 - x0 + 2, y1 - y0 + 2, 1.0)).translate((x0 - 1, y0 - 1, coupon.PLATE + 1))
            assert ((outside - around) ^ plate).volume() < 1e-9
            assert (around ^ plate).bounding_box() == pytest.approx(around.bounding_box(), abs=GRID)
        strip = realise(moved(turned(tongue, "z", 2), x, 5, coupon.WINDOW_Z), SEGMENTS)
        assert strip.min_gap(plate, 1) == pytest.approx(values["window"][i], abs=GRID)
        hole = plate.slice(1.0).to_polygons()
        radii = [max(math.dist(p, (x, made.y("hole"))) for p in loop) for loop in hole]
        assert 2 * min(radii) / area_true(SEGMENTS) == pytest.approx(values["hole"][i], abs=2 * GRID)
        around = CrossSection.square((coupon.WALL_LENGTH, 2.0), True).translate((x, made.y("wall")))
        wall = (plate.slice(coupon.PLATE + 4) ^ around).bounds()
        assert min(wall[2] - wall[0], wall[3] - wall[1]) == pytest.approx(values["wall"][i], abs=GRID)


@pytest.mark.parametrize("name", ["fdm-0.4", "fdm-0.25", "sla"])
def test_its_toml_is_taken_by_a_spec(name):
    printer = printers()[name]
    block = coupon.Coupon(printer).markdown().split("```toml\n")[1].split("```")[0]
    spec = from_data({**read("encapsulating"), **tomllib.loads(block)})
    assert spec.moulds.plinth_clearance_mm == float(printer.plinth_clearance_mm)
    for fit in coupon.Coupon(printer).fits.values():
        own = tomllib.loads(fit.toml(3))
        data = {**read(LEADLESS), "moulds": {"printer": "mine"}, "printers": {"mine": {"like": name, **own}}}
        assert getattr(from_data(data).moulds, fit.key) == fit.values_mm[3]


def test_command_writes_a_folder(tmp_path):
    from unitcad.cli import app

    result = CliRunner().invoke(app, ["coupon", "fdm-0.4", "-o", str(tmp_path), "--json"])
    assert result.exit_code == 0, result.output
    output = json.loads(result.stdout)
    names = {file.name for file in Path(output["folder"]).iterdir()}
    assert names == {"coupon-plate.stl", "coupon-plug.stl", "coupon-tongue.stl", "coupon.3mf", "coupon.md"} | LEAK
    first = {file.name: file.read_bytes() for file in Path(output["folder"]).iterdir()}
    CliRunner().invoke(app, ["coupon", "fdm-0.4", "-o", str(tmp_path)])
    assert first == {file.name: file.read_bytes() for file in Path(output["folder"]).iterdir()}


def test_resin_coupon_prints_no_tongue_and_says_how_to_cut_it(tmp_path):
    assert not (coupon.write(printers()["sla"], tmp_path) / "coupon-tongue.stl").exists()
    text = coupon.Coupon(printers()["sla"]).markdown()
    assert "cut a strip 3.4 mm wide" in text
    assert "0.35 mm thick" in text


@pytest.mark.parametrize("name", ["fdm-0.4", "fdm-0.25", "sla"])
def test_windows_end_whole_layers_and_keep_the_clearance(name):
    printer = printers()[name]
    layer, thick = float(printer.layer_mm), float(printer.slot_height_mm)
    around = next(fit.values_mm for fit in coupon.Coupon(printer).fits.values() if fit.feature == "window")
    for (low, high), clearance in zip(coupon.Coupon(printer).windows, around, strict=True):
        assert low / layer == pytest.approx(round(low / layer))
        assert high / layer == pytest.approx(round(high / layer))
        assert coupon.WINDOW_Z - low >= clearance - 1e-9
        assert high - coupon.WINDOW_Z - thick >= clearance - 1e-9
    assert "differ only in width" in coupon.Coupon(printer).markdown()

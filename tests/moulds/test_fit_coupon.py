"""The coupon: every station has the clearance that its line of TOML says, measured on the meshes."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import pytest
from manifold3d import Manifold
from typer.testing import CliRunner

from unitcad.casting import coupon
from unitcad.catalogue import printers
from unitcad.kernels.mesh import area_true, realise
from unitcad.shape import moved, turned
from unitcad.validation import from_data, read

GRID = 2 / 1024
SEGMENTS = 64


def station_x(i: int) -> float:
    return coupon.MARGIN + coupon.PITCH * (i + 0.5)


def pieces(name: str) -> dict[str, Manifold]:
    return {body.name: realise(body.shape, SEGMENTS) for body in coupon.bodies(printers()[name])}


@pytest.mark.parametrize("name", sorted(printers()))
def test_stations_have_the_clearances_they_say(name: str) -> None:
    printer = printers()[name]
    plate = pieces(name)["coupon-plate"]
    assert len(plate.decompose()) == 1
    assert plate.genus() == 5
    values = {fit.feature: fit.values_mm for fit in coupon.fits(printer)}
    _, plug, tongue = (body.shape for body in coupon.bodies(printer))
    for i in range(5):
        # The plug, turned over, its handle on the plate: below the plate's face only its sides are near.
        inside = moved(turned(plug, "x", 2), station_x(i), coupon._ROWS["recess"], coupon.PLATE + 4)
        mesh = realise(inside, SEGMENTS)
        assert (mesh ^ plate).volume() < 1e-6
        below = mesh.trim_by_plane((0, 0, -1), 0.3 - coupon.PLATE)
        assert below.min_gap(plate, 1) == pytest.approx(values["recess"][i], abs=2 * GRID)
        strip = realise(moved(turned(tongue, "z", 2), station_x(i), 5, coupon.WINDOW_Z), SEGMENTS)
        assert strip.min_gap(plate, 1) == pytest.approx(values["window"][i], abs=GRID)
        hole = plate.slice(1.0).to_polygons()
        radii = [max(math.dist(p, (station_x(i), coupon._ROWS["hole"])) for p in loop) for loop in hole]
        assert 2 * min(radii) / area_true(SEGMENTS) == pytest.approx(values["hole"][i], abs=2 * GRID)
        wall = plate.slice(coupon.PLATE + 2).decompose()[i].bounds()
        assert min(wall[2] - wall[0], wall[3] - wall[1]) in [pytest.approx(v, abs=GRID) for v in values["wall"]]


@pytest.mark.parametrize("name", sorted(printers()))
def test_its_toml_is_taken_by_a_spec(name: str) -> None:
    printer = printers()[name]
    block = coupon.to_markdown(printer).split("```toml\n")[1].split("```")[0]
    spec = from_data({**read("encapsulating"), **tomllib.loads(block)})
    assert spec.moulds.plinth_clearance_mm == float(printer.plinth_clearance_mm)
    for fit in coupon.fits(printer):
        own = tomllib.loads(fit.toml(3))
        data = {**read("no-fpcb"), "moulds": {"printer": "mine"}, "printers": {"mine": {"like": name, **own}}}
        assert getattr(from_data(data).moulds, fit.key) == fit.values_mm[3]


def test_command_writes_a_folder(tmp_path: Path) -> None:
    from unitcad.cli import app

    result = CliRunner().invoke(app, ["coupon", "fdm-0.4", "-o", str(tmp_path), "--json"])
    assert result.exit_code == 0, result.output
    output = json.loads(result.stdout)
    names = {file.name for file in Path(output["folder"]).iterdir()}
    assert names == {"coupon-plate.stl", "coupon-plug.stl", "coupon-tongue.stl", "coupon.3mf", "coupon.md"}
    first = {file.name: file.read_bytes() for file in Path(output["folder"]).iterdir()}
    CliRunner().invoke(app, ["coupon", "fdm-0.4", "-o", str(tmp_path)])
    assert first == {file.name: file.read_bytes() for file in Path(output["folder"]).iterdir()}


def test_resin_coupon_prints_no_tongue(tmp_path: Path) -> None:
    from unitcad.casting.coupon_files import write

    assert not (write(printers()["sla"], tmp_path) / "coupon-tongue.stl").exists()


def test_windows_are_as_high_as_the_slicer_makes_them() -> None:
    """Layers counted in PrusaSlicer's G-code, where each is cut at its middle."""
    heights = {name: coupon.window_heights_as_printed(printers()[name]) for name in ("fdm-0.4", "fdm-0.25")}
    assert heights["fdm-0.4"] == pytest.approx([0.6, 0.6, 0.6, 0.8, 0.8])
    assert heights["fdm-0.25"] == pytest.approx([0.4, 0.6, 0.6, 0.6, 0.6])
    assert "differ in width only" in coupon.to_markdown(printers()["fdm-0.4"])


def test_resin_coupon_says_how_to_cut_the_tongue() -> None:
    text = coupon.to_markdown(printers()["sla"])
    assert "cut a strip 3.4 wide" in text
    assert "0.35 mm thick" in text

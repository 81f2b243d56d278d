"""`unitcad phantom`: recipe and box against their lengths, response and echo, refusals, a spec's tissue."""

import csv
import json
import math
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from typer.testing import CliRunner

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_spec
from unitcad.kernels.mesh import bounds, realise
from unitcad.lab import phantom_command
from unitcad.lab.phantom import PhantomTable, load_phantom, modulus_by_table, phantom_set
from unitcad.shape import box, cylinder, moved, union
from unitcad.spec import convert
from unitcad.validation import load
from unitcad.validation.load import shipped_files

DATA = Path(__file__).parent / "data" / "phantom-material-database" / "phantoms_table.csv"
LAYERS = [
    {"name": "skin", "silicone": "ecoflex-00-50", "thinner_pct": 6.0, "thickness_mm": 1.5},
    {"name": "muscle", "silicone": "ecoflex-00-10", "thinner_pct": 62.5, "thickness_mm": 20.0},
]


@cache
def _skin():
    return phantom_set(load_phantom("skin"))


def _made(**changed):
    return phantom_set(convert({"name": "ours", "layers": LAYERS, **changed}, PhantomTable))


def test_every_tested_share_has_the_modulus_of_the_source():
    with open(DATA, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 15
    for row in rows:
        family, share = row["sample_label"].split("_")
        value, low, high = modulus_by_table(
            f"ecoflex-00-{family.removeprefix('EF')}", float(share.removesuffix("T")), "layers.0"
        )
        mean, deviation = float(row["elastic_modulus_mean_kPa"]), float(row["elastic_modulus_std_kPa"])
        assert value == pytest.approx(mean)
        assert high - low == pytest.approx(4 * deviation)
    assert modulus_by_table("ecoflex-00-50", 6.0, "layers.0")[0] == pytest.approx(130, rel=0.02)


def test_the_walls_and_the_response_are_those_of_another_program():
    made = _skin()
    assert made.expected.wall_mm == pytest.approx(63, abs=0.5)
    assert 2 * made.size.inner == 130
    assert made.size.tops[0] == 30.5
    assert made.expected.echo_pct < 5
    assert made.expected.factor == pytest.approx(2.4, abs=0.05)
    assert made.expected.sensitivity["skin"] == pytest.approx(-0.045, abs=0.01)
    assert abs(made.expected.sensitivity["muscle"]) < 0.01


def test_the_range_has_what_the_frequency_may_bring_and_every_page_says_quasi_static():
    made = _skin()
    factor = abs(1 + (2j * math.pi * 125 * 260e-6) ** 0.27)  # the catalogue's law, from rest to 125 Hz
    assert factor == pytest.approx(1.62, abs=0.005)
    for one, layer in zip(made.recipes, made.table.layers, strict=True):
        value, low, high = modulus_by_table(layer.silicone, layer.thinner_pct, "layers.0")
        assert one.high_kpa == pytest.approx(factor * high)
        assert (one.modulus_kpa, one.low_kpa) == (value, low)
    words = phantom_command.casting_markdown(made)
    assert "They are quasi-static" in words
    assert "has a factor of 1.62 for 125 Hz" in words
    assert "from quasi-static compression" in words.split("## What to expect")[1]
    assert phantom_command.tissue_toml(made).count("quasi-static compression; high: also times 1.62") == 3


def test_the_response_is_the_layered_solver_s():
    made = _skin()
    layers = [
        Layer(t * 1e-3, one.density_g_cm3 * 1e3, one.modulus_kpa * 1e3, 0.4999, LossFactor(0.2))
        for t, one in zip((1.5, 4.0, 25.0), made.recipes, strict=True)
    ]
    stack = LayeredMedium(layers, HalfSpace(1190.0, 3e9, 0.37, LossFactor(0.05)))
    u = np.abs(stack.response(UniformDisc(3.5e-3), 2 * math.pi * 125, [7e-3, 22e-3, 37e-3, 93e-3], rtol=1e-6).u_z)
    assert made.expected.value[3] == pytest.approx(u[1] / u[0], rel=1e-3)
    assert made.expected.value[-1] == pytest.approx(u[2] / u[0], rel=1e-3)
    assert made.expected.echo_pct == pytest.approx(100 * u[3] / u[2], rel=1e-2)
    assert made.expected.low[-1] < made.expected.value[-1] < made.expected.high[-1]


def test_tools_and_layers_fill_the_box_without_overlap():
    """Tools are drawn from lengths, not by subtracting the layers: together they leave nothing of the cavity."""
    made = _skin()
    layers = [realise(body.shape, 64) for body in made.layers]
    assembled = [realise(b.shape, 64) for b in made.tools if b.kind in ("base", "frame") or b.made == "cut"]
    for layer in layers:
        for tool in assembled:
            assert (layer ^ tool).volume() == pytest.approx(0, abs=1e-6)
    half, top = made.size.outer - 0.5, made.size.tops[0]
    space = realise(box(-half, half, -half, half, 0.0, top), 64)
    left = space.volume() - sum((space ^ one).volume() for one in (*layers, *assembled))
    grid = 8 * made.size.rim * 25.0 / 1024 / 2  # corners lie on 1/1024 mm, the taper of the tray between them
    assert left == pytest.approx(0, abs=grid / 2)
    side = [2 * made.size.inner, 2 * made.size.rim]
    frustum = 25.0 / 3 * (side[0] ** 2 + side[0] * side[1] + side[1] ** 2)
    assert made.volumes_mm3 == pytest.approx((side[1] ** 2 * 1.5, side[1] ** 2 * 4.0, frustum), rel=1e-5)


def test_the_grams_are_the_volumes_and_the_thinner_the_recipe():
    made = _skin()
    pours = phantom_command.pours(made)
    assert [pour.layer.name for pour in pours] == ["muscle", "hypodermis", "skin"]
    for pour, volume in zip(pours, reversed(made.volumes_mm3), strict=True):
        box = volume * pour.recipe.density_g_cm3 / 1e3
        assert pour.thinner_g / (pour.part_a_g + pour.part_b_g) == pytest.approx(pour.layer.thinner_pct / 100)
        assert pour.part_a_g == pytest.approx(pour.part_b_g)
        assert pour.part_a_g + pour.part_b_g + pour.thinner_g == pytest.approx(1.1 * box)
        assert pour.grams_per_mm * pour.layer.thickness_mm == pytest.approx(box)


def test_a_frame_off_the_printer_s_layers_is_named_with_layers_that_fit():
    """The skin's 1.5 mm are 7.5 layers of 0.2 mm, or 8 of 0.1875 mm; the others are whole."""
    text = phantom_command.casting_markdown(_skin())
    assert text.count("no whole number of") == 1
    assert "frame of the skin in layers of 0.1875 mm: 1.5 mm" in text


def test_the_folder_prints_checks_and_goes_into_a_spec(tmp_path):
    done = CliRunner().invoke(app, ["phantom", "-o", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    folder = Path(found["folder"])
    assert found["findings"] == []
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    pieces = {f"moulds/{n}.stl" for n in ("tray", "frame2", "frame3", "lid", "blade")}
    pages = {"casting.md", "tissue.toml", "response.json", "section.svg"}
    assert names == pieces | pages | {"moulds/moulds.3mf"}
    casting = (folder / "casting.md").read_text("utf-8")
    assert "repeatable, not skin-like" in casting
    assert json.loads((folder / "response.json").read_text("utf-8"))["value"] == pytest.approx(
        found["response"]["value"], abs=1e-5
    )
    tissue = tomllib.loads((folder / "tissue.toml").read_text("utf-8"))["tissue"]
    spec = load("embedded", {"tissue": tissue, "estimate.tissue": "phantom-skin"})
    layered = estimate_spec(spec, ["rule"])["layered"]
    assert layered["tissue"] == "phantom-skin"
    axial = layered["drives"]["axial"]
    value = axial["u_z"]["value"]
    assert value[30] / value[0] == pytest.approx(found["response"]["value"][-1], rel=1e-2)
    again = phantom_command.contents(_skin())
    assert all((folder / name).read_bytes() == content for name, content in again.items())


@pytest.mark.parametrize(
    ("changed", "field", "part"),
    [
        ({"printer": "sla"}, "printer", "the bed"),
        ({"printer": "fdm"}, "printer", "closest"),
        ({"layers": [{**LAYERS[0], "thinner_pct": 40.0}]}, "layers.0.thinner_pct", "25"),
        ({"layers": [{**LAYERS[0], "silicone": "dragon-skin-30"}]}, "layers.0.silicone", "unknown name"),
        ({"layers": [LAYERS[0], LAYERS[0]]}, "layers", "name of its own"),
        ({"layers": [{**LAYERS[0], "thickness_mm": 0.1}]}, "layers.0.thickness_mm", "0.5"),
        ({"most_echo_pct": 0.1}, "most_echo_pct", "0.5"),
        ({"room_c": 23.0}, "room_c", "unknown key"),
        (
            {"name": "Our Phantom"},
            "name",
            "a to z, digits and -, the first a letter or digit; nearest accepted: 'our-phantom'",
        ),
        ({"points_mm": [0.0, 5.0, 8.0]}, "points_mm", "5 and 8 are nearer than 3.5 mm"),
    ],
)
def test_what_can_not_be_is_refused(changed, field, part):
    with pytest.raises(Refusal) as refused:
        _made(**changed)
    assert refused.value.field == field
    assert part in str(refused.value)


def test_a_refused_phantom_leaves_no_folder(tmp_path):
    file = tmp_path / "p.toml"
    file.write_text(shipped_files("phantoms")["skin"].read_text("utf-8").replace('"fdm-0.4"', '"sla"'), "utf-8")
    with pytest.raises(Refusal, match="known: skin"):
        load_phantom("nope")
    done = CliRunner().invoke(app, ["phantom", str(file), "-o", str(tmp_path / "out")])
    assert isinstance(done.exception, Refusal)
    assert not (tmp_path / "out").exists()


def test_a_frame_is_exact():
    lengths = _skin().size
    frame = next(b for b in _skin().tools if b.name == "frame3")
    ears = 4 * 14.0 * 18.0 - 4 * math.pi * lengths.hole**2
    ring = 4 * (lengths.outer**2 - lengths.rim**2)
    assert realise(frame.shape, 256).volume() == pytest.approx(1.5 * (ring + ears), rel=1e-5)


def test_the_bill_has_what_the_procedure_asks_for():
    text = phantom_command.casting_markdown(_skin()).split("## Buy and have ready")[0].lower()
    bill = {item: note for item, _, note in phantom_command.bill(_skin())}
    items = " ".join(f"{item} {note}" for item, note in bill.items()).lower()
    for asked in ("tape", "clips", "pen", "emery paper", "primer", "degas", "talc", "calliper", "blade"):
        assert asked in text or asked == "calliper", asked
        assert asked in items, asked
    assert bill["silicone primer"].startswith("optional")
    quantities = {item: quantity for item, quantity, _ in phantom_command.bill(_skin())}
    assert quantities["ecoflex-00-10"] == "167.4 g of A, 167.4 g of B"


def test_the_first_layer_is_struck_off_at_the_tray_and_the_others_at_frames():
    """The bench sheet has an empty row for each pour."""
    pours, sheet = (
        phantom_command.casting_markdown(_skin()).split(f"## {title}")[1].split("\n## ")[0]
        for title in ("Pours", "Bench sheet")
    )
    rows = [line.split(" | ")[1:3] for line in pours.splitlines() if line.startswith("| ")][2:]
    assert rows == [["muscle", "the tray's rim, 25 mm"], ["hypodermis", "frame 2, 4 mm"], ["skin", "frame 3, 1.5 mm"]]
    assert [line for line in sheet.splitlines() if "|  |" in line] == [f"| {i}{' | ' * 10} |" for i in (1, 2, 3)]


@pytest.mark.parametrize("diameter", [4.0, 40.0])
def test_the_lid_has_a_seat_and_a_hole_for_each_point(diameter):
    """Each hole is a cylinder of 1.25 mm; those that meet the seat are cut with it."""
    made = phantom_set(replace(load_phantom("skin"), unit_diameter_mm=diameter, points_mm=(2.5, 6.25, 30.0)))
    (body,) = [one for one in made.tools if one.name == "lid"]
    lid = realise(body.shape, 64)
    low, high = bounds(lid)[2], bounds(lid)[5]
    radius = diameter / 2
    through = [
        cylinder(radius, low, high),
        *(moved(cylinder(1.25, low, high), radius + d, 0.0) for d in (2.5, 6.25, 30)),
    ]
    assert (realise(union(through), 64) ^ lid).volume() == pytest.approx(0.0, abs=1e-6)
    middle = realise(box(-radius - 5, radius + 35, -radius - 5, radius + 5, low, high), 64)
    assert (middle - lid).volume() == pytest.approx(realise(union(through), 64).volume(), rel=1e-6)

"""PrusaSlicer as a real client: it takes every tool without a repair."""

import math
import re
from collections import Counter

import prusa
import pytest
from faulty_sets import set_of

from unitcad.casting import coupon, figures
from unitcad.casting.plates import mould_plates
from unitcad.casting.preparation import slicer_settings
from unitcad.catalogue import printers
from unitcad.export import printing
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.cup import SLOPE, ribs
from unitcad.pipeline.plan import threemf_content
from unitcad.validation import templates

pytestmark = prusa.MARKS


SETS = [(name,) for name in sorted(templates())] + [
    ("encapsulating", "moulds.cavities=[2,3]"),
    ("encapsulating", "moulds.pour=injected"),
]


def written(folder, *source):
    moulds = set_of(*source)
    files = []
    for tool in moulds.plan.tools:
        if tool.made == "printed":
            ready = print_ready(*arrays(realise(tool.shape, moulds.segments)), tool.upside_down)
            files.append(folder / f"{tool.name}.stl")
            files[-1].write_bytes(printing.stl(*ready, tool.name))
    return files


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_no_tool_needs_a_repair(source, tmp_path):
    files = written(tmp_path, *source)
    assert len(files) >= 3
    assert [file.name for file in files if prusa.needs_repair(file)] == []


@pytest.mark.parametrize("source", [("embedded",), ("three-layer",), ("encapsulating", "moulds.printer=fdm-0.25")])
def test_the_slicers_time_is_within_the_range_that_the_procedure_says(source, tmp_path):
    moulds, files = set_of(*source), written(tmp_path, *source)
    printer = printers()[moulds.spec.moulds.printer]
    taken = sum(prusa.print_minutes(file, printer, file.with_suffix(".gcode")) for file in files)
    solid = sum(moulds.solids[tool.name].volume() for tool in moulds.plan.tools if tool.made == "printed")
    low, high = figures.FDM_ERROR
    assert low <= taken / figures.print_min(moulds.spec, solid, 0.0) <= high


@pytest.mark.smoke
def test_a_broken_mesh_needs_one(tmp_path):
    """A facet left out: the check sees what it should."""
    content = written(tmp_path, "single-embedded")[0].read_bytes()
    count = int.from_bytes(content[80:84], "little") - 1
    broken = tmp_path / "broken.stl"
    broken.write_bytes(content[:80] + count.to_bytes(4, "little") + content[84 : 84 + 50 * count])
    assert prusa.needs_repair(broken)


@pytest.mark.smoke
@pytest.mark.parametrize("name", ["fdm-0.4", "fdm-0.25"])
def test_the_slicer_draws_a_cup_s_ribs(name, tmp_path):
    """The outer edge of the extruded lines, halfway up the crests, reaches into the plinth by the interference."""
    moulds = set_of("encapsulating", f"moulds.printer={name}")
    layer, (rib, *_) = moulds.spec.moulds.layer_mm, ribs(moulds.frame)
    cup = moulds.plan.tool("cup1")
    file, code = tmp_path / "cup.stl", tmp_path / "cup.gcode"
    file.write_bytes(printing.stl(*print_ready(*arrays(moulds.solids["cup1"]), cup.upside_down), "cup"))
    nozzle = float(printers()[name].nozzle_mm)
    heights = ("--layer-height", f"{layer:g}", "--first-layer-height", f"{layer:g}")
    prusa.run("--export-gcode", "--output", str(code), "--nozzle-diameter", f"{nozzle:g}", *heights, str(file))
    middle = (rib.bottom + rib.top) / 2
    height = math.ceil((moulds.dimensions.heights[0] - middle) / layer) * layer
    edges, kind, width, z = [], "", 0.0, 0.0
    for line in code.read_text().splitlines():
        key, _, value = line.partition(":")
        if key == ";TYPE":
            kind = value
        elif key == ";WIDTH":
            width = float(value)
        elif key == ";Z":
            z = float(value)
        elif kind == "External perimeter" and abs(z - height) < 1e-6:
            edges += [(float(x), float(y), width) for x, y in re.findall(r"^G1 X([\d.]+) Y([\d.]+)", line)]
    centre = [(min(e[i] for e in edges) + max(e[i] for e in edges)) / 2 for i in (0, 1)]
    # Lines along the recess: nearer to the middle than its wall, farther than the bore.
    face = abs(rib.x) - middle * SLOPE
    near = [abs(x - centre[0]) - width / 2 for x, y, width in edges if abs(abs(y - centre[1]) - abs(rib.y)) < 0.4]
    tips = [at for at in near if abs(at - face) < 0.5]
    assert face - min(tips) == pytest.approx(moulds.spec.moulds.rib_interference_mm, abs=0.01)


def test_coupon_needs_no_repair(tmp_path):
    for body in coupon.Coupon(printers()["fdm-0.4"]).bodies():
        file = tmp_path / f"{body.name}.stl"
        file.write_bytes(printing.stl(*print_ready(*arrays(realise(body.shape, 64))), body.name))
        assert not prusa.needs_repair(file)


def test_no_setting_of_an_object_carries_the_first_layer(tmp_path):
    """What docs/how-to/print-and-cast.md says of PrusaSlicer: the plate's layers start where the user's setting does."""
    moulds = set_of("encapsulating")
    (plate,) = mould_plates(moulds).values()
    file, code = tmp_path / "plate.3mf", tmp_path / "plate.gcode"

    def first(settings, *options):
        file.write_bytes(threemf_content(moulds, plate, settings))
        prusa.run("--export-gcode", *options, "--output", code, file)
        return [float(z) for z in re.findall(r"^;Z:([\d.]+)$", code.read_text(), re.M)[:2]]

    ours = slicer_settings(moulds)
    assert first({**ours, "first_layer_height": "0.2"}) == [0.35, 0.55], "if this is 0.2, write the setting"
    assert first(ours, "--first-layer-height", "0.2") == [0.2, 0.4]


def test_the_plate_s_settings_replace_those_of_the_user(tmp_path):
    """Sliced with other settings of the user, the plate has the layers and filament of the sheet's settings."""
    moulds = set_of("encapsulating")
    (plate,) = mould_plates(moulds).values()
    ours, theirs = slicer_settings(moulds), "--perimeters 1 --fill-density 5% --layer-height 0.15 --support-material"
    asked = [part for key, value in ours.items() for part in (f"--{key.replace('_', '-')}", value)][:-2]
    codes = []
    for settings, options in ((ours, theirs.split()), ({}, asked), ({}, theirs.split())):
        file, code = tmp_path / "plate.3mf", tmp_path / "plate.gcode"
        file.write_bytes(threemf_content(moulds, plate, settings))
        plain = ("--export-gcode", "--gcode-label-objects", "--skirts", "0", "--first-layer-height", "0.2")
        prusa.run(*plain, *options, "--output", code, file)
        codes.append(code.read_text())
    mine, same, other = (float(prusa.value(code, "filament used [mm]")) for code in codes)
    assert mine == pytest.approx(same, rel=2e-3)
    assert abs(other / same - 1) > 0.1
    begun = Counter(re.findall(r"^; printing object (\w+) id", codes[0], re.M))
    for body in plate:
        z0, z1 = (moulds.mesh_of(body.shape).bounding_box()[i] for i in (2, 5))
        copies = 2 if body.kind == "tongue" else 1
        assert begun[body.kind if copies > 1 else body.name] / copies == math.ceil(
            (z1 - z0) / 0.2 - 0.5
        )  # cut at its middle
    assert ";TYPE:Support material" not in codes[0]
    assert ";TYPE:Support material" in codes[2]

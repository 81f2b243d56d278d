"""An array's folder: complete, the same bytes again, built again from its own array.toml."""

import base64
import gzip
import io
import json
import re
import shutil

import numpy as np
import pytest
import trimesh
from casting_rules import broken_rules

from tests.arrays.made_arrays import pockets_cast
from tests.report.test_glb import chunks
from unitcad.arrays.array_file import array_hash, load_array
from unitcad.arrays.array_page import patch_glb, write_array_page
from unitcad.arrays.arrayed import Arrayed
from unitcad.arrays.patch import patch_bodies, patch_moulds, patch_parts
from unitcad.cache import MemoryStore
from unitcad.casting.steps import casting_summary, duration
from unitcad.casting.views import picture_path, views
from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import realise
from unitcad.pipeline.make import make
from unitcad.pipeline.result import Progress
from unitcad.pipeline.write import build as build_array
from unitcad.report.bench_page import write_bench
from unitcad.serve.answers import answered
from unitcad.serve.messages import Ask, Trusted
from unitcad.shape.lettering import seen

SMALL = [
    "layout.columns=2",
    "layout.rows=1",
    "moulds.cavities=[1, 1]",
    'output.formats=["stl", "3mf", "glb"]',
    "sheet.strap_slot_mm=[3, 8]",
]


STORE = MemoryStore()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    built = build_array(load_array("forearm-pockets", SMALL), tmp_path_factory.mktemp("out"), store=STORE)
    assert built.ok
    return built.folder


def _contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != "timings.json")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_the_live_page_says_what_the_procedure_says(folder):
    told = answered(Ask(what="moulds", text=(folder / "array.toml").read_text("utf-8")), Trusted([]))
    assert told.lines[0] == "Unit encapsulating comes out 4.6 mm high (drawn 4.61), caps 1.2 and 1.2."
    assert told.lines[1:-1] == [*casting_summary(json.loads((folder / "casting.json").read_bytes()))]


def test_the_folder_holds_units_patch_tools_and_procedure(folder):
    there = set(_contents(folder))
    assert there >= {
        "array.toml", "manifest.json", "casting.md", "casting.json", "bom.csv", "step1-section.svg",
        "moulds/base.stl", "moulds/blade.stl", "moulds/moulds.3mf", "patch/layer1.stl", "patch/patch.glb",
        "units/encapsulating/spec.toml", "units/encapsulating/unit.3mf", "units/encapsulating/moulds/step1-cup.stl",
        "crosstalk.json", "crosstalk.csv", "crosstalk.svg", "crosstalk-patch.svg",
        "pictures/patch-skin-side.png", "pictures/tools.png", "pictures/pour1.png",
    }  # fmt: skip
    manifest = json.loads((folder / "manifest.json").read_text())
    assert set(manifest["files"]) == there - {"manifest.json"}
    assert [place["name"] for place in manifest["array"]["places"]] == ["A1", "A2"]
    assert all(finding["ok"] for finding in manifest["mould_checks"])
    assert manifest["check"]["findings"] == []


def test_the_manifest_says_that_the_sheet_is_as_cast(folder):
    """Its pockets are as narrow as cast; in the assembly they are stretched round the units."""
    parts = {part["name"]: part for part in json.loads((folder / "manifest.json").read_text())["parts"]}
    (sheet,) = [part for part in patch_parts(load_array("forearm-pockets", SMALL)) if part.name == "sheet"]
    stretched = realise(sheet.body.shape, 96).volume()
    assert parts["layer1"]["state"].startswith("as cast")
    assert parts["layer1"]["volume_mm3"] > 1.005 * stretched
    assert [name for name, part in parts.items() if "state" in part] == ["layer1"]


def test_the_bill_of_pockets_lists_what_units_and_sheet_use_up():
    """Nine units in two cavities: five castings of two pours each, then the sheet's pour."""
    array = load_array("forearm-pockets", ["moulds.cavities=[2, 1]"])
    unit, made = pockets_cast(array)
    used = {item.item: item.quantity for item in made.bill}
    assert (used["gloves"], used["mixing cups and sticks"]) == (5 * 2 + 1, 5 * 2 + 1)
    strips = next(item.quantity for item in unit.bill if item.item == "adhesive tape")
    assert used["adhesive tape"] == 5 * strips
    (container,) = [item for item in made.bill if "degassing" in item.item]
    asked = [
        figure.value
        for pour in (*unit.pours, *made.pours)
        for figure in pour.figures
        if figure.name == "degassing container, at least"
    ]
    assert (container.quantity, container.made) == (1, "tool")
    assert container.least_ml == pytest.approx(max(asked), rel=0.05)
    assert broken_rules(made) == []
    steps = [*made.preparation, *made.pours[0].steps, *made.release, *made.assembly]
    drawn = {step.picture for step in steps} - {""}
    assert drawn == {picture_path(name) for name in views(patch_moulds(array))}
    assert "tray" in {item.item for item in made.bill}
    assert f"engraved b{seen(made.label)}" in " ".join(step.text for step in steps)


def test_a_page_has_no_file_of_another_folder(folder, tmp_path):
    """A manifest may come from others: a path in it leads nowhere else."""
    copy = tmp_path / "out" / "array"
    shutil.copytree(folder, copy)
    secret = '<svg xmlns="http://www.w3.org/2000/svg"><text>secret</text></svg>'
    (tmp_path / "out" / "secret.svg").write_text(secret)
    manifest = json.loads((copy / "manifest.json").read_text("utf-8"))
    manifest["pictures"] = ["../secret.svg"]
    (copy / "manifest.json").write_text(json.dumps(manifest))
    assert base64.b64encode(secret.encode()).decode() not in write_array_page(copy, print).read_text("utf-8")


def test_the_bench_page_speaks_of_the_sheet(folder):
    page = write_bench(folder)
    packed = re.search(r'id="data">([A-Za-z0-9+/=]*)</script>', page.read_text("utf-8"))
    page.unlink()
    content = json.loads(gzip.decompress(base64.b64decode(packed[1])))
    assert (content["casting"]["makes"], content["casting"]["last"]) == ("sheet", "Units in")
    wanted = {f"steps/{name}.png" for name in ("pieces", "pour", "strike", "filled", "peel", "units-in")}
    assert wanted <= set(content["pictures"])


def test_a_blade_that_no_bed_takes_is_a_bar_of_metal():
    rows = {"layout.columns": 2, "layout.rows": 7, "moulds.bed_x_mm": 112, "moulds.bed_y_mm": 112}
    array = load_array("forearm-pockets", {**rows, "moulds.cavities": [1, 1]})
    _, made = pockets_cast(array)
    assert [(item.made, "bar of metal" in item.note) for item in made.bill if item.item == "blade"] == [
        ("printed upside down", False),
        ("tool", True),
    ]
    assert "upside down" not in made.printing.how[0]


def test_the_sheet_of_injected_units_is_struck_off_without_a_syringe():
    unit, made = pockets_cast(load_array("forearm-pockets", ["moulds.pour=injected"]))
    syringes = [next(item.quantity for item in each.bill if item.item == "syringe") for each in (unit, made)]
    assert syringes == [2, 2]
    assert not any("syringe" in figure.name for figure in made.pours[0].figures)


@pytest.mark.parametrize(("count", "words"), [(1, "one casting in"), (2, "2 castings, one after the other, in")])
def test_the_units_take_the_time_of_their_whole_time_line(count, words):
    """Two units, two cavities or one: the motors' time counts at the bench and in all, in words and in numbers."""
    array = load_array("forearm-pockets", [*SMALL, f"moulds.cavities=[{3 - count}, 1]"])
    unit, made = pockets_cast(array)
    (step,) = [step for step in made.preparation if step.title == "Cast the units"]
    bench, whole = sum(phase.bench_min for phase in unit.time_line), unit.time_line[-1].end_min
    assert bench > unit.bench_min
    assert (step.minutes, step.minutes + step.wait_min) == (count * bench, count * whole)
    take = f"{'takes' if count == 1 else 'take'} {duration(count * whole)}, of which {duration(count * bench)} at"
    assert words in step.text
    assert take in step.text


def test_the_sheet_is_cast_while_the_units_first_pour_cures():
    """One casting of two units: Layer 1 cures for 4 h, in which the sheet is poured; neither waits for the other."""
    array = load_array("forearm-pockets", [*SMALL, "moulds.cavities=[2, 1]"])
    unit, made = pockets_cast(array)
    phases = {phase.name: phase for phase in made.time_line}
    first = next(phase for phase in unit.time_line if phase.name == "pour 1")
    begin = first.end_min - 60 * unit.pours[0].cure_h
    assert phases["sheet: preparation"].start_min == pytest.approx(begin)
    assert phases["sheet: pour"].start_min + phases["sheet: pour"].bench_min < first.end_min
    ends = phases["units"].end_min, phases["sheet: out of the mould"].end_min
    assert made.earliest_finish_min == pytest.approx(max(ends)) == pytest.approx(phases["units in"].start_min)
    assert made.bench_min == pytest.approx(sum(phase.bench_min for phase in made.time_line[:-1]))
    assert f"while their first pour cures, {duration(begin)} from now" in made.preparation[0].text


def test_the_same_input_gives_the_same_bytes_from_its_own_file(folder, tmp_path):
    assert load_array(folder / "array.toml") == load_array("forearm-pockets", SMALL)
    again = build_array(load_array(folder / "array.toml"), tmp_path)
    assert again.folder.name == folder.name
    assert _contents(again.folder) == _contents(folder)


def test_arrays_that_differ_only_in_their_places_share_no_moulds_in_a_store():
    store, trays = MemoryStore(), []
    for pitch in (20, 22):
        array = load_array("forearm-pockets", [*SMALL, f"layout.pitch_mm={pitch}"])
        (base, *_) = make(Arrayed(array), ("moulds",), False, store, Progress()).manifest["parts"]
        trays.append(base["bbox_mm"][3] - base["bbox_mm"][0])
    assert trays[1] - trays[0] == pytest.approx(2)


def test_the_hash_follows_the_array_and_not_its_name():
    array = load_array("forearm-pockets")
    assert array_hash(load_array("forearm-pockets", ["name='other'", "output.formats=['stl']"])) == array_hash(array)
    assert array_hash(load_array("forearm-pockets", ["sheet.margin_mm=4"])) != array_hash(array)
    assert array_hash(load_array("forearm-pockets", ["unit.diameter_mm=14.5"])) != array_hash(array)


def test_the_procedure_names_every_place_and_weighs_all_units(folder):
    casting = json.loads((folder / "casting.json").read_text())
    (together,) = casting["assembly"]
    for place in load_array("forearm-pockets", SMALL).places:
        assert place.name in together["text"]
    bill = {item["item"]: item["quantity"] for item in casting["bill"]}
    motor = load_array("forearm-pockets").unit.motor.part
    assert bill[motor] == bill["flexible circuit"] == 2
    unit = json.loads((folder / "units/encapsulating/casting.json").read_text())
    inner = sum(p["part_a_g"] for p in unit["pours"] if p["material"] == "ecoflex-00-10")
    assert bill["ecoflex-00-10 part A"] == pytest.approx(2 * inner)
    assert casting["earliest_finish_min"] > 2 * unit["earliest_finish_min"]
    text = (folder / "casting.md").read_text("utf-8")
    assert "## Silicone stays tacky" in (folder / "troubleshooting.md").read_text("utf-8")
    assert f"- at {duration(casting['earliest_finish_min'])}: units in (" in text, "not when the sheet is out"


def test_a_back_sheet_is_written_as_step(tmp_path):
    """The inner layers of all units are one body of as many solids, and both colours come back on all of them."""
    pytest.importorskip("unitcad.export.step", exc_type=UnitcadError)
    import step_reader

    asked = ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3, 8]", 'output.formats=["step"]']
    array = load_array("forearm-patch", asked)
    built = build_array(array, tmp_path, only=("unit",), store=STORE)
    layer1, sheet, *others = step_reader.read(built.folder / "patch" / "patch.step")
    bodies = patch_bodies(array)
    assert [layer1.name, sheet.name, *(body.name for body in others)] == [body.name for body in bodies]
    assert (layer1.measures.solids, sheet.measures.solids) == (2, 1)
    for back, body in zip((layer1, sheet), bodies, strict=False):
        assert back.colour == pytest.approx(body.colour, abs=1e-6)
        assert back.measures.volume == pytest.approx(realise(body.shape, 720).volume(), rel=1e-4)


def test_a_unit_s_bodies_are_in_a_patch_once_and_stand_at_every_place():
    turned = {"kind": "list", "points_mm": [[-20.5, 1], [2, 3], [30, -4]]}
    places = [{"at": "P2", "angle_deg": 37.5}]
    array = load_array("forearm-pockets", {"layout": turned, "place": places, "sheet.strap_slot_mm": [3, 8]})
    moulds = patch_moulds(array).blank
    content = patch_glb(moulds, patch_parts(array))
    document, _ = chunks(content)
    names = [mesh["name"] for mesh in document["meshes"]]
    assert names == ["sheet", "layer1", "layer2", "motor", "fpcb"]
    scene = trimesh.load(io.BytesIO(content), file_type="glb")
    bodies = patch_bodies(array)
    assert sorted(node["name"] for node in document["nodes"][1:]) == sorted(body.name for body in bodies)
    for body in bodies:
        matrix, name = scene.graph.get(body.name)
        mesh = scene.geometry[name].copy().apply_transform(matrix)
        x0, y0, z0, x1, y1, z1 = moulds.mesh(body).bounding_box()
        assert mesh.bounds * 1e3 == pytest.approx(np.array([[x0, z0, -y1], [x1, z1, -y0]]), abs=1e-4)

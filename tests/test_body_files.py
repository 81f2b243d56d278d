"""A file of bodies as a design: STEP, STL and 3MF, their moulds, and what is refused."""

import math
import zipfile

import numpy as np
import pytest

from unitcad.checks import check_moulds
from unitcad.designs import unit_bodies
from unitcad.errors import Refusal, UnitcadError
from unitcad.export import printing
from unitcad.kernels import mesh
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.write import build
from unitcad.shape import Extrude, cut, cylinder, polygon
from unitcad.shape.tree import Body
from unitcad.spec.body_file import bodies_in
from unitcad.validation import load

LAYER = '[[layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 2.0\ncap_mm = 1.25\n'
CORNERS = ((1, 0), (0.5, 0.875), (-0.5, 0.875), (-1, 0), (-0.5, -0.875), (0.5, -0.875))
AREA = 2 * (1 + 0.5) * 0.875
"""Of the hexagon with these corners."""


def hexagon(radius, top):
    """Return an upright hexagonal prism, its corners on the grid."""
    return Extrude(polygon(*((radius * x, radius * y) for x, y in CORNERS)), 0, top)


MOTOR = cylinder(3.7, -1, 2)
INNER, OUTER = cut(hexagon(6.5, 3.25), [MOTOR]), cut(hexagon(8.5, 4.5), [MOTOR])


def spec_of(folder, design, layers=2, more=""):
    """Write a spec of a file of bodies."""
    text = f'name = "bodies"\ndesign = "{design}"\ndiameter_mm = 17.0\n{more}\n{LAYER * layers}'
    (folder / "spec.toml").write_text(text)
    return folder / "spec.toml"


def stl_of(shape):
    """Return a shape as STL."""
    return printing.stl(*arrays(realise(shape, 96)), "body")


def step_of(folder, **shapes):
    """Write shapes as STEP; returns the file's name."""
    pytest.importorskip("OCP")
    from unitcad.export import step

    step.write(folder / "body.step", [Body(n, "unit", "layer", s, (1, 0, 0)) for n, s in shapes.items()], "unit")
    return "body.step"


def step_design(folder):
    return step_of(folder, layer2=OUTER, layer1=INNER)


RELS = """<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r1"
 Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"""
TYPES = """<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>"""
MODEL = """<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>{objects}</resources><build>{items}</build></model>"""


def threemf_design(folder):
    """Write a 3MF in centimetres, each object moved to its place by its item of the build."""
    objects, items = "", ""
    for i, (name, shape) in enumerate((("layer2", OUTER), ("layer1", INNER)), 1):
        vertices, faces = arrays(realise(shape, 96))
        corners = "".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>' for x, y, z in vertices / 10 - (1, 0, 0))
        sides = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
        mesh = f"<mesh><vertices>{corners}</vertices><triangles>{sides}</triangles></mesh>"
        objects += f'<object id="{i}" type="model" name="{name}">{mesh}</object>'
        items += f'<item objectid="{i}" transform="1 0 0 0 1 0 0 0 1 1 0 0"/>'
    with zipfile.ZipFile(folder / "body.3mf", "w") as package:
        package.writestr("[Content_Types].xml", TYPES)
        package.writestr("_rels/.rels", RELS)
        package.writestr("3D/3dmodel.model", MODEL.format(unit="centimeter", objects=objects, items=items))
    return "body.3mf"


@pytest.mark.parametrize("written", [step_design, threemf_design])
def test_bodies_by_name_get_moulds_that_keep_every_check(written, tmp_path):
    moulds = MouldSet(load(spec_of(tmp_path, written(tmp_path))))
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    hole = math.pi * 3.7**2 * 2
    assert moulds.solids["layer1"].volume() == pytest.approx(AREA * 6.5**2 * 3.25 - hole, rel=2e-3)
    between = AREA * (8.5**2 * 4.5 - 6.5**2 * 3.25)  # the earlier layer is cut out of the later
    assert moulds.solids["layer2"].volume() == pytest.approx(between, rel=1e-6)


def test_bodies_without_such_names_are_layers_in_their_order(tmp_path):
    moulds = MouldSet(load(spec_of(tmp_path, step_of(tmp_path, Inner=INNER, Outer=OUTER))))
    assert [body.name for body in moulds.unit] == ["layer1", "layer2", "motor"]
    assert moulds.solids["layer1"].volume() < moulds.solids["layer2"].volume()


def test_a_motor_in_the_file_is_the_unit_s_motor(tmp_path):
    name = step_of(tmp_path, layer1=INNER, motor=cylinder(3.5, 0, 1.75))
    moulds = MouldSet(load(spec_of(tmp_path, name, layers=1)))
    (motor,) = [body for body in moulds.unit if body.kind == "motor"]
    assert motor.made == "bought"
    assert moulds.solids["motor"].volume() == pytest.approx(math.pi * 3.5**2 * 1.75, rel=5e-3)


def test_a_result_stands_alone(tmp_path):
    (tmp_path / "body.stl").write_bytes(stl_of(INNER))
    spec = load(spec_of(tmp_path, "body.stl", layers=1), {"output.formats": ["stl", "step"]})
    done = build(spec, tmp_path / "out")
    assert done.ok
    assert done.manifest["outputs"] == ["unit", "moulds", "estimate", "casting"]
    (tmp_path / "body.stl").unlink()
    again = build(load(done.folder / "spec.toml"), tmp_path / "again")
    assert again.manifest == done.manifest


def test_the_hash_is_of_the_geometry_alone(tmp_path):
    """Facets in another order give the same variant; a corner that moves by a hundredth gives another."""
    vertices, faces = arrays(realise(INNER, 96))
    texts = []
    rng = np.random.default_rng(1)
    for turned in (faces, np.roll(faces[rng.permutation(len(faces))], 1, axis=1)):
        (tmp_path / "body.stl").write_bytes(printing.stl(vertices, turned, "body"))
        texts.append(load(spec_of(tmp_path, "body.stl", layers=1)).design_source)
    (tmp_path / "body.stl").write_bytes(printing.stl(vertices * (1, 1, 1.01), faces, "body"))
    texts.append(load(spec_of(tmp_path, "body.stl", layers=1)).design_source)
    assert texts[0] == texts[1] != texts[2]


def test_a_step_body_s_facets_lie_within_the_stated_tolerance(tmp_path):
    spec = load(spec_of(tmp_path, step_of(tmp_path, layer1=cylinder(7, 0, 3)), layers=1))
    assert "facets within 0.01 mm" in str(spec.design_source)
    (held,) = bodies_in(spec.design, str(spec.design_source)).values()
    corners, faces = mesh.corners_and_faces(held)
    heights, radii = corners[:, 2], np.hypot(corners[:, 0], corners[:, 1])
    assert radii[radii > 1].min() > 7 - 0.001
    walls = [face for face in faces.astype(int) if np.ptp(heights[face]) > 1]
    level = [(a, b) for face in walls for a, b in zip(face, np.roll(face, 1), strict=True) if heights[a] == heights[b]]
    middles = [np.hypot(*(corners[a] + corners[b])[:2]) / 2 for a, b in level]
    assert 7 - 0.0105 < min(middles) < 7 - 0.001


def test_no_other_design_replaces_a_body_that_can_not_be_cast(tmp_path):
    (tmp_path / "body.stl").write_bytes(stl_of(cut(hexagon(9, 9), [cylinder(5, 2, 7)])))
    with pytest.raises(Refusal, match=r"is closed (in|all round)") as refused:
        load(spec_of(tmp_path, "body.stl", layers=1, more="motor = false"), (), lambda spec: MouldSet(spec).plan)
    assert refused.value.others == ()


def test_a_body_that_meets_the_motor_is_an_error(tmp_path):
    (tmp_path / "body.stl").write_bytes(stl_of(hexagon(6.5, 3.25)))
    done = build(load(spec_of(tmp_path, "body.stl", layers=1)), tmp_path / "out", only=("unit",))
    (finding,) = [finding for finding in done.manifest["mould_checks"] if not finding["ok"]]
    assert (finding["code"], finding["where"]) == ("C200", "unit: layer1 and motor")
    assert finding["value"] == pytest.approx(math.pi * 3.5**2 * 2, rel=1e-3)
    assert "room for the motor of 7 x 2 mm" in finding["advice"]
    assert finding["advice"].endswith("motor = false")
    without = load(spec_of(tmp_path, "body.stl", layers=1, more="motor = false"))
    done = build(without, tmp_path / "without", only=("unit", "moulds", "casting"))
    assert done.ok
    assert [body.name for body in unit_bodies(without)] == ["layer1"]
    assert "motor" not in (done.folder / "casting.md").read_text().lower()
    assert load(done.folder / "spec.toml") == without


@pytest.mark.parametrize(("facets", "passes"), [(24, True), (16, False)])
def test_a_pocket_that_only_its_facets_make_narrow_passes_with_a_note(facets, passes, tmp_path):
    """The middles of a pocket's facets are 3.5 (1 - cos(pi / facets)) mm inside the motor: 0.03, or 0.067 mm."""
    turns = [2 * math.pi * i / facets for i in range(facets)]
    pocket = Extrude(polygon(*((3.5 * math.cos(a), 3.5 * math.sin(a)) for a in turns)), -1, 2)
    (tmp_path / "body.stl").write_bytes(stl_of(cut(hexagon(6.5, 3.25), [pocket])))
    done = build(load(spec_of(tmp_path, "body.stl", layers=1)), tmp_path / "out", only=("unit",))
    (finding,) = done.manifest["mould_checks"]
    polygon_area = facets / 2 * 3.5**2 * math.sin(2 * math.pi / facets)
    assert finding["value"] == pytest.approx(2 * (math.pi * 3.5**2 - polygon_area), rel=0.01)
    assert (finding["ok"], "gives way" in finding["advice"]) == (passes, passes)


@pytest.mark.parametrize(
    ("template", "change", "why"),
    [
        ("embedded", "motor=false", "motor = false: the design embedded is drawn round one"),
        ("custom/strap-lugs", "motor=true", "motor = true: takes a table, or false for none"),
        ("custom/strap-lugs", "motor=false", "(fpcb|wires): leads to a motor, and motor = false"),
    ],
)
def test_a_unit_without_a_motor_is_a_custom_design_without_circuit(template, change, why):
    with pytest.raises(Refusal, match=why):
        load(template, [change])


def _open(vertices, faces):
    return printing.stl(vertices, faces[:-1], "body")


def _inverted(vertices, faces):
    return printing.stl(vertices, faces[:, ::-1], "body")


def _inches(vertices, faces):
    return printing.stl(vertices / 25.4, faces, "body")


def _huge(vertices, faces):
    return printing.stl(*arrays(realise(cylinder(7, 0, 3), 11000)), "body")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (_open, "body.stl': T001: "),
        (_inverted, "body.stl': T008: "),
        (_inches, "body.stl': S001: .* if inches"),
        (_huge, "has [0-9]+ triangles, 40000 at most; make it coarser"),
        (lambda vertices, faces: b"", "F001: the file is empty"),
        (lambda vertices, faces: b"solid x\nfacet", "body.stl': F00"),
        (lambda vertices, faces: b"ISO-10303-21;", "F005: named .stl, but the content is STEP"),
    ],
)
def test_a_bad_file_is_refused_with_the_finding_s_code(content, why, tmp_path):
    scale = 0.05 if content is _inches else 1.0
    (tmp_path / "body.stl").write_bytes(content(arrays(realise(INNER, 96))[0] * scale, arrays(realise(INNER, 96))[1]))
    with pytest.raises(Refusal, match=f"design = '{why}" if why.startswith("body") else why) as refused:
        load(spec_of(tmp_path, "body.stl", layers=1))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("design", "why"),
    [
        ("missing.step", "missing.step: no such file"),
        ("../away/body.stl", "no such file"),
        ("folder.stl", "directory|regular"),
    ],
)
def test_a_file_that_is_not_there_is_one_sentence(design, why, tmp_path):
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(Refusal, match=why):
        load(spec_of(tmp_path, design, layers=1))


def test_what_goes_with_no_body_is_refused(tmp_path):
    (tmp_path / "body.stl").write_bytes(stl_of(INNER))
    with pytest.raises(Refusal, match=r"parameters.*nothing reads them"):
        load(spec_of(tmp_path, "body.stl", layers=1), {"parameters.wall": 1.0})
    with pytest.raises(Refusal, match=r"needs? each of the spec's 2 \[\[layers\]\] drawn"):
        _ = MouldSet(load(spec_of(tmp_path, "body.stl", layers=2))).plan
    spec = load(spec_of(tmp_path, "body.stl", layers=1))
    for damaged in ("", "unitcad bodies 1\nlayer1 AAAA AAAA\n", str(spec.design_source)[:-40]):
        with pytest.raises(UnitcadError, match=r"design_source is damaged|is required"):
            build(load(spec, {"design_source": damaged}), tmp_path / "out", only=("unit",))


def test_a_layer_without_a_silicone_is_no_printed_part(tmp_path):
    """A body that is named as a layer is silicone; the spec says which, or is refused."""
    spec = load(spec_of(tmp_path, threemf_design(tmp_path), layers=1))
    with pytest.raises(Refusal, match=r"layers = 1: .* has the body layer2, and the spec has no \[\[layers\]\] table"):
        build(spec, tmp_path / "out", only=("unit",))
    flex = load(spec_of(tmp_path, step_of(tmp_path, layer1=INNER, fpcb=cylinder(3.5, 2, 2.1)), layers=1))
    with pytest.raises(Refusal, match=r"fpcb: .* has the body fpcb, and the spec has no \[fpcb\] table"):
        build(flex, tmp_path / "out", only=("unit",))
    more = load(spec_of(tmp_path, "body.3mf", layers=2))
    assert [body.made for body in unit_bodies(more)] == ["cast", "cast", "bought"]

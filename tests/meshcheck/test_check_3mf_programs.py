"""3MF as programs write it: exports of theirs, and what BambuStudio and Cura put into a package."""

import shutil
import subprocess
from pathlib import Path

import pytest
from shapes import PNG, PRODUCTION, START, THUMBNAIL, box, mesh_xml, model_xml, package, rels_xml, text_stl

from unitcad.meshcheck import Options, check_file

PROGRAMS = Path(__file__).parent.parent / "corpus" / "programs"
OBJECT = f'<object id="1">{mesh_xml()}</object>'
UUID = "00010000-81cb-4c03-9d28-80fed5dfa1dc"
COLORS = '<m:colorgroup id="2"><m:color color="#FF0000"/></m:colorgroup>'
PAINTED, COLORED = 'paint_color="4"', 'pid="2" p1="0"'


@pytest.mark.parametrize("path", sorted(PROGRAMS.glob("*.3mf")), ids=lambda path: path.stem)
def test_an_export_passes(path):
    report = check_file(path)
    assert report.verdict in ("pass", "warning"), report.findings
    assert {found.code for found in report.findings} <= {"P002", "P017"}
    assert report.facts.watertight


@pytest.mark.smoke
@pytest.mark.slicer
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="PrusaSlicer is not installed")
def test_what_prusaslicer_exports_now_passes(tmp_path):
    (tmp_path / "a.stl").write_text(text_stl(box()))
    (tmp_path / "b.stl").write_text(text_stl(box((20, 5, 5))))
    command = ["prusa-slicer", "--export-3mf", "--merge", "a.stl", "b.stl", "-o", "c.3mf"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=100)
    report = check_file(tmp_path / "c.3mf")
    assert report.verdict != "error"
    assert report.facts.volume_mm3 == pytest.approx(1500)
    assert check_file(tmp_path / "c.3mf", Options(strict_3mf=True)).verdict == "error"


LENIENT = {
    "P017 attribute": package(model_xml(OBJECT, '<build><item objectid="1" printable="1"/></build>')),
    "P017 paint": package(model_xml(f'<object id="1">{mesh_xml(per_face=PAINTED)}</object>')),
    "P017 metadata": package(model_xml(before=2 * '<metadata name="Title">a</metadata>')),
    "P002 thumbnail": package(rels=rels_xml((START, "/3D/3dmodel.model"), (THUMBNAIL, "/Metadata/thumbnail.png"))),
    "P019 default": package(model_xml(f'{COLORS}<object id="1">{mesh_xml(per_face=COLORED)}</object>')),
    "P019 components": package(model_xml(
        f'{COLORS}{OBJECT}<object id="3" pid="2"><components><component objectid="1"/></components></object>',
        '<build><item objectid="3"/></build>')),
}  # fmt: skip


@pytest.mark.parametrize("name", LENIENT)
def test_what_common_programs_write_is_an_error_only_where_strictness_is_asked_for(name, judge):
    usual = "info" if name in ("P017 attribute", "P017 paint") else "warning"
    for strict, severity in ((False, usual), (True, "error")):
        report = judge(LENIENT[name], "a.3mf", strict_3mf=strict)
        assert [(found.code, found.severity) for found in report.findings] == [(name[:4], severity)]


def test_a_project_as_bambustudio_packs_it_passes(judge):
    """Objects in parts of their own, attributes without prefix, several covers of types that are no thumbnail's."""
    child = model_xml(f'<object id="1" p:UUID="{UUID}" type="model">{mesh_xml()}</object>', "<build/>",
                      'unit="millimeter" requiredextensions="p"')  # fmt: skip
    component = f'<component p:path="/3D/Objects/object_1.model" objectid="1" p:UUID="{UUID}"/>'
    root = model_xml(
        f'<object id="2" p:UUID="{UUID}" type="model"><components>{component}</components></object>',
        f'<build p:UUID="{UUID}"><item objectid="2" p:UUID="{UUID}" transform="1 0 0 0 1 0 0 0 1 9 9 0" '
        'printable="1"/></build>',
        'unit="millimeter" requiredextensions="p" xmlns:BambuStudio="http://schemas.bambulab.com/package/2021"',
        '<metadata name="Application">BambuStudio-01.10</metadata><metadata name="BambuStudio:3mfVersion">1</metadata>'
        '<metadata name="Thumbnail_Small">/Metadata/plate_1_small.png</metadata>',
    )
    assert PRODUCTION in root
    covers = "http://schemas.bambulab.com/package/2021/cover-thumbnail-"
    rels = rels_xml((START, "/3D/3dmodel.model"), (THUMBNAIL, "/Metadata/plate_1.png"),
                    (covers + "middle", "/Metadata/plate_1.png"), (covers + "small", "/Metadata/none.png"))  # fmt: skip
    more = [
        ("3D/Objects/object_1.model", child),
        ("3D/_rels/3dmodel.model.rels", rels_xml((START, "/3D/Objects/object_1.model"))),
        ("Metadata/plate_1.png", PNG),
        ("Metadata/project_settings.config", '{"version": "1"}'),
    ]
    report = judge(package(root, rels=rels, more=more), "a.3mf")
    assert [(found.code, found.severity) for found in report.findings] == [("P017", "info")]
    assert report.facts.volume_mm3 == pytest.approx(1000)


def test_a_project_as_cura_packs_it_passes(judge):
    settings = '<metadata name="cura:print_order" preserve="true" type="xs:integer">1</metadata>'
    model = model_xml(
        f'<object id="1" name="a.stl" type="model"><metadatagroup>{settings}</metadatagroup>{mesh_xml()}</object>',
        attributes='unit="millimeter" xmlns:cura="http://software.ultimaker.com/xml/cura/3mf/2015/10"',
    )
    rels = rels_xml((START, "/3D/3dmodel.model"), (THUMBNAIL, "/Metadata/thumbnail.png"))
    report = judge(package(model, rels=rels, more=[("Metadata/thumbnail.png", PNG), ("Cura/a.inst.cfg", "a")]), "a.3mf")
    assert report.findings == ()


def test_findings_name_part_object_and_line(judge):
    lines = model_xml(f'<object id="7">{mesh_xml()}</object>', '\n<build>\n<item objectid="7" odd="1"/></build>')
    model = lines.replace("<vertex ", "\n<vertex ").replace("<triangle ", "\n<triangle ")
    first = model[: model.index("<triangle ")].count("\n") + 1
    gone = model.replace('<triangle v1="0" v2="1" v3="3" />', "")
    (hole, *_), (attribute,) = (
        [found.locations[0] for found in judge(gone, "a.3mf").findings if found.code == code]
        for code, gone in (("T001", package(gone)), ("P017", package(model)))
    )
    assert (hole.part, hole.object, hole.line) == ("3D/3dmodel.model", "7", first + 1 + hole.face)
    assert (attribute.part, attribute.line) == ("3D/3dmodel.model", model.count("\n") + 1)
    index = model.replace('v3="3"', 'v3="99"', 1)
    word = model.replace('x="10"', 'x="ten"', 1)
    at = {found.code: found.locations[0] for text in (index, word) for found in judge(package(text), "a.3mf").findings}
    assert (at["P011"].line, at["P011"].object) == (first, "7")
    assert at["F004"].line == word[: word.index("ten")].count("\n") + 1
    assert str(at["P011"]) == f"3D/3dmodel.model object '7' line {first}"


@pytest.mark.parametrize("blank", ["\u00a0", "\u2003", "\u0085", "\u3000"])
def test_blanks_that_xml_does_not_know_are_no_part_of_a_number(blank, judge):
    model = model_xml(f'<object id="1">{mesh_xml()}</object>')
    report = judge(package(model.replace('x="0', f'x="{blank}0', 1)), "a.3mf")
    assert [found.code for found in report.findings if found.severity == "error"] == ["F004"]
    moved = f'<build><item objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0{blank}5"/></build>'
    report = judge(package(model_xml(f'<object id="1">{mesh_xml()}</object>', moved)), "a.3mf")
    assert [found.code for found in report.findings if found.severity == "error"] == ["P017"]


def test_an_image_that_is_damaged_in_the_zip_is_told(judge):
    name = "Metadata/thumbnail.png"
    whole = package(rels=rels_xml((START, "/3D/3dmodel.model"), (THUMBNAIL, f"/{name}")), more=[(name, PNG)])
    assert not judge(whole, "a.3mf").findings
    content = whole.index(name.encode(), whole.index(b"3dmodel.model")) + len(name)
    report = judge(whole[: content + 9] + b"x" + whole[content + 10 :], "a.3mf")
    assert [(one.code, one.locations[0].part) for one in report.findings] == [("F003", name)]

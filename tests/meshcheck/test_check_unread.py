"""What is not read never passes, and what is no part of a body is not judged; each fault has its one finding."""

import numpy as np
import pytest
from malformed import lattice, sliced
from shapes import TYPES, box, finding, mesh_xml, model_xml, package, stl, text_stl

from unitcad.meshcheck import check_bytes


def codes(report):
    return {found.code: found.severity for found in report.findings}


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize(
    ("content", "word"),
    [
        (lattice('<b:beam v1="0" v2="7"/>'), "its shape is not"),
        (sliced(f'<object id="1">{mesh_xml()}</object>'), "slices are not checked"),
        (f'<object id="1">{mesh_xml()}</object><i:field xmlns:i="http://schemas.3mf.io/3dmanufacturing/implicit/2023/12" '
         'id="5"/>', "implicit content is not checked"),
        (f'<object id="1">{mesh_xml()}</object><v:image xmlns:v="http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01" '
         'id="5"/>', "volumetric content is not checked"),
    ],
)  # fmt: skip
def test_content_that_no_rule_judges_is_named(content, word, strict, judge):
    report = judge(package(model_xml(content)), "a.3mf", strict_3mf=strict)
    assert codes(report) == {"P021": "error" if strict else "warning"}
    assert word in finding(report, "P021").message


def test_slices_may_be_shifted_turned_and_scaled_in_their_plane(judge):
    turned = '<build><item objectid="1" transform="0 2 0 -2 0 0 0 0 1 5 5 5"/></build>'
    one = sliced(f'<object id="1">{mesh_xml()}</object>')
    assert not judge(package(model_xml(one, turned)), "a.3mf").has("P022")


def test_beams_have_their_lines(judge):
    beams = "\n".join(f'<b:beam v1="0" v2="{k}"/>' for k in (1, 2, 77))
    model = model_xml(lattice(beams))
    place = finding(judge(package(model), "a.3mf"), "P011").locations[0]
    assert place.line == 1 + model[: model.index('v2="77"')].count("\n")
    assert place.object == "1"


BALLS = 'xmlns:n="http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07" n:ballmode="mixed"'


@pytest.mark.parametrize(
    ("attributes", "more", "code", "words"),
    [
        ('clippingmode="inside" clippingmesh="77"', "", "P012", "clippingmesh of object 1 names object 77"),
        ('clippingmode="inside" clippingmesh="1"', "", "P012", "or is itself"),
        ('representationmesh="77"', "", "P012", "representationmesh of object 1 names object 77"),
        ('clippingmode="outside"', "", "P017", "without a clippingmesh"),
        (BALLS, '<n:balls><n:ball vindex="7"/><n:ball vindex="8"/></n:balls>', "P011", "1 ball of object 1"),
        (BALLS, '<n:balls><n:ball vindex="7"/></n:balls><b:beamsets><b:beamset><n:ballref index="1"/></b:beamset></b:beamsets>',
         "P011", "an index of the ball sets of object 1 is 1"),
    ],
)  # fmt: skip
def test_a_lattice_names_what_is_there(attributes, more, code, words, judge):
    one = lattice('<b:beam v1="0" v2="7"/>').replace("<b:beamlattice ", f"<b:beamlattice {attributes} ")
    report = judge(package(model_xml(one.replace("</b:beams>", f"</b:beams>{more}"))), "a.3mf")
    assert words in finding(report, code).message
    assert set(codes(report)) == {code, "P021"}


def test_a_clipped_lattice_with_balls_has_no_fault(judge):
    one = lattice('<b:beam v1="0" v2="7"/>', '<b:ref index="0"/><n:ballref index="0"/>')
    one = one.replace("<b:beamlattice ", f'<b:beamlattice {BALLS} clippingmode="inside" clippingmesh="2" ')
    one = one.replace("</b:beams>", '</b:beams><n:balls><n:ball vindex="7"/></n:balls>')
    assert set(codes(judge(package(model_xml(f'<object id="2">{mesh_xml()}</object>{one}')), "a.3mf"))) == {"P021"}


CONFIG = '<config><object id="1">{}</object></config>'
VOLUME = '<volume firstid="{}" lastid="{}"><metadata type="volume" key="{}" value="{}"/></volume>'


@pytest.mark.parametrize(
    ("key", "value", "counts"),
    [
        ("volume_type", "ModelPart", True),
        ("volume_type", "ParameterModifier", False),
        ("volume_type", "NegativeVolume", False),
        ("volume_type", "SupportEnforcer", False),
        ("volume_type", "SupportBlocker", False),
        ("modifier", "1", False),
        ("modifier", "0", True),
    ],
)
def test_prusaslicers_modifiers_are_no_part_of_the_body(key, value, counts, judge):
    both = np.concatenate([box(), box((4, 4, 20), (3, 3, -5))])
    corners, faces = np.unique(both.reshape(-1, 3), axis=0, return_inverse=True)
    model = model_xml(f'<object id="1">{mesh_xml(corners, faces.reshape(-1, 3))}</object>')
    volumes = VOLUME.format(0, 11, "volume_type", "ModelPart") + VOLUME.format(12, 23, key, value)
    types = TYPES.replace("</Types>", '<Default Extension="config" ContentType="text/xml"/></Types>')
    more = [("Metadata/Slic3r_PE_model.config", CONFIG.format(volumes))]
    report = judge(package(model, types=types, more=more), "a.3mf")
    assert report.has("G001") == counts
    assert report.facts.triangles == (24 if counts else 12)
    if not counts:
        assert report.findings == ()
        assert report.facts.volume_mm3 == pytest.approx(1000)


def _encrypted(data, name):
    """The package with the flag of encryption at an entry, in the directory and at the entry itself."""
    found, at = bytearray(data), -1
    for mark, flags, size, start in ((b"PK\x01\x02", 8, 28, 46), (b"PK\x03\x04", 6, 26, 30)):
        while (at := found.find(mark, at + 1)) >= 0:
            length = int.from_bytes(found[at + size : at + size + 2], "little")
            if found[at + start : at + start + length] == name:
                found[at + flags] |= 1
    return bytes(found)


@pytest.mark.parametrize("name", [b"[Content_Types].xml", b"_rels/.rels", b"3D/3dmodel.model"])
def test_an_encrypted_part_is_one_finding(name, judge):
    report = judge(_encrypted(package(), name), "a.3mf")
    assert [(found.code, found.count) for found in report.findings] == [("P008", 1)]
    assert f"{name.decode()} is encrypted" in report.findings[0].message


@pytest.mark.parametrize("field", [8, 10, 12, 16], ids=["entries here", "entries", "size", "offset"])
@pytest.mark.parametrize("more", [1, 255])
def test_an_end_record_that_contradicts_the_directory(field, more, judge):
    data = bytearray(package())
    at = data.rfind(b"PK\x05\x06") + field
    data[at] = (data[at] + more) % 256
    assert [found.code for found in judge(bytes(data), "a.3mf").findings] == ["F003"]


@pytest.mark.parametrize("more", [1, 100])
def test_bytes_after_the_zip_are_trailing_bytes(more, judge):
    report = judge(package() + bytes(more), "a.3mf")
    assert codes(report) == {"F006": "warning"}
    assert report.facts.volume_mm3 == pytest.approx(1000)


def test_a_comment_of_the_zip_is_none(judge):
    data = bytearray(package())
    at = data.rfind(b"PK\x05\x06")
    data[at + 20] = 5
    assert judge(bytes(data) + b"hello", "a.3mf").verdict == "pass"


@pytest.mark.parametrize("end", ["end solid box", "END SOLID", "  end\tsolid"])
@pytest.mark.parametrize("solids", [1, 2])
def test_end_solid_in_two_words_ends_a_solid(end, solids, judge):
    text = "".join(text_stl(box(at=(20 * k, 0, 0))) for k in range(solids)).replace("endsolid box", end)
    report = judge(text, "a.stl")
    assert codes(report) == ({} if solids == 1 else {"F010": "info"})
    assert report.facts.triangles == 12 * solids


@pytest.mark.parametrize("more", [1, 4, 50, 600])
def test_attribute_bytes_after_each_facet_are_one_finding(more, judge):
    data = stl(box())
    facets = [data[84 + 50 * k : 132 + 50 * k] + more.to_bytes(2, "little") + bytes(range(256))[:more].ljust(more, b"x")
              for k in range(12)]  # fmt: skip
    report = judge(data[:84] + b"".join(facets), "a.stl")
    assert codes(report) == {"F002": "error"}
    assert f"84 + 12 x (50 + {more})" in finding(report, "F002").message
    assert report.facts.volume_mm3 == pytest.approx(1000)


@pytest.mark.parametrize("name", ["part.glb", "part.amf", "part.IGES"])
def test_a_format_that_is_not_checked_says_which_ones_slicers_take(name, judge):
    message = finding(judge(b"glTF" + bytes(20), name), "F005").message
    assert "export STL, 3MF or OBJ, which every slicer takes" in message


def test_a_long_name_has_the_rule_of_a_short_one_and_a_short_message():
    found = []
    for n in (20, 9_000_000):
        before = f'<metadata name="{"x" * n}:y">a</metadata>'
        found.append(check_bytes(package(model_xml(before=before), compression=0), "a.3mf").findings)
    assert [[item.code for item in one] for one in found] == [["P017"], ["P017"]]
    assert len(found[1][0].message) < 500


@pytest.mark.parametrize("strict", [False, True])
def test_metadata_behind_the_resources_fails_no_file_unless_3mf_is_read_strictly(strict, judge):
    model = model_xml(f'<object id="1">{mesh_xml()}</object>')
    late = model.replace("</resources>", '</resources><metadata name="Title">a</metadata>')
    assert codes(judge(package(late), "a.3mf", strict_3mf=strict)) == {"P017": "error" if strict else "warning"}

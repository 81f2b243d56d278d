"""How programs write numbers and texts: not-a-number in each format, UTF-16, values of a wrong type, huge settings."""

import codecs

import numpy as np
import pytest
from polygon_files import off, ply
from shapes import CUBE_CORNERS, CUBE_FACES, box, mesh_xml, model_xml, obj, package, text_stl

from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.readers.threemf_schema import CORE, ELEMENTS, MATERIAL

SPELLINGS = (
    "nan",
    "-NaN",
    "inf",
    "+Infinity",
    "-nan(ind)",
    "1.#INF",
    "-1.#IND00",
    "1.#QNAN0",
    "1.#SNAN",
)
TEXTS = {
    "a.obj": obj(CUBE_CORNERS * 7, CUBE_FACES),
    "a.off": off(CUBE_CORNERS * 7, CUBE_FACES).decode(),
    "a.ply": ply(CUBE_CORNERS * 7, CUBE_FACES, "").decode(),
    "a.stl": text_stl(box((7, 7, 7))),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("name", [*TEXTS, "a.3mf"])
def test_every_spelling_of_not_a_number_is_one(name, spelling, judge):
    """In each format the same coordinate is replaced."""
    if name == "a.3mf":
        content = package(model_xml().replace('z="10"', f'z="{spelling}"', 1))
    else:
        lines = TEXTS[name].split("\n")
        line = next(i for i, text in enumerate(lines) if text.replace("vertex ", "v ").split()[-3:] == ["0", "0", "7"])
        lines[line] = lines[line].rpartition(" ")[0] + f" {spelling}"
        content = "\n".join(lines)
    code = "F004" if name == "a.3mf" and "#" in spelling else "V001"
    assert {found.code for found in judge(content, name).findings} == {code}


@pytest.mark.parametrize("comment", ["#INF", " # 1.#IND", "#1.#QNAN"])
def test_a_comment_is_one_where_it_was(comment, judge):
    content = TEXTS["a.obj"].replace("v 0 0 7", f"v 0 0 7{comment}", 1)
    assert judge(content, "a.obj").findings == ()


@pytest.mark.parametrize("mark", [codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE])
@pytest.mark.parametrize("name", TEXTS)
def test_utf_16_is_read_with_a_warning(name, mark, judge):
    order = "utf-16-le" if mark == codecs.BOM_UTF16_LE else "utf-16-be"
    report = judge(mark + TEXTS[name].encode(order), name)
    assert [found.code for found in report.findings] == ["F009"]
    assert report.facts.volume_mm3 == pytest.approx(343)


WRONG = ("", "x", "-1", "1.5", "9" * 5000, "99999999999999999999", "\u0663")
BASE = '<basematerials id="5"><base name="a" displaycolor="#FF0000"/></basematerials>'
OPTIONAL = [
    (space, element, name)
    for space in (CORE, MATERIAL)
    for element, schema in ELEMENTS[space].items()
    for name, test in schema.optional.items()
    if not all(test(value) for value in WRONG)
]


@pytest.mark.parametrize(("space", "element", "name"), OPTIONAL, ids=lambda value: value.rpartition("/")[2])
def test_an_optional_attribute_of_a_wrong_type_is_reported_and_left_out(space, element, name, judge):
    prefix = "" if space == CORE else "m:"
    needed = {"id": "7", "name": "a", "path": "/a.png", "contenttype": "image/png", "texid": "9", "matid": "5"}
    needed |= {"matindices": "0", "pids": "5", "x": "0", "y": "0", "z": "0", "objectid": "1", "displaycolor": "#FF0000"}
    for value in WRONG:
        if ELEMENTS[space][element].optional[name](value):
            continue
        required = "".join(
            f' {key}="{needed.get(key, "0")}"' for key in ELEMENTS[space][element].required if key not in ("v1", "v2")
        )
        if element == "triangle":
            resources = f'<object id="1">{mesh_xml(per_face=f"{name}={chr(34)}{value}{chr(34)}")}</object>'
        elif element == "object":
            resources = f'<object id="1" {name}="{value}">{mesh_xml()}</object>'
        elif element == "model":
            continue
        else:
            resources = f'{BASE}<{prefix}{element}{required} {name}="{value}"/><object id="1">{mesh_xml()}</object>'
        report = judge(package(model_xml(resources)), "a.3mf")
        assert report.has("P017"), value
        assert report.facts.volume_mm3 == pytest.approx(1000), value


@pytest.mark.parametrize(
    "resources",
    [
        '<s:slicestack id="{huge}"/>',
        '<s:unknown id="{huge}"/>',
        '<x:thing xmlns:x="urn:x" id="{huge}"/>',
        '<m:multiproperties id="8" pids="5"><m:color color="#FFFFFF"/></m:multiproperties>',
        '<m:multiproperties id="8" pids="5"><s:vertex x="1" y="1"/></m:multiproperties>',
    ],
)
def test_strange_resources_are_judged(resources, judge):
    found = judge(
        package(model_xml(f'{BASE}{resources.format(huge="9" * 5000)}<object id="1">{mesh_xml()}</object>')), "a.3mf"
    )
    assert found.facts.volume_mm3 == pytest.approx(1000)


@pytest.mark.parametrize("size", [1e38, 3e38])
def test_sizes_near_the_largest_give_no_warnings_of_overflow(size):
    """A flat mesh, whose third axis has no extent, beside the largest float32 numbers; warnings are errors here."""
    corners = np.array([[0, 0, 0], [size, 0, 0], [0, size, 0], [1e-45, 1e-45, 0]])
    assert check_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])).verdict == "error"

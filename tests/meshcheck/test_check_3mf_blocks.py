"""Uniform blocks of vertices and triangles: the same model, line by line, as the parser alone gives."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from unitcad.meshcheck.findings import Unreadable
from unitcad.meshcheck.readers import threemf_model
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.rules.f_file import Limits

VERTICES = [
    '<vertex x="1" y="2.5" z="-3e-2"/>',
    '<vertex x="1" y="2.5" z="3E+1"/>\n',
    '  <vertex x="-.5" y="7." z="0" />\n',
    '<vertex y="1" x="2" z="3"/>',
    '<vertex x="1"\ny="2" z="3"/>',
    '<vertex x=" 1 " y="2" z="3"/>',
    '<vertex x="1-2" y="" z="3"/>',
    '<vertex x="1" y="2" z="nan"/>',
    '<vertex x="1e39" y="2" z="3"/>',
    '<vertex x="1_0" y="2" z="3"/>',
    '<vertex x="1e" y="2" z="3"/>',
    '<vertex x="1" y="2" z="3">\n</vertex>',
    '<vertex x="1" y="2"/>',
    '<vertex x="1" y="2.5" w="-3e-2"/>',
    '<vertex x="1" y="" z="2"/>',
    '<vertex x="1" y="2" z="&lt;3"/>',
    '<vertex x="1" y="2" z="3" x="4"/>',
    '<vertex x="1" y="2" z="3" w="4"/>',
    "<vertex x='1' y='2' z='3'/>",
    '<vertex x="&#49;" y="2" z="3"/>',
    '<vertex x="1" y="2" z="3"/>7',
]
TRIANGLES = [
    '<triangle v1="0" v2="1" v3="2"/>',
    '\t<triangle v1="0" v2="1" v3="2"/>\r\n',
    '<triangle v1="0" v2="1" v3="2"/>\r',
    '<triangle v3="0" v1="1" v2="2"/>\n',
    '<triangle v1="0" v2="1" v3="2" pid="3" p1="0"/>\n',
    '<triangle v1="0" v2="1" v3="2" pid="0" p1="0"/>\n',
    '<triangle v1="0" v2="1" v3="2147483648"/>',
    '<triangle v1="0" v2="1" v3="99999999999999999999"/>',
    '<triangle v1="0" v2="1" v3="+2"/>',
    '<triangle v1="0" v2="1" v3="1.5"/>',
    '<triangle v1="0" v2="1" v2="2"/>',
    '<triangle v1="0" v2="1" v3="2" paint_color="4"/>',
    '<triangle v1="0" v2="1" v3="2" paint="/>"/>',
    '<trianglE v1="0" v2="1" v3="2"/>',
]
WRAPPED = [
    "<!--{}-->",
    "<![CDATA[{}]]>",
    "<?a {}?>",
    '<q a="{}"/>',
    "<vertices>{}</vertices>",
    "<triangles>{}</triangles>",
]
ODD = [
    "<!-- /> -->",
    "<!--",
    "-->",
    "]]>",
    "</vertices>",
    "<triangles>",
    '<q a="/>',
    '"/>',
    "&lt;",
    "\u00e4",
    "7",
]


def _texts(of):
    """Draw runs of one text or two, as programs write them, some of them inside of something, and what is odd."""
    one = st.one_of(st.sampled_from(of[:3]), st.sampled_from(of))
    some = st.lists(one, min_size=1, max_size=2).flatmap(lambda texts: st.lists(st.sampled_from(texts), max_size=8))
    run = some.map("".join)
    wrapped = st.tuples(st.sampled_from(WRAPPED), run).map(lambda drawn: drawn[0].format(drawn[1]))
    return st.lists(st.one_of(run, run, run, wrapped, st.sampled_from(ODD)), max_size=4).map("".join)


def _model(vertices, triangles="", prefix="", opened="<{}vertices>"):
    name = f"xmlns:{prefix[:-1]}" if prefix else "xmlns"
    body = f"{opened.format(prefix)}{vertices}</{prefix}vertices>\n<{prefix}triangles>{triangles}</{prefix}triangles>"
    return (
        f'<{prefix}model {name}="{schema.CORE}"><{prefix}resources>'
        f'<{prefix}object id="1"><{prefix}mesh>{body}</{prefix}mesh></{prefix}object></{prefix}resources>'
        f'<{prefix}build><{prefix}item objectid="1"/></{prefix}build></{prefix}model>'
    ).encode()


@st.composite
def _models(draw):
    prefix = draw(st.sampled_from(["", "", "", "c:"]))
    opened = draw(st.sampled_from(["<{}vertices>", "<{}vertices>", "<{}vertices >", '<{}vertices a="1">']))
    return _model(draw(_texts(VERTICES)), draw(_texts(TRIANGLES)), prefix, opened)


def _read(text):
    """Return all that is read of a model part, or the findings that end it, in plain data."""
    try:
        model = threemf_model.read_model(text, "3D/a.model", Limits(max_faces=40), lambda: None)
    except Unreadable as stop:
        return str(stop.findings[-1].as_dict())
    meshes = [one.mesh for one in model.objects().values() if one.mesh]
    found = sorted(str(finding.as_dict()) for finding in model.findings)  # those of numbers come batch by batch
    return found, [(mesh.vertices.tolist(), mesh.rows.tolist()) for mesh in meshes], sorted(model.resources)


def _confirm_equal(text, block=10_000):
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(threemf_model, "_BLOCK", block)
        patched.setattr(threemf_model, "_SHORTEST", 1)
        at_once = _read(text)
        patched.setattr(threemf_model, "cut_lists", lambda data: (data, []))
        assert at_once == _read(text)


@settings(max_examples=300)
@given(_models(), st.sampled_from([60, 200, 10_000]))
def test_reading_at_once_changes_nothing(text, block):
    _confirm_equal(text, block)


@pytest.mark.parametrize("element", [*VERTICES, *TRIANGLES])
def test_reading_elements_of_one_text_at_once_changes_nothing(element):
    for behind in ("", element.replace("1", "3"), VERTICES[0]):
        text = 5 * element + behind
        _confirm_equal(_model(text) if "vertex" in element else _model(2 * VERTICES[0], text))


@pytest.mark.parametrize("around", WRAPPED)
@pytest.mark.parametrize("block", [60, 10_000])
def test_what_only_looks_like_elements_is_left_to_the_parser(around, block):
    _confirm_equal(_model(around.format(6 * VERTICES[0]) + VERTICES[0]), block)
    _confirm_equal(_model(2 * VERTICES[0], around.format(6 * TRIANGLES[0]) + TRIANGLES[0]), block)


@pytest.mark.parametrize("blank", ["\x0b", "\x0c", "\xa0"])
def test_a_blank_that_xml_forbids_is_refused(blank):
    for vertex in (VERTICES[0].replace(" ", blank), VERTICES[0].replace("/>", f"{blank}/>"), VERTICES[0] + blank):
        text = _model(100 * vertex)
        assert isinstance(_read(text), str) or blank == "\xa0"
        _confirm_equal(text)


def test_a_part_full_of_comments_is_not_searched_again_and_again():
    begin = time.process_time()
    threemf_model.cut_lists(b"<!-- -->" * 200_000 + b"<!--" * 400_000)
    assert time.process_time() - begin < 2


@pytest.mark.parametrize("line_end", ["", "\n", "\r\n"])
def test_most_of_a_part_is_read_at_once(line_end):
    vertices = "".join(f'  <vertex x="{i}.5" y="-{i}" z="1e-{i % 9}"/>{line_end}' for i in range(5000))
    triangles = "".join(f'<triangle v1="{i}" v2="{i + 1}" v3="{i + 2}" />{line_end}' for i in range(4998))
    text = _model(line_end + vertices, triangles)
    assert len(threemf_model.cut_lists(text)[0].strip()) < 400 + text.count(b"\n")
    (mesh,) = (one.mesh for one in threemf_model.read_model(text, "a", Limits(), lambda: None).objects().values())
    assert mesh is not None
    assert np.array_equal(mesh.vertices[:, 2], [float(f"1e-{i % 9}") for i in range(5000)])
    assert np.array_equal(mesh.rows[:, 0], np.arange(4998))
    assert mesh.rows[-1, 7] == text[: text.rindex(b"<triangle")].count(b"\n") + 1

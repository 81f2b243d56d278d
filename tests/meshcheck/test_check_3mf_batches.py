"""Vertices and triangles of 3MF, read in batches: the same model, line by line, as one after the other."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import model_xml

from unitcad.meshcheck.findings import Unreadable
from unitcad.meshcheck.readers import threemf_model
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


def _model(vertices, triangles):
    body = f"<mesh><vertices>{vertices}</vertices>\n<triangles>{triangles}</triangles></mesh>"
    return model_xml(f'<object id="1">{body}</object>').encode()


def _read(text):
    """Return all that is read of a model part, or the findings that end it, in plain data."""
    try:
        model = threemf_model.read_model([text], "3D/a.model", Limits(max_faces=40))
    except Unreadable as stop:
        return str(stop.findings[-1].as_dict())
    meshes = [one.mesh for one in model.objects().values() if one.mesh]
    found = sorted(str(finding.as_dict()) for finding in model.findings)  # those of numbers come batch by batch
    return found, [(mesh.vertices.tolist(), mesh.rows.tolist()) for mesh in meshes]


def _confirm_equal(text):
    with pytest.MonkeyPatch.context() as patched:
        together = _read(text)
        patched.setattr(threemf_model, "_BATCH", 1)
        assert together == _read(text)


def _runs(of):
    """Draw runs of one text or two, as programs write them."""
    some = st.lists(st.sampled_from(of), min_size=1, max_size=2)
    return some.flatmap(lambda texts: st.lists(st.sampled_from(texts), max_size=8)).map("".join)


@settings(max_examples=100)
@given(_runs(VERTICES), _runs(TRIANGLES))
def test_reading_at_once_changes_nothing(vertices, triangles):
    _confirm_equal(_model(vertices, triangles))


@pytest.mark.parametrize("line_end", ["", "\n", "\r\n"])
def test_numbers_and_lines_of_elements_of_several_kinds(line_end):
    triangles = line_end.join([*3 * TRIANGLES[:1], *2 * TRIANGLES[3:4], TRIANGLES[4], TRIANGLES[11]])
    text = _model(4 * VERTICES[0], triangles)
    found, [(vertices, rows)] = _read(text)
    assert len(found) == 1
    assert vertices == 4 * [[1, 2.5, -0.03]]
    assert [row[:3] for row in rows] == [*3 * [[0, 1, 2]], *2 * [[1, 2, 0]], *2 * [[0, 1, 2]]]
    assert [row[3:7] for row in rows] == [*5 * [[-1, -1, -1, -1]], [0, -1, -1, 3], [-1, -1, -1, -1]]
    begins = [at.start() for at in re.finditer("<triangle ", text.decode())]
    assert [row[7] for row in rows] == [text.count(b"\n", 0, at) + 1 for at in begins]

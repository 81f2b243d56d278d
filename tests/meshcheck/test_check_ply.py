"""PLY: the header's counts against what the file holds."""

import struct

import numpy as np
import pytest
from polygon_files import ply
from shapes import CUBE_CORNERS, CUBE_FACES

CUBE = CUBE_CORNERS * 10


def cube(vertices=8, faces=12, order="<", newline=b"\n"):
    """A cube whose header promises other numbers of vertices and faces than the 8 and 12 that follow."""
    head, end, body = ply(CUBE, CUBE_FACES.tolist(), order, coordinate="float").partition(b"end_header\n")
    head = (head + end).replace(b"vertex 8", b"vertex %d" % vertices).replace(b"face 12", b"face %d" % faces)
    return head.replace(b"\n", newline) + body


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_a_sound_cube_passes(order, newline, judge):
    report = judge(cube(order=order, newline=newline), "cube.ply")
    assert report.findings == ()
    assert report.facts.volume_mm3 == pytest.approx(1000)


@pytest.mark.parametrize(
    ("content", "code", "said"),
    [
        (cube(faces=13), "F002", "promises 13 face records, the file has room for 12"),
        (cube(vertices=100), "F002", "promises 100 vertex records, the file has room for 21"),
        (cube(vertices=7), "F002", "promises 12 face records"),
        (cube(vertices=9), "F008", "1 face with fewer than three vertices"),
        (cube()[:-1], "F002", "promises 12 face records, the file has room for 11"),
        (cube(faces=11), "F006", "13 bytes after the last element"),
        (cube() + b"x", "F006", "1 byte after the last element"),
        (cube().replace(b"uchar", b"word "), "F003", "'property list word int vertex_indices' is no property"),
        (cube().replace(b"face 12", b"face"), "F003", "'element face' names no element and count"),
        (cube().replace(b"float z", b"float w"), "F003", "its elements are not those of a mesh"),
    ],
)
def test_wrong_counts_are_named(content, code, said, judge):
    report = judge(content, "cube.ply")
    assert [found for found in report.findings if found.code == code and said in found.message], report.findings


@pytest.mark.parametrize("seed", range(8))
def test_elements_end_where_their_records_do(seed, judge):
    """Random elements with lists of one length, of many, and runs of each; any byte less is one too few."""
    rng = np.random.default_rng(seed)
    sign = "<>"[seed % 2]
    kinds = {"uchar": "B", "int16": "h", "uint": "I", "double": "d"}
    whole = cube(order=sign)
    head, body = whole.split(b"end_header\n")
    lines = head.decode().splitlines()
    for element in range(3):
        lists = list(rng.choice(list(kinds), 2)) if element else []
        plain = list(rng.choice(list(kinds), 2))
        count = int(rng.integers(1, 9000))
        lines.append(f"element e{element} {count}")
        lines += [f"property {kind} p{i}" for i, kind in enumerate(plain)]
        lines += [f"property list uchar {kind} l{i}" for i, kind in enumerate(lists)]
        run = 1 if seed < 3 else 3000
        lengths = np.repeat(rng.integers(0, 5, count // run + 1), run)[:count]
        for n in lengths.tolist():
            body += bytes(sum(struct.calcsize(sign + kinds[kind]) for kind in plain))
            body += b"".join(bytes([n]) + bytes(n * struct.calcsize(sign + kinds[kind])) for kind in lists)
    raw = "\n".join([*lines, "end_header", ""]).encode() + body
    assert judge(raw, "a.ply").findings == ()
    (found,) = judge(raw + b"12345", "a.ply").findings
    assert (found.code, found.count) == ("F006", 5)
    (found,) = judge(raw[:-1], "a.ply").findings
    assert found.code == "F002"
    assert "e2 record" in found.message


def test_numbers_after_the_last_property_of_a_text_face_are_a_warning(judge):
    """MeshLab announces plain colours of faces and writes a list."""
    text = ply(CUBE, CUBE_FACES.tolist(), "").decode()
    lines = text.split("\n")
    longer = [line + " 1 1 1" if line.startswith("3 ") and line.count(" ") == 3 else line for line in lines]
    (found,) = judge("\n".join(longer), "a.ply").findings
    assert (found.code, found.severity, found.count) == ("F006", "warning", 12)
    wide = text.replace("\n10 ", "\n1 0 ", 1)
    assert [found.code for found in judge(wide, "a.ply").findings] == ["F003"]


def test_an_element_named_twice_is_refused(judge):
    head, body = cube().split(b"end_header\n")
    twice = head + b"element face 0\nproperty list uchar int vertex_indices\nend_header\n" + body
    assert "names element face twice" in judge(twice, "a.ply").findings[0].message

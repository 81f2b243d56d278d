"""Files whose bytes or text are wrong before any geometry: the F rules, and what text formats promise of themselves."""

import gzip
import zipfile

import polygon_files
from shapes import CUBE_CORNERS, CUBE_FACES, box, model_xml, obj, package, stl, text_ply, text_stl

OBJ, PLY = obj(CUBE_CORNERS * 10, CUBE_FACES), text_ply(CUBE_CORNERS * 10, CUBE_FACES)
OFF = polygon_files.off(CUBE_CORNERS * 10, CUBE_FACES.tolist()).decode()


def files():
    """(name, code, content) each, options after it where there are any."""
    good, text = stl(box()), text_stl(box())
    return [
        ("empty.stl", "F001", b""),
        ("empty.3mf", "F001", b""),
        ("short.stl", "F001", good[:50]),
        ("header-only.stl", "F001", good[:80] + bytes(4)),
        ("no-facet-text.stl", "F001", "solid a\nendsolid a\n"),
        ("zeros.stl", "F001", bytes(1000)),
        ("cut.stl", "F002", good[:-70]),
        ("count-high.stl", "F002", stl(box(), count=4_000_000_000)),
        ("count-low.stl", "F002", stl(box(), count=3)),
        ("count-zero.stl", "F002", stl(box(), count=0)),
        ("ply-promises.ply", "F002", "ply\nformat ascii 1.0\nelement vertex 99999\nproperty float x\nend_header\n"),
        ("cut.3mf", "F003", package()[:-40]),
        ("bad-crc.3mf", "F003", _flipped(package(compression=zipfile.ZIP_STORED))),
        ("cut-xml.3mf", "F003", package(model_xml()[:-20])),
        ("two-roots.3mf", "F003", package(model_xml() + "<model/>")),
        ("unbound-prefix.3mf", "F003", package(model_xml(before="<x:y/>"))),
        ("cut.ply", "F003", "ply\nformat ascii 1.0\nelement vertex 3\n"),
        ("comma.stl", "F004", text.replace("10", "10,5")),
        ("word.stl", "F004", text.replace("vertex 10", "vertex ten", 1)),
        ("comma.3mf", "F004", package(model_xml().replace('x="10"', 'x="10,5"'))),
        ("word.3mf", "F004", package(model_xml().replace('x="10"', 'x="ten"', 1))),
        ("underscore.stl", "F004", text.replace("vertex 10", "vertex 1_0", 1)),
        ("wide-digits.stl", "F004", text.replace("vertex 10", "vertex \uff11\uff10", 1)),
        ("underscore.3mf", "F004", package(model_xml().replace('x="10"', 'x="1_0"', 1))),
        ("wide-digits.3mf", "F004", package(model_xml().replace('x="10"', 'x="\uff11\uff10"', 1))),
        ("page.stl", "F005", "<!DOCTYPE html>\n<html><body>404</body></html>"),
        ("page.3mf", "F005", "<html><body>sign in</body></html>"),
        ("lfs.stl", "F005", "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n"),
        ("packed.stl", "F005", gzip.compress(good, mtime=0)),
        ("package.stl", "F005", package()),
        ("mesh.3mf", "F005", good),
        ("notes.txt", "F005", "hello"),
        ("scene.glb", "F005", b"glTF\x02\0\0\0" + bytes(12)),
        ("object.stl", "F005", OBJ),
        ("comment-first.stl", "F005", "# made by hand\n" + text),
        ("json.stl", "F005", '{"error": 1}'),
        ("trailing.stl", "F006", good + b"xyz"),
        ("facets-after-endsolid.stl", "F003", text_stl(box()) + text_stl(box(at=(20, 0, 0))).split("\n", 1)[1]),
        ("trailing-text.stl", "F006", text + "made by hand\n"),
        ("solid-header.stl", "F007", stl(box(), header=b"solid made by a program")),
        ("bom.stl", "F009", b"\xef\xbb\xbf" + text.encode()),
        ("cr-only.stl", "F009", text.replace("\n", "\r")),
        ("latin1.stl", "F009", text_stl(box(), "K\u00e4se").encode("latin-1")),
        ("utf16.3mf", "F009", package(model_xml().replace("UTF-8", "UTF-16").encode("utf-16"))),
        ("latin1.3mf", "F009", package(model_xml().replace("UTF-8", "ISO-8859-1").encode("latin-1"))),
        (
            "bad-bytes.3mf",
            "F009",
            package(model_xml(before='<metadata name="Title">\u00e4</metadata>').encode("latin-1")),
        ),
        ("two-solids.stl", "F010", text + text_stl(box(at=(20, 0, 0)))),
        ("too-many.stl", "F011", good, {"max_faces": 5}),
        ("too-many-text.stl", "F011", text, {"max_faces": 5}),
        ("too-many.3mf", "F011", package(), {"max_faces": 5}),
        ("deep-xml.3mf", "F011", package(model_xml(before="<x:a xmlns:x='q'>" * 200 + "</x:a>" * 200))),
    ]


def _flipped(data):
    at = data.index(b'x="10"')
    return data[:at] + b'x="90"' + data[at + 6 :]


def text_meshes():
    """OBJ, PLY and OFF whose lines are not what they promise."""
    return [
        ("cut.off", "F002", OFF[: OFF.rindex("3 ", 0, -20)]),
        ("cut-lines.ply", "F002", PLY[: PLY.rindex("3 ", 0, -20)]),
        ("one-vertex-less.off", "F002", OFF.replace("10 10 10\n", "", 1)),
        ("more.off", "F006", OFF + "3 0 1 2\n"),
        ("more.ply", "F006", PLY + "3 0 1 2\n"),
        ("zero.obj", "P011", OBJ.replace("f 1 ", "f 0 ", 1)),
        ("zero-slash.obj", "P011", OBJ.replace("f 1 2 4", "f 1/1 2/1 0/1", 1)),
        ("beyond.obj", "P011", OBJ.replace("f 1 ", "f 9 ", 1)),
        ("beyond.off", "P011", OFF.replace("3 0 ", "3 8 ", 1)),
        ("comma.obj", "F004", OBJ.replace("v 10", "v 10,5", 1)),
        ("comma.off", "F004", OFF.replace("10 ", "10,5 ", 1)),
        ("comma.ply", "F004", PLY.replace("10 ", "10,5 ", 1)),
        ("underscore.obj", "F004", OBJ.replace("v 10", "v 1_0", 1)),
        ("underscore.off", "F004", OFF.replace("\n10 ", "\n1_0 ", 1)),
        ("word.obj", "F004", OBJ.replace("f 1 ", "f one ", 1)),
        ("edge.obj", "F008", OBJ + "f 1 2\n"),
        ("edge-slashes.obj", "F008", OBJ + "f 1/1 2/2  # an edge\n"),
        ("edge.off", "F008", OFF.replace("3 0 1 3", "2 0 1", 1)),
        ("face-too-short.off", "F003", OFF.replace("3 0 1 3", "999999999 0 1 3", 1)),
        ("cr-only.obj", "F009", OBJ.replace("\n", "\r")),
        ("bom.obj", "F009", "\ufeff" + OBJ),
        ("bent.off", "F013", "OFF\n4 3 0\n0 0 0\n9 0 0\n9 9 1\n0 9 0\n4 0 1 2 3\n3 2 1 0\n3 3 2 0\n"),
        ("word.off", "F004", OFF.replace("\n10 ", "\nten ", 1)),
    ]


def good_text_meshes():
    """(name, content) of the same cube without a fault."""
    slashes = polygon_files.obj(CUBE_CORNERS * 10, CUBE_FACES.tolist(), form="{}//").decode()
    good = [("cube.off", OFF), ("cube.ply", PLY), ("cube.obj", OBJ), ("tabs.obj", OBJ.replace(" ", "\t"))]
    return [*good, ("slashes.obj", slashes)]

"""Files made to do harm, small, of every kind that a command reads: name and content, drawn when they are asked for."""

import gzip
import io
import json
import math
import os
import random
import socket
import struct
import zipfile
import zlib
from pathlib import Path

import numpy

CASES = Path(__file__).parent.parent / "meshcheck" / "cases"
N = 200_000
LONG = "9" * 100_000
DEEP = ".".join("a" * 500)
UTF16 = "name = 'x'\nv 0 0 0\n1,2\n".encode("utf-16")
NOISE = random.Random(1).randbytes(4096)

ANY = {
    "empty": b"",
    "nul": b"\0",
    "nuls": bytes(1_000_000),
    "noise": NOISE,
    "utf16": UTF16,
    "latin1": "größe = 1,5 µm\n".encode("latin-1") * 9,
    "bom": b"\xef\xbb\xbf",
    "html": b"<!DOCTYPE html><html></html>",
    "lfs": b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
    "gzip": gzip.compress(bytes(2_000_000)),
    "line": b"a" * 1_000_000,
    "lines": b"\n" * 1_000_000,
    "returns": b"\r" * 1_000_000,
    "blanks": b" " * 1_000_000,
    "quotes": b'"' * 300_001,
    "escaped quotes": b'\\"' * 300_001,
    "single quotes": b"'" * 300_001,
    "commas": b"," * 1_000_000,
    "hashes": b"#" * 1_000_000,
    "ones": b"1 " * 500_000,
    "digits": b"1" * 1_000_000,
    "columns": b"1," * 300_000 + b"\n" + b"1," * 300_000 + b"\n",
    "minus": b"-" * 1_000_000,
    "brackets": b"[" * 100_000,
    "braces": b'{"a":' * 100_000,
    "escape": b"\x1b[2J\x1b]0;x\x07\n" * 100,
}
"""Content that any name may have."""


def special(folder, suffix):
    """Make what is no regular file; return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {
        name: folder / f"{name}{suffix}" for name in ("folder", "pipe", "loop", "nowhere", "zero", "random", "full")
    }
    made["folder"].mkdir()
    os.mkfifo(made["pipe"])
    made["loop"].symlink_to(made["loop"].name)
    made["nowhere"].symlink_to("nothing")
    for name in ("zero", "random", "full"):
        made[name].symlink_to(f"/dev/{name}")
    made["missing"] = folder / f"missing{suffix}"
    made["socket"] = folder / f"s{suffix}"
    with socket.socket(socket.AF_UNIX) as bound, _inside(folder):
        bound.bind(made["socket"].name)
    made["secret"] = folder / f"secret{suffix}"
    made["secret"].write_text("x")
    made["long"] = folder / ("n" * 300 + suffix)
    made["newline"] = folder / f"a\nb\x1b[31m{suffix}"
    made["newline"].write_bytes(b"")
    return made


class _inside:
    """A context within a folder: the path of a socket is short."""

    def __init__(self, folder):
        self.folder = folder

    def __enter__(self):
        self.before = os.getcwd()
        os.chdir(self.folder)

    def __exit__(self, *raised):
        os.chdir(self.before)


# --- meshes ---------------------------------------------------------------------------------------------------------

CUBE = [(x, y, z) for x in (0, 9) for y in (0, 9) for z in (0, 9)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
         (1, 5, 7), (1, 7, 3)]  # fmt: skip


def stl(count=None, value=None):
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(v if value is None else value for i in face for v in CUBE[i]), 0)
        for face in FACES
    )
    return bytes(80) + struct.pack("<I", len(FACES) if count is None else count) + facets


FACET = "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
STL = {
    "count huge": stl(0xFFFFFFFF),
    "count none": stl(0),
    "count more": stl(13),
    "nan": stl(value=float("nan")),
    "inf": stl(value=float("inf")),
    "denormal": stl(value=1e-44),
    "largest": stl(value=3.4e38),
    "same point": stl(value=1.0),
    "header": bytes(84),
    "solids": b"solid\n" * 100_000,
    "solids and ends": b"solid a\nendsolid a\n" * 50_000,
    "facets open": b"solid a\n" + b"facet normal 0 0 0\n" * 50_000,
    "loops": b"solid a\nfacet normal 0 0 0\n" + b"outer loop\n" * 50_000,
    "vertices": b"solid a\nfacet normal 0 0 0\nouter loop\n" + b"vertex 0 0 0\n" * 60_000 + b"endloop\nendfacet\nendsolid a\n",
    "numbers": f"solid a\n{FACET.replace('1 0 0', f'1e999 nan {LONG}')}endsolid a\n".encode(),
    "comma": f"solid a\n{FACET.replace('1 0 0', '1,5 0 0')}endsolid a\n".encode(),
    "underscores": f"solid a\n{FACET.replace('1 0 0', '1_0 ٣ 0x10')}endsolid a\n".encode(),
    "one facet many times": f"solid a\n{FACET * 5000}endsolid a\n".encode(),
    "name": f"solid {'n' * 1_000_000}\n{FACET}endsolid\n".encode(),
    "utf16": f"solid a\n{FACET}endsolid a\n".encode("utf-16"),
    "returns": f"solid a\n{FACET}endsolid a\n".replace("\n", "\r").encode(),
}  # fmt: skip
POINTS = "".join(f"v {x} {y} {z}\n" for x, y, z in CUBE)
CORNERS = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)
OBJ = {
    "index huge": f"{POINTS}f 1 2 {LONG}\n",
    "index 2^31": f"{POINTS}f 1 2 2147483648\n",
    "index 2^63": f"{POINTS}f 1 2 9223372036854775808\n",
    "index none": f"{POINTS}f 0 1 2\n",
    "index negative": f"{POINTS}f -1 -2 -9\n",
    "index fraction": f"{POINTS}f 1.5 2 3\n",
    "polygon": f"{POINTS}f {'1 2 3 4 ' * 50_000}\n",
    "polygon of many": "".join(f"v {i} {i * i % 97} 0\n" for i in range(20_000)) + f"f {' '.join(map(str, range(1, 20_001)))}\n",
    "star": "".join(f"v {(i * 7919) % 1000} {(i * 104729) % 997} 0\n" for i in range(3000)) + f"f {' '.join(map(str, range(1, 3001)))}\n",
    "continued": f"{POINTS}f 1 2 {chr(92) + chr(10)}3\n" + "\\\n" * 200_000,
    "slashes": f"{POINTS}f {'1/' * 100_000} 2 3\n",
    "library": f"mtllib ../../../etc/passwd\nusemtl x\n{POINTS}{CORNERS}",
    "groups": f"{POINTS}" + "".join(f"g g{i}\no o{i}\n" for i in range(60_000)) + CORNERS,
    "vertices": "v 0 0 0\n" * 100_000 + "f 1 2 3\n",
    "normals": "vn 0 0 1\n" * 100_000 + POINTS + CORNERS,
    "nan": f"v nan inf -inf\n{POINTS}f 1 2 3\n",
    "large": f"v 1e308 -1e308 1e-320\n{POINTS}f 1 2 3\n",
    "digits": f"v {LONG} 0 0\n{POINTS}f 1 2 3\n",
    "same face": POINTS + "f 1 2 3\n" * 50_000,
    "round and round": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + f"f {'1 2 3 4 ' * 50_000}\n",
    "many sides": "".join(f"v {50 * math.cos(i * math.tau / 50_000)} {50 * math.sin(i * math.tau / 50_000)} 0\n" for i in range(50_000)) + f"f {' '.join(map(str, range(1, 50_001)))}\n",
    "stars": "".join(f"v {(i * 7919) % 1000} {(i * 104729) % 997} {i % 89}\n" for i in range(2000)) + "".join(f"f {' '.join(str((i * (2 * k + 3)) % 1999 + 1) for i in range(1, 2000))}\n" for k in range(100)),
    "one edge": POINTS + "".join(f"v {i} 1 1\n" for i in range(3000)) + "".join(f"f 1 2 {i + 9}\n" for i in range(3000)),
    "one point": "v 0 0 0\n" * 3000 + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 2999)),
    "crossing": "".join(f"v {i} 0 -9\nv {i} 9 9\nv {i + 9} 0 9\n" for i in range(400)) + "".join(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n" for i in range(400)),
}  # fmt: skip


def ply(vertices, faces, form="ascii", body="0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", more=""):
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n{more}"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode() + (body if isinstance(body, bytes) else body.encode())


BINARY = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
PLY = {
    "vertices huge": ply(10**18, 1),
    "faces huge": ply(3, 10**18),
    "counts negative": ply(-3, -1),
    "counts fraction": ply("3.0", "1e0"),
    "counts digits": ply(LONG, 1),
    "counts of the file": ply(2_000_000_000, 2_000_000_000, "binary_little_endian", BINARY),
    "binary list huge": ply(3, 1, "binary_little_endian", BINARY + b"\xff" + struct.pack("<3i", 0, 1, 2)),
    "binary index huge": ply(3, 1, "binary_little_endian", BINARY + b"\3" + struct.pack("<3i", 0, 1, 2**31 - 1)),
    "binary index negative": ply(3, 1, "binary_big_endian", BINARY + b"\3" + struct.pack(">3i", 0, -1, 2)),
    "binary cut": ply(3, 1, "binary_little_endian", BINARY[:20]),
    "properties": ply(3, 1, more="".join(f"property float p{i}\n" for i in range(30_000))),
    "properties of one name": ply(3, 1, more="property float x\n" * 30_000),
    "elements": b"ply\nformat ascii 1.0\n" + b"".join(b"element e%d 1\nproperty int a\n" % i for i in range(30_000)) + b"end_header\n",
    "elements of none": b"ply\nformat binary_little_endian 1.0\n" + b"element vertex 0\n" * 30_000 + b"end_header\n",
    "lists of vertices": b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty list uint double x\nproperty float y\nproperty float z\nend_header\n\xff\xff\xff\xff",
    "no end": b"ply\nformat ascii 1.0\n" + b"comment x\n" * 100_000,
    "format": ply(3, 1, "binary_middle_endian"),
    "version": b"ply\nformat ascii 99999999999999999999\nend_header\n",
    "nan": ply(3, 1, body="nan nan nan\ninf 0 0\n0 1 0\n3 0 1 2\n"),
    "polygon": ply(3, 1, body="0 0 0\n1 0 0\n0 1 0\n255 " + "0 1 2 " * 85 + "\n"),
    "types": ply(3, 1, more="property complex c\n"),
    "no vertices": b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n",
}  # fmt: skip
OFF = {
    "vertices huge": f"OFF\n{10**18} 1 0\n",
    "faces huge": f"OFF\n3 {10**18} 0\n0 0 0\n",
    "counts nan": "OFF\nnan inf 0\n",
    "counts negative": "OFF\n-3 -1 0\n",
    "counts digits": f"OFF\n{LONG} 1 0\n",
    "face huge": f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{10**9} 0 1 2\n",
    "index huge": f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {10**12}\n",
    "index negative": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n",
    "coloured": "COFF\n3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2\n",
    "binary": "OFF BINARY\n" + "\0" * 300,
    "dimensions": "4OFF\n3 1 0\n0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n",
    "n dimensions": f"nOFF\n{10**9}\n3 1 0\n",
    "comments": "OFF\n" + "#\n" * 200_000 + "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "one line": "OFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2",
    "nan": "OFF\n3 1 0\nnan 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n",
}

TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def mesh(vertices=CUBE, faces=FACES, more=""):
    return (
        "<mesh><vertices>" + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in vertices) + "</vertices><triangles>"
        + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces) + f"</triangles>{more}</mesh>"
    )  # fmt: skip


def model(resources, build='<item objectid="1"/>', head='<?xml version="1.0" encoding="UTF-8"?>', attributes=""):
    core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    return (
        f'{head}<model unit="millimeter" xmlns="{core}" {attributes}><resources>{resources}</resources>'
        f"<build>{build}</build></model>"
    )


def package(text, more=None, types=TYPES, relations=RELATIONS, packed=zipfile.ZIP_DEFLATED):
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", packed) as archive:
        archive.writestr("[Content_Types].xml", types)
        archive.writestr("_rels/.rels", relations)
        archive.writestr("3D/3dmodel.model", text)
        for name, content in (more or {}).items():
            archive.writestr(name, content)
    return made.getvalue()


def _components(depth, width):
    """Objects of `width` components each, `depth` deep: width ** depth instances."""
    objects = [f'<object id="1">{mesh()}</object>']
    for i in range(2, depth + 2):
        objects.append(
            f'<object id="{i}"><components>{f"<component objectid={chr(34)}{i - 1}{chr(34)}/>" * width}</components></object>'
        )
    return model("".join(objects), f'<item objectid="{depth + 1}"/>')


def _entities():
    """An entity of entities of entities: a thousand million letters."""
    declared = '<!ENTITY a0 "aaaaaaaaaa">' + "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    return f'<?xml version="1.0"?><!DOCTYPE model [{declared}]><model unit="&a9;"/>'


def _zip_in_zip(depth=6):
    content = bytes(1_000_000)
    for _ in range(depth):
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
            for i in range(5):
                archive.writestr(f"{i}.zip", content)
        content = made.getvalue()
    return content


def _patched(content, old, new):
    """A package with other bytes in every local head and directory entry."""
    return content.replace(old, new)


ONE = f'<object id="1">{mesh()}</object>'


def threemf():
    """3MF packages by name."""
    sound = package(model(ONE))
    directory = sound.rindex(b"PK\1\2")
    made = {
        "bomb": package(model(ONE, attributes=" " * 60_000_000)),
        "bomb of parts": package(model(ONE), {f"Metadata/{i}.txt": bytes(4_000_000) for i in range(40)}),
        "zip in zip": _zip_in_zip(),
        "entities": package(_entities()),
        "outside entity": package('<?xml version="1.0"?><!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/passwd">]><model>&x;</model>'),
        "outside dtd": package('<?xml version="1.0"?><!DOCTYPE m SYSTEM "http://127.0.0.1:9/x.dtd"><model/>'),
        "deep": package(model("<a>" * 100_000)),
        "deep in an object": package(model(f'<object id="1">{"<metadatagroup>" * 5000}</object>')),
        "components": package(_components(40, 10)),
        "components in a row": package(_components(5000, 1)),
        "component of itself": package(model('<object id="1"><components><component objectid="1"/></components></object>')),
        "items": package(model(ONE, '<item objectid="1"/>' * 30_000)),
        "index beyond": package(model(f'<object id="1">{mesh(faces=[*FACES, (0, 1, 99)])}</object>')),
        "index beyond behind warnings": package(model(f'<object id="1">{mesh(faces=[*FACES, (0, 1, 99)])}</object>'.replace("<vertices>", "<vertices>" + '<vertex x="0" y="0" z="0" odd="1"/>' * 300))),
        "index 2^31": package(model(f'<object id="1">{mesh(faces=[*FACES, (0, 1, 2147483647)])}</object>')),
        "index digits": package(model(f'<object id="1">{mesh(faces=[*FACES, (0, 1, LONG)])}</object>')),
        "numbers": package(model(f'<object id="1">{mesh(vertices=[("1e999", "nan", LONG), *CUBE])}</object>')),
        "id digits": package(model(f'<object id="{LONG}">{mesh()}</object>')),
        "objects": package(model("".join(f'<object id="{i}">{mesh(CUBE[:4], FACES[:4])}</object>' for i in range(1, 4000)))),
        "attributes": package(model(f'<object id="1" {" ".join(f"a{i}={chr(34)}{chr(34)}" for i in range(30_000))}>{mesh()}</object>')),
        "name spaces": package(model(ONE, attributes=" ".join(f'xmlns:n{i}="urn:n{i}"' for i in range(20_000)))),
        "attribute long": package(model(f'<object id="1" name="{"n" * 3_000_000}">{mesh()}</object>')),
        "metadata": package(model(ONE).replace("<resources>", f'{"<metadata name=" + chr(34) + "a" + chr(34) + ">x</metadata>"}' * 20_000 + "<resources>")),
        "transform": package(model(ONE, f'<item objectid="1" transform="{"nan " * 12}"/>')),
        "transform huge": package(model(ONE, f'<item objectid="1" transform="{"1e38 " * 12}"/>')),
        "transform long": package(model(ONE, f'<item objectid="1" transform="{"1 " * 100_000}"/>')),
        "way out": package(model(ONE), {"../../out.txt": "x", "/etc/x": "x", "C:\\x": "x", "a\0b": "x"}),
        "entries": package(model(ONE), {f"e{i}": "" for i in range(15_000)}, packed=zipfile.ZIP_STORED),
        "one name": sound[:directory] + sound[directory:],
        "utf16": package(model(ONE, head='<?xml version="1.0" encoding="UTF-16"?>').encode("utf-16")),
        "no model": package(model(ONE), relations=RELATIONS.replace("3dmodel.model", "none.model")),
        "relations": package(model(ONE), relations=RELATIONS.replace("<Relationship ", "<Relationship Id='a' " * 3000)),
        "many relations": package(model(ONE), relations=RELATIONS.replace("</Relationships>", '<Relationship Target="/3D/3dmodel.model" Id="r" Type="x"/>' * 30_000 + "</Relationships>")),
        "types": package(model(ONE), types=TYPES.replace("</Types>", '<Default Extension="x" ContentType="y"/>' * 30_000 + "</Types>")),
        "config": package(model(ONE), {"Metadata/Slic3r_PE_model.config": '<config><object id="1">' + "<volume>" * 50_000}),
        "config index": package(model(ONE), {"Metadata/Slic3r_PE_model.config": f'<config><object id="1"><volume firstid="0" lastid="{LONG}"><metadata type="volume" key="volume_type" value="ParameterModifier"/></volume></object></config>'}),
        "config entities": package(model(ONE), {"Metadata/model_settings.config": _entities()}),
        "cut": sound[: len(sound) // 2],
        "no directory": sound[:directory],
        "directory only": sound[directory:],
        "sizes": _patched(sound, struct.pack("<I", len(model(ONE))), b"\xff\xff\xff\xff"),
        "method": sound.replace(b"\x14\0\0\0\x08\0", b"\x14\0\0\0\x63\0"),
        "encrypted": sound.replace(b"\x14\0\0\0\x08\0", b"\x14\0\x01\0\x08\0"),
        "noise inside": sound[:200] + NOISE[:500] + sound[700:],
        "comment": sound[:-2] + b"\xff\xff" + b"x" * 65535,
    }  # fmt: skip
    return made


def _step(
    data,
    head="FILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));\n",
):
    return f"ISO-10303-21;\nHEADER;\n{head}ENDSEC;\nDATA;\n{data}ENDSEC;\nEND-ISO-10303-21;\n"


STEP = {
    "million refs": _step("#1=SHAPE_REPRESENTATION('',(" + "#1," * 500_000 + "#1),#1);\n"),
    "lists": _step("#1=FOO(" + "(0.)," * 200_000 + "0.);\n"),
    "many refs in many": _step(("#1=FOO(" + "#2," * 15_000 + "0.);\n") * 20),
    "parts of one": _step("#1=(" + "A()" * 12_000 + ");\n"),
    "deep list": _step("#1=CARTESIAN_POINT(''," + "(" * 100_000 + "0." + ")" * 100_000 + ");\n"),
    "points": _step("".join(f"#{i}=CARTESIAN_POINT('',(0.,0.,0.));\n" for i in range(1, 30_000))),
    "one id": _step("#1=CARTESIAN_POINT('',(0.,0.,0.));\n" * 30_000),
    "id digits": _step(f"#{LONG}=CARTESIAN_POINT('',(0.,0.,0.));\n"),
    "cycle": _step("#1=SHAPE_DEFINITION_REPRESENTATION(#1,#1);\n"),
    "chain": _step("".join(f"#{i}=SHAPE_REPRESENTATION('',(#{i + 1}),#{i + 1});\n" for i in range(1, 20_000))),
    "text": _step(f"#1=CARTESIAN_POINT('{'x' * 1_000_000}',(0.,0.,0.));\n"),
    "open text": _step("#1=CARTESIAN_POINT('" * 20_000),
    "comment": _step("/*" * 200_000),
    "numbers": _step(f"#1=CARTESIAN_POINT('',(1.E999,{LONG}.,NaN));\n"),
    "header": _step("", "FILE_SCHEMA((" + "'A'," * 50_000 + "'B'));\n"),
    "no end": _step("#1=CARTESIAN_POINT('',(0.,0.,0.));\n")[:-20],
    "end first": "ISO-10303-21;\nEND-ISO-10303-21;\n" + "#1=A();\n" * 1000 + "END-ISO-10303-21;\n",
    "nothing": _step(""),
}
"""STEP texts; each costs two seconds of OCCT unless it is refused before."""


def _bytes(content):
    return content if isinstance(content, bytes) else content.encode()


def meshes():
    """Yield the name and the content of every mesh file."""
    for suffix, group in ((".stl", STL), (".obj", OBJ), (".ply", PLY), (".off", OFF), (".3mf", threemf())):
        for name, content in group.items():
            yield f"{name}{suffix}", _bytes(content)
    for path in sorted(CASES.iterdir()):
        yield path.name, path.read_bytes()
    for i, (name, content) in enumerate(ANY.items()):
        yield f"{name}{('.stl', '.obj', '.ply', '.off', '.3mf')[i % 5]}", content
        yield f"{name} again{('.ply', '.off', '.3mf', '.stl', '.obj')[i % 5]}", content


def steps():
    """Yield the name and the content of every STEP file."""
    for name, content in STEP.items():
        yield f"{name}.step", _bytes(content)


# --- TOML and JSON --------------------------------------------------------------------------------------------------

SPEC = """name = "s"
design = "embedded"
diameter_mm = 14.0
[[layers]]
material = "ecoflex-00-10"
wall_mm = 1.25
cap_mm = 1.25
[[layers]]
material = "dragon-skin-30"
wall_mm = 1.25
cap_mm = 1.25
"""
SYNTAX = {
    "dotted": f"{DEEP} = 1\n",
    "dotted header": f"[{DEEP}]\n",
    "dotted headers": "".join(f"[k{i}.{'.'.join('a' * 18)}]\n" for i in range(1000)),
    "dotted quotes": ".".join(['"a"'] * 500) + " = 1\n",
    "deep list": f"a = {'[' * 5000}{']' * 5000}\n",
    "deep table": f"a = {'{a=' * 5000}1{'}' * 5000}\n",
    "21 deep": f"a = {'[' * 25}{']' * 25}\n",
    "key": "k" * 100_000 + " = 1\n",
    "quoted key": '"' + "k" * 100_000 + '" = 1\n',
    "digits": f"a = {LONG}\n",
    "float digits": f"a = 0.{LONG}\n",
    "hexadecimal": f"a = 0x{'f' * 50_000}\n",
    "2^63": "a = 9223372036854775808\n",
    "2^64": "diameter_mm = 18446744073709551616\n",
    "1e400": "diameter_mm = 1e400\n",
    "keys": "".join(f"k{i} = 1\n" for i in range(25_000)),
    "entries": f"a = [{'1,' * 25_000}]\n",
    "tables": "".join(f"[[t]]\n[t.u]\nx = {i}\n" for i in range(8000)),
    "twice": "a = 1\na = 2\n",
    "twice deep": "[a]\nb = 1\n[a.b.c]\n",
    "text": f"name = '{'n' * 2_000_000}'\n",
    "escapes": 'name = "' + "\\n" * 500_000 + '"\n',
    "nul": 'name = "\\u0000"\n',
    "half": 'name = "\\ud800"\n',
    "direction": 'name = "\u202e\u2066x"\n',
    "terminal": 'name = "\\u001b[2J"\n"\\u001b]0;x" = 1\n',
    "open text": 'name = """' + '\\"' * 200_000,
    "date": "a = 1979-05-27T07:32:00Z\n",
    "bom": "\ufeff" + SPEC,
    "json": json.dumps({"design": "embedded", "layers": []}),
    "nothing": "\n# only a comment\n",
}
VALUES = {
    "nan": SPEC.replace("14.0", "nan"),
    "inf": SPEC.replace("14.0", "-inf"),
    "huge": SPEC.replace("14.0", "1e308"),
    "tiny": SPEC.replace("1.25", "5e-324"),
    "kinds": SPEC.replace("14.0", "[{a = 1}]").replace('"s"', "{}"),
    "zero device": SPEC.replace('"embedded"', '"/dev/zero.step"'),
    "device code": SPEC.replace('"embedded"', '"/dev/zero.py:f"'),
    "pipe": SPEC.replace('"embedded"', '"special/pipe.stl"'),
    "way out": SPEC.replace('"s"', '"../../../s"'),
    "slash": SPEC.replace('"s"', '"/tmp/s"'),
    "name long": SPEC.replace('"s"', f'"{"n" * 5000}"'),
    "layers": SPEC + '[[layers]]\nmaterial = "ecoflex-00-10"\nwall_mm = 1.25\n' * 3000,
    "materials": SPEC + "".join(f"[materials.m{i}]\nlike = 'ecoflex-00-10'\n" for i in range(5000)),
    "fit": SPEC + '[estimate]\nfit = "/dev/zero"\n',
    "fit text": SPEC + f'[estimate]\nfit = "a.toml"\nfit_source = "{DEEP} = 1"\n',
    "source": SPEC.replace('"embedded"', '"a.step"') + "",
    "bodies": f'design_source = "unitcad bodies 1: a.step\\nlayer1 {"A" * 4000} {"B" * 4000}\\n"\n' + SPEC.replace('"embedded"', '"a.step"'),
    "tolerance": SPEC + "[output]\ntolerance_mm = 1e-9\n",
    "cavities": SPEC + "[moulds]\ncavities = [100000, 100000]\n",
    "parameters": SPEC + "[parameters]\n" + "".join(f"p{i} = 1\n" for i in range(5000)),
    "unknown": SPEC + "".join(f"unknown{i} = 1\n" for i in range(3000)),
    "markup": SPEC.replace('"s"', '"<script>"'),
    "unit": SPEC.replace("14.0", '"14 mm"'),
}  # fmt: skip
ARRAY = """name = "a"
array = "pockets"
unit = "embedded"
[layout]
kind = "grid"
columns = 2
rows = 2
pitch_mm = 22
"""
ARRAYS = {
    "dotted": ARRAY + f"{DEEP} = 1\n",
    "dotted unit": ARRAY.replace("unit =", f"unit.{DEEP} ="),
    "columns": ARRAY.replace("columns = 2", "columns = 1000000000"),
    "rings": ARRAY.replace('"grid"', '"hexagon"').replace("columns = 2\nrows = 2", "rings = 100000000"),
    "ring": ARRAY.replace('"grid"', '"ring"').replace("columns = 2\nrows = 2", "count = 1000000000"),
    "pitch": ARRAY.replace("22", "1e300"),
    "pitch none": ARRAY.replace("22", "0"),
    "itself": ARRAY.replace('"embedded"', '"itself.toml"'),
    "device": ARRAY.replace('"embedded"', '"/dev/zero"'),
    "places": ARRAY + "[[place]]\nat = 'A1'\n" * 6000,
    "cyclic names": ARRAY.replace('"embedded"', '{like = {like = {like = "embedded"}}}'),
    "nan": ARRAY.replace("22", "nan"),
    "kinds": ARRAY.replace('"grid"', "['grid']"),
}
SWEEPS = {
    "product": 'base = "embedded"\n[sweep]\n' + "".join(f'"layers.{i}.wall_mm" = {{ start = 1, stop = 2, num = 100000 }}\n' for i in (0, 1)) + '"diameter_mm" = { start = 14, stop = 20, num = 100000 }\n',
    "range": 'base = "embedded"\n[sweep]\ndiameter_mm = { start = 1, stop = 2, num = 1000000000000 }\n',
    "range nan": 'base = "embedded"\n[sweep]\ndiameter_mm = { start = nan, stop = inf, num = 3 }\n',
    "list": f'base = "embedded"\n[sweep]\ndiameter_mm = [{", ".join(str(14 + i * 1e-4) for i in range(15_000))}]\n',
    "itself": 'base = "itself.toml"\n[sweep]\ndiameter_mm = [14, 15]\n',
    "bases": f'base = [{", ".join(["chr"] * 3)}]\n[sweep]\nx = 1\n'.replace("chr", '"embedded"'),
    "device": 'base = "/dev/zero"\n[sweep]\ndiameter_mm = [14]\n',
    "dotted": f'base = "embedded"\n[sweep]\n"{DEEP}" = [1]\n',
    "dotted set": f'base = "embedded"\n[set]\n{DEEP} = 1\n[sweep]\ndiameter_mm = [14]\n',
    "cases": 'base = "embedded"\n[sweep]\nmode = "cases"\n' + "[[sweep.cases]]\ndiameter_mm = 14\n" * 6000,
    "same": 'base = "embedded"\n[sweep]\ndiameter_mm = [' + "14.0," * 15_000 + "]\n",
    "names": 'base = "embedded"\n[sweep]\nname = ["../../x", "/x"]\n',
    "nested": 'base = "embedded"\n[sweep]\nlayers = [[[[[[[[1]]]]]]]]\n',
}  # fmt: skip
CAMPAIGN = """name = "c"
[sensor]
quantity = "displacement"
unit = "um"
{settings}
[[unit]]
name = "u"
reference = ["{record}"]
edge = ["{record}"]
"""
CAMPAIGNS = {
    "dotted": CAMPAIGN.format(settings="", record="x.csv") + f"{DEEP} = 1\n",
    "device": CAMPAIGN.format(settings="", record="/dev/zero.csv"),
    "pipe": CAMPAIGN.format(settings="", record="special/pipe.csv"),
    "way out": CAMPAIGN.format(settings="", record="../../../../etc/passwd.csv"),
    "records": CAMPAIGN.format(settings="", record='x.csv", "' * 5000),
    "units": CAMPAIGN.format(settings="", record="x.csv") + '[[unit]]\nname = "v"\nreference = []\nedge = []\n' * 4000,
    "scale": CAMPAIGN.format(settings="scale = 1e308", record="x.csv"),
    "itself": CAMPAIGN.format(settings="", record="itself.toml"),
}
FIT = """name = "f"
[[unit]]
name = "u"
spec = "{spec}"
frequency_hz = 130.0
level = {{ value = {value}, low = 0.086, high = 0.112 }}
"""
FITS = {
    "dotted": FIT.format(spec="embedded", value=0.1) + f"{DEEP} = 1\n",
    "device": FIT.format(spec="/dev/zero", value=0.1),
    "itself": FIT.format(spec="itself.toml", value=0.1),
    "nan": FIT.format(spec="embedded", value="nan"),
    "huge": FIT.format(spec="embedded", value="1e300"),
    "units": "".join(FIT.format(spec="embedded", value=0.1).replace('"u"', f'"u{i}"').replace('name = "f"\n', "") for i in range(2000)),
    "cast": FIT.format(spec="embedded", value=0.1).replace('spec = "embedded"', 'cast = "/dev/zero"'),
    "measured": FIT.format(spec="embedded", value=0.1).replace("level = ", 'measured = "/dev/zero"\nlevel = '),
}  # fmt: skip
TARGETS = {
    "dotted": f"[target]\nedge_max = 0.06\n[spec.{DEEP}]\n",
    "steps": "[target]\nedge_max = 0.06\n[vary]\nwall_mm = [0.3, 20]\ncap_mm = [0.3, 20]\ndiameter_mm = [8, 60]\nstep_mm = 0.01\ndiameter_step_mm = 0.01\n",
    "nan": "[target]\nedge_max = nan\n",
    "materials": f"[target]\nedge_max = 0.06\n[at_hand]\nmaterials = [{', '.join(['chr'] * 9000)}]\n".replace("chr", '"x"'),
    "fit": '[target]\nedge_max = 0.06\n[estimate]\nfit = "/dev/zero"\n',
    "impossible": "[target]\nedge_max = 0.001\nprobability_min = 0.99\n",
    "spec": "[target]\nedge_max = 0.06\n[spec.motor]\nx = 1\n",
}  # fmt: skip
PHANTOM = 'name = "p"\n[[layers]]\nname = "l"\nsilicone = "ecoflex-00-10"\nthinner_pct = 75.0\nthickness_mm = {}\n'
PHANTOMS = {
    "dotted": PHANTOM.format(4) + f"{DEEP} = 1\n",
    "layers": "".join(PHANTOM.format(4).replace('"l"', f'"l{i}"').replace('name = "p"\n', "") for i in range(3000)),
    "nan": PHANTOM.format("nan"),
    "thick": PHANTOM.format("1e300"),
    "thin": PHANTOM.format("1e-300"),
    "way out": PHANTOM.format(4).replace('"p"', '"../../p"'),
    "width": "unit_diameter_mm = 1e9\n" + PHANTOM.format(4),
}
CHECKS = {
    "dotted": f"[check]\n{DEEP} = 1\n",
    "select": f"[check]\nselect = [{', '.join(['chr'] * 9000)}]\n".replace("chr", '"T"'),
    "ignores": "[check.per-file-ignores]\n" + "".join(f'"*{i}*a*b*c*d*" = ["T"]\n' for i in range(3000)),
    "pattern": '[check.per-file-ignores]\n"' + "*a" * 50 + '" = ["T"]\n',
    "exclude": f'[check]\nexclude = ["{"[" * 200}", "{"*" * 200}x"]\n',
    "numbers": "[check]\ntimeout = 1e308\nmax-faces = 9223372036854775807\nmemory = 9223372036854775807\n",
    "nan": "[check]\ntimeout = nan\n",
    "printer": '[check]\nprinter = "../../x"\n',
}  # fmt: skip
TOML = {
    "spec": {**VALUES, "sound": SPEC},
    "array": ARRAYS,
    "sweep": SWEEPS,
    "campaign": CAMPAIGNS,
    "fit": FITS,
    "target": TARGETS,
    "phantom": PHANTOMS,
    "check": CHECKS,
}
"""TOML texts by the kind of file that they are; those of SYNTAX and ANY are none."""
JSON = {
    "list": "[1, 2]",
    "number": "5",
    "deep": '{"a": ' + "[" * 5000 + "]" * 5000 + "}",
    "21 deep": '{"a": ' + "[" * 25 + "]" * 25 + "}",
    "brackets": "[" * 100_000,
    "tables": "[" + "{}," * 250_000 + "{}]",
    "key": json.dumps({"k" * 100_000: 1}),
    "twice": '{"parts": [], "parts": {}}',
    "nan": '{"a": NaN}',
    "1e999": '{"a": 1e999}',
    "digits": f'{{"a": {LONG}}}',
    "2^64": '{"a": 18446744073709551616}',
    "half": '{"name": "\\ud800"}',
    "nul key": '{"\\u0000": 1}',
    "parts": json.dumps({"parts": [{"name": "a", "role": "unit", "files": {"stl": {"path": "../../etc/passwd", "sha256": "0", "copies": 1}}}]}),
    "parts absolute": json.dumps({"parts": [{"name": "a", "role": "unit", "files": {"stl": {"path": "/dev/zero", "sha256": "0", "copies": 1}}}]}),
    "parts huge": json.dumps({"parts": [{"name": "a", "role": "tool", "files": {"stl": {"path": "a.stl", "sha256": "0", "copies": 2**62}}, "volume_mm3": 1e308, "solids": 2**62}]}),
    "parts many": json.dumps({"parts": [{"name": str(i), "role": "unit", "files": {}} for i in range(20_000)]}),
    "batch": json.dumps({"columns": ["a"] * 3000, "variants": [{"folder": "../.."}] * 300, "name": "x", "batch": "0"}),
    "text": json.dumps({"a": "y" * 3_000_000}),
}  # fmt: skip


# --- recordings and tables ------------------------------------------------------------------------------------------


def _rows(count=400, step=0.0005):
    return "".join(f"{i * step:.6f},{(i * 7919) % 97 / 97:.6f}\n" for i in range(count))


TABLES = {
    "sound": "Time (s),Force (N)\n" + _rows(),
    "columns": "1," * 30_000 + "1\n" + "1," * 30_000 + "1\n",
    "rows": "0,0\n" * 200_000,
    "ragged": "".join("1," * (i % 50) + "1\n" for i in range(2000)),
    "quotes": '"1","2\n' * 5000,
    "nan": "t,x\n" + "0,nan\n1,inf\n" * 300,
    "huge": "t (s),x (um)\n" + "".join(f"{i}e300,{i}e308\n" for i in range(300)),
    "digits": f"t,x\n0,{LONG}\n1,{LONG}\n",
    "same time": "t (s),x (um)\n" + "0,1\n" * 500,
    "falling time": "t (s),x (um)\n" + "".join(f"{500 - i},1\n" for i in range(500)),
    "restart": "t (s),x (um)\n" + _rows() + _rows(),
    "header": "x" * 900_000 + "\n" + _rows(),
    "header lines": "# a b c (d) [e]\n" * 50_000 + _rows(),
    "words": "a,b,c\n" * 50_000,
    "thousands": "1,000,000,000,000\n" * 5000,
    "signs": "----,####\n" * 5000 + _rows(),
    "delimiters": ";,\t ;,\t \n" * 20_000 + _rows(),
    "lvm": "LabVIEW Measurement\n***End_of_Header***\n" * 3000 + _rows(),
    "utf16": ("t,x\n" + _rows()).encode("utf-16"),
    "nul": ("t,x\n" + _rows()).replace("1", "\0").encode(),
    "one row": "1,2\n",
    "constant": "t (s),x (um)\n" + "".join(f"{i * 0.0005:.6f},1\n" for i in range(500)),
    "exponents": "".join(f"1e{i},-1e-{i}\n" for i in range(400)),
    "strain": "strain (%),stress (kPa)\n" + "".join(f"{i},{i * i}\n" for i in range(3)),
    "strain falls": "strain (%),stress (kPa)\n" + "".join(f"{-i},{-i}\n" for i in range(300)),
}


def _wav(channels=1, rate=2000, bits=16, size=800, kind=1, riff=None, align=None):
    data = bytes((i * 37) % 256 for i in range(min(size, 100_000)))
    block = channels * bits // 8 if align is None else align
    form = struct.pack(
        "<HHIIHH", kind, channels & 0xFFFF, rate & 0xFFFFFFFF, (rate * block) & 0xFFFFFFFF, block & 0xFFFF, bits
    )
    inside = b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", size & 0xFFFFFFFF) + data
    return b"RIFF" + struct.pack("<I", len(inside) if riff is None else riff) + inside


WAVS = {
    "sound": _wav(),
    "no channels": _wav(0),
    "channels": _wav(65535),
    "no rate": _wav(rate=0),
    "rate": _wav(rate=0xFFFFFFFF),
    "no bits": _wav(bits=0),
    "bits": _wav(bits=65535),
    "odd bits": _wav(bits=13),
    "size huge": _wav(size=0xFFFFFFF0),
    "size huge and true": _wav(size=0xFFFFFFF0, riff=0xFFFFFFFF),
    "float 64": _wav(bits=64, kind=3),
    "compressed": _wav(kind=0x55),
    "align": _wav(align=0),
    "chunks": b"RIFF" + struct.pack("<I", 8 * 50_000 + 4) + b"WAVE" + b"junk\0\0\0\0" * 50_000,
    "chunk of itself": b"RIFF" + struct.pack("<I", 40) + b"WAVEfmt \xff\xff\xff\xff" + bytes(28),
    "rf64": b"RF64\xff\xff\xff\xffWAVEds64" + struct.pack("<IQQQI", 28, 2**60, 2**60, 2**60, 0),
    "cut": _wav()[:30],
    "rifx": b"RIFX" + _wav()[4:],
}


def _mat(name, dims, payload=b"", kind=6, declared=None, packed=False):
    """A MAT file of version 5 with one matrix."""
    flags = struct.pack("<IIII", 6, 8, kind, 0)
    shape = struct.pack("<II", 5, 4 * len(dims)) + struct.pack(f"<{len(dims)}i", *dims) + bytes(-4 * len(dims) % 8)
    label = struct.pack("<II", 1, len(name)) + name + bytes(-len(name) % 8)
    real = struct.pack("<II", 9, len(payload) if declared is None else declared) + payload
    inside = flags + shape + label + real
    whole = struct.pack("<II", 14, len(inside)) + inside
    if packed:
        pressed = zlib.compress(whole, 9)
        whole = struct.pack("<II", 15, len(pressed)) + pressed
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + whole


MATS = {
    "sound": _mat(b"x", (100, 1), struct.pack("<100d", *range(100))),
    "dims huge": _mat(b"x", (2**31 - 1, 2**31 - 1), bytes(80)),
    "dims negative": _mat(b"x", (-5, -5), bytes(80)),
    "dims many": _mat(b"x", (1,) * 4000, bytes(80)),
    "declared": _mat(b"x", (10, 1), bytes(80), declared=2**32 - 8),
    "bomb": _mat(b"x", (8_000_000, 1), bytes(64_000_000), packed=True),
    "name": _mat(b"n" * 500_000, (10, 1), bytes(80)),
    "kind": _mat(b"x", (10, 1), bytes(80), kind=200),
    "cell": _mat(b"x", (2**31 - 1, 1), bytes(80), kind=1),
    "struct": _mat(b"x", (1000, 1000), bytes(80), kind=2),
    "cut": _mat(b"x", (100, 1), struct.pack("<100d", *range(100)))[:200],
    "version 4": struct.pack("<5I", 0, 2**31 - 1, 2**31 - 1, 0, 2) + b"x\0" + bytes(80),
    "v7.3 head": b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + bytes(500),
    "big endian": b"MATLAB 5.0 MAT-file".ljust(124) + b"\1\0MI" + NOISE[:500],
}


def _hdf5(fill):
    import h5py

    made = io.BytesIO()
    with h5py.File(made, "w") as file:
        fill(file, h5py)
    return made.getvalue()


def _groups(file, h5py):
    node = file
    for _ in range(400):
        node = node.create_group("g")
    node["x"] = [1.0, 2.0]
    node["up"] = h5py.SoftLink("/g")
    file["again"] = file["g"]
    file["g/g/again"] = file["g"]


def _hdf5_files():
    """HDF5 files by name; each is small."""
    sound = _hdf5(lambda file, h5py: file.create_dataset("x", data=[float(i % 7) for i in range(500)]))
    return {
        "sound": sound,
        "chunks not written": _hdf5(lambda f, h: f.create_dataset("x", (10**12,), "f8", chunks=(10**6,))),
        "shape huge": _hdf5(lambda f, h: f.create_dataset("x", (2**40, 2**20), "f8", chunks=(64, 64))),
        "bomb": _hdf5(lambda f, h: f.create_dataset("x", data=b"\0" * 0 or numpy.zeros(30_000_000), chunks=(1_000_000,), compression="gzip", compression_opts=9)),
        "bomb of bytes": _hdf5(lambda f, h: f.create_dataset("x", data=numpy.zeros(150_000_000, "i1"), chunks=(1_000_000,), compression="gzip", compression_opts=9)),
        "many sets": _hdf5(lambda f, h: [f.create_dataset(f"x{i}", data=[1.0, 2.0]) for i in range(3000)] and None),
        "groups": _hdf5(_groups),
        "outside": _hdf5(lambda f, h: f.__setitem__("x", h.ExternalLink("/etc/passwd", "/x"))),
        "attribute": _hdf5(lambda f, h: f.create_dataset("x", data=[1.0, 2.0]).attrs.__setitem__("unit", "u" * 60_000)),
        "text": _hdf5(lambda f, h: f.create_dataset("x", data=["a", "b"])),
        "wide": _hdf5(lambda f, h: f.create_dataset("x", data=numpy.zeros((2, 200_000)))),
        "complex": _hdf5(lambda f, h: f.create_dataset("x", data=[1j, 2j])),
        "cut": sound[: len(sound) // 2],
        "noise": sound[:100] + NOISE[:600] + sound[700:],
        "head": sound[:96],
    }  # fmt: skip


def _tdms(objects=1, raw=b"", version=4713, toc=0x0E, next_at=None, raw_at=None, path=b"/'g'/'c'", values=2, kind=10):
    index = struct.pack("<IIIQ", 20, kind, 1, values)
    meta = struct.pack("<I", objects) + struct.pack("<I", len(path)) + path + index + struct.pack("<I", 0)
    next_at = len(meta) + len(raw) if next_at is None else next_at
    raw_at = len(meta) if raw_at is None else raw_at
    return b"TDSm" + struct.pack("<IIQQ", toc, version, next_at & (2**64 - 1), raw_at & (2**64 - 1)) + meta + raw


TDMS = {
    "sound": _tdms(raw=struct.pack("<2d", 1, 2)),
    "values huge": _tdms(raw=bytes(16), values=2**62),
    "objects huge": _tdms(objects=2**32 - 1),
    "path huge": b"TDSm" + struct.pack("<IIQQI", 0x0E, 4713, 100, 80, 1) + struct.pack("<I", 2**32 - 1) + b"x" * 80,
    "next huge": _tdms(next_at=2**63),
    "next unknown": _tdms(raw=bytes(16), next_at=-1),
    "next itself": _tdms(next_at=0) * 5000,
    "raw before": _tdms(raw_at=-8),
    "version": _tdms(version=2**32 - 1),
    "kind": _tdms(kind=2**31),
    "segments": _tdms(raw=struct.pack("<2d", 1, 2)) * 3000,
    "cut": _tdms(raw=bytes(16))[:40],
    "daqmx": _tdms(toc=0xFFFFFFFF, raw=bytes(160)),
    "channels": b"".join(_tdms(raw=bytes(16), path=b"/'g'/'c%d'" % i) for i in range(2000)),
}


def _uff(points="4", head="    58", end="    -1\n    -1\n", values="  1.0e0  2.0e0  3.0e0  4.0e0\n", spacing="1"):
    lines = ["    -1", head, "NONE", "NONE", "01-Jan-20 00:00:00", "NONE", "NONE"]
    lines.append("    1         0    0         0 edge                1   3 NONE                0   0")
    lines.append(f"         2 {points:>9} {spacing:>9}  0.00000e+00  5.00000e-04  0.00000e+00")
    lines.append("        17    0    0    0 NONE                 s")
    lines += ["         8    0    0    0 edge                 um"] + [
        "         0    0    0    0 NONE                 NONE"
    ] * 2
    return "\n".join(lines) + "\n" + values + end.split("\n", 1)[0] + "\n"


UFF = {
    "sound": _uff(),
    "points huge": _uff(points="999999999"),
    "points digits": _uff(points=LONG),
    "points negative": _uff(points="-5"),
    "binary": _uff(head="    58b     1     2          11        999999999     0     0           0           0"),
    "sets": _uff() * 1500,
    "marks": "    -1\n" * 100_000,
    "kind": _uff(head="999999"),
    "kind letters": _uff(head="abcdef"),
    "values": _uff(values="x" * 100_000 + "\n"),
    "values huge": _uff(values="1e999 " * 4 + "\n"),
    "spacing": _uff(spacing="0"),
    "cut": _uff()[:300] + "\n    -1\n",
}


def recordings():
    """Yield the name and the content of every recording."""
    groups = ((".csv", TABLES), (".wav", WAVS), (".mat", MATS), (".h5", _hdf5_files()), (".tdms", TDMS), (".uff", UFF))
    for suffix, group in groups:
        for name, content in group.items():
            yield f"{name}{suffix}", _bytes(content)
    endings = (".csv", ".wav", ".mat", ".h5", ".tdms", ".uff", ".txt", ".lvm", ".unv", ".hdf5")
    for i, (name, content) in enumerate(ANY.items()):
        yield f"{name} any{endings[i % len(endings)]}", content


def tables():
    """Yield the name and the content of every table of a tensile or dynamic test."""
    for name, content in TABLES.items():
        yield f"{name}.csv", _bytes(content)
    for name, content in list(ANY.items())[::3]:
        yield f"{name} any.csv", content

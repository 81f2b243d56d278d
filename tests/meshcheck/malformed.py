"""Files that are wrong, each with the code that must be found: `python malformed.py FOLDER` writes them all.

A case's options are those of `unitcad.check.Options`; "printer" is a name of the catalogue.
"""

import sys
import warnings
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import malformed_files
import numpy as np
from shapes import (
    CUBE_CORNERS,
    CUBE_FACES,
    PNG,
    ROOT_RELS,
    START,
    TEXTURE,
    THUMBNAIL,
    TICKET,
    TYPES,
    box,
    fin,
    mesh_xml,
    model_xml,
    package,
    prism,
    rels_xml,
    stl,
    text_stl,
)

from unitcad.catalogue import printers
from unitcad.meshcheck import Limits, Options

Content = bytes | str


@dataclass(frozen=True)
class Case:
    """A file, the code that it must give, and how it is judged."""

    name: str
    code: str
    content: Content
    options: dict[str, Any] = field(default_factory=dict)

    def data(self):
        return self.content.encode() if isinstance(self.content, str) else self.content


def options(printer=None, **rest):
    """Options from plain values, as a malformed case names them; those of Limits stand among them."""
    bounds = {key: rest.pop(key) for key in Limits.__dataclass_fields__.keys() & rest}
    return Options(limits=Limits(**bounds), printer=printers()[printer] if printer else None, **rest)


def cases():
    """All of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zipfile warns of the duplicate entry that is wanted
        made = [
            *malformed_files.files(),
            *malformed_files.text_meshes(),
            *_packages(),
            *_models(),
            *_values(),
            *_topology(),
            *_geometry(),
            *_printing(),
        ]
    return [
        Case(name, code, content, dict(rest))
        for name, code, content, *more in made
        for rest in [more[0] if more else {}]
    ]


def _packages():
    override = TYPES.replace("</Types>", '<Override PartName="/3D/3dmodel.model" ContentType="text/plain"/></Types>')
    model_rels = "3D/_rels/3dmodel.model.rels"
    zeros = b"<!--" + b" " * 40_000_000 + b"-->"
    return [
        ("no-types.3mf", "P001", package(types=None)),
        ("bad-types.3mf", "P001", package(types="<Types")),
        ("types-twice.3mf", "P001", package(types=TYPES.replace(
            "</Types>", '<Default Extension="PNG" ContentType="image/png"/></Types>'))),
        ("model-type.3mf", "P001", package(types=override)),
        ("rels-gone.3mf", "P002", package(rels=None)),
        ("rels-bad.3mf", "P002", package(rels="<Relationships")),
        ("rel-no-id.3mf", "P002", package(rels=ROOT_RELS.replace('Id="r0"', ""))),
        ("thumbnail-gone.3mf", "P002", package(rels=rels_xml((START, "/3D/3dmodel.model"), (THUMBNAIL, "/a.png")))),
        ("no-start.3mf", "P003", package(rels=rels_xml())),
        ("start-gone.3mf", "P003", package(rels=rels_xml((START, "/3D/other.model")))),
        ("two-starts.3mf", "P003", package(
            rels=rels_xml((START, "/3D/3dmodel.model"), (START, "/3D/b.model")), more=[("3D/b.model", model_xml())])),
        ("twice.3mf", "P004", package(more=[("3D/3DModel.model", model_xml())])),
        ("climbs.3mf", "P005", package(more=[("../../evil.txt", "x")])),
        ("absolute.3mf", "P005", package(more=[("/etc/evil", "x")])),
        ("drive.3mf", "P005", package(more=[("C:/evil", "x")])),
        ("dot.3mf", "P005", package(more=[("3D/evil.", "x")])),
        ("doctype.3mf", "P006", package(model_xml().replace("<model", "<!DOCTYPE model><model", 1))),
        ("entities.3mf", "P006", package(model_xml().replace(
            "<model", '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]><model', 1))),
        ("doctype-rels.3mf", "P006", package(rels=ROOT_RELS.replace("<Relationships", "<!DOCTYPE r><Relationships"))),
        ("external.3mf", "P007", package(more=[
            (model_rels, rels_xml((TEXTURE, "http://x.test/a.png"), mode=' TargetMode="External"'))])),
        ("scheme.3mf", "P007", package(more=[(model_rels, rels_xml((TEXTURE, "file:///etc/passwd")))])),
        ("bomb.3mf", "P008", package(more=[("3D/zeros.bin", zeros)])),
        ("method.3mf", "P008", package(compression=zipfile.ZIP_LZMA)),
        ("two-thumbnails.3mf", "P020", package(rels=rels_xml(
            (START, "/3D/3dmodel.model"), (THUMBNAIL, "/a.png"), (THUMBNAIL, "/b.png")),
            more=[("a.png", PNG), ("b.png", PNG)])),
        ("two-tickets.3mf", "P020", package(more=[
            (model_rels, rels_xml((TICKET, "/a.xml"), (TICKET, "/b.xml"))), ("a.xml", "<a/>"), ("b.xml", "<a/>")])),
    ]  # fmt: skip


def _models():
    obj = f'<object id="1">{mesh_xml()}</object>'
    nested = obj + "".join(
        f'<object id="{i}"><components>{f"<component objectid={chr(34)}{i - 1}{chr(34)}/>" * 10}</components></object>'
        for i in range(2, 12)
    )
    deep = obj + "".join(
        f'<object id="{i}"><components><component objectid="{i - 1}"/></components></object>' for i in range(2, 100)
    )
    base = '<basematerials id="5"><base name="a" displaycolor="#FF0000"/></basematerials>'
    colors = '<m:colorgroup id="6"><m:color color="#FFFFFF"/></m:colorgroup>'

    def item(transform):
        return f'<build><item objectid="1" transform="{transform}"/></build>'

    return [
        ("expands.3mf", "P009", package(model_xml(nested, '<build><item objectid="11"/></build>'))),
        ("deep.3mf", "P009", package(model_xml(deep, '<build><item objectid="99"/></build>'))),
        ("unit.3mf", "P010", package(model_xml(attributes='unit="millimetre"'))),
        ("index.3mf", "P011", package(model_xml().replace('v3="3"', 'v3="8"', 1))),
        ("pindex.3mf", "P011", package(model_xml(base + f'<object id="1" pid="5" pindex="1">{mesh_xml()}</object>'))),
        ("no-object.3mf", "P012", package(model_xml(build='<build><item objectid="2"/></build>'))),
        ("recursive.3mf", "P012", package(model_xml(
            '<object id="1"><components><component objectid="1"/></components></object>'))),
        ("forward.3mf", "P012", package(model_xml(
            '<object id="2"><components><component objectid="1"/></components></object>' + obj))),
        ("other.3mf", "P012", package(model_xml(obj.replace('id="1"', 'id="1" type="other"')))),
        ("singular.3mf", "P013", package(model_xml(build=item("1 0 0 0 1 0 0 0 0 0 0 0")))),
        ("nan-matrix.3mf", "P013", package(model_xml(build=item("nan 0 0 0 1 0 0 0 1 0 0 0")))),
        ("large-matrix.3mf", "P013", package(model_xml(build=item("1e300 0 0 0 1e300 0 0 0 1e300 0 0 0")))),
        ("far-item.3mf", "V002", package(model_xml(build=item("1 0 0 0 1 0 0 0 1 1e30 0 0")))),
        ("large-nested.3mf", "V001", package(model_xml(obj + "".join(
            f'<object id="{i}"><components><component objectid="{i - 1}" transform="1e30 0 0 0 1e30 0 0 0 1e30 0 0 0"/>'
            "</components></object>" for i in range(2, 40)), '<build><item objectid="39"/></build>'))),
        ("no-item.3mf", "P014", package(model_xml(build="<build/>"))),
        ("mirrored.3mf", "P015", package(model_xml(build=item("-1 0 0 0 1 0 0 0 1 20 0 0")))),
        ("extension.3mf", "P016", package(model_xml(attributes='requiredextensions="z" xmlns:z="urn:z"'))),
        ("extension-prefix.3mf", "P016", package(model_xml(attributes='requiredextensions="nowhere"'))),
        ("no-build.3mf", "P017", package(model_xml(build=None))),
        ("metadata-twice.3mf", "P017", package(model_xml(before='<metadata name="Title"/><metadata name="Title"/>'))),
        ("metadata-nameless.3mf", "P017", package(model_xml(before="<metadata>x</metadata>"))),
        ("space.3mf", "P017", package(model_xml(attributes='xml:space="preserve"'))),
        ("xsi.3mf", "P017", package(model_xml(
            attributes='xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="a b"'))),
        ("unknown-element.3mf", "P017", package(model_xml(before="<extra/>"))),
        ("unknown-attribute.3mf", "P017", package(model_xml(obj.replace("<object", '<object colour="red"')))),
        ("short-matrix.3mf", "P017", package(model_xml(build=item("1 0 0")))),
        ("id-zero.3mf", "P017", package(model_xml(obj.replace('id="1"', 'id="0"')))),
        ("one-triangle.3mf", "P017", package(model_xml(f'<object id="1">{mesh_xml(faces=CUBE_FACES[:1])}</object>'))),
        ("same-vertex.3mf", "P017", package(model_xml().replace('v1="0" v2="1" v3="3"', 'v1="0" v2="0" v3="3"'))),
        ("wrong-root.3mf", "P017", package("<model/>")),
        ("id-twice.3mf", "P018", package(model_xml(obj + obj))),
        ("pid-gone.3mf", "P019", package(model_xml(obj.replace("<object", '<object pid="5" pindex="0"')))),
        ("pindex-alone.3mf", "P019", package(model_xml(obj.replace("<object", '<object pindex="0"')))),
        ("texture-gone.3mf", "P019", package(model_xml(
            '<m:texture2d id="7" path="/3D/a.png" contenttype="image/png"/>' + obj))),
        ("matid-color.3mf", "P019", package(model_xml(
            colors + '<m:compositematerials id="8" matid="6" matindices="0"><m:composite values="1"/>'
            + "</m:compositematerials>" + obj))),
        ("lattice.3mf", "P021", package(model_xml(lattice('<b:beam v1="0" v2="1"/>')))),
        ("lattice-index.3mf", "P011", package(model_xml(lattice('<b:beam v1="0" v2="8"/>')))),
        ("lattice-same.3mf", "P017", package(model_xml(lattice('<b:beam v1="3" v2="3"/>')))),
        ("lattice-radius.3mf", "P017", package(model_xml(lattice('<b:beam v1="0" v2="1" r2="-1"/>')))),
        ("lattice-set.3mf", "P011", package(model_xml(lattice('<b:beam v1="0" v2="1"/>', '<b:ref index="1"/>')))),
        ("slices.3mf", "P021", package(model_xml(sliced(obj)))),
        ("slices-tilted.3mf", "P022", package(model_xml(sliced(obj), item("1 0 0 0 0 1 0 -1 0 0 0 0")))),
        ("slices-stretched.3mf", "P022", package(model_xml(sliced(obj), item("1 0 0 0 1 0 0 0 2 0 0 0")))),
        ("two-colors.3mf", "P019", package(model_xml(
            colors + colors.replace('"6"', '"7"')
            + '<m:multiproperties id="8" pids="6 7"><m:multi pindices="0 0"/></m:multiproperties>' + obj))),
    ]  # fmt: skip


def lattice(beams, sets=""):
    """An object of a cube with beams of radius 1 on its vertices."""
    sets = f"<b:beamsets><b:beamset>{sets}</b:beamset></b:beamsets>" if sets else ""
    beams = f'<b:beamlattice radius="1" minlength="0.01"><b:beams>{beams}</b:beams>{sets}</b:beamlattice>'
    return f'<object id="1">{mesh_xml()}</object>'.replace("</mesh>", f"{beams}</mesh>")


def sliced(one):
    """An object with a stack of one slice."""
    ring = "".join(f'<s:vertex x="{x}" y="{y}"/>' for x, y in ((0, 0), (9, 0), (0, 9)))
    walk = '<s:segment v2="1"/><s:segment v2="2"/><s:segment v2="0"/>'
    stack = f'<s:slice ztop="1"><s:vertices>{ring}</s:vertices><s:polygon startv="0">{walk}</s:polygon></s:slice>'
    return f'<s:slicestack id="9">{stack}</s:slicestack>' + one.replace("<object", '<object s:slicestackid="9"')


def _values():
    nan, inf = box(), box()
    nan[3, 1, 2], inf[0, 0, 0] = np.nan, np.inf
    return [
        ("nan.stl", "V001", stl(nan)),
        ("inf.stl", "V001", stl(inf)),
        ("too-large.stl", "V001", text_stl(box()).replace("vertex 10 0 0", "vertex 1e39 0 0")),
        ("large.obj", "V001", "v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nv 0 0 1e300\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"),
        ("far.stl", "V002", stl(box(at=(200_000, 0, 0)))),
    ]


def _topology():
    cube = box()
    fin = np.array([[[0, 0, 0], [0, 0, 10], [-5, -5, 5]]], float)
    flipped = cube.copy()
    flipped[0] = flipped[0][::-1]
    crack = np.concatenate([cube[1:], _halves(cube[0])])
    noisy = box()
    noisy[0] += 2e-5
    line = np.array([[[0, 0, 0], [10, 0, 0], [5, 0, 0]]], float)
    wrong = np.tile([0.0, 0.0, 1.0], (12, 1))
    spread = (CUBE_CORNERS * 10)[CUBE_FACES].reshape(-1, 3)
    return [
        ("hole.stl", "T001", stl(cube[1:])),
        ("fin.stl", "T002", stl(np.concatenate([cube, fin]))),
        ("edge-to-edge.stl", "T003", stl(np.concatenate([cube, box(at=(10, 10, 0))]))),
        ("corner-to-corner.stl", "T004", stl(np.concatenate([cube, box(at=(10, 10, 10))]))),
        ("crack.stl", "T005", stl(crack)),
        ("unwelded.stl", "T006", stl(noisy)),
        ("unwelded.3mf", "T006", package(model_xml(
            f'<object id="1">{mesh_xml(spread, np.arange(36).reshape(-1, 3))}</object>'))),
        ("one-flipped.stl", "T007", stl(flipped)),
        ("inside-out.stl", "T008", stl(cube[:, ::-1])),
        ("face-twice.stl", "T009", stl(np.concatenate([cube, cube[:1]]))),
        ("two-sided.stl", "T009", stl(np.concatenate([cube[:1], cube[:1, ::-1]]))),
        ("collapsed.stl", "T010", stl(np.concatenate([cube, cube[:1, [0, 0, 1]]]))),
        ("line.stl", "T010", stl(np.concatenate([cube, line]))),
        ("sliver.stl", "T011", stl(with_sliver())),
        ("unused.3mf", "T012", package(model_xml(
            f'<object id="1">{mesh_xml(np.concatenate([CUBE_CORNERS * 10, [[5, 5, 5]]]))}</object>'))),
        ("normals.stl", "T013", stl(cube, normals=wrong)),
        ("nan-normals.stl", "T013", stl(cube, normals=wrong * np.nan)),
    ]  # fmt: skip


def _halves(triangle):
    a, b, c = triangle
    middle = (a + b) / 2
    return np.array([[a, middle, c], [middle, b, c]])


def with_sliver():
    """A box whose first face is split at a point that lies one float32 step off an edge."""
    cube = box(at=(3, 3, 3))
    a, b, c = cube[0]
    point = (a + b) / 2
    point = point + (c - point) * 3e-8
    return np.concatenate([cube[1:], [[a, point, c], [point, b, c], [a, b, point]]])


def _geometry():
    cube = box()
    pierced = np.concatenate([cube, box((5, 5, 20), (2.5, 2.5, -5))])
    crossed = (CUBE_CORNERS * 10).copy()
    crossed[[4, 5]] = crossed[[5, 4]] + [0, 3, 0]
    inner = box((5, 5, 5), (2.5, 2.5, 2.5))
    return [
        ("pierced.stl", "G001", stl(pierced)),
        ("through-edges.stl", "G001", stl(np.concatenate([cube, _ringed(2.5, 7.5, -5)]))),
        ("through-edges-only.stl", "G001", stl(np.concatenate([cube, _ringed(2.5, 7.5, 5)]))),
        ("twisted.stl", "G001", stl(crossed[CUBE_FACES])),
        ("items-overlap.3mf", "G002", package(model_xml(build=_items("5 5 5")))),
        ("items-the-same.3mf", "G002", package(model_xml(build=_items("0 0 0")))),
        ("components-overlap.3mf", "G002", package(model_xml(_pair("9 0 0"), '<build><item objectid="2"/></build>'))),
        ("corner-on-face.stl", "G003", stl(np.concatenate([cube, _tip((4, 5, 10))]))),
        ("flush.stl", "G004", stl(np.concatenate([cube, box((4, 4, 4), (3, 3, 10))]))),
        ("two.stl", "G005", stl(np.concatenate([cube, box(at=(20, 0, 0))])), {"shells": 1}),
        ("hollow.stl", "G006", stl(np.concatenate([cube, inner[:, ::-1]]))),
        ("sheet.obj", "G007", "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 3 3 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 3 2\n"),
        ("one-point.stl", "G007", stl(np.full((9, 3, 3), 5.0))),
        ("bow-tie.stl", "G008", stl(np.concatenate([_wedge(5)[:, ::-1], _wedge(-5)]))),
        ("fin-of-a-face.stl", "G009", stl(np.concatenate([cube, fin(other_diagonals=True)]))),
        ("speck.stl", "G010", stl(np.concatenate([cube, box((0.002, 0.002, 0.002), (12, 0, 0))]))),
        ("metres.stl", "S001", stl(box((0.014, 0.014, 0.005)))),
        ("microns.stl", "S001", stl(box((14_000, 14_000, 5_000)))),
        ("inches.3mf", "S001", package(model_xml(attributes='unit="meter"'))),
    ]


def _wedge(width):
    """A prism over a triangle with a corner at the origin; its faces look inwards."""
    return prism([(0, 0), (width, width), (width, -width)], 0, 5)


def _items(shift):
    """The cube, and once more with a shift."""
    return f'<build><item objectid="1"/><item objectid="1" transform="1 0 0 0 1 0 0 0 1 {shift}"/></build>'


def _pair(shift):
    """The cube, and an object of two of it."""
    moved = f'<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 {shift}"/>'
    both = f'<components><component objectid="1"/>{moved}</components>'
    return f'<object id="1">{mesh_xml()}</object><object id="2">{both}</object>'


def _ringed(low, high, start):
    """An upright tube from z = `start` through the cube's top at z = 10, with a ring of vertices in that plane."""
    ring = [(low, low), (high, low), (high, high), (low, high)]
    lower, upper = prism(ring, start, 10), prism(ring, 10, 20)
    cap = lower[:, :, 2].min(axis=1) == 10
    base = upper[:, :, 2].max(axis=1) == 10
    return np.concatenate([lower[~cap], upper[~base]])


def _tip(at):
    """A tetrahedron that stands on its tip."""
    x, y, z = at
    tip = np.array([x, y, z])
    a, b, c = np.array([x - 2, y - 2, z + 5]), np.array([x + 2, y - 2, z + 5]), np.array([x, y + 2, z + 5])
    return np.array([[tip, b, a], [tip, c, b], [tip, a, c], [a, b, c]])


def _printing():
    fdm = {"printer": "fdm-0.4"}
    plate = box((20, 20, 3))
    fence = box((20, 0.5, 10))
    pin = np.concatenate([box((10, 10, 3)), box((0.3, 0.3, 4), (20, 5, 0))])
    table = _table()
    hollow = np.concatenate([plate, box((5, 5, 1), (5, 5, 1))[:, ::-1]])
    tip = _tip((0, 0, 0))
    return [
        ("long.stl", "S002", stl(box((300, 20, 5))), fdm),
        ("fence.stl", "D001", stl(fence), fdm),
        ("foil.stl", "D001", stl(box((20, 20, 0.2))), fdm),
        ("pin.stl", "D002", stl(pin), fdm),
        ("table.stl", "D003", stl(table), fdm),
        ("hollow-plate.stl", "D004", stl(hollow), fdm),
        ("sunken.stl", "D005", stl(box(at=(0, 0, -2))), fdm),
        ("on-its-tip.stl", "D005", stl(tip), fdm),
        ("gap.stl", "D006", stl(np.concatenate([box(), box(at=(10.05, 0, 0))])), fdm),
    ]


def _table():
    """A mushroom: a wide slab on a narrow foot, one solid with no coplanar faces inside."""
    from manifold3d import Manifold

    solid = Manifold.cube([6, 6, 10]).translate([7, 7, 0]) + Manifold.cube([20, 20, 3]).translate([0, 0, 9])
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties, float)[:, :3][np.asarray(mesh.tri_verts)]


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for case in cases():
        (folder / case.name).write_bytes(case.data())
        print(f"{case.code} {case.name} {case.options or ''}")

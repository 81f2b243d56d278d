"""GLB: the scene's triangles in mm, z up, each node in its place; and what cannot be read is refused by name."""

import copy
import io

import numpy as np
import pytest
import trimesh
from glb_files import packed, scene
from shapes import CUBE_CORNERS, CUBE_FACES, finding

from unitcad.export import glb
from unitcad.meshcheck.readers import reader_of
from unitcad.meshcheck.rules.f_file import Deadline, Limits

CUBE = (CUBE_CORNERS * 0.01).astype("<f4")  # metres
FACES = CUBE_FACES.astype("<u2")


def in_mm(corners):
    """Metres with y up as mm with z up."""
    return np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1) * 1000


def soup(content):
    findings = []
    mesh = reader_of("glb")(memoryview(content), Limits(), Deadline(60), findings)
    assert findings == []
    return mesh.vertices[mesh.faces]


def test_metres_with_y_up_become_millimetres_with_z_up(judge):
    report = judge(packed(*scene(CUBE * np.array([1, 2, 3], "<f4"), FACES)), "a.glb", printer="fdm-0.4")
    assert report.findings == ()
    np.testing.assert_allclose(report.facts.bbox_mm, ((0, -30, 0), (10, 0, 20)), atol=1e-5)
    assert report.facts.volume_mm3 == pytest.approx(6000, rel=1e-6)


def test_a_unit_that_is_named_takes_the_place_of_the_metre(judge):
    content = packed(*scene((CUBE_CORNERS * 10).astype("<f4"), FACES))
    (found,) = judge(content, "a.glb").findings
    assert (found.code, "10 mm if the numbers are millimetres" in found.message) == ("S001", True)
    report = judge(content, "a.glb", unit="millimeter")
    assert report.findings == ()
    assert report.facts.volume_mm3 == pytest.approx(1000, rel=1e-12)


def test_our_own_files_come_back_to_the_last_bit():
    vertices = (CUBE_CORNERS * [12.3, 4.56, 78.9] + [1.1, 2.2, 3.3]).astype(np.float32)
    content = glb.content([glb.GlbPart("a", (1, 1, 1), vertices.astype(float), CUBE_FACES)])
    np.testing.assert_array_equal(np.unique(soup(content).reshape(-1, 3), axis=0), np.unique(vertices, axis=0))


TURN = [0.0, np.sin(0.35), 0.0, np.cos(0.35)]
NODES = [
    {"children": [1, 2], "translation": [0.1, 0, 0], "name": "root"},
    {"mesh": 0, "rotation": TURN, "scale": [1, 2, 1], "name": "turned"},
    {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.3, 0.2, 0.1, 1], "children": [3], "name": "mirrored"},
    {"mesh": 0, "translation": [0, 0.5, 0]},
]  # fmt: skip


def test_nodes_place_their_meshes_as_trimesh_has_them(judge):
    content = packed(*scene(CUBE, FACES, NODES))
    theirs = trimesh.load(io.BytesIO(content), file_type="glb", process=False)
    assert isinstance(theirs, trimesh.Scene)
    whole = theirs.to_geometry()
    expected = in_mm(np.asarray(whole.vertices)[np.asarray(whole.faces)])
    found = soup(content)

    np.testing.assert_allclose(np.sort(found.reshape(-1, 3), 0), np.sort(expected.reshape(-1, 3), 0), atol=1e-3)
    report = judge(content, "a.glb")
    assert report.facts.shells == 3
    assert report.facts.area_mm2 == pytest.approx(whole.area * 1e6, rel=1e-5)
    assert report.facts.volume_mm3 == pytest.approx(4000, rel=1e-5)  # all outwards, the mirrored ones too
    assert not report.has("T008")


def test_faces_are_named_by_their_node(judge):
    content = packed(*scene(CUBE, FACES[:-1], NODES))
    hole = finding(judge(content, "a.glb"), "T001")
    assert {place.object for place in hole.locations} <= {"turned", "mirrored", "node 3"}
    assert all(place.object == ("turned", "mirrored", "node 3")[place.face // 11] for place in hole.locations)


@pytest.mark.parametrize(("deep", "codes"), [(2e-6, []), (0.01, ["G002"])])
def test_objects_that_cross_by_rounding_only_touch(deep, codes, judge):
    cubes = {"a": CUBE_CORNERS * 10.0, "b": CUBE_CORNERS * 10.0 + [10 - deep, 1 / 3, 1 / 3]}
    content = glb.content([glb.GlbPart(name, (1, 1, 1), corners, CUBE_FACES) for name, corners in cubes.items()])
    assert [found.code for found in judge(content, "a.glb").findings] == codes


def test_lists_without_indices():
    assert len(soup(packed(*scene(CUBE[CUBE_FACES.ravel()], None)))) == 12


def test_interleaved_positions():
    document, binary = scene(CUBE, FACES)
    rows = np.zeros((8, 6), "<f4")
    rows[:, 3:] = CUBE
    document["bufferViews"].append(
        {"buffer": 0, "byteOffset": len(binary), "byteLength": rows.nbytes, "byteStride": 24}
    )
    document["accessors"][0] |= {"bufferView": 2, "byteOffset": 12}
    np.testing.assert_array_equal(soup(packed(document, binary + rows.tobytes())), soup(packed(*scene(CUBE, FACES))))


def spoil(change):
    document, binary = scene(CUBE, FACES)
    document = copy.deepcopy(document)
    change(document)
    return packed(document, binary)


HUGE = [{"scale": [1e29] * 3, "children": [1]}, {"mesh": 0, "scale": [1e29] * 3}]
GOOD = packed(*scene(CUBE, FACES))
BAD  = [
    ("no glb", b"solid a\n" * 9, "F005", "no binary glTF"),
    ("short", GOOD[:16], "F001", "shorter than a GLB's header"),
    ("cut", GOOD[:-1], "F002", "the header promises"),
    ("chunk", GOOD[:12] + b"\xff\xff\xff\x7f" + GOOD[16:], "F002", "a chunk promises"),
    ("version", packed({}, version=1), "F003", "glTF of version 1"),
    ("json", packed(b'{"a":'), "F003", "the glTF document cannot be read"),
    ("digits", packed(b'{"scene":' + b"1" * 9999 + b"}"), "F003", "the glTF document cannot be read"),
    ("nan", packed(b'{"a":NaN}'), "F003", "JSON is malformed"),
    ("nested", packed(b'{"a":' + b"[" * 100_000 + b"]" * 100_000 + b"}"), "F011", "nested too deeply"),
    ("list", packed([]), "F003", "Expected `object`, got `array`"),
    ("nothing", packed({}), "F001", "the file has no face"),
    ("draco", spoil(lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"])), "P016", "'KHR_draco_mesh_"),
    ("meshopt", spoil(lambda d: d.update(extensionsRequired=["EXT_meshopt_compression"])), "P016", "cannot be read"),
    ("sparse", spoil(lambda d: d["accessors"][0].update(sparse={"count": 1})), "F003", "accessor 0 is sparse"),
    ("no view", spoil(lambda d: d["accessors"][0].pop("bufferView")), "F003", "without a buffer view"),
    ("uri", spoil(lambda d: d["buffers"][0].update(uri="a.bin")), "P007", "not in the file's own binary chunk"),
    ("other", spoil(lambda d: d["accessors"][0].update(componentType=5130)), "F003", "not VEC3 of a known type"),
    ("count", spoil(lambda d: d["accessors"][0].update(count=9)), "F002", "accessor 0 promises 9 numbers of 12 bytes"),
    ("view", spoil(lambda d: d["bufferViews"][0].update(byteLength=95)), "F002", "accessor 0 promises 8 numbers"),
    ("negative", spoil(lambda d: d["bufferViews"][0].update(byteOffset=-4)), "F003", "`int` >= 0 - at `$.bufferV"),
    ("many", spoil(lambda d: d["accessors"][1].update(count=10**12)), "F011", "more than --max-faces"),
    ("loop", spoil(lambda d: d["nodes"][0].update(children=[0])), "P012", "contains itself"),
    ("mesh", spoil(lambda d: d["nodes"][0].update(mesh=7)), "P011", "names meshes 7, the list has 1"),
    ("scene", spoil(lambda d: d.update(scene=3)), "P011", "names scenes 3"),
    ("scale", spoil(lambda d: d["nodes"][0].update(scale=[1, 0, 1])), "P013", "determinant zero"),
    ("huge", spoil(lambda d: d["nodes"][0].update(scale=[1, 1e40, 1])), "P013", "not of 3 finite numbers"),
    ("large", spoil(lambda d: d.update(nodes=HUGE)), "V001", "not finite"),
    ("no position", spoil(lambda d: d["meshes"][0]["primitives"][0].update(attributes={})), "F003", "no POSITION"),
    ("kind", spoil(lambda d: d["accessors"][0].update(componentType=[])), "F003", "Expected `int`, got `array`"),
    ("mode", spoil(lambda d: d["meshes"][0]["primitives"][0].update(mode=9)), "F003", "Expected `int` <= 6"),
    ("strip", spoil(lambda d: d["meshes"][0]["primitives"][0].update(mode=5)), "F003", "export triangles"),
    ("lines", spoil(lambda d: d["meshes"][0]["primitives"][0].update(mode=1)), "F001", "the file has no face"),
    ("index", packed(*scene(CUBE, FACES + FACES.dtype.type(1))), "P011", "a face names vertex 8 of 8, counted from 0"),
    ("corners", spoil(lambda d: d["accessors"][1].update(count=35)), "F008", "35 corners of triangles"),
    ("trailing", GOOD + b"abc", "F006", "3 bytes after the last chunk"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "code", "said"), [case[1:] for case in BAD], ids=[case[0] for case in BAD])
def test_what_is_wrong_is_named(content, code, said, judge):
    report = judge(content, "a.glb")
    assert [found.message for found in report.findings if found.code == code and said in found.message], report.findings
    assert report.verdict == ("warning" if code == "F006" else "error")


def test_a_deep_tree_and_many_placings_are_bounded(judge):
    chain = [{"children": [i + 1]} for i in range(80)]
    assert judge(packed(*scene(CUBE, FACES, [*chain, {"mesh": 0}])), "a.glb").has("P009")
    crowd = [{"children": list(range(1, 400))}, *({"mesh": 0} for _ in range(399))]
    document, binary = scene(CUBE, FACES, crowd)
    document["meshes"][0]["primitives"] *= 300
    document["meshes"][0]["name"] = "a" * 100_000
    (found,) = judge(packed(document, binary), "a.glb").findings
    assert (found.code, "more primitives than the limit" in found.message) == ("F011", True)

import io
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from sample_bodies import all_bodies

from unitcad.export import printing
from unitcad.kernels.mesh import arrays, realise
from unitcad.meshcheck import check_file
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import is_printed, threemf_content
from unitcad.validation import load

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@pytest.fixture(scope="module")
def parts():
    return [
        printing.MeshPart(
            body.name, body.colour, *printing.print_ready(*arrays(realise(body.shape, 48)), body.upside_down)
        )
        for body in all_bodies()
    ]


def model(data):
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        return ElementTree.fromstring(archive.read("3D/3dmodel.model"))


def placed_boxes(root):
    objects = {o.get("id"): o for o in root.iter(f"{CORE}object")}
    found = []
    for item in root.iter(f"{CORE}item"):
        move = np.array(item.get("transform", "").split()[9:], dtype=float)
        table = [
            [float(v.get(axis, "")) for axis in "xyz"] for v in objects[item.get("objectid")].iter(f"{CORE}vertex")
        ]
        found.append((np.min(table, axis=0) + move, np.max(table, axis=0) + move))
    return found


def test_read_back_equals_written(parts):
    root = model(printing.content(parts))
    assert root.get("unit") == "millimeter"
    objects = list(root.iter(f"{CORE}object"))
    bases = list(root.iter(f"{CORE}base"))
    assert [o.get("name") for o in objects] == [part.name for part in parts]
    for part, node in zip(parts, objects, strict=True):
        vertices = [[np.float32(v.get(axis)) for axis in "xyz"] for v in node.iter(f"{CORE}vertex")]
        faces = [[int(t.get(key, "")) for key in ("v1", "v2", "v3")] for t in node.iter(f"{CORE}triangle")]
        assert np.array_equal(np.array(vertices), part.vertices)
        assert np.array_equal(faces, part.faces)
        base = bases[int(node.get("pindex", ""))]
        shown = tuple(int(base.get("displaycolor", "")[i : i + 2], 16) for i in (1, 3, 5))
        assert shown == tuple(round(255 * channel) for channel in part.colour)


def test_names_are_escaped(parts):
    odd = printing.MeshPart('a<b>"&', (0, 0.5, 1), parts[-1].vertices, parts[-1].faces)
    node = next(model(printing.content([odd])).iter(f"{CORE}object"))
    assert node.get("name") == 'a<b>"&'


def volume(node):
    """Return an object's volume by the divergence theorem, mm3."""
    corners = np.array([[float(v.get(axis, "")) for axis in "xyz"] for v in node.iter(f"{CORE}vertex")])
    faces = [[int(t.get(key, "")) for key in ("v1", "v2", "v3")] for t in node.iter(f"{CORE}triangle")]
    return float(np.linalg.det(corners[faces]).sum() / 6)


def test_copies_share_a_mesh_and_each_has_an_item(tmp_path):
    moulds = MouldSet(load("encapsulating", ("moulds.cavities=[2,3]",)))
    bodies = [body for body in moulds.plan.pieces if is_printed(body)]
    path = tmp_path / "moulds.3mf"
    path.write_bytes(threemf_content(moulds, bodies, {}))
    root = model(path.read_bytes())
    tongues = [body.name for body in bodies if body.kind == "tongue"]
    assert len(tongues) == 6
    numbers = [name for item in root.iter(f"{CORE}item") if (name := item.get("partnumber"))]
    assert sorted(numbers) == tongues
    assert [o.get("name") for o in root.iter(f"{CORE}object")] == [
        "base",
        "cup1",
        "cup2",
        "tongue",
        "tongue-1",
        "blade",
    ]
    volumes = {o.get("id"): volume(o) for o in root.iter(f"{CORE}object")}
    built = [volumes[item.get("objectid")] for item in root.iter(f"{CORE}item")]
    assert sorted(built) == pytest.approx(sorted(moulds.mesh(body).volume() for body in bodies), rel=1e-5)
    boxes = placed_boxes(root)
    for i, (low, high) in enumerate(boxes):
        assert all(np.maximum(low - b, a - high)[:2].max() >= printing.GAP_MM - 1e-5 for a, b in boxes[:i])
    assert not check_file(path).findings

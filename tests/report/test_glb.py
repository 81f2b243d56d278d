"""GLB files: structure after the specification, geometry and colours read back by another reader, the same bytes."""

import io
import json
import struct

import numpy as np
import pytest
import trimesh

from unitcad.api.variant import Variant
from unitcad.export import glb
from unitcad.kernels.mesh import arrays, realise
from unitcad.pipeline.plan import glb_content
from unitcad.shape import box, cylinder
from unitcad.validation import templates


def chunks(content):
    """The JSON and the binary chunk, after checking every length in the container."""
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    document = json.loads(content[20 : 20 + size])
    binary, kind = struct.unpack_from("<I4s", content, 20 + size)
    assert kind == b"BIN\0"
    assert 28 + size + binary == len(content)
    assert binary == document["buffers"][0]["byteLength"]
    return document, content[28 + size :]


@pytest.fixture(scope="module")
def variants():
    return {name: Variant.of(name) for name in templates()}


@pytest.mark.parametrize("name", sorted(templates()))
def test_every_template_reads_back_in_metres_and_y_up(name, variants):
    variant = variants[name]
    bodies = (*variant.unit, *variant.plan.tools)
    scene = trimesh.load(io.BytesIO(glb_content(variant, bodies)), file_type="glb")
    assert sorted(scene.geometry) == sorted(body.name for body in bodies)
    for body in bodies:
        mesh = scene.geometry[body.name].copy()
        assert mesh.visual.material.name == body.name
        mesh.apply_transform(scene.graph.get(body.name)[0])
        mesh.merge_vertices(merge_norm=True)
        solid = variant.mesh(body)
        assert mesh.is_watertight
        # Rounding to single precision and the slivers that go with it.
        assert mesh.volume * 1e9 == pytest.approx(solid.volume(), rel=2e-4)
        x0, y0, z0, x1, y1, z1 = solid.bounding_box()
        assert mesh.bounds * 1e3 == pytest.approx(np.array([[x0, z0, -y1], [x1, z1, -y0]]), abs=1e-4)


def test_structure():
    part = glb.GlbPart("a", (0.2, 0.5, 1.0), *arrays(realise(cylinder(3, 0, 2), 48)), {"role": "unit"})
    document, binary = chunks(glb.content([part, part]))
    for view in document["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(binary)
    position, normal, index = document["accessors"][:3]
    data = np.frombuffer(binary, "<f4", position["count"] * 3).reshape(-1, 3)
    assert position["min"] == data.min(axis=0).tolist()
    assert position["max"] == data.max(axis=0).tolist()
    view = document["bufferViews"][normal["bufferView"]]
    normals = np.frombuffer(binary, "<f4", normal["count"] * 3, view["byteOffset"]).reshape(-1, 3)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    view = document["bufferViews"][index["bufferView"]]
    assert np.frombuffer(binary, "<u2", index["count"], view["byteOffset"]).max() == position["count"] - 1
    assert document["nodes"][1]["extras"] == {"role": "unit"}


def test_colours_are_linear():
    part = glb.GlbPart("a", (0.0, 0.5, 1.0), *arrays(realise(box(0, 1, 0, 1, 0, 1), 24)))
    document, _ = chunks(glb.content([part]))
    colour = document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]
    assert colour == pytest.approx([0.0, 0.214041, 1.0, 1.0], abs=1e-6)  # 0.5 in sRGB, IEC 61966-2-1


def test_a_box_is_shaded_flat_and_a_wall_smooth():
    vertices, normals, _ = glb.shading_normals(*arrays(realise(box(0, 1, 0, 2, 0, 3), 24)))
    assert len(vertices) == 24
    assert np.abs(normals).max(axis=1) == pytest.approx(1)
    vertices, normals, _ = glb.shading_normals(*arrays(realise(cylinder(5, 0, 4), 60)))
    wall = np.abs(normals[:, 2]) < 0.5
    outward = vertices[wall, :2] / np.linalg.norm(vertices[wall, :2], axis=1, keepdims=True)
    assert normals[wall, :2] == pytest.approx(outward, abs=1e-4)
    assert wall.sum() == 120

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_bodies import cup

from unitcad.errors import Refusal, UnitcadError
from unitcad.export import printing
from unitcad.kernels.mesh import arrays, realise
from unitcad.pipeline.write import build
from unitcad.validation import load


def measured(vertices, faces):
    """By trimesh, another library: watertight volume, signed volume (mm3), least altitude of a face (mm)."""
    mesh = trimesh.Trimesh(vertices.astype(float), faces, process=False)
    sides = np.linalg.norm(np.diff(mesh.triangles[:, (0, 1, 2, 0)], axis=1), axis=2)
    return bool(mesh.is_volume), float(mesh.volume), float((2 * mesh.area_faces / sides.max(axis=1)).min())


def test_upside_down_stands_on_the_side_that_was_up():
    vertices, _ = arrays(realise(cup().shape, 96))
    laid = printing.lay_down(vertices, True)
    assert laid[:, 2].min() == 0
    assert np.array_equal(laid[:, 0], vertices[:, 0])
    assert np.allclose(laid[:, 2], 4.61 - vertices[:, 2], atol=1 / 1024)
    assert np.array_equal(laid[:, 1], -vertices[:, 1])


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-50, 50),
    st.floats(-50, 50),
    st.floats(0, 6.3),
    st.floats(-7, 0).map(lambda power: 10**power),
)
def test_slivers_of_booleans_survive_the_rounding(x, y, angle, gap):
    """A turned block cut a hair's breadth off its own face: the thin faces that this leaves are the rounding's trap."""
    block = manifold3d.Manifold.cube((10, 10, 10)).rotate((0, 0, np.degrees(angle))).translate((x, y, 0))
    other = block.translate((gap, 3 * gap, gap))
    drum = manifold3d.Manifold.cylinder(20, 4 + gap, 4, 64).translate((x + gap, y, -5))
    solid = (block + other) - drum
    vertices, faces = printing.print_ready(*arrays(solid))
    sound, volume, altitude = measured(vertices, faces)
    assert sound
    assert altitude > printing.resolution(vertices)
    assert volume == pytest.approx(solid.volume(), abs=64 * printing.resolution(vertices) * solid.surface_area())


def test_a_body_thinner_than_single_precision_is_refused():
    vertices, faces = arrays(manifold3d.Manifold.cube((100, 100, 1e-7)))
    with pytest.raises(UnitcadError, match="single precision"):
        printing.print_ready(vertices, faces)


EDGE = """
from unitcad.shape import box, union
def unit(spec):
    return union((box(-7, 0, -7, 0, 0, 3), box(0, 7, 0, 7, 0, 3)))
"""
EDGE_SPEC = """
name = "edge"
design = "edge.py:unit"
diameter_mm = 20.0
[[layers]]
material = "ecoflex-00-30"
wall_mm = 2.0
cap_mm = 1.0
"""


@pytest.mark.parametrize("format", ["stl", "3mf", "glb"])
def test_the_body_and_the_next_step_are_named_if_a_design_has_no_such_mesh(format, tmp_path):
    """Two boxes touch along an edge: four faces meet there, and no file holds that as a closed surface."""
    (tmp_path / "edge.py").write_text(EDGE)
    (tmp_path / "edge.toml").write_text(EDGE_SPEC)
    spec = load(tmp_path / "edge.toml", {"output.formats": [format]})
    place = "at x = 0, y = 0, z = [03] mm"
    with pytest.raises(
        Refusal, match=rf"single precision: .* {place}; draw them so that parts overlap, or are 0.01 mm"
    ) as caught:
        build(spec, tmp_path / "out", only=("unit",))
    assert (caught.value.field, caught.value.value) == ("design", "edge.py:unit")
    assert "layer1: " in str(caught.value)


def test_stl_bytes_are_the_format(tmp_path):
    vertices, faces = printing.print_ready(*arrays(realise(cup().shape, 96)))
    path = tmp_path / "cup2.stl"
    data = printing.stl(vertices, faces, "cup2")
    path.write_bytes(data)
    assert len(data) == 84 + 50 * len(faces)
    assert data[:80].decode("ascii").rstrip() == "unitcad, mm: cup2"
    assert int.from_bytes(data[80:84], "little") == len(faces)
    read = trimesh.load_mesh(path, process=False)
    assert np.array_equal(read.triangles, vertices[faces].astype(float))
    stored = np.frombuffer(data[84:], dtype=np.uint8).reshape(-1, 50)[:, :12].copy().view("<f4")
    assert np.abs(stored - trimesh.triangles.normals(read.triangles)[0]).max() < 1e-6
    assert printing.stl(vertices, faces, "cup2") == data


def test_stl_header_never_starts_with_solid_and_never_overflows():
    vertices, faces = printing.print_ready(*arrays(manifold3d.Manifold.cube((1, 1, 1))))
    data = printing.stl(vertices, faces, "solid " + "é" * 100)
    assert not data.lower().startswith(b"solid")
    assert len(data) == 84 + 50 * 12

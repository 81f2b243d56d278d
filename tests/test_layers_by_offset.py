"""`[body] file`: layers by offset from a body, against exact distances; what such a spec takes, and what it refuses."""

import numpy as np
import pytest
import trimesh
from trimesh.creation import box, cylinder, icosphere, torus

from unitcad.checks import check_moulds
from unitcad.designs import unit_bodies
from unitcad.designs.offset.inset import CIRCLE, inset, side_of
from unitcad.errors import Refusal
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.tree import corners_and_faces
from unitcad.spec import spec_hash, to_data
from unitcad.spec.body_file import on_grid
from unitcad.validation import from_data, load

SPEC = """
name = "tip"
layers = [{material = "ecoflex-00-30"}, {material = "dragon-skin-10-medium", thickness_mm = 1.5}]
output.formats = ["stl"]
[body]
file = "tip.stl"
"""


def dome():
    ball = icosphere(4, 7.0)
    ball.apply_translation((0, 0, 2))
    return ball.slice_plane((0, 0, 0), (0, 0, 1), cap=True)


def placed(mesh, z):
    mesh.apply_translation((0, 0, z))
    return mesh


def of_rod(points):
    return np.minimum(7 - np.hypot(*points[:, :2].T), 20 - points[:, 2])


def of_box(points):
    return np.minimum(np.minimum(6 - abs(points[:, 0]), 8 - abs(points[:, 1])), 12 - points[:, 2])


# Each body, its depth under the surface in closed form, and the volume deeper than 1.25 mm.
EXACT = {
    "dome": (dome, lambda p: 7 - np.linalg.norm(p - (0, 0, 2), axis=1), np.pi * 7.75**2 * (3 * 5.75 - 7.75) / 3),
    "torus": (
        lambda: placed(torus(8, 4, major_sections=160, minor_sections=80), 4),
        lambda p: 4 - np.hypot(np.hypot(*p[:, :2].T) - 8, p[:, 2] - 4),
        2 * np.pi**2 * 8 * 2.75**2,
    ),
    "box": (lambda: placed(box((12, 16, 12)), 6), of_box, 9.5 * 13.5 * 10.75),
    "rod": (lambda: placed(cylinder(7, 20, sections=256), 10), of_rod, np.pi * 5.75**2 * 18.75),
}


@pytest.mark.parametrize("name", EXACT)
def test_an_offset_is_within_its_bound_and_hardly_off_where_smooth(name):
    drawn, depth, volume = EXACT[name]
    mesh = drawn()
    body = on_grid("", "body", np.array(mesh.vertices), np.array(mesh.faces))
    side = side_of(body, 1.25, 1.25)
    corners, faces = corners_and_faces(inset(body, 1.25, side))
    found = trimesh.Trimesh(corners, faces, process=False)
    assert found.is_watertight
    assert found.is_winding_consistent
    points = np.concatenate([corners, trimesh.sample.sample_surface(found, 20_000, seed=1)[0]])
    off = depth(points[points[:, 2] > 0.01]) - 1.25
    assert abs(off).max() <= CIRCLE * side + 0.02  # the facets of the body itself
    assert np.quantile(abs(off), 0.9) < 0.02
    over = found.slice_plane((0, 0, 0), (0, 0, 1), cap=True) if corners[:, 2].min() < 0 else found
    assert over.volume == pytest.approx(volume, rel=0.01)


def test_the_wall_of_an_upright_body_stays_upright():
    mesh = placed(cylinder(7, 20, sections=96), 10)
    corners, faces = corners_and_faces(
        inset(on_grid("", "body", np.array(mesh.vertices), np.array(mesh.faces)), 1.25, 0.5)
    )
    normals = trimesh.Trimesh(corners, faces, process=False).face_normals
    middles = corners[faces].mean(axis=1)
    wall = (middles[:, 2] > 1) & (middles[:, 2] < 17)
    assert wall.sum() > 90
    assert abs(normals[wall, 2]).max() < 0.02


def tip_of(folder, text=SPEC, shift=(3, 2, 5)):
    rod = placed(cylinder(7, 8, sections=64), 4)
    tip = trimesh.boolean.union([rod, placed(icosphere(3, 7.0), 8)], engine="manifold")
    tip.apply_translation(shift)
    tip.export(folder / "tip.stl")
    (folder / "spec.toml").write_text(text)
    return folder / "spec.toml"


def solids_of(spec):
    return {body.name: trimesh.Trimesh(*arrays(realise(body.shape, 96))) for body in unit_bodies(spec)}


def test_layers_fill_the_body_and_are_as_thick_as_asked_for(tmp_path):
    spec = load(tip_of(tmp_path, SPEC.replace("[body]", "motor.at = [4, 2, 5]\n[body]")))
    solids = solids_of(spec)
    whole = trimesh.load(tmp_path / "tip.stl")
    volumes = {name: solid.volume for name, solid in solids.items()}
    assert sum(volumes.values()) == pytest.approx(whole.volume, rel=2e-3)
    assert volumes["motor"] == pytest.approx(np.pi * 3.5**2 * 2, rel=1e-3)
    assert solids["motor"].bounds[:, 0] == pytest.approx([1 - 3.5, 1 + 3.5], abs=0.01)
    inner = solids["layer1"].vertices
    on_wall = inner[(inner[:, 2] < 7) & (np.hypot(*inner[:, :2].T) > 5)]
    assert len(on_wall)
    assert 7 - np.hypot(*on_wall[:, :2].T) == pytest.approx(1.5, abs=0.03)
    assert inner[:, 2].max() == pytest.approx(15 - 1.5, abs=0.05)  # facets of the ball
    again = from_data(to_data(spec))
    assert again == spec
    assert spec_hash(again) == spec_hash(spec)
    thick = load(tmp_path / "spec.toml", {"layers.1.thickness_mm": 2})
    assert solids_of(thick)["layer1"].bounds[1, 2] == pytest.approx(13, abs=0.07)


def test_a_hollow_is_left_and_a_floor_is_under_the_motor(tmp_path):
    hollow = load(tip_of(tmp_path, SPEC.replace('00-30"}', '00-30", thickness_mm = 1.0}'), (0, 0, 0)), {"motor": False})
    solids = solids_of(hollow)
    assert set(solids) == {"layer1", "layer2"}
    inside = [np.pi * r**2 * 8 + 2 / 3 * np.pi * r**3 for r in (4.5, 5.5)]
    assert solids["layer1"].volume == pytest.approx(inside[1] - inside[0], rel=0.01)
    floor = SPEC.replace("[{", '[{material = "ecoflex-00-30", thickness_mm = 1.25}, {').replace(
        "[body]", '[body]\nbottom = "floor"'
    )
    solids = solids_of(load(tip_of(tmp_path, floor)))
    assert solids["layer1"].bounds[:, 2] == pytest.approx([0, 1.25], abs=1e-3)
    assert [solids[name].bounds[0, 2] for name in ("layer2", "layer3", "motor")] == pytest.approx([1.25] * 3, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "field", "why"),
    [
        ({"design": "embedded"}, "design", "leave it out"),
        ({"diameter_mm": 14}, "diameter_mm", "leave it out"),
        ({"layers.0.wall_mm": 1}, "layers.0.wall_mm", "thickness_mm in its place"),
        ({"layers.1": {"material": "ecoflex-00-30"}}, "layers.1.thickness_mm", "is required"),
        (
            {"layers.1.thickness_mm": 7.5, "motor": False},
            "layers.1.thickness_mm",
            "nothing of the body is 7.5 mm under",
        ),
        ({"layers.0.thickness_mm": 6, "motor": False}, "layers.0.thickness_mm", "no hollow is left"),
        ({"layers.0.thickness_mm": 1, "motor.at": [3, 2, 5], "wires.diameter_mm": 0.5}, "wires", "by its mouth"),
        ({"layers.0.thickness_mm": 1}, "motor.at", "is required in a hollow body"),
        ({"motor.at": [5, 2, 5]}, "motor.at", "from the surface at x = 5.49"),
        ({"motor.at": [3, 2, 17]}, "motor.at", "from the surface"),
        ({"motor.at": [30, 2, 5]}, "motor.at", "stick out of the body"),
        ({"motor.at": [3, 2, 4]}, "motor.at", "1 mm under"),
        ({"body.bottom": "floor"}, "layers.0.thickness_mm", "is required"),
        ({"body.file": "none.stl"}, "body.file", "no such file"),
        ({"body.file": "tip.txt"}, "body.file", "ends in .step"),
    ],
)
def test_a_refusal_names_the_field_and_the_reason(changes, field, why, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Refusal, match=why) as refused:
        unit_bodies(load(tip_of(tmp_path), changes))
    assert refused.value.field == field


def test_keys_of_layers_by_offset_need_a_body():
    for changes, field in (
        ({"layers.0.thickness_mm": 1}, "layers.0.thickness_mm"),
        ({"motor.at": [0, 0, 0]}, "motor.at"),
    ):
        with pytest.raises(Refusal, match=r"for a spec with \[body\]") as refused:
            load("encapsulating", changes)
        assert refused.value.field == field


@pytest.mark.long
@pytest.mark.parametrize(
    "form",
    [
        SPEC,
        SPEC.replace('00-30"}', '00-30", thickness_mm = 1.5}').replace("[body]", "motor = false\n[body]"),
        SPEC.replace("[{", '[{material = "ecoflex-00-30", thickness_mm = 1}, {').replace(
            "[body]", '[body]\nbottom = "floor"'
        ),
    ],
    ids=["fingertip", "thimble", "floor"],
)
def test_the_moulds_of_a_layered_body_keep_every_check(form, tmp_path):
    moulds = MouldSet(load(tip_of(tmp_path, form)))
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    assert moulds.plan.way == "as drawn: cups closed above, filled through a gate"
    for step in moulds.plan.steps:
        assert moulds.meshes(step.layer)[0].volume() == pytest.approx(moulds.solids[step.name].volume(), rel=1e-3)

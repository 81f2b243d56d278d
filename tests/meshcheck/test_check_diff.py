"""`unitcad check --diff`: largest distance against exact values, new and gone findings, exit codes."""

import json
import math

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from shapes import box, stl
from test_check_command import run

from unitcad.cli import check_diff
from unitcad.cli.check_diff import largest_distance

PLATE = Manifold.cube([20, 20, 4])
HOLE = Manifold.cylinder(10, 3, 3, 64).translate([10, 10, -1])


def _mesh(solid):
    mesh = solid.to_mesh64()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)


def _stl(solid):
    return stl(_mesh(solid).triangles)


def _ball(radius):
    return Manifold.sphere(radius, 200)


@pytest.mark.parametrize(
    ("one", "other", "exact"),
    [
        (PLATE, PLATE.refine(7), 0.0),
        (PLATE, PLATE - HOLE, 3 * math.cos(math.pi / 64)),  # the middle of the hole's mouth to its wall
        (PLATE - HOLE, PLATE, 2.0),  # the middle of the hole's wall to the plate's faces
        (_ball(5), _ball(6), 1.0),
        (PLATE, PLATE + Manifold.cube([0.1, 0.1, 5]).translate([3, 3, 3]), 0.0),
        (PLATE + Manifold.cube([0.1, 0.1, 5]).translate([3, 3, 3]), PLATE, 4.0),
    ],
)
def test_the_distance_is_within_its_error_of_the_exact_one(one, other, exact):
    found, points, distances = largest_distance(_mesh(one), _mesh(other), spacing := 0.3)
    assert len(points) == len(distances)
    assert found == distances.max()
    error = 0.02 if one is not PLATE and exact == 1.0 else 0.0  # a ball of flat facets
    if exact == 0.0:
        assert found < 0.1  # the mouth that the bar covers
    else:
        assert abs(found - exact) <= spacing / math.sqrt(3) + error


@pytest.fixture
def versions(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    for folder in (old, new):
        folder.mkdir()
    (old / "plate.stl").write_bytes(_stl(PLATE))
    (new / "plate.stl").write_bytes(_stl(PLATE - HOLE))
    (old / "open.stl").write_bytes(stl(box()[1:]))
    (new / "open.stl").write_bytes(stl(box()[1:]))
    (old / "mended.stl").write_bytes(stl(box()[1:]))
    (new / "mended.stl").write_bytes(stl(box()))
    (old / "gone.stl").write_bytes(stl(box()))
    (new / "more.stl").write_bytes(stl(box()))
    return old, new


def test_only_new_findings_fail(versions, tmp_path, monkeypatch):
    monkeypatch.setattr(check_diff, "SAMPLES", 40)  # which takes a sixth of the time
    old, new = (str(folder) for folder in versions)
    result = run("--diff", old, new, "--pictures", str(tmp_path / "pictures"))
    assert result.returncode == 0
    said = result.stdout
    assert "plate.stl: largest distance 3 mm, to 0.71 mm\n  volume, mm3: 1600 -> 1487" in said
    assert "open.stl: the same surface\n" in said
    assert "  gone: T001 error: " in said
    assert "gone.stl: file is gone\n" in said
    assert "more.stl: new file\n" in said
    assert said.endswith("5 files: 0 new findings, 1 gone\n")
    assert {path.name for path in (tmp_path / "pictures").iterdir()} == {
        f"{name}.stl.png" for name in ("plate", "open", "mended")
    }
    result = run("--diff", new, old, "--json")
    assert result.returncode == 1
    reports = {item["name"]: item for item in json.loads(result.stdout)}
    assert [item["code"] for item in reports["mended.stl"]["new_findings"]] == ["T001"]
    assert reports["more.stl"]["new"] is None
    result = run("--diff", old + "/plate.stl", new + "/plate.stl", "--output-format", "markdown")
    assert (result.returncode, "| volume, mm3 | 1600 | 1487" in result.stdout) == (0, True)


def test_a_hole_in_another_place_is_a_new_finding(tmp_path):
    whole = box()
    (tmp_path / "a.stl").write_bytes(stl(whole[1:]))
    (tmp_path / "b.stl").write_bytes(stl(np.delete(whole, 6, axis=0)))
    assert run("--diff", str(tmp_path / "a.stl"), str(tmp_path / "b.stl")).returncode == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["a.stl", "folder"], "must be two files or two folders"),
        (["a.stl", "none.stl"], "no such file"),
        (["a.stl", "a.stl", "--output-format", "sarif"], "markdown"),
        (["a.stl", "a.stl", "a.stl"], "leave out other files"),
    ],
)
def test_refusals(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.stl").write_bytes(stl(box()))
    result = run("--diff", *arguments)
    assert result.returncode == 2
    assert said in result.stderr

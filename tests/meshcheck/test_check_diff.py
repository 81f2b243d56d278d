"""`unitcad check --diff`: largest distance against exact values, new and gone findings, exit codes."""

import json
import math

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from shapes import box, mesh_xml, model_xml, package, stl
from test_check_command import run

from unitcad.meshcheck.geometry.distance import halved, largest_distance, nearest_of, refined

PLATE = Manifold.cube([20, 20, 4])
HOLE = Manifold.cylinder(10, 3, 3, 64).translate([10, 10, -1])
BAR = Manifold.cube([0.1, 0.1, 5]).translate([3, 3, 3])


def _corners(solid):
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]


def _ball(radius):
    return Manifold.sphere(radius, 60)


@pytest.mark.parametrize(
    ("one", "other", "exact"),
    [
        (PLATE, PLATE.refine(7), 0.0),
        (PLATE, PLATE - HOLE, 3 * math.cos(math.pi / 64)),  # the middle of the hole's mouth to its wall
        (_ball(5), _ball(6), 1.0),  # a corner to the corner below it
        (PLATE, PLATE + BAR, 4.0),
        (PLATE, PLATE.translate([0, 0, 0.25]), 0.25),
        (PLATE, PLATE.translate([100, 0, 0]), 100.0),
    ],
    ids=["refined", "hole", "balls", "bar", "shifted", "far"],
)
@pytest.mark.parametrize("swapped", [False, True])
def test_the_distance_is_within_its_error_of_the_exact_one(one, other, exact, swapped):
    found = largest_distance(*map(_corners, (other, one) if swapped else (one, other)))
    assert found.distance <= exact + 1e-9
    assert exact <= found.distance + found.error
    assert found.error <= 0.011 * np.linalg.norm(np.ptp(np.concatenate([_corners(one), _corners(other)]), axis=(0, 1)))


def test_distances_as_trimesh_has_them():
    rng = np.random.default_rng(0)
    faces = np.concatenate([rng.normal(size=(300, 3, 3)), np.zeros((1, 3, 3)), rng.normal(size=(1, 1, 3)).repeat(3, 1)])
    faces[7] = faces[7, 0] + np.outer([0, 1, 2], faces[7, 1] - faces[7, 0])  # three corners on a line
    points = np.concatenate([rng.normal(size=(200, 3)) * 3, faces[:20].mean(axis=1), faces[:20, 1]])
    whole = faces[:300][np.arange(300) != 7]  # trimesh takes none without an area
    expected = [np.linalg.norm(trimesh.triangles.closest_point(whole, np.repeat(p[None], len(whole), 0)) - p, axis=1).min()
                for p in points]  # fmt: skip
    assert nearest_of(whole).distances(points) == pytest.approx(expected, abs=1e-12)
    lines = np.concatenate([faces[7:8], faces[-2:]])
    along = np.clip(
        (points - lines[0, 0]) @ (lines[0, 2] - lines[0, 0]) / np.sum((lines[0, 2] - lines[0, 0]) ** 2), 0, 1
    )
    segment = np.linalg.norm(points - lines[0, 0] - along[:, None] * (lines[0, 2] - lines[0, 0]), axis=1)
    ends = [np.linalg.norm(points - face[0], axis=1) for face in lines[1:]]
    assert nearest_of(lines).distances(points) == pytest.approx(np.min([segment, *ends], axis=0), abs=1e-12)


def test_pieces_cover_the_surface():
    faces = np.random.default_rng(1).normal(size=(20, 3, 3))

    def area(of):
        return np.linalg.norm(np.cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]), axis=1).sum()

    pieces = refined(faces, 0.2)
    assert np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2).max() <= 0.2
    assert area(pieces) == pytest.approx(area(faces))
    assert area(halved(faces)) == pytest.approx(area(faces))


@pytest.fixture
def versions(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    for folder in (old, new):
        folder.mkdir()
    (old / "plate.stl").write_bytes(stl(_corners(PLATE)))
    (new / "plate.stl").write_bytes(stl(_corners(PLATE - HOLE)))
    (old / "open.stl").write_bytes(stl(box()[1:]))
    (new / "open.stl").write_bytes(stl(box()[1:]))
    (old / "again.stl").write_bytes(stl(box()[1:]))
    (new / "again.stl").write_bytes(stl(box()[:0:-1]))
    (old / "mended.stl").write_bytes(stl(box()[1:]))
    (new / "mended.stl").write_bytes(stl(box()))
    (old / "gone.stl").write_bytes(stl(box()))
    (new / "more.stl").write_bytes(stl(box()))
    return tmp_path


def test_only_new_findings_fail(versions):
    result = run("--diff", "old", "new", "--pictures", "pictures", cwd=versions)
    assert (result.returncode, result.stderr) == (0, "")
    said = result.stdout.splitlines()
    assert "new/plate.stl: surfaces up to 2.98 mm apart (at most 0.029 mm more)" in result.stdout
    assert "volume 1600 mm3 -> 1487.08 mm3" in result.stdout
    assert [line.split(":")[0] for line in said[:-1]] == ["new/again.stl", "old/gone.stl", *2 * ["new/mended.stl"],
                                                          "new/more.stl", "new/plate.stl"]  # fmt: skip
    assert said[0].startswith("new/again.stl: the same surface")
    assert "new/mended.stl: gone: T001 error: 3 boundary edges" in said
    assert said[-1] == "6 files: 1 unchanged, 3 changed, 1 new, 1 gone, 0 new findings, 1 finding gone"
    assert len(list((versions / "pictures").iterdir())) == 3
    result = run("--diff", "new", "old", "--json", cwd=versions)
    assert result.returncode == 1
    reports = {item["path"]: item for item in json.loads(result.stdout)["files"]}
    mended = reports["old/mended.stl"]
    assert [(item["code"], item["known"]) for item in mended["findings"]] == [("T001", False)]
    assert mended["old"]["volume_mm3"] == pytest.approx(1000)
    assert reports["new/more.stl"]["change"] == "gone"
    assert reports["old/open.stl"]["change"] == "unchanged"
    assert [item["known"] for item in reports["old/open.stl"]["findings"]] == [True]


def test_two_files_and_every_format(versions):
    pair = ("--diff", "old/plate.stl", "new/plate.stl")
    said = run(*pair, "--output-format", "markdown", cwd=versions).stdout
    assert "| new/plate.stl | surfaces up to 2.98 mm apart" in said
    result = run("--diff", "new", "old", "--output-format", "sarif", cwd=versions)
    states = [one.get("baselineState") for one in json.loads(result.stdout)["runs"][0]["results"]]
    assert sorted(map(str, states)) == ["None", "unchanged", "unchanged"]
    junit = run("--diff", "new", "old", "--output-format", "junit", cwd=versions).stdout
    assert 'failures="1"' in junit
    quiet = run("--diff", "new", "old", "-q", cwd=versions).stdout.splitlines()
    assert [line.split(":")[0] for line in quiet] == ["old/mended.stl", "6 files"]


def test_a_hole_in_another_place_is_new_and_the_old_one_gone(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()[1:]))
    (tmp_path / "b.stl").write_bytes(stl(np.delete(box(), 6, axis=0)))
    result = run("--diff", "a.stl", "b.stl", cwd=tmp_path)
    assert result.returncode == 1
    assert result.stdout.splitlines()[-1].endswith("1 new finding, 1 finding gone")


def test_fewer_holes_are_gone_in_part(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(np.concatenate([box()[1:], box(at=(20, 0, 0))[1:]])))
    (tmp_path / "b.stl").write_bytes(stl(np.concatenate([box()[1:], box(at=(20, 0, 0))])))
    result = run("--diff", "a.stl", "b.stl", cwd=tmp_path)
    assert result.returncode == 0
    assert "gone: T001 error: 6 boundary edges (3 in the new version)" in result.stdout


def test_items_of_a_3mf_are_compared_where_they_are_placed(tmp_path):
    for name, shift in (("a.3mf", 0), ("b.3mf", 7)):
        items = f'<build><item objectid="1" transform="1 0 0 0 1 0 0 0 1 {shift} 0 0"/></build>'
        (tmp_path / name).write_bytes(package(model_xml(f'<object id="1">{mesh_xml()}</object>', items)))
    (entry,) = json.loads(run("--diff", "a.3mf", "b.3mf", "--json", cwd=tmp_path).stdout)["files"]
    assert entry["distance_mm"] == pytest.approx(7)


def test_a_version_that_cannot_be_read_has_no_distance(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()))
    (tmp_path / "b.stl").write_bytes(stl(box())[:-80])
    result = run("--diff", "a.stl", "b.stl", cwd=tmp_path)
    assert result.returncode == 1
    assert "b.stl: changed, without two surfaces to compare" in result.stdout
    assert run("--diff", "b.stl", "b.stl", cwd=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["a.stl", "folder"], "must be two files or two folders"),
        (["folder", "folder"], "no mesh file in these folders"),
        (["a.stl", "none.stl"], "no such file"),
        (["a.stl", "a.stl", "a.stl"], "leave out other files"),
        (["a.stl", "a.stl", "--write-baseline", "b.json"], "the baselines"),
        (["a.stl", "a.stl", "--quiet", "--json"], "--quiet"),
    ],
)
def test_refusals(arguments, said, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.stl").write_bytes(stl(box()))
    result = run("--diff", *arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert said in result.stderr
    assert len(result.stderr.splitlines()) == 1

"""`unitcad check FILE --repair OUT.stl`: a closed copy, and how far it is from the file."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from unitcad.cli.command_line import app
from unitcad.errors import Refusal
from unitcad.meshcheck.rules.inspection import Options
from unitcad.pipeline.repair import repair


def cracked(folder, by):
    """Write a ball of radius 10 mm whose triangles do not quite meet."""
    ball = trimesh.creation.icosphere(3, 10.0)
    moved = np.random.default_rng(1).uniform(-by, by, ball.triangles.shape)
    soup = ball.triangles + moved
    trimesh.Trimesh(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3), process=False).export(
        folder / "ball.stl"
    )
    return folder / "ball.stl", soup


def test_a_cracked_ball_is_closed_and_its_distance_is_said(tmp_path):
    path, soup = cracked(tmp_path, 0.002)
    far = repair(path, tmp_path / "closed.stl", Options())
    closed = trimesh.load(tmp_path / "closed.stl")
    assert closed.is_watertight
    assert closed.volume == pytest.approx(4 / 3 * np.pi * 1000, rel=0.01)
    # By code of the tests' own: the corners of each surface next to those of the other.
    one, other = soup.reshape(-1, 3), closed.vertices
    apart = max(cKDTree(b).query(a)[0].max() for a, b in ((one, other), (other, one)))
    assert far == pytest.approx(apart, abs=2e-6)
    assert 0.001 < far < 0.01


def test_a_hole_is_refused_and_nothing_is_written(tmp_path):
    ball = trimesh.creation.icosphere(2, 10.0)
    ball.update_faces(np.arange(len(ball.faces)) > 5)
    ball.export(tmp_path / "open.stl")
    with pytest.raises(Refusal, match=r"further apart than 0\.04 mm"):
        repair(tmp_path / "open.stl", tmp_path / "closed.stl", Options())
    assert not (tmp_path / "closed.stl").exists()
    ran = CliRunner().invoke(app, ["check", str(tmp_path / "open.stl"), "--repair", "closed.obj"])
    assert ran.exit_code != 0

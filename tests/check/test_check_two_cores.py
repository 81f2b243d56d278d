"""Large meshes on two cores: the report is the one that a single process makes, and each is what it was in parts."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES, stl

from unitcad import sharing
from unitcad.check import Options, check_file, one_mesh
from unitcad.check.findings import FileReport
from unitcad.check.geometry import self_crossing, topology
from unitcad.check.geometry.arranged import arranged
from unitcad.check.geometry.stars import stars_of
from unitcad.check.geometry.triangle_mesh import Mesh
from unitcad.check.rules.f_limits import Limits
from unitcad.geometry import boxes

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies are made on Linux")
TWO_CUBES = np.concatenate([CUBE_FACES, CUBE_FACES + 8]).astype(np.int32)


def _lattice() -> np.ndarray:
    """Cubes side by side, one of which reaches into its neighbours, one fin, and a cube without its lid."""
    at = np.array([[x, y, z] for x in range(6) for y in range(6) for z in range(6)], float)
    cubes = [(CUBE_CORNERS + place)[CUBE_FACES] for place in at]
    cubes[40] = cubes[40] + 0.25
    fin = np.array([[[9, 0, 0], [10, 0, 0], [9, 1, 0]], [[9, 0, 0], [9, 1, 0], [10, 0, 0]]], float)
    return np.concatenate([*cubes, fin, (CUBE_CORNERS + 12)[CUBE_FACES][2:]]).astype(np.float32)


def _report(path: Path, *, shared: bool, options: Options) -> FileReport:
    if not shared:
        return check_file(path, options)
    with sharing.two_cores():
        return check_file(path, options)


@pytest.fixture
def lattice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "lattice.stl"
    path.write_bytes(stl(_lattice()))
    monkeypatch.setattr(sharing, "cores", lambda: 2)
    monkeypatch.setattr(boxes, "_PART", 4)
    return path


def _in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (one_mesh, self_crossing):
        monkeypatch.setattr(module, "MANY", 0)


def test_the_report_does_not_depend_on_who_does_what(lattice: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = Options(locations=10_000)
    whole = check_file(lattice, options)
    assert {"G001", "G003", "T001", "T003"} <= {item.code for item in whole.findings}
    _in_parts(monkeypatch)
    forks, fork = [], os.fork
    monkeypatch.setattr(os, "fork", lambda: forks.append(1) or fork())
    alone, first, second = (_report(lattice, shared=shared, options=options) for shared in (False, True, True))
    assert len(forks) == 4
    assert alone == first == second
    counts = [[(item.code, item.count) for item in report.findings] for report in (whole, alone)]
    assert counts[0] == counts[1]
    assert whole.facts == alone.facts


def test_the_most_pairs_kept_are_those_of_all_parts() -> None:
    """A mesh that lies on itself everywhere takes no more memory and time in parts than whole."""
    body = topology.topology_of(Mesh(np.concatenate([CUBE_CORNERS, CUBE_CORNERS + 0.5]), TWO_CUBES), lambda: None)
    faces = self_crossing.crossings_of(body, arranged(body), stars_of(body), lambda: None).faces
    assert faces is not None
    pair = np.array([0]), np.array([1])
    for kept, looked_at in ((self_crossing._FEW // 24, 1), (self_crossing._FEW // 24 + 1, 0)):
        part = self_crossing.Crossings(kept=kept, parts=24)
        self_crossing._decide(faces, [pair], part)
        assert part.looked_at == looked_at


def test_a_small_mesh_is_checked_by_one_process(lattice: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fork", lambda: pytest.fail("a copy was made"))
    report = _report(lattice, shared=True, options=Options())
    assert report.findings == check_file(lattice, Options()).findings


def test_a_time_limit_ends_both(lattice: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _in_parts(monkeypatch)
    report = _report(lattice, shared=True, options=Options(limits=replace(Limits(), seconds=0.0)))
    assert "F011" in {item.code for item in report.findings}

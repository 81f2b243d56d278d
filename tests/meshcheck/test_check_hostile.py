"""Hostile and damaged input: never anything but a verdict, within bounds."""

import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shapes import ROOT_RELS, TYPES, box, mesh_xml, model_xml, package, stl

from unitcad.meshcheck import Options, check_file, check_mesh
from unitcad.meshcheck.file_checks import check_files, check_guarded


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=300), suffix=st.sampled_from([".stl", ".3mf", ".obj", ".ply", ".off", ".step"]))
def test_any_bytes_are_an_error_or_a_mesh(data, suffix, tmp_path):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    report = check_file(path)
    assert report.verdict == "error" or report.facts.triangles


@settings(max_examples=60)
@given(
    st.lists(st.tuples(*[st.integers(-2, 2)] * 3), min_size=3, max_size=8),
    st.lists(st.tuples(*[st.integers(0, 7)] * 3), min_size=1, max_size=12),
)
def test_any_little_mesh_has_a_verdict(points, faces):
    faces = [[i % len(points) for i in face] for face in faces]
    report = check_mesh(np.array(points, float), np.array(faces))
    assert report.verdict in ("pass", "warning", "error")
    assert not report.has("F011")


def test_a_bomb_is_refused_before_it_is_inflated(tmp_path):
    path = tmp_path / "bomb.3mf"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", TYPES)
        archive.writestr("_rels/.rels", ROOT_RELS)
        with archive.open("3D/3dmodel.model", "w") as entry:
            for _ in range(300):
                entry.write(bytes(1_000_000))
    assert path.stat().st_size < 400_000
    start = time.monotonic()
    report = check_file(path)
    assert report.has("P008")
    assert time.monotonic() - start < 5


@pytest.mark.parametrize(
    ("content", "bounds"),
    [
        (package(model_xml(before="<!--" + "ab" * 1_600_000 + "-->"), compression=0), {"max_package_bytes": 2_000_000}),
        (package(), {"max_entries": 2}),
    ],
    ids=["bytes", "entries"],
)
def test_a_packages_bounds(content, bounds, judge):
    assert judge(content, "a.3mf", **bounds).has("F011")


@pytest.mark.parametrize("flood", ['<vertex x="0" y="0" z="0" odd="1"/>', '<vertex x="0" y="0" z="0" xml:lang="1"/>'])
@pytest.mark.parametrize(("fault", "code"), [
    ('<triangle v1="0" v2="1" v3="400"/>', "P011"),
    ('<triangle v1="0" v2="1" v3="2147483647"/>', "P011"),
    ('<triangle v1="0" v2="1"/>', "P017"),
    ('</triangles></mesh></object><object id="2"><mesh><vertices><vertex x="nan" y="0" z="0"/></vertices><triangles>',
     "V001"),
])  # fmt: skip
def test_a_flood_of_findings_hides_no_other(flood, fault, code, judge):
    mesh = mesh_xml().replace("<vertices>", "<vertices>" + flood * 300).replace("</triangles>", fault + "</triangles>")
    report = judge(package(model_xml(f'<object id="1">{mesh}</object>')), "a.3mf")
    assert not report.has("F011")
    (found,) = (finding for finding in report.findings if finding.code == code)
    assert found.severity == "error"


def test_a_wrong_size_in_the_directory_is_no_way_round(judge):
    data = bytearray(package())
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = (10).to_bytes(4, "little")  # the model's inflated size in the directory
    assert judge(bytes(data), "a.3mf").verdict == "error"


def test_memory_limit_is_a_finding(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(np.tile(box(), (60_000, 1, 1)) + np.arange(720_000)[:, None, None] // 12 * 0.001))
    code = (
        "import sys, scipy.spatial, scipy.sparse.csgraph, manifold3d; from unitcad.meshcheck import Options; "
        "from unitcad.meshcheck.file_checks import check_files; import resource; "
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize() // 1_000_000; "
        f"r = list(check_files([({str(path)!r}, Options())], 1, used + 60)); "
        "sys.exit(0 if r[0].has('F011') else repr(r))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_a_worker_that_dies_names_its_file(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import dying

    for name in ("a.stl", "b.stl", "c.stl"):
        (tmp_path / name).write_bytes(stl(box()))
    work = [(str(tmp_path / name), dying.Deadly(name == "b.stl")) for name in ("a.stl", "b.stl", "c.stl")]
    reports = list(check_files(work, 2))
    assert [report.has("F011") for report in reports] == [False, True, False]


def test_inner_fault_is_a_finding(tmp_path, monkeypatch):
    monkeypatch.setattr("unitcad.meshcheck.file_checks.check_file", lambda *_: 1 / 0)
    report = check_guarded(str(tmp_path / "a.stl"), Options())
    assert report.has("F011")
    assert "ZeroDivisionError" in report.findings[0].message


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()))
    path.chmod(0)
    assert check_file(path).has("F012")

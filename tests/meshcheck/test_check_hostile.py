"""Hostile and damaged input: never anything but a verdict, within bounds."""

from __future__ import annotations

import io
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
from shapes import CUBE_CORNERS, CUBE_FACES, ROOT_RELS, TYPES, box, mesh_xml, model_xml, package, stl, text_stl

from unitcad.meshcheck import Limits, Options, check_file, check_mesh
from unitcad.meshcheck.file_checks import check_files, check_guarded

OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CUBE_CORNERS * 10)
OBJ += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in CUBE_FACES)
PLY = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
PLY += "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
PLY += "".join(f"{x} {y} {z}\n" for x, y, z in CUBE_CORNERS * 10) + "".join(
    f"3 {a} {b} {c}\n" for a, b, c in CUBE_FACES
)
OFF = "OFF\n8 12 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in CUBE_CORNERS * 10)
OFF += "".join(f"3 {a} {b} {c}\n" for a, b, c in CUBE_FACES)
MATERIALS = (
    '<basematerials id="5"><base name="a" displaycolor="#FF0000"/></basematerials>'
    '<m:colorgroup id="6"><m:color color="#FFFFFF"/></m:colorgroup>'
    '<m:multiproperties id="7" pids="5 6"><m:multi pindices="0 0"/></m:multiproperties>'
    f'<object id="1" pid="7" pindex="0">{mesh_xml()}</object>'
    '<object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 5 5"/></components></object>'
)
SEEDS = {
    "a.stl": stl(box()),
    "b.stl": text_stl(box()).encode(),
    "a.3mf": package(model_xml(MATERIALS), compression=zipfile.ZIP_STORED),
    "b.3mf": package(model_xml(MATERIALS)),
    "a.obj": OBJ.encode(),
    "a.ply": PLY.encode(),
    "a.off": OFF.encode(),
}
EDIT = st.tuples(
    st.sampled_from(["flip", "cut", "insert", "copy"]), st.integers(0, 10**6), st.binary(min_size=1, max_size=6)
)


def spoiled(data: bytes, edits: list[tuple[str, int, bytes]]) -> bytes:
    """The bytes after flips, cuts, insertions and repeats."""
    for kind, where, some in edits:
        at = where % max(len(data), 1)
        if kind == "flip":
            data = (
                data[:at]
                + bytes(x ^ y for x, y in zip(data[at : at + len(some)], some, strict=False))
                + data[at + len(some) :]
            )
        elif kind == "cut":
            data = data[:at] + data[at + 1 + len(some) * 9 :]
        elif kind == "insert":
            data = data[:at] + some + data[at:]
        else:
            data = data[:at] + data[max(0, at - 60) : at] + data[at:]
    return data


@pytest.mark.parametrize("name", sorted(SEEDS))
def test_the_seed_itself_is_clean(name: str, judge) -> None:
    assert judge(SEEDS[name], name).verdict == "pass"


@pytest.mark.parametrize("name", sorted(SEEDS))
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(EDIT, min_size=1, max_size=5))
def test_spoiled_bytes_give_a_verdict(name: str, edits: list[tuple[str, int, bytes]], tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(spoiled(SEEDS[name], edits))
    report = check_file(path, Options(limits=Limits(max_faces=100_000, seconds=20)))
    assert report.verdict in ("pass", "warning", "error")
    if report.facts.triangles is None:
        assert report.verdict == "error"  # nothing was judged: no silent pass


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=300), suffix=st.sampled_from([".stl", ".3mf", ".obj", ".ply", ".off", ".step"]))
def test_any_bytes_are_an_error_or_a_mesh(data: bytes, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    report = check_file(path)
    assert report.verdict == "error" or report.facts.triangles


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-2, 2)] * 3), min_size=3, max_size=8),
    st.lists(st.tuples(*[st.integers(0, 7)] * 3), min_size=1, max_size=12),
)
def test_any_little_mesh_has_a_verdict(points: list, faces: list) -> None:
    faces = [[i % len(points) for i in face] for face in faces]
    report = check_mesh(np.array(points, float), np.array(faces))
    assert report.verdict in ("pass", "warning", "error")
    assert not report.has("F011")


def test_a_bomb_is_refused_before_it_is_inflated(tmp_path: Path) -> None:
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


def test_a_slow_bomb_stops_at_the_package_limit(tmp_path: Path) -> None:
    comment = "<!--" + "ab" * 400_000 + "-->"
    data = package(model_xml(before=comment * 4), compression=zipfile.ZIP_STORED)
    path = tmp_path / "large.3mf"
    path.write_bytes(data)
    limits = Limits(max_package_bytes=2_000_000)
    assert check_file(path, Options(limits=limits)).has("F011")


def test_a_wrong_size_in_the_directory_is_no_way_round(tmp_path: Path) -> None:
    data = bytearray(package(model_xml()))
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = (10).to_bytes(4, "little")  # the model's inflated size in the directory
    path = tmp_path / "a.3mf"
    path.write_bytes(data)
    assert check_file(path).verdict == "error"


def test_too_many_entries(tmp_path: Path) -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for i in range(50):
            archive.writestr(f"a{i}", "x")
    (tmp_path / "a.3mf").write_bytes(out.getvalue())
    assert check_file(tmp_path / "a.3mf", Options(limits=Limits(max_entries=40))).has("F011")


def test_expansion_is_counted_first(tmp_path: Path) -> None:
    obj = f'<object id="1">{mesh_xml()}</object>'
    rows = "".join(
        f'<object id="{i}"><components>' + f'<component objectid="{i - 1}"/>' * 100 + "</components></object>"
        for i in range(2, 12)
    )
    path = tmp_path / "a.3mf"
    path.write_bytes(package(model_xml(obj + rows, '<build><item objectid="11"/></build>')))
    start = time.monotonic()
    assert check_file(path).has("P009")
    assert time.monotonic() - start < 5


def test_time_limit_is_a_finding(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()))
    report = check_guarded(str(path), Options(limits=Limits(seconds=0.0)))
    assert report.has("F011")
    assert report.verdict == "error"


def test_memory_limit_is_a_finding(tmp_path: Path) -> None:
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


def test_a_worker_that_dies_names_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import dying

    for name in ("a.stl", "b.stl", "c.stl"):
        (tmp_path / name).write_bytes(stl(box()))
    work = [(str(tmp_path / name), dying.Deadly(name == "b.stl")) for name in ("a.stl", "b.stl", "c.stl")]
    reports = list(check_files(work, 2))  # type: ignore[arg-type]
    assert [report.has("F011") for report in reports] == [False, True, False]


def test_inner_fault_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("unitcad.meshcheck.file_checks.check_file", lambda *_: 1 / 0)
    report = check_guarded(str(tmp_path / "a.stl"), Options())
    assert report.has("F011")
    assert "ZeroDivisionError" in report.findings[0].message


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()))
    path.chmod(0)
    assert check_file(path).has("F012")


def test_missing_folder_and_pipe(tmp_path: Path) -> None:
    assert check_file(tmp_path / "none.stl").has("F012")
    assert check_file(tmp_path).has("F012")
    os.mkfifo(tmp_path / "pipe.stl")
    assert check_file(tmp_path / "pipe.stl").has("F012")

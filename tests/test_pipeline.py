"""build: files, bytes, folders, interruption, what was left out."""

import hashlib
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh

from tests.in_process import unitcad as run
from tests.sample_bodies import LEADLESS
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import tool_dimensions
from unitcad.pipeline import unit_estimate as artifacts
from unitcad.pipeline.write import build, replacing, subject
from unitcad.validation import load, templates


def folder_name(spec):
    return subject(spec).folder_name


NAMES = sorted(templates())


def _tree(folder):
    return {
        str(f.relative_to(folder)): hashlib.sha256(f.read_bytes()).hexdigest()
        for f in sorted(folder.rglob("*"))
        if f.is_file() and f.name not in ("timings.json", "report.html")
    }


def _mesh_only(name, *more):
    return load(name, ['output.formats=["stl","3mf"]', *more])


@pytest.mark.parametrize("name", NAMES)
def test_every_template_builds_and_passes_all_checks(name, tmp_path):
    built = build(_mesh_only(name), tmp_path)
    assert built.ok
    assert built.manifest["check"]["findings"] == []
    assert {finding["code"] for finding in built.manifest["mould_checks"]} >= {"C000", "C100", "C200", "C210"}
    on_disk = {str(f.relative_to(built.folder)) for f in built.folder.rglob("*") if f.is_file()}
    assert {"spec.toml", "manifest.json", "timings.json", "section.svg", "unit.3mf", "moulds/moulds.3mf"} <= on_disk
    for part in built.manifest["parts"]:
        for entry in part["files"].values():
            content = (built.folder / entry["path"]).read_bytes()
            assert hashlib.sha256(content).hexdigest() == entry["sha256"]
        if "stl" not in part["files"]:
            assert part["made"] == "cut"
            continue
        mesh = trimesh.load_mesh(built.folder / part["files"]["stl"]["path"])
        assert len(mesh.faces) == part["triangles"]
        assert mesh.is_watertight
        assert mesh.is_volume
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(part["volume_mm3"], rel=1e-4)
        solid = manifold3d.Manifold(
            manifold3d.Mesh(np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32))
        )
        assert solid.status() == manifold3d.Error.NoError
        if part["role"] == "tool":
            assert mesh.bounds[0][2] == 0  # in print attitude, on the bed
        else:  # at its place, as in the STEP file
            assert mesh.bounds.ravel() == pytest.approx(part["bbox_mm"], abs=1e-5)
    spec = load(name)
    made = MouldSet(spec)
    if tool_dimensions(spec) != made.dimensions:  # rims at 3.25 and 4.4 mm print caps of 1.2 and 1.2
        assert name == "no-fpcb"
        made = MouldSet(load(name, ["layers.1.cap_mm=1.15"]))
    for step in built.manifest["steps"]:
        drawn = made.solids[f"layer{step['index']}"].volume() * np.prod(spec.moulds.cavities)
        assert step["cavity_volume_mm3"] == pytest.approx(drawn, rel=1e-8)


def test_further_formats_are_added_and_none_removed(tmp_path):
    spec = load("single-embedded", ['output.formats=["stl"]'])
    first = build(spec, tmp_path, only=["unit"])
    (first.folder / "note.txt").write_text("mine")
    second = build(load("single-embedded", ['output.formats=["3mf"]']), tmp_path, only=["moulds"])
    assert second.folder == first.folder
    assert (first.folder / "unit" / "layer1.stl").exists()
    assert (first.folder / "moulds" / "moulds.3mf").exists()
    assert (first.folder / "note.txt").read_text() == "mine"
    assert second.manifest["outputs"] == ["unit", "moulds"]


def test_the_folder_name_ignores_name_and_formats_only():
    spec = load("embedded")
    digits = folder_name(spec)[-12:]
    assert folder_name(load("embedded", ["name='An other: name'"])) == f"an-other-name-{digits}"
    assert folder_name(load("embedded", ['output.formats=["stl"]']))[-12:] == digits
    assert folder_name(load("embedded", ["casting.room_c=25.0"]))[-12:] != digits
    assert len(folder_name(load("embedded", [f"name='{'x' * 120}'"]))) < 64
    assert folder_name(load("embedded", ["name='é<>'"])).startswith(("e-", "unit-"))


def test_a_folder_of_another_spec_is_an_error_and_stays(tmp_path):
    spec = load("single-embedded", ['output.formats=["stl"]'])
    folder = build(spec, tmp_path, only=["unit"]).folder
    other = load("single-embedded", ["layers.0.wall_mm=2.4"])
    from unitcad.spec import to_toml

    (folder / "spec.toml").write_text(to_toml(other))
    before = _tree(folder)
    with pytest.raises(UnitcadError, match=r"spec\.toml differs"):
        build(spec, tmp_path, only=["unit"])
    (folder / "spec.toml").unlink()
    with pytest.raises(UnitcadError, match="not a result of unitcad"):
        build(spec, tmp_path, only=["unit"])
    del before["spec.toml"]
    assert _tree(folder) == before


def test_an_interrupted_build_leaves_the_old_result_whole(tmp_path):
    spec = load("single-embedded", ['output.formats=["stl"]'])
    folder = build(spec, tmp_path, only=["unit"]).folder
    before = _tree(folder)
    with pytest.raises(KeyboardInterrupt), replacing(folder) as fresh:
        (fresh / "spec.toml").write_text("half")
        raise KeyboardInterrupt
    assert _tree(folder) == before
    assert _tree(build(spec, tmp_path, only=["unit"]).folder) == before
    assert [p.name for p in tmp_path.iterdir()] == [folder.name]


def test_a_process_killed_between_the_two_renames_leaves_the_old_result_whole(tmp_path):
    spec = load("single-embedded", ['output.formats=["stl"]'])
    folder = build(spec, tmp_path, only=["unit"]).folder
    before = _tree(folder)
    code = (
        "import os, signal; from pathlib import Path; from unitcad.pipeline.write import replacing\n"
        "rename = Path.rename\n"
        "def fatal(path, target):\n"
        "    rename(path, target)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
        "Path.rename = fatal\n"
        f"with replacing(Path({str(folder)!r})) as fresh:\n"
        "    (fresh / 'spec.toml').write_text('half')\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == -signal.SIGKILL
    assert not folder.exists()
    assert _tree(build(spec, tmp_path, only=["unit"]).folder) == before
    assert [p.name for p in tmp_path.iterdir()] == [folder.name]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("single-embedded", "second pour"),
        (LEADLESS, "tongue and slot"),
        ("embedded", "tongue and slot"),
        ("embedded", "filament and its hole"),
        ("embedded", "mould checks"),
        ("embedded", "boundary representation"),
    ],
)
def test_what_a_variant_lacks_is_left_out_and_listed(name, what, tmp_path):
    built = build(load(name, ['output.formats=["stl"]']), tmp_path, only=["unit", "moulds"], check=False)
    assert what in {entry["output"] for entry in built.manifest["skipped"]}
    assert all(entry["reason"] for entry in built.manifest["skipped"])


def test_json_is_one_object_and_the_last_line_is_the_folder(tmp_path):
    command = ["build", "single-embedded", "--formats", "stl", "--only", "unit", "-o", tmp_path]
    assert Path(run(*command).stdout.splitlines()[-1]).is_dir()
    data = json.loads(run(*command, "--json").stdout)
    assert data["variants"][0]["ok"] is True
    refused = run(*command, "--set", "diameter_mm=3.0", "--json")
    assert refused.returncode == 2
    assert json.loads(refused.stdout)["error"]["field"] == "diameter_mm"


def test_ctrl_c_stops_without_a_traceback(tmp_path):
    child = subprocess.Popen(
        [sys.executable, "-m", "unitcad", "build", *NAMES, "--formats", "stl", "-o", str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not list(tmp_path.glob("[!.]*/manifest.json")):  # the first variant is done, the others are to come
        assert child.poll() is None
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 130  # 0 where the signal is ignored
    assert errors.splitlines()[-1] == "interrupted"
    assert "Traceback" not in errors
    assert len(list(tmp_path.glob("[!.]*"))) < len(NAMES)
    assert not [p for p in tmp_path.glob(".tmp-*")]


def test_variants_that_differ_in_casting_alone_share_one_estimate(monkeypatch, tmp_path):
    """The file is the one that another process, which remembers nothing, makes; another silicone has its own."""
    made = []
    whole = artifacts.estimate_spec
    monkeypatch.setattr(artifacts, "estimate_spec", lambda *asked, **more: made.append(asked) or whole(*asked, **more))
    artifacts._ESTIMATES.clear()
    changes = [(), ("casting.room_c=24",), ("casting.waste=0.7",), ("layers.0.material=ecoflex-00-30",)]
    files = []
    for i, change in enumerate(changes):
        built = build(load("single-embedded", change), tmp_path / str(i), only=("estimate",))
        files.append((built.folder / "estimate.json").read_bytes())
    assert len(made) == 2
    assert files[0] == files[1] == files[2] != files[3]
    artifacts._ESTIMATES.clear()
    again = build(load("single-embedded", changes[1]), tmp_path / "again", only=("estimate",))
    assert (again.folder / "estimate.json").read_bytes() == files[1]

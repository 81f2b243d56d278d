"""No filter makes a file pass that was not judged."""

import json
import zipfile

import numpy as np
import pytest
from shapes import CUBE_CORNERS, box, mesh_xml, model_xml, package, stl
from test_check_command import run

from unitcad.meshcheck import Options, check_mesh

FILTERS = (["--select", "G"], ["--ignore", "F,P,V"], ["--select", "T,G", "--ignore", "F0"])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "page.stl").write_bytes(b"<!DOCTYPE html><html></html>")
    (tmp_path / "cut.stl").write_bytes(stl(box())[:-80])
    (tmp_path / "none.stl").write_bytes(stl(box()[:0]))
    (tmp_path / "nan.stl").write_bytes(stl(box((np.nan, 1, 1))))
    (tmp_path / "good.stl").write_bytes(stl(box()))
    (tmp_path / "cut.3mf").write_bytes(package()[:-30])
    (tmp_path / "xml.3mf").write_bytes(package(model_xml()[:-30]))
    (tmp_path / "index.3mf").write_bytes(package(model_xml(f'<object id="1">{mesh_xml(CUBE_CORNERS[:7])}</object>')))
    (tmp_path / "bare.3mf").write_bytes(package(model_xml(build="<build/>")))
    with zipfile.ZipFile(tmp_path / "bomb.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", bytes(30_000_000))
    return tmp_path


@pytest.mark.parametrize("chosen", FILTERS, ids=" ".join)
@pytest.mark.parametrize(
    "name",
    ["page.stl", "cut.stl", "none.stl", "nan.stl", "cut.3mf", "xml.3mf", "index.3mf", "bomb.3mf"],
)
def test_what_ended_the_judgement_survives_every_filter(folder, name, chosen):
    result = run(name, "--json", *chosen, cwd=folder)
    (entry,) = json.loads(result.stdout)["files"]
    assert (result.returncode, entry["verdict"]) == (1, "error")
    assert entry["findings"]


@pytest.mark.parametrize("chosen", FILTERS, ids=" ".join)
def test_a_limit_survives_every_filter(folder, chosen):
    result = run("good.stl", "--max-faces", "3", *chosen, cwd=folder)
    assert result.returncode == 1
    assert "F011" in result.stdout
    assert run("good.stl", *chosen, cwd=folder).returncode == 0


def test_a_build_without_an_item_is_said_whatever_is_selected(folder):
    result = run("bare.3mf", "--select", "G", cwd=folder)
    assert "P014 warning" in result.stdout
    assert run("bare.3mf", "--select", "G", "--fail-on", "warning", cwd=folder).returncode == 1


def test_a_mesh_in_memory_that_cannot_be_judged_survives_too():
    report = check_mesh(CUBE_CORNERS, np.array([[0, 1, 9]]), Options(select=("G",)))
    assert [found.code for found in report.findings] == ["P011"]


def test_faults_beside_the_judgement_are_filtered_as_asked(folder):
    (folder / "warn.stl").write_bytes(stl(box()[2:], header=b"solid"))
    assert run("warn.stl", "--ignore", "T,F", cwd=folder).returncode == 0
    assert "F007" not in run("warn.stl", "--select", "T", cwd=folder).stdout

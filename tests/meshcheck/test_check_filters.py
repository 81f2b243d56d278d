"""No filter makes a file pass that was not judged."""

import numpy as np
import pytest
from malformed import cases
from shapes import CUBE_CORNERS, box, model_xml, package, stl
from test_check_command import run

from unitcad.meshcheck import Options, check_bytes, check_mesh

FILTERS = (["--select", "G"], ["--ignore", "F,P,V"], ["--select", "T,G", "--ignore", "F0"])
ENDED = [
    "page.stl", "cut.stl", "header-only.stl", "nan.stl", "cut.3mf", "cut-xml.3mf", "index.3mf", "bomb.3mf", "cut.ply",
    "cut.off",
]  # fmt: skip
"""Malformed files that could not be judged."""


@pytest.mark.parametrize("chosen", [{"select": ("G",)}, {"ignore": ("F", "P", "V")}])
@pytest.mark.parametrize("case", [case for case in cases() if case.name in ENDED], ids=lambda case: case.name)
def test_what_ended_the_judgement_survives_every_filter(case, chosen):
    report = check_bytes(case.data(), case.name, Options(**chosen))
    assert report.has(case.code)
    assert report.verdict == "error"


@pytest.mark.parametrize("chosen", FILTERS, ids=" ".join)
def test_a_limit_survives_every_filter(tmp_path, chosen):
    (tmp_path / "good.stl").write_bytes(stl(box()))
    result = run("good.stl", "--max-faces", "3", *chosen, cwd=tmp_path)
    assert result.returncode == 1
    assert "F011" in result.stdout
    assert run("good.stl", *chosen, cwd=tmp_path).returncode == 0


def test_a_build_without_an_item_is_said_whatever_is_selected():
    report = check_bytes(package(model_xml(build="<build/>")), "a.3mf", Options(select=("G",)))
    assert [(found.code, found.severity) for found in report.findings] == [("P014", "warning")]


def test_a_mesh_in_memory_that_cannot_be_judged_survives_too():
    report = check_mesh(CUBE_CORNERS, np.array([[0, 1, 9]]), Options(select=("G",)))
    assert [found.code for found in report.findings] == ["P011"]


def test_faults_beside_the_judgement_are_filtered_as_asked():
    content = stl(box()[2:]) + bytes(16)
    assert check_bytes(content, "a.stl", Options(ignore=("T", "F"))).findings == ()
    assert not check_bytes(content, "a.stl", Options(select=("T",))).has("F006")

"""How numbers and names come out: no -0, no powers of ten where digits do, UTF-8 whatever a file is called."""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polygon_files import ply
from shapes import CUBE_CORNERS, CUBE_FACES, box, mesh_xml, model_xml, package, stl

from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.findings import number


@pytest.mark.parametrize(
    ("value", "digits", "expected"),
    [
        (-0.0, 6, "0"), (1e-9, 6, "0"), (-1e-9, 6, "0"), (0.00001, 6, "0.00001"), (1.5e-5, 3, "0.000015"),
        (1 / 3, 6, "0.333333"), (1 / 3, 3, "0.333"), (-2.5, 6, "-2.5"), (1234567.0, 6, "1234570"), (1e6, 6, "1000000"),
        (999999.5, 6, "1000000"), (0.0009999996, 6, "0.001"), (10.0, 6, "10"), (1e15, 6, "1e+15"), (3e38, 6, "3e+38"),
        (0.07323, 3, "0.0732"), (9.996, 3, "10"),
    ],
)  # fmt: skip
def test_numbers_in_messages(value, digits, expected):
    assert number(value, digits) == expected
    assert float(number(value, digits, zeros=True)) == float(expected)


@given(st.floats(-1e14, 1e14))
def test_numbers_are_within_their_digits(value):
    text = number(value)
    assert "e" not in text
    assert text != "-0"
    assert float(text) == pytest.approx(value, rel=5.1e-6, abs=1.1e-6)


@pytest.mark.parametrize(("n", "told"), [(10_000, "10000 faces"), (10_001, "more than 10,000 faces")])
def test_places_are_counted_up_to_ten_thousand(n, told):
    faces = np.concatenate([CUBE_FACES, np.tile([[0, 0, 1]], (n, 1))])
    found = check_mesh(CUBE_CORNERS * 10, faces).findings
    assert [(item.code, item.count, item.message) for item in found] == [("T010", 10_000, f"{told} without area")]


def test_no_volume_of_a_mesh_that_is_not_oriented(judge):
    """Closed, but one face is turned over: what it encloses has no meaning."""
    turned = box()
    turned[0] = turned[0][::-1]
    facts = judge(stl(turned)).facts
    assert facts.watertight is True
    assert facts.volume_mm3 is None
    faces = np.arange(36).reshape(-1, 3)
    model = model_xml(f'<object id="1">{mesh_xml(turned.reshape(-1, 3), faces)}</object>')
    assert judge(package(model), "a.3mf").facts.volume_mm3 is None
    assert judge(stl(box())).facts.volume_mm3 == pytest.approx(1000)


@pytest.mark.skipif(sys.platform != "linux", reason="names of any bytes")
@pytest.mark.parametrize(("format_", "encoding"), [("json", "ascii"), ("junit", "latin-1")])
def test_machine_formats_are_utf8_for_any_name(format_, encoding, tmp_path):
    for name in (b"k\xe4se\xff\\.stl", "Käse.stl".encode(), b"line\nbreak.stl"):
        (tmp_path / os.fsdecode(name)).write_bytes(stl(box()[1:]))
    command = [sys.executable, "-m", "unitcad", "check", ".", "--output-format", format_]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, env=environment)
    assert (done.returncode, done.stderr) == (1, b"")
    text = done.stdout.decode("utf-8")
    if format_ == "junit":
        assert "Käse.stl" in ET.tostring(ET.fromstring(text), "unicode")
        return
    names = [entry["path"] for entry in json.loads(text)["files"]]
    assert names == ["Käse.stl", "k\\xe4se\\xff\\.stl", "line\nbreak.stl"]


def test_numbers_that_float32_has_none_for_are_zero(judge):
    """Their products are beyond what doubles hold, too."""
    points = CUBE_CORNERS * 10
    points[points == 0] = 1e-312
    assert judge(ply(points, CUBE_FACES.tolist()), "a.ply").findings == ()
    report = judge(ply(CUBE_CORNERS * 1e-311, CUBE_FACES.tolist()), "a.ply")
    assert report.verdict == "error"
    assert not report.has("F011")

"""gmsh as a real client of the STEP files: the same solids, the same volumes."""

import re
import shutil
import subprocess

import pytest

from unitcad.api.variant import Variant
from unitcad.pipeline.write import build
from unitcad.validation import load

pytestmark = pytest.mark.skipif(shutil.which("gmsh") is None, reason="gmsh is not installed")
pytest.importorskip("build123d")


def read(path):
    """Volumes of the solids of a STEP file in mm3, as gmsh finds them."""
    script = path.with_suffix(".geo")
    script.write_text(
        'SetFactory("OpenCASCADE");\n'
        f'v() = ShapeFromFile("{path}");\n'
        "For i In {0:#v()-1}\n"
        "  m = Mass Volume{v(i)};\n"
        '  Printf("volume %.15g", m);\n'
        "EndFor\n"
    )
    done = subprocess.run(
        ["gmsh", str(script), "-", "-nopopup"], capture_output=True, text=True, timeout=120, check=True, cwd=path.parent
    )
    return [float(number) for number in re.findall(r"^volume (\S+)$", done.stdout + done.stderr, re.M)]


def test_same_solids_and_volumes(tmp_path):
    variant = Variant(load("encapsulating", ["output.formats=['step']"]))
    folder = build(variant.spec, tmp_path, only=("unit", "moulds"), check=False).folder
    there = [read((folder / file).resolve()) for file in ("unit.step", "moulds/moulds.step")]
    assert [len(volumes) for volumes in there] == [len(variant.unit), len(variant.plan.tools)]
    apart = variant.to_build123d(exploded=True)  # as drawn: no rib is crushed
    drawn = sorted(body.volume for group in apart.children for body in group.children)
    assert sorted([*there[0], *there[1]]) == pytest.approx(drawn, rel=1e-9)

"""Builds of one spec into one folder at the same time: none fails, and what each was asked for is there at the end."""

import os
import random
import subprocess
import sys
import tomllib

import pytest

from unitcad.pipeline.write import whole

FORMATS = ("stl", "3mf", "svg", "glb")
OUTPUTS = ("unit", "estimate", "casting")


@pytest.mark.parametrize(
    ("count", "seed"), [(3, 2), *(pytest.param(18, seed, marks=pytest.mark.long) for seed in range(4))]
)
def test_builds_of_one_spec_at_the_same_time(count, seed, tmp_path):
    folder = tmp_path / "out"
    dice = random.Random(seed)
    asked = [(dice.choice(FORMATS), dice.choice(OUTPUTS), dice.random() < 0.5) for _ in range(count)]
    build = [sys.executable, "-P", "-m", "unitcad", "build", "single-embedded", "--set", "output.tolerance_mm=0.1"]
    children = [
        subprocess.Popen(
            [*build, "-o", folder, "--formats", form, "--only", only, *(["--report"] if page else [])],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "UNITCAD_TRACEBACK": "1"},
        )
        for form, only, page in asked
    ]  # fmt: skip
    for child in children:
        _, errors = child.communicate(timeout=500)
        assert child.returncode == 0, errors
    (result,) = folder.iterdir()
    manifest = whole(result, hashes=True)
    assert manifest is not None
    assert set(manifest["outputs"]) == {only for _, only, _ in asked}
    formats = tomllib.loads((result / "spec.toml").read_text())["output"]["formats"]
    assert set(formats) == {form for form, _, _ in asked}
    assert (result / "report.html").exists() == any(page for _, _, page in asked)

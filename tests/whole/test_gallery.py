"""The gallery's specs: each builds with its moulds, its checks hold, and one number agrees with the published one."""

import json
import math
import re
from pathlib import Path

import pytest

from tests.in_process import unitcad
from unitcad import Variant
from unitcad.arrays import load_array
from unitcad.validation import compound_kind

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
SPECS = sorted(GALLERY.glob("*.toml"))
POCKET = math.pi * 3.5**2 * 2.0
"""The volume that the motor of 7 x 2 mm takes from a gel, mm3."""


IN_CI = {"gel-dome", "sleeve-cluster", "lra-8mm"}


@pytest.mark.parametrize(
    "spec",
    [pytest.param(one, marks=() if one.stem in IN_CI else pytest.mark.long, id=one.stem) for one in SPECS],
)
def test_it_builds_and_all_its_checks_hold(spec, tmp_path):
    assert len(spec.read_text().splitlines()) <= 30
    assert re.search(r"not expressible", spec.read_text(), re.I)
    done = unitcad("build", spec, "--formats", "stl", "--no-report", "-o", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    (folder,) = tmp_path.iterdir()
    assert '"holds": false' not in json.dumps(json.loads((folder / "manifest.json").read_text()))
    if spec.stem.startswith("gel"):
        assert unit_volume(spec) == pytest.approx(gel_volume(spec.stem), rel=1.5e-3)  # tessellated to 0.02 mm


def unit_volume(spec):
    variant = Variant.of(spec)
    return sum(variant.mesh(body).volume() for body in variant.unit if body.name == "layer1")


def gel_volume(name):
    """Return the exact volume of a gel drawn from its published lengths, mm3."""
    if name == "gel-pad":
        return (18.2 * 24.6 - (4 - math.pi) * 2.0**2) * 3.8 - POCKET
    low, high, radius = 10.0, 19.5, 20.0
    return math.pi * (radius**2 * (high - low) - (high**3 - low**3) / 3) - POCKET


@pytest.mark.parametrize(
    ("name", "diameter", "height"), [("lra-8mm", 8, 3.2), ("lra-10mm", 10, 3.6), ("exciter-13mm", 13, 6.5)]
)
def test_an_actuator_has_its_published_size(name, diameter, height):
    box = Variant.of(GALLERY / f"{name}.toml").mesh("motor").bounding_box()
    assert box[3] - box[0] == pytest.approx(diameter, abs=0.02)  # of equal area
    assert box[5] - box[2] == pytest.approx(height, abs=1e-3)


def test_the_arrays_have_their_published_numbers():
    ring = load_array(GALLERY / "forearm-ring.toml")
    assert 2 * math.pi * ring.radius_mm == pytest.approx(245, abs=0.1)
    counts = {path.stem: len(load_array(path).places) for path in SPECS if compound_kind(path)}
    assert counts == {"forearm-ring": 8, "sleeve-cluster": 7, "tape": 10, "thumb-array": 9}

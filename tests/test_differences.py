"""What differs between built results: only that, of the specs and of what came out, each in its own words."""

import re
from dataclasses import replace

import pytest
from typer.testing import CliRunner

import unitcad
from unitcad.cli import app
from unitcad.pipeline.differences import differences

OTHER = {"layers.0.wall_mm": 1.5, "layers.1.material": "dragon-skin-10-medium", "name": "other"}


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    out, less = tmp_path_factory.mktemp("two"), {"only": ("unit", "estimate"), "formats": "stl", "check": False}
    return unitcad.build("encapsulating", out, **less), unitcad.build("encapsulating", out, set=OTHER, **less)


def test_a_row_for_each_value_that_differs_and_no_other(two):
    rows = {row.pop(""): row for row in differences(two)}
    assert rows["layers.0.wall_mm"] == {"encapsulating": "1.25", "other": "1.5"}
    assert rows["layers.1.material"] == {"encapsulating": "dragon-skin-30", "other": "dragon-skin-10-medium"}
    # Nobody asked for another pad, and the unit is as large as before.
    assert set(rows) == {"layers.0.wall_mm", "layers.1.material", "silicone, g", "level at the edge", "measured level"}
    densities = {"ecoflex-00-10": 1.04, "dragon-skin-30": 1.08, "dragon-skin-10-medium": 1.07}
    for one in two:
        silicones = [layer.material for layer in one.spec.layers]
        volumes = (one.volumes["layer1"], one.volumes["layer2"])
        grams = sum(v * densities[name] / 1000 for v, name in zip(volumes, silicones, strict=True))
        assert float(rows["silicone, g"][one.spec.name]) == pytest.approx(grams, abs=5e-4)
        head = re.match(
            r"Level at the edge: (\S+) % of the motor's amplitude \((.*?)\)", one.manifest["estimate"]["line"]
        )
        assert rows["level at the edge"][one.spec.name] == f"{head[1]} % ({head[2]})"


def test_results_of_one_name_have_their_folders_and_the_same_one_no_row(two):
    assert differences([two[0], two[0]]) == []
    namesake = replace(two[1], manifest={**two[1].manifest, "name": "encapsulating"})
    (again, *_) = differences([two[0], namesake])
    assert [*again][1:] == [one.folder.name for one in two]


def test_build_of_several_ends_with_it(tmp_path):
    words = ["--only", "estimate", "--formats", "stl", "-o", str(tmp_path)]
    done = CliRunner().invoke(app, ["build", "encapsulating", "embedded", *words])
    assert "What differs" in done.stderr
    assert "4.6 % (3.1 to 6.8)" in done.stderr
    assert len(done.stdout.splitlines()) == 2  # the folders alone
    assert "What differs" not in CliRunner().invoke(app, ["build", "embedded", *words]).stderr

"""docs/fem.json holds what the finite elements give: one of its rows is made again."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("skfem")

from benchmarks.accuracy.fem_search import COMPONENTS, unit_levels
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.fem.unit import Draw

DATA = json.loads((Path(__file__).parents[2] / "docs" / "fem.json").read_text("utf-8"))


@pytest.mark.parametrize("index", [None, 0])
def test_a_row_is_made_again(index):
    unit = DATA["units"][4]
    draw = None if index is None else Draw(DATA["seed"], index, len(DATA["draws"]))
    found = unit_levels(unit, draw, DATA["fineness"])
    stored = np.array(DATA["nominal"] if index is None else DATA["draws"][index])[4]
    assert stored[0] == pytest.approx(found[0, :, COMPONENTS.index("radial"), 0], rel=1e-3)
    assert stored[1] == pytest.approx(found[1, :, COMPONENTS.index("normal"), 0], rel=1e-3)
    assert tuple(DATA["units"]) == measured_table().names
    assert len(DATA["draws"]) >= 100

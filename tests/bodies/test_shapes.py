"""Forty bodies: each is cast, or refused with the ways that were tried."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from tests.bodies.judge import cavity, collisions, moments
from tests.bodies.shapes import BODIES, HEAD, QUICK, REFUSED
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import ready
from unitcad.validation import load

SPEC = """
name = "body"
design = "drawn.py:unit"
diameter_mm = 16.0
motor = false
[[layers]]
material = "ecoflex-00-30"
wall_mm = 1.25
cap_mm = 1.25
[output]
formats = ["stl"]
tolerance_mm = 0.05
"""


def moulds_of(folder, drawn, *changes):
    (folder / "drawn.py").write_text(f"{HEAD}\ndef unit(spec):\n    return {drawn}\n")
    (folder / "spec.toml").write_text(SPEC)
    return MouldSet(load(folder / "spec.toml", changes))


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=() if each in QUICK else pytest.mark.long) for each in BODIES]
)
def test_a_body_is_cast_and_its_pieces_come_apart(name, tmp_path):
    drawn, way = BODIES[name]
    moulds = moulds_of(tmp_path, drawn)
    assert way in moulds.plan.way
    assert (moulds.plan.way == "") == (way == "")
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    for piece in moulds.plan.pieces:
        ready(moulds, piece)
    # From here on by code of the tests' own.
    assert list(collisions(moulds)) == []
    (filled,) = cavity(moulds)
    (step,) = moulds.plan.steps
    poured = Manifold.batch_boolean(moulds.meshes((*step.layer, *step.channels)), OpType.Add)
    assert (poured - filled).volume() + (filled - poured).volume() < 1e-3 * poured.volume()
    np.testing.assert_allclose(moments(moulds.meshes(step.layer)[0]), moments(moulds.solids["layer1"]), rtol=1e-3)


@pytest.mark.parametrize("name", REFUSED)
def test_a_body_without_a_mould_is_refused_with_the_reason(name, tmp_path):
    drawn, why = REFUSED[name]
    with pytest.raises(Refusal, match=why) as refused:
        moulds = moulds_of(tmp_path, drawn)
        for piece in moulds.plan.pieces:
            ready(moulds, piece)
    assert str(refused.value).endswith("--only unit makes only the unit")

"""Forty bodies: each is cast, or refused with the ways that were tried."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from tests.bodies.judge import cavity, collisions, moments
from tests.bodies.shapes import BODIES, HEAD, QUICK, REFUSED
from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_markdown
from unitcad.casting.views import picture_path, views
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
    (step,) = moulds.plan.steps
    (filled,) = cavity(moulds, step)
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


TIP = """
def tip(r, z): return union([cylinder(r, 0, z), Common((ball(r, z), box(-9, 9, -9, 9, z, 30)))])
def unit(spec):
    return {"layer1": cut(tip(5.5, 8), [cylinder(3.5, -1, 2)]), "layer2": cut(tip(7, 8), [tip(5.5, 8)])}
"""


def test_a_layered_fingertip_is_cast_in_closed_cups(tmp_path):
    """Two pours, each under a round top: a gate and a vent each. Every pour's space is its layer and its channels."""
    layer = SPEC[SPEC.index("[[layers]]") : SPEC.index("[output]")]
    (tmp_path / "drawn.py").write_text(HEAD + TIP)
    (tmp_path / "spec.toml").write_text(SPEC.replace("motor = false\n", "").replace(layer, 2 * layer))
    moulds = MouldSet(load(tmp_path / "spec.toml"))
    assert moulds.plan.way == "as drawn: cups closed above, filled through a gate"
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    for step in moulds.plan.steps:
        (filled,) = cavity(moulds, step)
        poured = Manifold.batch_boolean(moulds.meshes((*step.layer, *step.channels)), OpType.Add)
        assert (poured - filled).volume() + (filled - poured).volume() < 1e-3 * poured.volume()
        assert poured.volume() > 1.01 * moulds.meshes(step.layer)[0].volume()
    text = to_markdown(procedure(moulds, [moulds.solids[step.name].volume() for step in moulds.plan.steps]))
    assert [text.count(each) for each in ("**Inject.**", "**Cup 2 off.**", "Side pieces", "Strike")] == [2, 1, 0, 0]
    assert {"pour1-inject", "pour2-cup-off", "peel"} <= set(views(moulds))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("cone, wide above", ("Peel out", "into the groove", "The body is cast as drawn.")),
        ("dimples on four sides", ("Side pieces together", "Frame off", "cup 1a, cup 1b, cup 1c and cup 1d")),
        ("dumbbell", ("The body is cast +x up.", "until every vent shows a bead", "Sprue and vents tear off")),
    ],
)
def test_the_sheet_says_how_a_parted_mould_is_used(name, said, tmp_path):
    moulds = moulds_of(tmp_path, BODIES[name][0])
    made = procedure(moulds, [moulds.solids["layer1"].volume()])
    text = to_markdown(made)
    assert [each for each in said if each not in text] == []
    # Each step's picture is drawn, and each view belongs to a step.
    every = [*made.preparation, *made.pours[0].steps, *made.release]
    assert {step.picture for step in every if step.picture} == {picture_path(view) for view in views(moulds)}


@pytest.mark.parametrize(
    ("parting", "z", "way"),
    [("z=3", 3.0, "as drawn: two halves"), ("z=1", 1.0, "no mould")],
)
def test_a_mould_comes_apart_at_the_named_plane(parting, z, way, tmp_path):
    """A barrel has its widest level at z = 3; at z = 1 the upper half would catch it."""
    if way == "no mould":
        with pytest.raises(Refusal, match="no mould that comes apart there") as refused:
            _ = moulds_of(tmp_path, "union([cone(4, 6, 0, 3), cone(6, 4, 3, 6)])", f"moulds.parting={parting}").plan
        assert refused.value.field == "moulds.parting"
        return
    moulds = moulds_of(tmp_path, "union([cone(4, 6, 0, 3), cone(6, 4, 3, 6)])", f"moulds.parting={parting}")
    assert moulds.plan.way.startswith(way)
    (layer,) = moulds.meshes(moulds.plan.steps[0].layer)
    assert layer.bounding_box()[2] == pytest.approx(-z, abs=1e-3)
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    assert list(collisions(moulds)) == []


def test_a_parting_is_refused_beside_the_body_and_for_a_design_that_has_none(tmp_path):
    with pytest.raises(Refusal, match="misses the body, which reaches from 0 to 6") as refused:
        _ = moulds_of(tmp_path, "union([cone(4, 6, 0, 3), cone(6, 4, 3, 6)])", "moulds.parting=z=9").plan
    assert refused.value.nearest == "z=3"
    with pytest.raises(Refusal, match="custom design"):
        load("encapsulating", {"moulds.parting": "z=1"})

"""A cupboard: `design` tries only what a person owns."""

import pytest

from unitcad.errors import Refusal
from unitcad.search.candidates import geometries, spec_data
from unitcad.search.target_file import target_of
from unitcad.validation import from_data

OWNED = """
[at_hand]
materials = ["ecoflex-00-10", "our-blend"]
motors = ["VC0820B006F"]
printer = "sla"
[materials.our-blend]
like = "dragon-skin-30"
"""


def target(folder, text=OWNED, **more):
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    at_hand = {"cupboard": "mine.toml", **more}
    vary = {"step_mm": 1.0}
    return target_of({"target": {"edge_max": 0.5}, "at_hand": at_hand, "vary": vary}, "target", folder)


def test_a_design_tries_only_what_is_owned(tmp_path):
    found = target(tmp_path)
    assert found.materials == ("ecoflex-00-10", "our-blend")
    made, _ = geometries(found)
    assert {one.lengths.motor for one in made} == {"VC0820B006F"}
    spec = from_data(spec_data(found, made[0].lengths, ("our-blend",) * len(made[0].lengths.walls)))
    assert spec.moulds.printer == "sla"
    assert spec.materials["our-blend"].like == "dragon-skin-30"


def test_a_list_of_the_target_goes_before_the_cupboard(tmp_path):
    assert target(tmp_path, materials=["ecoflex-00-50"]).materials == ("ecoflex-00-50",)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('[at_hand]\nmaterials = ["ecoflex-00-11"]', r"materials\.0 = 'ecoflex-00-11': unknown name"),
        ('[at_hand]\nmotors = ["LCM"]', r"motors\.0 = 'LCM': unknown name"),
        ('[at_hand]\nprinter = "fmd"', r"printer = 'fmd': unknown name"),
        ("[at_hand]\nmaterials = []", r"at_hand\.materials"),
        ("[at_hand]\nsilicones = []", r"at_hand\.silicones"),
        ("materials = [", r"mine\.toml"),
        ("", r"at_hand"),
        ('[at_hand]\ncupboard = "mine.toml"', r"no other one"),
    ],
)
def test_a_cupboard_with_a_fault_is_refused_with_its_field(tmp_path, text, match):
    with pytest.raises(Refusal, match=match) as refused:
        target(tmp_path, text)
    assert refused.value.field == "at_hand.cupboard"


def test_a_cupboard_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(Refusal, match=r"^at_hand\.cupboard = 'none\.toml': ") as refused:
        target_of({"target": {"edge_max": 0.5}, "at_hand": {"cupboard": "none.toml"}}, "target", tmp_path)
    assert refused.value.field == "at_hand.cupboard"

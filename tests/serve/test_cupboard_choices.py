"""The live page's pickers with a cupboard: names of the form, and own entries that go into the text."""

import msgspec
import pytest

from unitcad.errors import UnitcadError
from unitcad.serve.answers import answered
from unitcad.serve.cupboard_choices import held_in
from unitcad.serve.messages import Ask, Edit, Trusted
from unitcad.validation import every_template

CUPBOARD = """
[at_hand]
materials = ["dragon-skin-30", "our-blend"]
printer = "mine"
[materials.our-blend]
like = "ecoflex-00-30"
density_g_cm3 = 1.09
[printers.mine]
like = "fdm-0.4"
window_clearance_mm = 0.15
"""


def choices(answer):
    return {field.path: dict(field.choices) for group in answer.groups for field in group.fields if field.choices}


@pytest.fixture
def held(tmp_path):
    file = tmp_path / "cupboard.toml"
    file.write_text(CUPBOARD)
    return held_in(file)


def ask(text, *edits):
    return Ask(text=text, what="unit", edits=list(edits))


def test_pickers_offer_what_is_held(held):
    text = every_template()["encapsulating"].read_text()
    shown = choices(answered(ask(text), Trusted(), held))
    # The text's own silicone stays, else the list would show another.
    assert set(shown["layers.0.material"]) == {"ecoflex-00-10", "dragon-skin-30", "our-blend"}
    assert shown["layers.1.material"]["our-blend"] == "of your cupboard"
    assert set(shown["moulds.printer"]) == {"fdm-0.4", "mine"}
    everything = choices(answered(ask(text), Trusted()))
    assert len(everything["layers.0.material"]) >= 50
    # A cupboard that names no motors does not narrow them.
    assert set(shown["motor.part"]) == set(everything["motor.part"])


def test_an_own_entry_that_is_chosen_goes_into_the_spec(held):
    text = every_template()["encapsulating"].read_text()
    edits = [Edit(path="layers.0.material", value="our-blend"), Edit(path="moulds.printer", value="mine")]
    answer = answered(ask(text, *edits), Trusted(), held)
    assert answer.faults == []
    assert answer.spec["materials"]["our-blend"]["density_g_cm3"] == 1.09
    assert answer.spec["moulds"]["window_clearance_mm"] == 0.15
    assert "[materials.our-blend]" in answer.text
    again = answered(ask(answer.text), Trusted(), held)
    assert again.text == answer.text
    assert choices(again)["layers.0.material"]["our-blend"] == "of this spec"
    assert answered(ask(text, *edits), Trusted()).faults != []


def test_an_array_offers_shipped_entries_that_are_held(held):
    text = every_template()["forearm-patch"].read_text()
    shown = choices(answered(ask(text), Trusted(), held))
    assert set(shown["moulds.printer"]) == {"fdm-0.4"}
    assert not any("our-blend" in names for names in shown.values())


def test_a_broken_cupboard_is_refused_before_the_page_is_served(tmp_path):
    file = tmp_path / "cupboard.toml"
    file.write_text('[at_hand]\nmaterials = ["ecoflex"]\n')
    with pytest.raises(UnitcadError, match=r"at_hand\.materials\.0"):
        held_in(file)


def test_it_reaches_a_worker_as_json(held):
    assert msgspec.json.decode(msgspec.json.encode(held), type=type(held)) == held

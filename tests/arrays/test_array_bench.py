"""The bench rules, pictures, bill and plates of arrays: a unit's tests with the sets of arrays."""

from itertools import pairwise

import pytest
from casting_rules import broken_rules

from tests.casting import test_bench_rules as rules
from tests.casting import test_bench_views as views_of
from tests.casting.test_bench_views import hues
from tests.casting.test_plates import lie_apart
from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.drawings import ARROW, GREASE
from unitcad.casting.preparation import printing
from unitcad.casting.procedure_text import files
from unitcad.casting.views import BenchPictures, picture_path, views
from unitcad.designs import layer_colour

PATCH, BAND = ("forearm-patch",), ("wrist-band",)
CURVED = ("sleeve-curved", "layout.columns=2", "layout.rows=1")
ARRAYS = (PATCH, BAND, CURVED)


def planned(*source):
    array = patch_moulds(load_array(source[0], list(source[1:])))
    return array, array_procedure(array, [100.0] * len(array.plan.steps), 1000.0, {})


@pytest.mark.parametrize("source", ARRAYS, ids=" ".join)
def test_every_array_keeps_every_rule(source):
    assert broken_rules(planned(*source)[1]) == []


PLANTED = {
    "grease under a cup": (PATCH, rules.greased_too_late, "greases what the cup already hides"),
    "grease without a name": (PATCH, rules.greased_with_nothing_named, "does not say what to grease with"),
    "filament under the mould": (PATCH, rules.pulled_on_the_bench, "while the mould lies on them"),
    "no picture of the grease": (PATCH, rules.without_pictures, "Grease the flanks: has no picture"),
    "filament under a curved base": (CURVED, rules.pulled_on_the_bench, "while the mould lies on them"),
    "no picture of a curved set's grease": (CURVED, rules.without_pictures, "Grease the flanks: has no picture"),
    "bands round a curved mould": (CURVED, rules.tilted_by_tape, "pour 1: nothing says to look at the level again"),
}


@pytest.mark.parametrize(("source", "plant", "said"), PLANTED.values(), ids=PLANTED)
def test_a_planted_fault_breaks_its_rule(source, plant, said):
    faults = broken_rules(plant(planned(*source)[1]))
    assert any(said in fault for fault in faults), faults


@pytest.mark.parametrize("source", ARRAYS, ids=" ".join)
@pytest.mark.parametrize("test", views_of.OF_EVERY_SET, ids=lambda test: test.__name__)
def test_the_pictures_of_arrays(test, source):
    test(source, planned)


def test_no_step_needs_a_pin_where_the_base_has_pins():
    made = planned(*PATCH)[1]
    (cups_on,) = (step for step in made.preparation if "one pin stands off" in step.text)
    assert "pin" not in cups_on.required_tools


def test_all_pieces_of_split_tools_lie_apart_on_the_bed():
    lie_apart(planned(*BAND)[0])


def test_pictures_of_a_curved_set_show_what_is_there():
    moulds, _ = planned(*CURVED)
    shown = views(moulds)
    names = [name for name, view in shown.items() if view.group == "curved"]
    bench = BenchPictures(moulds)
    drawn = {picture_path(name): bench.picture(name) for name in names}
    for name in names:
        colours = {extra.colour for extra in shown[name].extras}
        for colour in (ARROW, GREASE):
            assert (hues(drawn[picture_path(name)], colour) > 30) == (colour in colours), name
    layer1 = {name for name in names if hues(drawn[picture_path(name)], layer_colour(0)) > 300}
    assert layer1 == {"pour2-laid-in", "pour2-lid-on"}
    layer2 = {name for name in names if hues(drawn[picture_path(name)], layer_colour(1)) > 300}
    assert layer2 == {"pour2-lid-off", "peel"}


def test_the_procedure_says_what_is_on_each_plate():
    first = " ".join(printing(planned(*BAND)[0], 1000.0).how)
    named = ("moulds/moulds-1.3mf with base piece 1", "moulds/moulds-2.3mf with", "cup 2 piece 2")
    places = [first.index(words) for words in named]
    assert all(one < other for one, other in pairwise(places))


def test_a_patch_s_sheet_has_no_more_words_than_a_maker_reads():
    assert len(files(planned(*PATCH)[1])["casting.md"].split()) <= 1800

"""A refusal of a spec's length names a field that helps: the value offered, put in, is accepted in that field."""

import copy
import math
import random

import pytest

from unitcad.errors import Refusal
from unitcad.moulds.plan import plan
from unitcad.spec import to_data
from unitcad.spec.custom_code import ANY, allow, allow_nothing
from unitcad.validation import custom_templates, from_data, load, read, templates
from unitcad.validation.dotted import put

CHANGED = 4
"""Fields of a spec that are changed at once, at most."""


def lengths(node, path=""):
    """Return every length of a spec's data by its dotted path."""
    below = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    found = {}
    for key, value in below:
        at = f"{path}.{key}" if path else str(key)
        found |= {at: value} if isinstance(value, float) and at.endswith("_mm") else lengths(value, at)
    return found


def bad_specs(name, count):
    """Return specs of a template with some lengths between a seventh and the sevenfold of its own."""
    choose = random.Random(name)
    own = sorted(lengths(to_data(load(name))).items())
    specs = []
    for _ in range(count):
        data = copy.deepcopy(read(name))
        for path, length in choose.sample(own, choose.randint(1, CHANGED)):
            put(data, path, round(length * math.exp(choose.uniform(-2, 2)), 3))
        if choose.random() < 0.3:
            put(data, "motor.fill", choose.random() < 0.5)
        if choose.random() < 0.3:
            put(data, "moulds.cavities", [choose.randint(1, 9), choose.randint(1, 9)])
        specs.append(data)
    return specs


def refused(data, judge):
    try:
        judge(data)
    except Refusal as refusal:
        return refusal
    return None


def check_offer(data, judge):
    """Assert the law of one spec; tell whether it was refused."""
    refusal = refused(data, judge)
    if refusal is None or refusal.value is None or not refusal.field.endswith("_mm"):
        return False
    assert refusal.nearest is not None, str(refusal)
    changed = copy.deepcopy(data)
    put(changed, refusal.field, refusal.nearest)
    again = refused(changed, judge)
    assert again is None or again.field != refusal.field, (str(refusal), str(again))
    return True


@pytest.mark.parametrize("name", sorted(templates()))
def test_a_bad_length_is_refused_with_one_that_is_accepted(name):
    assert sum(check_offer(data, from_data) for data in bad_specs(name, 150)) > 20


@pytest.mark.parametrize("name", sorted(custom_templates()))
def test_a_bad_length_of_a_custom_design_is_refused_with_one_that_is_accepted(name):
    allow(ANY)
    try:
        assert sum(check_offer(data, from_data) for data in bad_specs(name, 100)) > 3
    finally:
        allow_nothing()


@pytest.mark.parametrize("name", sorted(templates()))
def test_moulds_that_are_refused_name_a_length_that_is_accepted(name):
    def judge(data):
        plan(from_data(data))

    for data in bad_specs(name, 100):
        if refused(data, from_data) is None:
            check_offer(data, judge)


@pytest.mark.parametrize(
    ("changes", "field", "nearest"),
    [
        ({"motor.fill": True, "moulds.filament_hole_mm": 8.032, "diameter_mm": 20.0}, "motor.diameter_mm", 10.832),
        ({"moulds.ledge_mm": 3.578, "fpcb.tail_width_mm": 0.5}, "diameter_mm", 15.706),
    ],
)
def test_a_core_too_narrow_names_what_widens_it(changes, field, nearest):
    with pytest.raises(Refusal, match="the core must have room for the filament's hole") as caught:
        load("single-encapsulating", changes)
    assert (caught.value.field, caught.value.nearest) == (field, nearest)
    load("single-encapsulating", {**changes, field: nearest})

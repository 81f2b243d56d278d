"""A refusal's suggestion was tried: put in, the file is accepted, with its moulds if they were asked for."""

import copy
import math
import random
import re
import tomllib
from importlib.util import find_spec

import pytest

from unitcad.errors import Refusal, UnknownKey
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import to_data
from unitcad.spec.custom_code import ANY, allow, allow_nothing
from unitcad.validation import custom_templates, load, put, read, templates
from unitcad.validation.suggestions import is_number, with_changes

WILD = (-1e9, -1, 0, 0.05, 1, 3.3, 7, 16, 60, 200, 1e6)
SHARES = (0.3, 0.7, 0.9, 1.1, 1.5, 3)
PARTED = set() if find_spec("unitcad.bodies") else {"custom/dome"}
"""Bodies that only the room of bodies casts."""
CASTABLE = sorted({*templates(), *custom_templates()} - PARTED)
SEARCHED = "custom/dome"
"""A body whose moulds are searched for again for each value that is tried: minutes."""
CHANGED = 4
"""Fields of a spec that are changed at once, at most."""


def moulds_of(data):
    return load(data, makeable=lambda spec: MouldSet(spec).plan)


def numbers(node, path=""):
    """Return every number of plain data by its dotted path."""
    below = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list | tuple) else ()
    found = {}
    for key, value in below:
        at = f"{path}.{key}" if path else str(key)
        found |= {at: value} if is_number(value) else numbers(value, at)
    return found


def refused(data, judge):
    try:
        judge(data)
    except Refusal as refusal:
        return refusal
    return None


def suggestions(refusal):
    """Return the values by path that the faults of a refusal suggest together; {} if one suggests nothing."""
    changes = {}
    for one in (refusal, *refusal.others):
        found = {} if one.nearest is None or isinstance(one, UnknownKey) else {one.field: one.nearest}
        for words in re.findall(r"also needs ([^;]*)|; ([^;]*) would do", one.limit):
            for part in re.split(" and | or ", "".join(words)):
                path, _, value = part.partition(" = ")
                if value:
                    found[path] = tomllib.loads(f"v = {value.replace(chr(39), chr(34))}")["v"]
        if not found:
            return {}
        changes |= found
    return changes


def assert_accepted(data, refusal, judge):
    """Assert the law of one refusal; tell whether it suggests anything."""
    changes = suggestions(refusal)
    again = refused(with_changes(data, changes), judge) if changes else None
    assert again is None, (str(refusal), changes, str(again))
    return bool(changes)


def check_each_field(base, own, judge, count, seed):
    """One number of a good file is wild: the refusal suggests something that is accepted."""
    choose = random.Random(seed)
    cases = [(path, value) for path, usual in own.items() for value in (*WILD, *(usual * share for share in SHARES))]
    met = 0
    for path, value in choose.sample(cases, min(count, len(cases))):
        whole = isinstance(own[path], int)
        data = copy.deepcopy(base)
        try:
            put(data, path, round(value) if whole else round(value, 6))
        except Refusal:  # no such entry of a list
            continue
        refusal = refused(data, judge)
        if refusal is not None:
            met += 1
            assert assert_accepted(data, refusal, judge), (path, value, str(refusal))
    assert met > count / 10


def fields_of_spec(name):
    """Return the numbers of a template's settled spec that a table of numbers can have."""
    own = numbers(to_data(load(name)))
    return {path: value for path, value in own.items() if not path.startswith("moulds.cavities")}


@pytest.fixture
def any_code():
    allow(ANY)
    yield
    allow_nothing()


@pytest.mark.usefixtures("any_code")
@pytest.mark.parametrize("count", [12, pytest.param(2000, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long) if name == SEARCHED else name for name in CASTABLE]
)
def test_a_wild_number_of_a_spec_is_refused_with_a_value_that_is_accepted(name, count):
    check_each_field(read(name), fields_of_spec(name), moulds_of, count, name)


@pytest.mark.parametrize("count", [15, pytest.param(60, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", sorted(templates()))
def test_the_suggestions_for_several_faults_are_accepted_together(name, count):
    """Some numbers between a seventh and the sevenfold of the template's; of most specs all is suggested."""
    choose = random.Random(name)
    own = sorted(fields_of_spec(name).items())
    met = suggested = 0
    for _ in range(count):
        data = copy.deepcopy(read(name))
        for path, usual in choose.sample(own, choose.randint(2, CHANGED)):
            value = usual * math.exp(choose.uniform(-2, 2))
            put(data, path, round(value) if isinstance(usual, int) else round(value, 3))
        if choose.random() < 0.3:
            put(data, "motor.fill", choose.random() < 0.5)
        refusal = refused(data, moulds_of)
        if refusal is not None:
            met += 1
            suggested += assert_accepted(data, refusal, moulds_of)
    assert met > count / 6
    assert suggested > 0.6 * met


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


def test_a_diameter_of_which_no_value_helps_names_the_key_that_does():
    """A ring of air as wide as the body leaves no core at any diameter that the bed takes."""
    with pytest.raises(Refusal, match=r"^diameter_mm = 14: .*; motor\.diameter_mm = 8\.8 would do$") as caught:
        load("encapsulating", {"motor.diameter_mm": 1000.0})
    assert caught.value.nearest is None
    load("encapsulating", {"motor.diameter_mm": 8.8})

"""The range of model `fem`: seeded, the same for a material in every unit, made on demand; the page's table."""

import itertools
import json
import math
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("skfem")

from benchmarks.accuracy.fem_search import COMPONENTS, unit_levels
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.fem import unit as prior_range
from unitcad.attenuation.fem.unit import CHOICES, DRAWS, Draw, Setting, draw_unknowns, level, motion, range_block
from unitcad.attenuation.inputs import Quantity
from unitcad.errors import Refusal, UnitcadError
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.validation import load

UNIT = estimate_input(load("encapsulating"))
DATA = json.loads((Path(__file__).parents[2] / "docs" / "fem.json").read_text("utf-8"))


def test_a_draw_is_its_seed_and_index_and_stays_in_the_ranges():
    made = [draw_unknowns(UNIT, Draw(7, index))[0] for index in range(200)]
    assert made[3] == draw_unknowns(UNIT, Draw(7, 3))[0] != draw_unknowns(UNIT, Draw(8, 3))[0]
    for before, after in [
        (UNIT.frequency, [one.frequency for one in made]),
        (UNIT.tissue[1].shear_modulus, [one.tissue[1].shear_modulus for one in made]),
        (UNIT.geometry.motor_mass, [one.geometry.motor_mass for one in made]),
        (UNIT.layers[0].tan_delta, [one.layers[0].tan_delta for one in made]),
    ]:
        low, high = before.ends
        values = [quantity.middle for quantity in after]
        assert low <= min(values) < low * 1.1
        assert high / 1.1 < max(values) <= high
    moduli = [one.layers[0].youngs_modulus.middle / UNIT.layers[0].youngs_modulus.middle for one in made]
    assert 1 / 1.5 <= min(moduli) < 0.7 < 1.4 < max(moduli) <= 1.5
    assert {one.geometry.gap > 0 for one in made} == {one.geometry.floor > 0 for one in made} == {True, False}
    assert {one.geometry.pad is None for one in made} == {True, False}


def test_two_units_of_one_draw_share_what_they_share():
    other = estimate_input(load("embedded"))
    shared = {layer.material for layer in UNIT.layers} & {layer.material for layer in other.layers}
    assert shared
    for index in range(5):
        one, two = (draw_unknowns(variant, Draw(1, index)) for variant in (UNIT, other))
        of_one, of_two = ({layer.material: layer.youngs_modulus for layer in made[0].layers} for made in (one, two))
        assert all(of_one[name] == of_two[name] for name in shared)
        assert one[0].tissue == two[0].tissue
        assert one[1] == two[1]


def test_something_always_holds_the_motor():
    """Of open rings without a circuit and without a floor only a filled ring holds it."""
    other = estimate_input(load("embedded"))
    made = [draw_unknowns(other, Draw(1, index))[0].geometry for index in range(100)]
    loose = [one for one in made if not one.pad and not one.floor]
    assert loose
    assert all(one.gap == 0 for one in loose)


def test_a_floor_lifts_the_unit_and_softens_the_drive_of_the_skin():
    draws = (Draw(1, index) for index in range(50))
    lifted = next(made for made in (draw_unknowns(UNIT, draw)[0] for draw in draws) if made.geometry.floor)
    floor = lifted.geometry.floor
    assert lifted.geometry.layers[-1].top == pytest.approx(UNIT.geometry.layers[-1].top + floor)
    flat = replace(
        UNIT,
        geometry=replace(
            lifted.geometry,
            pad=UNIT.geometry.pad and replace(UNIT.geometry.pad, low=2e-3 + floor, high=2.11e-3 + floor),
        ),
    )
    on_skin, on_floor = (motion(variant, "flat", Setting(), 0.5) for variant in (UNIT, flat))
    assert abs(on_floor.skin[0] / on_floor.motor) < abs(on_skin.skin[0] / on_skin.motor)


def test_the_range_is_repeatable_and_orders_its_numbers():
    block = range_block(UNIT, draws=3)
    assert block == range_block(UNIT, draws=3)
    assert [(one["drive"], one["reading"]) for one in block["levels"]] == [
        (drive, reading) for drive in ("flat", "axial") for reading in ("skin", "edge")
    ]
    for one in block["levels"]:
        assert 0 < one["low"] < one["median"] < one["high"]
        assert one["median_error"] > 1
    other = range_block(UNIT, draws=3, seed=2)
    assert [one["median"] for one in other["levels"]] != [one["median"] for one in block["levels"]]


def test_draws_are_spread_evenly():
    draws = [Draw(4, index, DRAWS) for index in range(DRAWS)]
    combinations = Counter(tuple(draw.either(name) for name in CHOICES) for draw in draws)
    assert combinations == dict.fromkeys(itertools.product((True, False), repeat=len(CHOICES)), DRAWS // 16)
    for group in (draws[::2], draws[1::2]):
        strata = sorted(math.floor(draw.position("frequency") * len(group)) for draw in group)
        assert strata == list(range(len(group)))
    assert draws[3].position("frequency") != Draw(5, 3, DRAWS).position("frequency")


@pytest.mark.long  # quick: draws are spread evenly, and the range is repeatable
def test_the_default_draws_agree_with_256():
    known = np.array(DATA["draws"])[:, DATA["units"].index("encapsulating E10/D30")]
    bonded = np.array([Draw(DATA["seed"], index, len(known)).either("contact") for index in range(len(known))])
    for one in range_block(UNIT)["levels"]:
        levels = known[:, DATA["drives"].index(one["drive"]), DATA["readings"].index(one["reading"])]
        for contact, part in (("bonded", levels[bonded]), ("resting", levels[~bonded])):
            group = one["by_contact"][contact]
            assert abs(math.log(group["median"] / np.median(part))) < 2 * math.log(group["median_error"]), one


def test_a_unit_of_unknown_modulus_has_a_reason():
    unknown = replace(UNIT, layers=(replace(UNIT.layers[0], youngs_modulus=Quantity(None, note="nobody knows")),) * 2)
    assert range_block(unknown, draws=1)["levels"] == []
    assert range_block(unknown, draws=1)["reason"].endswith("nobody knows")
    with pytest.raises(UnitcadError, match="nobody knows"):
        level(unknown, 125.0, "flat", "edge")


def test_an_unknown_drive_or_reading_is_refused():
    for drive, reading in (("up", "skin"), ("flat", "motor")):
        with pytest.raises(Refusal):
            level(UNIT, 125.0, drive, reading)  # pyright: ignore[reportArgumentType]


def test_it_is_made_only_when_it_is_asked_for(monkeypatch):

    monkeypatch.setattr(prior_range, "range_block", lambda variant, say: {"draws": 0})
    monkeypatch.setattr(prior_range, "fem_sensitivities", lambda variant, say: [])
    assert "fem" not in estimate_spec(load("encapsulating"))
    data = estimate_spec(load("encapsulating"), models=("published", "fem"))
    assert data["fem"] == {"draws": 0, "sensitivities": []}
    assert list(data["models"]) == ["published"]


def test_without_scikit_fem_the_message_says_what_to_install():
    code = (
        "import sys; sys.modules['skfem'] = None\n"
        "from unitcad.cli.command_line import run; assert not run(['estimate', 'encapsulating'])\n"
        "from unitcad.cli import main; sys.argv = ['unitcad', 'estimate', 'encapsulating', '--model', 'fem']; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "[fem]" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_the_change_over_frequency_is_as_the_page_on_what_to_measure_says():
    """how-to/what-to-measure.md: from 60 to 200 Hz, the middle 80 % of the draws, a flat motor in the closed unit."""
    unit = estimate_input(load("encapsulating"))
    ratios = []
    for index in range(48):
        draw = Draw(1, index, 48)
        low, high = (level(unit, hertz, "flat", "edge", draw, 0.5) for hertz in (60.0, 200.0))
        ratios.append(high / low)
    assert np.quantile(ratios, [0.1, 0.9]) == pytest.approx([0.2, 3.0], rel=0.1)


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

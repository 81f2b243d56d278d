"""Values far outside the usual ranges: each array is made, or refused with a field and in seconds."""

import contextlib
import math
import random
import time

import pytest

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.arrays.sheet import slot_profile
from unitcad.errors import UnitcadError


@pytest.mark.parametrize("height", [2.0, 3 - 1 / 1024, 3.0, 3 + 1 / 1024, 4.0])
@pytest.mark.parametrize("width", [3.0, 3 - 1 / 1024])
def test_a_strap_slot_of_any_proportion_has_round_ends(width, height):
    drawn, r = slot_profile((5.0, -1.0, 5 + width, height - 1)), min(width, height) / 2
    assert drawn.area == pytest.approx(width * height - (4 - math.pi) * r**2, rel=1e-3)
    assert drawn.bounds == pytest.approx((5, -1, 5 + width, height - 1), abs=1e-3)


MADE = [
    ("sleeve-curved", {"sheet.strap_slot_mm": [3, 3]}),
    ("forearm-pockets", {"layout.columns": 7, "layout.pitch_mm": [200, 20]}),
]
"""The last one's tray has 7 pieces."""


@pytest.mark.parametrize(("name", "changes"), MADE)
def test_what_is_rare_is_made(name, changes):
    assert patch_moulds(load_array(name, changes)).plan


NUMBERS = {
    "layout.pitch_mm": 20.0, "layout.columns": 3, "layout.rows": 3, "layout.rings": 2, "layout.count": 8,
    "sheet.thickness_mm": 1.5, "sheet.margin_mm": 3.0, "sheet.corner_mm": 5.0, "sheet.strap_web_mm": 5.0,
    "sheet.strap_slot_mm": [3.0, 20.0], "sheet.hold_mm": 0.2, "limb.radius_mm": 40.0, "circuit.row_width_mm": 3.0,
    "circuit.spine_mm": 10.0, "circuit.tail_mm": 10.0, "circuit.corner_mm": 1.0, "moulds.bed_x_mm": 100.0,
    "moulds.bed_y_mm": 100.0, "moulds.bed_z_mm": 100.0, "moulds.plate_mm": 4.0, "moulds.land_mm": 1.0,
    "moulds.groove_width_mm": 2.0, "moulds.plinth_clearance_mm": 0.15, "moulds.layer_mm": 0.2,
    "moulds.least_wall_mm": 0.8, "moulds.filament_mm": 1.75, "unit.diameter_mm": 14.0,
}  # fmt: skip
"""A usual value of each key."""
NONSENSE = (math.nan, math.inf, -1, 0, 1e308, 10**30, "x", True, None, [], {}, 1e-12)
SECONDS = 20.0
"""Of processor time, at most."""


def far_out(seed):
    """Return a template and changes of it, each a hundredth to a hundred times the usual value, or nonsense."""
    pick = random.Random(seed)

    def changed(value):
        if isinstance(value, list):
            return [changed(each) for each in value]
        if pick.random() < 0.06:
            return pick.choice(NONSENSE)
        by = 10 ** pick.uniform(-2, 2)
        return max(1, round(value * by)) if isinstance(value, int) else round(value * by, pick.choice([1, 3, 6]))

    name = pick.choice(sorted(array_templates()))
    return name, {path: changed(NUMBERS[path]) for path in pick.sample(sorted(NUMBERS), pick.randint(1, 3))}


@pytest.mark.parametrize("seed", [*range(15), *(pytest.param(i, marks=pytest.mark.long) for i in range(15, 1000))])
def test_values_far_out_are_planned_or_refused_within_seconds(seed):
    name, changes = far_out(seed)
    start = time.process_time()
    with contextlib.suppress(UnitcadError):
        patch_moulds(load_array(name, changes)).plan  # noqa: B018
    assert time.process_time() - start < SECONDS

"""Random array files: each is built with all mould checks kept, or refused with a field; none fails silently."""

import random
import re

import pytest

from tests.moulds.faulty_sets import mesh_findings
from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.validation import default_template, put, templates

QUICK, ALL = 12, 200


def drawn(seed):
    """Return the data of a random array file: most of them near to what can be made, some far from it."""
    pick = random.Random(seed)
    kind = pick.choice(["grid", "grid", "hex", "ring", "list"])
    layouts = {
        "grid": {
            "columns": pick.randint(1, 5),
            "rows": pick.randint(1, 4),
            "pitch_mm": pick.choice([round(pick.uniform(10, 30), 2), [pick.randint(15, 30), pick.randint(15, 30)]]),
        },
        "hex": {"rings": pick.randint(1, 2), "pitch_mm": round(pick.uniform(12, 28), 2)},
        "ring": {"count": pick.randint(2, 7), "bands": pick.randint(1, 2), "band_pitch_mm": pick.randint(15, 40)},
        "list": {"points_mm": [[round(pick.uniform(-60, 60), 2) for _ in "xy"] for _ in range(pick.randint(1, 5))]},
    }
    data = {
        "name": f"random-{seed}",
        "array": pick.choice(["back-sheet", "pockets"]),
        "unit": {"like": pick.choice([default_template(), default_template(), *templates()])},
        "layout": {"kind": kind, **layouts[kind]},
    }
    changes = {
        "limb.radius_mm": pick.randint(10, 60),
        "sheet.thickness_mm": round(pick.uniform(0.6, 3.5), 2),
        "sheet.margin_mm": round(pick.uniform(1, 12), 2),
        "sheet.corner_mm": round(pick.uniform(0.5, 15), 2),
        "sheet.strap_slot_mm": [round(pick.uniform(0.5, 6), 2), round(pick.uniform(3, 40), 2)],
        "sheet.strap_web_mm": round(pick.uniform(1, 8), 2),
        "sheet.hold_mm": round(pick.uniform(0.05, 1.5), 2),
        "sheet.material": pick.choice(["ecoflex-00-30", "dragon-skin-30", "ecoflex-00-50"]),
        "unit.diameter_mm": round(pick.uniform(11, 24), 1),
        "unit.fpcb.tail_length_mm": round(pick.uniform(2, 25), 1),
        "moulds.land_mm": round(pick.uniform(0.7, 3), 2),
        "moulds.groove_depth_mm": round(pick.uniform(0.3, 2), 2),
        "moulds.plate_mm": round(pick.uniform(3, 8), 1),
    }
    for path in pick.sample(sorted(changes), pick.randint(0, 6)):
        put(data, path, changes[path])
    if kind == "ring" and pick.random() < 0.8:
        put(data, "limb.radius_mm", pick.randint(20, 60))
    if pick.random() < 0.3:
        put(data, "moulds.bed_x_mm", pick.randint(80, 180))
    if pick.random() < 0.3:
        put(data, "moulds.bed_y_mm", pick.randint(80, 180))
    if pick.random() < 0.2:
        put(data, "limb.cast", "curved")
        if pick.random() < 0.8:  # what a curved cast needs, or nearly all of them would stop at its first condition
            data["array"], data["unit"]["like"] = "back-sheet", default_template()
            put(data, "limb.radius_mm", pick.randint(25, 90))
            if kind == "ring":
                data["layout"] = {"kind": "grid", **layouts["grid"]}
    return data


@pytest.mark.parametrize("seed", [*range(QUICK), *(pytest.param(i, marks=pytest.mark.long) for i in range(QUICK, ALL))])
def test_a_random_array_is_made_with_all_checks_or_refused(seed):
    judge(drawn(seed))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(ALL))
def test_a_random_array_on_a_small_bed_is_made_in_pieces_or_refused(seed):
    data = drawn(seed)
    put(data, "moulds.bed_x_mm", 110.0)
    put(data, "moulds.bed_y_mm", 110.0)
    judge(data)


def judge(data):
    """Build the moulds of an array file with every check, or see it refused with field, limit and what is accepted."""
    try:
        moulds = patch_moulds(load_array(data))
        findings = check_moulds(moulds)
    except Refusal as refusal:
        assert refusal.field
        assert refusal.limit
        if (
            type(refusal) is Refusal
            and refusal.nearest is not None
            and not refusal.others  # each then meets its own limit
            and not re.search("also needs|; then", refusal.limit)
        ):
            assert patch_moulds(load_array(data, {refusal.field: refusal.nearest})).plan
        return
    broken = [f"{f.code} {f.where}: {f.value:.3g}, limit {f.limit:.3g} {f.unit}" for f in findings if not f.ok]
    assert broken == []
    assert len(findings) > 8
    assert mesh_findings(moulds) == []  # both kinds of checks agree

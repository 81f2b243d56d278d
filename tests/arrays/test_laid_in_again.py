"""Casts that are taken out and laid in elsewhere, and silicone that comes out in parts: C200 and C300."""

import math
from dataclasses import replace
from functools import cache

from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import draw, overlap
from unitcad.moulds.pieces import CAST, Removal
from unitcad.shape import box, cut, cylinder, moved, rotated

UP, DOWN = (0, 0, 1), (0, 0, -1)


@cache
def patch():
    return patch_moulds(load_array("forearm-patch", ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3,6]"]))


def with_steps(*steps):
    return patch_moulds(patch().arranged, replace(patch().plan, steps=steps))


def test_a_layer_that_is_laid_in_askew_overlaps_what_stands_there():
    first, last = patch().plan.steps
    askew = replace(last, earlier=tuple(moved(shape, x=0.25) for shape in last.earlier))
    found = {finding.where for finding in overlap.findings(with_steps(first, askew)) if not finding.ok}
    assert found >= {"pour 2: base and layer1 laid in", "pour 2: layer1 laid in and layer2"}


def test_a_layer_is_laid_in_elsewhere_only_once_it_was_taken_out():
    """Order by order, which of them can be done: the next pour is cast on Layer 1, or has it laid in anew."""
    first, last = patch().plan.steps
    elsewhere = replace(last, earlier=tuple(moved(shape, z=1.0) for shape in last.earlier))
    out = tuple(Removal(piece.name, DOWN) for piece in patch().plan.of_kind("filament")), Removal(CAST, UP)
    taken = replace(first, removals=(*first.removals, out[1]))
    for steps, wrong in (
        ((first, last), []),
        ((taken, last), ["pour 1: cast out"]),
        ((first, elsewhere), ["pour 1: cast stays"]),
        ((taken, elsewhere), []),
    ):
        found = [f.where for f in draw.findings(with_steps(*steps)) if not f.ok and f.where.startswith("pour 1")]
        assert found == wrong


def slanted(degrees, x):
    return moved(rotated(cylinder(3, -4, 9), "y", degrees), x)


def parted(ways, parts):
    """What C300 finds on silicone with two pegs in a block, at 25 degrees to either side of the vertical."""
    pegs = [slanted(side * 25, side * 10) for side in (-1, 1)]
    room = box(-30, 30, -10, 10, 2, 4)
    block = cut(box(-40, 40, -20, 20, -12, 2), pegs)
    last = patch().plan.steps[-1]
    below = [cut(peg, [box(-99, 99, -99, 99, 2, 99)]) for peg in pegs]
    tool = replace(patch().plan.tool("base"), shape=block)
    step = replace(
        last,
        index=1,
        tools=("base",),
        layer=(*below, room),
        earlier=(),
        seals=(),
        removals=tuple(
            Removal(CAST, way, f"part {i}", part) for i, (way, part) in enumerate(zip(ways, parts, strict=True))
        ),
    )
    moulds = patch_moulds(patch().arranged, replace(patch().plan, tools=(tool,), steps=(step,)))
    return [finding.where for finding in draw.findings(moulds) if not finding.ok]


LEFT, RIGHT = ((side * math.sin(math.radians(25)), 0.0, math.cos(math.radians(25))) for side in (-1, 1))
LEFT_HALF = box(-99, 0, -99, 99, -99, 99)


def test_each_part_of_the_silicone_leaves_along_its_own_way():
    halves = LEFT_HALF, None
    assert parted((LEFT, RIGHT), halves) == []
    assert parted((RIGHT, LEFT), halves) == [f"pour 1: cast part {i} out against base" for i in range(2)]
    assert parted((UP,), (None,)) == ["pour 1: cast part 0 out against base"]


def test_parts_that_are_not_there_or_are_left_behind_are_found():
    assert parted((LEFT, LEFT), (LEFT_HALF, LEFT_HALF))[0] == "pour 1: cast part 1 out"
    (stays, *_) = parted((LEFT,), (LEFT_HALF,))
    # Half the plate, and a slanted peg from 4 mm under its middle up to the plate.
    volume = 30 * 20 * 2 + math.pi * 3**2 * (4 + 2 / math.cos(math.radians(25)))
    assert stays == f"pour 1: {volume:.3g} mm3 of the silicone stay"

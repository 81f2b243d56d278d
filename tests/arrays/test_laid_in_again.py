"""Casts that are taken out and laid in elsewhere, and silicone that comes out in parts: C200 and C300."""

from dataclasses import replace
from functools import cache

from unitcad.arrays.array_file import load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import draw
from unitcad.moulds.pieces import CAST, Removal
from unitcad.shape import moved

UP, DOWN = (0, 0, 1), (0, 0, -1)


@cache
def patch():
    return patch_moulds(load_array("forearm-patch", ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3,6]"]))


def with_steps(*steps):
    return patch_moulds(patch().array, replace(patch().plan, steps=steps))


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

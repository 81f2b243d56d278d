"""Marks are unmistakable: no set's label reads as a base's or a cup's, and pieces of a split tool carry it whole."""

import pytest

from tests.arrays.made_arrays import made
from unitcad.kernels.mesh import realise
from unitcad.moulds.pieces import set_label
from unitcad.shape import box
from unitcad.shape.lettering import engraving, seen


def test_a_label_has_no_letter_of_a_mark_and_is_shown_as_it_is_engraved():
    labels = {set_label([box(0, i + 1, 0, 1, 0, 1)]) for i in range(300)}
    assert len(labels) > 290
    assert set().union(*labels) == set("0123456789AEF")
    assert all(seen(label) == label for label in labels)


def test_every_piece_of_a_split_tool_carries_mark_label_and_number():
    """The strokes that are cut away at each piece's rim are those of its own row of texts."""
    moulds = made("wrist-band")
    plan, lengths = moulds.plan, moulds.spec.moulds
    for split in plan.splits:
        top = plan.steps[split.pieces[0].step - 1].rim if split.pieces[0].step else 0.0
        for number, piece in enumerate(split.pieces, 1):
            mark = [f"C{piece.step}", plan.label] if piece.step else [f"B{plan.label}"]
            letters = sum(_area(text, lengths.engraving_stroke_mm) for text in (*mark, str(number)))
            solid, depth = moulds.mesh(piece), lengths.engraving_depth_mm
            lost = solid.slice(top - 1.5 * depth).area() - solid.slice(top - 0.5 * depth).area()
            assert lost == pytest.approx(letters, abs=0.05), piece.name


def _area(text, stroke):
    return realise(engraving(text, stroke, 0.0, 1.0), 24).volume()

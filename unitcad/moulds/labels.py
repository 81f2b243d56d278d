"""The engraving of pieces: which set and step a piece belongs to, and the numbers of its cells."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Layout
from unitcad.moulds.layout import TEXT_MARGIN
from unitcad.shape import Cut, Shape, Union, content_hash, cut, moved
from unitcad.shape.lettering import HEIGHT, PITCH, engraving, text_width
from unitcad.spec import Spec


def set_label(shapes: Iterable[Shape]) -> str:
    """Return four characters that identify a set, from the hash of its shapes before a label is on them.

    Without B and C, which stand for base and cup: "C1" is a cup's mark on every piece. Without D, whose bars are those
    of a small letter: a text shows the label as it is engraved.
    """
    return "".join(one for one in content_hash(Union(tuple(shapes))).upper() if one not in "BCD")[:4]


def engraved(blank: Shape, letters: list[Shape]) -> Shape:
    """Return a piece with its letters cut in the same pass as its other openings."""
    return replace(blank, tools=(*blank.tools, *letters)) if isinstance(blank, Cut) else cut(blank, letters)


def base_label(spec: Spec, lay: Layout, label: str, top: float) -> list[Shape]:
    """Draw the base's label on the plate's upper face, z = `top`, in front of the cup."""
    stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
    text = engraving(label, stroke, top - depth, top + BEYOND)
    width = text_width(label, stroke)
    return [moved(text, -width / 2, (lay.cup[1] + lay.plate[1]) / 2 - lay.label_height / 2)]


def row(texts: Sequence[str], stroke: float, at: tuple[float, float], heights: tuple[float, float]) -> list[Shape]:
    """Draw texts one after the other, a character's width between them, from `at` (the lower left corner) on."""
    starts = [sum(len(text) + 1 for text in texts[:i]) * PITCH * stroke for i in range(len(texts))]
    return [moved(engraving(text, stroke, *heights), at[0] + x, at[1]) for text, x in zip(texts, starts, strict=True)]


def row_width(texts: Sequence[str], stroke: float) -> float:
    """Return the width of such a row, mm."""
    return text_width("0".join(texts), stroke)


def corner_labels(spec: Spec, lay: Layout, rim: float, label: tuple[str, str, str]) -> list[Shape]:
    """Draw three pairs of characters in a plate's corners, outside all bores; the fourth corner is the key's."""
    stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
    width, height = text_width("00", stroke), HEIGHT * stroke
    x, y = lay.cup[0] - TEXT_MARGIN, lay.cup[1] - TEXT_MARGIN
    corners = ((-x, y - height), (-x, -y), (x - width, -y))
    return [
        moved(engraving(text, stroke, rim - depth, rim + BEYOND), *corner)
        for text, corner in zip(label, corners, strict=True)
    ]


def cell_numbers(spec: Spec, lay: Layout, rim: float) -> list[Shape]:
    """Draw the number of each of several cells, in the space that the grooves leave at its upper right."""
    stroke, depth = spec.moulds.engraving_stroke_mm, spec.moulds.engraving_depth_mm
    return [
        moved(
            engraving(c.name, stroke, rim - depth, rim + BEYOND),
            c.x + lay.pitch / 2 - text_width(c.name, stroke) / 2,
            c.y + lay.pitch / 2 - HEIGHT * stroke / 2,
        )
        for c in lay.cells
        if c.name
    ]

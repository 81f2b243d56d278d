"""Pieces of tooling: names, colours and attitudes on the printer, engraving, removals; and the seals of a pour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from unitcad.designs import design_of
from unitcad.designs.design import BEYOND, Layout
from unitcad.moulds import filament
from unitcad.moulds.base import core, notch, tongues
from unitcad.moulds.cup import bores, cup_blank, windows
from unitcad.moulds.layout import BLADE_HEIGHT, TEXT_MARGIN, Frame
from unitcad.shape import Common, Cut, Extrude, Shape, Union, content_hash, cut, moved, polygon, turned
from unitcad.shape.lettering import HEIGHT, PITCH, engraving, text_width
from unitcad.shape.tree import Body

CAST = "cast"
"""Stands for the silicone of all pours so far, bonded, in the place of a tool's name."""
Way = tuple[float, float, float]
"""A direction of any length but 0."""


@dataclass(frozen=True)
class Removal:
    """One movement: a tool's name, or `CAST`, and the direction in which it is taken away.

    Silicone bends, so its parts may leave in ways of their own: `part` names one, `within` is the space that it fills;
    None is all that is still there.
    """

    piece: str
    direction: Way
    part: str = ""
    within: Shape | None = None


def customary(standing: Sequence[Body], *, last: bool) -> Iterator[Removal]:
    """Yield the removals of moulds that a unit is peeled off: lid, tongues, cup; after the last pour the filaments.

    `standing` are the tools of the pour. A piece without a way of its own stays. The peel itself is C310's.
    """
    for kind in ("lid", "frame", "tongue", "cup", *(("filament",) if last else ())):
        for piece in standing:
            if piece.kind == kind and piece.removal:
                yield Removal(piece.name, piece.removal)


def set_label(shapes: Iterable[Shape]) -> str:
    """Return four characters that identify a set, from the hash of its shapes before a label is on them.

    Without B and C, which stand for base and cup: "C1" is a cup's mark on every piece. Without D, whose bars are those
    of a small letter: a text shows the label as it is engraved.
    """
    return "".join(one for one in content_hash(Union(tuple(shapes))).upper() if one not in "BCD")[:4]


def engrave(blank: Shape, letters: list[Shape]) -> Shape:
    """Return a piece with its letters cut in the same pass as its other openings."""
    return replace(blank, tools=(*blank.tools, *letters)) if isinstance(blank, Cut) else cut(blank, letters)


def base_label(frame: Frame, label: str, top: float) -> list[Shape]:
    """Draw the base's label on the plate's upper face, z = `top`, in front of the cup."""
    lay = frame.lay
    stroke, depth = frame.spec.moulds.engraving_stroke_mm, frame.spec.moulds.engraving_depth_mm
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


def corner_labels(frame: Frame, rim: float, label: tuple[str, str, str]) -> list[Shape]:
    """Draw three pairs of characters in a plate's corners, outside all bores; the fourth corner is the key's."""
    stroke, depth = frame.spec.moulds.engraving_stroke_mm, frame.spec.moulds.engraving_depth_mm
    width, height = text_width("00", stroke), HEIGHT * stroke
    x, y = frame.lay.cup[0] - TEXT_MARGIN, frame.lay.cup[1] - TEXT_MARGIN
    corners = ((-x, y - height), (-x, -y), (x - width, -y))
    return [
        moved(engraving(text, stroke, rim - depth, rim + BEYOND), *corner)
        for text, corner in zip(label, corners, strict=True)
    ]


def cell_numbers(frame: Frame, rim: float) -> list[Shape]:
    """Draw the number of each of several cells, in the space that the grooves leave at its upper right."""
    lay = frame.lay
    stroke, depth = frame.spec.moulds.engraving_stroke_mm, frame.spec.moulds.engraving_depth_mm
    return [
        moved(
            engraving(c.name, stroke, rim - depth, rim + BEYOND),
            c.x + lay.pitch / 2 - text_width(c.name, stroke) / 2,
            c.y + lay.pitch / 2 - HEIGHT * stroke / 2,
        )
        for c in lay.cells
        if c.name
    ]


_BASE, _CUP, _CUP2, _TONGUE = (0.76, 0.76, 0.76), (0.96, 0.83, 0.66), (0.73, 0.83, 0.93), (0.90, 0.30, 0.30)
_BLADE, _FILAMENT, _LID = (0.87, 0.87, 0.55), (0.22, 0.22, 0.22), (0.80, 0.72, 0.90)
_UP, _DOWN = (0, 0, 1), (0, 0, -1)


def base_piece(shape: Shape) -> Body:
    """Return the base, which stays for all pours."""
    return Body("base", "tool", "base", shape, _BASE)


def cup_piece(pour: int, shape: Shape, file: Shape | None = None) -> Body:
    """Return the cup of a pour (from 1), printed upside down and lifted off upwards; `file`: its shape in files."""
    colour = _CUP if pour % 2 else _CUP2
    return Body(f"cup{pour}", "tool", "cup", shape, colour, step=pour, upside_down=True, removal=_UP, file=file)


def lid_piece(pour: int, shape: Shape) -> Body:
    """Return the lid of a pour (from 1), printed upside down and lifted off upwards."""
    return Body(f"lid{pour}", "tool", "lid", shape, _LID, step=pour, upside_down=True, removal=_UP)


def tongue_pieces(strips: Sequence[tuple[int, Shape]], brittle: bool) -> list[Body]:
    """Return tongues, each pulled out to its side (+1, -1 along x).

    A printed resin is too `brittle` for a strip this thin: it is cut from film or steel.
    """
    made = "cut" if brittle else "printed"
    return [
        Body(_numbered("tongue", i, strips), "tool", "tongue", shape, _TONGUE, made=made, removal=(side, 0, 0))
        for i, (side, shape) in enumerate(strips)
    ]


def filament_pieces(filaments: Sequence[Shape]) -> list[Body]:
    """Return filaments, pulled out downwards."""
    return [
        Body(_numbered("filament", i, filaments), "tool", "filament", piece, _FILAMENT, made="cut", removal=_DOWN)
        for i, piece in enumerate(filaments)
    ]


def tray_piece(shape: Shape) -> Body:
    """Return the tray of a skin's film; it takes part in no pour."""
    return Body("skin-tray", "tool", "tray", shape, _CUP)


def blade_piece(shape: Shape, *, too_long: bool = False) -> Body:
    """Return the blade, printed upside down; it is part of no pour.

    One too long for the bed is cut, without a joint.
    """
    return Body("blade", "tool", "blade", shape, _BLADE, made="cut" if too_long else "printed", upside_down=True)


def _numbered(name: str, index: int, among: Sequence[object]) -> str:
    return name if len(among) == 1 else f"{name}{index + 1}"


BLADE_THICKNESS, BLADE_EDGE = 3.0, 0.8


def blade(lay: Layout, rim: float) -> Shape:
    """Draw the strike-off blade, edge down on the rim: a bar as long as the plate, bevelled to a flat edge."""
    return bar(lay.plate[1], rim)


def bar(half: float, rim: float) -> Shape:
    """Draw a bevelled bar of the length 2 `half` along y, its edge at the height `rim`."""
    t, e, h = BLADE_THICKNESS, BLADE_EDGE, BLADE_HEIGHT
    section = polygon((0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h))
    # Drawn in (x, z) and stood up: x to x, y to z, extrusion to -y.
    return moved(turned(Extrude(section, -half, half), "x", 1), 0, 0, rim)


def seals(frame: Frame, layer: int) -> list[Shape]:
    """Draw the space without tool that silicone is kept from: grease round a tongue, the annulus round a filament.

    A window's seal is the part of the cup removed by the window, less the tongue; never a solid built a second time.
    """
    dims = frame.dims
    seals: list[Shape] = []
    if dims.exit:
        around = [shape for _, shape in tongues(frame)]
        walls = cut(cup_blank(frame, dims.heights[layer]), bores(frame, layer))
        seals += [cut(Common((walls, window)), around) for window in windows(frame, dims.heights[layer])]
        seals += [
            cut(Common((moved(core(dims), c.x, c.y), moved(notch(frame, dims.exit, s), c.x, c.y))), around)
            for c in frame.lay.cells
            for s in c.sides
        ]
    if design_of(frame.spec).suction:
        seals += [filament.annulus(frame, c) for c in frame.lay.cells]
    return seals

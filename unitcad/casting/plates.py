"""The pieces of the tools as they are made, and the printer's plates: one list for plate, bill and picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from unitcad.export.printing import layout
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.extent import extent
from unitcad.shape.tree import Body

SPARE_TONGUE = "spare-tongue"


def plates(moulds: MouldSet, bodies: Sequence[Body], stem: str) -> dict[str, tuple[Body, ...]]:
    """Return the bodies of each of the printer's plates by its 3MF: `stem`.3mf, or numbered if there are several.

    In their order, each on the first plate with room for it. A spare tongue, the piece that bends first, is added to
    the tongue's plate if it has room.
    """
    bed_x, bed_y = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    filled: list[dict[Body, tuple[float, float]]] = []

    def has_room(plate: dict[Body, tuple[float, float]], size: tuple[float, float]) -> bool:
        sizes = [*plate.values(), size]
        ends = ((x + w, y + d) for (x, y), (w, d) in zip(layout(sizes, (bed_x, bed_y)), sizes, strict=True))
        return all(x <= bed_x and y <= bed_y for x, y in ends)

    for body in bodies:
        x0, y0, _, x1, y1, _ = extent(body.shape)
        size = x1 - x0, y1 - y0
        plate = next((plate for plate in filled if has_room(plate, size)), None)
        if plate is None:
            filled.append(plate := {})
        plate[body] = size
    if tongue := next((body for body in bodies if body.kind == "tongue"), None):
        plate = next(plate for plate in filled if tongue in plate)
        if has_room(plate, plate[tongue]):
            plate[replace(tongue, name=SPARE_TONGUE)] = plate[tongue]
    names = [f"{stem}-{i + 1}.3mf" for i in range(len(filled))] if len(filled) > 1 else [f"{stem}.3mf"]
    return dict(zip(names, map(tuple, filled), strict=bool(filled)))


def mould_plates(moulds: MouldSet) -> dict[str, tuple[Body, ...]]:
    """Return the printed pieces of each plate by its file in a result's folder."""
    return plates(moulds, [piece for piece in moulds.plan.pieces if piece.made == "printed"], "moulds/moulds")


def made_pieces(moulds: MouldSet) -> tuple[Body, ...]:
    """Return every piece that is printed or cut, in the plan's order; the spare tongue follows its like."""
    return moulds.once("made pieces", lambda: _made(moulds))


def _made(moulds: MouldSet) -> tuple[Body, ...]:
    spare = [body for plate in mould_plates(moulds).values() for body in plate if body.name == SPARE_TONGUE]
    last = max((i for i, piece in enumerate(moulds.plan.pieces) if piece.kind == "tongue"), default=-1)
    return (*moulds.plan.pieces[: last + 1], *spare, *moulds.plan.pieces[last + 1 :])

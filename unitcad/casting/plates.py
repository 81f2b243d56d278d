"""The printer's plates: which pieces of a mould are printed together, and the 3MF that holds them."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.export.threemf import layout
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.body import Body
from unitcad.shape.column import extent


def plates(moulds: MouldSet, bodies: Sequence[Body], stem: str) -> dict[str, tuple[Body, ...]]:
    """Return the bodies of each plate by its file: `stem`.3mf, or a number each where one bed does not hold all.

    In their order, each on the first plate where it lies beside what is there.
    """
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    filled: list[list[tuple[Body, tuple[float, float]]]] = []
    for body in bodies:
        x0, y0, _, x1, y1, _ = extent(body.shape)
        size = x1 - x0, y1 - y0
        plate = next((each for each in filled if _fits([*(size for _, size in each), size], bed)), None)
        if plate is None:
            filled.append(plate := [])
        plate.append((body, size))
    names = [f"{stem}-{i + 1}.3mf" for i in range(len(filled))] if len(filled) > 1 else [f"{stem}.3mf"]
    return {name: tuple(body for body, _ in each) for name, each in zip(names, filled, strict=True)}


def mould_plates(moulds: MouldSet) -> dict[str, tuple[Body, ...]]:
    """Return the printed pieces of each plate by its file in a result's folder."""
    return moulds.once_a_geometry("plates", _mould_plates)


def _mould_plates(moulds: MouldSet) -> dict[str, tuple[Body, ...]]:
    return plates(moulds, [piece for piece in moulds.plan.pieces if piece.made == "printed"], "moulds/moulds")


def _fits(sizes: Sequence[tuple[float, float]], bed: tuple[float, float]) -> bool:
    places = zip(layout(sizes, bed), sizes, strict=True)
    return all(x + width <= bed[0] and y + depth <= bed[1] for (x, y), (width, depth) in places)

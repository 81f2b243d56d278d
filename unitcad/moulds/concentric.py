"""The tooling of concentric layers, drawn from their lengths: base, cups, lids, tongues, filaments and blade."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.designs import design_of
from unitcad.designs.dimensions import poured
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Tooling
from unitcad.moulds import filament, lid, trapped_air
from unitcad.moulds.base import base, plate_bottom
from unitcad.moulds.cup import cup
from unitcad.moulds.layout import layout
from unitcad.moulds.pieces import (
    base_piece,
    blade,
    blade_piece,
    cup_piece,
    filament_pieces,
    lid_piece,
    tongue_pieces,
    tray_piece,
)
from unitcad.moulds.seals import seals
from unitcad.moulds.skin_tray import skin_tray
from unitcad.moulds.tongue import tongues
from unitcad.shape import Shape
from unitcad.spec import Spec, printer_of


def concentric(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Return the tooling of a spec's rings or cups; the shapes `cast` are not looked at, so that C100 can compare.

    Raises Refusal beyond the bed, for a tail that reaches no edge, and for a tongue or vents that can't clear the air.
    """
    design = design_of(spec)
    dims = poured(spec, design.dimensions(spec))
    lay, pours = layout(spec, dims), range(len(cast))
    trapped_air.check_tongue(spec, dims)
    injected = spec.moulds.pour == "injected"
    tools = [base_piece(base(spec, dims, lay))]
    for i in pours:
        wider = spec.moulds.bore_compensation_mm
        file = cup(spec, dims, lay, i, wider) if wider else None
        tools.append(cup_piece(i + 1, cup(spec, dims, lay, i), file))
        if injected:
            drilled = lid.channels(spec, dims, lay, i, beyond=BEYOND)
            tools.append(lid_piece(i + 1, lid.lid(spec, dims, lay, i, drilled)))
    brittle = printer_of(spec).technology.value == "sla"
    tools += tongue_pieces(tongues(dims, lay, cut=brittle), brittle)
    if design.suction:
        tools += filament_pieces([filament.piece(spec, dims, lay, cell, plate_bottom(spec)) for cell in lay.cells])
    if dims.skin:
        tools.append(tray_piece(skin_tray(spec, dims, lay)))
    if not injected:
        tools.append(blade_piece(blade(lay, dims.heights[-1])))
    return Tooling(
        dims,
        lay,
        tuple(tools),
        seals=tuple(tuple(seals(spec, dims, lay, i)) for i in pours),
        channels=tuple(tuple(lid.channels(spec, dims, lay, i)) for i in pours) if injected else (),
        concentric=True,
    )

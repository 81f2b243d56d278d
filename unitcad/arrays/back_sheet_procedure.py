"""The casting of a back sheet: the procedure of its mould set, its assembly under titles of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.casting.procedure import Procedure, procedure
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import picture_path


def back_sheet_procedure(moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> Procedure:
    """Return the procedure of an array whose units are cast with the sheet: nothing is meshed or drawn.

    `layer_volumes_mm3`: of each pour, of all units together. `printed_mm3`: of all printed pieces.
    """
    made = procedure(moulds, layer_volumes_mm3, printed_mm3)
    return replace(
        made,
        assembly=motors_in(made.assembly),
        time_line=(*made.time_line[:-1], replace(made.time_line[-1], name="motors and circuit in")),
        last="Motors and circuit in",
    )


def motors_in(steps: Sequence[BenchStep]) -> tuple[BenchStep, ...]:
    """Return the steps of the assembly, each with its own title: soldering shows no state of the mould."""
    solder, lay_in, cure = steps
    return (
        replace(solder, title="Solder the motors", picture=""),
        replace(lay_in, title="Lay the circuit in", picture=picture_path("motor-in")),
        cure,
    )

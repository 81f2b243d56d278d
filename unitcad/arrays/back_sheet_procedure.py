"""The casting of a back sheet: the procedure of its mould set, with the array's own pictures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bench_views import picture_path
from unitcad.casting.procedure import Procedure, procedure

TOOLS, SKIN_SIDE = "pictures/tools.png", "pictures/patch-skin-side.png"


def back_sheet_procedure(moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> Procedure:
    """Return the procedure of an array whose units are cast with the sheet: nothing is meshed or drawn.

    `layer_volumes_mm3`: of each pour, of all units together. `printed_mm3`: of all printed pieces.
    """
    made = procedure(moulds, layer_volumes_mm3, printed_mm3)
    return replace(
        made,
        preparation=_shown(made.preparation),
        pours=tuple(replace(pour, steps=_shown(pour.steps)) for pour in made.pours),
        release=_shown(made.release),
        assembly=_motors_in(made.assembly),
        time_line=(*made.time_line[:-1], replace(made.time_line[-1], name="motors and circuit in")),
        last="Motors and circuit in",
    )


def _motors_in(steps: Sequence[BenchStep]) -> tuple[BenchStep, ...]:
    """Return the steps of the assembly, each with its own title; the picture stands by the circuit that goes in."""
    solder, lay_in, cure = steps
    return (
        replace(solder, title="Solder the motors", picture=""),
        replace(lay_in, title="Lay the circuit in", picture=SKIN_SIDE),
        replace(cure, picture=""),
    )


def _shown(steps: Iterable[BenchStep]) -> tuple[BenchStep, ...]:
    """Return steps with the array's pictures in the place of those that are drawn of one unit's moulds."""
    return tuple(replace(step, picture=_picture(step.picture)) for step in steps)


def _picture(path: str) -> str:
    if pour := re.fullmatch(re.escape(picture_path("pour")).replace("pour", r"pour(\d+)-strike"), path):
        return f"pictures/pour{pour[1]}.png"
    return {picture_path("pieces"): TOOLS}.get(path, "")

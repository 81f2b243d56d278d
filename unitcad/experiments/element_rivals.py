"""Finite elements of unit and body as rivals: a flat or an axial motor, read at the skin or at the unit's own edge.

A draw sets all that is not known of unit and body (`attenuation.mechanics.unknowns`). Blocks of draws are kept in a
store, so that a second run, or one that was interrupted, solves nothing twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.inputs import EstimateInput
from unitcad.cache import Store, digest
from unitcad.experiments.draws import Draws, Rival

if TYPE_CHECKING:
    from unitcad.attenuation.mechanics.motor_level import Drive

FINENESS = 0.5
"""Of the mesh; see docs/experiments.md for what it costs in accuracy."""
BLOCK = 10
"""Draws that are solved and kept together."""
SMALLEST = 1e-7
"""What a vibrometer shows where less moves, m, under the force of a small motor, about one newton."""
NAMES = {
    "mechanics-axial-edge": "finite elements, motor driven along its axis, the unit's own edge was read",
    "mechanics-flat-edge": "finite elements, motor driven sideways, the unit's own edge was read",
    "mechanics-axial-skin": "finite elements, motor driven along its axis, the skin beside the unit was read",
    "mechanics-flat-skin": "finite elements, motor driven sideways, the skin beside the unit was read",
}
MISSING = "needs scikit-fem, of the extra fem"


def installed() -> bool:
    """Tell whether the library of the finite elements is there."""
    return find_spec("skfem") is not None


def element_rivals(store: Store, smallest: float = SMALLEST) -> tuple[Rival, ...]:
    """Return the four rivals, whose solutions are kept in `store`; `smallest`: see `SMALLEST`."""
    return tuple(
        Rival(
            name,
            says,
            partial(_levels, store, smallest, *name.split("-")[1:]),
            costly=True,
            unread=partial(_unread, store, smallest, *name.split("-")[1:]),
        )
        for name, says in NAMES.items()
    )


def _levels(
    store: Store, smallest: float, drive: Drive, reading: str, variant: EstimateInput, draws: Draws
) -> np.ndarray:
    read, motor = (np.maximum(moved, smallest) for moved in _amplitudes(store, drive, reading, variant, draws))
    return read / motor


def _unread(
    store: Store, smallest: float, drive: Drive, reading: str, variant: EstimateInput, draws: Draws
) -> np.ndarray:
    return np.min(_amplitudes(store, drive, reading, variant, draws), axis=0) < smallest


def _amplitudes(store: Store, drive: Drive, reading: str, variant: EstimateInput, draws: Draws) -> list[np.ndarray]:
    """Return the amplitudes at the reading and of the motor, m under one newton, each (draws,)."""
    blocks = []
    for start in range(0, len(draws.indices), BLOCK):
        part = draws.indices[start : start + BLOCK]
        with store.entry(_key(variant, drive, draws.seed, draws.count, part)) as entry:
            if entry.data is None:
                entry.data = _solve(variant, drive, draws.seed, draws.count, part)
        blocks.append(entry.data)
    return [np.concatenate([block[at] for block in blocks]) for at in (reading, "motor")]


def _solve(
    variant: EstimateInput, drive: Drive, seed: int, count: int, indices: Sequence[int]
) -> dict[str, list[float]]:
    """Return amplitudes under one newton (m) of a block of draws: at both readings and of the motor."""
    from unitcad.attenuation.mechanics.motor_level import amplitude, motion
    from unitcad.attenuation.mechanics.unknowns import Draw, drawn

    found: dict[str, list[float]] = {"skin": [], "edge": [], "motor": []}
    for index in indices:
        made, setting = drawn(variant, Draw(seed, index, count))
        moved = motion(replace(made, frequency=variant.frequency), drive, setting, FINENESS)
        found["skin"].append(amplitude(moved.skin, drive, "along"))
        found["edge"].append(amplitude(moved.edge, drive, "along"))
        found["motor"].append(abs(moved.motor))
    return found


def _key(variant: EstimateInput, drive: Drive, seed: int, count: int, indices: Sequence[int]) -> str:
    return digest(repr(("amplitudes", _solver(), FINENESS, variant, drive, seed, count, tuple(indices))).encode())


@cache
def _solver() -> str:
    """Return a digest of the code that solves: a changed line reuses nothing."""
    folder = Path(str(files("unitcad"))) / "attenuation"
    code = [
        folder / "inputs.py",
        folder / "even_draws.py",
        *sorted(folder.glob("layered/*.py")),
        *sorted(folder.glob("mechanics/*.py")),
    ]
    return digest(b"".join(file.read_bytes() for file in code))

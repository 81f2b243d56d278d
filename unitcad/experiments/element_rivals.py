"""Finite elements of unit and body as rivals: a flat or an axial motor, read at the skin or at the unit's own edge.

A draw sets all that is not known of unit and body (`attenuation.mechanics.unknowns`). Blocks of draws are kept in a
store, so that a second run, or one that was interrupted, solves nothing twice.
"""

from __future__ import annotations

from functools import cache, partial
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from unitcad.attenuation.inputs import EstimateInput
from unitcad.cache import Store, digest
from unitcad.experiments.draws import Draws, Rival

FINENESS = 1.0
"""Of the mesh; see docs/experiments.md for what it costs in accuracy."""
BLOCK = 10
"""Draws that are solved and kept together."""
NAMES = {
    "mechanics-axial-edge": "finite elements, motor driven along its axis, the unit's own edge was read",
    "mechanics-flat-edge": "finite elements, motor driven sideways, the unit's own edge was read",
    "mechanics-axial-skin": "finite elements, motor driven along its axis, the skin beside the unit was read",
    "mechanics-flat-skin": "finite elements, motor driven sideways, the skin beside the unit was read",
}
MISSING = "needs scikit-fem: pip install 'unitcad[fem]'"


def installed() -> bool:
    """Tell whether the library of the finite elements is there."""
    return find_spec("skfem") is not None and find_spec("unitcad.attenuation.mechanics") is not None


def element_rivals(store: Store) -> tuple[Rival, ...]:
    """Return the four rivals, whose solutions are kept in `store`."""
    return tuple(
        Rival(name, says, partial(_levels, store, *name.split("-")[1:]), costly=True) for name, says in NAMES.items()
    )


def _levels(store: Store, drive: str, reading: str, variant: EstimateInput, draws: Draws) -> np.ndarray:
    starts = range(0, draws.count, BLOCK)
    solved = [
        store.data(_key(variant, drive, draws.seed, i), partial(_solve, variant, drive, draws.seed, i)) for i in starts
    ]
    return np.concatenate([block[reading] for block in solved])[: draws.count]


def _solve(variant: EstimateInput, drive: str, seed: int, start: int) -> dict[str, list[float]]:
    """Return the levels of a block of draws at both readings, which share their solutions."""
    from unitcad.attenuation.mechanics.motor_level import level
    from unitcad.attenuation.mechanics.unknowns import Draw

    found: dict[str, list[float]] = {"skin": [], "edge": []}
    for index in range(start, start + BLOCK):
        for reading, values in found.items():
            hertz = variant.frequency.middle
            values.append(level(variant, hertz, drive, reading, Draw(seed, index), FINENESS))  # type: ignore[arg-type]
    return found


def _key(variant: EstimateInput, drive: str, seed: int, start: int) -> str:
    return digest(repr(("levels", _solver(), FINENESS, BLOCK, variant, drive, seed, start)).encode())


@cache
def _solver() -> str:
    """Return a digest of the code that solves: a changed line reuses nothing."""
    folder = Path(str(files("unitcad"))) / "attenuation"
    return digest(b"".join(file.read_bytes() for file in sorted(folder.rglob("*.py"))))

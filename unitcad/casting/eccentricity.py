"""How far a cup's bore stands off the core's axis: by its play on the plinth, and with the ribs that centre it.

Without ribs a cup of the clearance c lies anywhere in a square of c to either side: up to c sqrt(2) off, in a gang too,
since every cell lies between the plinth's faces. With ribs it stands where their forces balance: rib i, at p_i with
the outward normal n_i, is crushed, or pushed back on its leaf, by d - n_i . u; its force is that times its strength.
The balance of forces and moments gives the shift u and the turn of the cup; the worst choice of strengths gives the
bound. None of this has
been measured: the strengths' spread is assumed, and what the printer makes of the clearance is taken from its play.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.ribs import Rib, ribs

UNEVEN = 0.3
"""By how much a rib may be stronger or weaker than the others, as a share.

Assumed: a line more or less; of a leaf, a tenth of its thickness.
"""


@dataclass(frozen=True)
class Eccentricity:
    """The most that a bore stands off the core's axis, mm, where the gap is printed as drawn, and where it is not.

    `off_mm` is what the printer's play makes the gap wider or narrower by, per side.
    """

    ribs: int
    as_drawn_mm: float
    at_worst_mm: float
    off_mm: float


def eccentricity(moulds: MouldSet, *, with_ribs: bool = True) -> Eccentricity:
    """Return the eccentricity of a set's cups as they are, or as they would be without ribs."""
    lengths, lay = moulds.spec.moulds, moulds.plan.layout
    clearance, off, depth = lengths.plinth_clearance_mm, lengths.xy_play_mm, lengths.rib_interference_mm
    standing = ribs(moulds.spec, lay) if with_ribs else ()
    if not standing:
        return Eccentricity(0, math.sqrt(2) * clearance, math.sqrt(2) * (clearance + off), off)
    cells = tuple((cell.x, cell.y) for cell in lay.cells)
    # A gap can't be narrower than nothing; one wider than the ribs reach leaves the rest as play.
    tight = depth + min(off, clearance)
    loose = math.sqrt(2) * max(off - depth, 0.0)
    share = shift_per_depth(standing, cells)
    return Eccentricity(len(standing), share * depth, max(share * tight, loose), off)


@lru_cache(maxsize=16)
def shift_per_depth(standing: tuple[Rib, ...], cells: tuple[tuple[float, float], ...]) -> float:
    """Return the greatest shift of a cell's bore, over the depth of the ribs, for every choice of their strengths."""
    outward = -np.array([rib.inwards for rib in standing], dtype=float)
    at = np.array([(rib.x, rib.y) for rib in standing])
    # What a shift (x, y) and a small turn of the cup take from each rib's depth, along its normal.
    rows = np.column_stack([outward, at[:, 0] * outward[:, 1] - at[:, 1] * outward[:, 0]])
    strengths = np.array(list(product((1 - UNEVEN, 1 + UNEVEN), repeat=len(standing))))
    weighted = rows * strengths[:, :, None]
    # Each rib pushes the cup outwards by its depth; moved out by u it is crushed by that much less.
    moved = np.linalg.solve(np.swapaxes(weighted, 1, 2) @ rows, weighted.sum(axis=1)[:, :, None])
    x, y, turn = np.moveaxis(moved, 1, 0)
    cx, cy = np.array(cells).T
    return float(np.hypot(x - turn * cy, y + turn * cx).max())

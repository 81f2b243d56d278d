"""Values of coordinates, V001 and V002."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.meshcheck.findings import Finding, Location, ending, number, tally
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, float32_steps
from unitcad.meshcheck.geometry.topology import diagonals
from unitcad.meshcheck.rules.inspection import Inspection
from unitcad.meshcheck.rules.registry import Rule

V001 = Rule("""
    V001 error: NaN or infinity
    A vertex is not a finite float32 number.
    Example: A vertex lies at (nan, 0, 0).
    Fix: Find the operation that divided by zero, and export again.
""")

V002 = Rule("""
    V002 warning: beyond float32 precision at this size
    The grid of float32 numbers at a shell's farthest coordinate is coarser than a ten-thousandth of the shell's
    diagonal: it is too far from the origin.
    Example: A part of 10 mm is 100 m from the origin, at which float32 numbers are 0.008 mm apart.
    Fix: Move the part to the origin before export.
""")

FAR = 1e-4  # V002: float32 step over the diagonal


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply V002 to each shell; without finite vertices (`not_finite`) there is nothing to inspect."""
    low, high = part.topology.low, part.topology.high
    yield from too_far(np.stack([low, high], axis=1), diagonals(low, high))


def not_finite(mesh: Mesh) -> tuple[Finding, ...]:
    """Apply V001, which ends the check of a mesh."""
    finite = np.asarray((np.abs(mesh.vertices) <= LARGEST).all(axis=1))
    if finite.all():
        return ()
    bad = np.flatnonzero(~finite[mesh.faces].all(axis=1))
    places = (Location(face=int(i)) for i in bad)
    text = tally(len(finite) - int(finite.sum()), "non-finite vertex", "non-finite vertices")
    return ending([V001.finding(text, len(bad) or 1, places)])


def faces_not_finite(n: int, places: Iterable[Location]) -> Finding:
    """Make the finding V001 of a reader, which gives no mesh then."""
    return V001.finding(f"{tally(n, 'face')} with a vertex that is not finite", n, places)


def too_far(corners: Floats, size: Floats) -> list[Finding]:
    """Apply V002 to shells or instances: low and high corners of their boxes, (n, 2, 3) mm, and diagonals, mm."""
    step = float32_steps(corners)
    far = np.flatnonzero((step > FAR * size) & (size > 0))
    if not len(far):
        return []
    worst = far[np.argmax(step[far] / size[far])]
    text = (
        f"coordinates are {number(step[worst], 3)} mm apart in float32, the part is {number(size[worst], 3)} mm across"
    )
    return [V002.finding(text, len(far))]

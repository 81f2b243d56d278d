"""Whether the tracks of all motors find room on the common circuit's spine and tail."""

from __future__ import annotations

from unitcad.arrays.array import Array
from unitcad.arrays.array_tables import CircuitTable
from unitcad.text import number

TRACK_MM = GAP_MM = 0.1
"""Least width of a track, and of the gap beside it (assumed: 4 mil, what makers of flexible circuits usually offer)."""


def width_needed(motors: int) -> float:
    """Return how wide one layer of a track a motor and a common return is, mm, a gap at both edges."""
    return (motors + 1) * (TRACK_MM + GAP_MM) + GAP_MM


def crowded_tracks(array: Array) -> list[str]:
    """Return a sentence where spine and tail are too narrow for the tracks of all motors; else []."""
    width, motors = (array.circuit or CircuitTable()).row_width_mm, len(array.places)
    needed = width_needed(motors)
    if needed <= width + 1e-9:
        return []
    most = int((width - GAP_MM) / (TRACK_MM + GAP_MM) + 1e-9) - 1
    return [
        f"the circuit's spine and tail are {number(width, 3)} mm wide (circuit.row_width_mm), enough for {most} "
        f"motors: {motors} tracks and a common return, {TRACK_MM:g} mm wide and {GAP_MM:g} mm apart on one layer, need "
        f"{number(needed, 3)} mm"
    ]

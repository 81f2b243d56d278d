"""The colour of what a pour casts, in every drawing and picture of the procedure."""

from __future__ import annotations

from unitcad.designs import layer_colour
from unitcad.moulds.mould_set import MouldSet


def cast_colour(moulds: MouldSet, pour: int) -> tuple[float, float, float]:
    """Return the colour of what pour (from 1) casts: that of the body that it becomes."""
    own = (body.colour for body in moulds.unit if body.made == "cast" and body.step == pour)
    return next(own, layer_colour(pour - 1))

"""Pockets of air that follow from lengths alone, before anything is meshed; mould check C400 measures them all."""

from __future__ import annotations

import math

from unitcad.designs import Dimensions
from unitcad.designs.dimensions import WIRE_GAP, Exit
from unitcad.designs.limits import EPS, down
from unitcad.errors import Refusal
from unitcad.spec import Spec

TILT_DEG = 5.0
"""The tilt that a mould must bear on the bench."""
DENT = 0.1
"""Depth of a pocket of air over the layer's thinnest part, up to which it is a dent that the printer's play exceeds."""
MESH_ROOM = 0.8
"""The part of that depth that vents and tongues may use: a mesh's polygons, and a gate in a vent's place, add to it."""


def deepest(spec: Spec, layer: int) -> float:
    """Return the depth of a dent that a layer (from 0) bears, mm."""
    drawn = spec.layers[layer]
    return DENT * min(drawn.wall_mm, drawn.cap_mm if drawn.cap_mm else drawn.wall_mm)


def under_tongue(dims: Dimensions, exit: Exit, layer: int) -> float:
    """Return the depth of the air trapped under a tongue at the bore, the mould tilted towards it, mm.

    The tongue's flat underside is a ceiling; its highest point is on the bore at r, and the way out leads round to the
    tongue's edge, half a width h aside: lower by (r - sqrt(r^2 - h^2)) sin(tilt).
    """
    bore, half = dims.radii[layer], exit.width / 2
    return (bore - math.sqrt(max(bore**2 - half**2, 0.0))) * math.sin(math.radians(TILT_DEG))


def widest_tongue(spec: Spec, dims: Dimensions, layer: int) -> float:
    """Return the width up to which air under a tongue gets out of a pour, mm: `under_tongue` solved for it."""
    bore = dims.radii[layer]
    drop = min(MESH_ROOM * deepest(spec, layer) / math.sin(math.radians(TILT_DEG)), bore)
    return 2 * math.sqrt(bore**2 - (bore - drop) ** 2)


def check_tongue(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal if a tongue is too wide for the air under it to get out."""
    widths = [widest_tongue(spec, dims, layer) for layer in range(len(spec.layers))]
    if not dims.exit or dims.exit.width <= min(widths) + EPS:
        return
    layer = widths.index(min(widths))
    widest = widths[layer] - spec.moulds.slot_width_clearance_mm
    depth = under_tongue(dims, dims.exit, layer)
    why = (
        f"tilted by {TILT_DEG:g} degrees, pour {layer + 1} keeps {depth:.3f} mm of air under the tongue, more than "
        f"{MESH_ROOM * deepest(spec, layer):.3f}"
    )
    if spec.wires:
        each = down((widest + WIRE_GAP) / spec.wires.count - WIRE_GAP)
        raise Refusal("wires.diameter_mm", spec.wires.diameter_mm, why, each if each > 0 else None)
    tail = spec.fpcb.tail_width_mm if spec.fpcb else 0.0
    raise Refusal("fpcb.tail_width_mm", tail, why, down(widest) if widest > 0.001 else None)

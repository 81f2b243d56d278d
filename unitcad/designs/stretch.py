"""How far silicone is stretched, and how far it may be."""

from __future__ import annotations

from collections.abc import Mapping

from unitcad.catalogue import Material
from unitcad.designs.dimensions import Dimensions, Exit
from unitcad.spec import Spec
from unitcad.spec.resolved import Circuit


def allowed_strain(spec: Spec, known: Mapping[str, Material]) -> float:
    """Return the margin's part of the least elongation at break among the layers (1 = 100 %)."""
    least = min(float(known[layer.material].elongation_pct) for layer in spec.layers)
    return spec.casting.strain_margin * least / 100


def lip_strain(dims: Dimensions) -> float:
    """Return the strain of a lip's mouth as motor and pad are pushed through it: radius over radius, less one."""
    passing = max(dims.motor_radius, dims.pad.radius if dims.pad else 0.0)
    return passing / dims.mouth_radius - 1


def tail_strain(fpcb: Circuit, slot: Exit) -> float:
    """Return the strain of the slot's edge as the tail's free end passes: perimeter over perimeter, less one, or 0."""
    return max(0.0, 2 * (fpcb.tail_end_width_mm + fpcb.thickness_mm) / _round(slot) - 1)


def pad_strain(fpcb: Circuit, slot: Exit) -> float:
    """Return the strain of the slot's edge if the circuit's own pad had to pass, as a chain's next pad would."""
    return max(0.0, 2 * (fpcb.pad_diameter_mm + fpcb.thickness_mm) / _round(slot) - 1)


def widest_tail_end(fpcb: Circuit, slot: Exit, strain: float) -> float:
    """Return the widest free end of a tail, mm, that stretches the slot by no more than `strain`."""
    return _round(slot) * (1 + strain) / 2 - fpcb.thickness_mm


def _round(slot: Exit) -> float:
    """Return the slot's perimeter, mm."""
    return 2 * (slot.width + slot.height)

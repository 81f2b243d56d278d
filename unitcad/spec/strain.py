"""How far silicone is stretched, and how far it may be: shared by the door and the moulds' laws."""

from __future__ import annotations

from collections.abc import Mapping

from unitcad.catalogue import Material
from unitcad.spec.dimensions import dimensions
from unitcad.spec.models import Spec


def allowed_strain(spec: Spec, known: Mapping[str, Material]) -> float:
    """The margin's part of the least elongation at break among the layers (1 = 100 %)."""
    least = min(float(known[layer.material].elongation_pct) for layer in spec.layers)
    return spec.casting.strain_margin * least / 100


def tail_strain(spec: Spec) -> float | None:
    """Strain of the slot's edge when the tail's free end passes: perimeter over perimeter, less one, or 0 if it fits.

    None without a tail that goes through a slot.
    """
    if not spec.fpcb or spec.design != "encapsulating":
        return None
    return max(0.0, _round_end(spec) / _round_slot(spec) - 1)


def pad_strain(spec: Spec) -> float | None:
    """Strain of the slot's edge if the circuit's own pad had to pass: what a chain's next pad would need."""
    if not spec.fpcb or not spec.fpcb.pad_diameter_mm or spec.design != "encapsulating":
        return None
    return max(0.0, 2 * (spec.fpcb.pad_diameter_mm + spec.fpcb.thickness_mm) / _round_slot(spec) - 1)


def widest_tail_end(spec: Spec, strain: float) -> float:
    """The widest free end of a tail, mm, that stretches the slot by no more than `strain`."""
    assert spec.fpcb is not None
    return _round_slot(spec) * (1 + strain) / 2 - spec.fpcb.thickness_mm


def _round_end(spec: Spec) -> float:
    assert spec.fpcb is not None
    return 2 * ((spec.fpcb.tail_end_width_mm or spec.fpcb.tail_width_mm) + spec.fpcb.thickness_mm)


def _round_slot(spec: Spec) -> float:
    dims = dimensions(spec)
    assert dims.slot_z is not None
    return 2 * (dims.slot_width + dims.slot_z[1] - dims.slot_z[0])

"""Which inputs a level reads: d ln level / d ln input at the middle of every range, by central differences.

An input is named as in the spec. Each is changed as a designer would: a thicker wall takes from the cavity, not from
the diameter; a higher motor lifts caps and circuit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.inputs import EstimateInput, Geometry, Pad, Quantity

Levels = Callable[[Sequence[EstimateInput]], Any]
"""The levels of variants that differ in values only, as many numbers."""
Scaled = Callable[[EstimateInput, float], EstimateInput]
STEP = 1e-3
"""Relative change to both sides: the differences are off by about its square."""
_DIGITS = 4
_SILICONE = {
    "youngs_modulus_kpa": "youngs_modulus",
    "density_g_cm3": "density",
    "poisson_ratio": "poisson_ratio",
    "loss_factor": "tan_delta",
}
_TISSUE = ("shear_modulus", "damping", "thickness", "density")


def sensitivities(variant: EstimateInput, levels: Levels, step: float = STEP) -> dict[str, Any]:
    """Return {by: d ln level / d ln input by input, not_seen: the inputs that change nothing}, to four decimals.

    Without a finite level `by` is None, with a `reason`.
    """
    with np.errstate(all="ignore"):
        low, high = np.log(np.asarray(levels(ends(variant, step)), dtype=float)).reshape(-1, 2).T
    if not np.all(np.isfinite([low, high])):
        return {"by": None, "not_seen": None, "reason": "no finite level at the middle of the inputs' ranges"}
    slopes = {
        name: round(float(d), _DIGITS) for name, d in zip(changed(variant), (high - low) / (2 * step), strict=True)
    }
    return {
        "by": {name: slope for name, slope in slopes.items() if slope},
        "not_seen": [name for name, slope in slopes.items() if not slope],
    }


@lru_cache(maxsize=4)
def ends(variant: EstimateInput, step: float) -> tuple[EstimateInput, ...]:
    """Return the variant with each input of `changed` lower, then higher, by `step`: every model reads the same."""
    return tuple(change(variant, factor) for change in changed(variant).values() for factor in np.exp([-step, step]))


@lru_cache(maxsize=4)
def changed(variant: EstimateInput) -> Mapping[str, Scaled]:
    """Return every input of a variant by its name: a function from the variant and a factor to the changed variant."""
    by_name: dict[str, Scaled] = {}
    geometry = variant.geometry
    for i, (layer, shape) in enumerate(zip(variant.layers, geometry.layers, strict=True)):
        path = f"layers.{i if layer.first is None else layer.first}"
        by_name[f"{path}.wall_mm"] = partial(_wall, i)
        if shape.cap:
            by_name[f"{path}.cap_mm"] = partial(_cap, i)
        for name, field in _SILICONE.items():
            by_name[f"{path}.{name}"] = partial(_silicone, i, field)
    by_name["diameter_mm"] = _diameter
    by_name["motor.diameter_mm"] = _motor_diameter
    by_name["motor.thickness_mm"] = _motor_height
    by_name["motor mass"] = lambda v, f: _with(v, motor_mass=_times(v.geometry.motor_mass, f))
    if geometry.pad:
        by_name["fpcb.pad_diameter_mm"] = _pad_radius
        by_name["fpcb.thickness_mm"] = _pad_thickness
    by_name["estimate.frequency_hz"] = lambda v, f: replace(v, frequency=_times(v.frequency, f))
    for field in _TISSUE:
        by_name[f"tissue {field.replace('_', ' ')}"] = partial(_tissue, field)
    return MappingProxyType(by_name)


def _times(quantity: Any, factor: float) -> Any:
    if quantity is None or isinstance(quantity, float):
        return quantity and quantity * factor
    value, low, high = (None if v is None else v * factor for v in (quantity.value, quantity.low, quantity.high))
    return Quantity(value, low, high, quantity.note)


def _silicone(index: int, field: str, variant: EstimateInput, factor: float) -> EstimateInput:
    layers = list(variant.layers)
    quantity = getattr(layers[index], field)
    if field == "poisson_ratio" and quantity.middle * max(factor, 1.0 / factor) > 0.5:
        # No ratio lies above 1/2: the whole difference is taken below the value.
        factor = min(factor**2, 1.0)
    layers[index] = replace(layers[index], **{field: _times(quantity, factor)})
    return replace(variant, layers=tuple(layers))


def _tissue(field: str, variant: EstimateInput, factor: float) -> EstimateInput:
    tissue = (replace(layer, **{field: _times(getattr(layer, field), factor)}) for layer in variant.tissue)
    return replace(variant, tissue=tuple(tissue))


def _with(variant: EstimateInput, **lengths: Any) -> EstimateInput:
    return replace(variant, geometry=replace(variant.geometry, **lengths))


def _cavity(geometry: Geometry, wider: float) -> float:
    """Return the cavity's radius; if Layer 1 reaches the motor it stays the motor's."""
    return geometry.cavity_radius + (wider if geometry.gap > 0 else 0.0)


def _radii(variant: EstimateInput, wider: Sequence[float], cavity: float) -> EstimateInput:
    geometry = variant.geometry
    pairs = zip(geometry.layers, wider, strict=True)
    layers = tuple(replace(shape, outer_radius=shape.outer_radius + more) for shape, more in pairs)
    return _with(variant, layers=layers, cavity_radius=_cavity(geometry, cavity))


def _wall(index: int, variant: EstimateInput, factor: float) -> EstimateInput:
    silicones = list(variant.layers)
    more = silicones[index].thickness * (factor - 1.0)
    silicones[index] = replace(silicones[index], thickness=silicones[index].thickness + more)
    inside = [-more if i < index else 0.0 for i in range(len(silicones))]
    return replace(_radii(variant, inside, -more), layers=tuple(silicones))


def _diameter(variant: EstimateInput, factor: float) -> EstimateInput:
    more = variant.diameter / 2.0 * (factor - 1.0)
    return replace(_radii(variant, [more] * len(variant.layers), more), diameter=variant.diameter * factor)


def _lifted(geometry: Geometry, by: float, first: int = 0, cap: float = 0.0) -> dict[str, Any]:
    """Return the layers' tops from `first` on `by` higher, the first one's cap thicker by `cap`."""
    return {
        "layers": tuple(
            replace(shape, top=shape.top + by * (i >= first), cap=shape.cap + cap * (i == first))
            for i, shape in enumerate(geometry.layers)
        )
    }


def _cap(index: int, variant: EstimateInput, factor: float) -> EstimateInput:
    more = variant.geometry.layers[index].cap * (factor - 1.0)
    return _with(variant, **_lifted(variant.geometry, more, index, more))


def _motor_diameter(variant: EstimateInput, factor: float) -> EstimateInput:
    geometry = variant.geometry
    radius = geometry.motor_radius * factor
    return _with(variant, motor_radius=radius, cavity_radius=geometry.cavity_radius if geometry.gap > 0 else radius)


def _motor_height(variant: EstimateInput, factor: float) -> EstimateInput:
    geometry = variant.geometry
    more = geometry.motor_height * (factor - 1.0)
    pad = geometry.pad and Pad(geometry.pad.radius, geometry.pad.low + more, geometry.pad.high + more)
    heights = {"motor_height": geometry.motor_height + more, "core_height": geometry.core_height + more}
    return _with(variant, **heights, pad=pad, **_lifted(geometry, more))


def _pad_radius(variant: EstimateInput, factor: float) -> EstimateInput:
    pad = variant.geometry.pad
    return _with(variant, pad=pad and replace(pad, radius=pad.radius * factor))


def _pad_thickness(variant: EstimateInput, factor: float) -> EstimateInput:
    """Thicken the circuit; if it is part of the core, under a cap, the layers rise with it."""
    geometry = variant.geometry
    pad = geometry.pad
    if pad is None:
        return variant
    more = (pad.high - pad.low) * (factor - 1.0)
    thicker = replace(pad, high=pad.high + more)
    if geometry.core_height <= geometry.motor_height:
        return _with(variant, pad=thicker)
    return _with(variant, pad=thicker, core_height=geometry.core_height + more, **_lifted(geometry, more))

"""Each model's account of one variant: edge level, ratio to the controls, margins, spread, and the inputs it reads.

The inputs' slopes are d ln level / d ln input at the middle of every range, by central differences. An input is named
as in the spec. Each is changed as a designer would: a thicker wall takes from the cavity, not from the diameter; a
higher motor lifts caps and circuit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured import (
    CLASSES,
    FIELDS,
    measured_slopes,
    nominal,
    stack_inputs,
    unit_class,
)
from unitcad.attenuation.edge.models import RULE, edge_levels, stored
from unitcad.attenuation.edge.ranges import LabFit, predictive_block
from unitcad.attenuation.inputs import EstimateInput, Pad, Quantity, SiliconeLayer

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
        return {"by": None, "no_effect": None, "reason": "no finite level at the middle of the inputs' ranges"}
    slopes = {
        name: round(float(d), _DIGITS) for name, d in zip(changed(variant), (high - low) / (2 * step), strict=True)
    }
    return {
        "by": {name: slope for name, slope in slopes.items() if slope},
        "no_effect": [name for name, slope in slopes.items() if not slope],
    }


def ends(variant: EstimateInput, step: float) -> tuple[EstimateInput, ...]:
    """Return the variant with each input of `changed` lower, then higher, by `step`."""
    return tuple(change(variant, factor) for change in changed(variant).values() for factor in np.exp([-step, step]))


def changed(variant: EstimateInput) -> dict[str, Scaled]:
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
    by_name["motor mass"] = lambda v, f: _grown(v, motor_mass=_times(v.geometry.motor_mass, f))
    if geometry.pad:
        by_name["fpcb.pad_diameter_mm"] = partial(_pad_radius, geometry.pad)
        by_name["fpcb.thickness_mm"] = partial(_pad_thickness, geometry.pad)
    by_name["estimate.frequency_hz"] = lambda v, f: replace(v, frequency=_times(v.frequency, f))
    for field in _TISSUE:
        by_name[f"tissue {field.replace('_', ' ')}"] = partial(_tissue, field)
    return by_name


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
    layer = layers[index]
    place = layer.place + (np.log(factor) if field == "youngs_modulus" else 0.0)
    layers[index] = replace(layer, place=float(place), **{field: _times(quantity, factor)})
    return replace(variant, layers=tuple(layers))


def _tissue(field: str, variant: EstimateInput, factor: float) -> EstimateInput:
    tissue = (replace(layer, **{field: _times(getattr(layer, field), factor)}) for layer in variant.tissue)
    return replace(variant, tissue=tuple(tissue))


def _grown(variant: EstimateInput, radii: Any = 0.0, tops: Any = 0.0, caps: Any = 0.0, **lengths: Any) -> EstimateInput:
    """Return the variant with the radii, tops and caps of its layers greater by numbers, and other lengths set."""
    shapes = variant.geometry.layers
    more = (np.broadcast_to(one, len(shapes)).tolist() for one in (radii, tops, caps))
    layers = tuple(
        replace(shape, outer_radius=shape.outer_radius + r, top=shape.top + top, cap=shape.cap + cap)
        for shape, r, top, cap in zip(shapes, *more, strict=True)
    )
    return replace(variant, geometry=replace(variant.geometry, layers=layers, **lengths))


def _wider(variant: EstimateInput, radii: Any, cavity: float) -> EstimateInput:
    """Return the variant with wider layers and cavity; if Layer 1 reaches the motor the cavity stays the motor's."""
    geometry = variant.geometry
    return _grown(variant, radii, cavity_radius=geometry.cavity_radius + (cavity if geometry.gap > 0 else 0.0))


def _wall(index: int, variant: EstimateInput, factor: float) -> EstimateInput:
    silicones = list(variant.layers)
    more = silicones[index].thickness * (factor - 1.0)
    silicones[index] = replace(silicones[index], thickness=silicones[index].thickness + more)
    inside = -more * (np.arange(len(silicones)) < index)
    return replace(_wider(variant, inside, -more), layers=tuple(silicones))


def _diameter(variant: EstimateInput, factor: float) -> EstimateInput:
    more = variant.diameter / 2.0 * (factor - 1.0)
    return replace(_wider(variant, more, more), diameter=variant.diameter * factor)


def _cap(index: int, variant: EstimateInput, factor: float) -> EstimateInput:
    more, place = variant.geometry.layers[index].cap * (factor - 1.0), np.arange(len(variant.layers))
    return _grown(variant, tops=more * (place >= index), caps=more * (place == index))


def _motor_diameter(variant: EstimateInput, factor: float) -> EstimateInput:
    geometry = variant.geometry
    radius = geometry.motor_radius * factor
    return _grown(variant, motor_radius=radius, cavity_radius=geometry.cavity_radius if geometry.gap > 0 else radius)


def _motor_height(variant: EstimateInput, factor: float) -> EstimateInput:
    geometry = variant.geometry
    more = geometry.motor_height * (factor - 1.0)
    pad = geometry.pad and Pad(geometry.pad.radius, geometry.pad.low + more, geometry.pad.high + more)
    heights = {"motor_height": geometry.motor_height + more, "core_height": geometry.core_height + more}
    return _grown(variant, tops=more, pad=pad, **heights)


def _pad_radius(pad: Pad, variant: EstimateInput, factor: float) -> EstimateInput:
    return _grown(variant, pad=replace(pad, radius=pad.radius * factor))


def _pad_thickness(pad: Pad, variant: EstimateInput, factor: float) -> EstimateInput:
    """Thicken the circuit; if it is part of the core, under a cap, the layers rise with it."""
    geometry, more = variant.geometry, (pad.high - pad.low) * (factor - 1.0)
    thicker, lifted = replace(pad, high=pad.high + more), more * (geometry.core_height > geometry.motor_height)
    return _grown(variant, tops=lifted, pad=thicker, core_height=geometry.core_height + lifted)


_MOST_CORNERS = 12
NO_PASSES = "the rule knows embedded and encapsulating units only"
_NOT_FINITE = "no finite answer at Poisson's ratio 1/2: the pressure wave's speed is infinite"
_WAVES: tuple[cf.Wave, ...] = ("s", "p")
KINDS = {
    "rule": "two constants fitted to the measured levels: s, times q for each pass of a border whose inside is the "
    "softer layer. Silicones that differ less than the measured pairs count in proportion to the logarithm of their "
    "moduli",
    "published": "the paper's closed form as printed: transmission coefficients and exponentials along the walls, one "
    "constant s from the table (f1 and f2 are not printed)",
    "corrected": "the same path with complex moduli, complex impedances and the exact attenuation; one constant s",
}
ASSUMPTIONS = {
    "rule": [
        "Fitted to nine levels of units with 1.25 mm walls at 100 to 150 Hz. Its form was chosen after they were seen.",
        "It can't tell one-material units apart: it gives each the same level, where 39.5, 45.2 and 60.2 % were "
        "measured.",
        "Between equal silicones and those of the measured units it follows the logarithm of their moduli: nothing was "
        "measured there.",
        "More than two layers: every border with the softer layer inside counts, which nobody has measured.",
    ],
    "published": [
        "Plane waves cross each interface at right angles as if both sides were half-spaces; a layer of the measured "
        "units is 1/14 to 1/67 of a shear wavelength thick.",
        "u_z decays and transmits as a shear wave, u_r as a pressure wave, though both components carry both.",
        "The path back into the skin has no coefficient: layers that close over the motor give the same number as open "
        "rings.",
        "The pressure wave depends on how Poisson's ratio is fixed just below 1/2; at 1/2 it has no answer.",
    ],
    "corrected": [
        "The same single path as the paper's: half-spaces, no reflections that come back, no path into the skin.",
        "One loss factor for each material at all frequencies, Poisson's ratio real.",
    ],
}


@lru_cache(maxsize=4)
def corners(variant: EstimateInput) -> Units:
    """Return the variant with inputs at the ends of their ranges: all corners, or one at a time if there are many.

    Layers of one material move together.
    """
    quantities = [q for _, q in _inputs(variant)]
    ends = np.array([q.ends for q in quantities])
    middle = np.array([q.middle for q in quantities])
    moving = [i for i, (low, high) in enumerate(ends) if low < high]
    if len(moving) <= _MOST_CORNERS:
        count = 2 ** len(moving)
        rows = np.repeat(middle[None], count, axis=0)
        for bit, i in enumerate(moving):
            rows[:, i] = ends[i][(np.arange(count) >> bit) & 1]
    else:
        rows = np.repeat(middle[None], 2 * len(moving), axis=0)
        for row, i in enumerate(moving):
            rows[2 * row : 2 * row + 2, i] = ends[i]
    return _units(variant, np.concatenate([middle[None], rows]))


def _inputs(variant: EstimateInput) -> Iterator[tuple[tuple[str, str], Quantity]]:
    """Yield ((material, field), quantity) of every distinct input, the frequency last."""
    seen: dict[str, SiliconeLayer] = {}
    for layer in variant.layers:
        seen.setdefault(layer.material, layer)
    for name, layer in seen.items():
        for field in FIELDS:
            yield (name, field), getattr(layer, field)
    yield ("", "frequency"), variant.frequency


def _units(variant: EstimateInput, rows: np.ndarray) -> Units:
    at = {key: i for i, (key, _) in enumerate(_inputs(variant))}
    columns = {field: rows[:, [at[layer.material, field] for layer in variant.layers]] for field in FIELDS}
    return Units(
        **columns,
        density=np.tile([layer.density for layer in variant.layers], (len(rows), 1)),
        thickness=np.tile([layer.thickness for layer in variant.layers], (len(rows), 1)),
        omega=2.0 * np.pi * rows[:, -1],
        passes=np.full(len(rows), variant.passes),
        place=np.tile([layer.place for layer in variant.layers], (len(rows), 1)),
        doubt=np.tile([layer.doubt for layer in variant.layers], (len(rows), 1)),
    )


@lru_cache(maxsize=4)
def unknown(variant: EstimateInput) -> str:
    """Return why there can be no number: the first input that is not known; empty if all are."""
    if variant.passes != variant.passes:
        return NO_PASSES
    for (name, field), quantity in _inputs(variant):
        if not quantity.known:
            return f"{name} {field}: {quantity.note}"
    return ""


@lru_cache(maxsize=4)
def range_notes(variant: EstimateInput) -> tuple[str, ...]:
    """Return the assumptions of the inputs that are known as a range only: their result is a range without a value."""
    return tuple(
        f"{name} {field}: {quantity.note}"
        for (name, field), quantity in _inputs(variant)
        if quantity.value is None and quantity.known
    )


def spread(variant: EstimateInput, values: Any) -> dict[str, Any]:
    """Return {value, low, high} of a number for each corner, the middle's first, and a `reason` for nulls.

    The value is null if an input has only a range; all three if an input is not known.
    """
    reason = unknown(variant)
    if reason:
        return {"value": None, "low": None, "high": None, "reason": reason}
    values = np.atleast_1d(values)
    if not np.all(np.isfinite(values)):
        return {"value": _number(values[0]), "low": None, "high": None, "reason": _NOT_FINITE}
    value = None if range_notes(variant) else float(values[0])
    level: dict[str, Any] = {"value": value, "low": float(values.min()), "high": float(values.max())}
    if range_notes(variant):
        level["reason"] = "; ".join(range_notes(variant))
    return level


def edge_level(variant: EstimateInput, model: str, fit: LabFit | None = None) -> dict[str, Any]:
    """Return a model's edge level as {value, low, high}."""
    return _spread(variant, model, edge_levels(corners(variant), model, _constants(variant, model, fit)))


def _spread(variant: EstimateInput, model: str, values: Any) -> dict[str, Any]:
    """Return `spread`; of the rule, which reads the silicones' places, the middle value alone."""
    if model != RULE:
        return spread(variant, values)
    value = _number(np.atleast_1d(values)[0])
    return {"value": value, "low": value, "high": value, **({} if value is not None else {"reason": unknown(variant)})}


def _constants(variant: EstimateInput, model: str, fit: LabFit | None) -> dict[str, float]:
    return fit.constants(model) if fit else stored(variant.moduli)[model]


@np.errstate(all="ignore")  # a legal extreme may under- or overflow, which `spread` finds
def model_block(variant: EstimateInput, model: str, fit: LabFit | None = None) -> dict[str, Any]:
    """Return one entry of the estimate's `models`, without its error against the table.

    With a lab's `fit` the constants are its own, and the level has a predictive range.
    """
    units, constants = corners(variant), _constants(variant, model, fit)
    own = edge_levels(units, model, constants)
    edge = {**_spread(variant, model, own), "unit": "of the motor's amplitude"}
    block: dict[str, Any] = {"kind": KINDS[model], "edge_level": edge}
    if fit:
        block["predictive"] = predictive_block(fit, model, variant, unknown(variant))
    if variant.amplitude is not None:
        block["edge_amplitude_um"] = _spread(variant, model, variant.amplitude * 1e6 * own)
    by_fit = fit and f"{fit.name}: {fit.units} units of the lab's own, fitted with those of other labs"
    block["constants"] = {**constants, "made_by": by_fit or "least squares of the log of nine measured levels"}
    # A control for each distinct material, by the number of its first layer.
    names = [layer.material for layer in variant.layers]
    controls = [names.index(name) for name in dict.fromkeys(names)] if len(names) > 1 else []
    block["hierarchical_over_control"] = [
        {"control": names[i], **_spread(variant, model, own / edge_levels(units.control(i), model, constants))}
        for i in controls
    ] or None
    if not controls:
        block["hierarchical_over_control_reason"] = "a single layer is its own control"
    if model == "published":
        block |= _published_details(variant, controls)
    block["sensitivities"] = test_slopes(
        variant, sensitivities(variant, lambda changed: edge_levels(stack_inputs(changed), model, constants))
    )
    block["assumptions"] = ASSUMPTIONS[model]
    return block


def test_slopes(variant: EstimateInput, seen: dict[str, Any]) -> dict[str, Any]:
    """Return slopes (`sensitivities`) with `tested`: for each how many measured pairs agree in sign, and its range.

    The range holds the slope and the pairs' own, and 0 unless two pairs or more were measured and all agree.
    """
    rows: dict[str, Any] = {}
    found = measured_slopes(variant.moduli) if len(variant.layers) <= 2 else {}
    kind = CLASSES[int(unit_class(nominal(variant))[0])].split(" ")[0]
    firsts = [i if layer.first is None else layer.first for i, layer in enumerate(variant.layers)]
    inputs = {f"layers.{first}.youngs_modulus_kpa": i for i, first in enumerate(firsts)}
    for name, slope in (seen["by"] or {}).items():
        pairs = found.get((kind, inputs.get(name, -1)), [])
        agree = sum(one * slope > 0 for one in pairs)
        sure = agree == len(pairs) >= 2
        every = [slope, *pairs, *([] if sure else [0.0])]
        rows[name] = {"agree": agree, "of": len(pairs), "low": round(min(every), 4), "high": round(max(every), 4)}
    return {**seen, "tested": rows}


def _published_details(variant: EstimateInput, controls: list[int]) -> dict[str, Any]:
    """Return the coefficients of equation 4 and inequalities 5 and 6: 5, 6a and 6b for each control; 6c and 6d once."""
    read = {"wave_of_the_level": "s", "reading_of_eta": "loss_modulus"}
    if unknown(variant):
        return {**read, "constraints": None}
    units = corners(variant) if range_notes(variant) else nominal(variant)
    coefficients = {}
    for wave in _WAVES:
        z = cf.with_air(cf.impedances(units, wave), wave)
        coefficients[wave] = {
            **_by_corner("k_t", cf.transmission(z[..., :-1], z[..., 1:]), variant),
            **_by_corner("k_r", cf.reflection(z[..., :-1], z[..., 1:]), variant),
        }
    return {
        **read,
        "poisson_ratio_used": [layer.poisson_ratio.middle for layer in variant.layers],
        "interfaces": [f"Layer {i + 1} to {i + 2}" for i in range(len(variant.layers) - 1)] + ["last layer to air"],
        "coefficients": coefficients,
        "constraints": [
            _constraint(constraint, None if constraint.name in _NO_CONTROL else variant.layers[i].material, variant)
            for i in controls
            for constraint in cf.constraints(units, units.control(i))
            if i == controls[0] or constraint.name not in _NO_CONTROL
        ],
    }


_NO_CONTROL = ("6c", "6d")


def _constraint(constraint: cf.Constraint, control: str | None, variant: EstimateInput) -> dict[str, Any]:
    margins = np.asarray(constraint.margin)
    finite = bool(np.all(np.isfinite(margins)))
    always, never = bool(np.all(margins > 0)), bool(np.all(margins <= 0))
    block = {
        "equation": constraint.name,
        "text": constraint.text,
        "control": control,
        **_by_corner("left", constraint.left, variant),
        "relation": constraint.relation,
        **_by_corner("right", constraint.right, variant),
        **_by_corner("margin", margins, variant),
        "holds": None if not finite else True if always else False if never else None,
        "unit": constraint.unit,
    }
    if block["holds"] is None:
        block["reason"] = "depends" if finite else _NOT_FINITE
    return block


def _by_corner(name: str, values: Any, variant: EstimateInput) -> dict[str, Any]:
    """Return `values`, a row for each corner, as {name}.

    If an input is known only as a range, {name} is null next to {name}_low and {name}_high.
    """

    def plain(row: Any) -> Any:
        return [_number(v) for v in row] if np.ndim(row) else _number(row)

    values = np.asarray(values)
    if not range_notes(variant):
        return {name: plain(values[0])}
    none = [None] * values.shape[1] if values.ndim > 1 else None
    return {name: none, f"{name}_low": plain(values.min(axis=0)), f"{name}_high": plain(values.max(axis=0))}


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None

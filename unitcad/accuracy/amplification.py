"""Properties that make a spec stiff or extreme, and the amplification of a change of 1e-6 in an input."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from unitcad.accuracy.measurements import REFERENCE, respond
from unitcad.attenuation.edge.level import changed, ends
from unitcad.attenuation.edge.measured import stack_inputs
from unitcad.attenuation.edge.models import edge_levels, stored
from unitcad.attenuation.inputs import EstimateInput, tissue_medium
from unitcad.estimate_inputs import closed_forms, fit_of
from unitcad.spec import Spec

STEP = 1e-6
_FAR = 0.03
"""Distance from the unit's edge to which the skin's motion decays, m."""


def amplifications(spec: Spec, variant: EstimateInput) -> dict[str, Any]:
    """Return {step, results: [{result, worst input, its amplification, by input}]}.

    Amplification: relative change of a result over that of the input, by central differences.
    """
    moved = ends(variant, STEP)
    models = closed_forms(spec.estimate.models)
    fit = fit_of(spec)
    results = {
        f"edge level, model {model}": edge_levels(
            stack_inputs(moved), model, fit.constants(model) if fit else stored(variant.moduli)[model]
        )
        for model in models
    }
    edge, far = _motions(moved)
    results |= {"motion of the skin at the edge": edge, f"motion {1e3 * _FAR:g} mm from the edge, over it": far / edge}
    return {"step": STEP, "results": [_moves(name, variant, values) for name, values in results.items()]}


def _moves(name: str, variant: EstimateInput, values: Any) -> dict[str, Any]:
    with np.errstate(all="ignore"):
        low, high = np.log(np.asarray(values, dtype=float)).reshape(-1, 2).T
    slopes = dict(zip(changed(variant), ((high - low) / (2 * STEP)).tolist(), strict=True))
    if not all(map(math.isfinite, slopes.values())):
        return {"result": name, "worst": None, "amplification": None, "by": {}}
    worst = max(slopes, key=lambda one: abs(slopes[one]))
    return {"result": name, "worst": worst, "amplification": abs(slopes[worst]), "by": slopes}


def _motions(variants: Sequence[EstimateInput]) -> np.ndarray:
    """Return |u| at the unit's edge and `_FAR` from it of each variant; those on one tissue are solved once."""
    solved: dict[str, np.ndarray] = {}
    keys = [repr((one.tissue, one.frequency, one.motor_diameter, one.diameter)) for one in variants]
    for key, one in zip(keys, variants, strict=True):
        if key not in solved:
            found = respond(one, [0.0, _FAR], REFERENCE)
            solved[key] = np.sqrt(sum(np.abs([found.u_r, found.u_theta, found.u_z]) ** 2))
    return np.array([solved[key] for key in keys]).T


def extremes(spec: Spec, variant: EstimateInput) -> list[dict[str, Any]]:
    """Return the properties that may make the design stiff or extreme: a number, its place, and its threshold."""
    medium = tissue_medium(variant.tissue)
    omega = 2.0 * math.pi * variant.frequency.middle
    bodies = list(zip((*medium.layers, medium.half_space), variant.tissue, medium.materials(omega), strict=True))
    lengths = {t.name: abs(2 * math.pi * (m.shear / b.density) ** 0.5 / omega) for b, t, m in bodies}
    softest, stiffest = (f(bodies, key=lambda one: one[0].youngs_modulus) for f in (min, max))
    loss = {t.name: abs(m.shear.imag / m.shear) for _, t, m in bodies}
    free = {t.name: 1 - 2 * b.poisson_ratio for b, t, _ in bodies}
    film = {t.name: one.thickness / lengths[t.name] for one, t in zip(medium.layers, variant.tissue, strict=False)}
    silicones = {one.material: one.youngs_modulus.middle for one in variant.layers}
    walls = {f"layers.{i}": one.wall_mm for i, one in enumerate(spec.layers)}
    wall, ends_of = min(walls, key=walls.__getitem__), sorted(silicones, key=silicones.__getitem__)
    low = [min(one, key=one.__getitem__, default="no layer") for one in (loss, free, film, lengths)]
    rows: list[tuple[str, float, str, float, bool]] = [
        (
            "tissue: modulus, largest over least",
            stiffest[0].youngs_modulus / softest[0].youngs_modulus,
            f"{stiffest[1].name} over {softest[1].name}",
            1e8,
            True,
        ),
        ("tissue: least tan delta", loss[low[0]], low[0], 1e-3, False),
        ("tissue: least 1 - 2 nu", free[low[1]], low[1], 1e-4, False),
        ("tissue: thinnest layer / its shear wavelength", film.get(low[2], math.inf), low[2], 1e-3, False),
        (
            "motor's radius / least shear wavelength",
            variant.motor_diameter / 2 / lengths[low[3]],
            low[3],
            1.0,
            True,
        ),
        (
            "silicones: modulus, largest over least",
            silicones[ends_of[-1]] / silicones[ends_of[0]],
            f"{ends_of[-1]} over {ends_of[0]}",
            100.0,
            True,
        ),
        ("diameter / thinnest wall", spec.diameter_mm / walls[wall], wall, 50.0, True),
        ("tolerance / thinnest wall", spec.output.tolerance_mm / walls[wall], wall, 0.05, True),
    ]
    return [
        {
            "what": what,
            "value": value,
            "at": place,
            "limit": limit,
            "extreme": value > limit if above else value < limit,
        }
        for what, value, place, limit, above in rows
    ]

"""The layered half-space's curve: how the skin's motion decays from the unit's edge outwards, and its spread."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import special

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.inputs import EstimateInput, Quantity, body
from unitcad.attenuation.layered.loads import UniformDisc

EDGE_TO_MM = 30
DEPTHS_MM = (1.0, 3.0)
NO_RATIO = (
    "a laterally uniform half-space has no ring of silicone in it: it can't say what the layers do, so multiplying "
    "its curve by another model's ratio would not be a model"
)
ASSUMPTIONS = [
    "A uniform pressure on the motor's disc drives a laterally uniform body; unit, circuit and cavity are not in it.",
    "An ERM lying flat drives sideways; every load here is axisymmetric. This is the largest thing that is left out.",
    "The body's layers are a template from published ranges, not this person's arm nor the paper's phantom.",
]
_SPREAD_RTOL = 1e-3


def layered_block(variant: EstimateInput, rtol: float = 1e-4) -> dict[str, Any]:
    """Return the estimate's `layered`: |u_z| and |u_r| over |u_z| at the edge, at 0 mm and `DEPTHS_MM`, with spread.

    The spread takes each kind of input (moduli, damping, thicknesses, frequency) by itself to its low and high end.
    """
    r_mm = np.arange(EDGE_TO_MM + 1)
    radius = variant.diameter / 2.0
    r = radius + r_mm * 1e-3
    load = UniformDisc(variant.motor_diameter / 2.0)
    omega = 2.0 * np.pi * variant.frequency.middle
    response = body(variant.tissue).response(load, omega, r, rtol=rtol)
    edge = abs(response.u_z[0])
    many = [(response.u_z, response.u_r)] + [_at_ends(variant, load, r, end) for end in _ends(variant)]
    curves = [np.abs([u_z, u_r]) / abs(u_z[0]) for u_z, u_r in many]
    low, high = np.min(curves, axis=0), np.max(curves, axis=0)
    return {
        "tissue": variant.tissue_name,
        "frequency_hz": variant.frequency.middle,
        "r_mm": [float(v) for v in r_mm],
        "r_is": "distance from the unit's edge outwards",
        "unit": "of |u_z| of the skin at the edge",
        "u_z": _curve(curves[0][0], low[0], high[0]),
        "u_r": _curve(curves[0][1], low[1], high[1]),
        "spread": "each kind of input (moduli, damping, thicknesses, frequency) by itself at both ends of its range",
        "depths": [_at_depth(variant, load, omega, r[::5], z, edge, rtol) for z in DEPTHS_MM],
        "paper_beside": _paper_curves(variant, radius, r),
        "surface_m_per_pa": {"u_z_at_the_edge": float(edge)},
        "error_estimate": response.error / edge,
        "wavenumbers": response.wavenumbers,
        "hierarchical_over_control": None,
        "hierarchical_over_control_reason": NO_RATIO,
        "assumptions": ASSUMPTIONS,
    }


def decay_at(variant: EstimateInput, frequency: float, distances_mm: tuple[float, ...]) -> list[float]:
    """Return |u_z| over its value at the edge, at distances (mm) from it and one frequency (Hz), nominal body."""
    r = variant.diameter / 2.0 + 1e-3 * np.array([0.0, *distances_mm])
    load = UniformDisc(variant.motor_diameter / 2.0)
    response = body(variant.tissue).response(load, 2.0 * np.pi * frequency, r, rtol=1e-3)
    return [float(v) for v in np.abs(response.u_z[1:] / response.u_z[0])]


def _curve(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> dict[str, list[float]]:
    return {name: [float(v) for v in data] for name, data in (("value", value), ("low", low), ("high", high))}


def _ends(variant: EstimateInput) -> list[dict[str, int]]:
    kinds = ["moduli", "damping", "thicknesses"] + (
        ["frequency"] if variant.frequency.ends[0] < variant.frequency.ends[1] else []
    )
    return [{kind: end} for kind in kinds for end in (0, 1)]


def _at_ends(variant: EstimateInput, load: UniformDisc, r: np.ndarray, end: dict[str, int]) -> tuple[Any, Any]:
    frequency: Quantity = variant.frequency
    hertz = frequency.ends[end["frequency"]] if "frequency" in end else frequency.middle
    response = body(variant.tissue, end).response(load, 2.0 * np.pi * hertz, r, rtol=_SPREAD_RTOL)
    return response.u_z, response.u_r


def _at_depth(
    variant: EstimateInput, load: UniformDisc, omega: float, r: np.ndarray, z_mm: float, edge: float, rtol: float
) -> dict[str, Any]:
    response = body(variant.tissue).response(load, omega, r, z=z_mm * 1e-3, rtol=rtol)
    return {
        "z_mm": z_mm,
        "r_mm": [float(v) for v in np.round((r - r[0]) * 1e3)],
        "u_z": [float(v) for v in np.abs(response.u_z) / edge],
        "u_r": [float(v) for v in np.abs(response.u_r) / edge],
    }


def _paper_curves(variant: EstimateInput, radius: float, r: np.ndarray) -> dict[str, Any]:
    """Return equation 3b's factors for the skin, over their value at the edge: |J0(kr)| and the exponential."""
    skin = variant.tissue[0]
    omega = 2.0 * np.pi * variant.frequency.middle
    speed = float(np.sqrt(skin.shear_modulus.middle / skin.density))
    tan_delta = skin.damping.middle
    if skin.damping_law == "kelvin_voigt":
        tan_delta = omega * skin.damping.middle / skin.shear_modulus.middle
    elif skin.damping_law is None:
        tan_delta = 0.0
    bessel = np.abs(special.j0(omega / speed * r))
    rate = omega * tan_delta / speed
    return {
        "what": "the print's J0(kr) exp(-omega eta r/(E c_s)) with the skin's values; it has no integral over k",
        "k_per_m": omega / speed,
        "j0": [float(v) for v in bessel / bessel[0]] if bessel[0] > 1e-3 else None,
        "exponential": {
            "loss_modulus": [float(v) for v in np.exp(-rate * (r - radius))],
            "kelvin_voigt": [float(v) for v in np.exp(-rate / 2.0 * (r - radius))],
        },
        "readings_of_eta": {name: cf.READINGS[name] for name in ("loss_modulus", "kelvin_voigt")},
    }

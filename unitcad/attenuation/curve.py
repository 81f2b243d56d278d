"""The layered half-space's curve: how the skin's motion decays from the unit's edge outwards, and its spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace
from scipy import special

from unitcad.attenuation.crosstalk import contact
from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.sensitivities import sensitivities
from unitcad.attenuation.inputs import Drive, EstimateInput, Quantity, body
from unitcad.attenuation.layered.loads import Direction, UniformDisc
from unitcad.attenuation.layered.response import Response, responses

EDGE_TO_MM = 30
DEPTHS_MM = (1.0, 3.0)
NO_RATIO = (
    "a laterally uniform half-space has no ring of silicone in it: it can't say what the layers do, so multiplying "
    "its curve by another model's ratio would not be a model"
)
FORCES: dict[Drive, str] = {
    "flat": "turns in the plane of the skin: two forces in quadrature, alike at every angle",
    "axial": "acts along the motor's axis, into the skin",
}
"""How the force of each drive acts."""
WHAT_U_IS = (
    "|u|, the root of the sum of the squares of the components' amplitudes: the root mean square of the skin's "
    "motion over a turn, times sqrt(2)"
)
ASSUMPTIONS = [
    "A uniform traction on the motor's disc drives a laterally uniform body: a pressure from an axial drive, one that "
    "turns in the skin's plane from a flat one. Unit, circuit and cavity are not in it, nor the moment of a flat "
    "motor's force about the skin.",
    "The body's layers are a template from published ranges, not this person's arm nor the paper's phantom.",
]
FAR = (
    "Beyond 2 cm the curve on the skin falls faster than was measured on arms: on hand and forearm vibration keeps "
    "0.79 (0.70 to 0.88) of its amplitude every 20 mm at 40 to 60 Hz and 0.80 (0.68 to 0.92) at 75 to 100 Hz. Both "
    "bands fit one of 400 random bodies within the template's sources under a flat motor, and eight under an axial one."
)
_DIRECTIONS: dict[Drive, Direction] = {"flat": "tangential", "axial": "normal"}
_COMPONENTS = {"flat": ("u_r", "u_theta", "u_z"), "axial": ("u_r", "u_z")}
_DECAY_RTOL = 1e-3
_SLOPE_RTOL, _SLOPE_STEP = 1e-6, 0.01
"""They leave the slopes off by less than 1e-3."""
_NO_UNIT = "a laterally uniform body under the motor's disc: walls, caps, silicones, circuit and mass are not in it"


def layered_block(variant: EstimateInput, rtol: float = 1e-4) -> dict[str, Any]:
    """Return the estimate's `layered`: the skin's motion under either drive, over that at the edge, with its spread.

    `drives`: the motor's own first, each over |u| at the edge under the same force. `flat_over_axial_per_newton`: |u|
    by one newton that turns, over |u| by one newton of axial amplitude. `u_z`, `u_r`, `depths` and
    `surface_m_per_pa` are the axial pressure's, over |u_z| at the edge. `sensitivities`: of the decay to `EDGE_TO_MM`
    under the motor's drive. The spread takes each kind of input (moduli,
    damping, thicknesses, frequency) by itself to its low and high end; that of |u| has `crosstalk.CONTACT` in it.
    """
    r_mm = np.arange(EDGE_TO_MM + 1)
    radius = variant.diameter / 2.0
    r = radius + r_mm * 1e-3
    order: tuple[Drive, ...] = ("flat", "axial") if variant.drive == "flat" else ("axial", "flat")
    found = _responses(variant, order, r, [{}, *_ends(variant)], rtol)
    depths = [_responses(variant, order, r[::5], [{}], rtol, z * 1e-3) for z in DEPTHS_MM]
    below = {drive: [one[drive][0] for one in depths] for drive in order}
    axial = found["axial"][0]
    edge = abs(axial.u_z[0])
    old = [np.abs([one.u_z, one.u_r]) / abs(one.u_z[0]) for one in found["axial"]]
    ratio = [_size(flat) / _size(normal) for flat, normal in zip(found["flat"], found["axial"], strict=True)]
    return {
        "tissue": variant.tissue_name,
        "frequency_hz": variant.frequency.middle,
        "drive": variant.drive,
        "r_mm": [float(v) for v in r_mm],
        "r_is": "distance from the unit's edge outwards",
        "u_is": WHAT_U_IS,
        "drives": {drive: _drive_block(variant, drive, found[drive], below[drive]) for drive in order},
        "flat_over_axial_per_newton": _curve(ratio),
        "unit": "of |u_z| of the skin at the edge",
        "u_z": _curve([one[0] for one in old]),
        "u_r": _curve([one[1] for one in old]),
        "spread": "each kind of input (moduli, damping, thicknesses, frequency) by itself at both ends of its range; "
        "of |u| also what a unit on the skin changes, bonded or resting, by finite elements",
        **({"far": FAR} if variant.tissue_name == "forearm" else {}),
        "depths": [
            {"z_mm": z, "r_mm": [float(v) for v in r_mm[::5]], **{key: _over(one, key, edge) for key in ("u_z", "u_r")}}
            for z, one in zip(DEPTHS_MM, below["axial"], strict=True)
        ],
        "paper_beside": _paper_curves(variant, radius, r),
        "surface_m_per_pa": {"u_z_at_the_edge": float(edge)},
        "error_estimate": rounded_error(axial.error / edge),
        "wavenumbers": axial.wavenumbers,
        "sensitivities": _sensitivities(variant),
        "hierarchical_over_control": None,
        "hierarchical_over_control_reason": NO_RATIO,
        "assumptions": ASSUMPTIONS,
    }


def _sensitivities(variant: EstimateInput) -> dict[str, Any]:
    """Return d ln (|u| at `EDGE_TO_MM` over |u| at the edge) / d ln input under the motor's drive."""
    seen = sensitivities(variant, _decays, _SLOPE_STEP)
    return {
        "of": f"|u| of the skin {EDGE_TO_MM} mm from the unit's edge over |u| at the edge",
        "drive": variant.drive,
        "by": seen["by"],
        "nothing_else": _NO_UNIT,
    }


def _decays(variants: Sequence[EstimateInput]) -> list[float]:
    """Return |u| at `EDGE_TO_MM` over |u| at the edge of each variant under its motor's drive.

    Those of one disc are solved on one path, those of one body and frequency once.
    """
    by_disc: dict[tuple[float, Drive], list[EstimateInput]] = {}
    for one in variants:
        by_disc.setdefault((one.motor_diameter, one.drive), []).append(one)
    decays: dict[str, float] = {}
    for (disc, drive), some in by_disc.items():
        bodies = {_reads(one): (body(one.tissue), 2.0 * np.pi * one.frequency.middle) for one in some}
        edges = [*dict.fromkeys(one.diameter / 2.0 for one in some)]
        load = UniformDisc(disc / 2.0, _DIRECTIONS[drive])
        found = responses([*bodies.values()], [load], np.add.outer(edges, [0.0, 1e-3 * EDGE_TO_MM]), rtol=_SLOPE_RTOL)
        sizes = {key: _size(response) for key, (response,) in zip(bodies, found, strict=True)}
        for one in some:
            edge, far = sizes[_reads(one)][edges.index(one.diameter / 2.0)]
            decays[repr(one)] = float(far / edge)
    return [decays[repr(one)] for one in variants]


def _reads(variant: EstimateInput) -> str:
    """Return the part of a variant that sets its body and frequency."""
    return repr((variant.tissue, variant.frequency))


def decay_at(variant: EstimateInput, frequency: float, distances_mm: tuple[float, ...]) -> dict[str, list[float]]:
    """Return |u| under a `flat` and an `axial` drive and, `u`, the motor's; `u_z`: |u_z| under an axial one.

    Each over its value at the edge, at distances (mm) from the edge and one frequency (Hz), nominal body.
    """
    r = variant.diameter / 2.0 + 1e-3 * np.array([0.0, *distances_mm])
    found = _responses(replace(variant, frequency=Quantity(frequency)), ("flat", "axial"), r, [{}], _DECAY_RTOL)
    sizes = {drive: _size(one) for drive, (one,) in found.items()}
    parts = {"u": sizes[variant.drive], **sizes, "u_z": np.abs(found["axial"][0].u_z)}
    return {name: [float(v) for v in part[1:] / part[0]] for name, part in parts.items()}


def _responses(
    variant: EstimateInput,
    drives: Sequence[Drive],
    r: np.ndarray,
    ends: Sequence[dict[str, int]],
    rtol: float,
    z: float = 0.0,
) -> dict[Drive, list[Response]]:
    """Return the skin's displacement under one pascal of each drive on the motor's disc, for `ends` of `body`."""
    hertz = variant.frequency
    bodies = [
        (
            body(variant.tissue, end),
            2.0 * np.pi * (hertz.ends[end["frequency"]] if "frequency" in end else hertz.middle),
        )
        for end in ends
    ]
    loads = [UniformDisc(variant.motor_diameter / 2.0, _DIRECTIONS[drive]) for drive in drives]
    found = responses(bodies, loads, r, z=z, rtol=rtol)
    return {drive: [one[i] for one in found] for i, drive in enumerate(drives)}


def _size(one: Response) -> np.ndarray:
    """Return |u|: the root of the sum of the squares of the components' amplitudes."""
    return np.sqrt(np.abs(one.u_r) ** 2 + np.abs(one.u_theta) ** 2 + np.abs(one.u_z) ** 2)


def _drive_block(variant: EstimateInput, drive: Drive, found: list[Response], below: list[Response]) -> dict[str, Any]:
    """Return a drive's curves over |u| at the edge: nominal and spread at the surface, nominal at `DEPTHS_MM`."""
    edges = [_size(one)[0] for one in found]
    disc = np.pi * (variant.motor_diameter / 2.0) ** 2
    nominal = found[0]
    error = np.sqrt(nominal.error_r**2 + nominal.error_theta**2 + nominal.error_z**2)
    return {
        "force": FORCES[drive],
        "unit": "of |u| of the skin at the edge under the same force",
        "u": _with_contact(drive, _curve([_size(one) / edge for one, edge in zip(found, edges, strict=True)])),
        **{
            key: _curve([np.abs(getattr(one, key)) / edge for one, edge in zip(found, edges, strict=True)])
            for key in _COMPONENTS[drive]
        },
        "depths": [
            {"z_mm": z, "u": [float(v) for v in _size(one) / edges[0]]} for z, one in zip(DEPTHS_MM, below, strict=True)
        ],
        "m_per_n_at_the_edge": float(edges[0] / disc),
        "error_estimate": rounded_error(np.max(error) / edges[0]),
    }


def _with_contact(drive: Drive, curve: dict[str, list[float]]) -> dict[str, list[float]]:
    """Return a curve of |u| by mm from the edge whose spread includes the effect of a unit on the skin."""
    factors = contact(drive, np.arange(len(curve["value"])))
    ends = zip(("low", "high"), factors, strict=True)
    return {"value": curve["value"], **{name: (np.array(curve[name]) * own).tolist() for name, own in ends}}


def rounded_error(error: float) -> float:
    """Return an error to three digits: a difference of near-equal numbers has no more that all processors agree on."""
    return float(f"{error:.3g}")


def _over(one: Response, key: str, edge: float) -> list[float]:
    return [float(v) for v in np.abs(getattr(one, key)) / edge]


def _curve(cases: list[np.ndarray]) -> dict[str, list[float]]:
    """Return the first case as the value, and the least and the largest of all."""
    parts = ("value", cases[0]), ("low", np.min(cases, axis=0)), ("high", np.max(cases, axis=0))
    return {name: [float(v) for v in data] for name, data in parts}


def _ends(variant: EstimateInput) -> list[dict[str, int]]:
    kinds = ["moduli", "damping", "thicknesses"] + (
        ["frequency"] if variant.frequency.ends[0] < variant.frequency.ends[1] else []
    )
    return [{kind: end} for kind in kinds for end in (0, 1)]


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

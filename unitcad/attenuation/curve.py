"""The skin beyond a unit's edge by the layered half-space: the decay, its spread, and crosstalk to a neighbour."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.inputs import Drive, EstimateInput, Quantity, tissue_medium
from unitcad.attenuation.layered import LayeredMedium, Response, Told, components, unheard
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.lean_scipy import special

EDGE_TO_MM = 30
NO_RATIO = "the half-space contains no rings of silicone, so its curve does not depend on the layers"
FORCES: dict[Drive, str] = {
    "flat": "turns in the plane of the skin: two forces in quadrature, alike at every angle",
    "axial": "acts along the motor's axis, into the skin",
}
"""How the force of each drive acts."""
U_DEFINITION = (
    "|u|, the root of the sum of the squares of the components' amplitudes: the root mean square of the skin's "
    "motion over a turn, times sqrt(2)"
)
ASSUMPTIONS = [
    "A uniform traction on the motor's disc drives a laterally uniform tissue: an axial drive gives a pressure, a flat "
    "one a traction that turns in the skin's plane. Unit, circuit, cavity and the moment of a flat motor's force about "
    "the skin are not included.",
    "The tissue's layers are a template from published ranges, not a person's arm or the paper's phantom.",
]
FAR = (
    "Beyond 2 cm the curve on the skin falls faster than measurements on arms. On hand and forearm vibration keeps "
    "0.79 (0.70 to 0.88) of its amplitude every 20 mm at 40 to 60 Hz and 0.80 (0.68 to 0.92) at 75 to 100 Hz. "
    "One of 400 random tissues within the template's sources fits both bands under a flat motor, and eight under an "
    "axial one."
)
_COMPONENTS = {"flat": ("u_r", "u_theta", "u_z"), "axial": ("u_r", "u_z")}
RANGE = (
    "moduli, damping and thicknesses of the tissue, and the frequency, at both ends of their ranges, one kind at a "
    "time; and the effect of a unit on the skin, bonded or resting, by finite elements"
)
CONTACT_MM = (0.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
CONTACT: dict[Drive, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "flat": ((1.0, 0.82, 0.66, 0.48, 0.34, 0.23, 0.19, 0.14), (1.0,) * 8),
    "axial": ((1.0, 0.83, 0.84, 0.9, 0.9, 0.9, 0.9, 0.9), (1.0, 1.0, 1.05, 1.47, 1.5, 1.5, 1.58, 2.14)),
}
"""Factors between |u| over that at the edge and bare skin's, least and largest, at `CONTACT_MM` from the edge.

Finite elements of the paper's two designs with four pairs of silicones each, skin that sticks to the unit or lets it
slide, 100 to 150 Hz, against the layered solver (`python -m benchmarks.accuracy skin` makes them again).
"""
_RTOL = 1e-3


def crosstalk_ratio(variant: EstimateInput, pitch: float, spread: bool = True) -> Quantity:
    """Return |u| of the bare skin at `pitch` (m) from the unit's middle over |u| at its edge, under its motor's drive.

    The layered half-space's own decay. low and high: `RANGE`, without `spread` none. Raises `Refusal` for values that
    no tissue has.
    """

    def ratio(end: dict[str, int]) -> float:
        return float(decay(variant, np.array([pitch]), end=end)[0])

    value = ratio({})
    if not spread:
        return Quantity(value)
    every = [value, *(ratio(end) for end in ends(variant))]
    low, high = (float(factor) for factor in contact(variant.drive, 1e3 * (pitch - variant.diameter / 2.0)))
    return Quantity(value, low * min(every), high * max(every))


def contact(drive: Drive, mm: float | np.ndarray) -> tuple[Any, Any]:
    """Return the least and the largest factor of `CONTACT` at distances from a unit's edge, mm; 1 inside it."""
    low, high = (np.interp(mm, CONTACT_MM, factors) for factors in CONTACT[drive])
    return low, high


def ends(variant: EstimateInput) -> list[dict[str, int]]:
    """Return the inputs that `RANGE` names, each kind at its low and its high end, as `decay` takes it."""
    ranged = variant.frequency.ends[0] < variant.frequency.ends[1]
    kinds = ["moduli", "damping", "thicknesses", *(["frequency"] if ranged else [])]
    return [{kind: end} for kind in kinds for end in (0, 1)]


def decay(
    variant: EstimateInput,
    radii: np.ndarray,
    drive: Drive | None = None,
    hertz: float | None = None,
    end: Mapping[str, int] | None = None,
    short: Told = unheard,
) -> np.ndarray:
    """Return the bare skin's |u| (`U_DEFINITION`) at `radii` (m, any shape) from a unit's middle, over that at its edge.

    `drive`, `hertz`: default: those of the motor and the unit. Otherwise as `motion`.
    """
    if hertz is not None:
        variant = replace(variant, frequency=Quantity(hertz))
    return np.linalg.norm(motion(variant, radii, drive, end, short), axis=0)


def motion(
    variant: EstimateInput,
    radii: np.ndarray,
    drive: Drive | None = None,
    end: Mapping[str, int] | None = None,
    short: Told = unheard,
) -> np.ndarray:
    """Return the bare skin's u_r, u_theta and u_z (complex) over |u| at the unit's edge, shape (3, *radii.shape).

    `radii`: m, any shape, inside the edge too. `end`: as in `inputs.tissue_medium`, or "frequency". One response serves
    all radii. A flat motor's force turns: its point at theta moves by e^(-i theta) (u_r, i u_theta, u_z). `short`
    gets the shortfall of a response. Raises `Refusal` for values that no tissue has.
    """
    wanted = np.asarray(radii, dtype=float)
    medium, load, omega = case(variant, drive or variant.drive, end or {})
    found = components(medium, load, omega, np.append(wanted.ravel(), variant.diameter / 2.0), _RTOL, short)
    return (found[:, :-1] / np.linalg.norm(found[:, -1])).reshape(3, *wanted.shape)


def in_axes(found: np.ndarray, angle: np.ndarray, drive: Drive) -> np.ndarray:
    """Return u_r, u_theta and u_z (3, k) at angles (rad, (k,)) as the motion in x, y and z, shape (k, 3).

    A flat motor's force turns: its phase is that of the angle, and u_theta is a quarter turn ahead.
    """
    out, around, up = found
    if drive == "flat":
        out, around, up = np.exp(-1j * angle) * np.array([out, 1j * around, up])
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([out * cos - around * sin, out * sin + around * cos, up], axis=-1)


def case(variant: EstimateInput, drive: Drive, end: Mapping[str, int]) -> tuple[LayeredMedium, UniformDisc, float]:
    """Return the medium, the load and omega of a drive; `end` as `decay` takes it."""
    frequency = variant.frequency
    hertz = frequency.ends[end["frequency"]] if "frequency" in end else frequency.middle
    load = UniformDisc(variant.motor_diameter / 2.0, "tangential" if drive == "flat" else "normal")
    return tissue_medium(variant.tissue, end), load, 2.0 * np.pi * hertz


def layered_block(variant: EstimateInput, rtol: float = 1e-4) -> dict[str, Any]:
    """Return the estimate's `layered`: the skin's motion under either drive, over that at the edge, with its spread.

    `drives`: the motor's own first, each over |u| at the edge under the same force. `flat_over_axial_per_newton`: |u|
    by one newton that turns, over |u| by one newton of axial amplitude. `not_reached`: the responses that miss `rtol`,
    with the error that each reached. The spread takes each kind of input (moduli,
    damping, thicknesses, frequency) by itself to its low and high end; that of |u| has `CONTACT` in it.
    """

    def response(drive: Drive, end: Mapping[str, int]) -> Response:
        medium, load, omega = case(variant, drive, end)
        return medium.response(load, omega, r, rtol=rtol)

    r_mm = np.arange(EDGE_TO_MM + 1)
    r = variant.diameter / 2.0 + r_mm * 1e-3
    order: tuple[Drive, ...] = ("flat", "axial") if variant.drive == "flat" else ("axial", "flat")
    cases = [{}, *ends(variant)]
    found = {drive: [response(drive, end) for end in cases] for drive in order}
    ratio = [_size(flat) / _size(normal) for flat, normal in zip(found["flat"], found["axial"], strict=True)]
    names = ["nominal", *(f"{kind} at the {('low', 'high')[at]} end" for end in cases for kind, at in end.items())]
    short = [
        f"{drive} drive, {name}: {one.shortfall}"
        for drive in order
        for name, one in zip(names, found[drive], strict=True)
        if not one.reached
    ]
    return {
        "tissue": variant.tissue_name,
        "frequency_hz": variant.frequency.middle,
        "drive": variant.drive,
        "r_mm": [float(v) for v in r_mm],
        "u_definition": U_DEFINITION,
        "rtol": rtol,
        "not_reached": short,
        "drives": {drive: _drive_block(variant, drive, found[drive]) for drive in order},
        "flat_over_axial_per_newton": _curve(ratio),
        "spread": "each kind of input (moduli, damping, thicknesses, frequency) by itself at both ends of its range; "
        "|u| also includes the effect of a unit on the skin, bonded or resting, by finite elements",
        **({"far": FAR} if variant.tissue_name == "forearm" else {}),
        "published_curves": _paper_curves(variant, r),
        "hierarchical_over_control": None,
        "hierarchical_over_control_reason": NO_RATIO,
        "assumptions": ASSUMPTIONS,
    }


def _size(one: Response) -> np.ndarray:
    """Return |u|: the root of the sum of the squares of the components' amplitudes."""
    return np.sqrt(np.abs(one.u_r) ** 2 + np.abs(one.u_theta) ** 2 + np.abs(one.u_z) ** 2)


def _drive_block(variant: EstimateInput, drive: Drive, found: list[Response]) -> dict[str, Any]:
    """Return a drive's curves over |u| at the edge, nominal and spread."""
    edges = [_size(one)[0] for one in found]
    nominal = found[0]
    error = np.sqrt(nominal.error_r**2 + nominal.error_theta**2 + nominal.error_z**2)
    u = _curve([_size(one) / edge for one, edge in zip(found, edges, strict=True)])
    factors = contact(drive, np.arange(EDGE_TO_MM + 1))
    for name, own in zip(("low", "high"), factors, strict=True):
        u[name] = (np.array(u[name]) * own).tolist()
    return {
        "force": FORCES[drive],
        "unit": "of |u| of the skin at the edge under the same force",
        "u": u,
        **{
            key: _curve([np.abs(getattr(one, key)) / edge for one, edge in zip(found, edges, strict=True)])
            for key in _COMPONENTS[drive]
        },
        "m_per_n_at_the_edge": float(edges[0] / (np.pi * (variant.motor_diameter / 2.0) ** 2)),
        "error_estimate": rounded_error(np.max(error) / edges[0]),
    }


def rounded_error(error: float) -> float:
    """Return an error to three digits: a difference of near-equal numbers has no more that all processors agree on."""
    return float(f"{error:.3g}")


def _curve(cases: list[np.ndarray]) -> dict[str, list[float]]:
    """Return the first case as the value, and the least and the largest of all."""
    parts = ("value", cases[0]), ("low", np.min(cases, axis=0)), ("high", np.max(cases, axis=0))
    return {name: [float(v) for v in data] for name, data in parts}


def _paper_curves(variant: EstimateInput, r: np.ndarray) -> dict[str, Any]:
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
        "note": "the print's J0(kr) exp(-omega eta r/(E c_s)) with the skin's values; it has no integral over k",
        "j0": [float(v) for v in bessel / bessel[0]] if bessel[0] > 1e-3 else None,
        "exponential": {
            "loss_modulus": [float(v) for v in np.exp(-rate * (r - r[0]))],
            "kelvin_voigt": [float(v) for v in np.exp(-rate / 2.0 * (r - r[0]))],
        },
    }

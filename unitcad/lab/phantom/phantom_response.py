"""What a phantom's surface should do under the motor: decay from the unit's edge, its sensitivity, the wall's echo.

The layers on the plate are a laterally infinite stack, the plate a half-space of acrylic; a uniform pressure on the
motor's disc drives it. u is |u_z|. A wall at the distance L from the unit's centre is a mirror here, which sends back
all: at the radius r towards it that wave has gone 2 L - r, so the echo is |u(2 L - r)| / |u(r)|.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.inputs import TissueLayer, body
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.attenuation.layered.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered.rheology import LossFactor
from unitcad.lab.phantom.description import PhantomTable
from unitcad.lab.phantom.recipe import Recipe

ACRYLIC = {"density_kg_m3": 1190.0, "youngs_modulus_kpa": 3e6, "poisson_ratio": 0.37, "loss_factor": 0.05}
"""Cast acrylic at room temperature (secondary: data sheets)."""
POISSON = 0.4999
THINNER_MM = 0.1
FARTHEST_MM = 125.0
"""Walls farther from the unit are not looked at: no shipped printer makes such a box."""
_RTOL = 1e-4


@dataclass(frozen=True)
class Expected:
    """The response: |u_z| over its value at the unit's edge at distances (mm) from it, and where it comes from.

    `low`, `high`: each kind of input by itself at both ends. `sensitivity`: relative change at the farthest point for a
    layer thinner by `THINNER_MM`. `wall_mm`: least distance of a wall from the unit's centre for the asked echo;
    `echo_pct`: at the wall as it is, `soft_echo_pct`: there with the least loss factors. `forearm`: the body template's
    curve, `factor` the mean factor between the two.
    """

    distances_mm: tuple[float, ...]
    value: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    sensitivity: Mapping[str, float]
    wall_mm: float
    echo_pct: float
    soft_echo_pct: float
    forearm: tuple[float, ...]
    factor: float
    error: float


def medium(phantom: PhantomTable, recipes: Sequence[Recipe], **changed: Sequence[float]) -> LayeredMedium:
    """Return the stack; `changed` overrides thickness (mm), modulus (kPa) or loss factor, a value each layer."""
    rows = zip(
        changed.get("thickness", [layer.thickness_mm for layer in phantom.layers]),
        changed.get("modulus", [one.modulus_kpa for one in recipes]),
        changed.get("loss", [one.loss[0] for one in recipes]),
        recipes,
        strict=True,
    )
    layers = [
        Layer(thickness * 1e-3, one.density_g_cm3 * 1e3, modulus * 1e3, POISSON, LossFactor(loss))
        for thickness, modulus, loss, one in rows
    ]
    base = HalfSpace(
        ACRYLIC["density_kg_m3"],
        ACRYLIC["youngs_modulus_kpa"] * 1e3,
        ACRYLIC["poisson_ratio"],
        LossFactor(ACRYLIC["loss_factor"]),
    )
    return LayeredMedium(layers, base)


def wall_distance(phantom: PhantomTable, recipes: Sequence[Recipe]) -> float:
    """Return the least distance (mm) of a wall from the unit's centre that keeps the echo at the farthest point small.

    Beyond it no wall up to `FARTHEST_MM` echoes more. Infinite where that is not far enough.
    """
    at = phantom.unit_diameter_mm / 2 + max(phantom.points_mm)
    walls = np.arange(at + 1.0, FARTHEST_MM, 0.25)
    loud = _echo(phantom, medium(phantom, recipes), at, walls) > phantom.most_echo_pct / 100
    if loud[-1]:
        return math.inf
    return float(walls[np.flatnonzero(loud)[-1] + 1]) if loud.any() else float(walls[0])


def echo_pct(phantom: PhantomTable, recipes: Sequence[Recipe], wall_mm: float, **changed: Sequence[float]) -> float:
    """Return the echo at the farthest point from a wall at a distance (mm) from the unit's centre, percent.

    `changed` as in `medium`.
    """
    at = phantom.unit_diameter_mm / 2 + max(phantom.points_mm)
    return 100 * float(_echo(phantom, medium(phantom, recipes, **changed), at, np.array([wall_mm]))[0])


def _echo(phantom: PhantomTable, stack: LayeredMedium, at: float, walls: np.ndarray) -> np.ndarray:
    u = _size(phantom, stack, np.concatenate([[at], 2 * walls - at]))[0]
    return u[1:] / u[0]


def expected(
    phantom: PhantomTable,
    recipes: Sequence[Recipe],
    wall_mm: float,
    least_wall_mm: float,
    forearm: tuple[TissueLayer, ...],
) -> Expected:
    """Work out the response at the phantom's points; `wall_mm` is the box's, `least_wall_mm` of `wall_distance`."""
    distances = np.array(sorted(phantom.points_mm))
    r = phantom.unit_diameter_mm / 2 + np.concatenate([[0.0], distances])

    def curve(stack: LayeredMedium) -> np.ndarray:
        u = _size(phantom, stack, r)[0]
        return u[1:] / u[0]

    nominal = medium(phantom, recipes)
    u, error = _size(phantom, nominal, r)
    value = u[1:] / u[0]
    losses = [[one.loss[end] for one in recipes] for end in (1, 2)]
    cases = [
        *(curve(medium(phantom, recipes, loss=loss)) for loss in losses),
        curve(medium(phantom, recipes, modulus=[one.low_kpa for one in recipes])),
        curve(medium(phantom, recipes, modulus=[one.high_kpa for one in recipes])),
    ]
    sensitivity = {}
    for i, layer in enumerate(phantom.layers):
        thickness = [one.thickness_mm - (THINNER_MM if j == i else 0.0) for j, one in enumerate(phantom.layers)]
        thinner = curve(medium(phantom, recipes, thickness=thickness))
        sensitivity[layer.name] = float(thinner[-1] / value[-1] - 1)
        cases.append(thinner)
    arm = curve(body(forearm))
    beyond = distances > 0
    factor = math.exp(float(np.mean(np.abs(np.log(value[beyond] / arm[beyond])))))
    return Expected(
        tuple(distances.tolist()),
        tuple(value.tolist()),
        tuple(np.min([value, *cases], axis=0).tolist()),
        tuple(np.max([value, *cases], axis=0).tolist()),
        sensitivity,
        least_wall_mm,
        echo_pct(phantom, recipes, wall_mm),
        echo_pct(phantom, recipes, wall_mm, loss=losses[0]),
        tuple(arm.tolist()),
        factor,
        float(error / u[-1]),
    )


def _size(phantom: PhantomTable, stack: LayeredMedium, r_mm: np.ndarray) -> tuple[np.ndarray, float]:
    load = UniformDisc(phantom.motor_diameter_mm / 2e3)
    response = stack.response(load, 2 * math.pi * phantom.frequency_hz, r_mm * 1e-3, rtol=_RTOL)
    return np.abs(response.u_z), float(np.max(response.error_z))

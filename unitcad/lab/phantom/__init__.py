"""A skin phantom that any lab can cast: description, recipes, box, expected response, each made once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.attenuation.curve import rounded_error
from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.inputs import TissueLayer, body
from unitcad.attenuation.layered import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
from unitcad.catalogue import Printer, choose, printers, tissue
from unitcad.errors import Refusal
from unitcad.estimate_inputs import tissue_layer
from unitcad.kernels.mesh import bounds, realise
from unitcad.lab.phantom.box import BoxLengths, cast, expect_apart, lengths, pieces
from unitcad.lab.phantom.recipe import PhantomTable, Recipe, recipe, stiffening
from unitcad.shape.body import Body
from unitcad.text import some

ACRYLIC = {"density_kg_m3": 1190.0, "youngs_modulus_kpa": 3e6, "poisson_ratio": 0.37, "loss_factor": 0.05}
"""Cast acrylic at room temperature (secondary: data sheets)."""
POISSON = 0.4999
THINNER_MM = 0.1
FARTHEST_MM = 125.0
"""Walls farther from the unit are not looked at: no shipped printer makes such a box."""
_RTOL, _DECIMALS = 1e-4, 6


@dataclass(frozen=True)
class Expected:
    """The response: |u_z| over its value at the unit's edge at distances (mm) from it, and its source.

    `low`, `high`: each kind of input by itself at both ends. `sensitivity`: relative change at the farthest point for a
    layer thinner by `THINNER_MM`. `wall_mm`: least distance of a wall from the unit's centre for the asked echo;
    `echo_pct`: at the actual wall, `soft_echo_pct`: there with the least loss factors. `forearm`: the body template's
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
    usual = {
        "thickness": [layer.thickness_mm for layer in phantom.layers],
        "modulus": [one.modulus_kpa for one in recipes],
        "loss": [one.loss[0] for one in recipes],
    }
    layers = [
        Layer(thickness * 1e-3, one.density_g_cm3 * 1e3, modulus * 1e3, POISSON, LossFactor(loss))
        for thickness, modulus, loss, one in zip(*(usual | changed).values(), recipes, strict=True)
    ]
    density, modulus, poisson, loss = ACRYLIC.values()
    return LayeredMedium(layers, HalfSpace(density, modulus * 1e3, poisson, LossFactor(loss)))


def _farthest(phantom: PhantomTable) -> float:
    return phantom.unit_diameter_mm / 2 + max(phantom.points_mm)


def wall_distance(phantom: PhantomTable, recipes: Sequence[Recipe]) -> float:
    """Return the least distance (mm) of a wall from the unit's centre that keeps the echo at the farthest point small.

    Beyond it no wall up to `FARTHEST_MM` echoes more. Infinite if that is not far enough.
    """
    walls = np.arange(_farthest(phantom) + 1.0, FARTHEST_MM, 0.25)
    loud = np.flatnonzero(_echo(phantom, medium(phantom, recipes), walls) > phantom.most_echo_pct / 100)
    at = loud[-1] + 1 if len(loud) else 0
    return float(walls[at]) if at < len(walls) else math.inf


def echo_pct(phantom: PhantomTable, recipes: Sequence[Recipe], wall_mm: float, **changed: Sequence[float]) -> float:
    """Return the echo at the farthest point from a wall at a distance (mm) from the unit's centre, percent.

    `changed` as in `medium`.
    """
    return 100 * float(_echo(phantom, medium(phantom, recipes, **changed), np.array([wall_mm]))[0])


def _echo(phantom: PhantomTable, stack: LayeredMedium, walls: np.ndarray) -> np.ndarray:
    at = _farthest(phantom)
    return _curve(phantom, stack, np.concatenate([[at], 2 * walls - at]))[0]


def _curve(phantom: PhantomTable, stack: LayeredMedium, r_mm: np.ndarray) -> tuple[np.ndarray, float]:
    """Return |u_z| at radii over that at the first one, and the last one's relative error."""
    load = UniformDisc(phantom.motor_diameter_mm / 2e3)
    response = stack.response(load, 2 * math.pi * phantom.frequency_hz, r_mm * 1e-3, rtol=_RTOL)
    u = np.abs(response.u_z)
    return u[1:] / u[0], rounded_error(np.max(response.error_z) / u[-1])


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

    def curve(**changed: Sequence[float]) -> np.ndarray:
        return _curve(phantom, medium(phantom, recipes, **changed), r)[0]

    value, error = _curve(phantom, medium(phantom, recipes), r)
    losses = [[one.loss[end] for one in recipes] for end in (1, 2)]
    cases = [value, *(curve(loss=loss) for loss in losses)]
    cases += [curve(modulus=[one.low_kpa for one in recipes]), curve(modulus=[one.high_kpa for one in recipes])]
    sensitivity = {}
    for i, layer in enumerate(phantom.layers):
        thickness = [one.thickness_mm - (THINNER_MM if j == i else 0.0) for j, one in enumerate(phantom.layers)]
        cases.append(curve(thickness=thickness))
        sensitivity[layer.name] = round(float(cases[-1][-1] / value[-1] - 1), _DECIMALS)
    arm, beyond = _curve(phantom, body(forearm), r)[0], distances > 0
    factor = math.exp(float(np.mean(np.abs(np.log(value[beyond] / arm[beyond])))))
    value, low, high, arm = (tuple(one.tolist()) for one in (value, np.min(cases, 0), np.max(cases, 0), arm))
    echoes = echo_pct(phantom, recipes, wall_mm), echo_pct(phantom, recipes, wall_mm, loss=losses[0])
    return Expected(
        tuple(distances.tolist()), value, low, high, sensitivity, least_wall_mm, *echoes, arm, factor, error
    )


SEGMENTS = 96
_STEP_MM = 5.0
LONGEST_SOURCE = 500
"""Characters of a source in a spec."""


@dataclass(frozen=True)
class PhantomSet:
    """A phantom ready to be written.

    `volumes_mm3`: of each layer, skin first.
    """

    table: PhantomTable
    recipes: tuple[Recipe, ...]
    printer: Printer
    inside_mm: float
    size: BoxLengths
    tools: tuple[Body, ...]
    layers: tuple[Body, ...]
    volumes_mm3: tuple[float, ...]
    expected: Expected


def phantom_set(table: PhantomTable) -> PhantomSet:
    """Work out a phantom; its response is compared with that of the catalogue's forearm.

    Raises Refusal for walls that echo too much, for layers that nobody tested, and for pieces beyond the bed.
    """
    recipes = tuple(recipe(one, table.frequency_hz, f"layers.{i}") for i, one in enumerate(table.layers))
    if len({layer.name for layer in table.layers}) < len(table.layers):
        raise Refusal("layers", some(layer.name for layer in table.layers), "each layer needs a name of its own")
    expect_apart(table.points_mm)
    printer = choose("printer", table.printer, printers())
    wall, farthest = wall_distance(table, recipes), f"at {max(table.points_mm):g} mm"
    if math.isinf(wall):
        limit = f"no wall is far enough for an echo below {table.most_echo_pct:g} % {farthest}"
        raise Refusal("most_echo_pct", table.most_echo_pct, limit)
    needed = _STEP_MM * math.ceil(2 * wall / _STEP_MM)
    inside = table.inside_mm or needed
    if inside < 2 * wall:
        limit = (
            f"the walls' echo is {echo_pct(table, recipes, inside / 2):.3g} % {farthest}; for "
            f"{table.most_echo_pct:g} % they must be {wall:g} mm from the unit's centre"
        )
        raise Refusal("inside_mm", inside, limit, needed)
    size = lengths(table, inside, printer)
    tools = tuple(pieces(table, size, printer))
    for piece in printed(tools):
        x0, y0, z0, x1, y1, z1 = bounds(realise(piece.shape, SEGMENTS))
        long, short = max(x1 - x0, y1 - y0), min(x1 - x0, y1 - y0)
        bed = _bed(printer)
        if short <= bed[0] and long <= bed[1] and z1 - z0 <= bed[2]:
            continue
        fitting = [
            name
            for name, one in printers().items()
            if short <= _bed(one)[0] and long <= _bed(one)[1] and z1 - z0 <= _bed(one)[2]
        ]
        over = max(short - bed[0], long - bed[1], 0.0)
        left = inside - over
        limit = f"the {piece.name} is {long:.0f} x {short:.0f} x {z1 - z0:.0f} mm, the bed {bed[1]:g} x {bed[0]:g}"
        if over and left > 40:
            echo = echo_pct(table, recipes, left / 2)
            limit += f"; about {left:.0f} mm inside would fit, whose walls echo {echo:.2g} %"
        raise Refusal("printer", printer.name, limit, fitting[0] if fitting else None)
    layers = tuple(cast(table, size))
    volumes = tuple(float(realise(body.shape, SEGMENTS).volume()) for body in layers)
    response = expected(table, recipes, inside / 2, wall, tuple(map(tissue_layer, tissue())))
    return PhantomSet(table, recipes, printer, inside, size, tools, layers, volumes, response)


def _bed(printer: Printer) -> tuple[float, float, float]:
    """Return the bed's shorter and longer side, and the height above it."""
    short, long = sorted((float(printer.bed_x_mm), float(printer.bed_y_mm)))
    return short, long, float(printer.bed_z_mm)


def tissue_table(phantom: PhantomSet) -> dict[str, dict[str, object]]:
    """Return the layers of [tissue.NAME] of a spec, skin first, the plate last."""
    found: dict[str, dict[str, object]] = {}
    hertz = phantom.table.frequency_hz
    also = f"; high: also times {stiffening(hertz):.3g}, which {hertz:g} Hz may add (assumed)"

    def ranged(value: float, low: float, high: float) -> dict[str, Any]:
        return rounded({"value": value, "low": low, "high": high}, 4)

    for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True):
        source = f"{one.silicone.name} + {one.thinner_pct:g} % thinner, {one.source}"
        found[layer.name] = {
            "status": "secondary",
            "source": source[: LONGEST_SOURCE - len(also)] + also,
            "thickness_mm": layer.thickness_mm,
            "density_kg_m3": rounded(1e3 * one.density_g_cm3, 4),
            "youngs_modulus_kpa": ranged(one.modulus_kpa, one.low_kpa, one.high_kpa),
            "poisson_ratio": {"value": POISSON, "status": "assumed", "source": "silicone hardly changes its volume"},
            "loss_factor": {
                **ranged(*one.loss),
                "status": "assumed",
                "source": "tan delta of soft silicones at 100 to 150 Hz",
            },
        }
    found["plate"] = {"status": "secondary", "source": "cast acrylic, data sheets", **ACRYLIC}
    return found


def printed(tools: Sequence[Body]) -> list[Body]:
    """Return the pieces that a printer makes."""
    return [body for body in tools if body.made == "printed"]

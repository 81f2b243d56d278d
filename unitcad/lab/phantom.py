"""A skin phantom that any lab can cast: description, recipes, box, expected response, each made once."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta, Struct

from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import FractionalKelvinVoigt, HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
from unitcad.catalogue import Material, Printer, choose, materials, printers, tissue
from unitcad.catalogue import entries as kinds
from unitcad.catalogue.entries import between
from unitcad.designs import layer_colour
from unitcad.documents import parse_toml
from unitcad.errors import Refusal, unknown_name
from unitcad.estimate_inputs import tissue_layer
from unitcad.json_text import rounded
from unitcad.kernels.mesh import bounds, realise
from unitcad.moulds.pieces import bar
from unitcad.shape import Extrude, Profile, Shape, box, cut, cylinder, moved, rectangle, turned, union
from unitcad.shape.tree import Body
from unitcad.spec import convert
from unitcad.text import some
from unitcad.validation.load import load_file

LEAST_LAYER = 0.5
_LAYER_NAME = "small letters a to z, digits and -, the first a letter"
_NAME = "small letters a to z, digits and -, the first a letter or digit"


class PhantomLayer(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One layer of the phantom, from the skin down."""

    removed: ClassVar = {
        "loss_factor": "the loss factor of silicone with thinner is an assumed range; leave it out",
        "measured": "a layer takes a tested silicone and its share of thinner",
    }
    name: Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description=_LAYER_NAME)]
    silicone: Annotated[str, Meta(description="tested silicone: ecoflex-00-10, ecoflex-00-30 or ecoflex-00-50")]
    thinner_pct: Annotated[float, between(0, 100, "thinner, in parts by weight to 100 of A and B")]
    thickness_mm: Annotated[float, between(LEAST_LAYER, 60, "thickness of the layer")]


class PhantomTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A skin phantom: one box of silicone layers."""

    removed: ClassVar = {
        "inside_mm": "most_echo_pct",
        "coupons": "the phantom has none; leave it out",
        **dict.fromkeys(("stage_bolt_mm", "stage_pitch_mm"), "the tray is clamped at its ears; leave it out"),
        **dict.fromkeys(("room_c", "scale_resolution_g"), "the recipe names its assumptions; leave it out"),
    }
    name: Annotated[str, Meta(min_length=1, max_length=60, pattern=r"^[a-z0-9][a-z0-9-]*$", description=_NAME)]
    layers: Annotated[tuple[PhantomLayer, ...], Meta(min_length=1, max_length=6)]
    unit_diameter_mm: Annotated[float, between(4, 40, "diameter of the unit to measure")] = 14.0
    motor_diameter_mm: Annotated[float, between(2, 40, "diameter of its motor")] = 7.0
    frequency_hz: kinds.Frequency = 125.0
    points_mm: Annotated[
        tuple[Annotated[float, between(0, 60)], ...],
        Meta(min_length=2, max_length=13, description="distances of the measuring points from the unit's edge"),
    ] = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
    most_echo_pct: Annotated[float, between(0.5, 50, "largest echo of the walls at the last point, percent")] = 5.0
    plate_thickness_mm: Annotated[float, between(2, 20, "thickness of the acrylic plate below")] = 5.0
    printer: Annotated[str, Meta(description="printer of the catalogue")] = "fdm-0.4"
    waste: Annotated[float, between(0, 2, "extra mix, as a fraction")] = 0.1


def load_phantom(source: str | os.PathLike[str]) -> PhantomTable:
    """Return the phantom of a shipped name or of a file. Raises Refusal or UnitcadError for an invalid one."""
    return load_file(source, "phantom", lambda data, _: convert(data, PhantomTable))


THINNER_DENSITY = 0.97
"""g/cm3 (assumed: a silicone oil)."""
LOSS_FACTOR = (0.2, 0.1, 0.3)
"""Tan delta of a silicone with thinner, and its range (assumed)."""


@cache
def thinned() -> dict[str, Any]:
    """Return the moduli of silicones with thinner by silicone, and their `source`."""
    return parse_toml((resources.files("unitcad.catalogue") / "thinned.toml").read_text("utf-8"), "thinned.toml")


@dataclass(frozen=True)
class Recipe:
    """A silicone with thinner: Young's modulus kPa and its range, density g/cm3.

    The modulus is the table's, its range two standard deviations. `high_kpa` includes the stiffening at the frequency.
    """

    silicone: Material
    modulus_kpa: float
    low_kpa: float
    high_kpa: float
    density_g_cm3: float


def recipe(layer: PhantomLayer, frequency_hz: float, field: str) -> Recipe:
    """Return a layer's recipe for a phantom that moves at a frequency; `field` is for refusals.

    Raises Refusal for a silicone or a share of thinner that nobody tested.
    """
    value, low, high = modulus_by_table(layer.silicone, layer.thinner_pct, field)
    material = materials()[layer.silicone]
    volume = 100.0 / float(material.density_g_cm3) + layer.thinner_pct / THINNER_DENSITY
    density = (100.0 + layer.thinner_pct) / volume
    return Recipe(material, value, low, stiffening(frequency_hz) * high, density)


def modulus_by_table(silicone: str, thinner_pct: float, field: str) -> tuple[float, float, float]:
    """Return the modulus, kPa, of a silicone with parts of thinner to 100 of A and B, with two standard deviations.

    Between two tested shares the logarithm of the modulus is interpolated. Raises Refusal for a silicone that was not
    tested, and for a share outside the tested ones.
    """
    known = {name: table for name, table in thinned().items() if isinstance(table, dict)}
    if silicone not in known:
        raise unknown_name(f"{field}.silicone", silicone, known)
    shares, moduli, deviations = (
        np.array(known[silicone][key]) for key in ("thinner_pct", "modulus_kpa", "deviation_kpa")
    )
    if not shares[0] <= thinner_pct <= shares[-1]:
        limit = f"was tested from {shares[0]:g} to {shares[-1]:g} parts of thinner to 100"
        raise Refusal(f"{field}.thinner_pct", thinner_pct, limit, float(np.clip(thinner_pct, shares[0], shares[-1])))
    modulus = math.exp(float(np.interp(thinner_pct, shares, np.log(moduli))))
    spread = 2.0 * float(np.interp(thinner_pct, shares, deviations / moduli))
    return modulus, modulus * (1 - spread), modulus * (1 + spread)


def stiffening(frequency_hz: float) -> float:
    """Return how much stiffer silicone may be at a frequency than at rest: the catalogue's fractional law of Ecoflex.

    The law is assumed to be valid with thinner; the moduli of the table were measured slowly.
    """
    material = materials()["ecoflex-00-30"]
    assert material.fractional_tau_us
    assert material.fractional_n
    law = FractionalKelvinVoigt(float(material.fractional_tau_us) * 1e-6, float(material.fractional_n))
    return abs(law.complex_shear(1.0, 2.0 * math.pi * frequency_hz))


POINT_RADIUS = 1.25
LEAST_APART = 2 * POINT_RADIUS + 1.0
"""Between two points, mm: the holes of nearer ones would leave no wall."""


WALL, FLOOR, LID = 4.0, 3.0, 4.0
"""Walls around the cavity at its rim, the tray's floor, thickness of the lid, mm."""
DRAFT_DEG = 1.0
EAR, EAR_HALF, EAR_AT = 14.0, 9.0, 0.65
"""Length of an ear, its half width, and its middle as a part of the half side, mm."""
PEG_RADIUS, PEG_FROM_WALL = 3.0, 8.0
PUSH_RADIUS = 8.0
PLATE_PLAY = 0.3
"""Of the plate in the tray, per side, mm."""
_COLOURS = {
    "base": (0.76, 0.76, 0.76),
    "frame": (0.96, 0.83, 0.66),
    "lid": (0.55, 0.75, 0.55),
}
_PLATE, _BLADE = (0.8, 0.9, 0.95), (0.90, 0.30, 0.30)


@dataclass(frozen=True)
class BoxLengths:
    """Lengths of a box, mm: half sides of the cavity at the plate and at the rim and of the walls, and more.

    `tops`: the height above the plate that each layer is struck off at, skin first; the last is the tray's rim.
    `plate`: its thickness; `hole`: radius for a peg.
    """

    inner: float
    rim: float
    outer: float
    tops: tuple[float, ...]
    plate: float
    hole: float


def lengths(phantom: PhantomTable, inside_mm: float, printer: Printer) -> BoxLengths:
    """Return the box's lengths for a cavity of `inside_mm` at the plate."""
    thickness = [layer.thickness_mm for layer in phantom.layers]
    tops = tuple(sum(thickness[i:]) for i in range(len(thickness)))
    inner = inside_mm / 2
    rim = inner + tops[-1] * math.tan(math.radians(DRAFT_DEG))
    hole = PEG_RADIUS + float(printer.plinth_clearance_mm) + 0.1
    return BoxLengths(inner, rim, rim + WALL, tops, phantom.plate_thickness_mm, hole)


def cast(phantom: PhantomTable, size: BoxLengths) -> list[Body]:
    """Draw the cast layers, skin first."""
    bodies = []
    for i, layer in enumerate(phantom.layers):
        low = size.tops[i + 1] if i + 1 < len(size.tops) else 0.0
        shape: Shape = Extrude(_square(size.rim), low, size.tops[i])
        if low == 0.0:
            shape = Extrude(_square(size.inner), 0.0, size.tops[i], top=_square(size.rim))
        bodies.append(Body(layer.name, "unit", "layer", shape, layer_colour(i), made="cast", step=len(size.tops) - i))
    return bodies


def pieces(phantom: PhantomTable, size: BoxLengths) -> list[Body]:
    """Draw tray, plate, frames (skin first), lid and blade as assembled."""
    frames = []
    for step, (high, low) in enumerate(pairwise(size.tops)):
        opening = Extrude(_square(size.rim), low - 1.0, high + 1.0)
        shape = cut(_outline(size, low, high), [opening, *_peg_holes(size, low, high)])
        number = len(size.tops) - step
        frames.append(Body(f"frame{number}", "tool", "frame", shape, _COLOURS["frame"], step=number))
    blade = moved(turned(bar(size.outer + PEG_FROM_WALL - PEG_RADIUS - 1.0, 0.0), "z", 1), 0, 0, size.tops[-1])
    plate = Extrude(_square(size.inner - PLATE_PLAY), -size.plate, 0.0)
    return [
        Body("tray", "tool", "base", _tray(size), _COLOURS["base"]),
        Body("plate", "tool", "holder", plate, _PLATE, made="cut"),
        *frames,
        Body("lid", "tool", "lid", _lid(phantom, size), _COLOURS["lid"]),
        Body("blade", "tool", "blade", blade, _BLADE, upside_down=True),
    ]


def _square(half: float) -> Profile:
    return rectangle(-half, -half, half, half)


def _at_corners(shape: Shape, x: float, y: float) -> list[Shape]:
    return [moved(shape, sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]


def _at_pegs(size: BoxLengths, shape: Shape) -> list[Shape]:
    return _at_corners(shape, size.outer + PEG_FROM_WALL, EAR_AT * size.outer)


def _tray(size: BoxLengths) -> Shape:
    # The taper runs on above the rim, so that no face of the tool is in the rim's plane.
    beyond = 1.0
    wide = size.rim + beyond * (size.rim - size.inner) / size.tops[-1]
    cavity = Extrude(_square(size.inner), 0.0, size.tops[-1] + beyond, top=_square(wide))
    pocket = Extrude(_square(size.inner), -size.plate, 0.5)
    bottom = -size.plate - FLOOR
    hole = cylinder(PUSH_RADIUS, bottom - 1.0, -size.plate + 1.0)
    holes = _at_corners(hole, 0.6 * size.inner, 0.6 * size.inner)
    pegs = _at_pegs(size, cylinder(PEG_RADIUS, size.tops[-1] - 1.0, size.tops[0] + LID))
    return union((cut(_outline(size, bottom, size.tops[-1]), [cavity, pocket, *holes]), *pegs))


def _outline(size: BoxLengths, low: float, high: float) -> Shape:
    half = EAR / 2 + 1.0
    ear = box(-half, half, -EAR_HALF, EAR_HALF, low, high)
    return union(
        (Extrude(_square(size.outer), low, high), *_at_corners(ear, size.outer + half - 2.0, EAR_AT * size.outer))
    )


def _peg_holes(size: BoxLengths, low: float, high: float) -> list[Shape]:
    return _at_pegs(size, cylinder(size.hole, low - 1.0, high + 1.0))


def _lid(phantom: PhantomTable, size: BoxLengths) -> Shape:
    """Draw the lid with the unit's seat and a hole at each point, all from its middle along x."""
    low, high = size.tops[0], size.tops[0] + LID
    seat = phantom.unit_diameter_mm / 2
    points = [moved(cylinder(POINT_RADIUS, low - 1.0, high + 1.0), seat + one, 0.0) for one in phantom.points_mm]
    seat_hole = cylinder(seat, low - 1.0, high + 1.0)
    return cut(_outline(size, low, high), [seat_hole, *points, *_peg_holes(size, low, high)])


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
    `echo_pct`: at the actual wall. `forearm`: the template's curve, `factor` the mean factor between the two.
    """

    distances_mm: tuple[float, ...]
    value: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    sensitivity: Mapping[str, float]
    wall_mm: float
    echo_pct: float
    forearm: tuple[float, ...]
    factor: float


def medium(phantom: PhantomTable, recipes: Sequence[Recipe], **changed: Sequence[float]) -> LayeredMedium:
    """Return the stack; `changes` overrides thickness (mm), modulus (kPa) or loss factor, a value each layer."""
    usual = {
        "thickness": [layer.thickness_mm for layer in phantom.layers],
        "modulus": [one.modulus_kpa for one in recipes],
        "loss": [LOSS_FACTOR[0]] * len(recipes),
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


def _echo(phantom: PhantomTable, stack: LayeredMedium, walls: np.ndarray) -> np.ndarray:
    at = _farthest(phantom)
    return _curve(phantom, stack, np.concatenate([[at], 2 * walls - at]))


def _curve(phantom: PhantomTable, stack: LayeredMedium, r_mm: np.ndarray) -> np.ndarray:
    """Return |u_z| at radii over that at the first one."""
    load = UniformDisc(phantom.motor_diameter_mm / 2e3)
    response = stack.response(load, 2 * math.pi * phantom.frequency_hz, r_mm * 1e-3, rtol=_RTOL)
    u = np.abs(response.u_z)
    return u[1:] / u[0]


def expected(phantom: PhantomTable, recipes: Sequence[Recipe], wall_mm: float, least_wall_mm: float) -> Expected:
    """Work out the response at the phantom's points; `wall_mm` is the box's, `least_wall_mm` of `wall_distance`."""
    distances = np.array(sorted(phantom.points_mm))
    r = phantom.unit_diameter_mm / 2 + np.concatenate([[0.0], distances])

    def curve(**changed: Sequence[float]) -> np.ndarray:
        return _curve(phantom, medium(phantom, recipes, **changed), r)

    value = curve()
    cases = [value, *(curve(loss=[loss] * len(recipes)) for loss in LOSS_FACTOR[1:])]
    cases += [curve(modulus=[one.low_kpa for one in recipes]), curve(modulus=[one.high_kpa for one in recipes])]
    sensitivity = {}
    for i, layer in enumerate(phantom.layers):
        thickness = [one.thickness_mm - (THINNER_MM if j == i else 0.0) for j, one in enumerate(phantom.layers)]
        cases.append(curve(thickness=thickness))
        sensitivity[layer.name] = round(float(cases[-1][-1] / value[-1] - 1), _DECIMALS)
    arm, beyond = _curve(phantom, tissue_medium(tuple(map(tissue_layer, tissue()))), r), distances > 0
    factor = math.exp(float(np.mean(np.abs(np.log(value[beyond] / arm[beyond])))))
    value, low, high, arm = (tuple(one.tolist()) for one in (value, np.min(cases, 0), np.max(cases, 0), arm))
    echo = 100 * float(_echo(phantom, medium(phantom, recipes), np.array([wall_mm]))[0])
    return Expected(tuple(distances.tolist()), value, low, high, sensitivity, least_wall_mm, echo, arm, factor)


SEGMENTS = 96
_STEP_MM = 5.0


@dataclass(frozen=True)
class PhantomSet:
    """A phantom ready to be written; `volumes_mm3`: of each layer, skin first."""

    table: PhantomTable
    recipes: tuple[Recipe, ...]
    printer: Printer
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
    for one, other in pairwise(sorted(table.points_mm)):
        if other - one < LEAST_APART:
            limit = f"{one:g} and {other:g} are nearer than {LEAST_APART:g} mm: their holes in the lid would meet"
            raise Refusal("points_mm", list(table.points_mm), limit)
    printer = choose("printer", table.printer, printers())
    wall, farthest = wall_distance(table, recipes), f"at {max(table.points_mm):g} mm"
    if math.isinf(wall):
        limit = f"no wall is far enough for an echo below {table.most_echo_pct:g} % {farthest}"
        raise Refusal("most_echo_pct", table.most_echo_pct, limit)
    inside = _STEP_MM * math.ceil(2 * wall / _STEP_MM)
    size = lengths(table, inside, printer)
    tools = tuple(pieces(table, size))
    bed = sorted((float(printer.bed_x_mm), float(printer.bed_y_mm)))
    for piece in printed_pieces(tools):
        sides = np.diff(np.reshape(bounds(realise(piece.shape, SEGMENTS)), (2, 3)), axis=0)[0]
        short, long, high = *np.sort(sides[:2]), sides[2]
        if short > bed[0] or long > bed[1] or high > float(printer.bed_z_mm):
            limit = f"the {piece.name} is {long:.0f} x {short:.0f} x {high:.0f} mm, the bed {bed[1]:g} x {bed[0]:g}"
            raise Refusal("printer", printer.name, limit)
    layers = tuple(cast(table, size))
    volumes = tuple(float(realise(body.shape, SEGMENTS).volume()) for body in layers)
    response = expected(table, recipes, inside / 2, wall)
    return PhantomSet(table, recipes, printer, size, tools, layers, volumes, response)


def tissue_table(phantom: PhantomSet) -> dict[str, dict[str, object]]:
    """Return the layers of [tissue.NAME] of a spec, skin first, the plate last."""
    found: dict[str, dict[str, object]] = {}
    hertz = phantom.table.frequency_hz
    also = f"; high: also times {stiffening(hertz):.3g}, which {hertz:g} Hz may add (assumed)"

    def ranged(value: float, low: float, high: float) -> dict[str, Any]:
        return rounded({"value": value, "low": low, "high": high}, 4)

    for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True):
        found[layer.name] = {
            "status": "secondary",
            "source": f"{one.silicone.name} + {layer.thinner_pct:g} % thinner, {thinned()['source']}{also}",
            "thickness_mm": layer.thickness_mm,
            "density_kg_m3": rounded(1e3 * one.density_g_cm3, 4),
            "youngs_modulus_kpa": ranged(one.modulus_kpa, one.low_kpa, one.high_kpa),
            "poisson_ratio": {"value": POISSON, "status": "assumed", "source": "silicone hardly changes its volume"},
            "loss_factor": {
                **ranged(*LOSS_FACTOR),
                "status": "assumed",
                "source": "tan delta of soft silicones at 100 to 150 Hz",
            },
        }
    found["plate"] = {"status": "secondary", "source": "cast acrylic, data sheets", **ACRYLIC}
    return found


def printed_pieces(tools: Sequence[Body]) -> list[Body]:
    """Return the pieces that a printer makes."""
    return [body for body in tools if body.made == "printed"]

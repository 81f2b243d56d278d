"""A unit on tissue by finite elements: its rings, its unknowns, its levels and their range. SI.

The motor is a rigid cylinder, the circuit's pad an elastic plate. The tail and its slot, which are not round, are
ignored. Touching parts within the unit are bonded.

A force at the motor's middle drives it: upwards (an axial motor, harmonic 0) or sideways (a flat one, harmonic 1). The
motor is a rigid cylinder with mass and, about its middle, turning inertia. A level is the amplitude of a reading over
the amplitude of the motor's middle along the drive, in this unit on this tissue. For a force that turns in the plane,
as that of a flat ERM, every point round the unit has the amplitudes that a sideways force gives at theta = 0 (u_r, u_z)
and at theta = 90 degrees (u_theta).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Any, Literal, get_args

import numpy as np
from msgspec.structs import replace
from scipy.stats import binom

from unitcad.attenuation.edge.level import sensitivities, unknown
from unitcad.attenuation.edge.measured import merge_layers
from unitcad.attenuation.fem.elements import Block, Contact, Fields, Solid, harmonic_mesh, motor_response
from unitcad.attenuation.inputs import Drive, EstimateInput, Geometry, Quantity, tissue_medium
from unitcad.attenuation.layered import LayeredMedium
from unitcad.attenuation.layered.medium import HalfSpace, Layer, LossFactor, complex_shear_modulus
from unitcad.errors import UnitcadError, unknown_name


@lru_cache(maxsize=1024)
def positions(seed: int, name: str, count: int) -> np.ndarray:
    """Return `count` numbers between 0 and 1, shape (count,), not to be written to.

    Those of even and those of odd index are a Latin hypercube each: one number in each of as many equal intervals, so
    that two groups which alternate are spread evenly by themselves. Every name has a stream of its own: a new name
    changes no other.
    """
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), count])
    found = rng.random(count)
    for group in range(min(2, count)):
        own = found[group::2]
        own[:] = (rng.permutation(len(own)) + own) / len(own)
    found.flags.writeable = False
    return found


def position(seed: int, name: str, index: int) -> float:
    """Return a number between 0 and 1 that is independent of those of any other index, name or seed."""
    return float(np.random.default_rng([seed, index, zlib.crc32(name.encode())]).random())


MODULUS_FACTOR = 1.5
"""A modulus that is given without a range is drawn from its value over this to its value times this: assumed."""
FLOORS = (0.3e-3, 1.0e-3)
"""Silicone between motor and skin, m, in the half of the draws that have it: assumed."""
CIRCUIT_MODULUS = (1e9, 3e9, 5e9)
"""Young's modulus of polyimide with copper, Pa: lowest, nominal, highest; assumed."""


CHOICES = ("contact", "gap filled", "floor", "no circuit")
"""Unknowns drawn with even odds; the contact is the first since it parts the levels into two groups."""


@dataclass(frozen=True)
class Draw:
    """One draw of everything that is not known: the same seed, index and name give the same value on any machine.

    A value belongs to its name (a silicone, a tissue layer, "contact"), so that two units of one draw share it.

    of   how many draws are spread evenly (`even_draws`): each 16 of them have every combination of `CHOICES` once, and
         any other value is a Latin hypercube over the bonded draws and over the resting ones. None: all draws are
         independent
    """

    seed: int
    index: int
    of: int | None = None

    def position(self, name: str) -> float:
        """Return a uniform number between 0 and 1."""
        if self.of is None:
            return position(self.seed, name, self.index)
        return float(positions(self.seed, name, self.of)[self.index])

    def between(self, name: str, low: float, high: float) -> float:
        """Return a number of log-uniform distribution between two above 0, or uniform from 0."""
        part = self.position(name)
        return low * (high / low) ** part if low > 0 else low + (high - low) * part

    def either(self, name: str) -> bool:
        """Return true or false with even odds."""
        if self.of is None:
            return self.position(name) < 0.5
        return (self.index >> CHOICES.index(name)) % 2 == 0


@dataclass(frozen=True)
class Setting:
    """Settings of the elements besides an input: how skin carries the unit, and the circuit's Young's modulus (Pa)."""

    contact: Contact = "bonded"
    circuit_modulus: float = CIRCUIT_MODULUS[1]


def draw_unknowns(variant: EstimateInput, draw: Draw) -> tuple[EstimateInput, Setting]:
    """Return an input with every unknown set by a draw, and the draw's setting.

    Moduli, damping, thicknesses of the tissue, frequency and the motor's mass are in their ranges; the air round the
    motor is open or filled, a floor of Layer 1 under the motor is there or not, and so is the circuit. The ring is
    filled if the motor would be loose otherwise.
    """

    def known(name: str, quantity: Quantity, spread: float = 1.0) -> Quantity:
        if not quantity.known or (quantity.low is None and spread == 1.0):
            return quantity
        low, high = quantity.ends if quantity.low is not None else (quantity.middle / spread, quantity.middle * spread)
        return Quantity(draw.between(name, low, high))

    layers = tuple(
        replace(
            layer,
            youngs_modulus=known(f"{layer.material} modulus", layer.youngs_modulus, MODULUS_FACTOR),
            tan_delta=known("silicone damping", layer.tan_delta),
            poisson_ratio=Quantity(layer.poisson_ratio.middle),
        )
        for layer in variant.layers
    )
    tissue = tuple(
        replace(
            layer,
            thickness=layer.thickness and known(f"{layer.name} thickness", layer.thickness),
            shear_modulus=known(f"{layer.name} modulus", layer.shear_modulus),
            damping=known(f"{layer.name} damping", layer.damping),
        )
        for layer in variant.tissue
    )
    made = replace(
        variant,
        layers=layers,
        tissue=tissue,
        frequency=known("frequency", variant.frequency),
        geometry=_geometry(variant.geometry, draw, known("motor mass", variant.geometry.motor_mass)),
    )
    contact: Contact = "bonded" if draw.either("contact") else "resting"
    low, _, high = CIRCUIT_MODULUS
    return made, Setting(contact, draw.between("circuit modulus", low, high))


def _geometry(geometry: Geometry, draw: Draw, mass: Quantity) -> Geometry:
    made = replace(geometry, motor_mass=mass)
    if draw.either("no circuit"):
        made = replace(made, pad=None)
    if made.floor == 0.0 and draw.either("floor"):
        made = lift_unit(made, draw.between("floor thickness", *FLOORS))
    held = made.pad or made.floor or made.layers[0].cap
    if draw.either("gap filled") or not held:
        made = replace(made, cavity_radius=made.motor_radius)
    return made


def lift_unit(geometry: Geometry, floor: float) -> Geometry:
    """Return a unit on a floor of Layer 1 (m) across its cavity: everything in it lies so much higher."""
    pad = geometry.pad
    return replace(
        geometry,
        floor=geometry.floor + floor,
        core_height=geometry.core_height + floor,
        layers=tuple(replace(layer, top=layer.top + floor) for layer in geometry.layers),
        pad=pad and replace(pad, low=pad.low + floor, high=pad.high + floor),
    )


CIRCUIT_DENSITY, CIRCUIT_POISSON = 1900.0, 0.34
"""Polyimide with copper: assumed."""
MOST_POISSON = 0.4999
"""The elements' pressure needs a finite bulk modulus."""
DEEP, STIFF = 0.06, 100.0
"""A half-space this many times stiffer in shear than the layers over it is the rigid floor; a softer one is a layer of
that thickness (m) over it."""


def unit_blocks(variant: EstimateInput, omega: float, circuit_modulus: float) -> list[Block]:
    """Return layers, pad and motor of a unit at its inputs' middle values.

    Without a circuit Layer 1 fills the place between motor and cap. Raises UnitcadError for a material whose modulus
    is not known.
    """
    shape = variant.geometry
    blocks: list[Block] = []
    inner, below = shape.cavity_radius, shape.core_height
    solids = []
    for silicone, layer in zip(variant.layers, shape.layers, strict=True):
        if not silicone.youngs_modulus.known:
            raise UnitcadError(f"{silicone.material}: {silicone.youngs_modulus.note}")
        material = HalfSpace(
            silicone.density,
            silicone.youngs_modulus.middle,
            min(silicone.poisson_ratio.middle, MOST_POISSON),
            LossFactor(silicone.tan_delta.middle),
        )
        solid = _solid(material, omega)
        solids.append(solid)
        blocks.append(Block(inner, layer.outer_radius, 0.0, layer.top, solid))
        if layer.cap:
            blocks.append(Block(0.0, inner, below, layer.top, solid))
        inner, below = layer.outer_radius, layer.top
    low, high = shape.floor, shape.floor + shape.motor_height
    if low:
        blocks.append(Block(0.0, shape.cavity_radius, 0.0, low, solids[0]))
    if shape.pad:
        plate = HalfSpace(CIRCUIT_DENSITY, circuit_modulus, CIRCUIT_POISSON)
        blocks.append(Block(0.0, shape.pad.radius, shape.pad.low, shape.pad.high, _solid(plate, omega)))
    elif shape.layers[0].cap and shape.core_height > high:
        blocks.append(Block(0.0, shape.motor_radius, high, shape.core_height, solids[0]))
    blocks.append(Block(0.0, shape.motor_radius, low, high, None))
    return blocks


def medium_blocks(medium: LayeredMedium, omega: float, radius: float) -> list[Block]:
    """Return the layers of a medium from the skin down, out to `radius` (m); see `DEEP` for its half-space."""
    layers = list(medium.layers)
    deep = medium.half_space
    over = [abs(_solid(layer, omega).shear) for layer in layers]
    if not over or abs(_solid(deep, omega).shear) < STIFF * max(over):
        layers.append(Layer(DEEP, deep.density, deep.youngs_modulus, deep.poisson_ratio, deep.damping))
    blocks, top = [], 0.0
    for layer in layers:
        blocks.append(Block(0.0, radius, top - layer.thickness, top, _solid(layer, omega)))
        top -= layer.thickness
    return blocks


def _solid(material: Layer | HalfSpace, omega: float) -> Solid:
    nu = min(material.poisson_ratio, MOST_POISSON)
    return Solid(complex_shear_modulus(material.youngs_modulus, nu, material.damping, omega), nu, material.density)


Reading = Literal["skin", "edge"]
"""Place of the reading: the skin at r = D/2, or the unit's own outer edge at its top."""
RADIUS = 0.16
"""Outer, fixed border of the elements, m: one farther out changes a level by less than the mesh does."""


@dataclass(frozen=True)
class Motion:
    """The motor's motion (m, and rad of a flat one) and displacements (m) at both readings under one newton."""

    motor: complex
    turning: complex
    skin: tuple[complex, complex, complex]
    edge: tuple[complex, complex, complex]
    unknowns: int


def level(
    variant_input: EstimateInput,
    frequency_hz: float,
    drive: Drive,
    reading: Reading,
    draw: Draw | None = None,
    fineness: float = 1.0,
) -> float:
    """Return the amplitude of a reading over the motor's, both along the drive.

    variant_input   `estimate_inputs.estimate_input(spec)`
    frequency_hz    overrides the input's, also that of a draw
    drive           "flat" (sideways force) or "axial"
    reading         "skin" or "edge"
    draw            `Draw(seed, index)` of all unknowns; None: nominal values, bonded, the unit as drawn
    fineness        of the mesh: at 1 one core needs about 0.1 s and bonded levels are within 1 %; at 0.5 0.02 s and
                    2 %, but 25 % where a resting unit is near a resonance (docs/evidence/accuracy/fem.md)

    Both readings of one call come from one solution, which is kept: ask for the second one next. Plain arguments and
    results: a process pool can call it. Raises Refusal for an unknown drive or reading, UnitcadError for a material
    without a modulus, Missing without scikit-fem.
    """
    for field, value, names in (("drive", drive, Drive), ("reading", reading, Reading)):
        if value not in get_args(names):
            raise unknown_name(field, str(value), get_args(names))
    made, setting = draw_unknowns(variant_input, draw) if draw else (variant_input, Setting())
    moved = motion(replace(made, frequency=Quantity(frequency_hz)), drive, setting, fineness)
    return amplitude(moved.skin if reading == "skin" else moved.edge, drive) / abs(moved.motor)


def amplitude(displacement: tuple[complex, complex, complex], drive: Drive) -> float:
    """Return the amplitude of (u_r, u_theta, u_z) along the drive: |u_z| of an axial one, |u_r| of a flat one."""
    return abs(displacement[2 if drive == "axial" else 0])


@lru_cache(maxsize=64)
def motion(variant: EstimateInput, drive: Drive, setting: Setting, fineness: float) -> Motion:
    """Solve one unit at its inputs' middle values under one newton on its motor."""
    omega = 2 * math.pi * variant.frequency.middle
    fields = unit_fields(variant, drive, setting, fineness)
    shape = variant.geometry
    mass = shape.motor_mass.middle
    inertia = [mass]
    if drive == "flat":
        inertia.append(mass * (3 * shape.motor_radius**2 + shape.motor_height**2) / 12)
    force = np.zeros(len(inertia))
    force[0] = 1.0
    motions = np.linalg.solve(fields.stiffness - omega**2 * np.diag(inertia), force)
    mesh, r = fields.mesh, shape.layers[-1].outer_radius
    at = [
        tuple(complex(part @ motions) for part in fields.displacement(mesh.at(r, z, above)))
        for z, above in ((0.0, False), (shape.layers[-1].top, True))
    ]
    turning = complex(motions[1]) if drive == "flat" else 0j
    return Motion(complex(motions[0]), turning, at[0], at[1], fields.unknowns)  # type: ignore[arg-type]


def unit_fields(
    variant: EstimateInput, drive: Drive, setting: Setting, fineness: float, radius: float = RADIUS
) -> Fields:
    """Solve one unit under unit motions of its motor: along z, or sideways and turning."""
    omega = 2 * math.pi * variant.frequency.middle
    blocks = [
        *medium_blocks(tissue_medium(variant.tissue), omega, radius),
        *unit_blocks(variant, omega, setting.circuit_modulus),
    ]
    mesh = harmonic_mesh(blocks, fineness, radius)
    return motor_response(mesh, blocks, omega, 0 if drive == "axial" else 1, setting.contact)


SEED, DRAWS, FINENESS = 1, 32, 1.0
"""Twice every combination of the choices."""
PERCENT = (5, 50, 95)
ALIKE = 0.01
"""Layers whose properties differ by less are one layer: the mesh's own error is as large."""
WITHIN = NormalDist().cdf(1.0) - NormalDist().cdf(-1.0)
"""How often a value lies within one standard error."""
MEDIAN_ERROR = (
    "a factor: the median of all possible draws lies between the median divided by it and times it in two of three "
    "cases or more; wide where bonded and resting levels lie far apart, since the median then falls between them"
)
NOT_KNOWN = (
    "moduli and damping of silicones and tissue, thicknesses of the tissue, frequency, mass of the motor; whether the "
    "ring of air next to the motor is filled, silicone is under it, the circuit stiffens the unit, and whether skin "
    "sticks to the unit or lets it slide"
)
KIND = (
    "finite elements of unit and tissue; a force drives the rigid motor: axial (along z) and flat (sideways); "
    "amplitude along the drive over the motor's, on the skin at r = D/2 and at the unit's own outer edge, at its top"
)


def range_block(
    variant: EstimateInput, draws: int = DRAWS, seed: int = SEED, say: Callable[[str], None] = lambda line: None
) -> dict[str, Any]:
    """Return {kind, not_known, draws, seed, fineness, percent, levels}: a range for each drive and reading.

    The draws are spread evenly (`Draw.of`). low, median and high are percentiles; `by_contact` has them for bonded and
    for resting skin apart. median_error: `MEDIAN_ERROR`; None below three draws. `drawn_as`: the level of the unit as
    its spec draws it, bonded, all values nominal: one of many, not the estimate. `skin_over_edge`: the level on the
    skin over that of the unit's own edge, both as drawn, by drive. A unit with a silicone of unknown modulus has an
    empty `levels` and a `reason`.
    """
    data: dict[str, Any] = {
        "kind": KIND,
        "not_known": NOT_KNOWN,
        "draws": draws,
        "seed": seed,
        "fineness": FINENESS,
        "percent": list(PERCENT),
        "median_error": MEDIAN_ERROR,
    }
    variant = merge_layers(variant, ALIKE)
    if reason := unknown(variant):
        return {**data, "levels": [], "reason": reason}
    cases: list[tuple[Drive, Reading]] = [(drive, at) for drive in get_args(Drive) for at in get_args(Reading)]
    found: dict[tuple[Drive, Reading], list[float]] = {case: [] for case in cases}
    contacts: list[Contact] = []
    for index in range(draws):
        say(f"finite elements: draw {index + 1} of {draws}")
        draw = Draw(seed, index, draws)
        made, setting = draw_unknowns(variant, draw)
        contacts.append(setting.contact)
        for drive, at in cases:
            found[drive, at].append(level(variant, made.frequency.middle, drive, at, draw, FINENESS))
    nominal = variant.frequency.middle
    levels = [
        {
            "drive": drive,
            "reading": at,
            **spread(values),
            "drawn_as": level(variant, nominal, drive, at, None, FINENESS),
            "by_contact": {
                contact: spread([value for value, one in zip(values, contacts, strict=True) if one == contact])
                for contact in dict.fromkeys(contacts)
            },
        }
        for (drive, at), values in found.items()
    ]
    drawn_as = {(one["drive"], one["reading"]): one["drawn_as"] for one in levels}
    ratios = {drive: drawn_as[drive, "skin"] / drawn_as[drive, "edge"] for drive in get_args(Drive)}
    return {**data, "levels": levels, "skin_over_edge": ratios}


def spread(values: Sequence[float]) -> dict[str, float | None]:
    """Return low, median, high of draws and the median's error, a factor.

    The error spans the narrowest pair of ordered draws, as far from either end, between which the median of
    independent draws of any distribution lies with the probability `WITHIN`: its rank is binomial.
    """
    low, median, high = (float(value) for value in np.percentile(values, PERCENT))
    ordered, n = np.sort(values), len(values)
    ranks = [k for k in range(n // 2) if 1 - 2 * binom.cdf(k, n, 0.5) >= WITHIN]
    error = None
    if ranks:
        error = float(max(ordered[n - 1 - ranks[-1]] / median, median / ordered[ranks[-1]]))
    return {"low": low, "median": median, "high": high, "median_error": error}


STEP, _COARSE = 0.01, 0.5
"""The step is wide enough that the mesh's own changes do not show; differences are off by about 1 % of a slope."""


def fem_sensitivities(
    variant: EstimateInput, say: Callable[[str], None] = lambda line: None, step: float = STEP
) -> list[dict[str, Any]]:
    """Return `sensitivities` of each reading, of the unit as drawn, bonded, all values nominal; [] without a level.

    One finite-element solution for each end of each input serves both readings.
    """
    variant = merge_layers(variant, ALIKE)
    if unknown(variant):
        return []
    drive = variant.drive
    levels: dict[Reading, list[float]] = {reading: [] for reading in get_args(Reading)}

    def solve(variants: Sequence[EstimateInput]) -> np.ndarray:
        for i, one in enumerate(variants):
            say(f"finite elements: input {i // 2 + 1} of {len(variants) // 2}")
            moved = motion(one, drive, Setting(), _COARSE)
            for reading in levels:
                shown = moved.skin if reading == "skin" else moved.edge
                levels[reading].append(
                    amplitude(
                        shown,
                        drive,
                    )
                    / abs(moved.motor)
                )
        return np.ones(len(variants))

    sensitivities(variant, solve, step)
    return [
        {"drive": drive, "reading": reading, **sensitivities(variant, lambda _, own=own: own, step)}
        for reading, own in levels.items()
    ]

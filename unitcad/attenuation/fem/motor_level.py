"""How much of the motor's motion reaches the edge, by finite elements of unit and body. SI.

A force at the motor's middle drives it: upwards (an axial motor, harmonic 0) or sideways (a flat one, harmonic 1). The
motor is a rigid cylinder with mass and, about its middle, turning inertia. A level is the amplitude of a reading over
the amplitude of the motor's middle along the drive, in this unit and on this body. For a force that turns in the plane,
as a flat ERM's does, every point round the unit has the amplitudes that a sideways force gives at theta = 0 (u_r, u_z)
and at theta = 90 degrees (u_theta).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.fem.harmonic_mesh import harmonic_mesh
from unitcad.attenuation.fem.harmonic_response import Fields, disc_response, motor_response
from unitcad.attenuation.fem.unit_blocks import medium_blocks, unit_blocks
from unitcad.attenuation.fem.unknowns import Draw, Setting, drawn
from unitcad.attenuation.inputs import EstimateInput, Quantity, body
from unitcad.attenuation.layered.response import LayeredMedium
from unitcad.errors import unknown_name

Drive = Literal["flat", "axial"]
Reading = Literal["skin", "edge"]
"""Place of the reading: the skin at r = D/2, or the unit's own outer edge at its top."""
Component = Literal["along", "normal", "radial", "total"]
"""Component of the reading.

Along the drive (axial: u_z; flat: u_r in the drive's direction), |u_z|, |u_r|, or the root of the sum of the squares of
u_r, u_theta and u_z (of a force that turns: over half a turn, the mean of the largest squares).
"""
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
    component: Component = "along",
) -> float:
    """Return the amplitude of a reading over the motor's, both along the drive unless `component` says otherwise.

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
    for field, value, names in (
        ("drive", drive, Drive),
        ("reading", reading, Reading),
        ("component", component, Component),
    ):
        if value not in get_args(names):
            raise unknown_name(field, str(value), get_args(names))
    made, setting = drawn(variant_input, draw) if draw else (variant_input, Setting())
    moved = motion(replace(made, frequency=Quantity(frequency_hz)), drive, setting, fineness)
    return amplitude(moved.skin if reading == "skin" else moved.edge, drive, component) / abs(moved.motor)


def amplitude(displacement: tuple[complex, complex, complex], drive: Drive, component: Component) -> float:
    """Return one amplitude of (u_r, u_theta, u_z)."""
    u_r, _, u_z = displacement
    if component == "total":
        return float(np.linalg.norm(displacement)) / (math.sqrt(2.0) if drive == "flat" else 1.0)
    along = "normal" if drive == "axial" else "radial"
    return abs(u_z) if (along if component == "along" else component) == "normal" else abs(u_r)


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
        *medium_blocks(body(variant.tissue), omega, radius),
        *unit_blocks(variant, omega, setting.circuit_modulus),
    ]
    mesh = harmonic_mesh(blocks, fineness, radius)
    return motor_response(mesh, blocks, omega, 0 if drive == "axial" else 1, setting.contact)


def pressed_skin(medium: LayeredMedium, omega: float, drive: Drive, disc: float, fineness: float) -> Fields:
    """Solve bare skin under 1 Pa on a disc of that radius (m), pushing down or, flat, sideways."""
    blocks = medium_blocks(medium, omega, RADIUS)
    mesh = harmonic_mesh(blocks, fineness, RADIUS, disc)
    return disc_response(mesh, blocks, omega, 0 if drive == "axial" else 1, disc)

"""A spec's unit on its tissue as blocks for the finite elements: nominal values, everything that touches is bonded.

The motor is a rigid cylinder that moves along z with unit amplitude; the pad is an elastic plate; the tail and
its slot, which are not axisymmetric, are left out; the deepest tissue is the rigid floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from unitcad import catalogue
from unitcad.accuracy.fem import Block, Solid, solve
from unitcad.attenuation.rheology import KelvinVoigt, LossFactor, complex_shear_modulus
from unitcad.catalogue import Material, Tissue, Value
from unitcad.errors import UnitcadError
from unitcad.spec import Spec, dimensions

CIRCUIT = {"youngs_modulus_kpa": 3e6, "poisson_ratio": 0.34, "density_kg_m3": 1900.0}
"""Polyimide with copper: assumed."""
RADIUS = 0.16
"""Where the finite elements end, m: twice as far changes the skin's motion by less than the mesh does."""
MM = 1e-3


def edge_level(spec: Spec, fineness: float, pad: bool = True) -> tuple[float, int]:
    """|u_z| of the skin at r = D/2 over the motor's, and the unknowns solved for; without `pad`, no circuit."""
    omega = 2 * math.pi * (spec.estimate.frequency_hz or 0.0)
    surface = solve(unit_blocks(spec, pad), omega, fineness, radius=RADIUS)
    return float(abs(surface.at([spec.diameter_mm / 2 * MM])[0])), surface.unknowns


def unit_blocks(spec: Spec, pad: bool = True) -> list[Block]:
    """Tissue, layers, pad and motor (m, z upwards from the skin). Raises UnitcadError for a material without E."""
    dims = dimensions(spec)
    omega = 2 * math.pi * (spec.estimate.frequency_hz or 0.0)
    found = tissue_blocks(spec, omega)
    known = catalogue.materials(spec.materials)
    inner, below = dims.cavity_radius, dims.core_height
    for layer, radius, top in zip(spec.layers, dims.radii, dims.heights, strict=True):
        solid = silicone(known[layer.material], omega)
        found.append(Block(inner * MM, radius * MM, 0.0, top * MM, solid))
        if layer.cap_mm is not None:
            found.append(Block(0.0, inner * MM, below * MM, top * MM, solid))
        inner, below = radius, top
    if pad and dims.pad_radius and dims.circuit_z:
        low, high = dims.circuit_z
        shear = complex(CIRCUIT["youngs_modulus_kpa"] * 1e3 / (2 * (1 + CIRCUIT["poisson_ratio"])))
        plate = Solid(shear, CIRCUIT["poisson_ratio"], CIRCUIT["density_kg_m3"])
        found.append(Block(0.0, dims.pad_radius * MM, low * MM, high * MM, plate))
    found.append(Block(0.0, dims.motor_radius * MM, 0.0, dims.motor_height * MM, None))
    return found


def tissue_blocks(spec: Spec, omega: float) -> list[Block]:
    """The spec's tissue from the skin down; the half-space under it is the floor."""
    found, top = [], 0.0
    for layer in catalogue.tissue(spec.estimate.tissue, spec.tissue):
        if layer.thickness_mm is None:
            break
        bottom = top - float(layer.thickness_mm) * MM
        found.append(Block(0.0, RADIUS, bottom, top, tissue_solid(layer, omega)))
        top = bottom
    return found


def silicone(material: Material, omega: float) -> Solid:
    """A silicone at its nominal values. Raises UnitcadError where it has no small-strain modulus."""
    if material.youngs_modulus_kpa is None:
        raise UnitcadError(f"{material.name} has no small-strain modulus")
    return _solid(
        material.youngs_modulus_kpa,
        None,
        material.poisson_ratio,
        1e3 * float(material.density_g_cm3),
        LossFactor(float(material.loss_factor)),
        omega,
    )


def tissue_solid(layer: Tissue, omega: float) -> Solid:
    """A tissue layer at its nominal values."""
    if layer.viscosity_pa_s is not None:
        damping = KelvinVoigt(float(layer.viscosity_pa_s))
    else:
        damping = LossFactor(float(layer.loss_factor)) if layer.loss_factor is not None else None
    return _solid(
        layer.youngs_modulus_kpa,
        layer.shear_modulus_kpa,
        layer.poisson_ratio,
        float(layer.density_kg_m3),
        damping,
        omega,
    )


def _solid(
    young: Value | None,
    shear: Value | None,
    nu: Value,
    density: float,
    damping: KelvinVoigt | LossFactor | None,
    omega: float,
) -> Solid:
    poisson = float(nu)
    kpa = float(young) if young is not None else 2 * (1 + poisson) * float(shear or 0.0)
    return Solid(complex_shear_modulus(1e3 * kpa, poisson, damping, omega), poisson, density)


def convergence(spec: Spec, finenesses: Sequence[float], pad: bool = True) -> list[tuple[float, int]]:
    """`edge_level` at each fineness."""
    return [edge_level(spec, n, pad) for n in finenesses]

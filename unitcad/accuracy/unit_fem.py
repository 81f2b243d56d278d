"""A spec's unit on its tissue as blocks for the finite elements: nominal values, everything that touches is bonded.

The motor is a rigid cylinder that moves along z with unit amplitude; the pad is an elastic plate; the tail and
its slot, which are not axisymmetric, are left out; the deepest tissue is the rigid floor.
"""

from __future__ import annotations

import math

from unitcad.accuracy.fem import Block, Solid, Surface, solve
from unitcad.attenuation.inputs import body
from unitcad.attenuation.layered.medium import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered.rheology import LossFactor, complex_shear_modulus
from unitcad.designs import dimensions
from unitcad.errors import UnitcadError
from unitcad.estimating import estimate_input
from unitcad.spec import Spec

CIRCUIT = HalfSpace(density=1900.0, youngs_modulus=3e9, poisson_ratio=0.34)
"""Polyimide with copper: assumed."""
RADIUS = 0.16
"""Where the finite elements end, m: farther out changes the skin's motion by less than the mesh does."""
_MM = 1e-3


def edge_level(spec: Spec, fineness: float, pad: bool = True) -> tuple[float, int]:
    """Return |u_z| of the skin at r = D/2 over the motor's, and the number of unknowns; without `pad`, no circuit.

    Raises UnitcadError for a material without a small-strain modulus.
    """
    variant = estimate_input(spec)
    omega = 2 * math.pi * variant.frequency.middle
    blocks = [*medium_blocks(body(variant.tissue), omega), *unit_blocks(spec, omega, pad)]
    surface = solve(blocks, omega, fineness, radius=RADIUS)
    return float(abs(surface.at([variant.diameter / 2])[0])), surface.unknowns


def pressed_skin(medium: LayeredMedium, omega: float, disc: float, fineness: float) -> Surface:
    """Solve bare skin under 1 Pa on a disc of that radius (m); the medium's half-space is the rigid floor."""
    return solve(medium_blocks(medium, omega), omega, fineness, radius=RADIUS, pressure_radius=disc)


def unit_blocks(spec: Spec, omega: float, pad: bool) -> list[Block]:
    """Return the blocks of layers, pad and motor (m, z upwards from the skin)."""
    dims = dimensions(spec)
    blocks = []
    inner, below = dims.cavity_radius, dims.core_height
    walls = zip(estimate_input(spec).layers, spec.layers, dims.radii, dims.heights, strict=True)
    for silicone, layer, radius, top in walls:
        if not silicone.youngs_modulus.known:
            raise UnitcadError(f"{silicone.material} has no small-strain modulus")
        solid = _solid(
            HalfSpace(
                silicone.density,
                silicone.youngs_modulus.middle,
                silicone.poisson_ratio.middle,
                LossFactor(silicone.tan_delta.middle),
            ),
            omega,
        )
        blocks.append(Block(inner * _MM, radius * _MM, 0.0, top * _MM, solid))
        if layer.cap_mm:
            blocks.append(Block(0.0, inner * _MM, below * _MM, top * _MM, solid))
        inner, below = radius, top
    if pad and dims.pad:
        blocks.append(
            Block(0.0, dims.pad.radius * _MM, dims.pad.low * _MM, dims.pad.high * _MM, _solid(CIRCUIT, omega))
        )
    blocks.append(Block(0.0, dims.motor_radius * _MM, 0.0, dims.motor_height * _MM, None))
    return blocks


def medium_blocks(medium: LayeredMedium, omega: float) -> list[Block]:
    """Return the layers of a medium from the skin down, out to `RADIUS`; its half-space becomes the floor."""
    blocks, top = [], 0.0
    for layer in medium.layers:
        blocks.append(Block(0.0, RADIUS, top - layer.thickness, top, _solid(layer, omega)))
        top -= layer.thickness
    return blocks


def _solid(material: Layer | HalfSpace, omega: float) -> Solid:
    nu = material.poisson_ratio
    return Solid(complex_shear_modulus(material.youngs_modulus, nu, material.damping, omega), nu, material.density)

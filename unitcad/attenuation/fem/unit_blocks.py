"""A unit on its body as rings of material for the finite elements. SI, z upwards from the skin.

The motor is a rigid cylinder, the circuit's pad an elastic plate. The tail and its slot, which are not round, are
ignored. Touching parts within the unit are bonded.
"""

from __future__ import annotations

from unitcad.attenuation.fem.harmonic_mesh import Block, Solid
from unitcad.attenuation.inputs import EstimateInput
from unitcad.attenuation.layered.medium import HalfSpace, Layer, LossFactor, complex_shear_modulus
from unitcad.attenuation.layered.response import LayeredMedium
from unitcad.errors import UnitcadError

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

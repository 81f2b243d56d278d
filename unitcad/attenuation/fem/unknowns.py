"""The unknowns of a unit on its body, and one draw of them. SI."""

from __future__ import annotations

from dataclasses import dataclass

from msgspec.structs import replace

from unitcad.attenuation.even_draws import position, positions
from unitcad.attenuation.fem.harmonic_response import Contact
from unitcad.attenuation.inputs import EstimateInput, Geometry, Quantity

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


def drawn(variant: EstimateInput, draw: Draw) -> tuple[EstimateInput, Setting]:
    """Return an input with every unknown set by a draw, and the draw's setting.

    Moduli, damping, thicknesses of the body, frequency and the motor's mass lie in their ranges; the ring of air round
    the motor is open or filled, a floor of Layer 1 under the motor is there or not, and so is the circuit. The ring is
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
        made = lifted(made, draw.between("floor thickness", *FLOORS))
    held = made.pad or made.floor or made.layers[0].cap
    if draw.either("gap filled") or not held:
        made = replace(made, cavity_radius=made.motor_radius)
    return made


def lifted(geometry: Geometry, floor: float) -> Geometry:
    """Return a unit on a floor of Layer 1 (m) across its cavity: everything in it lies so much higher."""
    pad = geometry.pad
    return replace(
        geometry,
        floor=geometry.floor + floor,
        core_height=geometry.core_height + floor,
        layers=tuple(replace(layer, top=layer.top + floor) for layer in geometry.layers),
        pad=pad and replace(pad, low=pad.low + floor, high=pad.high + floor),
    )

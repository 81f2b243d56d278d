"""Inputs of an estimate: a variant in SI units, each uncertain number with its range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import msgspec
import numpy as np

from unitcad.attenuation.layered import LayeredMedium
from unitcad.attenuation.layered.medium import HalfSpace, KelvinVoigt, Layer, LossFactor

Drive = Literal["flat", "axial"]


class Quantity(msgspec.Struct, frozen=True):
    """A number and its range. A range without a value: nobody measured it, `note` has the source.

    Neither value nor range: not known, `note` is the reason.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    note: str = ""

    @property
    def known(self) -> bool:
        return self.value is not None or self.low is not None

    @property
    def middle(self) -> float:
        """The value, or the geometric middle of the range; NaN if neither is known."""
        if self.value is not None:
            return self.value
        return float(np.sqrt(self.low * self.high)) if self.low is not None and self.high is not None else np.nan

    @property
    def ends(self) -> tuple[float, float]:
        """(low, high); the value if there is no range."""
        return (
            self.middle if self.low is None else self.low,
            self.middle if self.high is None else self.high,
        )


class SiliconeLayer(msgspec.Struct, frozen=True):
    """A layer of the unit: wall thickness (m), density (kg/m3), Young's modulus (Pa), Poisson's ratio, tan delta.

    `place`, `doubt`: of its silicone (`edge.contrast.place_of`); `other`: it is none of the catalogue's. `first` is its
    number in the spec, from 0, if that is not its place among the unit's layers.
    """

    material: str
    thickness: float
    density: float
    youngs_modulus: Quantity
    poisson_ratio: Quantity
    tan_delta: Quantity
    place: float
    doubt: float = 0.0
    other: bool = False
    first: int | None = None


class LayerShape(msgspec.Struct, frozen=True):
    """Outer lengths of a layer of the unit, m: its radius, the height of its top and its cap (0: an open ring)."""

    outer_radius: float
    top: float
    cap: float = 0.0


class Pad(msgspec.Struct, frozen=True):
    """The circuit's round pad, m: its radius, and its faces at the heights `low` and `high`."""

    radius: float
    low: float
    high: float


class Geometry(msgspec.Struct, frozen=True):
    """A unit's lengths in m, of the section through its axis; z = 0 is the skin, heights count away from it.

    cavity_radius   inner radius of Layer 1; equal to the motor's radius if Layer 1 reaches the motor
    core_height     top of the cavity, under the first cap
    layers          inside out
    motor_mass      kg
    pad             the circuit's pad, None without a circuit
    floor           silicone between motor and skin; 0: the motor lies on the skin, as in every shipped design
    """

    cavity_radius: float
    core_height: float
    layers: tuple[LayerShape, ...]
    motor_radius: float
    motor_height: float
    motor_mass: Quantity
    pad: Pad | None = None
    floor: float = 0.0

    @property
    def gap(self) -> float:
        """Width of the ring of air between motor and Layer 1, m; 0 if the gap is filled."""
        return self.cavity_radius - self.motor_radius


class TissueLayer(msgspec.Struct, frozen=True):
    """A layer of the tissue: thickness (m, None for the half-space), density (kg/m3), shear modulus (Pa), damping.

    damping is tan delta if `damping_law` is "loss_factor", a viscosity in Pa s if it is "kelvin_voigt".
    """

    name: str
    thickness: Quantity | None
    density: float
    shear_modulus: Quantity
    poisson_ratio: float
    damping_law: Literal["loss_factor", "kelvin_voigt"] | None
    damping: Quantity


class Feature(msgspec.Struct, frozen=True):
    """A feature of a unit that no measured unit had, and its size (mm; degrees of a draft; 1 if it has none)."""

    name: str
    size: float = 1.0


class EstimateInput(msgspec.Struct, frozen=True, cache_hash=True):
    """A unit on tissue: lengths in m, frequency in Hz, the motor's amplitude in m (None: not known).

    `passes`: how often the wave from motor to skin passes the border between the layers; `drive`: how the motor's force
    acts, turning in the skin's plane (flat) or along the motor's axis (axial); `moduli`: which ones the layers have;
    `features`: those that no measured unit of the paper had and no model reads.
    """

    name: str
    design: str
    passes: float
    diameter: float
    geometry: Geometry
    layers: tuple[SiliconeLayer, ...]
    tissue_name: str
    tissue: tuple[TissueLayer, ...]
    frequency: Quantity
    amplitude: float | None = None
    drive: Drive = "flat"
    moduli: Literal["small-strain", "quasi-static"] = "small-strain"
    features: tuple[Feature, ...] = ()

    @property
    def motor_diameter(self) -> float:
        """The motor's diameter, m."""
        return 2.0 * self.geometry.motor_radius


def tissue_medium(tissue: tuple[TissueLayer, ...], end: Mapping[str, int] | None = None) -> LayeredMedium:
    """Return the tissue as a layered medium; `end` sets "moduli", "damping" or "thicknesses" to low (0) or high (1)."""
    end = end or {}

    def of(kind: str, quantity: Quantity) -> float:
        return quantity.ends[end[kind]] if kind in end else quantity.middle

    made = []
    for layer in tissue:
        modulus = of("moduli", layer.shear_modulus) * 2.0 * (1.0 + layer.poisson_ratio)
        law = {"loss_factor": LossFactor, "kelvin_voigt": KelvinVoigt}.get(layer.damping_law or "")
        damping = law(of("damping", layer.damping)) if law else None
        material = (layer.density, modulus, layer.poisson_ratio, damping)
        if layer.thickness is None:
            return LayeredMedium(made, HalfSpace(*material))
        made.append(Layer(of("thicknesses", layer.thickness), *material))
    raise ValueError("the tissue ends with a half-space: a layer without a thickness")

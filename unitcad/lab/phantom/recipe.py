"""The TOML file of a phantom. Lengths in mm; layers from the skin down, on a stiff plate."""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from unitcad.attenuation.layered import FractionalKelvinVoigt
from unitcad.catalogue import Material, materials
from unitcad.catalogue import entries as kinds
from unitcad.errors import Refusal, unknown_name
from unitcad.spec import convert
from unitcad.validation.typed_files import load_file

LEAST_LAYER, MOST_DEPTH = 0.5, 100.0
_LAYER_NAME = "small letters a to z, digits and -, the first a letter"
_NAME = "small letters a to z, digits and -, the first a letter or digit"


class PhantomLayer(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One layer of the phantom, from the skin down."""

    name: Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description=_LAYER_NAME)]
    silicone: Annotated[str, Meta(description="tested silicone: ecoflex-00-10, ecoflex-00-30 or ecoflex-00-50")]
    thinner_pct: Annotated[float, Meta(ge=0, le=100, description="thinner, in parts by weight to 100 of A and B")]
    thickness_mm: Annotated[float, Meta(ge=LEAST_LAYER, le=60, description="thickness of the layer")]
    loss_factor: Annotated[float, Meta(ge=0.01, le=1, description="tan delta (assumed)")] = 0.2


class PhantomTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A skin phantom: one box of silicone layers."""

    name: Annotated[str, Meta(min_length=1, max_length=60, pattern=r"^[a-z0-9][a-z0-9-]*$", description=_NAME)]
    layers: Annotated[tuple[PhantomLayer, ...], Meta(min_length=1, max_length=6)]
    unit_diameter_mm: Annotated[float, Meta(ge=4, le=40, description="diameter of the unit to measure")] = 14.0
    motor_diameter_mm: Annotated[float, Meta(ge=2, le=40, description="diameter of its motor")] = 7.0
    frequency_hz: kinds.Frequency = 125.0
    points_mm: Annotated[
        tuple[Annotated[float, Meta(ge=0, le=60)], ...],
        Meta(min_length=2, max_length=13, description="distances of the measuring points from the unit's edge"),
    ] = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
    inside_mm: Annotated[
        Annotated[float, Meta(ge=40, le=400)] | None,
        Meta(description="inner side of the box; default: the smallest with an echo below most_echo_pct"),
    ] = None
    most_echo_pct: Annotated[
        float, Meta(ge=0.5, le=50, description="largest echo of the walls at the last point, in percent")
    ] = 5.0
    plate_thickness_mm: Annotated[float, Meta(ge=2, le=20, description="thickness of the acrylic plate below")] = 5.0
    stage_pitch_mm: Annotated[float, Meta(ge=5, le=50, description="pitch of the table's threaded holes")] = 25.0
    stage_bolt_mm: Annotated[float, Meta(ge=2, le=12, description="thread of the table's holes")] = 6.0
    printer: Annotated[str, Meta(description="printer of the catalogue")] = "fdm-0.4"
    waste: Annotated[float, Meta(ge=0, le=2, description="extra mix, as a fraction")] = 0.1
    scale_resolution_g: Annotated[float, Meta(ge=1e-4, le=10, description="smallest step of the scale")] = 0.1
    room_c: Annotated[float, Meta(ge=5, le=45, description="temperature of the room")] = 23.0

    @property
    def depth_mm(self) -> float:
        """All layers together."""
        return sum(layer.thickness_mm for layer in self.layers)


def load_phantom(source: str | os.PathLike[str]) -> PhantomTable:
    """Return the phantom of a shipped name or of a file. Raises Refusal or UnitcadError for an invalid one."""
    return load_file(source, "phantom", lambda data, _: convert(data, PhantomTable))


THINNER_DENSITY = 0.97
"""g/cm3 (assumed: a silicone oil)."""
LOSS_RANGE = (0.5, 1.5)
"""Range of an assumed loss factor, as factors: 0.1 to 0.3 for 0.2."""


@dataclass(frozen=True)
class Recipe:
    """A silicone with thinner: Young's modulus kPa, tan delta and their ranges, density g/cm3.

    The modulus is the table's, its range two standard deviations. `high_kpa` includes the stiffening at the frequency.
    """

    silicone: Material
    thinner_pct: float
    modulus_kpa: float
    low_kpa: float
    high_kpa: float
    density_g_cm3: float
    source: str
    loss: tuple[float, float, float]


def recipe(layer: PhantomLayer, frequency_hz: float, field: str) -> Recipe:
    """Return a layer's recipe for a phantom that moves at a frequency; `field` is for refusals.

    Raises Refusal for a silicone or a share of thinner that nobody tested.
    """
    value, low, high = modulus_by_table(layer.silicone, layer.thinner_pct, field)
    material = materials()[layer.silicone]
    volume = 100.0 / float(material.density_g_cm3) + layer.thinner_pct / THINNER_DENSITY
    least, most = LOSS_RANGE
    return Recipe(
        material,
        layer.thinner_pct,
        value,
        low,
        stiffening(frequency_hz) * high,
        (100.0 + layer.thinner_pct) / volume,
        str(_table()["source"]),
        (layer.loss_factor, least * layer.loss_factor, most * layer.loss_factor),
    )


def modulus_by_table(silicone: str, thinner_pct: float, field: str) -> tuple[float, float, float]:
    """Return the modulus, kPa, of a silicone with parts of thinner to 100 of A and B, with two standard deviations.

    Between two tested shares the logarithm of the modulus is interpolated. Raises Refusal for a silicone that was not
    tested, and for a share outside the tested ones.
    """
    known = {name: table for name, table in _table().items() if isinstance(table, dict)}
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


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads((resources.files("unitcad.catalogue") / "thinned.toml").read_text("utf-8"))

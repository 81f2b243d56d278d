"""The modulus of a silicone with thinner, from compression tests by others; nothing outside them is guessed."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt
from unitcad.catalogue import Material, materials
from unitcad.errors import Refusal, unknown_name
from unitcad.lab.phantom.description import PhantomLayer
from unitcad.lab.phantom.measured_layer import MeasuredLayer, measured_layer

THINNER_DENSITY = 0.97
"""g/cm3 (assumed: a silicone oil)."""
LOSS_RANGE = (0.5, 1.5)
"""Range of an assumed loss factor, as factors: 0.1 to 0.3 where it is 0.2."""


@dataclass(frozen=True)
class Recipe:
    """A silicone with thinner: Young's modulus kPa, tan delta and their ranges, density g/cm3.

    `high_kpa` has what the phantom's frequency may bring over a slow test. `measured`: the file of the layer's own
    coupons, else the modulus is the table's, with two standard deviations.
    """

    silicone: Material
    thinner_pct: float
    modulus_kpa: float
    low_kpa: float
    high_kpa: float
    density_g_cm3: float
    source: str
    loss: tuple[float, float, float]
    loss_source: str = ""
    measured: MeasuredLayer | None = None


def recipe(layer: PhantomLayer, frequency_hz: float, field: str) -> Recipe:
    """Return a layer's recipe for a phantom that moves at a frequency; `field` is for refusals.

    A layer without measured modulus needs a tested silicone and share of thinner. Raises Refusal.
    """
    assumed = layer.loss_factor, LOSS_RANGE[0] * layer.loss_factor, LOSS_RANGE[1] * layer.loss_factor
    factor = stiffening(frequency_hz)
    if layer.measured is None:
        value, low, high = modulus_by_table(layer.silicone, layer.thinner_pct, field)
        material = materials()[layer.silicone]
        density = _density(material, layer.thinner_pct)
        return Recipe(material, layer.thinner_pct, value, low, factor * high, density, _source(), assumed)
    known = materials()
    if layer.silicone not in known:
        raise unknown_name(f"{field}.silicone", layer.silicone, known)
    found = measured_layer(Path(layer.measured), layer.silicone, frequency_hz, f"{field}.measured")
    material, high = known[layer.silicone], found.high_kpa * (1.0 if found.dynamic else factor)
    return Recipe(
        material, layer.thinner_pct, found.modulus_kpa, found.low_kpa, high, _density(material, layer.thinner_pct),
        found.source, found.loss or assumed, found.loss_source, found,
    )  # fmt: skip


def _density(material: Material, thinner_pct: float) -> float:
    volume = 100.0 / float(material.density_g_cm3) + thinner_pct / THINNER_DENSITY
    return (100.0 + thinner_pct) / volume


def modulus_by_table(silicone: str, thinner_pct: float, field: str) -> tuple[float, float, float]:
    """Return the modulus, kPa, of a silicone with parts of thinner to 100 of A and B, with two standard deviations.

    Between two tested shares the logarithm of the modulus is interpolated. Raises Refusal for a silicone that was not
    tested, and for a share outside the tested ones.
    """
    known = _table()
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

    That the law holds with thinner is assumed; the moduli of the table were measured slowly.
    """
    material = materials()["ecoflex-00-30"]
    assert material.fractional_tau_us
    assert material.fractional_n
    law = FractionalKelvinVoigt(float(material.fractional_tau_us) * 1e-6, float(material.fractional_n))
    return abs(law.complex_shear(1.0, 2.0 * math.pi * frequency_hz))


@cache
def _raw() -> dict:  # type: ignore[type-arg]
    return tomllib.loads((files("unitcad.catalogue") / "thinned.toml").read_text("utf-8"))


def _table() -> dict[str, dict[str, list[float]]]:
    return {name: table for name, table in _raw().items() if isinstance(table, dict)}


def _source() -> str:
    return str(_raw()["source"])

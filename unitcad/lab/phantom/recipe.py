"""The modulus of a silicone with thinner, from compression tests by others; nothing outside them is guessed."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt
from unitcad.catalogue import Material, materials
from unitcad.errors import Refusal, unknown_name

THINNER_DENSITY = 0.97
"""g/cm3 (assumed: a silicone oil)."""


@dataclass(frozen=True)
class Recipe:
    """A silicone with thinner: Young's modulus kPa with its range (two standard deviations), density g/cm3."""

    silicone: Material
    thinner_pct: float
    modulus_kpa: float
    low_kpa: float
    high_kpa: float
    density_g_cm3: float
    source: str


def recipe(silicone: str, thinner_pct: float, field: str) -> Recipe:
    """Return the recipe of a silicone with parts of thinner to 100 parts of A and B; `field` is for refusals.

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
    material = materials()[silicone]
    volume = 100.0 / float(material.density_g_cm3) + thinner_pct / THINNER_DENSITY
    density = (100.0 + thinner_pct) / volume
    return Recipe(material, thinner_pct, modulus, modulus * (1 - spread), modulus * (1 + spread), density, _source())


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

"""What a phantom's TOML file may hold. Lengths in mm; layers from the skin down, on a stiff plate."""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, NoReturn

import numpy as np
from msgspec import Meta, Struct
from msgspec.structs import replace

from unitcad import files
from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt
from unitcad.catalogue import Material, MaterialEntry, materials
from unitcad.catalogue import entries as kinds
from unitcad.errors import Refusal, UnitcadError, WrongArgument, unknown_name
from unitcad.spec import convert, read_toml
from unitcad.validation.shipped_files import named_file, shipped_files

LEAST_LAYER, MOST_DEPTH = 0.5, 100.0
_LAYER_NAME = "small letters a to z, digits and -, the first a letter"
_NAME = "small letters a to z, digits and -, the first a letter or digit"


class PhantomLayer(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One layer: a silicone of the table of thinned ones, its thinner in parts to 100 of A and B, and its thickness.

    `loss_factor`: tan delta, assumed where nobody measured it. `measured`: what `unitcad material` wrote of the layer's
    coupons; its modulus goes before the table's, and so does its loss factor.
    """

    name: Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description=_LAYER_NAME)]
    silicone: str
    thinner_pct: Annotated[float, Meta(ge=0, le=100)]
    thickness_mm: Annotated[float, Meta(ge=LEAST_LAYER, le=60)]
    loss_factor: Annotated[float, Meta(ge=0.01, le=1)] = 0.2
    measured: Annotated[str, Meta(min_length=1, max_length=1000)] | None = None


class PhantomTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A phantom; `inside_mm` is the box's inside, None for the least that keeps the echo below `most_echo_pct`."""

    name: Annotated[str, Meta(min_length=1, max_length=60, pattern=r"^[a-z0-9][a-z0-9-]*$", description=_NAME)]
    layers: Annotated[tuple[PhantomLayer, ...], Meta(min_length=1, max_length=6)]
    unit_diameter_mm: Annotated[float, Meta(ge=4, le=40)] = 14.0
    motor_diameter_mm: Annotated[float, Meta(ge=2, le=40)] = 7.0
    frequency_hz: kinds.Frequency = 125.0
    points_mm: Annotated[tuple[Annotated[float, Meta(ge=0, le=60)], ...], Meta(min_length=2, max_length=13)] = (
        0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0
    )  # fmt: skip
    inside_mm: Annotated[float, Meta(ge=40, le=400)] | None = None
    most_echo_pct: Annotated[float, Meta(ge=0.5, le=50)] = 5.0
    plate_thickness_mm: Annotated[float, Meta(ge=2, le=20, description="of the acrylic plate below")] = 5.0
    coupons: Annotated[int, Meta(ge=0, le=4, description="tensile coupons of each pour")] = 3
    stage_pitch_mm: Annotated[float, Meta(ge=5, le=50, description="of the table's threaded holes")] = 25.0
    stage_bolt_mm: Annotated[float, Meta(ge=2, le=12, description="thread of the table's holes")] = 6.0
    printer: str = "fdm-0.4"
    waste: Annotated[float, Meta(ge=0, le=2, description="extra mix as a fraction")] = 0.1
    scale_resolution_g: Annotated[float, Meta(ge=1e-4, le=10)] = 0.1
    room_c: Annotated[float, Meta(ge=5, le=45)] = 23.0

    @property
    def depth_mm(self) -> float:
        """All layers together."""
        return sum(layer.thickness_mm for layer in self.layers)


def phantoms() -> dict[str, Path]:
    """Return the shipped phantoms by name."""
    return shipped_files("phantoms")


def load_phantom(source: str | os.PathLike[str]) -> PhantomTable:
    """Return the phantom of a shipped name or of a file, from whose folder its `measured` files are seen.

    Raises Refusal or UnitcadError for what is not valid.
    """
    path = named_file(os.fspath(source), phantoms(), "phantom", WrongArgument)
    table = convert(read_toml(path), PhantomTable)
    layers = (
        replace(layer, measured=str(path.parent / layer.measured)) if layer.measured else layer
        for layer in table.layers
    )
    return replace(table, layers=tuple(layers))


MOST_OFF = 0.02
"""Relative difference from the file's own law at the phantom's frequency: beyond it the file is for another one."""
_LAW = ("fractional_mu0_kpa", "fractional_tau_us", "fractional_n")


@dataclass(frozen=True)
class MeasuredLayer:
    """Young's modulus, kPa, with its range; at the phantom's frequency where `dynamic`, else of a slow pull.

    `loss`: tan delta with its range, where it was measured. `file`, `sha256`: of the file that was read.
    """

    modulus_kpa: float
    low_kpa: float
    high_kpa: float
    dynamic: bool
    source: str
    file: str
    sha256: str
    loss: tuple[float, float, float] | None = None
    loss_source: str = ""


def measured_layer(path: Path, silicone: str, frequency_hz: float, field: str) -> MeasuredLayer:
    """Return what a file of `unitcad material` says; a modulus at the motor's frequency goes before a slow pull's.

    Raises Refusal, of `field`, for a file that is not there or holds something else: another silicone (`like`), no
    modulus, one without a range, or one at another frequency.
    """
    shown = path.name

    def refuse(limit: str) -> NoReturn:
        raise Refusal(field, shown, limit)

    if not path.is_file():
        refuse(f"no such file in {files.seen_from(path.parent)}")
    try:
        found = read_toml(path).get("materials")
        if isinstance(found, dict):
            convert(found, dict[str, MaterialEntry], "materials")
    except UnitcadError as error:
        refuse(str(error))
    if not isinstance(found, dict) or len(found) != 1:
        refuse("must hold one table [materials.NAME], as unitcad material writes it")
    (entry,) = found.values()
    if entry.get("like", silicone) != silicone:
        refuse(f"is of {entry['like']} (like), the layer of {silicone}")
    dynamic = "youngs_modulus_kpa" in entry
    key = "youngs_modulus_kpa" if dynamic else "quasistatic_modulus_kpa"
    if key not in entry:
        refuse("holds neither youngs_modulus_kpa nor quasistatic_modulus_kpa")
    values, sources = {}, {}
    for name in (key, "loss_factor"):
        if name in entry:
            one = entry[name] if isinstance(entry[name], dict) else {}
            low, middle, high = (one.get(end) for end in ("low", "value", "high"))
            if low is None or high is None or not 0 < low <= middle <= high:
                refuse(f"{name} needs low and high about its value")
            values[name] = (float(middle), float(low), float(high))
            sources[name] = "; ".join(filter(None, (shown, one.get("method"), one.get("source"))))
    value = values[key][0]
    if dynamic and all(isinstance(entry.get(name), dict) for name in _LAW):
        mu0, tau, n = (float(entry[name]["value"]) for name in _LAW)
        omega = 2.0 * math.pi * frequency_hz
        there = FractionalKelvinVoigt(tau * 1e-6, n).complex_shear(3.0 * mu0, omega).real
        if abs(there / value - 1.0) > MOST_OFF:
            refuse(
                f"youngs_modulus_kpa is {value:.4g}, but the file's law has {there:.4g} at {frequency_hz:g} Hz: run "
                f"unitcad material --dma again with --frequency-hz {frequency_hz:g}"
            )
    return MeasuredLayer(
        *values[key], dynamic, sources[key], shown, files.sha256(path), values.get("loss_factor"),
        sources.get("loss_factor", ""),
    )  # fmt: skip


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
    loss, loss_source = tuple(part * layer.loss_factor for part in (1.0, *LOSS_RANGE)), ""
    known, found = materials(), None
    if layer.measured is None:
        value, low, high = modulus_by_table(layer.silicone, layer.thinner_pct, field)
        source = str(_table()["source"])
    elif layer.silicone not in known:
        raise unknown_name(f"{field}.silicone", layer.silicone, known)
    else:
        found = measured_layer(Path(layer.measured), layer.silicone, frequency_hz, f"{field}.measured")
        value, low, high, source = found.modulus_kpa, found.low_kpa, found.high_kpa, found.source
        loss, loss_source = found.loss or loss, found.loss_source
    if found is None or not found.dynamic:
        high = stiffening(frequency_hz) * high
    material = known[layer.silicone]
    volume = 100.0 / float(material.density_g_cm3) + layer.thinner_pct / THINNER_DENSITY
    density = (100.0 + layer.thinner_pct) / volume
    return Recipe(material, layer.thinner_pct, value, low, high, density, source, loss, loss_source, found)


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

    That the law holds with thinner is assumed; the moduli of the table were measured slowly.
    """
    material = materials()["ecoflex-00-30"]
    assert material.fractional_tau_us
    assert material.fractional_n
    law = FractionalKelvinVoigt(float(material.fractional_tau_us) * 1e-6, float(material.fractional_n))
    return abs(law.complex_shear(1.0, 2.0 * math.pi * frequency_hz))


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads((resources.files("unitcad.catalogue") / "thinned.toml").read_text("utf-8"))

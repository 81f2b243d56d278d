"""A layer's modulus as a lab measured it, from the table that `unitcad material` wrote of the layer's own coupons."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt
from unitcad.catalogue import MaterialEntry
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec import convert, read_toml

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
    if not path.is_file():
        raise Refusal(field, shown, f"no such file in {files.seen_from(path.parent)}")
    try:
        found = read_toml(path).get("materials")
        if not isinstance(found, dict) or len(found) != 1:
            raise Refusal(field, shown, "must hold one table [materials.NAME], as unitcad material writes it")
        name, entry = next(iter(found.items()))
        convert({name: entry}, dict[str, MaterialEntry], "materials")
    except UnitcadError as error:
        raise error if getattr(error, "field", "") == field else Refusal(field, shown, str(error)) from None
    if entry.get("like", silicone) != silicone:
        raise Refusal(field, shown, f"is of {entry['like']} (like), the layer of {silicone}")
    dynamic = "youngs_modulus_kpa" in entry
    key = "youngs_modulus_kpa" if dynamic else "quasistatic_modulus_kpa"
    if key not in entry:
        raise Refusal(field, shown, "holds neither youngs_modulus_kpa nor quasistatic_modulus_kpa")
    value, low, high = _ranged(entry, key, field, shown)
    if dynamic:
        _expect_frequency(entry, value, frequency_hz, field, shown)
    loss = _ranged(entry, "loss_factor", field, shown) if "loss_factor" in entry else None
    return MeasuredLayer(
        value, low, high, dynamic, _source(entry[key], shown), shown, files.sha256(path), loss,
        _source(entry["loss_factor"], shown) if loss else "",
    )  # fmt: skip


def _ranged(entry: Mapping[str, Any], key: str, field: str, shown: str) -> tuple[float, float, float]:
    value = entry[key]
    ends = (value.get("low"), value["value"], value.get("high")) if isinstance(value, dict) else (None, value, None)
    low, middle, high = ends
    if low is None or high is None or not 0 < low <= middle <= high:
        raise Refusal(field, shown, f"{key} needs low and high about its value")
    return float(middle), float(low), float(high)


def _source(value: Mapping[str, Any], shown: str) -> str:
    """Return file, method and source of a value."""
    return "; ".join(filter(None, (shown, value.get("method"), value.get("source"))))


def _expect_frequency(entry: Mapping[str, Any], modulus: float, frequency_hz: float, field: str, shown: str) -> None:
    """Refuse a modulus that the file's own law does not have at the phantom's frequency."""
    if not all(isinstance(entry.get(key), dict) for key in _LAW):
        return
    mu0, tau, n = (float(entry[key]["value"]) for key in _LAW)
    law = FractionalKelvinVoigt(tau * 1e-6, n)
    there = law.complex_shear(3.0 * mu0, 2.0 * math.pi * frequency_hz).real
    if abs(there / modulus - 1.0) > MOST_OFF:
        limit = (
            f"youngs_modulus_kpa is {modulus:.4g}, but the file's law has {there:.4g} at {frequency_hz:g} Hz: run "
            f"unitcad material --dma again with --frequency-hz {frequency_hz:g}"
        )
        raise Refusal(field, shown, limit)

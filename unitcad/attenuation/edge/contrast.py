"""How much softer a layer is than the next: one place for each silicone, and how likely a border of two counts. SI.

Two tests of one silicone differ by more than two silicones of one test: the paper's moduli over those of other labs'
slow pulls are 0.57, 1.97 and 0.74. So a modulus is compared only with moduli of its own method. Ecoflex 00-10 and
Dragon Skin 10 Medium, the pair that differs least among the measured units with the softer layer inside, set the
scale: their places are the logarithms of their printed moduli. A third measured silicone lies where each method has it
on this scale, on average over the methods. Any other lies where its method has it between the measured ones, and by the
logarithm beyond them. It has one place, whichever modulus a spec chooses.

A reading that a spec brings has no method here. Within the values that other labs found for its silicone (`like`) it
is that silicone. Beyond them its place moves by the logarithm, and its doubt grows to the spread of the methods.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from unitcad.catalogue import Material, Value, materials, measurements
from unitcad.catalogue.moduli import PAPER, method_spread, readings
from unitcad.lean_scipy import special

PAIR = ("E10", "D10")
"""Short names of the pair that sets the scale."""
_NORMAL = 1.2816
"""Standard deviations from the middle to the 10 and 90 % points of a normal distribution."""


@dataclass(frozen=True)
class Place:
    """Place of a silicone on the scale of ln modulus (Pa) and the standard deviation of its doubt; NaN if not known."""

    at: float
    doubt: float = 0.0


UNKNOWN = Place(math.nan)


@cache
def _scales() -> dict[str, tuple[list[float], list[float]]]:
    """Return the readings (ln Pa) and the places of the measured silicones, ascending, for each method that has all."""
    every = {name: readings(materials()[name]) for name in measurements().names.values()}
    methods = [method for method in next(iter(every.values())) if all(method in one for one in every.values())]
    logs = {method: {name: math.log(_pascal(one[method])) for name, one in every.items()} for method in methods}
    soft, stiff = (measurements().names[short] for short in PAIR)
    low, unit = logs[PAPER][soft], logs[PAPER][stiff] - logs[PAPER][soft]
    places = {
        name: low + unit * float(np.mean([(of[name] - of[soft]) / (of[stiff] - of[soft]) for of in logs.values()]))
        for name in every
    }
    order = sorted(every, key=places.__getitem__)
    return {method: ([of[name] for name in order], [places[name] for name in order]) for method, of in logs.items()}


@cache
def unit_of_scale() -> float:
    """Return the difference of the places of the pair that sets the scale: a border counts in full from there on."""
    soft, stiff = (_shipped_place(measurements().names[short]).at for short in PAIR)
    return stiff - soft


def place_of(material: Material) -> Place:
    """Return the place of a silicone of the catalogue or of a spec."""
    base = materials().get(material.like or material.name)
    known = readings(base) if base else {}
    own = [value for value in readings(material).values() if value not in known.values()]
    if base and not own:
        return _shipped_place(base.name)
    if not own:
        return UNKNOWN
    apart = float(np.hypot(method_spread(), np.mean([_spread(value) for value in own])))
    if not (base and known):
        return Place(float(np.mean([math.log(_pascal(value)) for value in own])), apart)
    start = _shipped_place(base.name)
    away = float(np.mean([_beyond(float(value), known.values()) for value in own]))
    gone = 1.0 - math.exp(-0.5 * (away / apart) ** 2)
    return Place(start.at + away, math.hypot(start.doubt * math.sqrt(1.0 - gone), apart * math.sqrt(gone)))


def _spread(value: Value[Any]) -> float:
    """Return the standard deviation (ln) of a reading whose range is taken for its 10 to 90 %; 0 without a range."""
    ends = [float(end) for end in (value.low, value.value, value.high) if end is not None]
    return math.log(max(ends) / min(ends)) / (2.0 * _NORMAL)


def _beyond(kpa: float, known: Iterable[Value[Any]]) -> float:
    """Return how far (ln) a modulus lies above all values and ranges of a silicone, below them negative, 0 within."""
    ends = [float(end) for value in known for end in (value.value, value.low, value.high) if end is not None]
    return math.log(kpa / min(max(kpa, min(ends)), max(ends)))


@cache
def _shipped_place(name: str) -> Place:
    found, scales = readings(materials()[name]), _scales()
    if not found:
        return UNKNOWN
    on_scale = [_between(math.log(_pascal(value)), *scales[one]) for one, value in found.items() if one in scales]
    at = float(np.mean(on_scale or [math.log(_pascal(value)) for value in found.values()]))
    if name in measurements().names.values():
        return Place(at)
    return Place(at, float(np.hypot(method_spread(), np.mean([_spread(value) for value in found.values()]))))


def _between(reading: float, known: list[float], places: list[float]) -> float:
    """Return the place of a reading between known ones, linearly; beyond them its distance is added."""
    inside = min(max(reading, known[0]), known[-1])
    return float(np.interp(inside, known, places)) + reading - inside


def _pascal(value: Value[Any]) -> float:
    return 1e3 * float(value)


def counts(at: Any, doubt: Any) -> np.ndarray:
    """Return how likely each border of layers counts, shape (..., N - 1), from the layers' places, (..., N).

    1: the inside is softer by the measured pair's difference or more; 0: it is not softer. Between, the measured units
    do not say where a border begins to count: anywhere, with equal odds. The doubt of both places enters as normal
    scatter of their difference. It fades as the difference does, since one test orders two silicones.
    """
    apart = np.diff(np.asarray(at, dtype=float), axis=-1)
    squares = np.square(np.asarray(doubt, dtype=float))
    variance = squares[..., 1:] + squares[..., :-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = np.sqrt(variance * -np.expm1(-0.5 * apart**2 / variance))
        whole = unit_of_scale()
        blurred = scatter / whole * (_ramp(apart / scatter) - _ramp((apart - whole) / scatter))
    return np.where(scatter > 0.0, blurred, np.clip(apart / whole, 0.0, 1.0))


def _ramp(u: np.ndarray) -> np.ndarray:
    """Return the mean of max(u + normal scatter, 0)."""
    return u * special.ndtr(u) + np.exp(-0.5 * u**2) / math.sqrt(2.0 * math.pi)

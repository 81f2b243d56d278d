"""The rivals: accounts of the level at the edge, each as draws of the logarithm of a reading.

A reading is the amplitude at the unit's edge over the motor's, as the measured table has it. What multiplies every
reading of a rival by one number cancels in the ratios that are compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.fitted_models import fit_divider
from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.attenuation.inputs import EstimateInput
from unitcad.errors import unknown_name
from unitcad.experiments.draws import Draws


@dataclass(frozen=True)
class Rival:
    """An account of the level: its name, what it says, and `levels`, draws of a variant's reading, shape (draws,)."""

    name: str
    says: str
    levels: Callable[[EstimateInput, Draws], np.ndarray]


def _closed_form(path: Callable[[Units], Any]) -> Callable[[EstimateInput, Draws], np.ndarray]:
    return lambda variant, draws: np.asarray(path(draws.units(variant)))


def _divider(variant: EstimateInput, draws: Draws) -> np.ndarray:
    kappas = _resampled_kappas()
    kappa = kappas[(draws.uniform("kappa") * len(kappas)).astype(int)]
    return np.asarray(cf.divider(draws.units(variant), kappa))


@cache
def _resampled_kappas(count: int = 200) -> np.ndarray:
    """Fit the divider to the measured units drawn with replacement; a draw of one contrast alone fits nothing."""
    table, rng = measured_table(), np.random.default_rng(1)
    picks = (rng.integers(0, len(table.names), len(table.names)) for _ in range(10 * count))
    fits = [fit_divider(table, pick)[0] for pick, _ in zip(_varied(picks, table.contrast), range(count), strict=False)]
    return np.array(fits)


def _varied(picks: Any, contrast: np.ndarray) -> Any:
    return (pick for pick in picks if np.ptp(np.log(contrast[pick])) > 1.0)


_CLOSED_FORMS = (
    Rival(
        "paper",
        "the paper's closed form as printed: transmission along the walls, decay by a loss modulus",
        _closed_form(cf.paper_path),
    ),
    Rival(
        "consistent",
        "the same path with complex moduli and the exact attenuation",
        _closed_form(cf.consistent_path),
    ),
    Rival(
        "crossings",
        "layer propagation: the transmission coefficient once for each pass of the border between the layers",
        _closed_form(cf.transmission_only),
    ),
    Rival(
        "divider",
        "the empirical divider of the layers' moduli, fitted to the measured levels",
        _divider,
    ),
)


@dataclass(frozen=True)
class Available:
    """The rivals that can be asked here, and why others can't, by name."""

    rivals: tuple[Rival, ...]
    left_out: dict[str, str]


def available(names: Sequence[str] = ()) -> Available:
    """Return the rivals of those names in that order, ["all"], or the usual ones for none.

    Raises Refusal for a name that no rival has.
    """
    known = {rival.name: rival for rival in _CLOSED_FORMS}
    missing: dict[str, str] = {}
    if list(names) == ["all"]:
        names = [*known, *missing]
    for i, name in enumerate(names):
        if name not in known and name not in missing:
            raise unknown_name(f"rivals.{i}", name, [*known, *missing])
    chosen = names or DEFAULT
    return Available(
        tuple(known[name] for name in dict.fromkeys(chosen) if name in known),
        {name: missing[name] for name in chosen if name in missing},
    )


DEFAULT = ("paper", "crossings", "divider")

"""The rivals by name: the closed forms, and finite elements where they are installed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.special import ndtri

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.bush import CHOSEN, bush
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.fitted_models import fit_divider
from unitcad.attenuation.edge.lab_fit import LabFit
from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.attenuation.inputs import EstimateInput
from unitcad.cache import MemoryStore, Store
from unitcad.errors import unknown_name
from unitcad.experiments import element_rivals
from unitcad.experiments.draws import Draws, Rival


def _closed_form(path: Callable[[Units], Any]) -> Callable[[EstimateInput, Draws], np.ndarray]:
    return lambda variant, draws: np.asarray(path(draws.units(variant)))


KAPPA = (0.02, 5.0)
"""The divider's constant where the draws are held to the measured levels afterwards: far wider than these allow."""


def _divider(variant: EstimateInput, draws: Draws) -> np.ndarray:
    if draws.held:
        return np.asarray(cf.divider(draws.units(variant), draws.between("kappa", *KAPPA)))
    kappas = _resampled_kappas()
    kappa = kappas[(draws.uniform("kappa") * len(kappas)).astype(int)]
    return np.asarray(cf.divider(draws.units(variant), kappa))


def _bush(variant: EstimateInput, draws: Draws) -> np.ndarray:
    units = draws.units(variant)
    filled = bush(units, replace(CHOSEN, filled=True))
    return np.where(draws.uniform("gap filled") < 0.5, filled, bush(units))


@cache
def _resampled_kappas(count: int = 200) -> np.ndarray:
    """Fit the divider to the measured units drawn with replacement; a draw of one contrast alone fits nothing."""
    table, rng = measured_table(), np.random.default_rng(1)
    picks = (rng.integers(0, len(table.names), len(table.names)) for _ in range(10 * count))
    kept = [pick for pick, _ in zip(_varied(picks, table.contrast), range(count), strict=False)]
    return fit_divider(table, np.array([np.bincount(pick, minlength=len(table.names)) for pick in kept]))[0]


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
        "fitted",
        "the empirical divider of the layers' moduli, fitted to the measured levels",
        _divider,
    ),
    Rival(
        "bush",
        "the layers as rubber bushes in a row, whose stiffness against a sideways motion follows from their lengths",
        _bush,
    ),
)


@dataclass(frozen=True)
class Available:
    """The rivals that can be asked here, and why others can't, by name."""

    rivals: tuple[Rival, ...]
    left_out: dict[str, str]


def available(
    names: Sequence[str] = (), store: Store | None = None, smallest: float = element_rivals.SMALLEST
) -> Available:
    """Return the rivals of those names in that order, ["all"], or the usual ones for none.

    `store` keeps what is costly; `smallest`: the least amplitude that is read, m. Raises Refusal for a name that no
    rival has.
    """
    elements = element_rivals.element_rivals(store or MemoryStore(), smallest)
    known = {rival.name: rival for rival in (*_CLOSED_FORMS, *elements)}
    chosen = tuple(known) if list(names) == ["all"] else tuple(names) or DEFAULT
    for i, name in enumerate(chosen):
        if name not in known:
            raise unknown_name(f"rivals.{i}", name, known)
    missing = [name for name in chosen if known[name].costly and not element_rivals.installed()]
    return Available(
        tuple(known[name] for name in dict.fromkeys(chosen) if name not in missing),
        dict.fromkeys(missing, element_rivals.MISSING),
    )


def of_lab(rivals: Sequence[Rival], fit: LabFit) -> tuple[Rival, ...]:
    """Return rivals with a lab's own constants: the divider's from its fit; a factor of all readings cancels."""
    return tuple(_lab_divider(rival, fit) if rival.name == "fitted" else rival for rival in rivals)


def _lab_divider(rival: Rival, fit: LabFit) -> Rival:
    one = fit.model["fitted"]
    at = list(one.constants).index("kappa")
    spread = one.discrepancy * float(np.sqrt(one.covariance[at][at]))

    def levels(variant: EstimateInput, draws: Draws) -> np.ndarray:
        kappa = one.constants["kappa"] * np.exp(spread * ndtri(draws.uniform("kappa")))
        return np.asarray(cf.divider(draws.units(variant), kappa))

    return replace(rival, levels=levels)


DEFAULT = ("crossings", "fitted", "bush", "mechanics-axial-edge", "mechanics-flat-edge", "mechanics-flat-skin")
"""The rivals of a lab that names none."""
CLOSED_FORMS = tuple(name for name in DEFAULT if not name.startswith("mechanics"))
"""Those of them that are formulas: a draw is a matter of microseconds."""

"""Young's modulus from a tensile curve by every usual method, since defensible ones differ. SI, engineering values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unitcad.lab.hyperelastic import HyperelasticFit, Law, fit_law, least_points

SECANTS = (0.10, 0.15, 0.25, 0.50, 1.00)
SLOPE_TO = 0.25
LAWS: tuple[tuple[Law, float], ...] = (
    ("neo-Hooke", 0.5),
    ("Mooney", 1.0),
    ("Mooney", 3.0),
    ("Yeoh", 1.0),
    ("Ogden", 1.0),
)
"""Each law with the strain up to which it is fitted."""
MOST_LAW_STRAIN = 1.0
"""A law that is fitted beyond this is shown, but it is no statement about small strain."""
WIDEST_GAP = 0.5
"""Between two points of a curve, as a part of the strain of use, or of a secant's strain: nothing is made up beyond."""
_GRID = 41
_PASSES = 3


@dataclass(frozen=True)
class Modulus:
    """One method's Young's modulus of one curve, Pa; None with the reason where the method can't be used.

    `defensible`: it may stand for the modulus at the strain of use, and counts in the range of methods.
    """

    method: str
    value: float | None
    reason: str = ""
    defensible: bool = True
    fit: HyperelasticFit | None = None


@dataclass(frozen=True)
class Toe:
    """The start of a curve: neo-Hooke's law with a shifted origin, fitted from the first point to a strain.

    `origin`: the strain at which the law's stress is zero (slack positive, an offset of the force either way).
    `youngs_modulus`: the law's, Pa.
    """

    origin: float
    youngs_modulus: float
    up_to: float

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return the fitted nominal stress (Pa) at engineering strains as recorded."""
        stretch = 1.0 + np.asarray(strain, float) - self.origin
        return self.youngs_modulus / 3.0 * (stretch - stretch**-2)

    def secant(self, low: float, high: float) -> float:
        """Return the mean secant modulus (Pa) between two strains, from the fitted origin."""
        stretch = 1.0 + np.linspace(low, high, _GRID)
        return float(np.mean(self.youngs_modulus / 3.0 * (stretch - stretch**-2) / (stretch - 1.0)))


def fit_toe(strain: np.ndarray, stress: np.ndarray, up_to: float) -> Toe | None:
    """Fit the start of a curve up to a strain by least squares; None with fewer than three points, or no solution."""
    from scipy.optimize import least_squares

    kept = strain <= up_to
    x, y = strain[kept], stress[kept]
    if len(x) < 3 or np.ptp(x) < 0.25 * up_to:
        return None
    slope, offset = np.polyfit(x, y, 1)
    if slope <= 0.0:
        return None

    def misfit(p: np.ndarray) -> np.ndarray:
        stretch = 1.0 + x - p[1]
        return p[0] / 3.0 * (stretch - stretch**-2) - y / slope

    found = least_squares(
        misfit, [1.0, -offset / slope], bounds=([1e-6, -0.5], [1e3, float(x.max())]), xtol=1e-14, ftol=1e-14
    )
    return Toe(float(found.x[1]), float(found.x[0] * slope), up_to)


def fit_start(strain: np.ndarray, stress: np.ndarray, high: float) -> Toe | None:
    """Fit the start of a curve up to the strain `high` counted from the fitted origin; None as `fit_toe`."""
    toe = fit_toe(strain, stress, high)
    for _ in range(_PASSES if toe else 0):
        further = fit_toe(strain, stress, high + max(toe.origin, 0.0)) if toe else None
        toe = further or toe
    return toe


def secant(strain: np.ndarray, stress: np.ndarray, at: float) -> float | None:
    """Return stress over strain at a strain, Pa, interpolated; None where no points of the curve are near it."""
    if not strain[0] <= at <= strain[-1]:
        return None
    after = int(np.searchsorted(strain, at))
    if strain[after] > at and strain[after] - strain[after - 1] > WIDEST_GAP * at:
        return None
    return float(np.interp(at, strain, stress)) / at


def default_method(low: float, high: float) -> str:
    """Return the default method's name for a strain of use."""
    return f"secant over {100 * low:.3g} to {100 * high:.3g} %, toe fitted"


def moduli(strain: np.ndarray, stress: np.ndarray, low: float, high: float) -> tuple[Modulus, ...]:
    """Return Young's modulus by every method, the default first; strain rises, stress in Pa, use is `low` to `high`."""
    return (
        _default(strain, stress, low, high),
        *_secants(strain, stress),
        _slope(strain, stress),
        *_laws(strain, stress, high),
    )


def by_name(methods: tuple[Modulus, ...]) -> Mapping[str, Modulus]:
    """Return the methods by their names."""
    return {one.method: one for one in methods}


def _default(strain: np.ndarray, stress: np.ndarray, low: float, high: float) -> Modulus:
    name = default_method(low, high)
    if strain[-1] < high:
        return Modulus(name, None, f"the curve ends at {100 * strain[-1]:.3g} %")
    toe = fit_start(strain, stress, high)
    if toe is None:
        return Modulus(name, None, f"too few points below {100 * high:.3g} %, or no rising stress there")
    begin, end = _widest_gap(strain - toe.origin, low, high)
    if end - begin > WIDEST_GAP * (high - low):
        ends = f"{100 * (begin + toe.origin):.3g} and {100 * (end + toe.origin):.3g} %"
        return Modulus(name, None, f"the curve has no point between {ends} strain")
    return Modulus(name, toe.secant(low, high))


def _widest_gap(strain: np.ndarray, low: float, high: float) -> tuple[float, float]:
    """Return the ends of the widest gap between `low`, the points within, and `high`."""
    points = np.concatenate([[low], strain[(strain > low) & (strain < high)], [high]])
    at = int(np.argmax(np.diff(points)))
    return float(points[at]), float(points[at + 1])


def _secants(strain: np.ndarray, stress: np.ndarray) -> list[Modulus]:
    made = []
    for at in SECANTS:
        standard = " (ISO 37, ASTM D412)" if at == 1.0 else ""
        value = secant(strain, stress, at)
        spans = strain[0] <= at <= strain[-1]
        missing = "no points near it" if spans else f"the curve spans {100 * strain[0]:.3g} to {100 * strain[-1]:.3g} %"
        reason = "" if value is not None else missing
        made.append(Modulus(f"secant at {100 * at:g} %{standard}", value, reason))
    return made


def _slope(strain: np.ndarray, stress: np.ndarray) -> Modulus:
    name = f"slope 0 to {100 * SLOPE_TO:g} % with offset"
    kept = strain <= SLOPE_TO
    if kept.sum() < 3 or strain[-1] < SLOPE_TO:
        return Modulus(name, None, "fewer than three points, or the curve ends before")
    return Modulus(name, float(np.polyfit(strain[kept], stress[kept], 1)[0]))


def _laws(strain: np.ndarray, stress: np.ndarray, used: float) -> list[Modulus]:
    made = []
    for law, up_to in LAWS:
        terms = ", one term," if law == "Ogden" else ""
        name = f"{law}{terms} up to {100 * up_to:g} %"
        count = int(((strain >= 0.0) & (strain <= up_to)).sum())
        if strain[-1] < up_to or count < least_points(law):
            made.append(Modulus(name, None, f"the curve ends at {100 * strain[-1]:.3g} %, or has too few points"))
            continue
        fit = fit_law(law, strain, stress, up_to, used)
        unstable = "; ".join(f"unstable in {mode} from {100 * at:.3g} %" for mode, at in fit.unstable.items())
        wide = f"fitted up to {100 * up_to:g} %, far beyond the use" if up_to > MOST_LAW_STRAIN else ""
        reason = "; ".join(part for part in (unstable, wide) if part)
        made.append(Modulus(name, fit.youngs_modulus, reason, not reason, fit))
    return made

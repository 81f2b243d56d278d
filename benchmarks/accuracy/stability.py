"""Extreme media: compliance against 60 digits, Thomson-Haskell beside it; the response against exact answers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy import extreme_responses, thomson_haskell
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table
from unitcad.accuracy.random_media import CLASSES
from unitcad.attenuation.layered import (
    Damping,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LayeredMedium,
    LossFactor,
    UniformDisc,
)

COMPLIANCE = Path(__file__).parent / "references" / "compliance.json"
LIMIT = 1e-13
"""The promised error of the compliance, normwise over the problem's condition number."""


@dataclass(frozen=True)
class Case:
    """A frozen 60-digit compliance: medium, wavenumber (1/m), frequency (rad/s), and what it is extreme in."""

    kind: str
    medium: LayeredMedium
    k: float
    omega: float
    exact: np.ndarray
    condition: float

    @property
    def kh(self) -> float:
        """k times the thickest layer."""
        return self.k * max((layer.thickness for layer in self.medium.layers), default=0.0)

    @property
    def contrast(self) -> float:
        """Largest over least Young's modulus."""
        moduli = [body.youngs_modulus for body in (*self.medium.layers, self.medium.half_space)]
        return max(moduli) / min(moduli)

    @property
    def nu(self) -> float:
        """The largest Poisson's ratio."""
        return max(body.poisson_ratio for body in (*self.medium.layers, self.medium.half_space))

    @property
    def thinnest(self) -> float:
        """m; 1 without a layer."""
        return min((layer.thickness for layer in self.medium.layers), default=1.0)


def cases() -> list[Case]:
    """Return the frozen references, made by references/make_compliance.py."""
    return [_case(data) for data in json.loads(COMPLIANCE.read_text("utf-8"))]


def run(quick: bool, say: Say) -> Result:
    """Compute a third of the frozen cases and a medium a class if quick, else all and six; `study` takes any number."""
    return study(len(CLASSES) if quick else 6 * len(CLASSES), say, every=3 if quick else 1)


def study(media: int, say: Say, seed: int = 0, journal: Path | None = None, every: int = 1) -> Result:
    """Compute every so many of the frozen cases, exact answers of the response, and `media` random media.

    The comparisons of media that this code wrote into `journal` before are taken from there, new ones are appended.
    """
    known = cases()[::every]
    say(f"{len(known)} cases")
    condition = np.array([case.condition for case in known])
    error = np.array([_error(case.medium.compliance(case.k, case.omega), case) for case in known])
    own = error / condition
    plain = np.array([_error(thomson_haskell.compliance(c.medium, c.k, c.omega), c) for c in known]) / condition
    groups = tuple(
        (
            axis,
            label,
            int(inside.sum()),
            float(error[inside].max()),
            float(own[inside].max()),
            float(condition[inside].max()),
            float(np.median(plain[inside])),
            _share(plain[inside]),
        )
        for axis, of, bins in _AXES
        for values in [np.array([of(case) for case in known])]
        for label, low, high in bins
        if (inside := (values >= low) & (values <= high)).any()
    )
    exact = tuple(_exact_answers())
    say("responses")
    extreme = tuple(extreme_responses.rows(extreme_responses.cases()))
    surveyed: list[extreme_responses.Row] = []
    for i, found in enumerate(extreme_responses.survey(media, seed, journal)):
        say(f"random media: {i + 1} of {media}")
        surveyed += found
    wide = [i for i, case in enumerate(known) if case.kh > 0]
    return Result(
        suite="stability",
        title="Stability at the extremes",
        text=(
            f"Surface compliance at {len(known)} seeded cases against 60-digit values by another method (the global "
            "matrix, mpmath), normwise and over the problem's own condition number. The plain Thomson-Haskell "
            "propagator multiplies growing exponentials and keeps P and S apart as omega goes to 0. It is wrong by "
            "more than one percent times the condition number, or no number, in the share of cases shown. **unitcad "
            "promises** two bounds. The compliance is within 1e-13 times the condition number, which is large near "
            f"branch points (here up to {condition.max():.0e}, with a plain error of up to {error.max():.1e}). "
            "The range: nu from 0 to 1/2 exactly, contrast 1e-8 to 1e8, thickness 1e-9 to 0.1 m, omega from 0 to 6e3 "
            "rad/s, "
            f"k h up to {max(case.kh for case in known):.0e}, any damping or none. The response's error is below "
            "`error_r` and `error_z` at each radius, whether or not rtol was reached. The reference of the responses "
            "shares no code with the solver: the global matrix in balls of 128 bits and more (python-flint), with "
            "its own panels and closed forms. A film thinner than some micrometres, or nearly fluid, needs more "
            "wavenumbers than the limit: a small rtol is then often not met."
        ),
        tables=(
            Table(
                "Compliance, by what is extreme",
                (
                    "in",
                    "range",
                    "cases",
                    "unitcad, worst error",
                    "over the condition number",
                    "largest condition number",
                    "Thomson-Haskell, median",
                    "Thomson-Haskell, off by more than 1 %",
                ),
                groups,
                _where_it_breaks(known, plain),
            ),
            Table("Exact answers of the response", ("case", "error"), tuple((n, e) for n, e, _ in exact)),
            *extreme_responses.tables(extreme, surveyed),
        ),
        plots=(
            Plot(
                "Error over the condition number against k h (thickest layer; infinite errors on the upper edge)",
                "k h",
                "error",
                {
                    name: tuple((known[i].kh, float(np.clip(errors[i], 1e-17, 1e3))) for i in wide)
                    for name, errors in (("unitcad", own), ("Thomson-Haskell", plain))
                },
                lines=False,
            ),
            extreme_responses.plot(surveyed),
        ),
        promises=(
            Promise("compliance: worst error over the condition number", float(own.max()), LIMIT),
            *(Promise(name, error, limit) for name, error, limit in exact),
            *extreme_responses.promises(extreme, surveyed),
        ),
        measured={**machine("numpy", "scipy"), "cases": len(known), "random media": media, "seed": seed},
        summary=Summary(*extreme_responses.summary(surveyed), plot=1),
    )


_Bins = Sequence[tuple[str, float, float]]
_AXES: tuple[tuple[str, Callable[[Case], float], _Bins], ...] = (
    ("k h", lambda c: c.kh, (("to 1", 0, 1), ("1 to 15", 1, 15), ("15 to 700", 15, 700), ("above 700", 700, math.inf))),
    (
        "omega, rad/s",
        lambda c: c.omega,
        (("0", 0, 0), ("6e-8", 1e-9, 1e-6), ("6e-4", 1e-6, 1e-2), ("1", 0.1, 10), ("785 and 6e3", 100, 1e4)),
    ),
    (
        "nu",
        lambda c: c.nu,
        (("to 0.49", 0, 0.49), ("0.4999999 to 1/2 - 1e-12", 0.4999, 0.5 - 1e-13), ("1/2", 0.5, 0.5)),
    ),
    ("contrast", lambda c: c.contrast, (("to 1e2", 1, 100.5), ("1e2 to 1e6", 101, 1e6), ("to 1e8", 1.1e6, 1.1e8))),
    (
        "thinnest layer, m",
        lambda c: c.thinnest,
        (("below 1e-7", 0, 1e-7), ("1e-7 to 1e-4", 1e-7, 1e-4), ("to 0.1", 1e-4, 0.2)),
    ),
    ("k beside a branch point", lambda c: float(c.kind == "branch"), (("yes", 1, 1),)),
)


def _where_it_breaks(known: list[Case], errors: np.ndarray) -> str:
    deep, slow = (np.array([case.kh > 15 for case in known]), np.array([case.omega < 0.1 for case in known]))
    rest = ~(deep | slow)
    return (
        f"Thomson-Haskell is off by more than 1 % in {_share(errors[deep])} of the cases with k h above 15 (growing "
        f"exponentials). It is so in {_share(errors[slow])} of those below 0.1 rad/s (P and S cancel), and in "
        f"{_share(errors[rest])} of all others."
    )


def _share(errors: np.ndarray) -> str:
    return f"{100 * float(np.mean(~(errors < 1e-2))):.0f} %"


def _error(compliance: np.ndarray, case: Case) -> float:
    """Return the normwise relative error; infinite for what is no number."""
    with np.errstate(all="ignore"):
        error = float(np.linalg.norm(compliance - case.exact) / np.linalg.norm(case.exact))
    return error if math.isfinite(error) else math.inf


def _case(data: dict[str, Any]) -> Case:
    *layers, below = data["bodies"]
    medium = LayeredMedium(
        [Layer(h, rho, e, nu, _damping(*loss)) for h, rho, e, nu, *loss in layers],
        HalfSpace(below[1], below[2], below[3], _damping(*below[4:])),
    )
    exact = np.array([complex(*pair) for pair in data["compliance"]]).reshape(2, 2)
    return Case(data["kind"], medium, data["k"], data["omega"], exact, data["condition"])


def _damping(tan_delta: float, viscosity: float) -> Damping:
    return KelvinVoigt(viscosity) if viscosity else LossFactor(tan_delta) if tan_delta else None


def _exact_answers() -> list[tuple[str, float, float]]:
    """Return (case, relative error, promise) of closed forms and identities of the response."""
    a, e, answers = 3.5e-3, 3e4, []
    for nu in (0.0, 0.3, 0.5):
        disc = LayeredMedium([], HalfSpace(1000, e, nu)).response(UniformDisc(a), 0.0, [0.0, a])
        centre, edge = 2 * (1 - nu**2) * a / e, 4 * (1 - nu**2) * a / (math.pi * e)
        worst = max(abs(disc.u_z[0] / centre - 1), abs(disc.u_z[1] / edge - 1))
        answers.append((f"Boussinesq's disc, centre and edge, nu = {nu}", float(worst), 1e-12))
    body = (1040.0, 15e3, 0.4999, LossFactor(0.2))
    base = HalfSpace(1900.0, 15e9, 0.3)
    whole = LayeredMedium([Layer(0.02, *body)], base).compliance(80.0, 785.0)
    cut = LayeredMedium([Layer(0.02 / 10_000, *body)] * 10_000, base).compliance(80.0, 785.0)
    gap = float(np.linalg.norm(cut - whole) / np.linalg.norm(whole))
    answers.append(("10,000 sublayers of one material", gap, LIMIT))
    forearm = [Layer(1.5e-3, 1100, 130e3, 0.49), Layer(4e-3, 950, 8970.0, 0.495), Layer(25e-3, 1050, 11960.0, 0.495)]
    undamped = LayeredMedium(forearm, HalfSpace(1900, 15e9, 0.3))
    r = np.array([3.5e-3, 50e-3, 0.525])
    coarse = undamped.response(UniformDisc(a), 785.0, r, rtol=1e-6)
    fine = undamped.response(UniformDisc(a), 785.0, r, rtol=1e-9)
    gap = float(np.max(np.abs(coarse.u_z - fine.u_z)) / np.max(np.abs(fine.u_z)))
    answers.append(("undamped, out to r/a = 150, rtol 1e-6 against 1e-9", gap, 1e-6))
    return answers

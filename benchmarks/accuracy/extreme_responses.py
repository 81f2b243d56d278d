"""Responses of extreme and of random media beside `ball_reference`: the true error and its stated bound."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy import ball_reference
from benchmarks.accuracy.hankel import DISC, OMEGA, RADII
from benchmarks.accuracy.journal import journalled
from benchmarks.accuracy.result import Cell, Plot, Promise, Table, shown
from unitcad.accuracy.random_media import CLASSES, Trial, trial
from unitcad.accuracy.survey import in_order
from unitcad.attenuation.layered import Damping, HalfSpace, KelvinVoigt, Layer, LayeredMedium, LossFactor
from unitcad.errors import UnitcadError

TOLERANCES = (0.1, 1e-3, 1e-5, 1e-7, 1e-9)
LEAST_GAIN = 1.25
"""The most that a tighter rtol's bound may be over a looser one's.

It is above 1 where neither rtol is met: the panels are then spent differently, or rounding next to the poles enters at
other wavenumbers. And where a detour that the looser one takes leaves out more than the tighter one may: the panels in
its place may then be off by 1.2 times as much. Of 2,000 random media one was
2.5 times worse for neither reason.
"""
_LEAST = 1e-15
"""Where a true error of 0 is drawn."""


STALL = 60.0
"""Processor seconds after which a response counts as stalled."""
PATIENCE = 1200.0
"""Processor seconds after which a medium counts as hung: the reference and the responses at all tolerances."""
_SERIAL = 60

Job = tuple[str, int]
"""A class and its seed."""


@dataclass(frozen=True)
class Row:
    """A response beside the reference.

    error, bound, doubt: the largest of all components over the radii, over the largest |u|. over_bound: the largest
    (error - doubt) / bound of one radius and component. Where a response has no value, error, bound and over_bound are
    infinite; where the reference has none, doubt is. seconds: of processor time.
    """

    case: str
    kind: str
    rtol: float
    error: float
    bound: float
    doubt: float
    over_bound: float
    wavenumbers: int
    seconds: float = 0.0

    @property
    def met(self) -> bool:
        """Whether the response's bound is within rtol."""
        return self.bound <= self.rtol

    @property
    def decided(self) -> bool:
        """Whether the reference is good enough to decide."""
        return self.doubt <= 0.1 * max(self.bound, 1e-12)


def rows(trials: Iterable[Trial], tolerances: Iterable[float] = TOLERANCES) -> Iterator[Row]:
    """Yield every trial at every tolerance."""
    for one in trials:
        try:
            exact = ball_reference.response(one.medium, one.load, one.omega, one.r)
        except ball_reference.TooHard:
            exact = None
        for rtol in tolerances:
            yield _row(one, rtol, exact)


def _row(one: Trial, rtol: float, exact: ball_reference.Reference | None) -> Row:
    start = time.process_time()
    try:
        response = one.medium.response(one.load, one.omega, one.r, rtol=rtol)
    except UnitcadError:
        response = None
    seconds = time.process_time() - start
    if response is None:
        return Row(one.name, one.kind, rtol, math.inf, math.inf, math.inf, math.inf, 0, seconds)
    components = ("r", "theta", "z") if one.load.direction == "tangential" else ("r", "z")
    u = np.array([getattr(response, f"u_{name}") for name in components])
    bound = np.array([getattr(response, f"error_{name}") for name in components])
    if exact is None:
        exact = ball_reference.Reference(u, np.full(u.shape, np.inf), 0)
    wrong = np.abs(u - exact.u)
    scale, over = float(np.max(np.abs(exact.u))), float(np.max(np.maximum(wrong - exact.doubt, 0.0) / bound))
    if not (np.isfinite(u).all() and np.isfinite(bound).all()):
        over = math.inf
    worst, doubt = float(np.max(wrong)) / scale, float(np.max(exact.doubt)) / scale
    return Row(one.name, one.kind, rtol, worst, response.error / scale, doubt, over, response.wavenumbers, seconds)


def cases() -> list[Trial]:
    """Return media of extreme contrast, Poisson's ratio, frequency, thickness and damping."""

    def two(
        name: str, top: float, below: float, nu: float, thickness: float, damping: Damping, omega: float = OMEGA
    ) -> Trial:
        layer = Layer(thickness, 1050.0, top, nu, damping)
        medium = LayeredMedium([layer], HalfSpace(1050.0, below, nu, damping))
        return Trial(name, "extreme", medium, DISC, omega, RADII)

    loss = LossFactor(0.2)
    return [
        two("stiff on soft, 1e6", 1e9, 1e3, 0.45, 1e-3, loss),
        two("soft on stiff, 1e6", 1e4, 1e10, 0.45, 5e-3, loss),
        two("nu = 1/2 - 1e-9", 1e4, 1e5, 0.5 - 1e-9, 2e-3, KelvinVoigt(2.0)),
        two("nu = 1/2, no damping", 2e5, 2e4, 0.5, 2e-3, None),
        two("1 rad/s, no damping", 1e4, 1e5, 0.49, 2e-3, None, 1.0),
        two("6e3 rad/s", 1e5, 1e6, 0.49, 2e-3, loss, 6e3),
        two("film of 0.1 mm", 1e7, 1e4, 0.49, 1e-4, loss),
    ]


def survey(count: int, seed: int = 0, journal: Path | None = None) -> Iterator[list[Row]]:
    """Yield the rows of `count` random media, one of each of the `CLASSES` in turn.

    Many media go to worker processes. With a `journal` the study resumes from it.
    """
    jobs = [(CLASSES[i % len(CLASSES)], 10_000 * seed + i // len(CLASSES)) for i in range(count)]
    finished = journalled(jobs, _surveyed, journal) if journal else _surveyed(jobs)
    return ([Row(**row) for row in media] for media in finished)


def _surveyed(jobs: Sequence[Job]) -> Iterator[list[dict[str, Any]]]:
    return in_order(_medium, jobs, PATIENCE, _hung, _SERIAL)


def _medium(job: Job) -> list[dict[str, Any]]:
    return [asdict(row) for row in rows([trial(*job)])]


def _hung(job: Job) -> list[dict[str, Any]]:
    inf = math.inf
    return [asdict(Row(f"{job[0]} {job[1]}", job[0], rtol, inf, inf, inf, inf, 0, inf)) for rtol in TOLERANCES]


def tables(extreme: Sequence[Row], surveyed: Sequence[Row]) -> tuple[Table, ...]:
    """Tabulate the extreme media one by one, the random ones by class and by tolerance."""
    columns = (
        "media",
        "within rtol by their bound",
        "largest bound",
        "largest error",
        "bounds broken",
        "largest error over its bound",
        "the reference decides",
        "most wavenumbers",
        "longest, processor seconds",
    )
    return (
        Table(
            "Response of extreme media",
            ("case", "rtol", "error", "its bound", "the reference's doubt"),
            tuple((r.case, r.rtol, r.error, r.bound, r.doubt) for r in extreme),
            "u_r and u_z under the motor's disc at 13 radii, the largest over the largest |u|.",
        ),
        Table(
            "Response of random media, by class",
            ("class", *columns),
            tuple((kind, *_summary(group)) for kind in CLASSES if (group := [r for r in surveyed if r.kind == kind])),
            "A disc, normal or tangential, four radii, five tolerances, seeded. A bound is broken where the error of "
            "one component at one radius exceeds it by more than the reference's doubt, or where there is no value. "
            "The reference decides where that doubt is below a tenth of the bound; where a medium takes it too long it "
            "never does.",
        ),
        Table(
            "Response of random media, by tolerance",
            ("rtol", *columns),
            tuple((rtol, *_summary([r for r in surveyed if r.rtol == rtol])) for rtol in TOLERANCES),
        ),
    )


def plot(surveyed: Sequence[Row]) -> Plot:
    """Plot the bound against the true error; a point above the line is a broken bound.

    Where the reference does not decide, its own error may be what is above.
    """
    known = [row for row in surveyed if math.isfinite(row.error + row.bound + row.doubt)]
    shown = [row for row in known if row.decided or row.over_bound > 1]
    ends = [f(r.bound for r in shown) for f in (min, max)]
    line = "error = bound"
    points = {k: tuple((r.bound, max(r.error, _LEAST)) for r in shown if r.kind == k) for k in CLASSES}
    return Plot(
        "Random media, where the reference decides: true error against its bound",
        "bound over the largest |u|",
        "error over the largest |u|",
        {line: tuple((end, end) for end in ends), **points},
        lines=False,
        curves=(line,),
    )


def summary(surveyed: Sequence[Row]) -> tuple[tuple[tuple[str, str, str], ...], str]:
    """Return rows of (for what, error, what to pick), and the response that comes closest to its bound."""
    picks = []
    media = len({row.case for row in surveyed})
    for rtol in TOLERANCES:
        group = [row for row in surveyed if row.rtol == rtol]
        met = sum(row.met for row in group) / len(group)
        slowest = max(row.seconds for row in group)
        picks.append(
            (
                f"displacement of {media} extreme random media, with a bound",
                f"{rtol:g}",
                f"`response(rtol={rtol:g})`: {100 * met:.3g} % within rtol, at most {shown(slowest)} s",
            )
        )
    worst = max(surveyed, key=lambda row: row.over_bound)
    broken = sum(not row.over_bound <= 1 for row in surveyed)
    return tuple(picks[::2]), (
        f"{_in_words(worst)} at rtol {worst.rtol:g}: error {shown(worst.over_bound)} of its bound; "
        f"{broken or 'no'} bounds broken in {len(surveyed)} responses of {media} media"
    )


_WORDS = {
    "ordinary": "an ordinary medium",
    "film on the forearm": "a film on the forearm",
    "nearly fluid film": "a nearly fluid film",
    "inverted": "a medium of stiff layers over soft ones",
    "zero thickness": "a medium with a layer of no thickness",
    "large k a": "a load that is large to the wavelength",
    "undamped": "an undamped medium",
    "partly damped": "a partly damped medium",
}


def _in_words(row: Row) -> str:
    """Return a random medium's class and seed in words."""
    return f"{_WORDS.get(row.kind, f'a medium of {row.kind}')} (seed {row.case.split()[-1]})"


def promises(extreme: Sequence[Row], surveyed: Sequence[Row]) -> tuple[Promise, ...]:
    """Return what a solver whose bounds do not hold, or a reference that can't decide, would break."""
    both = (*extreme, *surveyed)
    return (
        Promise("responses: largest error over its bound", float(np.max([r.over_bound for r in both])), 1.0),
        Promise("responses: share that the reference can't decide", float(np.mean([not r.decided for r in both])), 0.1),
        Promise("responses: how many took over a minute", sum(row.seconds > STALL for row in both), 0),
        Promise("responses: a tighter rtol's bound over a looser one's", _worsening(both), LEAST_GAIN),
    )


def _worsening(responses: Sequence[Row]) -> float:
    """Return the largest ratio of a bound to the least one of the same medium at a larger rtol."""
    worst = 0.0
    for row in responses:
        looser = [r.bound for r in responses if r.case == row.case and r.rtol > row.rtol]
        worst = max(worst, row.bound / min(looser, default=float("inf")))
    return worst


def _summary(group: Sequence[Row]) -> tuple[Cell, ...]:
    return (
        len({row.case for row in group}),
        sum(row.met for row in group),
        max(row.bound for row in group),
        max(row.error for row in group),
        sum(not row.over_bound <= 1 for row in group),
        max(row.over_bound for row in group),
        sum(row.decided for row in group),
        max(row.wavenumbers for row in group),
        max(row.seconds for row in group),
    )

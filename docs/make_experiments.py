"""Writes the computed tables of docs/experiments.md, between its markers, and its plot. Some minutes of one core.

python docs/make_experiments.py
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from unitcad.attenuation.mechanics.unknowns import CHOICES, Draw
from unitcad.cache import DiskStore, Store, default_root
from unitcad.experiments.conditioning import COSTLY_POOL, misfits
from unitcad.experiments.draws import Draws
from unitcad.experiments.element_rivals import NAMES
from unitcad.experiments.lab_file import Lab, LabFile, load_lab
from unitcad.experiments.protocol import Condition, Ratio
from unitcad.experiments.range_plot import svg
from unitcad.experiments.ranking import Predictions
from unitcad.experiments.rivals import DEFAULT, available
from unitcad.experiments.study import predictions, study
from unitcad.experiments.study_files import shown

HERE = Path(__file__).parent
PLATE, GEL = "rigid-plate", "gel-50kpa"


def by_body(unit: str, frequency_hz: float = 200) -> Ratio:
    """The unit on the plate over the same on gel."""
    return Ratio(Condition(unit, frequency_hz, PLATE), Condition(unit, frequency_hz, GEL))


def by_frequency(unit: str, body: str = PLATE) -> Ratio:
    """The unit at 200 over 60 Hz."""
    return Ratio(Condition(unit, 200, body), Condition(unit, 60, body))


def by_unit(above: str, below: str, frequency_hz: float = 200, body: str = PLATE) -> Ratio:
    """One unit over another."""
    return Ratio(Condition(above, frequency_hz, body), Condition(below, frequency_hz, body))


_BODY = by_body("encapsulating E10/D10")
_SWEEP = by_frequency("encapsulating D10/E10", GEL)
_DESIGN = by_unit("encapsulating E10/D30", "embedded E10/D30")
ROWS: dict[str, tuple[Ratio, ...]] = {
    "soft inside: on a plate over gel": (_BODY,),
    "stiff inside: on a plate over gel": (by_body("encapsulating D10/E10"),),
    "stiff inside: two frequencies, on gel": (_SWEEP,),
    "the first and the third": (_BODY, _SWEEP),
    "both, and two designs": (_BODY, _SWEEP, _DESIGN),
    "stiff inside: two frequencies, on a plate": (by_frequency("encapsulating D10/E10"),),
    "soft inside: two frequencies, on gel": (by_frequency("embedded E10/D10", GEL),),
    "soft inside: two frequencies, on a plate": (by_frequency("embedded E10/D10"),),
}


def predicted(lab: Lab, store: Store | None = None) -> tuple[Predictions, Predictions]:
    """What the usual rivals predict for a lab, and for one whose vibrometer shows any motion however small."""
    ideal = replace(lab, settings=structs.replace(lab.settings, smallest_um=1e-6))
    of = [available((), store, one.settings.smallest_um * 1e-6) for one in (lab, ideal)]
    return predictions(lab, of[0].rivals), predictions(ideal, of[1].rivals)


def row(what: str, predicted: tuple[Predictions, Predictions]) -> str:
    """A row of the table: what is compared, the ratios, their bits."""
    ratios = "; ".join(str(ratio) for ratio in ROWS[what])
    found = [one.information(ROWS[what]) for one in predicted]
    return f"| {what} | {ratios} | {' | '.join(f'{one.bits:.2f} ± {one.error:.2f}' for one in found)} |"


def table(predicted: tuple[Predictions, Predictions]) -> str:
    """The comparison of some measurements."""
    head = ["| what | ratios | bits | bits, any motion read |", "| --- | --- | --- | --- |"]
    return "\n".join([*head, *(row(what, predicted) for what in ROWS)])


def filled(text: str, name: str, content: str) -> str:
    """The page with a computed block made again."""
    pattern = rf"(<!-- computed: {name} -->\n)(?:(?!<!--).)*(<!-- end -->)"
    text, count = re.subn(pattern, lambda m: f"{m[1]}{content}\n{m[2]}", text, flags=re.DOTALL)
    if count != 1:
        raise ValueError(f"docs/experiments.md has {count} blocks named {name}")
    return text


FIGURES = {
    "soft inside: on a plate over gel": 1.48,
    "stiff inside: two frequencies, on gel": 1.20,
    "the first and the third": 2.04,
    "both, and two designs": 2.32,
    "soft inside: two frequencies, on gel": 0.28,
}
"""Bits that a prototype with six rivals gave."""


FOUR = ("crossings", "fitted", *NAMES)
"""Four rivals by finite elements beside two closed forms."""


def pooled(lab: Lab, store: Store | None, *rows: str, rivals: Sequence[str] = DEFAULT, **changes: Any) -> Predictions:
    """Rivals' prior in the readings of rows, as many draws as the pools have that are held."""
    ends = {end for row in rows for ratio in ROWS[row] for end in (ratio.above, ratio.below)}
    settings = structs.replace(lab.settings, held_to_levels=False, **changes)
    settings = structs.replace(settings, element_draws=COSTLY_POOL * settings.element_draws)
    part = replace(lab, settings=settings, variants={c: v for c, v in lab.variants.items() if c in ends})
    return predictions(part, available(rivals, store, settings.smallest_um * 1e-6).rivals)


def shared(pool: Predictions, shares: Callable[[str, int], np.ndarray | None]) -> Predictions:
    """The finite elements of a pool with other shares of their draws, by rival's name and count of draws."""
    found = []
    for name, own in zip(pool.rivals, pool.shares, strict=True):
        new = shares(name, len(own)) if name.startswith("mechanics") else None
        found.append(own if new is None else new / new.sum())
    return replace(pool, shares=tuple(found))


def squares(lab: Lab, store: Store | None, settings: LabFile) -> dict[str, np.ndarray]:
    """Of each draw of the finite elements the squared misfit of the nine levels over the variance of one."""
    variance = settings.noise**2 + settings.discrepancy**2 / 2.0
    draws = COSTLY_POOL * settings.element_draws
    return {
        rival.name: np.sum(misfits(rival, Draws(draws, settings.seed, rival.name), settings) ** 2, axis=1) / variance
        for rival in available(FOUR, store).rivals
        if rival.costly
    }


def as_drawn(_: str, count: int) -> np.ndarray:
    """The draws whose gap is open, without a floor, with the circuit, bonded."""
    draws = (Draw(1, index, count) for index in range(count))
    kept = [draw.either("contact") and not any(draw.either(name) for name in CHOICES[1:]) for draw in draws]
    return np.array(kept, dtype=float)


def causes(lab: Lab, store: Store | None) -> str:
    """The figures of a prototype, and ours as each suspected cause of the difference is changed."""
    pool, misfit = pooled(lab, store, *FIGURES), squares(lab, store, lab.settings)
    ideal = pooled(lab, store, *FIGURES, smallest_um=1e-6)

    def best(share: float) -> Callable[[str, int], np.ndarray]:
        return lambda name, count: (misfit[name] <= np.quantile(misfit[name], share)).astype(float)

    def strict(name: str, count: int) -> np.ndarray:
        return np.exp((misfit[name].min() - misfit[name]) / 2.0)

    four = pooled(lab, store, *FIGURES, rivals=FOUR, smallest_um=1e-6)
    held = predictions(lab, available((), store, lab.settings.smallest_um * 1e-6).rivals)
    variants = {
        "as the command does: held to the nine levels": held,
        "the prior alone": pool,
        "finite elements: the best tenth of the draws": shared(pool, best(0.1)),
        "finite elements: the likelihood at a discrepancy of 0.15, no more": shared(pool, strict),
        "finite elements: one assembly, gap open, no floor, circuit, bonded": shared(pool, as_drawn),
        "any motion read": ideal,
        "any motion read, the best tenth": shared(ideal, best(0.1)),
        "any motion read, discrepancy 0.05 and noise 5 %": replace(ideal, noise=0.05, discrepancy=0.05),
        "any motion read, two closed forms and four of finite elements": four,
        "the same, the best tenth": shared(four, best(0.1)),
        "the same, the likelihood at a discrepancy of 0.15, no more": shared(four, strict),
    }
    lines = [
        f"| | {' | '.join(FIGURES)} | effective draws |",
        f"| --- | {' | '.join('---' for _ in FIGURES)} | --- |",
        f"| the prototype | {' | '.join(f'{bits:.2f}' for bits in FIGURES.values())} | not known |",
    ]
    for what, one in variants.items():
        cells = [f"{found.bits:.2f} ± {found.error:.2f}" for found in (one.information(ROWS[row]) for row in FIGURES)]
        least = min(n for n, name in zip(one.effective_draws, one.rivals, strict=True) if name.startswith("mechanics"))
        lines.append(f"| {what} | {' | '.join(cells)} | {least:.0f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    lab, store = load_lab("paper"), DiskStore(default_root())
    page = HERE / "experiments.md"
    data = study(lab, store=store)
    text = filled(page.read_text("utf-8"), "comparison", table(predicted(lab, store)))
    best = [f"| {'; '.join(one['experiments'])} | {one['bits']:.2f} ± {one['error']:.2f} |" for one in data["sets"]]
    text = filled(text, "causes", causes(lab, store))
    text = filled(text, "best", "\n".join(["| measured together | bits |", "| --- | --- |", *best]))
    text = filled(text, "settles", data["settles"])
    page.write_text(text, "utf-8")
    (HERE / "experiments-ranges.svg").write_text(
        svg(shown(data, 6), [rival["name"] for rival in data["rivals"]]), "utf-8"
    )

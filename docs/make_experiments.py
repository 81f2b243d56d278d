"""Writes the computed table of docs/experiments.md, between its markers, and its plot. Some minutes of one core.

python docs/make_experiments.py
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from msgspec import structs

from unitcad.cache import DiskStore, Store, default_root
from unitcad.experiments.lab_file import Lab, load_lab
from unitcad.experiments.protocol import Condition, Ratio
from unitcad.experiments.range_plot import svg
from unitcad.experiments.ranking import Predictions
from unitcad.experiments.rivals import available
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


if __name__ == "__main__":
    lab, store = load_lab("paper"), DiskStore(default_root())
    page = HERE / "experiments.md"
    data = study(lab, store=store)
    text = filled(page.read_text("utf-8"), "comparison", table(predicted(lab, store)))
    best = [f"| {'; '.join(one['experiments'])} | {one['bits']:.2f} ± {one['error']:.2f} |" for one in data["sets"]]
    text = filled(text, "best", "\n".join(["| measured together | bits |", "| --- | --- |", *best]))
    text = filled(text, "settles", data["settles"])
    page.write_text(text, "utf-8")
    (HERE / "experiments-ranges.svg").write_text(
        svg(shown(data, 6), [rival["name"] for rival in data["rivals"]]), "utf-8"
    )

"""A procedure written out: Markdown for the bench, JSON for programs, CSV for the bill, a drawing a pour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import count
from typing import Any

import msgspec

from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bill import in_words, to_csv
from unitcad.casting.cast_colour import cast_colour
from unitcad.casting.figures import Figure
from unitcad.casting.procedure import Procedure
from unitcad.casting.time_line import duration
from unitcad.export import svg
from unitcad.json_text import all_finite
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape.body import Body
from unitcad.text import markdown, number, spaced


def _nine_digits(text: str) -> float:
    """Return a number to nine significant digits; with its point or exponent a short text has no more."""
    return float(text) if len(text) <= 10 else float(f"{float(text):.9g}")


_NINE_DIGITS: msgspec.json.Decoder[Any] = msgspec.json.Decoder(float_hook=_nine_digits)
UNPRINTED = "Nothing of this tooling has been printed yet: every clearance is a choice with a check behind it."


def files(procedure: Procedure) -> dict[str, str]:
    """Return casting.md, casting.json and bom.csv."""
    procedure = replace(procedure, bill=in_words(procedure.bill))
    return {
        "casting.md": to_markdown(procedure),
        "casting.json": to_json(procedure),
        "bom.csv": to_csv(procedure.bill),
    }


def to_json(procedure: Procedure) -> str:
    """Write the procedure as JSON: the same records; numbers to nine significant digits."""
    data = msgspec.to_builtins(procedure)
    if not all_finite(data):  # msgspec writes what is not finite as null
        raise ValueError("a number of the procedure is not finite")
    rounded = _NINE_DIGITS.decode(msgspec.json.encode(data))
    return msgspec.json.format(msgspec.json.encode(rounded), indent=1).decode() + "\n"


def to_markdown(procedure: Procedure) -> str:
    """Write the procedure for the bench: times, what is needed and printed, numbered steps, figures in an appendix."""
    numbers = count(1)

    def steps(these: Sequence[BenchStep]) -> Iterator[str]:
        for step in these:
            yield f"{next(numbers)}. **{markdown(step.title)}.** {markdown(step.text)}"
            if step.picture:
                yield from ("", f"   ![{markdown(step.title)}]({step.picture})", "")

    cavities = f"{procedure.cells} cavit{'y' if procedure.cells == 1 else 'ies'}"
    if procedure.cells > 1 and procedure.makes != "unit":
        cavities = f"{procedure.cells} units in one {procedure.makes}"
    lines = [f"# Casting {markdown(procedure.name)}", ""]
    lines += [f"Mould set {procedure.label}, {cavities}. {UNPRINTED}", ""]
    lines += ["## Time", "", *_times(procedure), ""]
    lines += ["## Needed", "", *_needed(procedure), ""]
    lines += ["## Print", "", *(f"- {markdown(text)}" for text in procedure.printing), ""]
    lines += ["## Before the first pour", "", *steps(procedure.preparation), ""]
    for pour in procedure.pours:
        lines += [f"## Pour {pour.index}: {spaced(pour.layer)}, {markdown(pour.material)}", "", *steps(pour.steps), ""]
    lines += ["## Out of the mould", "", *steps(procedure.release), ""]
    if procedure.assembly:
        lines += [f"## {procedure.last}", "", *steps(procedure.assembly), ""]
    lines += ["## Measure on the first part", "", *(f"- {markdown(text)}" for text in procedure.measure), ""]
    saves = "bench.html (unitcad report) takes down what was weighed and measured, and saves it as a cast record."
    lines += [saves, ""]
    return "\n".join([*lines, "## Appendix: figures and sources", "", *_appendix(procedure)]) + "\n"


def _times(procedure: Procedure) -> Iterator[str]:
    """Yield the earliest finish in a sentence, and the time line."""
    total, bench = duration(procedure.earliest_finish_min), duration(procedure.bench_min)
    out = "units and sheet out of their moulds" if procedure.makes == "sheet" else f"{procedure.makes} out of the mould"
    yield f"**{total}** from the printed pieces to the {out}, of which {bench} at the bench."
    if procedure.assembly:
        more = procedure.time_line[-1].end_min - procedure.earliest_finish_min
        waits = sum(step.wait_min for step in procedure.assembly)
        smear = f", of which {duration(waits)} a smear's cure" if waits else ""
        yield f"{procedure.last}: {duration(more)} more at most{smear}. Printing comes before."
    yield ""
    rows = [
        (phase.name, duration(phase.start_min), duration(phase.bench_min), duration(phase.wait_min))
        for phase in procedure.time_line
    ]
    yield from _table(("what", "begins after", "at the bench", "then wait"), rows)
    yield ""
    yield "Times at the bench are assumed; cures are the silicones' own, at the room's temperature."


def _needed(procedure: Procedure) -> list[str]:
    rows = [
        (
            markdown(i.item),
            f"{number(i.quantity, 3)} {i.unit}",
            i.made,
            markdown(i.note),
        )
        for i in procedure.bill
    ]
    return _table(("item", "quantity", "made", "note"), rows)


def _appendix(procedure: Procedure) -> Iterator[str]:
    for pour in procedure.pours:
        yield from (f"### Figures of pour {pour.index}: {spaced(pour.layer)}, {markdown(pour.material)}", "")
        yield from (f"![pour {pour.index} in section]({pour.drawing})", "", *_figures(pour.figures), "")
    if procedure.walls:
        yield from ("### Walls", "", "How far the cups stand off the core's axis is the largest error of all:", "")
        yield from (*_figures(procedure.walls, decimals=2), "")
    if procedure.off_grid:
        yield from ("### Edges between two layers", "")
        yield from ("These edges fall between two of the printer's layers; the slicer moves them to the nearest.", "")
        rows = [(spaced(o.piece), o.edge, number(o.height_mm, 3), number(o.moved_mm, 2)) for o in procedure.off_grid]
        yield from (*_table(("piece", "edge", "height as printed, mm", "moved by, mm"), rows), "")
    if procedure.unit_heights:
        yield from ("### Heights of the unit", "", "They are drawn as asked for; whole layers make them:", "")
        made = [(each.what, number(each.asked_mm, 3), number(each.printed_mm, 3)) for each in procedure.unit_heights]
        yield from (*_table(("height", "asked for, mm", "in whole layers, mm"), made), "")


def step_section(moulds: MouldSet, step: Step) -> str:
    """Draw the assembled pour cut along its first cell's tail, as SVG: tools, cured layers, the layer being cast."""
    plan = moulds.plan
    cells = len(plan.layout.cells)
    bodies = [plan.tool(name) for name in step.tools]
    layers = [(i // cells, shape) for i, shape in enumerate(step.earlier)]
    layers += [(step.index - 1, shape) for shape in step.layer]
    bodies += [
        Body(f"layer{i + 1}", "unit", "layer", shape, cast_colour(moulds, i + 1), made="cast") for i, shape in layers
    ]
    bodies += step.inserts
    regions = svg.cut(bodies, moulds.segments, y=plan.layout.cells[0].y)
    labels = {region.name: spaced(region.name) for region in regions}
    return svg.section(_merged(regions), title=f"Pour {step.index}: {spaced(step.name)}", labels=labels, ground="seat")


def _merged(regions: list[svg.Region]) -> list[svg.Region]:
    """Join regions of one name, such as a layer's several cells."""
    merged: dict[str, svg.Region] = {}
    for region in regions:
        earlier = merged.get(region.name)
        merged[region.name] = replace(region, loops=(*earlier.loops, *region.loops)) if earlier else region
    return list(merged.values())


def _figures(figures: tuple[Figure, ...], decimals: int | None = None) -> list[str]:
    """Write figures as a table, to three digits each, or to so many `decimals` where they are compared."""

    def value(figure: Figure) -> str:
        return number(figure.value, 3) if decimals is None else f"{figure.value:.{decimals}f}"

    rows = [(markdown(f.name), f"{value(f)} {f.unit}", markdown(f.source)) for f in figures]
    return _table(("figure", "value", "source"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]

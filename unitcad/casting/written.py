"""A procedure written out: Markdown for the bench, JSON for programs, CSV for the bill, a drawing a pour."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import msgspec

from unitcad.casting.bill import in_words, to_csv
from unitcad.casting.drawings import cast_colour
from unitcad.casting.figures import Figure
from unitcad.casting.procedure import Procedure
from unitcad.casting.steps import BenchStep, duration
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
    made, cells, written = procedure.makes, procedure.cells, 0
    cavities = f"{cells} cavit{'y' if cells == 1 else 'ies'}"
    if cells > 1 and made != "unit":
        cavities = f"{cells} units in one {made}"
    lines = [f"# Casting {markdown(procedure.name)}", "", f"Mould set {procedure.label}, {cavities}. {UNPRINTED}", ""]

    def section(title: str, body: Iterable[str], level: str = "##") -> None:
        lines.extend((f"{level} {title}", "", *body, ""))

    def steps(title: str, these: Iterable[BenchStep]) -> None:
        nonlocal written
        body = []
        for step in these:
            written += 1
            body.append(f"{written}. **{markdown(step.title)}.** {markdown(step.text)}")
            body += ["", f"   ![{markdown(step.title)}]({step.picture})", ""] if step.picture else []
        section(title, body)

    total, bench = duration(procedure.earliest_finish_min), duration(procedure.bench_min)
    out = "units and sheet out of their moulds" if made == "sheet" else f"{made} out of the mould"
    times = [f"**{total}** from the printed pieces to the {out}, of which {bench} at the bench."]
    if procedure.assembly:
        more = procedure.time_line[-1].end_min - procedure.earliest_finish_min
        waits = sum(step.wait_min for step in procedure.assembly)
        smear = f", of which {duration(waits)} a smear's cure" if waits else ""
        times.append(f"{procedure.last}: {duration(more)} more at most{smear}. Printing comes before.")
    line = [(p.name, *map(duration, (p.start_min, p.bench_min, p.wait_min))) for p in procedure.time_line]
    assumed = "Times at the bench are assumed; cures are the silicones' own, at the room's temperature."
    section("Time", [*times, "", *_table("what", "begins after", "at the bench", "then wait", rows=line), "", assumed])
    bill = [(markdown(i.item), f"{number(i.quantity, 3)} {i.unit}", i.made, markdown(i.note)) for i in procedure.bill]
    section("Needed", _table("item", "quantity", "made", "note", rows=bill))
    section("Print", (f"- {markdown(text)}" for text in procedure.printing))
    steps("Before the first pour", procedure.preparation)
    titles = [f"{pour.index}: {spaced(pour.layer)}, {markdown(pour.material)}" for pour in procedure.pours]
    for title, pour in zip(titles, procedure.pours, strict=True):
        steps(f"Pour {title}", pour.steps)
    steps("Out of the mould", procedure.release)
    if procedure.assembly:
        steps(procedure.last, procedure.assembly)
    section("Measure on the first part", (f"- {markdown(text)}" for text in procedure.measure))
    saves = "bench.html (unitcad report) takes down what was weighed and measured, and saves it as a cast record."
    lines += [saves, "", "## Appendix: figures and sources", ""]
    for title, pour in zip(titles, procedure.pours, strict=True):
        drawing = f"![pour {pour.index} in section]({pour.drawing})"
        section(f"Figures of pour {title}", [drawing, "", *_figures(pour.figures)], "###")
    if procedure.walls:
        worst = "How far the cups stand off the core's axis is the largest error of all:"
        section("Walls", [worst, "", *_figures(procedure.walls, decimals=2)], "###")
    if procedure.off_grid:
        moves = "These edges fall between two of the printer's layers; the slicer moves them to the nearest."
        edges = [(spaced(o.piece), o.edge, number(o.height_mm, 3), number(o.moved_mm, 2)) for o in procedure.off_grid]
        table = _table("piece", "edge", "height as printed, mm", "moved by, mm", rows=edges)
        section("Edges between two layers", [moves, "", *table], "###")
    if procedure.unit_heights:
        heights = [(each.what, number(each.asked_mm, 3), number(each.printed_mm, 3)) for each in procedure.unit_heights]
        table = _table("height", "asked for, mm", "in whole layers, mm", rows=heights)
        section("Heights of the unit", ["They are drawn as asked for; whole layers make them:", "", *table], "###")
    return "\n".join(lines) + "\n"


def step_section(moulds: MouldSet, step: Step) -> str:
    """Draw the assembled pour cut along its first cell's tail, as SVG: tools, cured layers, the layer being cast."""
    plan, cells = moulds.plan, moulds.plan.layout.cells
    layers = [(i // len(cells) + 1, shape) for i, shape in enumerate(step.earlier)]
    layers += [(step.index, shape) for shape in step.layer]
    bodies = [plan.tool(name) for name in step.tools]
    bodies += [Body(f"layer{i}", "unit", "layer", shape, cast_colour(moulds, i), made="cast") for i, shape in layers]
    regions: dict[str, svg.Region] = {}
    for region in svg.cut([*bodies, *step.inserts], moulds.segments, y=cells[0].y):
        # Regions of one name, such as a layer's several cells, are one.
        loops = regions[region.name].loops if region.name in regions else ()
        regions[region.name] = replace(region, name=spaced(region.name), loops=(*loops, *region.loops))
    return svg.section([*regions.values()], title=f"Pour {step.index}: {spaced(step.name)}", ground="seat")


def _figures(figures: Iterable[Figure], decimals: int | None = None) -> list[str]:
    """Write figures as a table, to three digits each, or to so many `decimals` where they are compared."""
    rows = [
        (
            markdown(f.name),
            f"{number(f.value, 3) if decimals is None else f'{f.value:.{decimals}f}'} {f.unit}",
            markdown(f.source),
        )
        for f in figures
    ]
    return _table("figure", "value", "source", rows=rows)


def _table(*head: str, rows: Iterable[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]

"""A procedure written out: Markdown for the bench, JSON for programs, CSV for the bill, a drawing a pour."""

from __future__ import annotations

import json
from dataclasses import asdict
from itertools import count

from unitcad.casting.bill import to_csv
from unitcad.casting.figures import Figure
from unitcad.casting.procedure import Pour, Procedure
from unitcad.designs import layer_colour
from unitcad.export import svg
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape.body import Body
from unitcad.text import markdown

UNPRINTED = "Nothing of this tooling has been printed yet: every clearance is a choice with a check behind it."


def files(found: Procedure) -> dict[str, str]:
    """Return casting.md, casting.json and bom.csv."""
    return {"casting.md": to_markdown(found), "casting.json": to_json(found), "bom.csv": to_csv(found.bill)}


def to_json(found: Procedure) -> str:
    """The procedure as JSON: the same records; numbers to nine significant digits."""
    data = json.loads(json.dumps(asdict(found)), parse_float=lambda text: float(f"{float(text):.9g}"))
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def to_markdown(found: Procedure) -> str:
    """The procedure for the bench: numbered steps that run through, tables of figures with their sources."""
    number = count(1)

    def steps(texts: tuple[str, ...]) -> list[str]:
        return [f"{next(number)}. {markdown(text)}" for text in texts]

    cavities = f"{found.cells} cavit{'y' if found.cells == 1 else 'ies'}"
    lines = [f"# Casting {markdown(found.name)}", "", f"Mould set {found.label}, {cavities}. {UNPRINTED}", ""]
    lines += ["## Before the first pour", "", *steps(found.preparation), ""]
    if found.off_grid:
        lines += ["These edges fall between two of the printer's layers; the slicer moves them to the nearest:", ""]
        lines += ["| piece | edge | height as printed, mm | nearest layer, mm |", "| --- | --- | --- | --- |"]
        lines += [f"| {o.piece} | {o.edge} | {o.height_mm:g} | {o.nearest_mm:g} |" for o in found.off_grid] + [""]
    for pour in found.pours:
        lines += _pour(pour, steps(pour.steps))
    lines += ["## Out of the mould", "", *steps(found.release), ""]
    lines += ["## Motor in", "", *steps(found.assembly), ""]
    lines += ["## Measure on the first part", "", *(f"- {markdown(text)}" for text in found.measure), ""]
    lines += ["The cups' play on the plinth is the largest error of all:", "", *_table(found.walls), ""]
    lines += ["## Needed", "", "| item | quantity | made | note |", "| --- | --- | --- | --- |"]
    bill = [(markdown(i.item), f"{i.quantity:.4g} {i.unit}", i.made, markdown(i.note)) for i in found.bill]
    lines += [f"| {' | '.join(row)} |" for row in bill]
    return "\n".join(lines) + "\n"


def step_section(moulds: MouldSet, step: Step) -> str:
    """Draw the assembled pour cut along its first cell's tail, as SVG: tools, cured layers, the layer being cast."""
    plan = moulds.plan
    cells = len(plan.layout.cells)
    bodies = [plan.tool(name) for name in step.tools]
    layers = [(i // cells, shape) for i, shape in enumerate(step.earlier)]
    layers += [(step.index - 1, shape) for shape in step.layer]
    bodies += [Body(f"layer{i + 1}", "unit", "layer", shape, layer_colour(i), made="cast") for i, shape in layers]
    regions = svg.cut(bodies, moulds.segments, y=plan.layout.cells[0].y)
    labels = {region.name: _spaced(region.name) for region in regions}
    return svg.section(_once(regions), title=f"Pour {step.index}: {_spaced(step.name)}", labels=labels, ground="seat")


def _once(regions: list[svg.Region]) -> list[svg.Region]:
    """Layers of several cells that share a name, as one region each."""
    found: dict[str, svg.Region] = {}
    for region in regions:
        loops = (*(found[region.name].loops if region.name in found else ()), *region.loops)
        found[region.name] = svg.Region(region.name, region.colour, loops)
    return list(found.values())


def _spaced(name: str) -> str:
    """ "cup1" as "cup 1"."""
    return name.rstrip("0123456789") + (f" {digits}" if (digits := name[len(name.rstrip("0123456789")) :]) else "")


def _pour(pour: Pour, steps: list[str]) -> list[str]:
    head = f"## Pour {pour.index}: {_spaced(pour.layer)}, {markdown(pour.material)}"
    return [head, "", f"![pour {pour.index}]({pour.drawing})", "", *_table(pour.figures), "", *steps, ""]


def _table(figures: tuple[Figure, ...]) -> list[str]:
    rows = [f"| {markdown(f.name)} | {f.value:.4g} {f.unit} | {markdown(f.source)} |" for f in figures]
    return ["| figure | value | source |", "| --- | --- | --- |", *rows]

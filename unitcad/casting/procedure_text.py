"""A procedure as text: Markdown for the bench, JSON for programs, CSV for the bill, a drawing a pour."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

import msgspec

from unitcad.casting.bill import Item, group_bill, in_words, plural, to_csv
from unitcad.casting.drawings import cast_colour
from unitcad.casting.preparation import MEASURED_MM
from unitcad.casting.procedure import Procedure
from unitcad.casting.steps import BenchStep, Phase, duration, number_steps
from unitcad.casting.troubles import TROUBLES, troubles_markdown
from unitcad.designs.printed import OVER_ALL
from unitcad.export import svg
from unitcad.json_text import rounded_json
from unitcad.moulds.heights import NEAR
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape.tree import Body
from unitcad.text import join_words, markdown, number, spaced

UNPRINTED = "Nobody has printed this tooling yet."


def files(procedure: Procedure) -> dict[str, str]:
    """Return casting.md, casting.json, bom.csv and troubleshooting.md."""
    procedure = _shortened(replace(procedure, bill=in_words(procedure.bill)))
    return {
        "casting.md": to_markdown(procedure),
        "casting.json": to_json(procedure),
        "bom.csv": to_csv(procedure.bill),
        "troubleshooting.md": troubles_markdown(procedure.troubles),
    }


def _shortened(procedure: Procedure) -> Procedure:
    before, after = procedure.preparation, (*procedure.release, *procedure.assembly)
    left = iter(number_steps([*before, *(step for pour in procedure.pours for step in pour.steps), *after]))

    def next_of(steps: Sequence[BenchStep]) -> tuple[BenchStep, ...]:
        return tuple(islice(left, len(steps)))

    return replace(
        procedure,
        preparation=next_of(before),
        pours=tuple(replace(pour, steps=next_of(pour.steps)) for pour in procedure.pours),
        release=next_of(procedure.release),
        assembly=next_of(procedure.assembly),
    )


def to_json(procedure: Procedure) -> str:
    """Write the procedure as JSON: the same records; numbers to nine significant digits."""
    return rounded_json(msgspec.to_builtins(procedure))


def to_markdown(procedure: Procedure) -> str:
    """Write the procedure for the bench: items to measure, print and have, numbered steps, figures behind a fold."""
    made, cells, printing, written = procedure.makes, procedure.cells, procedure.printing, 0
    cavities = f"{cells} cavit{'y' if cells == 1 else 'ies'}"
    if cells > 1 and made != "unit":
        cavities = f"{cells} units in one {made}"
    lines = [f"# Casting {markdown(procedure.name)}", "", f"Mould set {procedure.label}, {cavities}. {UNPRINTED}", ""]
    lines += [f"> **Warning:** {markdown(text)}.\n" for text in procedure.warnings]

    def section(title: str, body: Iterable[str], level: str = "##") -> None:
        lines.extend((f"{level} {title}", "", *body, ""))

    def steps(title: str, these: Iterable[BenchStep]) -> None:
        nonlocal written
        body, shown = list[str](), ""
        for step in these:
            written += 1
            name, text = markdown(step.title), markdown(step.short or step.text)
            begun = text.startswith(f"{name} ")
            body.append(
                f"{written}. **{name}**{text.removeprefix(name)}" if begun else f"{written}. **{name}.** {text}"
            )
            body += ["", f"   ![{written}]({step.picture})", ""] if step.picture not in ("", shown) else []
            shown = step.picture
        section(title, body)

    total, bench = duration(procedure.earliest_finish_min), duration(procedure.bench_min)
    out = "units and sheet are out of their moulds" if made == "sheet" else f"{made} is out of the mould"
    lines.append(f"The {out} **{total}** after the print. You work {bench} of it at the bench (assumed).")
    lines.append(f"For faults see {TROUBLES}.\n")
    lines += [*_stretches(procedure.time_line), ""]
    if printing.sizes:
        section("0. Measure first", _measuring(procedure))
    section("Print", (f"- {markdown(text)}" for text in printing.how))
    for group, items in group_bill(procedure.bill).items():
        if group == "print":
            continue  # the plate's line names the pieces
        section("Have ready" if group == "have" else group.capitalize(), _listed_items(items))
    steps("Before the first pour", procedure.preparation)
    titles = [f"{pour.index}: {spaced(pour.layer)}, {markdown(pour.material)}" for pour in procedure.pours]
    for title, pour in zip(titles, procedure.pours, strict=True):
        steps(f"Pour {title}", pour.steps)
    steps("Out of the mould", procedure.release)
    if procedure.assembly:
        steps(procedure.last, procedure.assembly)
    section("Measure on the first part", (f"- {markdown(text)}" for text in procedure.measure))
    lines += ["bench.html saves your figures as a cast record.", "", *_appendix(procedure)]
    return "\n".join(lines) + "\n"


def _measuring(procedure: Procedure) -> Iterator[str]:
    """Yield the measures to take before printing, and how to build again with other sizes."""
    printing = procedure.printing
    for size in printing.sizes:
        how, _, more = size.assumed.partition("; ")
        told = f" (assumed; {how}){f'. {more[0].upper()}{more[1:]}.' if more else ''}" if how else ""
        yield f"- {size.what}: {number(size.value_mm, 3)} mm{told}"
    differ = f"If calipers differ by more than {number(MEASURED_MM, 2)} mm"
    yield f"\n{differ}, build again with your figures."
    sets = " ".join(f"--set {key}={number(size.value_mm, 3)}" for size in printing.sizes for key in size.keys)
    yield f"\n```sh\nunitcad build {printing.source} {sets}\n```"


def _listed_items(items: Iterable[Item]) -> Iterator[str]:
    """Yield a line for each item with its note, silicones with both parts in one; one line for all without a note."""
    plain, parts = list[str](), dict[str, list[str]]()
    for item in items:
        several = item.quantity != 1 and not item.unit.startswith(("strip", "pair"))
        name, much = markdown(plural(item.item) if several else item.item), number(item.quantity, 3)
        silicone, part, letter = name.partition(" part ")
        if part:
            parts.setdefault(silicone, []).append(f"{much} g of part {letter}")
            continue
        unit = f" {item.unit} of" if item.unit.startswith(("strip", "pair")) else ""
        counted = f"{much}{unit} {name}" if unit or item.quantity != 1 else name
        if item.note:
            yield f"- {counted}: {markdown(item.note)}"
        else:
            plain.append(counted)
    for silicone, each in parts.items():
        equal = len(each) == 2 and each[0][:-1] == each[1][:-1]
        yield f"- silicone {silicone}: {f'{each[0]} and as much of B' if equal else join_words(each)}"
    if plain:
        yield f"- {join_words(plain)}"


def _stretches(line: Sequence[Phase]) -> Iterator[str]:
    """Yield a line for each stretch of work: its start, its phases, its length; the wait after the last."""
    names, begins, bench = list[str](), 0.0, 0.0
    for i, phase in enumerate(line, 1):
        begins = begins if names else phase.start_min
        # The end of a stage that began before a cure needs no name if another stage follows.
        names = [*(name for name in names if ": " not in name), phase.name]
        bench += phase.bench_min
        if phase.wait_min or i == len(line) or line[i].start_min > phase.end_min + 1e-6:
            wait = f", then wait {duration(phase.wait_min)}" if phase.wait_min and i == len(line) else ""
            yield f"- at {duration(begins)}: {', '.join(names)} ({duration(bench)}){wait}"
            names, bench = [], 0.0


def _appendix(procedure: Procedure) -> Iterator[str]:
    """Yield the drawings of the pours, and the heights that whole layers change, behind a fold."""
    yield from ("<details>", "<summary>Drawings</summary>", "")
    sections = (f"![pour {pour.index}]({pour.drawing})" for pour in procedure.pours)
    yield from (" ".join(sections), "")
    # The height over all is among the measures.
    near = NEAR * procedure.printing.layer_mm
    inside = [each for each in procedure.unit_heights if abs(each.asked_mm - each.printed_mm) > near]
    inside = [each for each in inside if each.what != OVER_ALL]
    heights = (f"{h.what} {number(h.printed_mm, 3)} for {number(h.asked_mm, 3)}" for h in inside)
    if inside:
        yield f"- heights in whole layers, mm: {', '.join(heights)}"
    yield from ("", "All figures and their sources: casting.json.", "", "</details>")


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

"""unitcad phantom: procedure and sheet for the bench, printable pieces, tissue entry, expected response."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import typer

from unitcad import files
from unitcad.attenuation.edge.estimates import rounded
from unitcad.casting.bill import Item, to_csv
from unitcad.casting.figures import DATASHEET_C, MIXING_MIN, POURING_MIN, at_room
from unitcad.catalogue import printers
from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson, Out
from unitcad.export import printing, svg
from unitcad.export.chart import Series, chart
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, realise
from unitcad.lab.phantom import (
    SEGMENTS,
    THINNER_MM,
    PhantomSet,
    load_phantom,
    phantom_set,
    printed_pieces,
    stiffening,
    tissue_table,
)
from unitcad.meshcheck import Options, check_file
from unitcad.text import markdown, toml, toml_key

NEAR_LAYER = 0.02
"""A height this much of a printed layer off the grid counts as on it."""
EDGE_MM = 10.0
"""Nothing is measured nearer to the walls than this: the silicone climbs there."""


@dataclass(frozen=True)
class PhantomPour:
    """One pour: grams of part A, part B and thinner to weigh, and the layer's own weight.

    `grams_per_mm`: of the layer in the box, which tells its thickness by the scale. `frame_mm`: height that the frame
    (or, for the first pour, the tray's rim above the plate) gives.
    """

    index: int
    layer: int
    name: str
    part_a_g: float
    part_b_g: float
    thinner_g: float
    box_g: float
    grams_per_mm: float
    frame_mm: float
    cure_h: float
    pot_life_min: float
    print_layer_mm: float
    off_grid: bool


def pours(phantom: PhantomSet) -> list[PhantomPour]:
    """Return the pours in their order, the lowest layer first."""
    found, table = [], phantom.table
    for index, i in enumerate(reversed(range(len(table.layers))), 1):
        layer, one = table.layers[i], phantom.recipes[i]
        box = phantom.volumes_mm3[i] * one.density_g_cm3 / 1e3
        total = box * (1 + table.waste)
        silicone = total * 100.0 / (100.0 + one.thinner_pct)
        share = float(one.silicone.mix_ratio) / (1 + float(one.silicone.mix_ratio))
        height = float(phantom.printer.layer_mm)
        heights = layer.thickness_mm / height
        fitted = layer.thickness_mm / math.ceil(heights - NEAR_LAYER)
        found.append(
            PhantomPour(
                index,
                i,
                layer.name,
                silicone * share,
                silicone * (1 - share),
                total - silicone,
                box,
                box / layer.thickness_mm,
                layer.thickness_mm,
                at_room(float(one.silicone.cure_h), table.room_c),
                at_room(float(one.silicone.pot_life_min), table.room_c),
                fitted,
                abs(heights - round(heights)) > NEAR_LAYER and i < len(table.layers) - 1,
            )
        )
    return found


def casting_markdown(phantom: PhantomSet) -> str:
    """Write the procedure for the bench."""
    table, number = phantom.table, count(1)

    def steps(texts: Iterator[str]) -> list[str]:
        return [f"{next(number)}. {text}" for text in texts]

    lines = [
        f"# Casting the phantom {markdown(table.name)}",
        "",
        "Nothing of this tooling has been printed yet: every clearance is a choice with a check behind it. The phantom "
        "is repeatable, not skin-like: read [what to expect](#what-to-expect) first.",
        "",
        "## Recipe",
        "",
        "| layer, from the skin down | silicone | thinner to 100 of A + B | E, kPa | thickness, mm |",
        "| --- | --- | --- | --- | --- |",
    ]
    for layer, one in zip(table.layers, phantom.recipes, strict=True):
        lines.append(
            f"| {layer.name} | {one.silicone.name} | {one.thinner_pct:g} | {one.modulus_kpa:.3g} ({one.low_kpa:.3g} "
            f"to {one.high_kpa:.3g}) | {layer.thickness_mm:g} |"
        )
    lines += ["", *_moduli(phantom), "", "## Before the first pour", "", *steps(_preparation(phantom)), ""]
    for pour in pours(phantom):
        lines += [f"## Pour {pour.index}: {pour.name}, {phantom.recipes[pour.layer].silicone.name}", ""]
        lines += ["| figure | value | source |", "| --- | --- | --- |"]
        lines += [f"| {' | '.join(row)} |" for row in _figures(phantom, pour)]
        lines += ["", *steps(_pour(phantom, pour)), ""]
    lines += ["## Marks, and out of the box", "", *steps(_release(phantom)), ""]
    lines += ["## What to expect", "", *_expectations(phantom), ""]
    lines += ["## Buy and have ready", "", "| item | quantity | made | note |", "| --- | --- | --- | --- |"]
    lines += [f"| {i.item} | {i.quantity:.4g} {i.unit} | {i.made} | {markdown(i.note)} |" for i in bill(phantom)]
    return "\n".join(lines) + "\n"


def sheet_markdown(phantom: PhantomSet) -> str:
    """Write the sheet to fill in, a row a pour, so that two labs' phantoms can be compared."""
    lines = [
        f"# Bench sheet: phantom {markdown(phantom.table.name)}",
        "",
        "Date:                    Made by:                    Room, degC:",
        "",
    ]
    lines += [
        "| pour | layer | lot A / lot B | A, g (wanted) | B, g (wanted) | thinner, g (wanted) | mixed at | poured "
        "at | box before, g "
        "| box after, g | thickness = difference over |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for p in pours(phantom):
        lines.append(
            f"| {p.index} | {p.name} | | ({p.part_a_g:.1f}) | ({p.part_b_g:.1f}) | ({p.thinner_g:.1f}) | | | | | "
            f"{p.grams_per_mm:.2f} g/mm: |"
        )
    first, *further = pours(phantom)
    lines += [
        "",
        "Frame heights by calliper, mm (wanted): " + ", ".join(f"{p.name} ({p.frame_mm:g})" for p in further)
        if further
        else "Frames: none.",
        f"Tray, rim above the plate by depth gauge, mm (wanted): {first.name} ({first.frame_mm:g})",
        "",
    ]
    return "\n".join(lines)


def bill(phantom: PhantomSet) -> list[Item]:
    """Return the pieces to print, cut, buy and weigh."""
    table, found = phantom.table, pours(phantom)
    rows: list[tuple[str, float, str, str, str]] = [
        (body.name, 1, "piece", f"printed {'upside down' if body.upside_down else 'as drawn'}", phantom.printer.name)
        for body in printed_pieces(phantom.tools)
    ]
    side = 2 * phantom.size.inner - 0.6
    rows.append(("plate", 1, "piece", "cut", f"acrylic, {side:.1f} x {side:.1f} x {table.plate_thickness_mm:g} mm"))
    for name in dict.fromkeys(one.silicone.name for one in phantom.recipes):
        own = [p for p in found if phantom.recipes[p.layer].silicone.name == name]
        rows.append(
            (f"{name} part A", sum(p.part_a_g for p in own), "g", "bought", f"{len(own)} pour{'s' * (len(own) > 1)}")
        )
        rows.append(
            (f"{name} part B", sum(p.part_b_g for p in own), "g", "bought", f"{len(own)} pour{'s' * (len(own) > 1)}")
        )
    rows.append(("silicone thinner", sum(p.thinner_g for p in found), "g", "bought", "of the silicones' maker"))
    rows += [
        ("scale", 1, "piece", "at hand", f"reads {table.scale_resolution_g:g} g"),
        ("level", 1, "piece", "at hand", "0.2 mm over the box's side"),
        ("calliper", 1, "piece", "at hand", "0.02 mm"),
        ("mixing cup and stick", len(found), "piece", "bought", "a set for each pour"),
        ("vacuum chamber and pump", 1, "piece", "at hand", "degasses each mix before it is poured"),
    ]
    bought = dict.fromkeys(("release agent", "petroleum jelly", "talc", "nitrile gloves"), "for all pours") | {
        "tape or clips": "hold the frames down",
        "pen": "marks the skin through the lid",
        "thin blade": "loosens the slab from the wall",
        "emery paper, fine": "roughens the plate",
        "silicone primer": "optional: bonds the lowest layer to the plate, in place of roughening it",
    }
    rows += [(name, 1, "piece", "bought", note) for name, note in bought.items()]
    return [Item(*row) for row in rows]


def _moduli(phantom: PhantomSet) -> Iterator[str]:
    """Return the source of the moduli, the table of thinned silicones, and the effect of the frequency."""
    hertz = phantom.table.frequency_hz
    yield f"Moduli: {phantom.recipes[0].source}. They are quasi-static."
    yield "The range is two standard deviations of that table."
    yield (
        f"The upper end of a range has a factor of {stiffening(hertz):.3g} for {hertz:g} Hz, by the catalogue's "
        "fractional law (assumed to hold with thinner)."
    )


def _preparation(phantom: PhantomSet) -> Iterator[str]:
    table, size, found = phantom.table, phantom.size, pours(phantom)
    yield (
        "Print the pieces in the orientation of their files: the blade edge up, the lid flat. "
        "Uncured resin and latex keep silicone from curing: wash and post-cure resin prints fully, cast a small trial "
        "on each, and wear nitrile gloves."
    )
    for p in found:
        if p.off_grid:
            yield (
                f"Print the frame of the {p.name} in layers of {p.print_layer_mm:.4g} mm: {p.frame_mm:g} mm is no "
                f"whole number of {float(phantom.printer.layer_mm):g} mm layers, and half a layer more or less shows "
                "in the response."
            )
    sensitive = min(phantom.expected.sensitivity.items(), key=lambda pair: -abs(pair[1]))
    yield (
        f"Measure every frame's height at eight places. The {sensitive[0]} {THINNER_MM:g} mm thinner changes the "
        f"response at {max(table.points_mm):g} mm by {100 * sensitive[1]:.2g} %: reprint a frame that is more than "
        "0.05 mm off."
    )
    yield (
        f"Cut the acrylic plate, {2 * size.inner - 0.6:.1f} mm square, {table.plate_thickness_mm:g} mm thick. Lay it "
        "into the tray, clean, and seal its edge all round with a thin bead of petroleum jelly; the holes below "
        "stay free."
    )
    yield (
        "Release agent sparingly on the inner walls of tray and frames, none on the plate. Silicone that cures on "
        f"acrylic does not bond to it: the {found[0].name} only clings. Roughen the plate with emery paper, use a "
        "silicone primer on it, or take a perforated one. Check before measuring: pushed sideways with a finger, the "
        "slab must not slip, and through the plate from below no air shows. Level the tray to 0.2 mm over its side."
    )


def _figures(phantom: PhantomSet, p: PhantomPour) -> Iterator[tuple[str, str, str]]:
    one = phantom.recipes[p.layer]
    parts = "computed: volume x density (mixed by weight; thinner 0.97 g/cm3, assumed)"
    yield "in the box", f"{p.box_g:.1f} g", parts
    yield "part A", f"{p.part_a_g:.1f} g", f"with {100 * phantom.table.waste:g} % extra"
    yield "part B", f"{p.part_b_g:.1f} g", f"with {100 * phantom.table.waste:g} % extra"
    yield "thinner", f"{p.thinner_g:.1f} g", f"{one.thinner_pct:g} parts to 100 of A + B, by weight (assumed)"
    yield (
        "pot life",
        f"{p.pot_life_min:.3g} min",
        "without thinner; thinner makes it longer (assumed: half the time for 10 K more)",
    )
    yield (
        "cure",
        f"{p.cure_h:.3g} h",
        f"without thinner, at {phantom.table.room_c:g} degC (data sheet at {DATASHEET_C:g}); thinner: longer",
    )
    yield "weight of a millimetre", f"{p.grams_per_mm:.2f} g", "computed: tells the thickness by the scale"


def _pour(phantom: PhantomSet, p: PhantomPour) -> Iterator[str]:
    one, frame = phantom.recipes[p.layer], f"frame {p.index} ({p.name}, {p.frame_mm:g} mm high)"
    if p.index > 1:
        yield (
            f"When the layer before is firm: trim the film off the rim below, put {frame} on the pegs and press it "
            "down all round. Hold it with tape on the outside or clips at the ears: nothing may be on the rim that "
            "the blade runs on. A thin line of petroleum jelly between the rims keeps it tight; wipe off the excess "
            "out inside. No release agent on the silicone: the layers must bond."
        )
    yield "Weigh the box with its content, and write that down."
    yield (
        f"Weigh {p.part_a_g:.1f} g of {one.silicone.name} part A, {p.part_b_g:.1f} g of part B and {p.thinner_g:.1f} "
        f"g of thinner. Mix for {MIXING_MIN:g} min (assumed), scraping the walls; degas; the pot life runs from now, "
        f"and pouring takes {POURING_MIN:g} min or more."
    )
    rim = "the tray's rim" if p.index == 1 else f"the rim of {frame}"
    yield (
        f"Pour in a thin thread at one corner until the silicone rises above {rim}, and prick the bubbles that rise."
    )
    yield (
        f"Strike off with the blade: along x, its edge on {rim} at both sides, drawn once from one end to the other "
        "along y, between the pegs. Wipe the rims and weigh the box again: the "
        f"difference over {p.grams_per_mm:.2f} g/mm is the thickness; {0.05 * p.grams_per_mm:.2g} g are 0.05 mm. Top "
        "up and strike again if it is low."
    )
    yield (
        "Cure level, covered, until a touch on the overflow is dry. Much thinner stays tacky: talc, after the last "
        "layer."
    )


def _release(phantom: PhantomSet) -> Iterator[str]:
    seat = phantom.table.unit_diameter_mm
    yield (
        f"Talc the skin, put the lid on and mark with a pen: the seat of the unit, a circle of {seat:g} mm whose "
        "notch is the point at 0 mm, and the points at "
        f"{', '.join(f'{d:g}' for d in sorted(phantom.table.points_mm))} mm from its edge. Take the lid off."
    )
    yield "Measure in the box: its walls count in the design. Fix the tray on the table with clamps at its ears."
    yield (
        "To take the slab out: lift the frames off, run a thin wet blade round the wall, and push the plate up "
        "through the four holes of the tray, evenly. The cavity widens upwards. Never pull the silicone: it is "
        "carried on its plate."
    )
    yield (
        "Thinner migrates between layers and out of the skin, so the moduli change with age: write down the age at "
        "each measurement, and compare labs at the same age, such as 7 days (assumed)."
    )
    yield (f"Keep the measured points {EDGE_MM:g} mm or more from the walls. Cut nothing off the skin.")


def _expectations(phantom: PhantomSet) -> Iterator[str]:
    table, e = phantom.table, phantom.expected
    yield (
        f"|u_z| of the skin at {table.frequency_hz:g} Hz over its value at the unit's edge, the motor's disc pressing "
        "evenly, by the layered solver with moduli from quasi-static compression. The range takes loss factors (half "
        "to one and a half times, assumed), moduli (up to the effect of the frequency) and thicknesses each by itself."
    )
    yield ""
    yield "| mm from the edge | expected | low | high | the forearm template |"
    yield "| --- | --- | --- | --- | --- |"
    for row in zip(e.distances_mm, e.value, e.low, e.high, e.forearm, strict=True):
        yield f"| {row[0]:g} | {row[1]:.3f} | {row[2]:.3f} | {row[3]:.3f} | {row[4]:.3f} |"
    yield ""
    for name, change in e.sensitivity.items():
        yield f"- {name} {THINNER_MM:g} mm thinner: {100 * change:+.2g} % at {e.distances_mm[-1]:g} mm"
    yield ""
    yield (
        "It is repeatable, not skin-like: silicone decays too little, and the curve is off the forearm template's "
        f"by a factor of {e.factor:.2g} on average. Two labs compare their chains on it, not their skins."
    )
    yield ""
    yield (
        f"A wall sends back {e.echo_pct:.2g} % at {e.distances_mm[-1]:g} mm at most: {phantom.inside_mm / 2:g} mm "
        f"from the unit's centre, and {e.wall_mm:g} mm would give {table.most_echo_pct:g} % (a mirror's estimate)."
    )


FINISHED = "casting.md"
"""The file that is put in place last: a folder that has it is whole."""


def contents(phantom: PhantomSet, stage: Callable[[str], None] = lambda name: None) -> dict[str, bytes]:
    """Return the files of a phantom's folder by their names, the pieces as STL and one 3MF."""
    found: dict[str, bytes] = {}
    parts = []
    for body in printed_pieces(phantom.tools):
        stage(body.name)
        ready = print_ready(*arrays(realise(body.shape, SEGMENTS)), body.upside_down)
        found[f"moulds/{body.name}.stl"] = printing.stl(*ready, body.name)
        parts.append(printing.MeshPart(body.name, body.colour, *ready))
    bed = float(phantom.printer.bed_x_mm), float(phantom.printer.bed_y_mm)
    found["moulds/moulds.3mf"] = printing.content(parts, bed)
    stage("pages")
    # The box filled, cut through the pegs of one side and, of the lid, nothing: frames, layers and plate.
    shown = [body for body in phantom.tools if body.kind in ("base", "frame") or body.made == "cut"]
    regions = svg.cut([*shown, *phantom.layers], SEGMENTS)
    texts = {
        "section.svg": svg.section(regions, title=f"Phantom {phantom.table.name}: box and layers", ground=""),
        "response.svg": _response_chart(phantom),
        "response.json": json.dumps(rounded(asdict(phantom.expected)), indent=1, allow_nan=False) + "\n",
        "tissue.toml": tissue_toml(phantom),
        "casting.json": json.dumps(rounded(casting_data(phantom)), indent=1, allow_nan=False, ensure_ascii=False)
        + "\n",
        "bom.csv": to_csv(tuple(bill(phantom))),
        "sheet.md": sheet_markdown(phantom),
        FINISHED: casting_markdown(phantom),
    }
    return {**found, **{name: text.encode() for name, text in texts.items()}}


def tissue_toml(phantom: PhantomSet) -> str:
    """Return [tissue.NAME] for a spec, which chooses it by estimate.tissue."""
    name = toml_key(f"phantom-{phantom.table.name}")
    lines = [
        "# For a spec: paste it there, and choose it:",
        "# [estimate]",
        f'# tissue = "phantom-{phantom.table.name}"',
    ]
    for layer, table in tissue_table(phantom).items():
        lines += ["", f"[tissue.{name}.{toml_key(layer)}]", *(f"{key} = {toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


_RECIPE = ("thinner_pct", "modulus_kpa", "low_kpa", "high_kpa", "density_g_cm3", "source")


def casting_data(phantom: PhantomSet) -> dict[str, Any]:
    """Return recipe, pours and lengths as JSON-ready data."""
    return {
        "name": phantom.table.name,
        "inside_mm": phantom.inside_mm,
        "printer": phantom.printer.name,
        "pours": [asdict(pour) for pour in pours(phantom)],
        "recipes": [
            {
                "layer": layer.name,
                "silicone": one.silicone.name,
                **{key: getattr(one, key) for key in _RECIPE},
                "loss_factor": list(one.loss),
            }
            for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True)
        ],
        "bill": [asdict(item) for item in bill(phantom)],
    }


def write(folder: Path, found: Mapping[str, bytes], printer: str) -> list[str]:
    """Write the files into a folder, then check the meshes there; return the findings that are errors, as lines.

    All are written under another name first; the procedure is put in place last. Raises OSError if that fails.
    """
    files.replace_all(folder, found, FINISHED)
    meshes = sorted(str(folder / name) for name in found if name.endswith((".stl", ".3mf")))
    options = Options(printer=printers()[printer])
    return [
        f"{Path(path).name}: {finding.code} {finding.message}"
        for path in meshes
        for finding in check_file(path, options).findings
        if finding.severity == "error"
    ]


def _response_chart(phantom: PhantomSet) -> str:
    e = phantom.expected
    series = [
        Series("expected", e.distances_mm, e.value),
        Series("low", e.distances_mm, e.low, dashed=True),
        Series("high", e.distances_mm, e.high, dashed=True),
        Series("the forearm template", e.distances_mm, e.forearm),
    ]
    title = (
        f"Phantom {phantom.table.name} at {phantom.table.frequency_hz:g} Hz: |u_z| over its value at the unit's edge"
    )
    return chart(series, title, "distance from the unit's edge, mm", "|u_z| / |u_z| at the edge", log_y=True)


def phantom(
    source: Annotated[
        str, typer.Argument(metavar="[PHANTOM]", help="Phantom file, or name of a shipped one (unitcad list phantoms).")
    ] = "skin",
    out: Out = Path("out"),
    as_json: AsJson = False,
) -> None:
    """Make a skin phantom to cast, and its response.

    Recipe, box with a screed frame a layer, lid, procedure, bench sheet, the tissue for
    an estimate, and the response to expect. The last line printed is the folder.
    """

    table = load_phantom(source)
    with progress("phantom") as stage:
        stage("response")
        made = phantom_set(table)
        found = contents(made, stage)
        stage("checks")
        folder = out / f"phantom-{table.name}"
        faults = write(folder, found, made.printer.name)
    if as_json:
        print_json(
            {
                "folder": str(folder),
                "findings": faults,
                "response": asdict(made.expected),
                **casting_data(made),
            }
        )
    else:
        off = f"{made.expected.factor:.2g}"
        typer.echo(f"repeatable, not skin-like: its response is off the forearm template by a factor of {off}")
        typer.echo(str(folder))
    for fault in faults:
        warn(f"finding: {fault}")
    if faults:
        raise typer.Exit(1)
